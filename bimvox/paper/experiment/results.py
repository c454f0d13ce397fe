"""The results of an experiment as values."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, fields
from typing import Any, TypeVar

from bimvox.paper.experiment.jobs import Job
from bimvox.paper.policy.episodes import Curve, CurvePoint

R = TypeVar("R", "LearningRun", "ScenarioRun", "BaselineRun")

_Cell = tuple[int, int, int]
_Box = tuple[_Cell, _Cell]


@dataclass(frozen=True, slots=True)
class LearningRun:
    """A training run: initialization layer, ablation, or beyond the paper.

    Attributes:
        mode: ``paper`` or ``ours``; ablation: ``observation-reward``; beyond the paper: ``targets`` or ``frame``.
        reached: Whether it was good enough within the budget.
        steps: Steps taken.
        budget: Steps allowed.
        curve: Every test.
        seconds: Wall time.
        cpu_seconds: Processor time.
        fresh_rate: Success rate without random actions on layouts that no test used. None if not measured.
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
        """Steps at the first test that was good enough. None if none was."""
        return self.steps if self.reached else None


@dataclass(frozen=True, slots=True)
class ScenarioRun:
    """One scenario of one mode and seed.

    Attributes:
        mode: ``paper`` or ``ours``.
        scenario: ``a`` to ``d``.
        start: Reference cell of the column in the yard: x, y.
        axis: Axis along which it lies there.
        target: Its reference cell when set.
        obstructions: Half-open boxes of cells.
        planned_cells: Reference cells of the path that the basic policy planned.
        path_cells: The same of the final path; empty if nothing was learned within the budget.
        retrained: Whether the network was retrained.
        succeeded: Whether there is a final path.
        steps: Steps of retraining.
        budget: Steps allowed.
        curve: Every test while retraining; the first, at 0 steps, tests the loaded network.
        success_rate: In the last test; for the unchanged scenario, in the trial.
        shortest_moves: Fewest moves possible.
        random_success: Success rate of random actions.
        tabular_steps: Steps of tabular Q-learning from scratch to the same requirement. None if the same budget was
            not enough.
        tabular_curve: Its tests.
        seconds: Wall time.
    """

    mode: str
    seed: int
    scenario: str
    start: tuple[int, int]
    axis: str
    target: _Cell
    obstructions: tuple[_Box, ...]
    planned_cells: tuple[_Cell, ...]
    path_cells: tuple[_Cell, ...]
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
        """Steps of retraining needed. None if the budget was not enough."""
        return self.steps if self.succeeded else None


@dataclass(frozen=True, slots=True)
class MatchedRun:
    """Retraining on a pair of sites that differ only in which end of the path the obstruction is close to.

    Attributes:
        exploration: Share of random actions at the start.
        detour_moves: Moves that either obstruction adds to the shortest path.
        near_steps: Steps with the obstruction close to the start. None if the budget was not enough.
        far_steps: The same, close to the target.
        budget: Steps allowed.
    """

    seed: int
    exploration: float
    detour_moves: int
    near_steps: int | None
    far_steps: int | None
    budget: int


@dataclass(frozen=True, slots=True)
class BaselineRun:
    """The baselines of the initialization layer for one seed.

    Attributes:
        starts: Number of distinct starts.
        random_success: Success rate of random actions.
        teacher_success: Success rate of descending the exact distance field.
        steps: Of tabular Q-learning to 100 of 100 episodes. None if the budget was not enough.
        budget: Steps allowed.
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
    """All results so far.

    Attributes:
        settings: As ``PaperSettings.to_dict`` gives them.
        initialization: One per mode and seed.
        scenarios: One per mode, seed and scenario.
        unplanned: Mode and seed of each run whose basic policy planned no usable path.
        matched: One per seed, pair and share of random actions.
        ablation: One per observation, reward and seed.
        beyond: One per case and seed.
        baselines: One per seed.
        field_seconds: Wall time of one exact distance field, by site.
        missing: Names of the missing results.
    """

    settings: dict[str, Any]
    initialization: tuple[LearningRun, ...]
    scenarios: tuple[ScenarioRun, ...]
    unplanned: tuple[tuple[str, int], ...]
    matched: tuple[MatchedRun, ...]
    ablation: tuple[LearningRun, ...]
    beyond: tuple[LearningRun, ...]
    baselines: tuple[BaselineRun, ...]
    field_seconds: dict[str, float]
    missing: tuple[str, ...]

    @property
    def is_complete(self) -> bool:
        """Whether nothing is missing."""
        return not self.missing


def results_of(
    settings: dict[str, Any], jobs: Sequence[Job], documents: Mapping[str, dict[str, Any]]
) -> ExperimentResults:
    """Return the results so far from the JSON values of the finished jobs, by the name of the job."""

    def of(part: str) -> list[dict[str, Any]]:
        return [documents[job.name] for job in jobs if job.part == part and job.name in documents]

    applied = {(d["mode"], d["seed"]): d for d in of("apply")}
    return ExperimentResults(
        settings=settings,
        initialization=tuple(_run(LearningRun, document) for document in of("initialize")),
        scenarios=tuple(_scenario_runs(applied, of("adapt"))),
        unplanned=tuple(key for key, document in applied.items() if not document["planned"]),
        matched=tuple(_matched_runs(of("matched"))),
        ablation=tuple(_run(LearningRun, document) for document in of("ablation")),
        beyond=tuple(_run(LearningRun, document) for document in of("beyond")),
        baselines=tuple(_run(BaselineRun, document) for document in of("baseline")),
        field_seconds=next((document["field_seconds"] for document in of("teacher")), {}),
        missing=tuple(job.name for job in jobs if job.name not in documents),
    )


def _run(kind: type[R], document: Mapping[str, Any], **more: Any) -> R:
    """Return a run from the JSON values that have the names of its fields."""
    known = {field.name: document[field.name] for field in fields(kind) if field.name in document}
    return kind(**{**known, "curve": _curve(document["curve"]), **more})


def _scenario_runs(
    applied: dict[tuple[str, int], dict[str, Any]], adapted: list[dict[str, Any]]
) -> Iterable[ScenarioRun]:
    """Yield the unchanged scenario of every mode and seed, then the changed ones."""
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


def _matched_runs(documents: list[dict[str, Any]]) -> Iterable[MatchedRun]:
    for d in documents:
        for pair in d["pairs"]:
            for exploration, (near, far) in zip(d["explorations"], pair["steps"], strict=True):
                yield MatchedRun(d["seed"], exploration, pair["detour_moves"], near, far, d["budget"])


def _scenario_run(mode: str, seed: int, scenario: str, layout: dict[str, Any], d: dict[str, Any]) -> ScenarioRun:
    described = layout["scenarios"][scenario]
    x, y, axis = layout["start"]
    return _run(
        ScenarioRun,
        {**described, **d},
        mode=mode,
        seed=seed,
        scenario=scenario,
        start=(x, y),
        axis=axis,
        target=_cell(layout["target"]),
        obstructions=tuple((_cell(low), _cell(high)) for low, high in described["obstructions"]),
        planned_cells=tuple(_cell(cell) for cell in layout["path_cells"]),
        path_cells=tuple(_cell(cell) for cell in d["path_cells"]),
        tabular_curve=_curve(described["tabular_curve"]),
    )


def _curve(rows: list[list[Any]]) -> Curve:
    return tuple(CurvePoint(*row) for row in rows)


def _cell(values: list[int]) -> _Cell:
    x, y, z = values
    return x, y, z
