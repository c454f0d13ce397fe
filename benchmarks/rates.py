"""Success rates with their intervals."""

from __future__ import annotations

from scipy.stats import binomtest


def rate(successes: int, tests: int) -> str:
    """Return a rate with its exact 95 % interval (Clopper and Pearson 1934), in per cent: ``97.6% (94.5-99.2)``."""
    if tests == 0:
        return "-"
    interval = binomtest(successes, tests).proportion_ci(0.95, method="exact")
    return f"{successes / tests:.1%} ({100.0 * interval.low:.1f}-{100.0 * interval.high:.1f})"
