"""Random occupancies of sites by family, from a generator and a shape.

Every site has a ground slab in layer k = 0. Walls that reach the top of the site can only be bypassed at their ends.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from bimvox.site.component import IntVec

Occupancy = NDArray[np.bool_]


def boxes(rng: np.random.Generator, shape: IntVec) -> Occupancy:
    """Return boxes and free-standing walls, some of them hanging in the air."""
    occupied = _ground(shape)
    nx, ny, nz = shape
    for _ in range(int(rng.integers(3, 26))):
        size = [int(rng.integers(1, max(2, n // 4))) for n in (nx, ny)]
        height = int(rng.integers(1, nz))
        if rng.random() < 0.4:
            size[int(rng.integers(2))] = int(rng.integers(1, 3))  # a wall
            size[int(rng.integers(2))] += int(rng.integers(0, max(nx, ny) // 3))
        x, y = int(rng.integers(0, nx)), int(rng.integers(0, ny))
        foot = 1 if rng.random() < 0.8 else int(rng.integers(1, nz))
        occupied[x : x + size[0], y : y + size[1], foot : foot + height] = True
    return occupied


def courtyards(rng: np.random.Generator, shape: IntVec) -> Occupancy:
    """Return courts within walls that have gaps, or corridors between parallel walls that leave a gap at one end."""
    occupied = _ground(shape)
    nx, ny, nz = shape
    if rng.random() < 0.5:
        for _ in range(int(rng.integers(1, 5))):
            width, depth = int(rng.integers(6, max(7, 2 * nx // 3))), int(rng.integers(6, max(7, 2 * ny // 3)))
            x, y = int(rng.integers(0, max(1, nx - width))), int(rng.integers(0, max(1, ny - depth)))
            _ring(rng, occupied, x, y, width, depth, _height(rng, nz))
    else:
        along = int(rng.integers(2))
        view = occupied if along == 0 else occupied.swapaxes(0, 1)
        length, across = view.shape[:2]
        step = int(rng.integers(5, max(6, length // 2)))
        top = _height(rng, nz)
        last = bool(rng.integers(2))
        for x in range(int(rng.integers(3, step + 1)), length - 2, step):
            gap = int(rng.integers(3, max(4, across // 3)))
            view[x : x + int(rng.integers(1, 3)), :, 1:top] = True
            where = int(rng.integers(0, across - gap)) if rng.random() < 0.3 else (0 if last else across - gap)
            view[x : x + 2, where : where + gap, 1:] = False
            last = not last
    return _littered(rng, occupied, 4)


def traps(rng: np.random.Generator, shape: IntVec) -> Occupancy:
    """Return a few U-shaped traps, open to one side, high or roofed, among some litter."""
    occupied = _ground(shape)
    nx, ny, nz = shape
    for _ in range(int(rng.integers(1, 4))):
        width, depth = int(rng.integers(5, max(6, 2 * nx // 3))), int(rng.integers(5, max(6, 2 * ny // 3)))
        x, y = int(rng.integers(0, nx - width + 1)), int(rng.integers(0, ny - depth + 1))
        court = occupied[x : x + width, y : y + depth]
        u_trap(court, _height(rng, nz), opens=int(rng.integers(4)), roof=bool(rng.random() < 0.3))
    return _littered(rng, occupied, 3)


def slabs(rng: np.random.Generator, shape: IntVec) -> Occupancy:
    """Return storeys: slabs with holes, some with walls between them."""
    occupied = _ground(shape)
    nx, ny, nz = shape
    storey = int(rng.integers(4, max(5, nz)))
    x0, y0 = int(rng.integers(0, nx // 4 + 1)), int(rng.integers(0, ny // 4 + 1))
    x1, y1 = nx - int(rng.integers(0, nx // 4 + 1)), ny - int(rng.integers(0, ny // 4 + 1))
    whole = rng.random() < 0.4
    if whole:
        x0, y0, x1, y1 = 0, 0, nx, ny
    for z in range(storey, nz - 2, storey):
        occupied[x0:x1, y0:y1, z] = True
        for _ in range(int(rng.integers(1, 4))):
            a, b = int(rng.integers(3, max(4, (x1 - x0) // 2))), int(rng.integers(3, max(4, (y1 - y0) // 2)))
            x, y = int(rng.integers(x0, max(x0 + 1, x1 - a))), int(rng.integers(y0, max(y0 + 1, y1 - b)))
            occupied[x : x + a, y : y + b, z] = False
        if rng.random() < 0.4:
            x = int(rng.integers(x0, x1))
            occupied[x, y0:y1, z - storey + 1 : z] = True
            y = int(rng.integers(y0, max(y0 + 1, y1 - 4)))
            occupied[x, y : y + 4, z - storey + 1 : z] = False
    return _littered(rng, occupied, 5)


def frames(rng: np.random.Generator, shape: IntVec) -> Occupancy:
    """Return a partly built frame of columns, beams and slab strips, with stock next to it."""
    occupied = _ground(shape)
    nx, ny, nz = shape
    bay_x, bay_y = int(rng.integers(4, max(5, nx // 3))), int(rng.integers(4, max(5, ny // 3)))
    storey = int(rng.integers(4, max(5, nz - 1)))
    thick = 1 if min(nx, ny) < 40 else int(rng.integers(1, 3))
    x0, y0 = int(rng.integers(1, nx // 3 + 1)), int(rng.integers(1, ny // 3 + 1))
    columns_x, columns_y = range(x0, nx - thick, bay_x), range(y0, ny - thick, bay_y)
    levels = list(range(1, nz - storey, storey)) or [1]
    parts: list[tuple[slice, slice, slice]] = []
    for level in levels:
        head = min(nz, level + storey - 2)
        parts += [(slice(x, x + thick), slice(y, y + thick), slice(level, head)) for x in columns_x for y in columns_y]
        beams = [
            (slice(x, x + bay_x), slice(y, y + thick), slice(head, head + 1)) for x in columns_x for y in columns_y
        ]
        beams += [
            (slice(x, x + thick), slice(y, y + bay_y), slice(head, head + 1)) for x in columns_x for y in columns_y
        ]
        parts += beams
        parts += [
            (slice(x, x + bay_x), slice(y, y + bay_y), slice(head + 1, head + 2))
            for x in columns_x
            for y in columns_y
            if rng.random() < 0.8
        ]
    done = int(rng.integers(1, len(parts) + 1))
    for part in parts[:done]:
        occupied[part] = True
    return _littered(rng, occupied, 6)


FAMILIES: dict[str, Callable[[np.random.Generator, IntVec], Occupancy]] = {
    "boxes": boxes,
    "courtyards": courtyards,
    "traps": traps,
    "slabs": slabs,
    "frames": frames,
}
"""Families by name; their order is part of the seeds."""


def u_trap(court: Occupancy, top: int, *, opens: int, roof: bool) -> None:
    """Write a U-shaped trap: a ring of walls without one side.

    Args:
        court: Part of an occupancy that the trap fills, overwritten.
        top: One above the highest cell of the walls.
        opens: The open side: 0 -x, 1 +x, 2 -y, 3 +y.
        roof: Whether the trap has a roof.
    """
    sides = [court[:1], court[-1:], court[:, :1], court[:, -1:]]
    for number, side in enumerate(sides):
        if number != opens:
            side[..., 1:top] = True
    if roof:
        court[..., top - 1 : top] = True


def _ground(shape: IntVec) -> Occupancy:
    occupied = np.zeros(shape, np.bool_)
    occupied[:, :, 0] = True
    return occupied


def _height(rng: np.random.Generator, nz: int) -> int:
    """Return one above the top of a wall; in half of the cases the site's height."""
    return nz if rng.random() < 0.5 else int(rng.integers(2, nz + 1))


def _ring(rng: np.random.Generator, occupied: Occupancy, x: int, y: int, width: int, depth: int, top: int) -> None:
    """Write four walls with one to three gaps."""
    court = occupied[x : x + width, y : y + depth]
    walls = [court[:1], court[-1:], court[:, :1].swapaxes(0, 1), court[:, -1:].swapaxes(0, 1)]
    for wall in walls:
        wall[..., 1:top] = True
    for number in rng.permutation(4)[: int(rng.integers(1, 4))]:
        wall = walls[number]
        gap = int(rng.integers(2, max(3, wall.shape[1] // 2)))
        where = int(rng.integers(0, max(1, wall.shape[1] - gap)))
        wall[:, where : where + gap, 1:] = False


def _littered(rng: np.random.Generator, occupied: Occupancy, most: int) -> Occupancy:
    """Add small boxes on the ground."""
    nx, ny, nz = occupied.shape
    for _ in range(int(rng.integers(0, most + 1))):
        x, y = int(rng.integers(0, nx)), int(rng.integers(0, ny))
        a, b, c = int(rng.integers(1, max(2, nx // 8))), int(rng.integers(1, max(2, ny // 8))), int(rng.integers(1, 4))
        occupied[x : x + a, y : y + b, 1 : 1 + min(c, nz - 2)] = True
    return occupied
