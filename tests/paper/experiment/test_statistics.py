from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import binomtest, wilcoxon

from bimvox.paper.experiment.findings import CensoredSteps, mean_interval, paired_test


def test_an_interval_by_students_t():
    interval = mean_interval([1.0, 2.0, 3.0, 4.0])
    assert interval.mean == 2.5
    # 3.182 is t of three degrees of freedom at 97.5 %.
    assert interval.high - 2.5 == pytest.approx(3.182 * np.std([1, 2, 3, 4], ddof=1) / 2, rel=1e-3)
    assert interval.low == pytest.approx(5.0 - interval.high)


def test_a_rate_stays_a_rate_and_one_seed_has_no_interval():
    interval = mean_interval([0.9, 1.0, 1.0], lowest=0.0, highest=1.0)
    assert interval.high == 1.0
    alone = mean_interval([0.3])
    assert (alone.low, alone.high, alone.count) == (0.3, 0.3, 1)


def test_medians_if_some_did_not_succeed():
    assert CensoredSteps((2_000, None, 4_000), 10_000).median == 4_000
    assert CensoredSteps((2_000, None, None), 10_000).median is None
    assert CensoredSteps((2_000, None, None), 10_000).text() == "> 10,000"
    assert CensoredSteps((2_000, 4_000, 6_000, None), 10_000).median == 5_000
    assert CensoredSteps((2_000, 4_000, None, None), 10_000).median is None
    assert CensoredSteps((2_000, None), 10_000).quantile(0.0) == 2_000
    assert CensoredSteps((2_000, None), 10_000).reached == 1


@given(st.lists(st.integers(1, 50), min_size=1, max_size=12), st.floats(0, 1))
def test_quantiles_without_censoring_are_numpys(values, share):
    assert CensoredSteps(tuple(values), 100).quantile(share) == pytest.approx(np.quantile(values, share))


@given(st.lists(st.integers(-6, 6), min_size=1, max_size=9))
def test_wilcoxon_is_the_share_of_all_signs(differences):
    array = np.array(differences, float)
    test = paired_test(array, np.zeros_like(array))
    kept = array[array != 0]
    sizes = np.abs(kept)
    ranks = np.array([(sizes < s).sum() + ((sizes == s).sum() + 1) / 2 for s in sizes])
    observed = ranks[kept > 0].sum()
    signs = itertools.product([0, 1], repeat=len(kept))
    expected = np.mean([np.dot(ranks, sign) >= observed - 1e-9 for sign in signs]) if len(kept) else 1.0
    assert test.p_wilcoxon == pytest.approx(expected)


def test_the_tests_are_scipys_where_there_are_no_ties():
    differences = np.array([3.0, -1.0, 4.0, 2.0, 6.0, 5.0, 7.0])
    test = paired_test(differences, np.zeros(7))
    assert test.p_wilcoxon == pytest.approx(wilcoxon(differences, alternative="greater", method="exact").pvalue)
    assert test.p_sign == pytest.approx(binomtest(6, 7, alternative="greater").pvalue)
    assert (test.larger, test.smaller, test.median_difference) == (6, 1, 4.0)


def test_no_difference_at_all():
    test = paired_test(np.ones(4), np.ones(4))
    assert (test.median_difference, test.p_sign, test.p_wilcoxon) == (0.0, 1.0, 1.0)
