"""Plausible results of an experiment, for tests of its reports."""

from __future__ import annotations

from bimvox.paper.experiment.jobs import ABLATION_OBSERVATIONS, ABLATION_REWARDS, PaperSettings, quick_settings
from bimvox.paper.experiment.results import BaselineRun, ExperimentResults, LearningRun, MatchedRun, ScenarioRun
from bimvox.paper.policy.curve import CurvePoint

SEEDS = 6
PATH = ((2, 2, 2), (3, 2, 2), (4, 2, 2), (5, 2, 2), (6, 2, 2), (7, 2, 2), (7, 3, 2), (7, 4, 2), (7, 5, 2), (7, 6, 2))
WHOLE = (*PATH, (7, 7, 2), (7, 7, 1))
BOX = ((3, 3, 1), (6, 4, 3))


def learning_run(mode: str, seed: int, steps: int, *, reached: bool = True, budget: int = 40_000) -> LearningRun:
    curve = (CurvePoint(steps // 2, 0.4, -20.0, 0.3), CurvePoint(steps, 1.0 if reached else 0.6, -5.0, 1.0))
    return LearningRun(
        mode=mode, seed=seed, reached=reached, steps=steps, budget=budget, curve=curve, seconds=3.0, cpu_seconds=2.5
    )


def scenario_run(mode: str, seed: int, scenario: str, steps: int, *, succeeded: bool = True) -> ScenarioRun:
    curve = (
        ()
        if steps == 0
        else (CurvePoint(0, 0.0, -36.0, None), CurvePoint(steps, 0.9 if succeeded else 0.2, -9.0, None))
    )
    return ScenarioRun(
        mode=mode,
        seed=seed,
        scenario=scenario,
        start=(2, 2, "x"),
        target=(7, 7, 1),
        obstructions=() if scenario == "a" else (BOX,),
        planned_cells=WHOLE,
        path_cells=WHOLE if succeeded else (),
        retrained=steps > 0,
        succeeded=succeeded,
        steps=steps,
        budget=20_000,
        curve=curve,
        success_rate=0.9 if succeeded else 0.2,
        shortest_moves=len(WHOLE) - 1,
        random_success=0.01,
        tabular_steps=18_000,
        tabular_curve=(),
        seconds=1.0,
    )


def results(*, steps_b: int = 6_000, steps_c: int = 10_000, steps_d: int = 2_000, fails: str = "") -> ExperimentResults:
    """Return results of six seeds; ``fails`` names scenarios that paper mode never learned."""
    settings: PaperSettings = quick_settings(SEEDS, ("paper", "ours"))
    steps = {"b": steps_b, "c": steps_c, "d": steps_d}
    scenarios = [
        scenario_run("paper", seed, name, 0 if name == "a" else steps[name] + 100 * seed, succeeded=name not in fails)
        for seed in range(SEEDS)
        for name in "abcd"
    ]
    scenarios += [scenario_run("ours", seed, name, 0) for seed in range(SEEDS) for name in "abcd"]
    return ExperimentResults(
        settings=settings.to_dict(),
        initialization=tuple(
            learning_run(mode, seed, 16_000 if mode == "paper" else 800)
            for mode in ("paper", "ours")
            for seed in range(SEEDS)
        ),
        scenarios=tuple(scenarios),
        unplanned=(),
        matched=tuple(
            MatchedRun(
                seed=seed,
                exploration=first,
                detour_moves=4,
                near_steps=1_000 + 250 * seed,
                far_steps=None if first < 1 and seed == 2 else 1_500,
                budget=20_000,
            )
            for seed in range(SEEDS)
            for first in (1.0, 0.02)
        ),
        ablation=tuple(
            learning_run(f"{observation}-{reward}", 0, 9_000, reached=observation != "paper")
            for observation in ABLATION_OBSERVATIONS
            for reward in ABLATION_REWARDS
        ),
        beyond=(
            learning_run("targets", 0, 1_200, budget=2_000),
            learning_run("frame", 0, 50_000, reached=False, budget=50_000),
        ),
        baselines=(
            BaselineRun(
                seed=0, starts=191, random_success=0.02, teacher_success=1.0, steps=None, budget=100_000, curve=()
            ),
        ),
        field_seconds={"paper": 0.0001},
        missing=(),
    )
