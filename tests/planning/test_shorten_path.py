from __future__ import annotations

import numpy as np
from crane_rooms import crane_room
from hypothesis import given, settings
from hypothesis import strategies as st

from bimvox.planning.shorten_path import shortest_of_visited, straightened
from bimvox.site.collision import placement_is_free


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
