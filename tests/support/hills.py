"""Terrain made of triangles."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from box_buildings import box_element

from bimvox.bim.building import Element, Role, TriangleMesh


def hill(height_at: Callable, *, reach: float = 60, step: float = 5) -> TriangleMesh:
    """Return an open surface of triangles over a square around (5, 5)."""
    at = np.arange(5 - reach, 5 + reach + step, step, dtype=float)
    x, y = np.meshgrid(at, at, indexing="ij")
    vertices = np.stack([x, y, height_at(x, y)], axis=-1).reshape(-1, 3)
    n = len(at)
    corner = (np.arange(n - 1)[:, None] * n + np.arange(n - 1)).ravel()
    faces = np.concatenate([[corner, corner + n, corner + n + 1], [corner, corner + n + 1, corner + 1]], axis=1).T
    return TriangleMesh(vertices, faces.astype(np.int32))


def terrain(height_at: Callable) -> Element:
    """Return the terrain of a model."""
    return replace(box_element("terrain", (0, 0, 0), (1, 1, 1), role=Role.GROUND), mesh=hill(height_at))
