"""The jobs of an experiment: what to do, in which order, and the name of each result.

A result's name holds the hash of everything that it depends on, including the jobs that it needs. So an interrupted run
resumes, and a changed setting repeats only what depends on it.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from bimvox.paper.experiment.settings import ABLATION_OBSERVATIONS, ABLATION_REWARDS, PaperSettings

MEANING = 3
"""Increased when the same settings give other results."""

CHANGED = ("b", "c", "d")
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
            "meaning": MEANING,
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
        for scenario in CHANGED
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
