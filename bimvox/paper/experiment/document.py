"""The results of an experiment as one JSON document, and all its curves as CSV."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Sequence
from dataclasses import asdict
from typing import Any

from bimvox.paper.experiment.findings import CensoredSteps, Finding, findings_of, matched_finding, mean_interval
from bimvox.paper.experiment.jobs import ABLATION_OBSERVATIONS, ABLATION_REWARDS, SCENARIOS
from bimvox.paper.experiment.results import ExperimentResults, LearningRun, ScenarioRun
from bimvox.paper.policy.curve import Curve

_NAMED_FIRST = "paper"
"""The mode whose scenarios come first in the document, if it was run."""


def document_of(results: ExperimentResults) -> dict[str, Any]:
    """Return everything as JSON values.

    ``scenarios`` is that of paper mode, or of the only mode; ``modes`` holds all of them.
    """
    names = sorted(results.settings["modes"], key=lambda mode: (mode != _NAMED_FIRST, mode))
    modes = {mode: _mode(results, mode) for mode in names}
    first = names[0]
    return {
        "scenarios": modes[first]["scenarios"],
        "mode": first,
        "modes": modes,
        "matched": _matched(results),
        "ablation": _ablation(results),
        "beyond": _beyond(results),
        "baselines": _baselines(results),
        "teacher": _teacher(results),
        "settings": results.settings,
        "complete": results.is_complete,
        "missing": list(results.missing),
    }


def _mode(results: ExperimentResults, mode: str) -> dict[str, Any]:
    config = results.settings["modes"][mode]
    seeds = results.settings["seeds"]
    layers = [run for run in results.initialization if run.mode == mode]
    runs = [run for run in results.scenarios if run.mode == mode]
    findings = findings_of(runs, test_every=config["test_every"], seeds=seeds)
    return {
        "initialization": _learning(layers),
        "scenarios": {
            scenario: _scenario([run for run in runs if run.scenario == scenario], layers) for scenario in SCENARIOS
        },
        "findings": [_finding(finding) for finding in findings],
        "unplanned": [seed for unplanned, seed in results.unplanned if unplanned == mode],
    }


def _finding(finding: Finding) -> dict[str, Any]:
    return {
        **asdict(finding),
        "verdict": finding.verdict.value,
        "test": asdict(finding.test) if finding.test else None,
    }


def _matched(results: ExperimentResults) -> list[dict[str, Any]]:
    """Return finding 2 on matched pairs, for each share of random actions with which retraining starts."""
    test_every = results.settings["matched_test_every"]
    judged = []
    for exploration in results.settings["matched_explorations"]:
        runs = [run for run in results.matched if run.exploration == exploration]
        if runs:
            near, far = ([getattr(run, f"{end}_steps") for run in runs] for end in ("near", "far"))
            judged.append(
                {
                    "exploration": exploration,
                    "test_every": test_every,
                    "finding": _finding(matched_finding(runs, test_every=test_every)),
                    "near": CensoredSteps(tuple(near), runs[0].budget).text(),
                    "far": CensoredSteps(tuple(far), runs[0].budget).text(),
                    "pairs": [run.model_dump() for run in runs],
                }
            )
    return judged


def _scenario(runs: Sequence[ScenarioRun], layers: Sequence[LearningRun]) -> dict[str, Any]:
    """Return one scenario; for the unchanged site the curve is the initialization layer's, as in the paper."""
    learned = layers if runs and runs[0].scenario == "a" else runs
    steps = _steps(learned)
    return {
        "steps_to_success": steps.median if runs else None,
        "steps_to_success_text": steps.text() if runs else None,
        "success_rate": float(sum(run.success_rate for run in runs) / len(runs)) if runs else None,
        "curve": mean_curve([run.curve for run in learned]),
        "path_cells": [list(cell) for cell in runs[0].path_cells] if runs else [],
        "seeds": [_scenario_seed(run) for run in runs],
        "learned": sum(run.succeeded for run in runs),
        "retrained": sum(run.retrained for run in runs),
        "solved_by_the_loaded_policy": sum(run.succeeded and not run.retrained for run in runs),
        "tabular_steps": [run.tabular_steps for run in runs],
        "random_success": [run.random_success for run in runs],
    }


def _scenario_seed(run: ScenarioRun) -> dict[str, Any]:
    left_out = {"mode", "scenario", "succeeded", "steps", "budget", "tabular_curve"}
    return {
        **run.model_dump(mode="json", exclude=left_out),
        "steps_to_success": run.steps_to_success,
        "curve": [[row.steps, row.success_rate] for row in run.curve],
        "moves": run.moves,
    }


def _learning(runs: Sequence[LearningRun]) -> dict[str, Any]:
    """Return the runs of one kind, one per seed."""
    if not runs:
        return {"steps_to_success": None, "reached": 0, "runs": 0}
    steps = _steps(runs)
    last = [run.curve[-1] for run in runs if run.curve]
    return {
        "steps_to_success": steps.median,
        "steps_to_success_text": steps.text(),
        "quartiles": [steps.quantile(0.25), steps.quantile(0.75)],
        "steps": list(steps.values),
        "most_steps": None if steps.reached < len(runs) else max(run.steps for run in runs),
        "reached": steps.reached,
        "runs": len(runs),
        "budget": steps.budget,
        "success_rates": [row.success_rate for row in last],
        "greedy_rates": [row.greedy_rate for row in last],
        "fresh_rates": [run.fresh_rate for run in runs],
        "curve": mean_curve([run.curve for run in runs]),
        "seconds": [run.seconds for run in runs],
        "cpu_seconds": [run.cpu_seconds for run in runs],
    }


def _steps(runs: Sequence[LearningRun] | Sequence[ScenarioRun]) -> CensoredSteps:
    return CensoredSteps(tuple(run.steps_to_success for run in runs), max((run.budget for run in runs), default=0))


def _ablation(results: ExperimentResults) -> list[dict[str, Any]]:
    cells = []
    for observation in ABLATION_OBSERVATIONS:
        for reward in ABLATION_REWARDS:
            runs = [run for run in results.ablation if run.mode == f"{observation}-{reward}"]
            if runs:
                cells.append({"observation": observation, "reward": reward, **_learning(runs)})
    return cells


def _beyond(results: ExperimentResults) -> dict[str, Any]:
    """Return the runs beyond the paper, with the bars set for them."""
    ours = [run for run in results.initialization if run.mode == "ours"]
    targets, frame = ([run for run in results.beyond if run.mode == mode] for mode in ("targets", "frame"))
    scenarios = [run for run in results.scenarios if run.mode == "ours" and run.scenario != "a"]
    settings = results.settings
    return {
        "every_start": {"bar_steps": 2_000, "cleared": _within(ours, 2_000), **_learning(ours)},
        **{
            name: {
                "bar_steps": settings[f"{mode}_budget"],
                "layouts": settings[f"{mode}_layouts"],
                "fresh_layouts": settings["fresh_layouts"],
                "cleared": _within(runs, settings[f"{mode}_budget"]),
                **_learning(runs),
            }
            for name, mode, runs in (("random_targets", "targets", targets), ("frame", "frame", frame))
        },
        "changed_sites": {
            "bar_steps": 2_000,
            "runs": len(scenarios),
            "cleared": sum(run.succeeded and run.steps <= 2_000 for run in scenarios),
            "by_the_loaded_policy": sum(run.succeeded and not run.retrained for run in scenarios),
            "most_steps": max((run.steps for run in scenarios), default=None),
        },
        "greedy_without_guard": True,
    }


def _within(runs: Sequence[LearningRun], steps: int) -> int:
    return sum(run.reached and run.steps <= steps for run in runs)


def _baselines(results: ExperimentResults) -> dict[str, Any]:
    runs = results.baselines
    if not runs:
        return {}
    steps = CensoredSteps(tuple(run.steps for run in runs), max(run.budget for run in runs))
    return {
        "starts": runs[0].starts,
        "random_success": asdict(mean_interval([run.random_success for run in runs], lowest=0.0, highest=1.0)),
        "teacher_success": min(run.teacher_success for run in runs),
        "tabular": {
            "steps_to_success": steps.median,
            "steps_to_success_text": steps.text(),
            "steps": list(steps.values),
            "budget": steps.budget,
            "curve": mean_curve([run.curve for run in runs]),
        },
    }


def _teacher(results: ExperimentResults) -> dict[str, Any]:
    """Return the cost of the exact distance field; descending it needs no environment step and solves every layout."""
    return {
        "field_seconds": results.field_seconds,
        "environment_steps": 0,
        "used_in_training_by": [
            name for name, config in results.settings["modes"].items() if config["reward"] == "shaped"
        ],
        "used_at_run_time_by": [],
    }


def mean_curve(curves: Sequence[Curve]) -> list[list[float]]:
    """Return ``[steps, mean rate, low, high]`` per test, over seeds, with the interval of ``mean_interval``.

    A run that has ended keeps its last rate.
    """
    curves = [curve for curve in curves if curve]
    grid = sorted({row.steps for curve in curves for row in curve})
    rows = []
    for steps in grid:
        rates = [rate for curve in curves if (rate := _rate_at(curve, steps)) is not None]
        interval = mean_interval(rates, lowest=0.0, highest=1.0)
        rows.append([float(steps), interval.mean, interval.low, interval.high])
    return rows


def _rate_at(curve: Curve, steps: int) -> float | None:
    """Return the rate of the last test up to a step. None before the first."""
    rate = None
    for row in curve:
        if row.steps <= steps:
            rate = row.success_rate
    return rate


def curves_csv(results: ExperimentResults) -> str:
    """Return every test of every run, one per line."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(["part", "mode", "seed", "scenario", "steps", "success_rate", "mean_reward", "greedy_rate"])
    for part, runs in (
        ("initialization", results.initialization),
        ("ablation", results.ablation),
        ("beyond", results.beyond),
    ):
        for run in runs:
            writer.writerows(_lines(part, run.mode, run.seed, "", run.curve))
    for scenario in results.scenarios:
        writer.writerows(_lines("application", scenario.mode, scenario.seed, scenario.scenario, scenario.curve))
        writer.writerows(_lines("tabular", scenario.mode, scenario.seed, scenario.scenario, scenario.tabular_curve))
    for baseline in results.baselines:
        writer.writerows(_lines("tabular", "initialization", baseline.seed, "", baseline.curve))
    return out.getvalue()


def _lines(part: str, mode: str, seed: int, scenario: str, curve: Curve) -> Iterable[list[Any]]:
    for row in curve:
        greedy = "" if row.greedy_rate is None else row.greedy_rate
        yield [part, mode, seed, scenario, row.steps, row.success_rate, row.mean_reward, greedy]
