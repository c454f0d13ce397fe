"""The held-out suite: deterministic problems that no lesson contains, each generated on request, and frozen.

The frozen file has a digest of every problem, so that two people know that they compare on the same ones. ``python -m
benchmarks.freeze_suite --write`` writes it. A problem whose digest differs was made by other versions of the generators
or of NumPy, and its results compare with nobody's. The lifts of the building are a file of their own (``BUILDING``),
because the planner made them, and the next one would make others.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, partial
from pathlib import Path

import numpy as np

from bimvox.env.observation import WIDEST_WINDOW_VOX
from bimvox.env.problem import UNREACHABLE, LiftProblem, training_problem
from bimvox.errors import PolicyError
from bimvox.grid.summed_area import summed_area_table
from bimvox.policy.generalist.problems import (
    FAMILIES,
    HELD_OUT_DOMAIN,
    SMALLEST,
    clearance_on,
    occupancy_of,
    random_boxes,
    random_clearance,
    random_problem,
    random_shape,
    u_trap,
)
from bimvox.site.collision import CollisionSpace, placement_is_free
from bimvox.site.component import IntVec

_FAMILY_COUNT = 210
"""Problems of each family."""

BUILDING_COUNT = 150
"""Lifts of the building that no lesson contains."""

UNSOLVABLE_COUNT = 150

_TRAP_SHARES = (0.1, 0.25, 0.5, 0.75, 1.0, 1.5)
"""Widths of the traps of :func:`wide_trap` over the view's widest window (224 cells)."""

_TRAP_COUNT = 12
"""Problems per width."""

_SPIRAL_COUNT = 100
"""Lifts out of a spiral, a family without lessons."""

_SUITE_SIZES: tuple[tuple[IntVec, int], ...] = (
    ((40, 40, 16), 4),
    ((96, 96, 32), 4),
    ((200, 200, 60), 1),
    ((400, 400, 100), 1),
)
"""Largest site, and how many problems in ten are drawn up to that size."""


@dataclass(frozen=True, slots=True, eq=False)
class _HeldOut:
    """One problem of the suite.

    Attributes:
        family: Its family's name.
        number: Its number there.
        problem: From ``start_vox`` to ``target_vox``, with its distance field.
    """

    family: str
    number: int
    problem: LiftProblem


def held_out(family: str, number: int) -> _HeldOut:
    """Return a problem of a family by its number."""
    sizes = [largest for largest, share in _SUITE_SIZES for _ in range(share)]
    largest = sizes[number % len(sizes)]
    return _HeldOut(family, number, random_problem((HELD_OUT_DOMAIN, number), family, SMALLEST, largest))


def unsolvable(number: int) -> LiftProblem:
    """Return a lift without a path: its target or its start is in a closed room."""
    names = list(FAMILIES)
    attempt = 0
    while True:
        rng = np.random.default_rng((HELD_OUT_DOMAIN, 77, number, attempt))
        attempt += 1
        space = random_clearance(rng, names[number % len(names)], random_shape(rng, SMALLEST, (64, 64, 24)))
        cells = [_free(rng, space) for _ in range(2)]
        if cells[0] is None or cells[1] is None:
            continue
        closed = _closed_in(space, cells[number % 2] or (0, 0, 0), 1 + int(rng.integers(3)))
        start, target = cells[0], cells[1]
        if not (placement_is_free(closed, *start) and placement_is_free(closed, *target)):
            continue
        problem = training_problem(closed, start, target)
        if problem.distance_from(start) == UNREACHABLE:
            return problem


def wide_trap(share: float, number: int) -> LiftProblem:
    """Return a lift from inside a U-shaped trap as high as the site to a target behind it.

    Args:
        share: Width of the trap over ``WIDEST_WINDOW_VOX``.
        number: Determines proportions, component and cells.
    """
    rng = np.random.default_rng((HELD_OUT_DOMAIN, 55, int(1000 * share), number))
    width = max(8, round(share * WIDEST_WINDOW_VOX))
    depth = max(6, int(rng.uniform(0.3, 1.0) * width))
    nx, ny, nz = depth + 48, width + 48, 8
    occupied = np.zeros((nx, ny, nz), np.bool_)
    occupied[:, :, 0] = True
    u_trap(occupied[24 : 24 + depth, 24 : 24 + width], nz, opens=0, roof=False)
    space = clearance_on(occupied, random_boxes(rng, (24, 24, nz)), rope=bool(rng.integers(2)))
    while True:
        start = (
            24 + int(rng.uniform(0.5, 0.9) * depth),
            24 + int(rng.uniform(0.2, 0.8) * width),
            int(rng.integers(2, nz - 2)),
        )
        target = (
            24 + depth + int(rng.integers(4, 20)),
            24 + int(rng.uniform(0.2, 0.8) * width),
            int(rng.integers(1, nz - 2)),
        )
        if placement_is_free(space, *start) and placement_is_free(space, *target):
            problem = training_problem(space, start, target)
            if problem.distance_from(start) > 0:
                return problem
        space = clearance_on(occupied, random_boxes(rng, (24, 24, nz)), rope=bool(rng.integers(2)))


def spiral(number: int) -> LiftProblem:
    """Return a lift from the middle of a spiral of walls as high as the site to a target outside it.

    No generator of lessons makes a spiral.

    Args:
        number: Determines corridor, turns, component and cells.
    """
    rng = np.random.default_rng((HELD_OUT_DOMAIN, 66, number))
    corridor, legs, nz = int(rng.integers(5, 13)), int(rng.integers(4, 10)), 8
    half = corridor * (legs // 2 + 1) + 12
    occupied = np.zeros((2 * half, 2 * half, nz), np.bool_)
    occupied[:, :, 0] = True
    at, heading = np.array([half, half]), np.array([1, 0])
    for leg in range(legs):
        there = at + heading * corridor * (leg // 2 + 1)
        (x0, y0), (x1, y1) = np.minimum(at, there), np.maximum(at, there)
        occupied[x0 : x1 + 1, y0 : y1 + 1] = True
        at, heading = there, np.array([-heading[1], heading[0]])
    while True:
        space = clearance_on(occupied, random_boxes(rng, (16, 16, nz)), rope=bool(rng.integers(2)))
        start = (half + int(rng.integers(1, corridor)), half + int(rng.integers(1, corridor)), int(rng.integers(1, nz)))
        target = (int(rng.integers(2 * half)), int(rng.integers(2 * half)), int(rng.integers(1, nz)))
        outside = max(abs(target[0] - half), abs(target[1] - half)) > half - 10
        if outside and placement_is_free(space, *start) and placement_is_free(space, *target):
            problem = training_problem(space, start, target)
            if problem.distance_from(start) > 0:
                return problem


def _free(rng: np.random.Generator, space: CollisionSpace) -> IntVec | None:
    shape = np.array(space.table.shape) - 1
    for _ in range(200):
        x, y, z = (int(n) for n in rng.integers(0, shape))
        if placement_is_free(space, x, y, z):
            return (x, y, z)
    return None


def _closed_in(space: CollisionSpace, cell: IntVec, room: int) -> CollisionSpace:
    """Return the rule with a shell of walls, one cell thick, ``room`` cells away from the component at a cell."""
    occupied = occupancy_of(space)
    low = np.maximum(np.array(cell) + space.boxes[:, :3].min(axis=0) - room - 1, 0)
    high = np.array(cell) + space.boxes[:, 3:].max(axis=0) + room + 1
    shell = np.zeros_like(occupied)
    shell[low[0] : high[0], low[1] : high[1], low[2] : high[2]] = True
    shell[low[0] + 1 : high[0] - 1, low[1] + 1 : high[1] - 1, low[2] + 1 : high[2] - 1] = False
    return space._replace(table=summed_area_table(occupied | shell))


FROZEN = Path(__file__).with_name("suite.json")
BUILDING = Path(__file__).with_name("building.npz")
FORMAT = "bimvox-held-out-suite"


@dataclass(frozen=True, slots=True)
class ProblemSet:
    """A set of the suite.

    Attributes:
        name: Its name.
        count: Number of problems.
        make: Returns the problem of a number below ``count``; the number is its seed.
    """

    name: str
    count: int
    make: Callable[[int], LiftProblem]


def problem_sets() -> dict[str, ProblemSet]:
    """Return the sets of the suite by name: families, building, spirals, U-traps by width, lifts without a path."""
    sets = [ProblemSet(family, _FAMILY_COUNT, partial(_of_family, family)) for family in FAMILIES]
    sets.append(ProblemSet("building", BUILDING_COUNT, _of_building))
    sets.append(ProblemSet("spirals", _SPIRAL_COUNT, spiral))
    sets += [ProblemSet(f"wide-trap-{share:g}", _TRAP_COUNT, partial(wide_trap, share)) for share in _TRAP_SHARES]
    sets.append(ProblemSet("unsolvable", UNSOLVABLE_COUNT, unsolvable))
    return {one.name: one for one in sets}


def digest_of(problem: LiftProblem) -> str:
    """Return the first 16 hexadecimal digits of the SHA-256 of all that decides a problem.

    That is, as little-endian int32, each array after its shape: the summed-area table of the occupied cells (its shape
    is the grid's plus one), boxes, hook and lowest hook cells, start, target, fewest moves (-1 without a path);
    then, if the space has any, the cleared placements and the highest hook cells.
    """
    sha = hashlib.sha256()
    space = problem.space
    fewest = problem.distance_from(problem.start_vox)
    way = (problem.start_vox, problem.target_vox, fewest)
    cleared = (space.cleared_low, space.cleared) if space.cleared.size else ()
    ceiling = (space.hook_ceiling,) if space.hook_ceiling.size else ()
    for array in (space.table, space.boxes, space.hook_offset, space.hook_floor, *way, *cleared, *ceiling):
        plain = np.ascontiguousarray(array, "<i4")
        sha.update(np.array(np.shape(array), "<i4").tobytes())
        sha.update(plain.tobytes())
    return sha.hexdigest()[:16]


def set_digest(digests: list[str]) -> str:
    """Return the digest of several problems in their order: SHA-256 of their digests, one a line."""
    return hashlib.sha256("".join(f"{digest}\n" for digest in digests).encode()).hexdigest()


@cache
def frozen_digests() -> dict[str, list[str]]:
    """Return the digests of the frozen file: of each set, by number."""
    document = json.loads(FROZEN.read_text())
    return {name: list(one["digests"]) for name, one in document["sets"].items()}


def frozen_problem(one: ProblemSet, number: int) -> LiftProblem:
    """Return a problem of the suite, after comparing it with its frozen digest.

    Raises:
        PolicyError: It is not the frozen one.
    """
    problem = one.make(number)
    found, frozen = digest_of(problem), frozen_digests()[one.name][number]
    if found != frozen:
        raise PolicyError(
            f"problem {number} of {one.name} is not the frozen one: its digest is {found}, not {frozen}",
            differs={"digest": (found, frozen)},
            hint="its generator or NumPy has changed: install the versions of constraints.txt",
        )
    return problem


def _of_family(family: str, number: int) -> LiftProblem:
    return held_out(family, number).problem


def _of_building(number: int) -> LiftProblem:
    """Return a lift of the building's file: of every array those of all lifts, flat, and their shapes."""
    with np.load(BUILDING, allow_pickle=False) as archive:
        arrays = dict(archive)
    of_lift = {}
    for key in [key for key in arrays if not key.endswith(".shape")]:
        shapes = arrays[f"{key}.shape"]
        end = int(shapes[: number + 1].prod(axis=1).sum())
        of_lift[key] = arrays[key][end - int(shapes[number].prod()) : end].reshape(shapes[number])
    grid, occupied, way, _ = (of_lift.pop(key) for key in ("grid", "occupied", "way", "yard"))
    bits = np.unpackbits(occupied.astype(np.uint8), count=int(grid.astype(int).prod())).reshape(tuple(grid))
    space = CollisionSpace(summed_area_table(bits.astype(np.bool_)), **of_lift)
    (a, b, c), (d, e, f) = way.astype(int).tolist()
    return training_problem(space, (a, b, c), (d, e, f))
