from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import binomtest, wilcoxon

from bimvox.paper.experiment.findings import (
    CensoredSteps,
    Verdict,
    findings_of,
    matched_finding,
    mean_interval,
    paired_test,
)
from bimvox.paper.experiment.results import MatchedRun, ScenarioRun


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


SEEDS = range(8)


def run(scenario, seed, steps, *, succeeded=True, rate=1.0):
    return ScenarioRun(
        mode="paper",
        seed=seed,
        scenario=scenario,
        start=(0, 0, "x"),
        target=(7, 7, 1),
        obstructions=(),
        planned_cells=(),
        path_cells=(),
        retrained=scenario != "a",
        succeeded=succeeded,
        steps=steps,
        budget=50_000,
        curve=(),
        success_rate=rate,
        shortest_moves=9,
        random_success=0.0,
        tabular_steps=None,
        tabular_curve=(),
        seconds=1.0,
    )


def runs(b=4_000, c=8_000, d=2_000, **special):
    found = []
    for seed in SEEDS:
        for scenario, steps in (("a", 0), ("b", b), ("c", c), ("d", d)):
            found.append(special.get(f"{scenario}{seed}", run(scenario, seed, steps + (0 if steps == 0 else seed))))
    return found


def verdicts(found):
    return [finding.verdict for finding in findings_of(found, test_every=2_000, seeds=SEEDS)]


def test_all_three_reproduce():
    assert verdicts(runs()) == [Verdict.REPRODUCES] * 3


def test_the_opposite_contradicts():
    assert verdicts(runs(b=2_000, c=1_000, d=4_000))[1:] == [Verdict.CONTRADICTED] * 2


def test_equal_steps_decide_nothing():
    assert verdicts(runs(b=2_000, c=2_000, d=2_000))[1:] == [Verdict.NOT_DECIDED] * 2


def test_a_difference_in_too_few_seeds_decides_nothing():
    few = {f"d{seed}": run("d", seed, 4_000 + seed) for seed in range(5)}
    assert verdicts(runs(**few))[1] is Verdict.NOT_DECIDED


def test_one_seed_that_did_not_learn_is_partly():
    found = runs(b3=run("b", 3, 50_000, succeeded=False, rate=0.4))
    first, second, _ = findings_of(found, test_every=2_000, seeds=SEEDS)
    assert first.verdict is Verdict.PARTLY
    assert first.learned == {"a": 1.0, "b": 7 / 8, "c": 1.0, "d": 1.0}
    assert second.test.median_difference == 2_000  # the one that was not learned counts as more than all others


def test_most_seeds_that_did_not_learn_contradict():
    failed = {f"c{seed}": run("c", seed, 50_000, succeeded=False) for seed in range(5)}
    assert verdicts(runs(**failed))[0] is Verdict.CONTRADICTED


def test_the_unchanged_site_must_work_in_eight_of_ten_trials():
    assert verdicts(runs(a0=run("a", 0, 0, rate=0.7)))[0] is Verdict.PARTLY


def test_a_seed_without_a_plan_has_learned_nothing():
    found = [r for r in runs() if r.seed != 2]
    first, second, _ = findings_of(found, test_every=2_000, seeds=SEEDS)
    assert first.verdict is Verdict.PARTLY
    assert first.learned["b"] == pytest.approx(7 / 8)
    assert second.seeds == 7


def test_nothing_run_finds_nothing():
    assert findings_of([], test_every=2_000, seeds=SEEDS) == ()


def matched(near, far, seeds=SEEDS):
    return [
        MatchedRun(
            seed=seed, exploration=1.0, detour_moves=4, near_steps=near(seed), far_steps=far(seed), budget=20_000
        )
        for seed in seeds
        for _ in range(2)
    ]


def test_matched_pairs_are_judged_seed_by_seed():
    judged = matched_finding(matched(lambda s: 2_000 + s, lambda s: 1_000 + s), test_every=250)
    assert judged.verdict is Verdict.REPRODUCES
    assert judged.seeds == len(SEEDS)
    assert judged.test.median_difference == 1_000
    opposite = matched_finding(matched(lambda s: 1_000 + s, lambda s: None), test_every=250)
    assert opposite.verdict is Verdict.CONTRADICTED
    assert opposite.test.median_difference == pytest.approx(1_000 + 3.5 - 20_250)


def test_a_pair_in_which_one_end_was_not_learned_is_no_reason_to_drop_it():
    mixed = matched(lambda s: 1_000 + s, lambda s: 500 if s else None)
    judged = matched_finding(mixed, test_every=250)
    assert (judged.test.larger, judged.test.smaller) == (len(SEEDS) - 1, 1)
