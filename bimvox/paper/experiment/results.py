"""The results of an experiment as values; each run is read from the JSON values of its jobs and written as such."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeVar

from pydantic import BaseModel, ConfigDict

from bimvox.paper.experiment.jobs import Job
from bimvox.paper.policy.curve import Curve

_Cell = tuple[int, int, int]


class _Run(BaseModel):
    """A run with one seed; other JSON values than its fields are left out."""

    model_config = ConfigDict(frozen=True)
    seed: int


class LearningRun(_Run):
    """A training run: initialization layer, ablation, or beyond the paper."""

    mode: str
    """``paper`` or ``ours``; ablation: ``observation-reward``; beyond the paper: ``targets`` or ``frame``."""
    reached: bool
    """Whether it was good enough within the budget."""
    steps: int
    """Steps taken."""
    budget: int
    """Steps allowed."""
    curve: Curve
    """Every test."""
    seconds: float
    """Wall time."""
    cpu_seconds: float
    """Processor time."""
    fresh_rate: float | None = None
    """Success rate without random actions on layouts that no test used. None if not measured."""

    @property
    def steps_to_success(self) -> int | None:
        """Steps at the first test that was good enough. None if none was."""
        return self.steps if self.reached else None


class ScenarioRun(_Run):
    """One scenario of one mode and seed."""

    mode: str
    """``paper`` or ``ours``."""
    scenario: str
    """``a`` to ``d``."""
    start: tuple[int, int, str]
    """Reference cell of the column in the yard, x and y, and the axis along which it lies there."""
    target: _Cell
    """Its reference cell when set."""
    obstructions: tuple[tuple[_Cell, _Cell], ...]
    """Half-open boxes of cells."""
    planned_cells: tuple[_Cell, ...]
    """Reference cells of the path that the basic policy planned."""
    path_cells: tuple[_Cell, ...]
    """The same of the final path; empty if nothing was learned within the budget."""
    retrained: bool
    """Whether the network was retrained."""
    succeeded: bool
    """Whether there is a final path."""
    steps: int
    """Steps of retraining."""
    budget: int
    """Steps allowed."""
    curve: Curve
    """Every test while retraining; the first, at 0 steps, tests the loaded network."""
    success_rate: float
    """In the last test; for the unchanged scenario, in the trial."""
    shortest_moves: int
    """Fewest moves possible."""
    random_success: float
    """Success rate of random actions."""
    tabular_steps: int | None
    """Steps of tabular Q-learning from scratch to the same requirement. None if the same budget was not enough."""
    tabular_curve: Curve
    """Its tests."""
    seconds: float
    """Wall time."""

    @property
    def steps_to_success(self) -> int | None:
        """Steps of retraining needed. None if the budget was not enough."""
        return self.steps if self.succeeded else None

    @property
    def moves(self) -> int:
        """Moves of the final path."""
        return max(0, len(self.path_cells) - 1)


class MatchedRun(_Run):
    """Retraining on a pair of sites that differ only in which end of the path the obstruction is close to."""

    exploration: float
    """Share of random actions at the start."""
    detour_moves: int
    """Moves that either obstruction adds to the shortest path."""
    near_steps: int | None
    """Steps with the obstruction close to the start. None if the budget was not enough."""
    far_steps: int | None
    """The same, close to the target."""
    budget: int
    """Steps allowed."""


class BaselineRun(_Run):
    """The baselines of the initialization layer for one seed."""

    starts: int
    """Number of distinct starts."""
    random_success: float
    """Success rate of random actions."""
    teacher_success: float
    """Success rate of descending the exact distance field."""
    steps: int | None
    """Of tabular Q-learning to 100 of 100 episodes. None if the budget was not enough."""
    budget: int
    """Steps allowed."""
    curve: Curve
    """Its tests."""


R = TypeVar("R", bound=_Run)


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

    def runs(kind: type[R], part: str) -> tuple[R, ...]:
        return tuple(kind.model_validate(document) for document in of(part))

    applied = {(d["mode"], d["seed"]): d for d in of("apply")}
    return ExperimentResults(
        settings=settings,
        initialization=runs(LearningRun, "initialize"),
        scenarios=tuple(_scenario_runs(applied, of("adapt"))),
        unplanned=tuple(key for key, document in applied.items() if not document["planned"]),
        matched=tuple(_matched_runs(of("matched"))),
        ablation=runs(LearningRun, "ablation"),
        beyond=runs(LearningRun, "beyond"),
        baselines=runs(BaselineRun, "baseline"),
        field_seconds=next((document["field_seconds"] for document in of("teacher")), {}),
        missing=tuple(job.name for job in jobs if job.name not in documents),
    )


def _scenario_runs(
    applied: Mapping[tuple[str, int], dict[str, Any]], adapted: Sequence[dict[str, Any]]
) -> Iterable[ScenarioRun]:
    """Yield the unchanged scenario of every mode and seed, then the changed ones."""
    kept: dict[str, Any] = {"retrained": False, "succeeded": True, "steps": 0, "budget": 0, "curve": ()}
    for (mode, _), layout in applied.items():
        if layout["planned"]:
            trial = {"scenario": "a", "success_rate": layout["trial_success"]}
            yield _scenario_run(mode, layout, {**layout, **kept, **trial})
    for document in adapted:
        if document["planned"]:
            mode = document["mode"].rsplit("-", 1)[0]
            yield _scenario_run(mode, applied[mode, document["seed"]], document)


def _scenario_run(mode: str, layout: Mapping[str, Any], document: Mapping[str, Any]) -> ScenarioRun:
    """Return a scenario from what was made of it, on the layout on which the basic policy planned a path."""
    given = {name: layout[name] for name in ("start", "target")} | {"planned_cells": layout["path_cells"]}
    described = layout["scenarios"][document["scenario"]]
    return ScenarioRun.model_validate({**described, **document, **given, "mode": mode})


def _matched_runs(documents: Sequence[dict[str, Any]]) -> Iterable[MatchedRun]:
    for document in documents:
        for pair in document["pairs"]:
            for exploration, (near, far) in zip(document["explorations"], pair["steps"], strict=True):
                steps = {"exploration": exploration, "near_steps": near, "far_steps": far}
                yield MatchedRun.model_validate({**document, **pair, **steps})
