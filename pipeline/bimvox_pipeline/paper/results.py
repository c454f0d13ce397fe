"""The results of an experiment, read back from its folder."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

from bimvox.errors import FileError
from bimvox_pipeline.paper.jobs import Job
from bimvox_pipeline.paper.work import read_json, result_file

MANIFEST = "experiment.json"
JOBS = "jobs"

Cell = tuple[int, int, int]
Box = tuple[Cell, Cell]


class CurveRow(NamedTuple):
    """One test.

    Attributes:
        steps: Environment steps so far.
        success_rate: With the tests' share of random actions.
        mean_reward: Of those episodes.
        greedy_rate: Without random actions, from every start; None where that was not tested.
    """

    steps: int
    success_rate: float
    mean_reward: float
    greedy_rate: float | None


Curve = tuple[CurveRow, ...]


@dataclass(frozen=True, slots=True)
class LearningRun:
    """A run of the initialization layer, of the ablation or of what goes beyond the paper.

    Attributes:
        mode: ``paper``, ``ours``; of the ablation ``observation-reward``; beyond the paper ``targets`` or ``frame``.
        seed: The seed.
        reached: Whether it was good enough within the budget.
        steps: Steps taken.
        budget: Steps there were.
        curve: Every test.
        seconds: Wall time, on whatever machine it was.
        cpu_seconds: Processor time.
        fresh_rate: Share of layouts that no test had used on which it succeeds without random actions; None where that
            was not asked.
    """

    mode: str
    seed: int
    reached: bool
    steps: int
    budget: int
    curve: Curve
    seconds: float
    cpu_seconds: float
    fresh_rate: float | None = None

    @property
    def steps_to_success(self) -> int | None:
        """Steps at the test that was good enough, None where none was."""
        return self.steps if self.reached else None


@dataclass(frozen=True, slots=True)
class ScenarioRun:
    """One scenario of one mode and seed.

    Attributes:
        mode: ``paper`` or ``ours``.
        seed: The seed.
        scenario: ``a`` to ``d``.
        start: Reference cell of the column in the yard: x, y.
        axis: Along which it lies there.
        target: Its reference cell when built in.
        obstructions: Half-open boxes of cells.
        planned_cells: Reference cells of the path that the basic policy planned.
        path_cells: And of the one built by in the end; empty where nothing was learned within the budget.
        retrained: Whether the network was trained again.
        succeeded: Whether there is a path in the end.
        steps: Steps of retraining.
        budget: Steps there were.
        curve: Every test while retraining; the first, at 0 steps, is of the loaded network.
        success_rate: In the last test; of the unchanged scenario in the trial.
        shortest_moves: Fewest moves there are.
        random_success: Success rate of random actions.
        tabular_steps: Steps of tabular Q-learning from nothing to the same requirement; None where the same budget was
            not enough.
        tabular_curve: Its tests.
        seconds: Wall time.
    """

    mode: str
    seed: int
    scenario: str
    start: tuple[int, int]
    axis: str
    target: Cell
    obstructions: tuple[Box, ...]
    planned_cells: tuple[Cell, ...]
    path_cells: tuple[Cell, ...]
    retrained: bool
    succeeded: bool
    steps: int
    budget: int
    curve: Curve
    success_rate: float
    shortest_moves: int
    random_success: float
    tabular_steps: int | None
    tabular_curve: Curve
    seconds: float

    @property
    def steps_to_success(self) -> int | None:
        """Steps of retraining that were needed, None where the budget was not enough."""
        return self.steps if self.succeeded else None


@dataclass(frozen=True, slots=True)
class BaselineRun:
    """The baselines of the initialization layer, one seed.

    Attributes:
        seed: The seed.
        starts: Distinct starts.
        random_success: Success rate of random actions.
        teacher_success: Of going down the exact distance field.
        steps: Of tabular Q-learning to 100 of 100 episodes; None where the budget was not enough.
        budget: Steps there were.
        curve: Its tests.
    """

    seed: int
    starts: int
    random_success: float
    teacher_success: float
    steps: int | None
    budget: int
    curve: Curve


@dataclass(frozen=True, slots=True)
class ExperimentResults:
    """All results that are there.

    Attributes:
        settings: As ``PaperSettings.to_dict`` gave them.
        initialization: One a mode and seed.
        scenarios: One a mode, seed and scenario.
        unplanned: Mode and seed of those whose basic policy planned no path that the experiments could use.
        ablation: One an observation, reward and seed.
        beyond: One a case and seed.
        baselines: One a seed.
        field_seconds: Wall time of one exact distance field, by site.
        missing: Names of the results that are not there.
    """

    settings: dict[str, Any]
    initialization: tuple[LearningRun, ...]
    scenarios: tuple[ScenarioRun, ...]
    unplanned: tuple[tuple[str, int], ...]
    ablation: tuple[LearningRun, ...]
    beyond: tuple[LearningRun, ...]
    baselines: tuple[BaselineRun, ...]
    field_seconds: dict[str, float]
    missing: tuple[str, ...]

    @property
    def is_complete(self) -> bool:
        """Whether nothing is missing."""
        return not self.missing


def load_results(folder: Path) -> ExperimentResults:
    """Read what an experiment has given so far.

    Raises:
        FileError: The folder is not an experiment's.
    """
    manifest = folder / MANIFEST
    if not manifest.exists():
        raise FileError(manifest, "no such file", hint="name the folder that `bimvox experiment paper -o` wrote")
    plain = read_json(manifest)
    jobs = [Job(**job) for job in plain["jobs"]]
    files = {job.name: result_file(folder / JOBS, job.name) for job in jobs}
    found = [(job, read_json(files[job.name])) for job in jobs if files[job.name].exists()]

    def of(part: str) -> list[dict[str, Any]]:
        return [document for job, document in found if job.part == part]

    applied = {(d["mode"], d["seed"]): d for d in of("apply")}
    return ExperimentResults(
        settings=plain["settings"],
        initialization=tuple(_learning_run(document) for document in of("initialize")),
        scenarios=tuple(_scenario_runs(applied, of("adapt"))),
        unplanned=tuple(key for key, document in applied.items() if not document["planned"]),
        ablation=tuple(_learning_run(document) for document in of("ablation")),
        beyond=tuple(_learning_run(document) for document in of("beyond")),
        baselines=tuple(_baseline_run(document) for document in of("baseline")),
        field_seconds=next((document["field_seconds"] for document in of("teacher")), {}),
        missing=tuple(name for name, file in files.items() if not file.exists()),
    )


def _learning_run(d: dict[str, Any]) -> LearningRun:
    return LearningRun(
        d["mode"],
        d["seed"],
        d["reached"],
        d["steps"],
        d["budget"],
        _curve(d["curve"]),
        d["seconds"],
        d["cpu_seconds"],
        d.get("fresh_rate"),
    )


def _baseline_run(d: dict[str, Any]) -> BaselineRun:
    return BaselineRun(
        d["seed"],
        d["starts"],
        d["random_success"],
        d["teacher_success"],
        d["steps"],
        d["budget"],
        _curve(d["curve"]),
    )


def _scenario_runs(
    applied: dict[tuple[str, int], dict[str, Any]], adapted: list[dict[str, Any]]
) -> Iterable[ScenarioRun]:
    """Give the unchanged scenario of every mode and seed, then the changed ones."""
    for (mode, seed), layout in applied.items():
        if layout["planned"]:
            cells = layout["path_cells"]
            kept = {
                "retrained": False,
                "succeeded": True,
                "steps": 0,
                "budget": 0,
                "curve": [],
                "success_rate": layout["trial_success"],
                "path_cells": cells,
                "seconds": layout["seconds"],
            }
            yield _scenario_run(mode, seed, "a", layout, kept)
    for document in adapted:
        if document["planned"]:
            mode = document["mode"].rsplit("-", 1)[0]
            layout = applied[mode, document["seed"]]
            yield _scenario_run(mode, document["seed"], document["scenario"], layout, document)


def _scenario_run(mode: str, seed: int, scenario: str, layout: dict[str, Any], d: dict[str, Any]) -> ScenarioRun:
    described = layout["scenarios"][scenario]
    x, y, axis = layout["start"]
    return ScenarioRun(
        mode=mode,
        seed=seed,
        scenario=scenario,
        start=(x, y),
        axis=axis,
        target=_cell(layout["target"]),
        obstructions=tuple((_cell(low), _cell(high)) for low, high in described["obstructions"]),
        planned_cells=tuple(_cell(cell) for cell in layout["path_cells"]),
        path_cells=tuple(_cell(cell) for cell in d["path_cells"]),
        retrained=d["retrained"],
        succeeded=d["succeeded"],
        steps=d["steps"],
        budget=d["budget"],
        curve=_curve(d["curve"]),
        success_rate=d["success_rate"],
        shortest_moves=described["shortest_moves"],
        random_success=described["random_success"],
        tabular_steps=described["tabular_steps"],
        tabular_curve=_curve(described["tabular_curve"]),
        seconds=d["seconds"],
    )


def _curve(rows: list[list[Any]]) -> Curve:
    return tuple(CurveRow(*row) for row in rows)


def _cell(values: list[int]) -> Cell:
    x, y, z = values
    return x, y, z
