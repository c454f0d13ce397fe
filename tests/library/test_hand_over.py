"""A lift without a free time for its crane goes to the other crane, if that one serves it."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest
from box_sites import box_site, test_crane
from two_cranes import two_crane_site

from bimvox.cranes.lift import NoFreeTimeError
from bimvox.cranes.schedule import time_lifts
from bimvox.library import hand_over, prove
from bimvox.library.hand_over import as_assigned, handed_over
from bimvox.planning.order.sequence import Sequencer
from bimvox.planning.order_search import plan_without_obstructions, prepare
from bimvox.planning.planner import plan_lifts
from bimvox.planning.preparation import Preparation
from bimvox.policy.choice import NO_POLICY
from bimvox.progress import SilentProgress
from bimvox.proof.motion import verify_motions
from bimvox.proof.plan import verify_plan
from bimvox.records.lift import Status
from bimvox.site.build import with_digests
from bimvox.site.crew_times import CrewTimes, TimesByWork
from bimvox.site.site import Blocker, Rules, Site
from bimvox.walk import Store

BRIDGE = NoFreeTimeError("west bridge", "west has no free time slot for it")


def site_with_a_bridge_between(**crane: float) -> Site:
    """Return a site on which both cranes carry the bridge from its place in the yard."""
    site = two_crane_site()
    parts = tuple(
        dataclasses.replace(one, start_vox=(36, 13, 1)) if one.id == BRIDGE.component else one
        for one in site.components
    )
    cranes = (site.cranes[0], dataclasses.replace(site.cranes[1], **crane))
    return with_digests(dataclasses.replace(site, components=parts, cranes=cranes))


def test_the_part_keeps_its_place_and_a_note_says_who_lifts_it() -> None:
    site = site_with_a_bridge_between()
    preparation = prepare(site)
    other, prepared, given = handed_over(site, preparation, [BRIDGE.component])
    assert given == [BRIDGE.component]
    assert [one.crane for one in other.components] == [0, 0, 0, 1, 1, 1, 1]
    assert other.digest != site.digest
    assert prepared.places == preparation.places
    assert prepared.sequence.order == preparation.sequence.order
    assert prepared.sequence.notes[-1] == (
        "west bridge: west has no free time for it alongside the other cranes, so east lifts it; "
        '[[component]] crane = "east" keeps that'
    )


@pytest.mark.parametrize("crane", [{"jib_length_m": 11.0}, {"sling_m": 5.0}, {"min_radius_m": 12.0}])
def test_a_crane_that_does_not_reach_it_or_has_other_slings_does_not_get_it(crane: dict[str, float]) -> None:
    site = site_with_a_bridge_between(**crane)
    preparation = prepare(site)
    assert handed_over(site, preparation, [BRIDGE.component]) == (site, preparation, [])


def timed_if_east_has_it(made: Any, *more: Any) -> Any:
    lifts = {made.site.components[lift.component].id: lift for lift in made.lifts}
    bridge = lifts[BRIDGE.component]
    if bridge.status is Status.PLANNED and made.site.components[bridge.component].crane == 0:
        raise BRIDGE
    return time_lifts(made, *more)


def test_the_plan_is_proven_with_the_other_crane(monkeypatch: pytest.MonkeyPatch) -> None:
    site = site_with_a_bridge_between()
    monkeypatch.setattr(prove, "time_lifts", timed_if_east_has_it)
    given = prepare(site)
    made = prove.plan_and_prove(site, given, NO_POLICY, progress=SilentProgress(), may_hand_over=["west bridge"])
    assert made.verdict is not None
    assert made.verdict.verified
    assert made.preparation is not None
    assert {lift.status for lift in made.plan.lifts} == {Status.PLANNED}
    assert made.motions[-1].crane == 1
    assert "so east lifts it" in made.plan.notes[-1]
    assert [one.crane for one in as_assigned(made.plan).components] == [one.crane for one in site.components]


def test_otherwise_the_lift_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    site = site_with_a_bridge_between()
    monkeypatch.setattr(prove, "time_lifts", timed_if_east_has_it)
    made = prove.plan_and_prove(site, prepare(site), NO_POLICY, progress=SilentProgress())
    assert made.preparation is None
    (refused,) = (lift for lift in made.plan.lifts if lift.status is not Status.PLANNED)
    assert "no free time slot" in (refused.reason or "")


def test_of_several_lifts_some_are_handed_over_and_the_rest_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    site = site_with_a_bridge_between()
    rounds = []

    def timed(made: Any, *more: Any) -> Any:
        planned = {made.site.components[one.component].id for one in made.lifts if one.status is Status.PLANNED}
        rounds.append(planned)
        if "east left" in planned:
            raise NoFreeTimeError("east left", "busy", more={"west bridge": "busy, too"})
        return time_lifts(made, *more)

    monkeypatch.setattr(prove, "time_lifts", timed)
    may = [one.id for one in site.components]
    made = prove.plan_and_prove(site, prepare(site), NO_POLICY, progress=SilentProgress(), may_hand_over=may)
    assert len(rounds) == 2  # both in one round
    assert "so east lifts it" in made.plan.notes[-1]
    (refused,) = (lift for lift in made.plan.lifts if lift.status is not Status.PLANNED)
    assert "busy" in (refused.reason or "")
    assert made.verdict is not None
    assert made.verdict.verified


def with_order(preparation: Preparation, ids: list[str]) -> Preparation:
    site = two_crane_site()
    numbers = {component.id: component.index for component in site.components}
    sequencer = Sequencer(site, preparation.relations, preparation.contacts)
    sequence = sequencer.following([numbers[name] for name in ids])
    assert [site.components[i].id for i in sequence.order] == ids
    return dataclasses.replace(preparation, sequence=sequence)


def test_the_order_whose_motions_end_earlier_is_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    site = two_crane_site()
    known = prepare(site)
    ends = ["east beam", "west beam", "west bridge"]
    turns = with_order(known, ["west left", "east left", "west right", "east right", *ends])
    blocks = with_order(known, ["west left", "west right", "east left", "east right", *ends])
    monkeypatch.setattr(hand_over, "faster", lambda *_: (site, turns))
    assert hand_over.faster_on_the_clock(site, blocks) == (site, turns)
    monkeypatch.setattr(hand_over, "faster", lambda *_: (site, blocks))
    assert hand_over.faster_on_the_clock(site, turns) == (site, turns)
    monkeypatch.setattr(hand_over, "faster", lambda *_: None)
    assert hand_over.faster_on_the_clock(site, blocks) == (site, blocks)


def row_of_posts() -> Site:
    """Return two cranes at the ends of a row of posts; both reach most of them, but nearly all are of the first one."""
    west = dataclasses.replace(test_crane(base=(8.0, -3.0, 0.0), height=14.0), name="west", jib_length_m=22.0)
    east = dataclasses.replace(west, name="east", base_m=(32.0, -3.0, 0.0))
    posts = [
        (f"post {n}", (x, 2.0, 0.0), (x + 0.5, 2.5, 3.0), {"ifc_class": "IfcColumn"})
        for n, x in enumerate(range(4, 37, 3))
    ]
    site = box_site(posts, shape=(80, 40, 40), yard=((3.0, 6.0), (37.0, 13.0)), crane=west)
    parts = tuple(dataclasses.replace(part, crane=int(part.index > 8)) for part in site.components)
    times = TimesByWork(*[CrewTimes(100.0, 60.0, 20.0)] * len(dataclasses.fields(TimesByWork)))
    return with_digests(
        dataclasses.replace(site, components=parts, cranes=(west, east), rules=Rules(order_search=True, times=times))
    )


def hours_of(site: Site, preparation: Preparation) -> float:
    plan = plan_lifts(site, preparation)
    assert all(lift.status is Status.PLANNED for lift in plan.lifts)
    return max(motion.end_ns for motion in time_lifts(plan, preparation)) / 3.6e12


@pytest.mark.slow
def test_parts_go_to_the_crane_that_has_less_to_do_if_the_schedule_is_shorter_then() -> None:
    site = row_of_posts()
    ids = [part.id for part in site.components]
    alone = hand_over.preparation_of(site)
    given, made = hand_over.preparation_of(site, free=ids)
    assert alone[0] is site
    assert hours_of(given, made) < 0.95 * hours_of(*alone)
    moved = [
        part.id for part, other in zip(site.components, given.components, strict=True) if part.crane != other.crane
    ]
    assert len(moved) >= 3
    notes = [note for note in made.sequence.notes if "east lifts it instead of west" in note]
    assert [note.partition(":")[0] for note in notes] == moved
    plan = plan_lifts(given, made)
    assert verify_plan(plan).verified
    assert verify_motions(plan, time_lifts(plan, made)).verified
    assert as_assigned(plan).fixed_digest == site.fixed_digest != given.fixed_digest
    assert hand_over.preparation_of(site, free=ids)[1].sequence == made.sequence
    kept = [name for name in ids if name not in moved]
    stays, _ = hand_over.preparation_of(site, free=kept)
    assert {part.crane for part in stays.components if part.id in moved} == {0}


def test_the_plan_without_obstructions_is_made_once() -> None:
    site = two_crane_site()
    (cells,) = np.array([[[3, 3, 1], [4, 3, 1]]], np.int32)
    site = with_digests(dataclasses.replace(site, blockers=(*site.blockers, Blocker("silo", "obstruction", cells))))
    preparation, store = prepare(site), Store()
    plan = plan_without_obstructions(site, preparation, store=store)
    assert "obstruction" not in {blocker.kind for blocker in plan.site.blockers}
    again = plan_without_obstructions(site, preparation, store=store)
    assert all(one is other for one, other in zip(again.lifts, plan.lifts, strict=True))
    other = plan_without_obstructions(site, prepare(site), store=store)
    assert not any(one is own for one, own in zip(other.lifts, plan.lifts, strict=True))
