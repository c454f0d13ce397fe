"""The interior of a part, however its mesh is made, and how it was found.

A closed mesh is filled by winding along z. Where lines do not close, the three axes vote: a cell is inside if most of
the axes whose lines close there say so. If the vote is a tie, or the mesh is more a sheet than a shell, a cell is
inside if it cannot be reached from outside without crossing a surface cell.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import kernel
from bimvox.voxelization.bits import CellPlanes, empty_plane, empty_planes, pack, unpack
from bimvox.voxelization.borders import mark_borders
from bimvox.voxelization.closure import corner_keys, edges_match, inverted_faces, openness
from bimvox.voxelization.columns import fill_columns
from bimvox.voxelization.runs import FilledCells, dense_shares, share_starts
from bimvox.voxelization.samples import sample_lines
from bimvox.voxelization.surface import mark_surface
from bimvox.voxelization.sweep import FULL

# If less than half of a mesh's surface faces other surface, it is a sheet: lines through it tell nothing about inside.
_SHEET_OPENNESS = 0.5
_HALF = FULL // 2


class Fill(StrEnum):
    """How the interior of a part was found."""

    WINDING = "winding"
    """Signed winding closed on every line."""
    VOTE = "vote"
    """Some lines did not close; the axes voted there."""
    FLOOD = "flood"
    """Cells that cannot be reached from outside are inside."""
    SURFACE = "surface"
    """The mesh encloses nothing; the part is its surface."""


@dataclass(frozen=True, slots=True, eq=False)
class SolidFill:
    """The cells of a part, and how they were found.

    Attributes:
        fill: How the interior was found.
        volume: Exact volume in cells by the divergence theorem; None if the mesh is open or overlaps itself.
        filled: The cells, and the filled share of each.
    """

    fill: Fill
    volume: float | None
    filled: FilledCells


@kernel
def signed_volume(triangles: NDArray[np.float64], inverted: NDArray[np.bool_]) -> float:
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


def _reach_from_outside(barrier: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return the cells that a 6-connected walk from the faces of the grid reaches without entering the barrier."""
    from scipy.ndimage import label  # imported only for the few parts that need it

    pieces, count = label(~barrier)
    is_outer = np.zeros(count + 1, np.bool_)
    for axis in range(3):
        layers = np.moveaxis(pieces, axis, 0)
        is_outer[layers[:1]] = is_outer[layers[-1:]] = True
    is_outer[0] = False  # the barrier
    reached: NDArray[np.bool_] = is_outer[pieces]
    return reached


@kernel
def _vote(
    met: NDArray[np.bool_],
    inside: NDArray[np.bool_],
    shares: NDArray[np.uint16],
    axis_shares: NDArray[np.uint16],
    closed_yz: NDArray[np.bool_],
    closed_zx: NDArray[np.bool_],
    closed_xy: NDArray[np.bool_],
    outside: NDArray[np.bool_],
) -> tuple[bool, bool]:
    """Let the axes decide every cell.

    Returns:
        Whether all axes agreed everywhere, and whether the flood decided any cell.
    """
    agreed = True
    flooded = False
    at = 0
    for i in range(met.shape[0]):
        for j in range(met.shape[1]):
            for k in range(met.shape[2]):
                votes = 0
                yes = 0
                total = 0
                for axis in range(3):
                    if axis == 0:
                        closes = closed_yz[j, k]
                    elif axis == 1:
                        closes = closed_zx[k, i]
                    else:
                        closes = closed_xy[i, j]
                    if closes:
                        votes += 1
                        share = int(axis_shares[axis, i, j, k])
                        yes += int(share > _HALF)
                        total += share
                if met[i, j, k]:
                    shares[at] = (2 * total + votes) // (2 * votes) if votes > 0 else _HALF
                    at += 1
                    continue
                inside[i, j, k] = 2 * yes > votes
                if 2 * yes == votes:
                    inside[i, j, k] = not outside[i, j, k]
                    flooded = flooded or inside[i, j, k]
                agreed = agreed and votes == 3 and (yes == 0 or yes == 3)
    return agreed, flooded


def _fill_along(
    axis: int, met: NDArray[np.bool_], triangles: NDArray[np.float64], inverted: NDArray[np.bool_]
) -> tuple[NDArray[np.uint16], NDArray[np.bool_], int]:
    """Return the filled shares found along one axis, which of its columns close, and how many lines leak."""
    order = [(1, 2, 0), (2, 0, 1), (0, 1, 2)][axis]
    turned = np.ascontiguousarray(met.transpose(order))
    nothing = empty_plane(0, 0, 0)
    cells = CellPlanes(pack(turned), empty_plane(*turned.shape), nothing, turned.shape[2])
    closed = np.ones(turned.shape[:2], np.bool_)
    corners = np.ascontiguousarray(triangles[:, :, order])
    starts = np.empty(closed.size + 1, np.int64)
    shares, leaks, _, _ = fill_columns(cells, corners, inverted, sample_lines(), closed, starts, False)
    dense = dense_shares(cells, shares)
    return dense.transpose(np.argsort(order)), closed, leaks


def fill_solid(
    shape: tuple[int, int, int], triangles: NDArray[np.float64], tolerance: float, top: NDArray[np.int64]
) -> SolidFill:
    """Find every cell of a part, and measure how much of it is filled.

    Args:
        shape: (A, B, C) cells to look at.
        triangles: (F, 3, 3) float64, in cells, relative to the lowest of these cells.
        tolerance: In cells.
        top: (3,) int64, one past the highest cell of the part's range.

    Returns:
        The cells, and how they were found. Surface cells count as half filled if the part was flooded, and as empty if
        it is a sheet.
    """
    cells = empty_planes(*shape)
    mark_surface(cells, triangles, tolerance)
    starts = np.empty(shape[0] * shape[1] + 1, np.int64)
    keys = corner_keys(triangles)
    matched = bool(edges_match(keys))
    if not matched and openness(triangles) >= _SHEET_OPENNESS:
        return _fill_by_flood(cells, triangles, tolerance, top)
    inverted = np.zeros(len(triangles), np.bool_)
    closed = np.ones(shape[:2], np.bool_)
    fill = Fill.WINDING
    # As it is; with a share for each cell, as leaking lines need it; with inverted shells turned.
    for sharing, inside_out in ((True, False), (False, False), (False, True)):
        if sharing and not matched:
            continue
        if inside_out:
            inverted = inverted_faces(triangles, keys)
            if not inverted.any():
                break
        cells.inside[:] = 0
        closed[:] = True
        shares, leaks, least, most = fill_columns(cells, triangles, inverted, sample_lines(), closed, starts, sharing)
        if not least < 0 < most and not (sharing and leaks):
            break
    if not matched or leaks:
        fill, inside = _fill_by_vote(cells, shares, triangles, inverted, closed, leaks, tolerance, top)
        cells = cells._replace(inside=inside)
    mark_borders(cells, triangles, tolerance, top)
    exact = None
    if matched and fill is Fill.WINDING and covers_once(least, most):
        exact = abs(signed_volume(triangles, inverted))
    return SolidFill(fill, exact, FilledCells(cells, starts, shares, 0))


@kernel
def covers_once(least: int, most: int) -> bool:
    """Return whether windings from ``least`` to ``most`` are those of a mesh that does not overlap itself."""
    return least == 0 <= most <= 1 or least == -1 <= most == 0


def _fill_by_vote(
    cells: CellPlanes,
    shares: NDArray[np.uint16],
    triangles: NDArray[np.float64],
    inverted: NDArray[np.bool_],
    closed_xy: NDArray[np.bool_],
    leaks_z: int,
    tolerance: float,
    top: NDArray[np.int64],
) -> tuple[Fill, NDArray[np.uint64]]:
    surface = unpack(cells.met, cells.height)
    share_x, closed_yz, leaks_x = _fill_along(0, surface, triangles, inverted)
    share_y, closed_zx, leaks_y = _fill_along(1, surface, triangles, inverted)
    along = np.stack([share_x, share_y, dense_shares(cells, shares)])
    # Seen from outside, cells on borders are surface too.
    shell = CellPlanes(cells.met, np.zeros_like(cells.met), np.zeros_like(cells.met), cells.height)
    mark_borders(shell, triangles, tolerance, top)
    outside = _reach_from_outside(unpack(shell.met | shell.border, cells.height))
    found = np.zeros_like(surface)
    agreed, flooded = _vote(surface, found, shares, along, closed_yz, closed_zx, closed_xy, outside)
    if agreed and not (leaks_x or leaks_y or leaks_z):
        return Fill.WINDING, pack(found)
    return Fill.FLOOD if flooded else Fill.VOTE, pack(found)


def _fill_by_flood(
    cells: CellPlanes, triangles: NDArray[np.float64], tolerance: float, top: NDArray[np.int64]
) -> SolidFill:
    mark_borders(cells, triangles, tolerance, top)
    barrier = unpack(cells.met | cells.border, cells.height)
    enclosed = ~barrier & ~_reach_from_outside(barrier)
    starts = share_starts(cells.met)
    if not enclosed.any():
        shares = np.zeros(starts[-1], np.uint16)
        return SolidFill(Fill.SURFACE, None, FilledCells(cells, starts, shares, 0))
    shares = np.full(starts[-1], _HALF, np.uint16)
    cells = cells._replace(inside=pack(enclosed))
    return SolidFill(Fill.FLOOD, None, FilledCells(cells, starts, shares, _HALF))
