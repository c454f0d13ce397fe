"""Doing one job: from its description to the file of its result, in whatever process."""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bimvox.files import write_atomically
from bimvox_pipeline.paper.jobs import Job

if TYPE_CHECKING:
    from bimvox.paper.env.layout import PaperLayout
    from bimvox.paper.env.spec import PaperSpec
    from bimvox.paper.policy.learning import CurvePoint
    from bimvox.paper.policy.network import PaperNetwork

FRESH_SEED = 2_000_003
"""Of layouts that no test has used, plus the seed of the run: tests decide when training stops, and which network is
kept, so that what they say of it is too good."""

LAYOUTS_TRIED = 50
"""Starts drawn, one after the other, until the experiments find room on the planned path."""


def result_file(folder: Path, name: str) -> Path:
    """Return the file of a result; it is there when the job is done."""
    return folder / f"{name}.json"


def weights_file(folder: Path, name: str) -> Path:
    """Return the file of the network that a job gave."""
    return folder / f"{name}.safetensors"


def do_job(job: Job, folder: Path) -> None:
    """Do a job whose needs are there, and write its result."""
    wall, cpu = time.perf_counter(), time.process_time()
    result = _PARTS[job.part](job, folder)
    document = {
        "part": job.part,
        "mode": job.mode,
        "seed": job.seed,
        **result,
        "seconds": round(time.perf_counter() - wall, 3),
        "cpu_seconds": round(time.process_time() - cpu, 3),
    }
    write_json(result_file(folder, job.name), document)


def write_json(path: Path, document: dict[str, Any]) -> None:
    """Write a JSON file whole or not at all."""
    write_atomically(path, (json.dumps(document, indent=1, sort_keys=True, allow_nan=False) + "\n").encode())


def read_json(path: Path) -> dict[str, Any]:
    """Read a JSON file of ours."""
    document: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    return document


def _initialize(job: Job, folder: Path) -> dict[str, Any]:
    from bimvox.paper.env.presets import PAPER

    return _learn_basic(job, folder, PAPER)


def _learn_basic(job: Job, folder: Path, spec: PaperSpec) -> dict[str, Any]:
    from bimvox.paper.policy.config import paper_config_from_dict
    from bimvox.paper.policy.initialization import initialize
    from bimvox.paper.policy.store import network_to_bytes

    checkpoint = folder / f"{job.name}.checkpoint.safetensors"

    def keep(network: PaperNetwork, steps: int) -> None:
        write_atomically(checkpoint, network_to_bytes(network))

    config = paper_config_from_dict(dict(job.options["config"]))
    basic = initialize(spec, config, seed=job.seed, checkpoint=keep)
    write_atomically(weights_file(folder, job.name), network_to_bytes(basic.network))
    checkpoint.unlink(missing_ok=True)
    return {"reached": basic.reached, "steps": basic.steps, "budget": config.budget, "curve": _rows(basic.curve)}


def _apply(job: Job, folder: Path) -> dict[str, Any]:
    from bimvox.errors import PlanningError
    from bimvox.paper.env.layout import random_layouts
    from bimvox.paper.env.presets import PAPER
    from bimvox.paper.policy.application import apply_layout
    from bimvox.paper.policy.baselines import random_policy, tabular_q, teacher_moves
    from bimvox.paper.policy.config import paper_config_from_dict
    from bimvox.paper.policy.episodes import success_rate
    from bimvox.paper.policy.scenarios import make_scenarios

    config = paper_config_from_dict(dict(job.options["config"]))
    network = _network(folder, job.needs["initialize"])
    redrawn = -1
    for layout in random_layouts(PAPER, LAYOUTS_TRIED, job.seed):
        redrawn += 1
        applied = apply_layout(network, PAPER, config, layout, seed=job.seed)
        if not applied.episode.succeeded:
            continue
        try:
            scenarios = make_scenarios(PAPER, layout, applied.episode.path_cells)
        except PlanningError:
            continue
        break
    else:
        return {"planned": False, "tried": LAYOUTS_TRIED}
    described = {}
    for name, scenario in scenarios.items():
        there = [scenario.layout]
        table = tabular_q(
            PAPER,
            there,
            seed=job.seed,
            budget=config.retrain_budget,
            test_episodes=config.retrain_episodes,
            required_successes=config.retrain_successes,
        )
        described[name] = {
            "obstructions": [[list(low), list(high)] for low, high in scenario.layout.obstructions],
            "shortest_moves": int(teacher_moves(PAPER, there)[0]),
            "random_success": success_rate(random_policy(PAPER, there * 100, seed=job.seed)),
            "tabular_steps": table.steps_to_success,
            "tabular_curve": _rows(table.curve),
        }
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
        "scenarios": described,
    }


def _adapt(job: Job, folder: Path) -> dict[str, Any]:
    import numpy as np

    from bimvox.paper.env.presets import PAPER
    from bimvox.paper.policy.application import AppliedPolicy, adapt
    from bimvox.paper.policy.config import paper_config_from_dict
    from bimvox.paper.policy.episodes import replay
    from bimvox.paper.policy.store import network_to_bytes

    applied = read_json(result_file(folder, job.needs["apply"]))
    if not applied["planned"]:
        return {"planned": False}
    config = paper_config_from_dict(dict(job.options["config"]))
    layout = _layout_of(applied)
    planned = replay(PAPER, layout, np.array(applied["moves"], np.int64), reward=config.reward)
    boxes = applied["scenarios"][job.options["scenario"]]["obstructions"]
    changed = replace(layout, obstructions=tuple((tuple(low), tuple(high)) for low, high in boxes))
    adapted = adapt(
        _network(folder, job.needs["initialize"]),
        AppliedPolicy(planned, applied["trial_success"], layout),
        PAPER,
        config,
        changed,
        seed=job.seed,
    )
    write_atomically(weights_file(folder, job.name), network_to_bytes(adapted.network))
    return {
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


def _beyond(job: Job, folder: Path) -> dict[str, Any]:
    """Learn what the paper did not, and judge it on layouts that decided nothing."""
    from bimvox.paper.env.layout import random_layouts
    from bimvox.paper.env.presets import FOUR_COLUMNS_FOUR_BEAMS, PAPER
    from bimvox.paper.policy.config import paper_config_from_dict
    from bimvox.paper.policy.initialization import greedy_success

    spec = FOUR_COLUMNS_FOUR_BEAMS if job.mode == "frame" else replace(PAPER, random_targets=True)
    result = _learn_basic(job, folder, spec)
    config = paper_config_from_dict(dict(job.options["config"]))
    fresh = random_layouts(spec, job.options["fresh_layouts"], FRESH_SEED + job.seed)
    return {
        **result,
        "fresh_layouts": len(fresh),
        "fresh_rate": greedy_success(_network(folder, job.name), spec, config, fresh),
    }


def _baseline(job: Job, folder: Path) -> dict[str, Any]:
    from bimvox.paper.env.layout import yard_layouts
    from bimvox.paper.env.presets import PAPER
    from bimvox.paper.policy.baselines import random_policy, tabular_q, teacher_moves
    from bimvox.paper.policy.episodes import success_rate

    starts = yard_layouts(PAPER)
    table = tabular_q(
        PAPER, starts, seed=job.seed, budget=job.options["budget"], test_episodes=100, required_successes=100
    )
    return {
        "starts": len(starts),
        "random_success": success_rate(random_policy(PAPER, starts, seed=job.seed)),
        "teacher_success": float((teacher_moves(PAPER, starts) > 0).mean()),
        "budget": job.options["budget"],
        "steps": table.steps_to_success,
        "curve": _rows(table.curve),
    }


def _teacher(job: Job, folder: Path) -> dict[str, Any]:
    """Measure what the exact distance field costs, which the shaped reward is taught by."""
    from bimvox.paper.env.presets import FOUR_COLUMNS_FOUR_BEAMS, PAPER
    from bimvox.paper.policy.baselines import field_seconds

    return {"field_seconds": {"paper": field_seconds(PAPER), "frame": field_seconds(FOUR_COLUMNS_FOUR_BEAMS)}}


_PARTS: dict[str, Callable[[Job, Path], dict[str, Any]]] = {
    "initialize": _initialize,
    "ablation": _initialize,
    "apply": _apply,
    "adapt": _adapt,
    "beyond": _beyond,
    "baseline": _baseline,
    "teacher": _teacher,
}


def _network(folder: Path, name: str) -> PaperNetwork:
    from bimvox.paper.policy.store import network_from_bytes

    return network_from_bytes(weights_file(folder, name).read_bytes())


def _layout_of(applied: dict[str, Any]) -> PaperLayout:
    from bimvox.paper.env.component import YardPose
    from bimvox.paper.env.layout import PaperLayout

    x, y, axis = applied["start"]
    i, j, k = applied["target"]
    return PaperLayout((YardPose(x, y, axis),), ((i, j, k),))


def _rows(curve: tuple[CurvePoint, ...]) -> list[list[Any]]:
    return [list(point) for point in curve]
