"""What a log says about the watch that wrote it: each lie is named, and nothing else is."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping

import pytest
import seeded_faults as faults

from bimvox.log.plan_log import PENDING, LogEvent, PlanLog
from bimvox.log.segments import FIRST_PLAN, NOW_NS, REPLAN_EVENT, first_plan_of, segment_of
from bimvox.log.shown import check_watched
from bimvox.records.lift import Epoch
from bimvox.records.motion import PhaseName
from bimvox.records.proof import Check
from bimvox.stop.brake_axes import STOP_EVENT

Lie = Callable[[PlanLog], PlanLog]


def failures(log: PlanLog) -> list[str]:
    check = Check("shown")
    check_watched(check, log)
    return check.failures


@pytest.fixture(scope="module")
def first() -> PlanLog:
    """Return the whole log of a watch before the first change."""
    log = faults.good_log()
    return dataclasses.replace(log, metadata={**log.metadata, FIRST_PLAN: first_plan_of(log)})


@pytest.fixture(scope="module")
def segment(first: PlanLog) -> PlanLog:
    """Return the segment of a revision that plans the second lift again and makes the last one infeasible."""
    log = faults.called_infeasible(first, "slab", "it is blocked at its place", ("wall",))
    names = {lift.order: log.plan.site.components[lift.component].id for lift in log.plan.lifts}
    fields = {
        "revision": "1",
        "event": "replanned",
        "changed_cells": "12",
        "kept": "2",
        "retimed": "0",
        "obstructions": "wall",
        "replanned": names[1],
        "infeasible": names[3],
        f"why {names[3]}": "it is blocked at its place (wall)",
    }
    motions = {motion.order: motion for motion in log.motions}
    watched = dataclasses.replace(log, revision=1, metadata={**log.metadata, NOW_NS: "0"})
    return segment_of(watched, motions, {1, 3}, (), fields)


def with_metadata(**changes: str | None) -> Lie:
    def lie(log: PlanLog) -> PlanLog:
        values = {**log.metadata, **{key: value for key, value in changes.items() if value is not None}}
        gone = {key for key, value in changes.items() if value is None}
        return dataclasses.replace(log, metadata={key: value for key, value in values.items() if key not in gone})

    return lie


def with_event(change: Callable[[LogEvent], Mapping[str, str]] | None = None, **times: int) -> Lie:
    def lie(log: PlanLog) -> PlanLog:
        (event,) = log.events
        fields = event.fields if change is None else {**event.fields, **change(event)}
        return dataclasses.replace(log, events=(dataclasses.replace(event, fields=fields, **times),))

    return lie


def stopped(**changes: str) -> Lie:
    """Return a log whose watch says that it stopped the second lift, which has no stop."""
    fields = {"how": "stopped", "safe": "True", "held": "False", "rest_s": "5.0", "brakes_for_s": "5.0"}
    fields |= {"component": "beam", "swings_m": "0.1", "goes_on_s": "None"} | changes

    def lie(log: PlanLog) -> PlanLog:
        return dataclasses.replace(log, events=(*log.events, LogEvent(STOP_EVENT, 0, 5 * 10**9, fields)))

    return lie


OF_A_SEGMENT: dict[str, tuple[Lie, str]] = {
    "another revision": (lambda log: dataclasses.replace(log, revision=7), "its 'revision' is '1', the plan gives '7'"),
    "before the first": (lambda log: dataclasses.replace(log, revision=-1), "metadata revision is -1; revisions count"),
    "no first plan": (with_metadata(first_plan=None, simulated_ns=None), "metadata first_plan is missing"),
    "a first plan in words": (
        with_metadata(first_plan="the first"),
        "metadata first_plan is 'the first', not",
    ),
    "a time in words": (with_metadata(simulated_ns="noon"), "metadata simulated_ns is 'noon', not the time of a watch"),
    "a time before the start": (with_metadata(simulated_ns="-1"), "metadata simulated_ns is '-1', not the time"),
    "a later end": (with_event(end_ns=10**15), "it lasts until 1000000.000 s; the motions of its lifts from"),
    "an earlier start": (with_event(start_ns=0), "; the motions of its lifts from"),
    "more kept": (with_event(lambda e: {"kept": "3"}), "it counts 3 lifts kept and 1 replanned, but 3 are planned"),
    "more retimed": (with_event(lambda e: {"retimed": "1"}), "it counts 1 lifts with a new motion; the log does not"),
    "not a count": (with_event(lambda e: {"changed_cells": "many"}), "its 'changed_cells' is 'many', not a number"),
    "others replanned": (
        with_event(lambda e: {"replanned": "left"}),
        "its 'replanned' is 'left'; not all",
    ),
    "none infeasible": (with_event(lambda e: {"infeasible": ""}), "its 'infeasible' is '', the plan gives 'slab'"),
    "another reason": (with_event(lambda e: {"why slab": "rain"}), "its 'why slab' is 'rain', the plan gives 'it is"),
    "a word more": (with_event(lambda e: {"approved": "yes"}), "its 'approved' is one that bimvox does not write"),
    "another event": (with_event(lambda e: {"event": "approved"}), "its 'event' is 'approved', not replanned,"),
    "no event": (lambda log: dataclasses.replace(log, events=()), "it has 0 events 'replan'; a segment has one"),
    "twice": (
        lambda log: dataclasses.replace(log, events=log.events * 2),
        "it has 2 events 'replan'; a segment",
    ),
    "an inspection": (
        lambda log: dataclasses.replace(log, events=(*log.events, LogEvent("inspection", 0, 1))),
        "bimvox writes no event 'inspection' into a log",
    ),
    "pending": (
        with_metadata(pending_lifts="[1]"),
        "metadata pending_lifts is '[1]'; these are not lifts",
    ),
    "not a segment": (with_metadata(pending_lifts=None), "no event 'replan' into a log that is not a segment"),
    "stopped elsewhere": (stopped(component="roof"), "the plan has no lift of 'roof'"),
    "went on": (stopped(goes_on_s="7.0"), "its 'goes_on_s' is '7.0', the motion gives None"),
    "held": (stopped(held="True"), "its 'held' is 'True'; the plan says something else"),
    "at rest earlier": (stopped(rest_s="1.0"), "its 'rest_s' is '1.0', but it ends at 5.000 s"),
    "no number": (stopped(swings_m="little"), "its 'swings_m' is 'little', not a number"),
    "half safe": (stopped(safe="yes"), "its 'safe' is 'yes', not True or False"),
    "stopped twice": (lambda log: stopped()(stopped()(log)), "a lift is stopped by two events 'stop'"),
    "words about a stop": (stopped(approved="yes"), "its fields are not those of a stop"),
}


def test_a_log_of_a_watch_is_accepted(first: PlanLog, segment: PlanLog):
    assert failures(first) == failures(segment) == []


@pytest.mark.parametrize("name", OF_A_SEGMENT)
def test_what_a_segment_says_about_itself_is_that_of_its_plan(segment: PlanLog, name: str):
    lie, says = OF_A_SEGMENT[name]
    found = failures(lie(segment))
    assert any(says in failure for failure in found), found


def test_a_stop_has_its_event(segment: PlanLog):
    (motion,) = segment.motions
    first, *rest = motion.phases
    halted = dataclasses.replace(motion, phases=(dataclasses.replace(first, name=PhaseName.STOP), *rest))
    (failure,) = failures(dataclasses.replace(segment, motions=(halted,)))
    assert failure.endswith("is stopped, but no event says so")


def test_the_first_plan_of_the_first_log_is_its_plan(first: PlanLog):
    (failure,) = failures(with_metadata(first_plan="0" * 64)(first))
    assert failure.startswith("metadata first_plan is 0000000000000000; the log is of revision 0, and its plan has")


def test_only_a_watch_that_carries_a_plan_out_sees_obstructions_change(first: PlanLog):
    until_ns = first.motions[-1].end_ns - 1
    changed = faults.with_plan(first, history=(Epoch(until_ns, ()),))
    (failure,) = failures(changed)
    assert failure.endswith("but metadata simulated_ns is missing: no watch carried it out")
    (failure,) = failures(with_metadata(simulated_ns="5000000000")(changed))
    assert failure.startswith("metadata simulated_ns is 5.000 s, but the obstructions changed at ")
    assert failures(with_metadata(simulated_ns=str(until_ns))(changed)) == []


def test_a_part_of_a_segment_is_no_segment(segment: PlanLog):
    part = segment.extract([3])
    assert PENDING not in part.metadata
    assert part.events == ()
    assert failures(part) == []
    assert [event.kind for event in segment.extract([1, 3]).events] == [REPLAN_EVENT]
