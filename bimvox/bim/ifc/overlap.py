"""How much of one solid lies inside another one."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bimvox.bim.building import TriangleMesh

_RAYS = 24
"""Vertical rays through the first solid, along x and along y."""
_OFF = 0.4142
"""Place of a ray in its square: in its middle it would run along edges that are drawn on round numbers."""
_AT_ONCE = 2_000_000
"""Pairs of ray and triangle that are looked at together."""


def share_inside(one: TriangleMesh, other: TriangleMesh) -> float:
    """Return the share of a solid's volume that is inside another one, measured along vertical rays.

    Args:
        one: Faces look outward; an open mesh gives a rough value.
        other: The same.
    """
    low, high = one.bounds_m
    if (low >= other.bounds_m[1]).any() or (high <= other.bounds_m[0]).any():
        return 0.0
    steps = (np.arange(_RAYS) + _OFF) / _RAYS
    xy = np.stack(np.meshgrid(*(low[:2] + steps[:, None] * (high - low)[:2]).T, indexing="ij"), axis=-1).reshape(-1, 2)
    total_m, inside_m = 0.0, 0.0
    first, second = _crossings(one, xy), _crossings(other, xy)
    for own, others in zip(first, second, strict=True):
        pieces = _solid(own)
        total_m += sum(top - bottom for bottom, top in pieces)
        inside_m += sum(
            max(0.0, min(top, high_m) - max(bottom, low_m))
            for bottom, top in pieces
            for low_m, high_m in _solid(others)
        )
    return inside_m / total_m if total_m > 0.0 else 0.0


def _crossings(mesh: TriangleMesh, xy: NDArray[np.float64]) -> list[NDArray[np.float64]]:
    """Return for each vertical line (N, 2) where it passes faces: (C, 2) height, and 1 if it enters going up, or -1."""
    triangles = mesh.triangles_m
    rays, heights, signs = [], [], []
    at_once = max(1, _AT_ONCE // len(xy))
    for start in range(0, len(triangles), at_once):
        a, b, c = np.moveaxis(triangles[start : start + at_once], 1, 0)
        doubled = _cross(b - a, c - a)
        weights = [_cross(q[:, :2] - xy[:, None], r[:, :2] - xy[:, None]) for q, r in ((b, c), (c, a), (a, b))]
        hit = np.all([weight * np.sign(doubled) > 0.0 for weight in weights], axis=0)
        ray, face = np.nonzero(hit)
        z = sum(weight[ray, face] * corner[face, 2] for weight, corner in zip(weights, (a, b, c), strict=True))
        rays.append(ray)
        heights.append(z / doubled[face])
        signs.append(-np.sign(doubled[face]))
    ray = np.concatenate(rays)
    found = np.stack([np.concatenate(heights), np.concatenate(signs)], axis=1)
    order = np.lexsort((found[:, 0], ray))
    return np.split(found[order], np.searchsorted(ray[order], np.arange(1, len(xy))))


def _solid(crossings: NDArray[np.float64]) -> list[tuple[float, float]]:
    """Return where a line is inside the solid, from the bottom up."""
    pieces: list[tuple[float, float]] = []
    depth, start = 0.0, 0.0
    for height, sign in crossings.tolist():
        if depth == 0.0:
            start = height
        depth += sign
        if depth == 0.0:
            pieces.append((start, height))
    return pieces


def _cross(p: NDArray[np.float64], q: NDArray[np.float64]) -> NDArray[np.float64]:
    return p[..., 0] * q[..., 1] - p[..., 1] * q[..., 0]
