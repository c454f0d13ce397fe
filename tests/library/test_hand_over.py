"""A lift without a free time for its crane goes to the other crane, if that one serves it."""

from __future__ import annotations

import dataclasses
from typing import Any

import pytest
from two_cranes import two_crane_site

from bimvox.cranes.lift import NoFreeTimeError
from bimvox.cranes.schedule import time_lifts
from bimvox.library import prove
from bimvox.library.hand_over import as_assigned, handed_over
from bimvox.planning.order_search import prepare
from bimvox.policy.choice import NO_POLICY
from bimvox.progress import SilentProgress
from bimvox.records.lift import Status
from bimvox.site.build import with_digests
from bimvox.site.site import Site

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
