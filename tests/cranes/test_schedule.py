"""Lifts of two cranes on one clock."""

import dataclasses
from functools import cache
from itertools import pairwise

import numpy as np
import pytest
from box_sites import box_site
from two_cranes import two_crane_site

from bimvox.crane.kinematics import hook_of
from bimvox.crane.tower_crane import AxisLimits
from bimvox.cranes.clock import PlacedLeg, standing_at
from bimvox.cranes.clocks import Clocks
from bimvox.cranes.lifts import crane_lifts
from bimvox.cranes.schedule import _Schedule, time_lifts, time_rest
from bimvox.errors import MotionError
from bimvox.motion.figures import plan_figures
from bimvox.motion.steps import may_pause, steps_of
from bimvox.motion.time_plan import time_plan
from bimvox.planning.order.sequence import Sequencer
from bimvox.planning.order_search import prepare
from bimvox.planning.planner import plan_lifts
from bimvox.proof.clock import verify_steps
from bimvox.proof.motion import verify_motions
from bimvox.proof.plan import verify_plan
from bimvox.records.lift import Status
from bimvox.records.motion import PhaseName
from bimvox.records.steps import by_other_means, needed_by_ns
from bimvox.site.build import with_digests
from bimvox.site.means import Means
from bimvox.site.site import parts_beside


def planned(site):
    preparation = prepare(site)
    plan = plan_lifts(site, preparation)
    return plan, time_lifts(plan, preparation)


@cache
def two():
    return planned(two_crane_site())


def phase(motion, name):
    return next(phase for phase in motion.phases if phase.name is name)


def test_everything_is_planned_and_proven():
    plan, motions = two()
    assert all(lift.status is Status.PLANNED for lift in plan.lifts)
    assert {motion.crane for motion in motions} == {0, 1}
    assert verify_plan(plan).verified
    proof = verify_motions(plan, motions)
    assert proof.verified, proof.failures
    assert {"cranes", "turns"} <= {check.name for check in proof.checks}


def test_every_crane_drives_its_own_parts_without_gaps_from_the_start():
    plan, motions = two()
    for number in (0, 1):
        own = [motion for motion in motions if motion.crane == number]
        assert all(plan.site.components[motion.component].crane == number for motion in own)
        assert own[0].start_ns == 0
        assert all(one.end_ns == other.start_ns for one, other in pairwise(own))
        turns = [float(np.abs(np.diff(motion.samples()[1][:, 0])).max()) for motion in own]
        assert max(turns) < 0.5  # no jump by a whole turn between two motions


def test_the_order_holds_where_it_must():
    plan, motions = two()
    delivery = {lift.order: lift.place.delivery for lift in plan.lifts}
    for motion in motions:
        for earlier in motions:
            if earlier.order < motion.order:
                hooked_ns = phase(motion, PhaseName.HOOK_ON).start_ns
                assert hooked_ns >= earlier.raised_ns
                assert motion.set_ns >= earlier.set_ns
                if parts_beside(plan.site)[motion.component, earlier.component]:
                    assert motion.set_ns >= earlier.released_ns
                assert delivery[earlier.order] == delivery[motion.order] or hooked_ns >= earlier.released_ns


def slow_then_quick(truckload_kg=0.0, **more):
    """Return a plan whose first part a crane carries that slews slowly, and whose second one another crane carries."""
    usual = two_crane_site(truckload_kg=truckload_kg)
    parts = [
        ("slow", (16.0, 1.0, 0.0), (17.0, 2.0, 1.0), {"start_vox": (4, 14, 1)}),
        ("quick", (32.0, 1.0, 0.0), (33.0, 2.0, 1.0), {"start_vox": (60, 10, 1), **more}),
    ]
    site = box_site(parts, shape=usual.shape, yard=((0.0, 8.0), (80.0, 22.0)), crane=usual.cranes[0], rules=usual.rules)
    west, east = usual.cranes
    cranes = (dataclasses.replace(west, slewing=AxisLimits(0.01, 0.01, 0.01)), east)
    own = tuple(dataclasses.replace(part, crane=part.index) for part in site.components)
    plan, (slow, quick) = planned(with_digests(dataclasses.replace(site, cranes=cranes, components=own)))
    assert [motion.order for motion in (slow, quick)] == [slow.component, quick.component] == [0, 1]
    assert verify_motions(plan, (slow, quick)).verified
    return plan, slow, quick


@pytest.mark.parametrize(("more", "waits_until"), [({}, "set_ns"), ({"after": ("slow",)}, "released_ns")])
def test_a_part_that_could_be_set_first_waits_for_the_earlier_one(more, waits_until):
    """Rule R2: until the earlier part is set; until its slings are off if the two are next to each other."""
    _, slow, quick = slow_then_quick(**more)
    assert quick.hooked_ns > slow.raised_ns + 5e9  # R1 alone would let it begin earlier
    assert 0 <= quick.set_ns - getattr(slow, waits_until) < 1e9


def test_a_part_of_a_later_delivery_waits_until_the_earlier_one_is_finished():
    """Rule R3: the lorry comes into the yard when nothing of the delivery before is on a hook."""
    plan, slow, quick = slow_then_quick(truckload_kg=2_500.0)
    assert [lift.place.delivery for lift in plan.lifts] == [0, 1]
    assert 0 <= quick.hooked_ns - slow.released_ns < 1e9


@pytest.mark.parametrize("passes", [True, False])
def test_a_part_is_set_after_the_empty_hook_of_another_crane_has_passed_its_place(passes):
    """Also rule R2: a leg says which parts must not be there yet."""
    plan, _ = two()
    lifts = crane_lifts(plan, prepare(plan.site))
    clocks, first = Clocks(plan, lifts, None, (), 0), lifts[0]
    other = clocks.of(1 - first.crane)
    leg = next(one.early for one in lifts if one.early is not None and one.crane == other.number)
    at_ns, waits = 500 * 10**9, standing_at(other.start.first, 500 * 10**9)
    other.add_leg(PlacedLeg(at_ns, leg.trajectory, waits, before=frozenset({first.lift.order} if passes else ())))
    way = clocks.lift(clocks.of(first.crane), first)
    assert way is not None
    assert (way.set_ns >= other.free_ns > at_ns) == passes


def test_the_cranes_work_at_the_same_time():
    plan, motions = two()
    busy_ns = sum(p.end_ns - p.start_ns for m in motions for p in m.phases if p.name is not PhaseName.WAIT)
    whole_ns = max(motion.end_ns for motion in motions)
    assert whole_ns < 0.9 * busy_ns
    cranes = plan_figures(plan, motions).cranes
    assert [crane.lifts for crane in cranes] == [4, 3]
    assert sum(crane.busy_s for crane in cranes) == pytest.approx(busy_ns / 1e9)
    assert all(0.0 < crane.share <= 1.0 for crane in cranes)


def test_no_load_waits_in_the_air():
    for motion in two()[1]:
        for one in motion.phases:
            if one.name is PhaseName.WAIT:
                hooked_ns = phase(motion, PhaseName.HOOK_ON).start_ns
                assert one.end_ns <= hooked_ns or one.start_ns >= motion.released_ns


def test_the_same_site_gives_the_same_motions():
    again = planned(two_crane_site())[1]
    for one, other in zip(two()[1], again, strict=True):
        assert one.phases == other.phases
        assert all(np.array_equal(a, b) for a, b in zip(one.samples(), other.samples(), strict=True))


def test_a_larger_separation_costs_time_and_is_kept():
    plan, motions = planned(two_crane_site(crane_separation_m=4.0))
    assert verify_motions(plan, motions).verified
    assert max(motion.end_ns for motion in motions) >= max(motion.end_ns for motion in two()[1])


def test_a_crane_without_parts_is_not_an_obstacle():
    site = two_crane_site()
    # With a longer jib, west reaches everything, and east has no lifts.
    west = dataclasses.replace(site.cranes[0], jib_length_m=16.0)
    components = tuple(dataclasses.replace(one, crane=0) for one in site.components if one.id.startswith("west"))
    components = tuple(
        dataclasses.replace(one, index=n, after=()) for n, one in enumerate(components) if "bridge" not in one.id
    )
    alone = dataclasses.replace(site, cranes=(west, site.cranes[1]), components=components)
    plan, motions = planned(alone)
    assert verify_motions(plan, motions).verified
    single = dataclasses.replace(alone, cranes=(west,))
    preparation = prepare(single)
    one_plan = plan_lifts(single, preparation)
    serial = time_plan(one_plan, preparation)
    assert max(motion.end_ns for motion in motions) <= max(motion.end_ns for motion in serial) + len(serial)


def test_a_part_set_by_other_means_is_in_the_way_of_every_crane_from_its_turn_on():
    site = two_crane_site()
    plan, motions = two()
    for name in ("west left", "east left"):
        preparation = prepare(site)
        made = plan_lifts(site, preparation, refused={name: "so"})
        timed = time_lifts(made, preparation)
        (left,) = by_other_means(made.lifts)
        assert site.components[left.component].id == name
        assert len(timed) == len(plan.lifts) - 1
        assert verify_plan(made).verified
        assert verify_motions(made, timed).verified, verify_motions(made, timed).failures
        later = [motion.set_ns for motion in timed if motion.order > left.order]
        assert needed_by_ns(made.lifts, timed) == {left.order: min(later)}
    assert len(motions) == len(plan.lifts)


@pytest.mark.parametrize("separation_m", [1.0, 5.0])
def test_a_hook_leaves_before_a_part_comes_by_other_means_onto_the_one_that_it_set(separation_m):
    """East sets its last column, then west sets one, then the beam comes onto east's columns by other means."""
    site = two_crane_site(crane_separation_m=separation_m)
    parts = tuple(
        dataclasses.replace(one, start_vox=(36, 13, 1), crane=1) if one.id == "west bridge" else one
        for one in site.components
    )
    site = with_digests(dataclasses.replace(site, components=parts))
    preparation = prepare(site)
    plan = plan_lifts(site, preparation, refused={"east beam": "so"})
    names = [site.components[lift.component].id for lift in plan.lifts]
    assert names[2:5] == ["east right", "west right", "east beam"]
    assert [lift.order for lift in by_other_means(plan.lifts)] == [4]
    motions = time_lifts(plan, preparation)
    proof = verify_motions(plan, motions)
    assert proof.verified, proof.failures
    assert len(motions) == 6


def test_what_is_cast_in_place_keeps_the_motions_of_several_cranes_proven():
    site = two_crane_site()
    parts = tuple(
        dataclasses.replace(one, means=Means.IN_SITU, means_reason="so") if one.id == "east left" else one
        for one in site.components
    )
    plan, motions = planned(dataclasses.replace(site, components=parts))
    assert [lift.status for lift in plan.lifts].count(Status.IN_SITU) == 1
    assert verify_plan(plan).verified
    assert verify_motions(plan, motions).verified


def test_no_load_hangs_while_the_cranes_pause_for_what_is_cast():
    site = two_crane_site()
    for name in ("east left", "west right"):
        parts = tuple(
            dataclasses.replace(one, means=Means.IN_SITU, means_reason="so") if one.id == name else one
            for one in site.components
        )
        plan, motions = planned(dataclasses.replace(site, components=parts))
        steps = steps_of(plan.site, plan.lifts, motions)
        (step,) = steps.steps
        check = verify_steps(plan, motions, steps)
        assert check.passed, check.failures
        waiting = may_pause(plan)
        assert {pause.order for pause in steps.pauses} <= waiting
        assert bool(steps.pauses) == (step.carries_ns > 0)
        for order in waiting:
            hooked_ns = next(motion.hooked_ns for motion in motions if motion.order == order)
            assert not [one for one in motions if one.hooked_ns < hooked_ns < one.released_ns]


def test_cranes_that_always_obstruct_each_other_are_reported():
    with pytest.raises(MotionError) as caught:
        planned(two_crane_site(crane_separation_m=15.0))
    assert "no free time slot for it alongside the other cranes" in str(caught.value)
    assert "crane" in str(caught.value.hint)


def low_and_high(order):
    """Return a site on which ropes of east pass where the jib of west can wait, its lifts, and the plan."""
    site = two_crane_site(crane_separation_m=2.0)
    west = dataclasses.replace(site.cranes[0], jib_length_m=16.0)
    east = dataclasses.replace(site.cranes[1], jib_height_m=20.0, jib_length_m=26.0, base_m=(26.0, -3.0, 0.0))
    parts = tuple(dataclasses.replace(one, crane=int("west b" not in one.id)) for one in site.components)
    site = with_digests(dataclasses.replace(site, cranes=(west, east), components=parts))
    preparation = prepare(site)
    numbers = {one.id: one.index for one in parts}
    sequencer = Sequencer(site, preparation.relations, preparation.contacts)
    sequence = sequencer.following([numbers[name] for name in order])
    preparation = dataclasses.replace(preparation, sequence=sequence)
    plan = plan_lifts(site, preparation)
    return plan, preparation


@pytest.mark.parametrize(
    "order",
    [
        ["west left", "west right", "east left", "east right", "west beam", "east beam", "west bridge"],
        ["east right", "west right", "east left", "west left", "west beam", "east beam", "west bridge"],
    ],
)
def test_a_parked_crane_moves_on_if_there_is_no_other_way(order, monkeypatch):
    plan, preparation = low_and_high(order)
    motions = time_lifts(plan, preparation)
    assert len(motions) == len(plan.lifts) == 7
    proof = verify_motions(plan, motions)
    assert proof.verified, proof.failures
    monkeypatch.setattr(_Schedule, "_with_every_place", lambda *_: False)
    with pytest.raises(MotionError):
        time_lifts(plan, preparation)


def test_also_in_a_revision_a_parked_crane_moves_on():
    plan, preparation = low_and_high(
        ["west left", "west right", "east left", "east right", "west beam", "east beam", "west bridge"]
    )
    ready_ns = 60_000_000_000
    motions = time_rest(plan, crane_lifts(plan, preparation), {}, (), ready_ns)
    assert len(motions) == 7
    assert min(motion.hooked_ns for motion in motions) >= ready_ns
    assert verify_motions(plan, motions).verified


def test_all_parking_places_are_the_first_ones_and_more_with_legs_between_them():
    plan, preparation = low_and_high(
        ["east right", "west right", "east left", "west left", "west beam", "east beam", "west bridge"]
    )
    lifts = [one for one in crane_lifts(plan, preparation) if one.parkings]
    assert lifts
    for one in lifts:
        places = one.every_parking()
        ends = [way.back.trajectory.axes[0] for way in places]
        assert len(places) >= len(one.parkings)
        assert all(
            np.allclose(way.back.trajectory.axes, own.back.trajectory.axes)
            for way, own in zip(places, one.parkings, strict=False)
        )
        ways = [(n, m, legs) for n, way in enumerate(places) for m, legs in enumerate(way.across) if legs]
        for _, _, (usual, creeping) in ways:
            assert creeping.trajectory.duration_s > 2.0 * usual.trajectory.duration_s
        legs = [(n, m, leg) for n, m, both in ways for leg in both]
        assert len(ways) > len(places)
        for n, m, leg in legs:
            begins, finishes = leg.trajectory.axes[0], leg.trajectory.axes[-1]
            assert n != m
            assert np.allclose(begins[1:], ends[n][1:])
            assert np.allclose(finishes[1:], ends[m][1:])
            assert np.isclose(np.cos(finishes[0] - ends[m][0]), 1.0)


def test_an_early_leg_delays_only_parts_next_to_it():
    site = two_crane_site()
    preparation = prepare(site)
    legs = [(one.crane, one.early) for one in crane_lifts(plan_lifts(site, preparation), preparation) if one.early]
    assert legs
    order = preparation.sequence.order
    for number, leg in legs:
        hook_m = hook_of(site.cranes[number], *leg.trajectory.axes.T)[:, None, :2]
        for later in leg.before:
            low_m, high_m = site.components[order[later]].mesh.bounds_m[:, :2]
            apart_m = np.hypot(*np.maximum(np.maximum(low_m - hook_m, hook_m - high_m), 0.0).T)
            assert apart_m.min() < 3.0


def test_of_the_ways_around_each_other_the_one_is_taken_with_which_the_next_lifts_end_first(monkeypatch):
    site = two_crane_site(crane_separation_m=5.0)
    preparation = prepare(site)
    plan = plan_lifts(site, preparation)
    lifts = crane_lifts(plan, preparation)

    def end_ns():
        return max(motion.end_ns for motion in time_rest(plan, lifts, {}, (), 0))

    best_ns = end_ns()
    monkeypatch.setattr(_Schedule, "_ends_ns", lambda *_: 0)  # the first way
    assert best_ns < end_ns()


def test_a_search_for_a_free_time_is_not_made_again_with_the_same_on_the_clocks(monkeypatch):
    site = two_crane_site(crane_separation_m=5.0)
    preparation = prepare(site)
    plan = plan_lifts(site, preparation)
    lifts, made = crane_lifts(plan, preparation), []
    searched, first_free = Clocks._searched, Clocks._first_free
    monkeypatch.setattr(Clocks, "_searched", lambda *given: made.append(0) or searched(*given))
    kept = time_rest(plan, lifts, {}, (), 0)
    count = len(made)

    def forgotten(clocks, *given):
        clocks._free.clear()
        return first_free(clocks, *given)

    monkeypatch.setattr(Clocks, "_first_free", forgotten)
    again = time_rest(plan, lifts, {}, (), 0)
    assert count < len(made) - count
    assert [one.phases for one in kept] == [one.phases for one in again]
