import numpy as np
import pytest
from box_sites import box_mesh
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from bimvox.planning.contact.sweep import blocked_steps

manifold3d = pytest.importorskip("manifold3d")
unit = st.floats(-1.0, 1.0)


def solid(triangles):
    """Return the convex hull of the triangles, which in these tests is the solid itself."""
    return manifold3d.Manifold.hull_points(np.unique(triangles.reshape(-1, 3), axis=0).astype(np.float32))


def turned_box(size, angles, centre):
    mesh = box_mesh(-np.array(size) / 2, np.array(size) / 2)
    a, b, c = angles
    turn = (
        np.array([[np.cos(a), -np.sin(a), 0], [np.sin(a), np.cos(a), 0], [0, 0, 1]])
        @ np.array([[1, 0, 0], [0, np.cos(b), -np.sin(b)], [0, np.sin(b), np.cos(b)]])
        @ np.array([[np.cos(c), 0, np.sin(c)], [0, 1, 0], [-np.sin(c), 0, np.cos(c)]])
    )
    return mesh.triangles_m @ turn.T + np.array(centre)


sizes = st.tuples(*[st.floats(0.2, 1.5)] * 3)
angles = st.tuples(*[st.floats(0.0, 3.0)] * 3)


@settings(max_examples=60, deadline=None)
@given(sizes, angles, sizes, angles, st.tuples(unit, unit, unit), st.integers(0, 2), st.sampled_from([1, -1]))
def test_a_move_is_blocked_where_the_solids_overlap(size_a, angles_a, size_b, angles_b, away, axis, direction):
    moving = turned_box(size_a, angles_a, (0, 0, 0))
    offset = np.array(away)
    offset[axis] = 0.0
    offset[axis] += direction * 4.0
    fixed = turned_box(size_b, angles_b, offset)
    step, count = 0.25, 32
    blocked = blocked_steps(moving, fixed, axis, direction, step, count)
    one, other = solid(moving), solid(fixed)
    volumes = []
    for k in range(count):
        shift = np.zeros(3)
        shift[axis] = direction * (k + 0.5) * step
        volumes.append((one.translate(tuple(shift)) ^ other).volume())
    overlapping = np.array(volumes) > 1e-5
    # every overlap is between a first and a last contact
    marked = np.flatnonzero(blocked)
    for k in np.flatnonzero(overlapping):
        assert len(marked)
        assert marked[0] <= k <= marked[-1]
    if not len(marked):
        assert not overlapping.any()


@given(st.floats(0.1, 3.0), st.floats(0.0, 0.9))
def test_two_boxes_meet_exactly_between_first_and_last_touch(gap, sideways):
    moving = box_mesh((0, 0, 0), (1, 1, 1)).triangles_m
    fixed = box_mesh((sideways, sideways, 1 + gap), (sideways + 1, sideways + 1, 2 + gap)).triangles_m
    blocked = blocked_steps(moving, fixed, 2, 1, 0.01, 700)
    assert np.flatnonzero(blocked)[0] == pytest.approx(gap / 0.01, abs=1.01)
    assert np.flatnonzero(blocked)[-1] == pytest.approx((gap + 2.0) / 0.01, abs=1.01)


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("direction", [1, -1])
def test_sliding_along_a_face_is_free(axis, direction):
    moving = box_mesh((0, 0, 0), (1, 1, 1)).triangles_m
    beside = np.zeros(3)
    beside[(axis + 1) % 3] = 1.0
    fixed = box_mesh(tuple(beside), tuple(beside + 1.0)).triangles_m
    assert not blocked_steps(moving, fixed, axis, direction, 0.5, 8).any()


def test_what_lies_behind_the_move_does_not_count():
    moving = box_mesh((0, 0, 2), (1, 1, 3)).triangles_m
    fixed = box_mesh((0, 0, 0), (1, 1, 1)).triangles_m
    assert not blocked_steps(moving, fixed, 2, 1, 0.5, 10).any()
    assert blocked_steps(moving, fixed, 2, -1, 0.5, 10)[2]
    assert not blocked_steps(moving, fixed, 2, -1, 0.5, 2).any()


@settings(max_examples=50, deadline=None)
@given(sizes, angles, st.tuples(unit, unit))
def test_the_answer_does_not_depend_on_the_axis(size, turn, away):
    moving = turned_box(size, turn, (0, 0, 0))
    fixed = turned_box((1.0, 0.7, 0.4), (0.3, 0.2, 0.1), (away[0], away[1], 3.0))
    up = blocked_steps(moving, fixed, 2, 1, 0.1, 60)
    along_x = blocked_steps(np.roll(moving, 1, axis=2), np.roll(fixed, 1, axis=2), 0, 1, 0.1, 60)
    assume(np.isfinite(moving).all())
    assert np.array_equal(up, along_x)
