"""Random lifts on random sites, and the numbered lessons of the generalist among them."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

import numpy as np
from numpy.typing import NDArray

from bimvox.env.problem import LiftProblem, distance_field, plain_clearance
from bimvox.grid.summed_area import summed_area_table, top_of_columns
from bimvox.policy.generalist.occupancies import FAMILIES
from bimvox.site.collision import HOOK_FORBIDDEN, NOTHING_CLEARED, CollisionSpace, placement_is_free
from bimvox.site.component import IntVec

Boxes = NDArray[np.int32]

STARTS = 96
"""Transit starts kept per training problem."""

LEAST_MOVES = 4
"""Fewest moves of a lift."""

_TARGET_TRIES = 12

LESSON_DOMAIN, HELD_OUT_DOMAIN, VALIDATION_DOMAIN = 1, 2, 3
"""First number of every seed: lessons, held-out suite and checks never share one."""

SMALLEST: IntVec = (15, 15, 6)
LESSON_SIZES: tuple[tuple[IntVec, int], ...] = (((40, 40, 16), 3), ((96, 96, 32), 5), ((160, 160, 48), 2))
"""Largest site, and how many lessons in ten are drawn up to that size."""


def random_shape(rng: np.random.Generator, smallest: IntVec, largest: IntVec) -> IntVec:
    """Return the shape of a site, log-uniform between two."""
    low, high = np.log(smallest), np.log(np.array(largest) + 0.999)
    x, y, z = np.exp(rng.uniform(low, high)).astype(int).tolist()
    return (x, y, z)


def random_boxes(rng: np.random.Generator, shape: IntVec) -> Boxes:
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
    occupied: NDArray[np.bool_], boxes: Boxes, *, rope: bool, jib_vox: tuple[float, float, float] | None = None
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


def random_lift(rng: np.random.Generator, space: CollisionSpace, starts: int = STARTS) -> LiftProblem | None:
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
            chosen = cells[rng.integers(len(cells), size=starts)]
            if around.any():
                detours = cells[around]
                chosen[::2] = detours[rng.integers(len(detours), size=len(chosen[::2]))]
            for row in chosen[: starts // 2]:
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
        problem = random_lift(rng, space)
        if problem is not None:
            return problem


def lesson(number: int, domain: int = LESSON_DOMAIN) -> LiftProblem:
    """Return the problem of a number, which determines family, size and seed."""
    names = list(FAMILIES)
    sizes = [largest for largest, tenths in LESSON_SIZES for _ in range(tenths)]
    largest = sizes[number // len(names) % len(sizes)]
    return random_problem((domain, number), names[number % len(names)], SMALLEST, largest)


def lessons(count: int, *, domain: int = LESSON_DOMAIN, first: int = 0, threads: int = 1) -> list[LiftProblem]:
    """Return ``count`` problems of a domain, from number ``first`` on, families in turn."""
    with ThreadPoolExecutor(threads) as executor:
        return list(executor.map(lambda number: lesson(number, domain), range(first, first + count)))


def with_boxes(rng: np.random.Generator, space: CollisionSpace, count: int) -> CollisionSpace:
    """Return a collision rule with random boxes added; with a rope rule, the hook stays above them.

    Args:
        rng: Draws the boxes.
        space: The rule.
        count: Number of boxes.
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
