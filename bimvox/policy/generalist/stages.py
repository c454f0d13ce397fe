"""Stages of real buildings in one plain file, so that training needs no model reader."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bimvox.env.problem import LiftProblem, training_problem
from bimvox.grid.summed_area import summed_area_table
from bimvox.policy.generalist.problems import occupancy_of, with_boxes
from bimvox.site.collision import CollisionSpace
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


def save_stages(file: Path, stages: Sequence[BuildingStage]) -> None:
    """Write stages to a compressed NumPy archive: of every array those of all stages, flat, and their shapes."""
    each = [_arrays(stage) for stage in stages]
    arrays: dict[str, NDArray[np.generic]] = {}
    for key in each[0]:
        arrays[key] = np.concatenate([one[key].reshape(-1) for one in each])
        arrays[f"{key}.shape"] = np.array([one[key].shape for one in each], np.int32)
    with file.open("wb") as stream:
        np.savez_compressed(stream, **arrays)  # type: ignore[arg-type]


def load_stages(file: Path, *numbers: int) -> list[BuildingStage]:
    """Return the stages of a file of :func:`save_stages`, or those of some numbers."""
    with np.load(file, allow_pickle=False) as archive:
        arrays = dict(archive)
    shapes = {key: arrays.pop(f"{key}.shape") for key in list(arrays) if not key.endswith(".shape")}
    ends = {key: np.cumsum(shape.prod(axis=1)) for key, shape in shapes.items()}

    def stage(n: int) -> BuildingStage:
        of_stage = {}
        for key, flat in arrays.items():
            end, shape = ends[key][n], shapes[key][n]
            of_stage[key] = flat[end - shape.prod() : end].reshape(shape)
        return _stage(of_stage)

    return [stage(n) for n in numbers or range(len(shapes["way"]))]


def _arrays(stage: BuildingStage) -> dict[str, NDArray[np.generic]]:
    space = stage.space
    occupied = occupancy_of(space)
    return {
        "grid": np.array(occupied.shape, np.int32),
        "occupied": np.packbits(occupied),
        **{name: array for name, array in space._asdict().items() if name != "table"},
        "way": np.array([stage.start_vox, stage.gate_vox], np.int32),
        "yard": stage.yard_vox,
    }


def _stage(arrays: dict[str, NDArray[np.generic]]) -> BuildingStage:
    grid, occupied, way, yard = (arrays.pop(key) for key in ("grid", "occupied", "way", "yard"))
    bits = np.unpackbits(occupied.astype(np.uint8), count=int(grid.astype(int).prod())).reshape(tuple(grid))
    space = CollisionSpace(summed_area_table(bits.astype(np.bool_)), **arrays)  # type: ignore[arg-type]
    (a, b, c), (d, e, f) = way.astype(int).tolist()
    return BuildingStage(space, (a, b, c), (d, e, f), yard.astype(np.int32))


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
