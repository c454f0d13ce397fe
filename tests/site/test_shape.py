import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bimvox.site.component import (
    StoredPose,
    erection_size_vox,
    shape_of,
    stored_shape,
    turned_aside,
    turned_hook,
    turned_shape,
    turning_columns,
)

cells = st.lists(
    st.tuples(st.integers(-3, 3), st.integers(-3, 3), st.integers(-3, 3)), min_size=1, max_size=20, unique=True
)
lying = st.sampled_from([StoredPose.LYING_X, StoredPose.LYING_Y])


def as_set(shape):
    return {tuple(cell) for cell in shape.cells.tolist()}


@given(cells)
@settings(deadline=None)
def test_shape_keeps_cells_and_reference_is_the_lowest_corner(some):
    shape, reference = shape_of(some)
    assert {tuple(np.add(cell, reference)) for cell in shape.cells.tolist()} == set(some)
    assert shape.cells.min(axis=0).tolist() == [0, 0, 0]
    assert shape.size_vox == tuple((shape.cells.max(axis=0) + 1).tolist())
    filled = [
        (x, y, z)
        for x0, y0, z0, x1, y1, z1 in shape.boxes.tolist()
        for x in range(x0, x1)
        for y in range(y0, y1)
        for z in range(z0, z1)
    ]
    assert len(filled) == len(set(filled)) == len(some)
    assert set(filled) == as_set(shape)


@given(cells, lying)
@settings(deadline=None)
def test_a_lying_shape_is_the_same_shape_turned_with_its_foot_at_the_low_end(some, pose):
    shape, _ = shape_of(some)
    turned = stored_shape(shape, pose)
    axis = 0 if pose is StoredPose.LYING_X else 1
    assert len(turned.cells) == len(shape.cells)
    assert turned.size_vox[axis] == shape.size_vox[2]
    assert turned.size_vox[2] == shape.size_vox[axis]
    # A layer at height z in the building is z cells from the low end: the foot is at the lowest index.
    for z in range(shape.size_vox[2]):
        assert (shape.cells[:, 2] == z).sum() == (turned.cells[:, axis] == z).sum()


@given(cells)
@settings(deadline=None)
def test_as_built_is_left_alone(some):
    shape, _ = shape_of(some)
    assert stored_shape(shape, StoredPose.AS_BUILT) is shape


@given(cells, st.sampled_from(list(StoredPose)))
@settings(deadline=None)
def test_the_erection_box_contains_the_stored_and_the_raised_upright_pose(some, pose):
    shape, _ = shape_of(some)
    box = np.array(erection_size_vox(shape, pose))
    assert (np.array(stored_shape(shape, pose).size_vox) <= box).all()
    assert (np.add(shape.size_vox, [0, 0, 1]) <= box).all()


@pytest.mark.parametrize("pose", [StoredPose.LYING_X, StoredPose.LYING_Y])
def test_the_erection_box_contains_every_angle_between(pose):
    length, width = 7, 3
    shape, _ = shape_of(np.argwhere(np.ones((width, width, length), bool)))
    reach_x, reach_y, reach_z = erection_size_vox(shape, pose)
    reach = reach_x if pose is StoredPose.LYING_X else reach_y
    for angle in np.linspace(0.0, np.pi / 2, 50):
        corners = np.array([[0, 0], [length, 0], [0, width], [length, width]]) @ np.array(
            [[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]]
        )
        extent = np.ptp(corners, axis=0)
        assert extent[0] <= reach
        assert extent[1] <= reach_z


def test_the_papers_column():
    column, reference = shape_of([(7, 7, z) for z in range(1, 5)])
    assert reference == (7, 7, 1)
    assert stored_shape(column, StoredPose.LYING_X).size_vox == (4, 1, 1)
    assert stored_shape(column, StoredPose.LYING_Y).size_vox == (1, 4, 1)
    assert erection_size_vox(column, StoredPose.LYING_X) == (4, 1, 5)


@given(st.integers(0, 3), st.integers(0, 3), st.integers(1, 4), st.integers(1, 4))
def test_turning_by_quarters_keeps_cells_around_the_hook(turn, more, size_x, size_y):
    cells = np.argwhere(np.ones((size_x, size_y, 2), bool))[: size_x * size_y * 2 - 1]
    shape, _ = shape_of(cells)
    hook = (size_x // 2, size_y // 2, 2)
    once, at = turned_shape(shape, turn), turned_hook(shape, hook, turn)
    twice = turned_shape(once, more)
    assert np.array_equal(twice.cells, turned_shape(shape, (turn + more) % 4).cells)
    assert turned_hook(once, at, more) == turned_hook(shape, hook, (turn + more) % 4)
    away = sorted(((shape.cells[:, :2] - hook[:2]) ** 2).sum(axis=1).tolist())
    assert sorted(((once.cells[:, :2] - at[:2]) ** 2).sum(axis=1).tolist()) == away


def test_a_part_turns_within_the_circle_of_its_corners():
    shape, _ = shape_of(np.argwhere(np.ones((9, 1, 1), bool)))
    columns = {tuple(c) for c in turning_columns(shape, (4.0, 0.0, 1.0), 1).tolist()}
    assert {(x, 0) for x in range(9)} <= columns
    assert {(4, y) for y in range(-4, 5)} <= columns
    assert (7, 3) in columns
    assert not {(0, 4), (8, -4)} & columns


def test_a_part_with_its_hook_aside_of_a_cell_is_first_moved_to_where_it_turns():
    shape, _ = shape_of(np.argwhere(np.ones((9, 1, 1), bool)))
    straight = {tuple(c) for c in turning_columns(shape, (4.0, 0.0, 1.0), 1).tolist()}
    columns = {tuple(c) for c in turning_columns(shape, (4.3, -0.2, 1.0), 2).tolist()}
    assert straight < columns
    # Its hook is 0.72 cells away from there as it lies, and its far corner 4.85 cells from its hook.
    assert (10, 0) in columns
    assert not {(11, 0), (4, 8)} & columns
    assert turned_aside((0.3, -0.2), 1) == (0.2, 0.3)
    assert turned_aside((0.3, -0.2), 2) == (-0.3, 0.2)
