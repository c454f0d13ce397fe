"""Parallel rays both ways through a body find what a ray each way finds."""

import numpy as np

from bimvox.proof.bodies.triangle_tree import crossed, nearest_both_ways, tree_over


def test_rays_both_ways_find_what_two_rays_each_find():
    rng = np.random.default_rng(2)
    corners = rng.uniform(-1.0, 1.0, (300, 1, 3)) + rng.uniform(-0.6, 0.6, (300, 3, 3))
    order, boxes, spans = tree_over(corners.min(axis=1), corners.max(axis=1))
    corners = np.ascontiguousarray(corners[order])
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    normals[:20] = np.eye(3)[rng.integers(0, 3, 20)]
    body, met, waiting = (corners, normals, boxes, spans), 0, np.empty(64, np.int64)
    for number in range(len(corners)):
        starts = rng.dirichlet(np.ones(3), rng.integers(1, 5)) @ corners[number]
        slowness = np.divide(1.0, normals[number], out=np.zeros(3), where=normals[number] != 0.0)
        crossings, nearest = np.full((6, 2), -1), np.full((6, 2), -1.0)
        nearest_both_ways(body, number, starts, slowness, waiting, crossings, nearest)
        for n, start in enumerate(starts):
            for way, ray in enumerate((normals[number], -normals[number])):
                count, _, nearest_m = crossed(*body, start, ray, number)
                assert (crossings[n, way], nearest[n, way]) == (count, nearest_m)
                met += count
        assert (crossings[len(starts) :] == -1).all()
    assert met > 300
