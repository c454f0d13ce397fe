import numpy as np
import pytest
from box_sites import box_site

from bimvox.planning.assembly import Assembly
from bimvox.planning.lift_space import LiftSpace, joined, whole_cells
from bimvox.planning.order_search import prepare
from bimvox.site.collision import placement_is_free
from bimvox.site.site import Rules

BLOCK = ("block", (5.0, 4.0, 0.0), (6.0, 5.0, 1.0))
WALL = ("wall", (8.0, 0.0, 0.0), (8.5, 15.0, 6.0))


@pytest.fixture(scope="module")
def transit():
    site = box_site([BLOCK], structure=[WALL], rules=Rules(rope=False))
    return site, Assembly(site, prepare(site)).begin(0).transit


@pytest.fixture(scope="module")
def space(transit):
    site, one = transit
    return LiftSpace(one, site.frame)


def test_what_is_free_is_what_the_engine_says(transit, space):
    _, one = transit
    cells = np.random.default_rng(0).integers(-3, np.array(space.shape) + 3, (2_000, 3))
    inside = ((cells >= 0) & (cells < space.shape)).all(axis=1)
    wanted = [bool(placement_is_free(one.space, *cell)) for cell in cells.tolist()]
    np.testing.assert_array_equal(space.are_free(cells), np.array(wanted) & inside)
    assert [space.is_free(cell) for cell in cells[:200]] == space.are_free(cells[:200]).tolist()
    assert space.is_free(space.start_vox)
    assert space.is_free(space.goal_vox)
    assert 0 < space.free.mean() < 1
    with pytest.raises(ValueError, match="read-only"):
        space.free[0, 0, 0] = True


def test_the_distance_is_to_the_nearest_placement_that_is_not_free(space):
    blocked = np.argwhere(~np.pad(space.free, 1)) - 1
    cells = np.argwhere(space.free)[::397]
    nearest = [np.sqrt(((blocked - cell) ** 2).sum(axis=1).min()) for cell in cells]
    np.testing.assert_allclose(space.distance_m(cells), space.cell_m * np.array(nearest))
    assert space.distance_m([(-5, 0, 0), (10**9, 0, 0)]).tolist() == [0.0, 0.0]
    assert space.distance_m(cells).min() >= space.cell_m


def test_obstacles_bounds_and_part_are_in_metres(transit, space):
    site, _ = transit
    low, high = space.bounds_m
    np.testing.assert_allclose(high - low, space.cell_m * np.array(space.shape))
    boxes = space.obstacles_m
    volume = np.prod(boxes[:, 3:] - boxes[:, :3], axis=1).sum()
    wall = np.prod(np.subtract(WALL[2], WALL[1]))
    assert volume == pytest.approx(wall + 40 * 30 * 0.5**3)  # the ground has one layer
    assert any(box[:3].tolist() == [8.0, 0.0, 0.0] for box in boxes)
    assert (space.part, space.part_size_m.tolist()) == ("block", [1.0, 1.0, 1.0])
    cell = site.components[0].target_vox
    np.testing.assert_allclose(space.metres_of([cell]), [BLOCK[1]])
    assert space.cells_of([np.array(BLOCK[1]) + 0.1]).tolist() == [list(cell)]


def test_waypoints_are_joined_by_unit_moves_near_the_straight_line(space):
    line = space.line((1, 2, 3), (7, 0, 3))
    assert (line[0].tolist(), line[-1].tolist()) == ([1, 2, 3], [7, 0, 3])
    assert (np.abs(np.diff(line, axis=0)).sum(axis=1) == 1).all()
    x, y = (line[:, :2] - line[0, :2]).T
    off = np.abs(6 * y + 2 * x) / np.hypot(6, 2)
    assert off.max() <= 1.0
    ends = np.random.default_rng(1).integers(0, 12, (50, 2, 3))
    for a, b in ends:
        np.testing.assert_array_equal(space.line(a, b), space.line(b, a)[::-1])
    path = joined(whole_cells([(0, 0, 0), (0, 0, 0), (0, 2, 0), (0, 2, 1)]))
    assert path.tolist() == [[0, 0, 0], [0, 1, 0], [0, 2, 0], [0, 2, 1]]
    assert joined(whole_cells([(4, 5, 6)])).tolist() == [[4, 5, 6]]
    assert whole_cells([(1.4, 2.6, -0.2)]).tolist() == [[1, 3, 0]]


@pytest.mark.parametrize(
    "cells", [5, "abc", [(1, 2)], [(1, 2, np.nan)], [None], [[10**30, 0, 0]], np.zeros((2, 3), bool)]
)
def test_what_is_no_list_of_cells_is_refused(space, cells):
    with pytest.raises(ValueError, match=r"not \(N, 3\) numbers|NaN"):
        space.are_free(cells)
