"""``make bench-generalist-seeds``: five training seeds with and without the teacher's loss, on the same lessons.

No lesson is a trap or a building: held-out traps, buildings and spirals are kinds of site that these networks never
saw. A score is the success rate of a network on a split. Interquartile means over seeds and splits have stratified
bootstrap intervals (Agarwal et al. 2021): each split's seeds are drawn again by themselves.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Sequence
from dataclasses import replace
from itertools import islice
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.stats import bootstrap, trim_mean

from benchmarks.document import put_into
from benchmarks.generalist import tries
from benchmarks.train_generalist import RECIPE, Run, lesson, save_generalist, train_generalist
from bimvox.env.problem import LiftProblem, lift_problem
from bimvox.planning.rollout import TowardsTarget, Values
from bimvox.policy.generalist.problems import FAMILIES, VALIDATION_DOMAIN
from bimvox.policy.generalist.suite import problem_sets
from bimvox.policy.generalist.weights import load_generalist

LEFT_OUT = "traps"
"""Family that gives no lesson."""

UNSEEN = (LEFT_OUT, "building", "spirals")
"""Splits of kinds that give no lesson: these have columns of their own."""

SEEDS = 5
STEPS = 100_000
LESSON_NUMBERS, CHECK_NUMBERS = 5_000, 40
TEACHER = {"teacher": 1.0, "no-teacher": 0.0}
"""Weight of the teacher's loss in each arm."""

PROBLEMS = 60
"""Of each split."""

WAYS = ("bare", "plan's try")
"""The first that are tried."""

Scores = NDArray[np.float64]
"""(splits, seeds) success rates."""


def main() -> int:
    """Train what is not there yet, and print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, required=True, help="folder of the networks; those there are kept")
    parser.add_argument("--steps", type=int, default=STEPS, help="environment steps of each training")
    parser.add_argument("--seeds", type=int, default=SEEDS)
    parser.add_argument("--problems", type=int, default=PROBLEMS, help="of each split")
    parser.add_argument("--write", action="store_true", help="write the table into docs/data/generalist.txt")
    chosen = parser.parse_args()
    train(chosen.out, chosen.seeds, chosen.steps)
    text = _table(chosen.out, chosen.seeds, _splits(chosen.problems))
    text += f"\n{chosen.seeds} seeds, {chosen.steps:,} steps each, {chosen.problems} problems a split.\n"
    sys.stdout.write(text)
    if chosen.write:
        put_into(Path("docs/data/generalist.txt"), "bench-generalist-seeds", text)
    return 0


def train(out: Path, seeds: int, steps: int) -> None:
    """Train every seed of both arms whose folder has no weights, seed by seed."""
    names = list(FAMILIES)
    kept = [n for n in range(LESSON_NUMBERS) if names[n % len(names)] != LEFT_OUT]
    runs = [(seed, arm, out / f"{arm}-{seed}") for seed in range(seeds) for arm in TEACHER]
    runs = [run for run in runs if not (run[2] / "generalist.safetensors").exists()]
    problems = [lesson(n) for n in kept] if runs else []
    checks = [lesson(n, VALIDATION_DOMAIN) for n in kept if n < CHECK_NUMBERS]
    for seed, arm, folder in runs:
        began = time.process_time()
        config = replace(RECIPE, teacher=TEACHER[arm], buffer_size=steps, test_every=10 * steps)
        network = train_generalist(problems, checks, config, Run(seed, steps, half=True), families=len(names) - 1)
        minutes = round((time.process_time() - began) / 60, 1)
        record = {"config": config.to_dict(), "seed": seed, "steps": steps, "without": LEFT_OUT, "minutes": minutes}
        save_generalist(network, record, folder)
        sys.stderr.write(f"{folder.name}: {minutes} minutes of processor time\n")


def _splits(count: int) -> dict[str, list[LiftProblem]]:
    """Return the problems by split; no lesson is of ``LEFT_OUT``, a building or a spiral."""
    sets = problem_sets()
    return {name: [sets[name].make(n) for n in range(count)] for name in (*FAMILIES, "building", "spirals")}


def _table(out: Path, seeds: int, splits: dict[str, list[LiftProblem]]) -> str:
    """Return the table: each arm in each way, over all splits and on those unseen, and the difference of the arms."""
    scores = {
        arm: _scores([load_generalist(out / f"{arm}-{seed}") for seed in range(seeds)], splits) for arm in TEACHER
    }
    head = ["values", "way", "all splits", *UNSEEN]
    rows = [list(splits).index(split) for split in UNSEEN]
    lines = [f"| {' | '.join(head)} |", "|---" * len(head) + "|"]
    for way in WAYS:
        for arm in TEACHER:
            of_arm = scores[arm][way]
            cells = [interval(of_arm), *(interval(of_arm[[n]]) for n in rows)]
            lines.append(f"| {arm} | {way} | {' | '.join(cells)} |")
        with_, without = (scores[arm][way] for arm in TEACHER)
        cells = [difference(with_, without), *(difference(with_[[n]], without[[n]]) for n in rows)]
        lines.append(f"| difference | {way} | {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"


def _scores(policies: Sequence[Values | TowardsTarget], splits: dict[str, list[LiftProblem]]) -> dict[str, Scores]:
    """Return the success rates of policies by way."""
    found = {way: np.zeros((len(splits), len(policies))) for way in WAYS}
    for n, problems in enumerate(splits.values()):
        for k, values in enumerate(policies):
            arrived = np.array([_arrivals(values, problem) for problem in problems])
            for w, way in enumerate(WAYS):
                found[way][n, k] = arrived[:, w].mean()
    return found


def _arrivals(values: Values | TowardsTarget, problem: LiftProblem) -> list[bool]:
    made = tries(values, lift_problem(problem.space, problem.start_vox, problem.target_vox), both_ways=False)
    return [tried.moves is not None for _, tried in islice(made, len(WAYS))]


def interquartile_mean(*splits: Scores, axis: int = -1) -> Scores:
    """Return the mean of the middle half of all scores."""
    mean: Scores = trim_mean(np.concatenate(splits, axis=axis), 0.25, axis=axis)
    return mean


def interval(scores: Scores) -> str:
    """Return the interquartile mean of (splits, seeds) scores with its stratified 95 % interval."""
    low, high = _bounds(list(scores), interquartile_mean)
    return f"{interquartile_mean(*scores):.0%} ({100.0 * low:.0f}-{100.0 * high:.0f})"


def difference(ours: Scores, theirs: Scores) -> str:
    """Return the same of a difference, in percentage points."""

    def difference(*samples: Scores, axis: int = -1) -> Scores:
        half = len(samples) // 2
        found: Scores = interquartile_mean(*samples[:half], axis=axis) - interquartile_mean(*samples[half:], axis=axis)
        return found

    low, high = _bounds([*ours, *theirs], difference)
    return f"{100.0 * difference(*ours, *theirs):+.0f} ({100.0 * low:+.0f} to {100.0 * high:+.0f})"


def _bounds(samples: list[Scores], statistic: object) -> tuple[float, float]:
    found = bootstrap(
        samples, statistic, n_resamples=10_000, vectorized=True, method="percentile", rng=np.random.default_rng(0)
    ).confidence_interval
    return float(found.low), float(found.high)


if __name__ == "__main__":
    sys.exit(main())
