"""Rays both ways through a body find what a ray each way finds."""

import numpy as np

from bimvox.proof.bodies.triangle_tree import crossed, nearest_both_ways, tree_over


def test_a_ray_both_ways_finds_what_two_rays_find():
    rng = np.random.default_rng(2)
    corners = rng.uniform(-1.0, 1.0, (300, 1, 3)) + rng.uniform(-0.6, 0.6, (300, 3, 3))
    order, boxes, spans = tree_over(corners.min(axis=1), corners.max(axis=1))
    corners = np.ascontiguousarray(corners[order])
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    normals[:20] = np.eye(3)[rng.integers(0, 3, 20)]
    body, met, waiting = (corners, normals, boxes, spans), 0, np.empty(64, np.int64)
    for number, start in enumerate(corners.mean(axis=1)):
        ahead, _, ahead_m = crossed(*body, start, normals[number], number)
        behind, _, behind_m = crossed(*body, start, -normals[number], number)
        slowness = np.divide(1.0, normals[number], out=np.zeros(3), where=normals[number] != 0.0)
        assert nearest_both_ways(*body, start, number, slowness, waiting) == (ahead, ahead_m, behind, behind_m)
        met += ahead + behind
    assert met > 300
