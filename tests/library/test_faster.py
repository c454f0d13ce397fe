"""The sequence of several cranes is the one whose motions end earlier."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from box_sites import box_site, test_crane
from two_cranes import two_crane_site

from bimvox.cranes.schedule import time_lifts
from bimvox.library import faster
from bimvox.library.hand_over import as_assigned
from bimvox.planning.order.sequence import Sequencer
from bimvox.planning.order_search import plan_without_obstructions, prepare
from bimvox.planning.planner import plan_lifts
from bimvox.planning.preparation import Preparation
from bimvox.proof.motion import verify_motions
from bimvox.proof.plan import verify_plan
from bimvox.records.lift import Status
from bimvox.site.build import with_digests
from bimvox.site.crew_times import CrewTimes, TimesByWork
from bimvox.site.site import Blocker, Rules, Site
from bimvox.walk import Store


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
    monkeypatch.setattr(faster, "faster", lambda *_: (site, turns))
    assert faster.faster_on_the_clock(site, blocks) == (site, turns)
    monkeypatch.setattr(faster, "faster", lambda *_: (site, blocks))
    assert faster.faster_on_the_clock(site, turns) == (site, turns)
    monkeypatch.setattr(faster, "faster", lambda *_: None)
    assert faster.faster_on_the_clock(site, blocks) == (site, blocks)


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
    alone = faster.preparation_of(site)
    given, made = faster.preparation_of(site, free=ids)
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
    assert faster.preparation_of(site, free=ids)[1].sequence == made.sequence
    kept = [name for name in ids if name not in moved]
    stays, _ = faster.preparation_of(site, free=kept)
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
