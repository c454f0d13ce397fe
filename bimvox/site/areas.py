"""Areas on plan: the grid columns that a polygon covers."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry.base import BaseGeometry

from bimvox.bim.building import TriangleMesh
from bimvox.grid.frame import GridFrame
from bimvox.kept import kept
from bimvox.site.component import Component
from bimvox.site.config.site_config import ZoneConfig
from bimvox.site.site import HookHeights, Site

Corners = Sequence[tuple[float, float]]

_BLOCK = 8
# An edge along a cell border does not count for the next column (metres).
_TOLERANCE_M = 1e-4


def columns_centred_in(polygons: Sequence[Corners], frame: GridFrame, shape: tuple[int, int]) -> NDArray[np.bool_]:
    """Return the (X, Y) columns whose centre lies inside one of the polygons (site metres)."""
    i, j = np.indices(shape)
    centres_m = frame.centre_of(np.stack([i, j, np.zeros_like(i)], axis=-1))
    inside = np.zeros(shape, np.bool_)
    for corners in polygons:
        inside |= shapely.contains_xy(shapely.Polygon(corners), centres_m[..., 0], centres_m[..., 1])
    return inside


def columns_met_by(polygons: Sequence[Corners], frame: GridFrame, shape: tuple[int, int]) -> NDArray[np.bool_]:
    """Return the (X, Y) columns that overlap one of the polygons (site metres)."""
    met = np.zeros(shape, np.bool_)
    for own in columns_met_by_each(polygons, frame, shape):
        met |= own
    return met


def columns_met_by_each(
    polygons: Sequence[Corners], frame: GridFrame, shape: tuple[int, int]
) -> Iterator[NDArray[np.bool_]]:
    """Yield the (X, Y) columns that overlap a polygon (site metres), for one polygon after the other.

    Blocks of columns are tested first; the columns of a block are tested if the polygon's outline is in it.
    """
    i, j = np.indices(shape)
    low_m = frame.corner_of(np.stack([i, j, np.zeros_like(i)], axis=-1))[..., :2] + _TOLERANCE_M
    high_m = low_m + frame.voxel_size_m - 2 * _TOLERANCE_M
    squares = shapely.box(low_m[..., 0], low_m[..., 1], high_m[..., 0], high_m[..., 1])
    ends = (np.minimum(np.arange(0, size, _BLOCK) + _BLOCK, size) - 1 for size in shape)
    first_m, last_m = low_m[::_BLOCK, ::_BLOCK], high_m[np.ix_(*ends)]
    blocks = shapely.box(first_m[..., 0], first_m[..., 1], last_m[..., 0], last_m[..., 1])
    for corners in polygons:
        polygon = shapely.Polygon(corners)
        shapely.prepare(polygon)
        met = np.zeros(shape, np.bool_)
        for x, y in np.argwhere(shapely.intersects(polygon, blocks)) * _BLOCK:
            window = (slice(x, x + _BLOCK), slice(y, y + _BLOCK))
            inside = shapely.contains(polygon, blocks[x // _BLOCK, y // _BLOCK])
            met[window] = inside or shapely.intersects(polygon, squares[window])
        yield met


# Outlines of parts and areas as plain values.
#
# An outline is a list of rings; a ring is a list of [x, y] corners, or of [along, z] corners in an elevation. A part is
# drawn by the convex hull of its vertices.

Outline = list[list[list[float]]]
PLAN, FRONT, SIDE = (0, 1), (0, 2), (1, 2)
"""The two axes of a drawing: from above, along +y, along -x."""

_SIMPLE_M = 0.02
"""Outlines are simplified by this much."""
_SMALL_M2, _MOST_TRIANGLES = 20.0, 5000
"""A hull of less has no opening for a mast; more triangles take too long to join."""


@kept
def hull(mesh: TriangleMesh, axes: tuple[int, int]) -> BaseGeometry:
    """Return the convex hull of a mesh along two axes."""
    used = np.zeros(len(mesh.vertices_m), np.bool_)
    used[mesh.faces] = True
    # A line through all vertices has their hull, and is made much faster than a set of points.
    return shapely.linestrings(mesh.vertices_m[:, axes][used]).convex_hull


@kept
def shadow(mesh: TriangleMesh) -> BaseGeometry:
    """Return what a mesh covers on plan, its openings left free; of a small or an intricate one the convex hull."""
    around = hull(mesh, PLAN)
    if around.area < _SMALL_M2 or len(mesh.faces) > _MOST_TRIANGLES:
        return around
    flat = shapely.polygons(mesh.triangles_m[:, :, :2])
    return shapely.union_all(flat[shapely.area(flat) > 0.0])


def union(shapes: Iterable[BaseGeometry]) -> BaseGeometry:
    """Return the union of all shapes that have an area."""
    return shapely.union_all([shape for shape in shapes if shape.area > 0.0])


def outline(shape: BaseGeometry) -> Outline:
    """Return the rings of a shape, to the millimetre."""
    parts = shapely.get_parts(shape.simplify(_SIMPLE_M))
    polygons = [part for part in parts if isinstance(part, shapely.Polygon) and not part.is_empty]
    rings = [ring for polygon in polygons for ring in (polygon.exterior, *polygon.interiors)]
    return [[rounded(at) for at in ring.coords[:-1]] for ring in rings]


def rounded(values: Iterable[float]) -> list[float]:
    """Return values to the millimetre."""
    return [round(float(value), 3) + 0.0 for value in values]


def area_of(site: Site, columns: NDArray[np.bool_] | None) -> BaseGeometry:
    """Return (X, Y) columns as an area."""
    if columns is None or not columns.any():
        return shapely.Polygon()
    size_m, (x0, y0, _) = site.frame.voxel_size_m, site.frame.origin_m
    edges = np.diff(np.pad(columns, ((0, 0), (1, 1))).astype(np.int8), axis=1)
    (row, start), (_, end) = np.nonzero(edges == 1), np.nonzero(edges == -1)
    low_x, low_y, high_y = x0 + row * size_m, y0 + start * size_m, y0 + end * size_m
    return shapely.union_all(shapely.box(low_x, low_y, low_x + size_m, high_y), grid_size=1e-6)


# Zones of a site as maps of columns, and the hook positions that they leave.
#
# A zone forbids the hook (``prohibited``), the load (``no_load``) or both (``public``), or it limits the hook's height
# (``limiter``). All of them become one map for the collision rule: the columns over which the hook may be with this
# load, and its lowest and highest position.

NO_HOOK = frozenset(("prohibited", "public"))
NO_LOAD = frozenset(("no_load", "public"))


def columns_without(
    kinds: frozenset[str], zones: Sequence[ZoneConfig], frame: GridFrame, shape: tuple[int, int]
) -> NDArray[np.bool_] | None:
    """Return the (X, Y) columns that zones of these kinds overlap; None if there is no such zone."""
    polygons = [zone.polygon for zone in zones if zone.kind in kinds]
    return columns_met_by(polygons, frame, shape) if polygons else None


def hook_heights(zones: Sequence[ZoneConfig], frame: GridFrame, shape: tuple[int, int]) -> HookHeights | None:
    """Return the limits of the hook's height per column; None if no zone gives any."""
    limiters = [zone for zone in zones if zone.kind == "limiter"]
    if not limiters:
        return None
    low, high = np.full(shape, -np.inf), np.full(shape, np.inf)
    for zone, met in zip(limiters, columns_met_by_each([one.polygon for one in limiters], frame, shape), strict=True):
        if zone.lowest_hook_m is not None:
            low[met] = np.maximum(low[met], zone.lowest_hook_m)
        if zone.highest_hook_m is not None:
            high[met] = np.minimum(high[met], zone.highest_hook_m)
    return HookHeights(low, high)


def hooks_with_load_over(zone: NDArray[np.bool_], component: Component) -> NDArray[np.bool_]:
    """Return the (X, Y) columns of the hook at which any part of a component hangs over a zone ((X, Y) bool)."""
    nx, ny = zone.shape
    taken = np.zeros((nx + 1, ny + 1), np.int32)
    taken[1:, 1:] = zone.cumsum(axis=0).cumsum(axis=1)
    over = np.zeros(zone.shape, np.bool_)
    offset = np.array(component.hook_offset_vox[:2])
    for x0, y0, x1, y1 in np.unique(component.shape.boxes[:, [0, 1, 3, 4]] - np.tile(offset, 2), axis=0).tolist():
        a, b = (np.clip(np.arange(nx) + n, 0, nx) for n in (x0, x1))
        c, d = (np.clip(np.arange(ny) + n, 0, ny) for n in (y0, y1))
        over |= taken[np.ix_(b, d)] - taken[np.ix_(a, d)] - taken[np.ix_(b, c)] + taken[np.ix_(a, c)] > 0
    return over
