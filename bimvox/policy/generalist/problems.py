"""Random lifts on random sites of five families, of lessons and of the held-out suite.

Every site has a ground slab in layer k = 0. Walls that reach the top of the site can only be bypassed at their ends.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from bimvox.env.problem import LiftProblem, distance_field, plain_clearance
from bimvox.grid.summed_area import summed_area_table, top_of_columns
from bimvox.site.collision import HOOK_FORBIDDEN, NOTHING_CLEARED, CollisionSpace, placement_is_free
from bimvox.site.component import IntVec

_Occupancy = NDArray[np.bool_]


def boxes(rng: np.random.Generator, shape: IntVec) -> _Occupancy:
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


def courtyards(rng: np.random.Generator, shape: IntVec) -> _Occupancy:
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


def traps(rng: np.random.Generator, shape: IntVec) -> _Occupancy:
    """Return a few U-shaped traps, open to one side, high or roofed, among some litter."""
    occupied = _ground(shape)
    nx, ny, nz = shape
    for _ in range(int(rng.integers(1, 4))):
        width, depth = int(rng.integers(5, max(6, 2 * nx // 3))), int(rng.integers(5, max(6, 2 * ny // 3)))
        x, y = int(rng.integers(0, nx - width + 1)), int(rng.integers(0, ny - depth + 1))
        court = occupied[x : x + width, y : y + depth]
        u_trap(court, _height(rng, nz), opens=int(rng.integers(4)), roof=bool(rng.random() < 0.3))
    return _littered(rng, occupied, 3)


def slabs(rng: np.random.Generator, shape: IntVec) -> _Occupancy:
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


def frames(rng: np.random.Generator, shape: IntVec) -> _Occupancy:
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


FAMILIES: dict[str, Callable[[np.random.Generator, IntVec], _Occupancy]] = {
    "boxes": boxes,
    "courtyards": courtyards,
    "traps": traps,
    "slabs": slabs,
    "frames": frames,
}
"""Families by name; their order is part of the seeds."""


def u_trap(court: _Occupancy, top: int, *, opens: int, roof: bool) -> None:
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


def _ground(shape: IntVec) -> _Occupancy:
    occupied = np.zeros(shape, np.bool_)
    occupied[:, :, 0] = True
    return occupied


def _height(rng: np.random.Generator, nz: int) -> int:
    """Return one above the top of a wall; in half of the cases the site's height."""
    return nz if rng.random() < 0.5 else int(rng.integers(2, nz + 1))


def _ring(rng: np.random.Generator, occupied: _Occupancy, x: int, y: int, width: int, depth: int, top: int) -> None:
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


def _littered(rng: np.random.Generator, occupied: _Occupancy, most: int) -> _Occupancy:
    """Add small boxes on the ground."""
    nx, ny, nz = occupied.shape
    for _ in range(int(rng.integers(0, most + 1))):
        x, y = int(rng.integers(0, nx)), int(rng.integers(0, ny))
        a, b, c = int(rng.integers(1, max(2, nx // 8))), int(rng.integers(1, max(2, ny // 8))), int(rng.integers(1, 4))
        occupied[x : x + a, y : y + b, 1 : 1 + min(c, nz - 2)] = True
    return occupied


_Boxes = NDArray[np.int32]

_STARTS = 96
"""Transit starts kept per training problem."""

LEAST_MOVES = 4
"""Fewest moves of a lift."""

_TARGET_TRIES = 12

LESSON_DOMAIN, HELD_OUT_DOMAIN, VALIDATION_DOMAIN = 1, 2, 3
"""First number of every seed: lessons, held-out suite and checks never share one."""

SMALLEST: IntVec = (15, 15, 6)


def random_shape(rng: np.random.Generator, smallest: IntVec, largest: IntVec) -> IntVec:
    """Return the shape of a site, log-uniform between two."""
    low, high = np.log(smallest), np.log(np.array(largest) + 0.999)
    x, y, z = np.exp(rng.uniform(low, high)).astype(int).tolist()
    return (x, y, z)


def random_boxes(rng: np.random.Generator, shape: IntVec) -> _Boxes:
    """Return the boxes of a component: a cell, a column, a beam, a slab, or an L, (B, 6) int32."""
    nx, ny, nz = shape
    longest = max(2, min(nx, ny) // 4)
    tallest = max(2, nz // 2)
    kind = int(rng.integers(6))
    thin = 1 if min(nx, ny) < 40 else int(rng.integers(1, 3))
    if kind == 0:
        sizes = [(1, 1, 1)]
    elif kind == 1:
        sizes = [(thin, thin, int(rng.integers(2, tallest + 1)))]
    elif kind == 2:
        sizes = [(int(rng.integers(2, longest + 1)), thin, min(thin, nz // 3))]
    elif kind == 3:
        sizes = [(thin, int(rng.integers(2, longest + 1)), min(thin, nz // 3))]
    elif kind == 4:
        sizes = [(int(rng.integers(2, longest + 1)), int(rng.integers(2, longest + 1)), 1)]
    else:
        sizes = [
            (int(rng.integers(2, longest + 1)), 1, int(rng.integers(1, tallest // 2 + 1))),
            (1, int(rng.integers(2, longest + 1)), int(rng.integers(1, tallest // 2 + 1))),
        ]
    boxes = np.array([[0, 0, 0, *size] for size in sizes], np.int32)
    reference = (int(rng.integers(sizes[0][0])), int(rng.integers(sizes[0][1])), 0)  # not always a corner
    return boxes - np.array([*reference, *reference], np.int32)


def clearance_on(
    occupied: NDArray[np.bool_], boxes: _Boxes, *, rope: bool, jib_vox: tuple[float, float, float] | None = None
) -> CollisionSpace:
    """Return the collision rule for a component hung by the middle of its top.

    Args:
        occupied: (X, Y, Z) occupied cells.
        boxes: (B, 6) int32 the component.
        rope: Whether the column above the hook must be free.
        jib_vox: Column of the mast (x, y) and reach of the jib, cells; without it, no limit of reach.
    """
    floor = top_of_columns(occupied) if rope else np.zeros(occupied.shape[:2], np.int32)
    if jib_vox is not None:
        x, y, reach = jib_vox
        i, j = np.indices(occupied.shape[:2])
        floor[(i - x) ** 2 + (j - y) ** 2 > reach**2] = HOOK_FORBIDDEN
    low, high = boxes[:, :3].min(axis=0), boxes[:, 3:].max(axis=0)
    hook = np.array([(low[0] + high[0]) // 2, (low[1] + high[1]) // 2, high[2]], np.int32)
    return plain_clearance(CollisionSpace(summed_area_table(occupied), boxes, hook, floor, *NOTHING_CLEARED))


def random_clearance(rng: np.random.Generator, family: str, shape: IntVec) -> CollisionSpace:
    """Return a site of a family with a component; half of them with a rope rule, 30 % with a limited reach."""
    occupied = FAMILIES[family](rng, shape)
    boxes = random_boxes(rng, shape)
    jib = None
    if rng.random() < 0.3:
        mast = rng.uniform((0, 0), shape[:2])
        jib = (float(mast[0]), float(mast[1]), float(rng.uniform(0.6, 1.1) * max(shape[:2])))
    return clearance_on(occupied, boxes, rope=bool(rng.random() < 0.5), jib_vox=jib)


def _random_lift(rng: np.random.Generator, space: CollisionSpace) -> LiftProblem | None:
    """Return a lift with a target reachable from much of the site. None if no random target is.

    Two thirds of the targets and half of the starts are lowered as far as the component can go. Half of the starts need
    a detour, if any start does.
    """
    for _ in range(_TARGET_TRIES):
        target = _free_cell(rng, space)
        if target is None:
            return None
        field = distance_field(space, np.array(target, np.int32))
        if (field >= LEAST_MOVES).sum() >= 16:
            cells = np.argwhere(field >= LEAST_MOVES).astype(np.int32)
            around = field[tuple(cells.T)] > np.abs(cells - np.array(target, np.int32)).sum(axis=1)
            chosen = cells[rng.integers(len(cells), size=_STARTS)]
            if around.any():
                detours = cells[around]
                chosen[::2] = detours[rng.integers(len(detours), size=len(chosen[::2]))]
            for row in chosen[: _STARTS // 2]:
                while row[2] > 0 and field[row[0], row[1], row[2] - 1] >= LEAST_MOVES:
                    row[2] -= 1
            chosen = chosen[rng.permutation(len(chosen))]
            first = (int(chosen[0, 0]), int(chosen[0, 1]), int(chosen[0, 2]))
            return LiftProblem(space, first, target, np.unique(chosen, axis=0).astype(np.int32), field)
    return None


def _free_cell(rng: np.random.Generator, space: CollisionSpace) -> IntVec | None:
    """Return a free placement, in two of three cases lowered as far as it can go. None if none is found."""
    shape = np.array(space.table.shape) - 1
    for _ in range(400):
        x, y, z = (int(n) for n in rng.integers(0, shape))
        if placement_is_free(space, x, y, z):
            if rng.random() < 2 / 3:
                while placement_is_free(space, x, y, z - 1):
                    z -= 1
            return (x, y, z)
    return None


def random_problem(seed: tuple[int, ...], family: str, smallest: IntVec, largest: IntVec) -> LiftProblem:
    """Return the lift of a seed; deterministic.

    Args:
        seed: Numbers that name the lift.
        family: A key of ``FAMILIES``.
        smallest: Least shape of its site.
        largest: Greatest shape.
    """
    rng = np.random.default_rng((*seed, list(FAMILIES).index(family)))
    while True:
        space = random_clearance(rng, family, random_shape(rng, smallest, largest))
        problem = _random_lift(rng, space)
        if problem is not None:
            return problem


def with_boxes(rng: np.random.Generator, space: CollisionSpace, count: int) -> CollisionSpace:
    """Return a collision rule with random boxes added; with a rope rule, the hook stays above them.

    ``rng``: draws the boxes.
    """
    occupied = occupancy_of(space)
    nx, ny, nz = occupied.shape
    added = np.zeros_like(occupied)
    for _ in range(count):
        size = [int(rng.integers(1, max(2, n // 5))) for n in (nx, ny)] + [int(rng.integers(1, max(2, nz // 2)))]
        x, y = int(rng.integers(nx)), int(rng.integers(ny))
        z = 1 if rng.random() < 0.7 else int(rng.integers(1, nz))
        added[x : x + size[0], y : y + size[1], z : z + size[2]] = True
    rope = bool(((space.hook_floor > 0) & (space.hook_floor < HOOK_FORBIDDEN)).any())
    floor = np.maximum(space.hook_floor, top_of_columns(added)) if rope else space.hook_floor
    return space._replace(table=summed_area_table(occupied | added), hook_floor=floor.astype(np.int32))


def occupancy_of(space: CollisionSpace) -> NDArray[np.bool_]:
    """Return the (X, Y, Z) cells of a summed-area table."""
    occupied: NDArray[np.bool_] = np.diff(np.diff(np.diff(space.table, axis=0), axis=1), axis=2) > 0
    return occupied
