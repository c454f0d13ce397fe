"""The interior of a part, however its mesh is made, and how it was found.

A closed mesh is filled by winding along z. Where that does not close, the three axes vote: a cell is inside when most
of the axes whose lines close there say so. Where they cannot tell, or where the mesh is more sheet than shell, what
cannot be reached from outside without crossing a surface cell is inside.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import kernel
from bimvox.voxelize.closure import edges_match, inverted_faces, openness, vertex_keys
from bimvox.voxelize.columns import fill_columns
from bimvox.voxelize.samples import sample_positions
from bimvox.voxelize.surface import INSIDE, MET, ON_BORDER, mark_borders

# A mesh that faces itself with less than half of its surface is a sheet: lines through it mean no inside and outside.
_SHEET_OPENNESS = 0.5
_HALF_FILLED = 0.5


class Fill(StrEnum):
    """How the interior of a part was found."""

    WINDING = "winding"
    """Signed winding closed on every line."""
    VOTE = "vote"
    """Some lines did not close: the axes voted there."""
    FLOOD = "flood"
    """What cannot be reached from outside."""
    SURFACE = "surface"
    """The mesh encloses nothing: only its surface counts."""


@dataclass(frozen=True, slots=True)
class SolidFill:
    """How a part was filled.

    Attributes:
        fill: By which means.
        volume: Volume in cells by the divergence theorem, where the mesh is closed and nowhere covers itself, so that
            it is exact; else None.
    """

    fill: Fill
    volume: float | None


@kernel
def _signed_volume(triangles: NDArray[np.float64], inverted: NDArray[np.bool_]) -> float:
    """Return the volume by the divergence theorem, about a corner of the mesh to keep the digits."""
    ox, oy, oz = triangles[0, 0, 0], triangles[0, 0, 1], triangles[0, 0, 2]
    six_fold = 0.0
    for f in range(triangles.shape[0]):
        ax, ay, az = triangles[f, 0, 0] - ox, triangles[f, 0, 1] - oy, triangles[f, 0, 2] - oz
        bx, by, bz = triangles[f, 1, 0] - ox, triangles[f, 1, 1] - oy, triangles[f, 1, 2] - oz
        cx, cy, cz = triangles[f, 2, 0] - ox, triangles[f, 2, 1] - oy, triangles[f, 2, 2] - oz
        part = ax * (by * cz - bz * cy) + ay * (bz * cx - bx * cz) + az * (bx * cy - by * cx)
        six_fold += -part if inverted[f] else part
    return six_fold / 6.0


@kernel
def _reach_from_outside(barrier: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return the cells that a 6-connected walk from the faces of the grid reaches without entering the barrier."""
    nx, ny, nz = barrier.shape
    reached = np.zeros((nx, ny, nz), np.bool_)
    stack = np.empty(2 * (nx * ny + ny * nz + nz * nx) + 8, np.int64)
    size = 0
    for i in range(nx):
        for j in range(ny):
            for k in range(nz):
                outer = i == 0 or j == 0 or k == 0 or i == nx - 1 or j == ny - 1 or k == nz - 1
                if outer and not barrier[i, j, k]:
                    reached[i, j, k] = True
                    stack[size] = (i * ny + j) * nz + k
                    size += 1
    while size > 0:
        size -= 1
        at = stack[size]
        k = at % nz
        j = at // nz % ny
        i = at // nz // ny
        if size + 6 > stack.size:
            longer = np.empty(2 * stack.size, np.int64)
            longer[:size] = stack[:size]
            stack = longer
        for axis in range(3):
            for step in (-1, 1):
                x = i + step if axis == 0 else i
                y = j + step if axis == 1 else j
                z = k + step if axis == 2 else k
                if x < 0 or y < 0 or z < 0 or x >= nx or y >= ny or z >= nz:
                    continue
                if not reached[x, y, z] and not barrier[x, y, z]:
                    reached[x, y, z] = True
                    stack[size] = (x * ny + y) * nz + z
                    size += 1
    return reached


@kernel
def _vote(
    cells: NDArray[np.uint8],
    fractions: NDArray[np.float32],
    shares: NDArray[np.float32],
    closed_yz: NDArray[np.bool_],
    closed_zx: NDArray[np.bool_],
    closed_xy: NDArray[np.bool_],
    outside: NDArray[np.bool_],
) -> tuple[bool, bool]:
    """Let the axes decide every cell; returns whether all agreed, and whether the flood had to decide anything."""
    agreed = True
    flooded = False
    for i in range(cells.shape[0]):
        for j in range(cells.shape[1]):
            for k in range(cells.shape[2]):
                votes = 0
                yes = 0
                total = 0.0
                for axis in range(3):
                    if axis == 0:
                        closes = closed_yz[j, k]
                    elif axis == 1:
                        closes = closed_zx[k, i]
                    else:
                        closes = closed_xy[i, j]
                    if closes:
                        votes += 1
                        share = shares[axis, i, j, k]
                        yes += int(share > _HALF_FILLED)
                        total += share
                if cells[i, j, k] & np.uint8(MET):
                    fractions[i, j, k] = total / votes if votes > 0 else _HALF_FILLED
                    continue
                inside = 2 * yes > votes
                if 2 * yes == votes:
                    inside = not outside[i, j, k]
                    flooded = flooded or inside
                agreed = agreed and votes == 3 and (yes == 0 or yes == 3)
                fractions[i, j, k] = 1.0 if inside else 0.0
                if inside:
                    cells[i, j, k] |= np.uint8(INSIDE)
    return agreed, flooded


def _fill_along(
    axis: int, cells: NDArray[np.uint8], triangles: NDArray[np.float64], inverted: NDArray[np.bool_]
) -> tuple[NDArray[np.float32], NDArray[np.bool_], int]:
    """Return the filled shares found along one axis, which of its columns close, and how many lines leak."""
    order = [(1, 2, 0), (2, 0, 1), (0, 1, 2)][axis]
    turned = np.ascontiguousarray(cells.transpose(order))
    shares = np.zeros(turned.shape, np.float32)
    closed = np.ones(turned.shape[:2], np.bool_)
    corners = np.ascontiguousarray(triangles[:, :, order])
    leaks, _, _ = fill_columns(turned, shares, corners, inverted, sample_positions(), closed)
    back = np.argsort(order)
    return shares.transpose(back), closed, leaks


def _flooded(
    cells: NDArray[np.uint8], triangles: NDArray[np.float64], tolerance: float, top: NDArray[np.int64]
) -> NDArray[np.bool_]:
    """Return the cells outside the surface, borders counted as surface."""
    barrier = cells & np.uint8(MET)
    mark_borders(barrier, triangles, tolerance, top)
    return _reach_from_outside(barrier != 0)


def fill_solid(
    cells: NDArray[np.uint8],
    fractions: NDArray[np.float32],
    triangles: NDArray[np.float64],
    steps: NDArray[np.int64],
    faces: NDArray[np.int32],
    tolerance: float,
    top: NDArray[np.int64],
) -> SolidFill:
    """Set ``INSIDE`` and ``ON_BORDER`` and the filled share of every cell.

    Args:
        cells: (A, B, C) uint8 bits, ``MET`` complete; changed in place.
        fractions: (A, B, C) float32, zeros; changed in place. Cells of a flooded part that its surface meets count as
            half filled, those of a sheet as empty.
        triangles: (F, 3, 3) float64, in cells, relative to the lowest corner of ``cells``.
        steps: (V, 3) int64 vertices in 2^-24 of a cell.
        faces: (F, 3) int32 into ``steps``, the faces of ``triangles``.
        tolerance: In cells.
        top: (3,) int64, one past the highest cell of the part's range.
    """
    keys = vertex_keys(steps)
    matched = edges_match(keys, faces)
    inverted = np.zeros(len(faces), np.bool_)
    if matched or openness(triangles) < _SHEET_OPENNESS:
        closed = np.ones(cells.shape[:2], np.bool_)
        leaks, least, most = fill_columns(cells, fractions, triangles, inverted, sample_positions(), closed)
        if least < 0 < most:
            inverted = inverted_faces(triangles, keys, faces)
            if inverted.any():
                cells &= np.uint8(MET)
                fractions[:] = 0.0
                closed[:] = True
                leaks, least, most = fill_columns(cells, fractions, triangles, inverted, sample_positions(), closed)
        fill = Fill.WINDING
        if not matched or leaks:
            fill = _fill_by_vote(cells, fractions, triangles, inverted, closed, leaks, tolerance, top)
        mark_borders(cells, triangles, tolerance, top)
        once = least == 0 <= most <= 1 or least == -1 <= most == 0
        volume = abs(_signed_volume(triangles, inverted)) if matched and fill is Fill.WINDING and once else None
        return SolidFill(fill, volume)
    return SolidFill(_fill_by_flood(cells, fractions, triangles, tolerance, top), None)


def _fill_by_vote(
    cells: NDArray[np.uint8],
    fractions: NDArray[np.float32],
    triangles: NDArray[np.float64],
    inverted: NDArray[np.bool_],
    closed_xy: NDArray[np.bool_],
    leaks_z: int,
    tolerance: float,
    top: NDArray[np.int64],
) -> Fill:
    surface = cells & np.uint8(MET)
    share_x, closed_yz, leaks_x = _fill_along(0, surface, triangles, inverted)
    share_y, closed_zx, leaks_y = _fill_along(1, surface, triangles, inverted)
    shares = np.stack([share_x, share_y, fractions])
    outside = _flooded(surface, triangles, tolerance, top)
    cells &= np.uint8(MET)
    agreed, flooded = _vote(cells, fractions, shares, closed_yz, closed_zx, closed_xy, outside)
    if agreed and not (leaks_x or leaks_y or leaks_z):
        return Fill.WINDING
    return Fill.FLOOD if flooded else Fill.VOTE


def _fill_by_flood(
    cells: NDArray[np.uint8],
    fractions: NDArray[np.float32],
    triangles: NDArray[np.float64],
    tolerance: float,
    top: NDArray[np.int64],
) -> Fill:
    mark_borders(cells, triangles, tolerance, top)
    outside = _reach_from_outside(cells != 0)
    enclosed = (cells == 0) & ~outside
    if not enclosed.any():
        return Fill.SURFACE
    fractions[enclosed] = 1.0
    fractions[(cells & np.uint8(MET | ON_BORDER)) != 0] = _HALF_FILLED
    cells[enclosed] |= np.uint8(INSIDE)
    return Fill.FLOOD
