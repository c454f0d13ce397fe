"""Fine poses of a guided load, so that no point of it moves further than a length between two of them."""

from __future__ import annotations

from itertools import pairwise, product

import numpy as np
from numpy.typing import NDArray

from bimvox.bim.building import TriangleMesh
from bimvox.records.lift import Guide

_MOST = 4096


def poses_along(guide: Guide, mesh: TriangleMesh, spacing_m: float) -> NDArray[np.float64]:
    """Return (N, 3) height, aside and tilt of poses from the first one of a guide to its last."""
    arm_m = float(np.linalg.norm(mesh.vertices_m - np.array(guide.centre_m), axis=1).max())
    found = []
    for start, end in pairwise(guide.poses):
        by = np.abs(np.subtract(end, start))
        count = min(max(1, int(np.ceil((by[0] + by[1] + arm_m * by[2]) / spacing_m))), _MOST)
        share = np.arange(count)[:, None] / count
        found.append(np.array(start) + share * np.subtract(end, start))
    return np.concatenate([*found, np.array(guide.poses[-1:])])


def boxes_along(guide: Guide, mesh: TriangleMesh, poses: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return (N, 2, 3) boxes around a guided part in (N, 3) poses: around its box at its place, moved and turned."""
    corners_m = np.array(list(product(*mesh.bounds_m.T))) - np.array(guide.centre_m)
    turned_m = np.einsum("nij,kj->nki", guide.turns(poses[:, 2]), corners_m)
    at_m = np.array(guide.centre_m) + poses[:, :1] * np.array([0.0, 0.0, 1.0]) + poses[:, 1:2] * guide.ahead
    boxes_m: NDArray[np.float64] = np.stack([turned_m.min(axis=1) + at_m, turned_m.max(axis=1) + at_m], axis=1)
    return boxes_m
