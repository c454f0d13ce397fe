from __future__ import annotations

import pytest

from bimvox.paper.experiment.findings import Verdict, findings_of, matched_finding
from bimvox.paper.experiment.results import MatchedRun, ScenarioRun

SEEDS = range(8)


def run(scenario, seed, steps, *, succeeded=True, rate=1.0):
    return ScenarioRun(
        mode="paper",
        seed=seed,
        scenario=scenario,
        start=(0, 0),
        axis="x",
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
    return [MatchedRun(seed, 1.0, 4, near(seed), far(seed), 20_000) for seed in seeds for _ in range(2)]


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
