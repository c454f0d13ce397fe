from __future__ import annotations

import numpy as np
from crane_rooms import crane_room
from hypothesis import given, settings
from hypothesis import strategies as st

from bimvox.grid.summed_area import summed_area_table
from bimvox.planning.search import all_free, shortest_path, which_free
from bimvox.planning.shorten_path import shortest_of_visited, straightened, widened, with_room
from bimvox.site.collision import NOTHING_CLEARED, CollisionSpace, placement_is_free


@settings(max_examples=60, deadline=None)
@given(st.lists(st.integers(0, 5), min_size=0, max_size=60))
def test_the_path_over_visited_cells_is_the_shortest(actions):
    import networkx

    from bimvox.env.actions import MOVES

    walk = np.concatenate([np.zeros((1, 3), np.int32), MOVES[actions].reshape(-1, 3)]).cumsum(axis=0).astype(np.int32)
    short = shortest_of_visited(walk)
    cells = [tuple(cell) for cell in walk.tolist()]
    graph = networkx.Graph()
    graph.add_nodes_from(cells)
    graph.add_edges_from((a, b) for a in cells for b in cells if np.abs(np.subtract(a, b)).sum() == 1)
    assert len(short) == networkx.shortest_path_length(graph, cells[0], cells[-1]) + 1
    assert (np.abs(np.diff(short, axis=0)).sum(axis=1) == 1).all()
    np.testing.assert_array_equal(short[[0, -1]], walk[[0, -1]])
    assert {tuple(c) for c in short.tolist()} <= set(cells)


def corners_of(path):
    steps = np.diff(path, axis=0)
    return int((steps[1:] != steps[:-1]).any(axis=1).sum())


def test_stairs_become_three_legs():
    room = crane_room(2, blocks=0, rope=False)
    stairs = np.array([[3 + (n + 2) // 3, 3 + (n + 1) // 3, 2 + n // 3] for n in range(30)], np.int32)
    short = straightened(room.space, stairs)
    assert corners_of(stairs) == 28
    assert corners_of(short) == 2
    assert len(short) == len(stairs)
    np.testing.assert_array_equal(short[[0, -1]], stairs[[0, -1]])


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 200))
def test_a_straightened_path_is_free_and_has_fewer_moves_or_corners(seed):
    room = crane_room(seed)
    short = straightened(room.space, room.path)
    assert all(placement_is_free(room.space, *cell) for cell in short)
    assert (np.abs(np.diff(short, axis=0)).sum(axis=1) == 1).all()
    np.testing.assert_array_equal(short[[0, -1]], room.path[[0, -1]])
    assert (len(short), corners_of(short)) <= (len(room.path), corners_of(room.path))
    np.testing.assert_array_equal(straightened(room.space, short), short)


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
