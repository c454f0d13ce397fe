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
(``bimvox.paper.policy.scenarios``): per seed the mean over its pairs.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

from bimvox.paper.experiment.jobs import SCENARIOS
from bimvox.paper.experiment.results import MatchedRun, ScenarioRun

CONFIDENCE = 0.95


@dataclass(frozen=True, slots=True)
class _Interval:
    """A mean and its confidence interval.

    Attributes:
        mean: Over the seeds.
        low: Lower end of the 95 % confidence interval by Student's t.
        high: Its upper end.
        count: Number of seeds. With one seed the interval is the mean itself.
    """

    mean: float
    low: float
    high: float
    count: int


def mean_interval(values: Sequence[float], *, lowest: float = -math.inf, highest: float = math.inf) -> _Interval:
    """Return the mean of one value per seed, with its 95 % confidence interval by Student's t.

    Args:
        values: At least one.
        lowest: The interval is clipped here, as a rate's is at 0.
        highest: And here, as a rate's is at 1.
    """
    from scipy.stats import t

    array = np.asarray(values, np.float64)
    mean = float(array.mean())
    if len(array) < 2:
        return _Interval(mean, mean, mean, len(array))
    half = float(t.ppf(0.5 + CONFIDENCE / 2, len(array) - 1) * array.std(ddof=1) / math.sqrt(len(array)))
    return _Interval(mean, max(lowest, mean - half), min(highest, mean + half), len(array))


@dataclass(frozen=True, slots=True)
class CensoredSteps:
    """Steps to success over seeds; a seed may have failed within the budget.

    Attributes:
        values: One per seed. None if the budget was not enough.
        budget: The budget.
    """

    values: tuple[int | None, ...]
    budget: int

    @property
    def reached(self) -> int:
        """Number of seeds that succeeded."""
        return sum(value is not None for value in self.values)

    def quantile(self, share: float) -> float | None:
        """Return the steps within which that share of the seeds succeeded. None if beyond the budget.

        Seeds that failed count as longer than all others, so nothing is assumed about them. Between two seeds the
        steps are interpolated linearly.
        """
        ordered = sorted(math.inf if value is None else float(value) for value in self.values)
        place = share * (len(ordered) - 1)
        low, high = ordered[math.floor(place)], ordered[math.ceil(place)]
        if math.isinf(high):
            return None if math.isinf(low) or place > math.floor(place) else low
        return low + (high - low) * (place - math.floor(place))

    @property
    def median(self) -> float | None:
        """The median. None if beyond the budget."""
        return self.quantile(0.5)

    def text(self) -> str:
        """Return the median as text."""
        return f"> {self.budget:,}" if self.median is None else f"{self.median:,.0f}"


@dataclass(frozen=True, slots=True)
class _PairedTest:
    """Two numbers per seed, compared.

    Attributes:
        median_difference: Median over the seeds of the first minus the second.
        larger: Number of seeds in which the first is larger.
        smaller: Number in which it is smaller; the rest are ties.
        p_sign: One-sided exact sign test: chance that the first is larger in at least as many seeds.
        p_wilcoxon: One-sided exact signed-rank test of Wilcoxon; ties are left out, equal differences get their mean
            rank.
    """

    median_difference: float
    larger: int
    smaller: int
    p_sign: float
    p_wilcoxon: float


def paired_test(first: NDArray[np.float64], second: NDArray[np.float64]) -> _PairedTest:
    """Return a test of whether the first of two numbers, one pair per seed, tends to be larger."""
    differences = first - second
    larger, smaller = int((differences > 0).sum()), int((differences < 0).sum())
    return _PairedTest(
        float(np.median(differences)) if len(differences) else 0.0,
        larger,
        smaller,
        _at_least(larger, larger + smaller),
        _wilcoxon(differences[differences != 0]),
    )


def _at_least(successes: int, tries: int) -> float:
    """Return the chance of at least so many heads among fair coins."""
    return float(sum(math.comb(tries, k) for k in range(successes, tries + 1)) / 2**tries)


def _wilcoxon(differences: NDArray[np.float64]) -> float:
    """Return the exact chance of a sum of positive ranks at least as large, if both signs are equally likely."""
    if len(differences) == 0:
        return 1.0
    sizes = np.abs(differences)
    # Twice the rank, because a mean rank may be a half.
    ranks = [int((sizes < size).sum() * 2 + (sizes == size).sum() + 1) for size in sizes]
    observed = sum(rank for rank, difference in zip(ranks, differences, strict=True) if difference > 0)
    chances = np.zeros(sum(ranks) + 1)
    chances[0] = 1.0
    for rank in ranks:
        moved = np.zeros_like(chances)
        moved[rank:] = chances[: len(chances) - rank]
        chances = 0.5 * chances + 0.5 * moved
    return float(chances[observed:].sum())


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
    test: _PairedTest | None = None


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
