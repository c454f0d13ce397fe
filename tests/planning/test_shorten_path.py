from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from bimvox.planning.shorten_path import shortest_of_visited


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
