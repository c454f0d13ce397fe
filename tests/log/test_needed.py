"""Which samples viewers need: what a straight line between them leaves out is small, and no sample is shown in vain."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from bimvox.log.driven import APART_S, needed

NS = 10**9
NONE = np.zeros(0, np.int64)


def a_walk(seed: int, samples: int = 400) -> tuple[np.ndarray, np.ndarray]:
    """Return times with uneven steps, and two smooth columns."""
    rng = np.random.default_rng(seed)
    time_ns = np.cumsum(rng.integers(NS // 100, NS // 4, samples))
    rates = np.cumsum(rng.normal(0.0, 0.05, (samples, 2)), axis=0)
    steps_s = np.diff(time_ns, prepend=time_ns[0])[:, None] / NS
    return time_ns, np.cumsum(rates * steps_s, axis=0)


def off(time_ns: np.ndarray, values: np.ndarray, first: int, last: int) -> np.ndarray:
    """Return how far samples between two are from the line between them."""
    share = ((time_ns[first + 1 : last] - time_ns[first]) / (time_ns[last] - time_ns[first]))[:, None]
    return np.abs(values[first] + share * (values[last] - values[first]) - values[first + 1 : last])


@pytest.mark.parametrize("seed", range(4))
def test_a_line_between_needed_samples_stays_close_and_reaches_as_far_as_it_may(seed: int) -> None:
    time_ns, values = a_walk(seed)
    limits = np.array([0.01, 0.02])
    kept = np.flatnonzero(needed(time_ns, values, limits, NONE))
    assert (kept[0], kept[-1]) == (0, len(time_ns) - 1)
    assert len(kept) < 0.7 * len(time_ns)
    for first, last in pairwise(kept.tolist()):
        assert (off(time_ns, values, first, last) <= limits + 1e-12).all()
        assert last == first + 1 or time_ns[last] - time_ns[first] <= APART_S * NS
        if last + 1 < len(time_ns):
            far = time_ns[last + 1] - time_ns[first] > APART_S * NS
            assert far or (off(time_ns, values, first, last + 1) > limits - 1e-12).any()


def test_a_steady_motion_is_shown_now_and_then_and_rest_only_at_its_ends() -> None:
    time_ns = np.concatenate([np.arange(0, 10 * NS, NS // 10), [400 * NS]])
    values = np.minimum(time_ns / NS, 9.9)[:, None]
    kept = time_ns[needed(time_ns, values, np.array([1e-6]), NONE)]
    apart_ns = int(APART_S * NS)
    assert kept.tolist() == [*range(0, 99 * NS // 10, apart_ns), 99 * NS // 10, 400 * NS]


def test_what_begins_or_ends_is_shown_always() -> None:
    time_ns = np.arange(0, NS, NS // 20)
    kept = needed(time_ns, np.zeros((20, 1)), np.array([0.01]), time_ns[[7, 8]])
    assert np.flatnonzero(kept).tolist() == [0, 7, 8, 19]


def test_one_sample_is_needed_and_none_is_none() -> None:
    assert needed(np.array([5]), np.zeros((1, 2)), np.ones(2), NONE).tolist() == [True]
    assert needed(NONE, np.zeros((0, 2)), np.ones(2), NONE).tolist() == []
