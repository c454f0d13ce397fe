"""The paper's three findings, each with its numbers and a verdict. The rules were fixed before any result was seen.

1. Every scenario is learned, the unchanged one with the loaded policy as it is. *Reproduces* if every seed does all of
   it: in (a) at least 8 of the 10 trial episodes succeed without retraining, and (b), (c), (d) each end with a path
   within the budget. *Contradicted* if fewer than half of the seeds learn some scenario. Otherwise *partly*.
2. (d), close to the target, needs fewer steps of retraining than (b), close to the start.
3. Two obstructions, (c), need more steps than one, (b).

For 2 and 3, per seed, a scenario that was not learned counts as one test interval more than the budget. *Reproduces* if
the median difference has the claimed sign and Wilcoxon's one-sided exact test gives p < 0.05; *contradicted* if both
hold for the opposite; otherwise *not decided*.

(b) and (d) differ in more than the distance. So 2 is judged once more, by the same rule, on matched pairs
(``bimvox.paper.policy.matched``): per seed the mean over its pairs.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

from bimvox.paper.experiment.names import SCENARIOS
from bimvox.paper.experiment.results import MatchedRun, ScenarioRun
from bimvox.paper.experiment.statistics import PairedTest, paired_test

SIGNIFICANCE = 0.05
TRIALS_NEEDED = 0.8
_NEAR_THE_TARGET = "an obstruction close to the target needs fewer steps than one close to the start"


class Verdict(StrEnum):
    """Whether a finding of the paper reproduces."""

    REPRODUCES = "reproduces"
    PARTLY = "partly"
    NOT_DECIDED = "not decided"
    CONTRADICTED = "contradicted"


@dataclass(frozen=True, slots=True)
class Finding:
    """One finding.

    Attributes:
        number: 1 to 3, as in the paper.
        claim: In words.
        verdict: By the rules of this module.
        seeds: Number of seeds behind it.
        learned: Finding 1: share of the seeds that learned each scenario.
        test: Findings 2 and 3: steps of the case claimed to need more, minus those of the other.
    """

    number: int
    claim: str
    verdict: Verdict
    seeds: int
    learned: dict[str, float] | None = None
    test: PairedTest | None = None


def findings_of(runs: Sequence[ScenarioRun], *, test_every: int, seeds: Sequence[int]) -> tuple[Finding, ...]:
    """Return the three findings for the runs of one mode.

    ``seeds`` are all seeds that were run; one without a planned path has learned nothing.
    """
    if not runs:
        return ()
    return (
        _learned(runs, seeds),
        _compared(runs, 2, _NEAR_THE_TARGET, "b", "d", test_every),
        _compared(runs, 3, "two obstructions need more steps than one", "c", "b", test_every),
    )


def matched_finding(runs: Sequence[MatchedRun], *, test_every: int) -> Finding:
    """Return finding 2 on matched pairs that were all retrained with the same share of random actions."""
    seeds = sorted({run.seed for run in runs})
    means = np.array(
        [
            np.mean(
                [
                    [run.budget + test_every if steps is None else steps for steps in (run.near_steps, run.far_steps)]
                    for run in runs
                    if run.seed == seed
                ],
                axis=0,
            )
            for seed in seeds
        ],
        np.float64,
    ).reshape(-1, 2)
    return _judged(2, _NEAR_THE_TARGET, means[:, 0], means[:, 1])


def _learned(runs: Sequence[ScenarioRun], seeds: Sequence[int]) -> Finding:
    learned = {
        scenario: sum(_is_learned(run) for run in runs if run.scenario == scenario) / len(seeds)
        for scenario in SCENARIOS
    }
    if all(share == 1.0 for share in learned.values()):
        verdict = Verdict.REPRODUCES
    elif min(learned.values()) < 0.5:
        verdict = Verdict.CONTRADICTED
    else:
        verdict = Verdict.PARTLY
    claim = "every scenario is learned, the unchanged one with the loaded policy as it is"
    return Finding(1, claim, verdict, len(seeds), learned=learned)


def _is_learned(run: ScenarioRun) -> bool:
    if run.scenario == "a":
        return not run.retrained and run.success_rate >= TRIALS_NEEDED
    return run.succeeded


def _compared(runs: Sequence[ScenarioRun], number: int, claim: str, more: str, fewer: str, test_every: int) -> Finding:
    first, second = _steps(runs, more, test_every), _steps(runs, fewer, test_every)
    seeds = sorted(set(first) & set(second))
    return _judged(number, claim, _array(first, seeds), _array(second, seeds))


def _judged(number: int, claim: str, one: NDArray[np.float64], other: NDArray[np.float64]) -> Finding:
    test, opposite = paired_test(one, other), paired_test(other, one)
    verdict = Verdict.NOT_DECIDED
    if test.median_difference > 0 and test.p_wilcoxon < SIGNIFICANCE:
        verdict = Verdict.REPRODUCES
    elif test.median_difference < 0 and opposite.p_wilcoxon < SIGNIFICANCE:
        verdict = Verdict.CONTRADICTED
    return Finding(number, claim, verdict, len(one), test=test)


def _steps(runs: Sequence[ScenarioRun], scenario: str, test_every: int) -> dict[int, float]:
    return {
        run.seed: float(run.steps if run.succeeded else run.budget + test_every)
        for run in runs
        if run.scenario == scenario
    }


def _array(steps: dict[int, float], seeds: Sequence[int]) -> NDArray[np.float64]:
    return np.array([steps[seed] for seed in seeds], np.float64)
