"""Work that the crane does not do: its time, the wait before it carries, and the pauses of the crane."""

from __future__ import annotations

import dataclasses
from functools import cache

import pytest
from box_sites import box_site, test_crane

from bimvox.motion.steps import may_pause, steps_of
from bimvox.motion.time_plan import time_plan
from bimvox.planning.order_search import prepare
from bimvox.planning.planner import plan_lifts
from bimvox.proof.clock import verify_steps
from bimvox.records.lift import LiftPlan
from bimvox.records.motion import LiftMotion
from bimvox.records.steps import Pause, Step, Steps
from bimvox.site.casting import FIELD_CASTING, FIELD_CURING, CastTimes, Curing
from bimvox.site.component import OrderHints
from bimvox.site.means import Means
from bimvox.site.site import Rules, floors_at_feet

H = 3600 * 10**9
ORDER = ("left", "right", "aside", "beam", "slab")
COLUMN = {"ifc_class": "IfcColumn", "erected": True}
PORTAL = [
    ("slab", (1.0, 1.0, 3.4), (5.0, 2.0, 3.6)),
    ("beam", (1.0, 1.4, 3.0), (5.0, 1.6, 3.4)),
    ("left", (1.0, 1.4, 0.0), (1.2, 1.6, 2.98), COLUMN),
    ("right", (4.8, 1.4, 0.0), (5.0, 1.6, 2.98), COLUMN),
    ("aside", (7.0, 1.4, 0.0), (7.4, 1.8, 2.98), COLUMN),
]
CASTING = dataclasses.replace(FIELD_CASTING, people=2.0, beam=CastTimes(10.0, 50.0), column=CastTimes(5.0, 20.0))


@cache
def portal(casting=CASTING, curing=None, **means: Means) -> tuple[LiftPlan, tuple[LiftMotion, ...]]:
    """Return the plan of a portal with a block next to it, of which some parts are not lifted."""
    crane = test_crane(base=(10.0, -3.0, 0.0), jib=40.0, height=14.0)
    site = box_site(PORTAL, crane=crane, shape=(40, 30, 24), rules=Rules(casting=casting, curing=curing))
    parts = (
        dataclasses.replace(
            one,
            means=means.get(one.id, Means.CRANE),
            means_reason="so",
            hints=OrderHints(rank=ORDER.index(one.id)),
        )
        for one in site.components
    )
    site = dataclasses.replace(site, components=tuple(parts))
    preparation = prepare(site)
    plan = plan_lifts(site, preparation)
    return plan, time_plan(plan, preparation)


def steps_by_name(plan: LiftPlan, motions: tuple[LiftMotion, ...]) -> tuple[Steps, dict[str, Step], dict[str, int]]:
    steps = steps_of(plan.site, plan.lifts, motions)
    names = {lift.order: plan.site.components[lift.component].id for lift in plan.lifts}
    return steps, {names[one.order]: one for one in steps.steps}, {name: order for order, name in names.items()}


def test_the_crane_pauses_until_a_cast_beam_carries_the_slab():
    plan, motions = portal(beam=Means.IN_SITU)
    steps, of, order = steps_by_name(plan, motions)
    before = [motion for motion in motions if motion.order < order["beam"]]
    slab = next(motion for motion in motions if motion.order == order["slab"])
    beam = of["beam"]
    assert beam.begins_ns == before[-1].end_ns
    work_h = 10.0 * 4.0 * 0.2 * 0.4 / 2.0
    assert beam.ends_ns - beam.begins_ns == pytest.approx(work_h * H)
    assert beam.carries_ns - beam.ends_ns == 50 * H
    assert steps.pauses == (Pause(slab.order, slab.start_ns, beam.carries_ns - slab.start_ns),)
    assert steps.starting_ns(slab.start_ns) == beam.carries_ns
    assert steps.ending_ns(slab.start_ns) == slab.start_ns
    assert may_pause(plan) == {slab.order}


def test_the_crane_goes_on_with_what_does_not_rest_on_it():
    plan, motions = portal(left=Means.IN_SITU, right=Means.IN_SITU)
    steps, _, _ = steps_by_name(plan, motions)
    assert not steps.pauses  # both were cast before the first lift
    plan, motions = portal(right=Means.IN_SITU)
    steps, of, order = steps_by_name(plan, motions)
    aside, beam = (next(one for one in motions if one.order == order[name]) for name in ("aside", "beam"))
    assert order["right"] < aside.order < beam.order
    assert steps.starting_ns(aside.start_ns) == aside.start_ns < of["right"].carries_ns
    assert [pause.order for pause in steps.pauses] == [beam.order]
    assert steps.starting_ns(beam.start_ns) == of["right"].carries_ns


def test_work_before_the_first_lift_is_done_when_the_clock_starts():
    plan, motions = portal(left=Means.IN_SITU, right=Means.IN_SITU)
    steps, of, _ = steps_by_name(plan, motions)
    first, last = sorted((of["left"], of["right"]), key=lambda step: step.order)
    assert max(first.carries_ns, last.carries_ns) == 0
    assert first.ends_ns == last.begins_ns < 0  # one crew
    assert last.carries_ns - last.ends_ns == 20 * H
    assert motions[0].start_ns == 0
    assert not steps.pauses


def test_what_is_set_by_hand_takes_a_little_time_and_no_wait():
    plan, motions = portal(beam=Means.BY_HAND)
    steps, of, _ = steps_by_name(plan, motions)
    assert of["beam"].ends_ns - of["beam"].begins_ns == round(CASTING.hand_s * 1e9)
    assert of["beam"].carries_ns == of["beam"].ends_ns
    assert [pause.length_ns for pause in steps.pauses] == [round(CASTING.hand_s * 1e9)]


def test_a_part_that_is_set_by_other_means_waits_for_what_it_rests_on():
    plan, _ = portal(beam=Means.IN_SITU)
    site, preparation = plan.site, prepare(plan.site)
    made = plan_lifts(site, preparation, refused={"slab": "so"})
    steps, of, _ = steps_by_name(made, time_plan(made, preparation))
    assert of["slab"].begins_ns == of["slab"].carries_ns == of["beam"].carries_ns
    assert not steps.pauses


def test_the_crane_waits_until_joints_have_cured_and_goes_on_meanwhile():
    plan, motions = portal(None, Curing(column_h=20.0))
    steps, _, order = steps_by_name(plan, motions)
    of = {name: next(one for one in motions if one.order == order[name]) for name in ORDER}
    cured_ns = of["right"].released_ns + 20 * H
    assert order["right"] < order["aside"] < order["beam"]  # nothing waits but what rests on a column
    assert steps == Steps((), (Pause(order["beam"], of["beam"].start_ns, cured_ns - of["beam"].start_ns),))
    assert may_pause(plan) & {order["aside"], order["beam"]} == {order["beam"]}
    both, _, _ = steps_by_name(*portal(None, Curing(column_h=20.0, beam_h=3.0)))
    carries_ns = both.ending_ns(of["beam"].released_ns) + 3 * H
    assert [(one.order, one.length_ns) for one in both.pauses[1:]] == [
        (order["slab"], carries_ns - Steps((), both.pauses[:1]).starting_ns(of["slab"].start_ns))
    ]


STACKED = [
    ("lower", (2.0, 1.4, 0.0), (2.4, 1.8, 2.98), COLUMN),
    ("beam", (2.0, 1.4, 3.0), (6.0, 1.8, 3.98), {"ifc_class": "IfcBeam"}),
    ("end", (5.6, 1.4, 0.0), (6.0, 1.8, 2.98), COLUMN),
    ("upper", (2.0, 1.4, 4.0), (2.4, 1.8, 6.48), COLUMN),
]


def test_by_default_a_storey_waits_for_the_joints_of_the_one_below_and_floors_do_not():
    assert FIELD_CURING.column_h > 0.0 and not FIELD_CURING.floors_wait
    crane = test_crane(base=(10.0, -3.0, 0.0), jib=40.0, height=20.0)
    waiting = {}
    for beam_h, floors_wait in ((0.0, False), (5.0, False), (5.0, True)):
        curing = dataclasses.replace(FIELD_CURING, beam_h=beam_h, floors_wait=floors_wait)
        site = box_site(STACKED, crane=crane, shape=(40, 30, 36), rules=Rules(curing=curing))
        preparation = prepare(site)
        plan = plan_lifts(site, preparation)
        motions = time_plan(plan, preparation)
        steps, _, order = steps_by_name(plan, motions)
        waiting[beam_h, floors_wait] = {name for name in order if order[name] in {one.order for one in steps.pauses}}
        assert {name for name in order if order[name] in may_pause(plan)} >= waiting[beam_h, floors_wait]
        assert floors_wait or order["beam"] not in may_pause(plan)  # two cranes need not wait for it
        assert verify_steps(plan, motions, steps).passed
        late = verify_steps(plan, motions, Steps())
        assert bool(late.failures) == bool(steps.pauses)
    assert waiting == {(0.0, False): set(), (5.0, False): {"upper"}, (5.0, True): {"beam", "upper"}}


PLANK = {"ifc_class": "IfcSlab"}
STOREY = [
    ("lower", (2.0, 1.4, 0.0), (2.4, 1.8, 3.0), COLUMN),
    ("beside", (2.6, 1.0, 2.8), (5.0, 2.2, 3.0), PLANK),
    ("one", (2.6, 1.4, 0.0), (3.0, 1.8, 2.78), COLUMN),
    ("other", (4.6, 1.4, 0.0), (5.0, 1.8, 2.78), COLUMN),
    ("far", (2.0, 7.0, 0.0), (2.4, 7.4, 3.0), COLUMN),
    ("upper", (2.0, 1.4, 3.02), (2.4, 1.8, 5.5), COLUMN),
    ("far upper", (2.0, 7.0, 3.02), (2.4, 7.4, 5.5), COLUMN),
]


def test_a_column_waits_for_the_joints_of_the_floor_at_its_feet_though_it_does_not_rest_on_it():
    crane = test_crane(base=(10.0, -3.0, 0.0), jib=40.0, height=20.0)
    curing = Curing(slab_h=5.0, floors_wait=False)
    site = box_site(STOREY, crane=crane, shape=(50, 50, 36), rules=Rules(curing=curing))
    ranks = ("lower", "one", "other", "far", "beside", "upper", "far upper")
    parts = (dataclasses.replace(one, hints=OrderHints(rank=ranks.index(one.id))) for one in site.components)
    site = dataclasses.replace(site, components=tuple(parts))
    number = {part.id: part.index for part in site.components}
    waits = floors_at_feet(site)
    assert {(one, other) for one in number for other in number if waits[number[one], number[other]]} == {
        ("upper", "beside")
    }  # not the columns below it, and not the one that is 5 m away
    preparation = prepare(site)
    plan = plan_lifts(site, preparation)
    motions = time_plan(plan, preparation)
    steps, _, order = steps_by_name(plan, motions)
    of = {name: next(one for one in motions if one.order == order[name]) for name in order}
    assert order["beside"] < order["upper"]
    cured_ns = of["beside"].released_ns + 5 * H
    assert steps.starting_ns(of["upper"].start_ns) == cured_ns
    assert [pause.order for pause in steps.pauses] == [order["upper"]] == sorted(may_pause(plan))
    assert verify_steps(plan, motions, steps).passed
    (late,) = verify_steps(plan, motions, Steps()).failures
    assert "beside (IfcSlab) at its feet" in late or "beside at its feet" in late


def test_what_is_cast_on_lifted_parts_waits_for_their_joints():
    steps, of, order = steps_by_name(*portal(curing=Curing(column_h=20.0), beam=Means.IN_SITU))
    right = next(
        one for one in portal(curing=Curing(column_h=20.0), beam=Means.IN_SITU)[1] if one.order == order["right"]
    )
    assert of["beam"].begins_ns == right.released_ns + 20 * H
    assert [one.order for one in steps.pauses] == [order["slab"]]


def test_plans_without_such_work_or_without_motions_have_no_steps():
    assert not may_pause(portal()[0])
    assert steps_of(*_of(portal())) == Steps()
    with_crane, _ = portal(beam=Means.IN_SITU)
    assert steps_of(with_crane.site, with_crane.lifts, ()) == Steps()


def _of(made: tuple[LiftPlan, tuple[LiftMotion, ...]]):
    return made[0].site, made[0].lifts, made[1]
