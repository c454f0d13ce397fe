"""The smallest upright box around a part, and the one around it when it is laid flat: what a lorry must take."""

from __future__ import annotations

import numpy as np

from bimvox.bim.building import TriangleMesh
from bimvox.bim.own_box import own_sides_m, plan_sides_m


def sizes_m(mesh: TriangleMesh) -> tuple[float, float, float]:
    """Return the edges of a part's smallest upright box, the longest first; it may be turned about the vertical."""
    low, high = mesh.bounds_m
    x, y, z = sorted((*plan_sides_m(mesh), float(high[2] - low[2])), reverse=True)
    return x, y, z


def boxes_m(mesh: TriangleMesh) -> tuple[tuple[float, float, float], ...]:
    """Return the boxes in which a part can be brought, the smaller one first; one of them if they are the same."""
    return tuple(dict.fromkeys((laid_flat_m(mesh), sizes_m(mesh))))


def laid_flat_m(mesh: TriangleMesh) -> tuple[float, float, float]:
    """Return the edges of the smaller of two boxes, the longest first: upright, and along a part's own main directions.

    A brace or a rafter is set at a slope, but no lorry carries it like that.
    """
    z, y, x = own_sides_m(mesh)
    return min((sizes_m(mesh), (x, y, z)), key=lambda sizes: round(float(np.prod(sizes)), 6))
