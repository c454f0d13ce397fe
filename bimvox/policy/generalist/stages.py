"""Stages of real buildings in one plain file, so that training needs no model reader."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bimvox.env.problem import LiftProblem, training_problem
from bimvox.grid.summed_area import summed_area_table
from bimvox.policy.generalist.problems import occupancy_of, with_boxes
from bimvox.site.collision import NOTHING_CLEARED, CollisionSpace
from bimvox.site.component import IntVec


@dataclass(frozen=True, slots=True, eq=False)
class BuildingStage:
    """A building before one of its lifts.

    Attributes:
        space: The collision rule.
        start_vox: Cell where transit starts.
        gate_vox: Cell where it ends.
        yard_vox: (S, 3) int32 starts all over the yard.
    """

    space: CollisionSpace
    start_vox: IntVec
    gate_vox: IntVec
    yard_vox: NDArray[np.int32]


def save_stages(file: Path, stages: list[BuildingStage]) -> None:
    """Write stages to a compressed NumPy archive of plain arrays."""
    arrays: dict[str, NDArray[np.generic]] = {}
    for n, stage in enumerate(stages):
        occupied = occupancy_of(stage.space)
        arrays[f"{n}.shape"] = np.array(occupied.shape, np.int32)
        arrays[f"{n}.occupied"] = np.packbits(occupied)
        arrays[f"{n}.boxes"] = stage.space.boxes
        arrays[f"{n}.hook_offset"] = stage.space.hook_offset
        arrays[f"{n}.hook_floor"] = stage.space.hook_floor
        arrays[f"{n}.way"] = np.array([stage.start_vox, stage.gate_vox], np.int32)
        arrays[f"{n}.yard"] = stage.yard_vox
    with file.open("wb") as stream:
        np.savez_compressed(stream, **arrays)  # type: ignore[arg-type]


def load_stages(file: Path) -> list[BuildingStage]:
    """Return the stages of a file of :func:`save_stages`."""
    with np.load(file, allow_pickle=False) as archive:
        count = sum(name.endswith(".shape") for name in archive.files)
        return [_stage({key: archive[f"{n}.{key}"] for key in _KEYS}) for n in range(count)]


_KEYS = ("shape", "occupied", "boxes", "hook_offset", "hook_floor", "way", "yard")


def _stage(arrays: dict[str, NDArray[np.generic]]) -> BuildingStage:
    shape = tuple(int(n) for n in arrays["shape"])
    bits = np.unpackbits(arrays["occupied"].astype(np.uint8), count=int(np.prod(shape)))
    space = CollisionSpace(
        summed_area_table(bits.reshape(shape).astype(np.bool_)),
        arrays["boxes"].astype(np.int32),
        arrays["hook_offset"].astype(np.int32),
        arrays["hook_floor"].astype(np.int32),
        *NOTHING_CLEARED,
    )
    (a, b, c), (d, e, f) = arrays["way"].astype(int).tolist()
    return BuildingStage(space, (a, b, c), (d, e, f), arrays["yard"].astype(np.int32))


def building_lifts(stages: list[BuildingStage], *, count: int, domain: int, starts: int) -> list[LiftProblem]:
    """Return lifts at random stages of buildings, with random boxes in three of four.

    Args:
        stages: Of the buildings.
        count: Number of lifts; fewer if too many stages are unsolvable.
        domain: First number of their seeds.
        starts: Starts per lift, drawn from the yard.
    """
    problems: list[LiftProblem] = []
    for number in range(20 * count):
        if len(problems) == count or not stages:
            break
        rng = np.random.default_rng((domain, 99, number))
        stage = stages[int(rng.integers(len(stages)))]
        space = stage.space
        if rng.random() < 0.75:
            space = with_boxes(rng, space, int(rng.integers(1, 9)))
        problem = training_problem(
            space, stage.start_vox, stage.gate_vox, rng.permutation(stage.yard_vox)[: 4 * starts]
        )
        if len(problem.starts_vox):
            chosen = rng.permutation(problem.starts_vox)[:starts]
            first = (int(chosen[0, 0]), int(chosen[0, 1]), int(chosen[0, 2]))
            problems.append(LiftProblem(problem.space, first, stage.gate_vox, chosen, problem.distance))
    return problems
