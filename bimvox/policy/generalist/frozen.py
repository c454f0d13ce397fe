"""The held-out suite, frozen: a digest of every problem, so that two people know that they compare on the same ones.

``python -m benchmarks.freeze_suite --write`` writes the file. A problem whose digest differs was made by other versions
of the generators or of NumPy, and its results compare with nobody's. The lifts of the building are a file of their own
(``BUILDING``), because the planner made them, and the next one would make others.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, partial
from pathlib import Path
from typing import Any

import numpy as np

from bimvox.env.problem import LiftProblem, training_problem
from bimvox.errors import PolicyError
from bimvox.policy.generalist.occupancies import FAMILIES
from bimvox.policy.generalist.stages import load_stages
from bimvox.policy.generalist.suite import (
    BUILDING_COUNT,
    FAMILY_COUNT,
    SPIRAL_COUNT,
    TRAP_COUNT,
    TRAP_SHARES,
    UNSOLVABLE_COUNT,
    held_out,
    spiral,
    unsolvable,
    wide_trap,
)

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
    sets = [ProblemSet(family, FAMILY_COUNT, partial(_of_family, family)) for family in FAMILIES]
    sets.append(ProblemSet("building", BUILDING_COUNT, _of_building))
    sets.append(ProblemSet("spirals", SPIRAL_COUNT, spiral))
    sets += [ProblemSet(f"wide-trap-{share:g}", TRAP_COUNT, partial(wide_trap, share)) for share in TRAP_SHARES]
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


def frozen_text() -> str:
    """Return the content of the frozen file, made anew from the generators and the building's file."""
    sets: dict[str, dict[str, Any]] = {}
    for one in problem_sets().values():
        digests = [digest_of(one.make(number)) for number in range(one.count)]
        sets[one.name] = {"seeds": [0, one.count - 1], "digest": set_digest(digests), "digests": digests}
    sets["building"] |= {"file": BUILDING.name, "sha256": hashlib.sha256(BUILDING.read_bytes()).hexdigest()}
    return json.dumps({"format": FORMAT, "version": 1, "sets": sets}, indent=1) + "\n"


def _of_family(family: str, number: int) -> LiftProblem:
    return held_out(family, number).problem


def _of_building(number: int) -> LiftProblem:
    (stage,) = load_stages(BUILDING, number)
    return training_problem(stage.space, stage.start_vox, stage.gate_vox)
