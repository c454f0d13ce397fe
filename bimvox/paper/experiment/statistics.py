"""Statistics over seeds: means with confidence intervals, censored medians, paired tests."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

CONFIDENCE = 0.95


@dataclass(frozen=True, slots=True)
class Interval:
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


def mean_interval(values: Sequence[float], *, lowest: float = -math.inf, highest: float = math.inf) -> Interval:
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
        return Interval(mean, mean, mean, len(array))
    half = float(t.ppf(0.5 + CONFIDENCE / 2, len(array) - 1) * array.std(ddof=1) / math.sqrt(len(array)))
    return Interval(mean, max(lowest, mean - half), min(highest, mean + half), len(array))


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
class PairedTest:
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


def paired_test(first: NDArray[np.float64], second: NDArray[np.float64]) -> PairedTest:
    """Return a test of whether the first of two numbers, one pair per seed, tends to be larger."""
    differences = first - second
    larger, smaller = int((differences > 0).sum()), int((differences < 0).sum())
    return PairedTest(
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
