"""Rounds of making and proving end when another round would give the same result."""

import pytest

from bimvox.errors import NoPlanError, VerificationError
from bimvox.planning.rounds import proven_in_rounds, refusals
from bimvox.records.proof import Check, Verification


def test_what_fails_is_refused_in_the_next_round():
    seen = []

    def attempt(refused):
        seen.append(dict(refused))
        return {"a": "too low"} if not refused else {"b": "too high"} if len(refused) == 1 else "plan"

    assert proven_in_rounds(attempt, "written") == "plan"
    assert seen == [{}, {"a": "too low"}, {"a": "too low", "b": "too high"}]


def test_a_lift_that_is_made_though_it_is_refused_ends_the_rounds_and_is_named():
    asked = []

    def attempt(refused):
        asked.append(len(refused))
        return {"hanging": "it meets box 29"}

    with pytest.raises(
        VerificationError, match="nothing was changed; the last one is hanging: it meets box 29"
    ) as caught:
        proven_in_rounds(attempt, "changed")
    assert asked == [0, 1]
    assert caught.value.failures == ("hanging: it meets box 29",)


def test_lifts_that_fail_one_after_the_other_end_the_rounds():
    with pytest.raises(
        VerificationError, match="lifts still fail their proof, so nothing was written; the last one is part 11"
    ):
        proven_in_rounds(lambda refused: {f"part {len(refused)}": "it fails"}, "written")


def test_a_lift_is_not_refused_with_a_failure_that_names_its_part_as_what_is_too_near():
    check = Check("motion_margin")
    for about, near in (("beam", "wall"), ("wall", "mast")):
        check.about = about
        check.look(False, f"lift 1 ({about}): at 2.00 s, in transit, its load is nearer than 2 m to {near}")
    assert refusals(Verification((check,)))["wall"].endswith(
        "(wall): at 2.00 s, in transit, its load is nearer than 2 m to mast"
    )


def test_a_lift_is_not_refused_with_the_failure_of_another():
    check = Check("motion_cells")
    for n in range(100):
        check.about = "beam" if n < 50 else "wall"
        check.look(False, f"{check.about}: meets slab")
    assert refusals(Verification((check,))) == {
        "beam": "its lift could not be proven: motion_cells: beam: meets slab",
        "wall": "its lift could not be proven: motion_cells",
    }


def _cast_by(wrong, names, *, names_it=False):
    """Return an attempt that fails as long as any of some lifts is made, and the list of those made by each."""
    made = []

    def attempt(refused):
        made.append([name for name in names if name not in refused])
        if not made[-1]:
            raise NoPlanError("no lift can be planned")
        bad = [name for name in made[-1] if name in wrong]
        if not bad:
            return made[-1]
        if names_it:
            return {"another": "it fails"}
        raise VerificationError("the plan could not be proven")

    return attempt, made


@pytest.mark.parametrize("wrong", [{"c"}, {"a", "h"}, set("abcdefg"), {"d", "e"}])
@pytest.mark.parametrize("names_it", [False, True])
def test_a_failure_that_names_no_lift_costs_only_the_lifts_that_cause_it(wrong, names_it):
    names = "abcdefgh"
    attempt, made = _cast_by(wrong, names, names_it=names_it)
    assert proven_in_rounds(attempt, "written", lambda: list(names)) == [name for name in names if name not in wrong]
    assert len(made) <= 24


def test_if_no_lift_is_proven_alone_the_failure_is_told():
    attempt, _ = _cast_by(set("abc"), "abc")
    with pytest.raises(VerificationError, match="the plan could not be proven"):
        proven_in_rounds(attempt, "written", lambda: list("abc"))
