"""Which cells a mesh fills: its surface touches them, or they lie inside it.

A cell that no triangle touches is entirely inside or entirely outside, so its centre decides. Three lines go through
the centre, one along each axis. A line closes if the triangles that it crosses cancel: as many face one way as the
other. The centre is inside if on most of the lines that close the crossings before it do not cancel. If the lines do
not decide and the mesh is open, a cell is inside if no way along untouched cells leads out of the part's cells.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_propagation

from bimvox.bim.building import TriangleMesh
from bimvox.compiled import kernel, leaf_kernel
from bimvox.proof.bodies.solid import are_edges_matched, corner_numbers, pieces_of

_STRIPS = np.arange(16)
_LINES = np.array([(8.0, 8.0), *zip(_STRIPS * 7 % 16 + 0.5, _STRIPS + 0.5, strict=True)]) / 16.0 + (0.00031, -0.00047)
"""(L, 2) where lines cross a cell, the first near its middle; off round numbers, where surfaces are."""

_DOUBTFUL = 1e-3
"""Share of the cells of an open mesh that other lines than these may find inside, because they miss its holes."""


def unfilled(
    cells: NDArray[np.bool_], touched: NDArray[np.bool_], mesh: TriangleMesh, corners: NDArray[np.float64], near: float
) -> NDArray[np.int64]:
    """Return (N, 3) the cells of a part that its mesh does not fill.

    Args:
        cells: (X, Y, Z) whether a cell is of the part; none at the faces of the array.
        touched: (X, Y, Z) cells that are known to be touched.
        mesh: Its triangles.
        corners: (F, 3, 3) float64 these triangles, in cells of the array.
        near: A triangle this close to a cell, in cells, touches it.
    """
    left = np.argwhere(cells & ~touched)
    if len(left):
        left = left[~_by_lines(left, corners, cells.shape, _LINES[:1])]
    if len(left):
        left = left[~_are_touched(left, corners, cells.shape, near)]
    if not len(left):
        return left
    numbers = corner_numbers(mesh)
    inward, is_open = _inward(corners, pieces_of(numbers)), not are_edges_matched(numbers)
    lines = _LINES if is_open else _LINES[:1]
    if is_open:
        left = left[~_by_lines(left, corners, cells.shape, lines)]
    if inward.any():  # shells that face inward may cancel others that face outward
        turned = np.ascontiguousarray(np.where(inward[:, None, None], corners[:, ::-1], corners))
        left = left[~_by_lines(left, turned, cells.shape, lines)]
    if is_open and len(left):
        left = left[~_are_enclosed(left, corners, touched, near)]
        if len(left) <= _DOUBTFUL * np.count_nonzero(cells):
            left = left[:0]
    return left


def _by_lines(
    left: NDArray[np.int64], corners: NDArray[np.float64], shape: tuple[int, ...], lines: NDArray[np.float64]
) -> NDArray[np.bool_]:
    """Return (N,) whether more axes may say that a cell is inside than must say that it is outside.

    An axis may say so if any of its lines through the cell closes and says so. It must say that the cell is outside if
    all of them close and say so.
    """
    votes = np.zeros(len(left), np.int64)
    for order in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        cells, turned = np.ascontiguousarray(left[:, order]), np.ascontiguousarray(corners[:, :, order])
        may, must = np.zeros(len(left), np.bool_), np.ones(len(left), np.bool_)
        for line in lines:
            closes, inside = _crossings(cells, turned, np.array(shape)[list(order)], line)
            may |= closes & inside
            must &= closes & ~inside
        votes += may.astype(np.int64) - must
    return votes > 0


def _are_enclosed(
    left: NDArray[np.int64], corners: NDArray[np.float64], touched: NDArray[np.bool_], near: float
) -> NDArray[np.bool_]:
    """Return (N,) whether no way along cells that no triangle touches leads from a cell to a face of the array."""
    free = ~touched
    cells = np.argwhere(free)
    free[tuple(cells[_are_touched(cells, corners, free.shape, near)].T)] = False
    faces = np.ones_like(free)
    faces[1:-1, 1:-1, 1:-1] = False
    enclosed: NDArray[np.bool_] = ~binary_propagation(faces, mask=free)[tuple(left.T)]
    return enclosed


@kernel
def _crossings(
    cells: NDArray[np.int64], corners: NDArray[np.float64], shape: NDArray[np.int64], aside: NDArray[np.float64]
) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Return (N,) whether the line along the last axis through a cell closes, and whether its centre is inside by it.

    Whether a line is over a triangle follows from its edges alone, with the same numbers for both triangles of an edge.
    So a closed mesh closes on every line.
    """
    number, count = np.full((shape[0], shape[1]), -1, np.int64), 0
    for n in range(cells.shape[0]):
        if number[cells[n, 0], cells[n, 1]] < 0:
            number[cells[n, 0], cells[n, 1]] = count
            count += 1
    wound = np.zeros((count, shape[2] + 1), np.int32)
    cut, sign = np.empty(3), np.empty(3, np.int64)
    for f in range(corners.shape[0]):
        one, two, three = corners[f, 0], corners[f, 1], corners[f, 2]
        lowest, highest = min(one[2], two[2], three[2]), max(one[2], two[2], three[2])
        ux, uy, uz = two[0] - one[0], two[1] - one[1], two[2] - one[2]
        vx, vy, vz = three[0] - one[0], three[1] - one[1], three[2] - one[2]
        nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
        first = max(int(np.ceil(min(one[1], two[1], three[1]) - aside[1])), 0)
        last = min(int(np.floor(max(one[1], two[1], three[1]) - aside[1])), shape[1] - 1)
        for j in range(first, last + 1):
            y, found = j + aside[1], 0
            for k in range(3):
                low, high = corners[f, k], corners[f, (k + 1) % 3]
                if (low[1] <= y) == (high[1] <= y):
                    continue
                sign[found] = 1
                if low[1] > y:
                    low, high, sign[found] = high, low, -1
                cut[found] = low[0] + (y - low[1]) / (high[1] - low[1]) * (high[0] - low[0])
                found += 1
            if found != 2:
                continue
            far = 0 if cut[0] > cut[1] else 1
            begins = max(int(np.ceil(cut[1 - far] - aside[0])), 0)
            ends = min(int(np.ceil(cut[far] - aside[0])), shape[0])
            for i in range(begins, ends):
                if number[i, j] < 0:
                    continue
                z = lowest
                if nz != 0.0:
                    z = one[2] - (nx * (i + aside[0] - one[0]) + ny * (y - one[1])) / nz
                    z = min(max(z, lowest), highest)
                at = min(max(int(np.ceil(z - 0.5)), 0), shape[2])
                wound[number[i, j], at] += sign[far]
    for n in range(count):
        for k in range(shape[2]):
            wound[n, k + 1] += wound[n, k]
    closes, inside = np.empty(cells.shape[0], np.bool_), np.empty(cells.shape[0], np.bool_)
    for n in range(cells.shape[0]):
        line = number[cells[n, 0], cells[n, 1]]
        closes[n] = wound[line, shape[2]] == 0
        inside[n] = wound[line, cells[n, 2]] != 0
    return closes, inside


def _are_touched(
    left: NDArray[np.int64], corners: NDArray[np.float64], shape: tuple[int, ...], near: float
) -> NDArray[np.bool_]:
    """Return (N,) whether a triangle comes within ``near`` of a cell."""
    waiting = np.zeros(shape, np.bool_)
    waiting[tuple(left.T)] = True
    _touch(waiting, corners, near)
    touched: NDArray[np.bool_] = ~waiting[tuple(left.T)]
    return touched


@kernel
def _touch(waiting: NDArray[np.bool_], corners: NDArray[np.float64], near: float) -> None:
    """Clear every cell that, larger by ``near``, a triangle touches: no plane along one of 13 directions parts them."""
    half = 0.5 + near
    first, last = np.empty(3, np.int64), np.empty(3, np.int64)
    for f in range(corners.shape[0]):
        for k in range(3):
            low = min(corners[f, 0, k], corners[f, 1, k], corners[f, 2, k])
            high = max(corners[f, 0, k], corners[f, 1, k], corners[f, 2, k])
            first[k] = max(int(np.floor(low - near)), 0)
            last[k] = min(int(np.floor(high + near)), waiting.shape[k] - 1)
        for i in range(first[0], last[0] + 1):
            for j in range(first[1], last[1] + 1):
                for k in range(first[2], last[2] + 1):
                    if waiting[i, j, k] and _meets(corners[f], i + 0.5, j + 0.5, k + 0.5, half):
                        waiting[i, j, k] = False


@leaf_kernel
def _meets(triangle: NDArray[np.float64], x: float, y: float, z: float, half: float) -> bool:
    """Return whether a triangle meets the cube around a point; its box does."""
    nx, ny, nz = 0.0, 0.0, 0.0
    for k in range(3):
        a, b = triangle[k], triangle[(k + 1) % 3]
        ex, ey, ez = b[0] - a[0], b[1] - a[1], b[2] - a[2]
        for axis in range(3):
            if axis == 0:
                px, py, pz = 0.0, ez, -ey
            elif axis == 1:
                px, py, pz = -ez, 0.0, ex
            else:
                px, py, pz = ey, -ex, 0.0
            low, high = np.inf, -np.inf
            for n in range(3):
                c = triangle[n]
                at = px * (c[0] - x) + py * (c[1] - y) + pz * (c[2] - z)
                low, high = min(low, at), max(high, at)
            reach = half * (abs(px) + abs(py) + abs(pz))
            if low > reach or high < -reach:
                return False
        if k == 0:
            c = triangle[2]
            vx, vy, vz = c[0] - a[0], c[1] - a[1], c[2] - a[2]
            nx, ny, nz = ey * vz - ez * vy, ez * vx - ex * vz, ex * vy - ey * vx
    a = triangle[0]
    off = nx * (a[0] - x) + ny * (a[1] - y) + nz * (a[2] - z)
    return bool(abs(off) <= half * (abs(nx) + abs(ny) + abs(nz)))


def _inward(corners: NDArray[np.float64], pieces: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Return (F,) the triangles of pieces that face unlike the largest piece, and are not a hollow in another."""
    number = np.unique(pieces, return_inverse=True)[1].reshape(-1)
    count = int(number.max()) + 1
    volumes = np.bincount(number, np.linalg.det(corners - corners.mean(axis=(0, 1))), count)
    volumes *= np.sign(volumes[np.abs(volumes).argmax()])
    low, high = np.full((count, 3), np.inf), np.full((count, 3), -np.inf)
    np.minimum.at(low, number, corners.min(axis=1))
    np.maximum.at(high, number, corners.max(axis=1))
    inward = np.zeros(count, np.bool_)
    for piece in np.flatnonzero(volumes < 0.0):
        around = (low <= low[piece]).all(axis=1) & (high >= high[piece]).all(axis=1)
        inward[piece] = not (around & (volumes > -volumes[piece])).any()
    result: NDArray[np.bool_] = inward[number]
    return result
