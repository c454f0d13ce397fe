from __future__ import annotations

import itertools

import networkx as nx
import numpy as np
import pytest
from lift_sites import clearance_of, random_occupancy

from bimvox.env.problem import UNREACHABLE, distance_field
from bimvox.site.collision import placement_is_free


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("size", [(1, 1, 1), (2, 1, 2)])
def test_field_is_the_shortest_distance_in_the_graph_of_free_placements(seed, size):
    occupied = random_occupancy(seed, share=0.25)
    space = clearance_of(occupied, size)
    free = {c for c in itertools.product(*(range(n) for n in occupied.shape)) if placement_is_free(space, *c)}
    graph = nx.Graph()
    graph.add_nodes_from(free)
    for cell in free:
        for axis in range(3):
            other = tuple(v + (a == axis) for a, v in enumerate(cell))
            if other in free:
                graph.add_edge(cell, other)
    target = sorted(free)[len(free) // 2]
    lengths = nx.single_source_shortest_path_length(graph, target)
    expected = np.full(occupied.shape, UNREACHABLE)
    for cell, length in lengths.items():
        expected[cell] = length
    np.testing.assert_array_equal(distance_field(space, np.array(target, np.int32)), expected)


def test_nothing_is_reachable_when_the_target_is_not_free():
    occupied = random_occupancy(0)
    target = np.argwhere(occupied)[0].astype(np.int32)
    assert (distance_field(clearance_of(occupied), target) == UNREACHABLE).all()
