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
from bimvox.voxelization.bits import empty_plane, pack, unpack
from bimvox.voxelization.borders import mark_borders
from bimvox.voxelization.closure import corner_keys, edges_match, inverted_faces, openness
from bimvox.voxelization.columns import fill_columns
from bimvox.voxelization.runs import dense_shares, share_starts
from bimvox.voxelization.samples import sample_lines
from bimvox.voxelization.surface import mark_surface
from bimvox.voxelization.sweep import FULL

# A mesh that faces itself with less than half of its surface is a sheet: lines through it mean no inside and outside.
_SHEET_OPENNESS = 0.5
_HALF = FULL // 2


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


@dataclass(frozen=True, slots=True, eq=False)
class SolidFill:
    """How a part was filled, and its cells as planes of bits (see ``bits.py``); no cell is in two of them.

    Attributes:
        fill: By which means.
        volume: Volume in cells by the divergence theorem, where the mesh is closed and nowhere covers itself, so that
            it is exact; else None.
        met: (A, B, W), cells that the surface meets.
        inside: (A, B, W), cells inside the solid.
        border: (A, B, W), cells in the part by the half-open rule only.
        starts: (A * B + 1,) int64, first share of each column; columns that are alike may share theirs.
        shares: (S,) uint16, in 2^-14: how much of each cell that the surface meets is filled, in order.
        border_share: The same for the cells of ``border``.
    """

    fill: Fill
    volume: float | None
    met: NDArray[np.uint64]
    inside: NDArray[np.uint64]
    border: NDArray[np.uint64]
    starts: NDArray[np.int64]
    shares: NDArray[np.uint16]
    border_share: int


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
    met: NDArray[np.bool_],
    inside: NDArray[np.bool_],
    shares: NDArray[np.uint16],
    axis_shares: NDArray[np.uint16],
    closed_yz: NDArray[np.bool_],
    closed_zx: NDArray[np.bool_],
    closed_xy: NDArray[np.bool_],
    outside: NDArray[np.bool_],
) -> tuple[bool, bool]:
    """Let the axes decide every cell; returns whether all agreed, and whether the flood had to decide anything."""
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
    surface, inside = pack(turned), empty_plane(*turned.shape)
    closed = np.ones(turned.shape[:2], np.bool_)
    corners = np.ascontiguousarray(triangles[:, :, order])
    starts = np.empty(closed.size + 1, np.int64)
    shares, leaks, _, _ = fill_columns(
        surface, inside, turned.shape[2], corners, inverted, sample_lines(), closed, starts, False
    )
    dense = dense_shares(surface, inside, turned.shape[2], shares)
    return dense.transpose(np.argsort(order)), closed, leaks


@kernel
def wind(
    met: NDArray[np.uint64],
    inside: NDArray[np.uint64],
    border: NDArray[np.uint64],
    height: int,
    triangles: NDArray[np.float64],
    samples: NDArray[np.float64],
    tolerance: float,
    top: NDArray[np.int64],
) -> tuple[bool, NDArray[np.int64], NDArray[np.uint16], int, int, float]:
    """Mark the surface and, where every edge matches, fill by winding: whether that was all, and what came out."""
    mark_surface(met, height, triangles, tolerance)
    starts = np.empty(met.shape[0] * met.shape[1] + 1, np.int64)
    if not edges_match(corner_keys(triangles)):
        return False, starts, np.empty(0, np.uint16), 0, 0, 0.0
    inverted = np.zeros(triangles.shape[0], np.bool_)
    closed = np.ones(met.shape[:2], np.bool_)
    shares, leaks, least, most = fill_columns(met, inside, height, triangles, inverted, samples, closed, starts, True)
    if leaks > 0 or least < 0 < most:
        return False, starts, shares, least, most, 0.0
    mark_borders(met, inside, border, height, triangles, tolerance, top)
    return True, starts, shares, least, most, abs(_signed_volume(triangles, inverted))


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
        How it was filled. Cells of a flooded part that its surface meets count as half filled, those of a sheet as
        empty.
    """
    met, inside, border = empty_plane(*shape), empty_plane(*shape), empty_plane(*shape)
    done, starts, shares, least, most, volume = wind(
        met, inside, border, shape[2], triangles, sample_lines(), tolerance, top
    )
    if done:
        exact = volume if covers_once(least, most) else None
        return SolidFill(Fill.WINDING, exact, met, inside, border, starts, shares, 0)
    keys = corner_keys(triangles)
    matched = bool(edges_match(keys))
    if not matched and openness(triangles) >= _SHEET_OPENNESS:
        return _fill_by_flood(met, inside, border, shape[2], triangles, tolerance, top)
    inverted = np.zeros(len(triangles), np.bool_)
    closed = np.ones(met.shape[:2], np.bool_)
    fill = Fill.WINDING
    for inside_out in (False, True):
        if inside_out:
            inverted = inverted_faces(triangles, keys)
            if not inverted.any():
                break
        inside[:] = 0
        closed[:] = True
        shares, leaks, least, most = fill_columns(
            met, inside, shape[2], triangles, inverted, sample_lines(), closed, starts, False
        )
        if not least < 0 < most:
            break
    if not matched or leaks:
        fill, inside = _fill_by_vote(met, inside, shape[2], shares, triangles, inverted, closed, leaks, tolerance, top)
    mark_borders(met, inside, border, shape[2], triangles, tolerance, top)
    exact = None
    if matched and fill is Fill.WINDING and covers_once(least, most):
        exact = abs(_signed_volume(triangles, inverted))
    return SolidFill(fill, exact, met, inside, border, starts, shares, 0)


@kernel
def covers_once(least: int, most: int) -> bool:
    """Say whether windings from ``least`` to ``most`` are those of a mesh that nowhere covers itself."""
    return least == 0 <= most <= 1 or least == -1 <= most == 0


def _fill_by_vote(
    met: NDArray[np.uint64],
    inside: NDArray[np.uint64],
    height: int,
    shares: NDArray[np.uint16],
    triangles: NDArray[np.float64],
    inverted: NDArray[np.bool_],
    closed_xy: NDArray[np.bool_],
    leaks_z: int,
    tolerance: float,
    top: NDArray[np.int64],
) -> tuple[Fill, NDArray[np.uint64]]:
    surface = unpack(met, height)
    share_x, closed_yz, leaks_x = _fill_along(0, surface, triangles, inverted)
    share_y, closed_zx, leaks_y = _fill_along(1, surface, triangles, inverted)
    along = np.stack([share_x, share_y, dense_shares(met, inside, height, shares)])
    # Seen from outside, what lies on borders is surface, too.
    nothing, border = np.zeros_like(met), np.zeros_like(met)
    mark_borders(met, nothing, border, height, triangles, tolerance, top)
    outside = _reach_from_outside(unpack(met | border, height))
    found = np.zeros_like(surface)
    agreed, flooded = _vote(surface, found, shares, along, closed_yz, closed_zx, closed_xy, outside)
    if agreed and not (leaks_x or leaks_y or leaks_z):
        return Fill.WINDING, pack(found)
    return Fill.FLOOD if flooded else Fill.VOTE, pack(found)


def _fill_by_flood(
    met: NDArray[np.uint64],
    inside: NDArray[np.uint64],
    border: NDArray[np.uint64],
    height: int,
    triangles: NDArray[np.float64],
    tolerance: float,
    top: NDArray[np.int64],
) -> SolidFill:
    mark_borders(met, inside, border, height, triangles, tolerance, top)
    barrier = unpack(met | border, height)
    enclosed = ~barrier & ~_reach_from_outside(barrier)
    starts = share_starts(met)
    if not enclosed.any():
        shares = np.zeros(starts[-1], np.uint16)
        return SolidFill(Fill.SURFACE, None, met, inside, border, starts, shares, 0)
    shares = np.full(starts[-1], _HALF, np.uint16)
    return SolidFill(Fill.FLOOD, None, met, pack(enclosed), border, starts, shares, _HALF)
