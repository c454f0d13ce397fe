"""Green needs a proof and plausibility; nothing is said by a colour alone."""

from __future__ import annotations

import dataclasses

import pytest
from opened_pages import failed_proof, passed_proof, some_remarks

from bimvox.records.lift import Lift, Status
from bimvox.records.proof import Check, Remark, Severity, Verification
from bimvox.rendering.page.source import Light, Verdict, verdict_of

NOTE = Remark("assumed", Severity.NOTE, "text")
MINOR = Remark("wind", Severity.MINOR, "text")
SERIOUS = Remark("floating", Severity.SERIOUS, "text")


LIFTS = [Lift(n, n, None, Status.PLANNED) for n in range(3)]


def verdict(proof: Verification | None, *remarks: Remark) -> Verdict:
    return verdict_of(proof, remarks, carried=3, lifts=LIFTS)


@pytest.mark.parametrize("remarks", [(), (NOTE,), (NOTE, NOTE)])
def test_only_what_is_proven_and_clean_is_green(remarks):
    found = verdict(passed_proof(), *remarks)
    assert (found.proof, found.proof_light, found.remarks_light) == ("✓ proven", Light.CLEAN, Light.CLEAN)


@pytest.mark.parametrize(
    ("remarks", "light", "words"),
    [
        ((MINOR,), Light.REMARKED, "! 1 remark"),
        ((NOTE, MINOR), Light.REMARKED, "! 1 remark"),
        ((SERIOUS, MINOR, NOTE), Light.SERIOUS, "⚠\ufe0e 2 remarks (1 serious)"),
    ],
)
def test_a_proven_plan_with_remarks_is_amber_without_a_tick(remarks, light, words):
    found = verdict(passed_proof(), *remarks)
    assert found == Verdict("proven", light, words, light)


def test_what_is_not_proven_names_the_check_that_failed():
    assert verdict(failed_proof("x")) == Verdict("✕ NOT PROVEN: cells", Light.REFUSED, "no remarks", Light.PLAIN)
    failed = [Check(name, samples=1, failed=1) for name in ("motion_cells", "swing", "rope")]
    found = verdict(Verification((Check("values"), *failed)), SERIOUS)
    assert found.proof == "✕ NOT PROVEN: motion cells and 2 more checks"
    assert found.remarks_light is Light.SERIOUS
    assert verdict(None, NOTE).proof == "✕ NOT PROVEN: no proof was made"
    assert verdict(None, NOTE).remarks_light is Light.PLAIN


def test_lifts_proven_against_earlier_obstructions_only_are_a_reservation():
    proof = dataclasses.replace(passed_proof(), not_current=("a",))
    found = verdict(proof)
    assert found.proof == "proven, 1 lift against earlier obstructions only"
    assert (found.proof_light, found.remarks_light) == (Light.REMARKED, Light.CLEAN)
    assert verdict(proof, SERIOUS).proof_light is Light.SERIOUS


@pytest.mark.parametrize(("count", "words"), [(1, "1 part is"), (2, "2 parts are")])
def test_parts_that_are_set_by_other_means_are_a_reservation(count, words):
    others = [Lift(n, n, None, Status.INFEASIBLE, by_other_means=True) for n in range(count)]
    found = verdict_of(passed_proof(), (), carried=4, lifts=[*others, *LIFTS[count:], *LIFTS])
    assert found.proof.startswith(f"proven, provided that {words} set by other means")
    assert (found.proof_light, found.remarks_light) == (Light.REMARKED, Light.CLEAN)


def test_an_extract_says_how_many_lifts_were_proven():
    assert verdict_of(passed_proof(), (), carried=2, lifts=LIFTS * 400).proof == "✓ proven (2 of 1,200 lifts)"


def test_both_are_in_one_line():
    line = verdict(passed_proof(), *some_remarks()).line
    assert line == "proven; ⚠\ufe0e 3 remarks (1 serious)"
