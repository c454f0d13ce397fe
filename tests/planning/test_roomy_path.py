import numpy as np

from bimvox.grid.summed_area import summed_area_table
from bimvox.planning.roomy_path import widened, with_room
from bimvox.planning.search import all_free, shortest_path, which_free
from bimvox.site.collision import NOTHING_CLEARED, CollisionSpace

SHAPE = (40, 30, 12)


def rule(occupied):
    """Return the rule for a load of 4 x 2 x 1 cells."""
    boxes = np.array([[0, 0, 0, 4, 2, 1]], np.int32)
    floor = np.zeros(occupied.shape[:2], np.int32)
    return CollisionSpace(summed_area_table(occupied), boxes, np.zeros(3, np.int32), floor, *NOTHING_CLEARED)


def site(gap):
    """Return a site with a wall across it that has a gap, and the ends of a path through the gap."""
    occupied = np.zeros(SHAPE, bool)
    occupied[18:20] = True
    occupied[18:20, gap] = False
    occupied[8:18, 12:14] = True
    return rule(occupied), (4, 4, 2), (32, 4, 2)


def test_a_path_goes_a_cell_away_from_walls():
    space, start, goal = site(slice(20, 27))
    path = shortest_path(space, start, goal).path_vox
    assert not which_free(widened(space), path).all()
    found = with_room(space, path)
    np.testing.assert_array_equal(found[[0, -1]], [start, goal])
    assert (np.abs(np.diff(found, axis=0)).sum(axis=1) == 1).all()
    assert which_free(widened(space), found).all()
    assert len(found) <= len(path) + 4


def test_a_path_through_a_gap_as_wide_as_the_load_has_room_before_and_after_it():
    space, start, goal = site(slice(20, 22))
    found = with_room(space, shortest_path(space, start, goal).path_vox)
    assert all_free(space, found)
    narrow = found[~which_free(widened(space), found)]
    # The load is four cells long, the wall two thick.
    assert narrow[:, 0].min() == 18 - 4
    assert narrow[:, 0].max() == 20
    assert (narrow[:, 1] == 20).all()
    assert len(narrow) == 7


def test_a_path_with_room_is_only_straightened():
    occupied = np.zeros(SHAPE, bool)
    stairs = np.array([[5 + (n + 1) // 2, 5 + n // 2, 4] for n in range(20)], np.int32)
    found = with_room(rule(occupied), stairs)
    assert len(found) == len(stairs)
    assert (np.abs(np.diff(found, 2, axis=0)).sum(axis=1) > 0).sum() == 1
