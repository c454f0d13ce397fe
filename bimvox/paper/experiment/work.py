"""The work of each kind of job, from the results that it needs to its own."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from bimvox.errors import PlanningError
from bimvox.paper.env.layout import PaperLayout, random_layouts, yard_layouts
from bimvox.paper.env.spec import FOUR_COLUMNS_FOUR_BEAMS, PAPER, PaperSpec, YardPose
from bimvox.paper.experiment.jobs import Job
from bimvox.paper.policy.baselines import Requirement, field_seconds, random_policy, tabular_q, teacher_moves
from bimvox.paper.policy.config import PaperDqnConfig, paper_config_from_dict
from bimvox.paper.policy.curve import Curve
from bimvox.paper.policy.episodes import replay, success_rate
from bimvox.paper.policy.initialization import adapt, apply_layout, greedy_success, initialize
from bimvox.paper.policy.network import ValueNetwork
from bimvox.paper.policy.scenarios import make_scenarios, matched_pairs

_FRESH_SEED = 2_000_003
"""Added to the seed of a run, the seed of layouts that no test uses. Tests decide when training stops and which network
is kept, so their success rates are too optimistic."""

_LAYOUTS_TRIED = 50
"""Most starts drawn until the scenarios have room on the planned path."""

_Checkpoint = Callable[[ValueNetwork], None]


@dataclass(frozen=True, slots=True, eq=False)
class JobResult:
    """The result of one job.

    Attributes:
        document: JSON values.
        network: The network that the job trained. None if it trained none.
    """

    document: dict[str, Any]
    network: ValueNetwork | None = None

    @property
    def trained(self) -> ValueNetwork:
        """The network.

        Raises:
            ValueError: The job trained none.
        """
        if self.network is None:
            raise ValueError("network: this job trained none")
        return self.network


def result_of(job: Job, needs: Mapping[str, JobResult], checkpoint: _Checkpoint) -> JobResult:
    """Return the result of a job from the results that it needs, by role.

    ``checkpoint`` receives the network at every test of a training run.
    """
    if job.part in ("initialize", "ablation"):
        return _learn_basic(job, PAPER, checkpoint)
    if job.part == "apply":
        return JobResult(_apply(job, needs["initialize"].trained))
    if job.part == "adapt":
        return _adapt(job, needs["initialize"].trained, needs["apply"].document)
    if job.part == "matched":
        return JobResult(_matched(job, needs["initialize"].trained))
    if job.part == "beyond":
        return _beyond(job, checkpoint)
    if job.part == "baseline":
        return JobResult(_baseline(job))
    return JobResult(_teacher())


def _config(job: Job) -> PaperDqnConfig:
    return paper_config_from_dict(dict(job.options["config"]))


def _learn_basic(job: Job, spec: PaperSpec, checkpoint: _Checkpoint) -> JobResult:
    config = _config(job)
    basic = initialize(spec, config, seed=job.seed, checkpoint=lambda network, steps: checkpoint(network))
    document = {"reached": basic.reached, "steps": basic.steps, "budget": config.budget, "curve": _rows(basic.curve)}
    return JobResult(document, basic.network)


def _apply(job: Job, network: ValueNetwork) -> dict[str, Any]:
    config = _config(job)
    for redrawn, layout in enumerate(random_layouts(PAPER, _LAYOUTS_TRIED, job.seed)):
        applied = apply_layout(network, PAPER, config, layout, seed=job.seed)
        if not applied.episode.succeeded:
            continue
        try:
            scenarios = make_scenarios(PAPER, layout, applied.episode.path_cells)
        except PlanningError:
            continue
        start = layout.starts[0]
        return {
            "planned": True,
            "redrawn": redrawn,
            "start": [start.x, start.y, start.axis],
            "target": list(layout.targets[0]),
            "trial_success": applied.success_rate,
            "reward": applied.episode.reward,
            "moves": applied.episode.moves.tolist(),
            "path_cells": [list(cell) for cell in applied.episode.path_cells],
            "scenarios": {name: _described(job, config, changed) for name, changed in scenarios.items()},
        }
    return {"planned": False, "tried": _LAYOUTS_TRIED}


def _described(job: Job, config: PaperDqnConfig, layout: PaperLayout) -> dict[str, Any]:
    """Return a scenario with its baselines."""
    layouts = [layout]
    required = Requirement(config.retrain_episodes, config.retrain_successes)
    table = tabular_q(PAPER, layouts, seed=job.seed, budget=config.retrain_budget, required=required)
    return {
        "obstructions": [[list(low), list(high)] for low, high in layout.obstructions],
        "shortest_moves": int(teacher_moves(PAPER, layouts)[0]),
        "random_success": success_rate(random_policy(PAPER, layouts * 100, seed=job.seed)),
        "tabular_steps": table.steps_to_success,
        "tabular_curve": _rows(table.curve),
    }


def _adapt(job: Job, network: ValueNetwork, applied: dict[str, Any]) -> JobResult:
    if not applied["planned"]:
        return JobResult({"planned": False})
    config = _config(job)
    layout = _layout_of(applied)
    planned = replay(PAPER, layout, np.array(applied["moves"], np.int64), reward=config.reward)
    boxes = applied["scenarios"][job.options["scenario"]]["obstructions"]
    changed = replace(layout, obstructions=tuple((tuple(low), tuple(high)) for low, high in boxes))
    adapted = adapt(network, planned, PAPER, config, changed, seed=job.seed)
    document = {
        "planned": True,
        "scenario": job.options["scenario"],
        "retrained": adapted.retrained,
        "succeeded": adapted.succeeded,
        "steps": adapted.steps,
        "budget": config.retrain_budget,
        "collision": adapted.collision,
        "success_rate": adapted.success_rate,
        "curve": _rows(adapted.curve),
        "reward": adapted.episode.reward if adapted.episode else None,
        "path_cells": [list(cell) for cell in adapted.episode.path_cells] if adapted.episode else [],
    }
    return JobResult(document, adapted.network)


def _matched(job: Job, network: ValueNetwork) -> dict[str, Any]:
    """Retrain on both sites of every pair, with each share of random actions at the start."""
    config = _config(job)
    pairs = []
    for pair in matched_pairs(network, PAPER, config, seed=job.seed, count=job.options["pairs"]):
        start = pair.near.starts[0]
        steps = []
        for first in job.options["explorations"]:
            retrained = [
                adapt(network, pair.planned, PAPER, replace(config, exploration_again=first), changed, seed=job.seed)
                for changed in (pair.near, pair.far)
            ]
            steps.append([adapted.steps if adapted.succeeded else None for adapted in retrained])
        pairs.append(
            {
                "start": [start.x, start.y, start.axis],
                "detour_moves": pair.detour_moves,
                "near": [[list(low), list(high)] for low, high in pair.near.obstructions],
                "far": [[list(low), list(high)] for low, high in pair.far.obstructions],
                "steps": steps,
            }
        )
    return {"explorations": job.options["explorations"], "budget": config.retrain_budget, "pairs": pairs}


def _beyond(job: Job, checkpoint: _Checkpoint) -> JobResult:
    """Train on a site beyond the paper, and judge the network on layouts that decided nothing."""
    spec = FOUR_COLUMNS_FOUR_BEAMS if job.mode == "frame" else replace(PAPER, random_targets=True)
    learned = _learn_basic(job, spec, checkpoint)
    fresh = random_layouts(spec, job.options["fresh_layouts"], _FRESH_SEED + job.seed)
    fresh_rate = greedy_success(learned.trained, spec, _config(job), fresh)
    document = {**learned.document, "fresh_layouts": len(fresh), "fresh_rate": fresh_rate}
    return JobResult(document, learned.network)


def _baseline(job: Job) -> dict[str, Any]:
    starts = yard_layouts(PAPER)
    budget = job.options["budget"]
    table = tabular_q(PAPER, starts, seed=job.seed, budget=budget, required=Requirement(100, 100))
    return {
        "starts": len(starts),
        "random_success": success_rate(random_policy(PAPER, starts, seed=job.seed)),
        "teacher_success": float((teacher_moves(PAPER, starts) > 0).mean()),
        "budget": budget,
        "steps": table.steps_to_success,
        "curve": _rows(table.curve),
    }


def _teacher() -> dict[str, Any]:
    """Measure the cost of the exact distance field, the teacher behind the shaped reward."""
    return {"field_seconds": {"paper": field_seconds(PAPER), "frame": field_seconds(FOUR_COLUMNS_FOUR_BEAMS)}}


def _layout_of(applied: dict[str, Any]) -> PaperLayout:
    x, y, axis = applied["start"]
    i, j, k = applied["target"]
    return PaperLayout((YardPose(x, y, axis),), ((i, j, k),))


def _rows(curve: Curve) -> list[list[Any]]:
    return [list(point) for point in curve]
