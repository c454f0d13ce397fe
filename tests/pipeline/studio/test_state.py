"""The four states of a plan, in words."""

from datetime import datetime

import pytest
from bimvox_pipeline.studio.state import Counts, Job, PlanIs, Planned, state_of

AT = datetime(2026, 12, 1, 9, 12)
COUNTS = Counts(planned=31, refused=2, replanned=0, done=0, waiting=0, revision=0)
TRUCK, CRANE = ("obstruction truck (new)",), ("the crane (moved 0.50 m)",)


def test_without_a_plan():
    found = state_of(None)
    assert (found.state, found.title, found.since, found.counts) == (PlanIs.NONE, "No plan", None, None)


def test_of_exactly_these_files():
    found = state_of(Planned(AT, COUNTS))
    assert found.state is PlanIs.CURRENT
    assert found.words == "Plan of exactly these files, of 1 Dec 2026 09:12: 31 lifts planned, 2 refused."
    assert found.holds


def test_of_an_earlier_state_with_what_changed_since():
    found = state_of(Planned(AT, COUNTS, TRUCK, CRANE))
    assert (found.state, found.changes, found.holds) == (PlanIs.EARLIER, (*CRANE, *TRUCK), False)
    assert found.words.startswith("Plan of an earlier state, of 1 Dec 2026 09:12: 31 lifts planned, 2 refused. ")
    assert found.words.endswith("Changed since: the crane (moved 0.50 m), obstruction truck (new).")


def test_a_plan_that_is_made_is_not_that_which_is_shown():
    job = Job(AT, makes=True, changes=CRANE)
    assert state_of(None, job).words == (
        "Plan being made, since 1 Dec 2026 09:12. Changed since: the crane (moved 0.50 m)."
    )
    found = state_of(Planned(AT, COUNTS), job)
    assert (found.state, found.holds) == (PlanIs.WORKING, False)
    assert "Shown is the plan of 1 Dec 2026 09:12: 31 lifts planned, 2 refused." in found.words


@pytest.mark.parametrize(
    ("plan", "job", "state", "title"),
    [
        (Planned(AT, COUNTS), Job(AT, makes=False), PlanIs.CURRENT, "Plan of exactly these files"),
        (Planned(AT, COUNTS, TRUCK), Job(AT, makes=False), PlanIs.WORKING, "Plan being revised"),
        (Planned(AT, COUNTS), Job(AT, makes=False, is_pending=True), PlanIs.WORKING, "Plan being revised"),
        (Planned(AT, COUNTS, TRUCK), Job(AT, makes=False, is_stuck=True), PlanIs.EARLIER, "Plan of an earlier state"),
        (Planned(AT, COUNTS, TRUCK, CRANE), Job(AT, makes=False), PlanIs.EARLIER, "Plan of an earlier state"),
    ],
)
def test_a_watch_answers_obstructions_and_nothing_else(plan: Planned, job: Job, state: PlanIs, title: str):
    found = state_of(plan, job)
    assert (found.state, found.title) == (state, title)
    assert found.holds is (state is not PlanIs.EARLIER)


def test_counts_say_what_a_watch_did():
    counts = Counts(planned=1, refused=0, replanned=4, done=3, waiting=2, revision=7)
    assert counts.words == "1 lift planned, 0 refused, 4 replanned in revision 7, 2 without a path yet, 3 done"
    told = state_of(Planned(AT, counts)).to_dict()
    assert told["counts"]["words"] == counts.words
    assert (told["when"], told["since"], told["changes"]) == ("1 Dec 2026 09:12", "2026-12-01T09:12:00", [])
