"""The jobs of an experiment: what to do, in which order, and the name of each result.

A result's name holds the hash of everything that it depends on, including the jobs that it needs. So an interrupted run
resumes, and a changed setting repeats only what depends on it.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from bimvox.paper.policy.config import PaperDqnConfig


SCENARIOS = ("a", "b", "c", "d")

TITLES = {
    "a": "(a) training environment, nothing changes",
    "b": "(b) one obstruction close to the start",
    "c": "(c) two obstructions side by side",
    "d": "(d) one obstruction close to the target",
}

_MODE_NAMES = {"paper": "paper mode", "ours": "our mode", "authors": "the authors' script"}


def mode_name(mode: str) -> str:
    """Return the name of a mode as people read it."""
    return _MODE_NAMES.get(mode, mode)


ABLATION_OBSERVATIONS = ("paper", "window", "egocentric")
ABLATION_REWARDS = ("paper", "shaped")
ALL_MODES = ("paper", "ours", "authors")


@dataclass(frozen=True, slots=True)
class PaperSettings:
    """Everything that the results depend on.

    Attributes:
        seeds: Each is one run of everything.
        modes: Configuration by name; all of ``ALL_MODES`` by default.
        matched_pairs: Pairs of obstructions that differ in the distance alone, per seed, in paper mode.
        matched_explorations: Shares of random actions with which retraining starts there.
        matched_test_every: Steps between two tests there.
        matched_budget: Steps of one retraining there.
        ablation_seeds: Number of seeds in the ablation.
        ablation_budget: Steps of one ablation run.
        targets_budget: Steps to solve ``targets_layouts`` layouts with drawn targets.
        targets_layouts: Number of those layouts.
        frame_budget: Steps to learn the frame of four columns and four beams.
        frame_layouts: Number of drawn yards from which the frame must be built.
        fresh_layouts: Number of layouts, unused by any test, that judge these two networks at the end.
        frame_changes: Fields of ``ours`` that the frame replaces.
        tabular_budget: Steps of tabular Q-learning in the initialization layer. For retraining it gets the networks'
            budget.
    """

    seeds: tuple[int, ...]
    modes: Mapping[str, PaperDqnConfig]
    matched_pairs: int = 3
    matched_explorations: tuple[float, ...] = (1.0, 0.02)
    matched_test_every: int = 250
    matched_budget: int = 20_000
    ablation_seeds: int = 10
    ablation_budget: int = 40_000
    targets_budget: int = 2_000
    targets_layouts: int = 1_000
    frame_budget: int = 50_000
    frame_layouts: int = 1_000
    fresh_layouts: int = 1_000
    frame_changes: Mapping[str, Any] = field(default_factory=dict)
    tabular_budget: int = 100_000

    def to_dict(self) -> dict[str, Any]:
        """Return plain values for JSON."""
        return {
            **{each.name: getattr(self, each.name) for each in fields(self)},
            "seeds": list(self.seeds),
            "matched_explorations": list(self.matched_explorations),
            "modes": {name: config.to_dict() for name, config in self.modes.items()},
            "frame_changes": dict(self.frame_changes),
        }


def default_settings(seeds: int = 10, modes: tuple[str, ...] = ALL_MODES) -> PaperSettings:
    """Return the settings of the whole experiment.

    Raises:
        ValueError: A mode is unknown, or there is no seed.
    """
    from bimvox.paper.policy.config import FRAME_CHANGES, MODES

    unknown = [name for name in modes if name not in MODES]
    if unknown:
        raise ValueError(f"modes: {', '.join(unknown)} unknown; there are {', '.join(MODES)}")
    if seeds < 1:
        raise ValueError(f"seeds: {seeds} is less than one")
    return PaperSettings(tuple(range(seeds)), {name: MODES[name] for name in modes}, frame_changes=FRAME_CHANGES)


def quick_settings(seeds: int = 2, modes: tuple[str, ...] = ALL_MODES) -> PaperSettings:
    """Return settings with tiny budgets, to check that everything runs; the results mean nothing."""
    full = default_settings(seeds, modes)
    tiny = {
        name: replace(config, budget=600, retrain_budget=400, test_every=200, learning_starts=100, test_episodes=10)
        for name, config in full.modes.items()
    }
    return replace(
        full,
        modes=tiny,
        matched_pairs=1,
        matched_test_every=100,
        matched_budget=200,
        ablation_seeds=1,
        ablation_budget=400,
        targets_budget=400,
        targets_layouts=20,
        frame_budget=400,
        frame_layouts=4,
        fresh_layouts=10,
        tabular_budget=2_000,
    )


_MEANING = 3
"""Increased when the same settings give other results."""

_CHANGED = ("b", "c", "d")
"""Scenarios in which obstructions appear."""


@dataclass(frozen=True, slots=True)
class Job:
    """One piece of work for one process.

    Attributes:
        part: Kind of job.
        mode: Name of the configuration, or the case within the part.
        seed: The seed.
        options: JSON values that the part reads.
        needs: Names of the results that the job needs, by role.
    """

    part: str
    mode: str
    seed: int
    options: Mapping[str, Any]
    needs: Mapping[str, str] = field(default_factory=dict)

    @property
    def name(self) -> str:
        """File name of the result, without suffix."""
        plain = {
            "meaning": _MEANING,
            "part": self.part,
            "mode": self.mode,
            "seed": self.seed,
            "options": dict(self.options),
            "needs": dict(self.needs),
        }
        key = hashlib.sha256(json.dumps(plain, sort_keys=True).encode()).hexdigest()[:12]
        return f"{self.part}-{self.mode}-{self.seed}-{key}"


def jobs_of(settings: PaperSettings) -> tuple[Job, ...]:
    """Return the jobs of an experiment, each after the jobs that it needs."""
    jobs = [Job("teacher", "all", 0, {})]
    for seed in settings.seeds:
        for mode, config in settings.modes.items():
            jobs += _two_layers(mode, seed, config.to_dict())
        if "paper" in settings.modes:
            jobs.append(_matched(settings, seed))
        budget = settings.tabular_budget
        jobs.append(Job("baseline", "tabular", seed, {"budget": budget}))
        if "ours" in settings.modes:
            jobs += _beyond(settings, seed)
    if "paper" in settings.modes:
        for seed in settings.seeds[: settings.ablation_seeds]:
            jobs += _ablation(settings, seed)
    return tuple(jobs)


def _two_layers(mode: str, seed: int, config: dict[str, Any]) -> list[Job]:
    basic = Job("initialize", mode, seed, {"config": config})
    applied = Job("apply", mode, seed, {"config": config}, {"initialize": basic.name})
    needs = {"initialize": basic.name, "apply": applied.name}
    return [basic, applied] + [
        Job("adapt", f"{mode}-{scenario}", seed, {"config": config, "scenario": scenario, "mode": mode}, needs)
        for scenario in _CHANGED
    ]


def _matched(settings: PaperSettings, seed: int) -> Job:
    paper = settings.modes["paper"].to_dict()
    basic = Job("initialize", "paper", seed, {"config": paper})
    config = {
        **paper,
        "test_every": settings.matched_test_every,
        "retrain_budget": settings.matched_budget,
        "exploration_steps": settings.modes["paper"].exploration_phase(paper["retrain_budget"]),
    }
    options = {
        "config": config,
        "pairs": settings.matched_pairs,
        "explorations": list(settings.matched_explorations),
    }
    return Job("matched", "paper", seed, options, {"initialize": basic.name})


def _beyond(settings: PaperSettings, seed: int) -> list[Job]:
    ours = settings.modes["ours"].to_dict()
    targets = {**ours, "greedy_layouts": settings.targets_layouts, "budget": settings.targets_budget}
    frame = {
        **ours,
        **settings.frame_changes,
        "greedy_layouts": settings.frame_layouts,
        "budget": settings.frame_budget,
    }
    return [
        Job("beyond", mode, seed, {"config": config, "fresh_layouts": settings.fresh_layouts})
        for mode, config in (("targets", targets), ("frame", frame))
    ]


def _ablation(settings: PaperSettings, seed: int) -> list[Job]:
    """Return runs of the paper's learner with one choice changed; they explore as long as paper mode does."""
    paper = settings.modes["paper"]
    base = {
        **paper.to_dict(),
        "budget": settings.ablation_budget,
        "exploration_steps": min(paper.exploration_phase(paper.budget), settings.ablation_budget),
    }
    return [
        Job(
            "ablation",
            f"{observation}-{reward}",
            seed,
            {"config": {**base, "observation": observation, "reward": reward}},
        )
        for observation in ABLATION_OBSERVATIONS
        for reward in ABLATION_REWARDS
    ]
