"""Forged lifts by two cranes are refused by name."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from tandem_sites import BEAM, crane_at, planned_together, tandem_site

from bimvox.crane.load_chart import LoadChart
from bimvox.motion.trajectories import delayed, delayed_phases
from bimvox.proof.motion import verify_motions
from bimvox.proof.plan import verify_plan
from bimvox.proof.tandem import as_crane_sees, shares
from bimvox.proof.values import check_values
from bimvox.records.motion import PhaseName
from bimvox.site.component import Tandem
from bimvox.site.default_rules import TandemRules
from bimvox.site.site import Rules
from bimvox.site.tandem import halves

SMALL = ("small", (3.0, 18.0, 0.0), (5.0, 19.0, 1.0))
BEHIND = ("behind", (18.0, 18.0, 0.0), (20.0, 19.0, 1.0))


@pytest.fixture(scope="module")
def made():
    return planned_together(tandem_site(parts=(SMALL, BEAM, BEHIND)))


def beam_of(plan, motions):
    """Return the lift of the beam and its motion."""
    lift = next(one for one in plan.lifts if one.tandem is not None)
    return lift, next(one for one in motions if one.order == lift.order)


def said_of(plan):
    found = verify_plan(plan)
    assert not found.verified
    return " ".join(found.failures)


def said_of_motions(plan, motions):
    found = verify_motions(plan, motions)
    assert not found.verified
    return " ".join(found.failures)


def with_shares(plan, **values):
    lifts = (one if one.tandem is None else replace(one, tandem=replace(one.tandem, **values)) for one in plan.lifts)
    return replace(plan, lifts=tuple(lifts))


def with_second(plan, motions, change):
    _, own = beam_of(plan, motions)
    return tuple(replace(one, second=change(one.second)) if one is own else one for one in motions)


def on(plan, **values):
    return replace(plan, site=replace(plan.site, **values))


def with_part(plan, **values):
    parts = (one if one.tandem is None else replace(one, **values) for one in plan.site.components)
    return on(plan, components=tuple(parts))


def test_the_plan_as_it_is_is_proven(made):
    plan, motions = made
    found, driven = verify_plan(plan), verify_motions(plan, motions)
    assert (found.failures, driven.failures) == ((), ())
    looked = {check.name: check.samples for check in (*found.checks, *driven.checks)}
    assert looked["tandem"] > 10 and looked["together"] > 100


def test_what_each_crane_sees_is_defined_twice(made):
    plan, _ = made
    (part,) = (one for one in plan.site.components if one.tandem is not None)
    for half in halves(plan.site, part):
        other = as_crane_sees(plan.site, half.crane).components[part.index]
        assert other.mass_kg == pytest.approx(half.mass_kg)
        assert other.hook_line_vox == pytest.approx(half.hook_line_vox)
        assert other.sail_area_m2 == pytest.approx(half.sail_area_m2)
    assert sum(shares(part, 0.05)) == pytest.approx(1.0)


def test_shares_that_are_not_the_weight(made):
    plan, _ = made
    said = said_of(with_shares(plan, load_kg=(12_000.0, 11_000.0)))
    assert "its two cranes carry 23.000 t together, but it weighs 24.000 t" in said
    said = said_of(with_shares(plan, load_kg=(14_000.0, 10_000.0)))
    assert "level, its first crane carries 12.000 t, not 14.000 t" in said


def test_a_load_that_may_not_hang_out_of_level(made):
    plan, _ = made
    said = said_of(with_shares(plan, most_kg=(12_000.0, 12_000.0)))
    assert "out of level, its second crane carries 12.105 t, not 12.000 t" in said
    assert "by up to 0.0 degrees, the rules say 3.0" in said_of(with_shares(plan, off_level_rad=0.0))


def test_a_crane_that_is_too_weak(made):
    plan, _ = made
    west, east = plan.site.cranes
    weak = replace(east, chart=LoadChart((2.0, 20.0), (16_000.0, 16_000.0)))
    said = said_of(on(plan, cranes=(west, weak)))
    assert "carried by two cranes, it uses 78.8 % of the load chart of east; 75 % is permitted" in said


def test_a_share_above_what_the_rules_permit(made):
    plan, motions = made
    strict = on(plan, rules=replace(plan.site.rules, tandem=TandemRules(most_share=0.5)))
    assert "% of the load chart of west; 50 % is permitted" in said_of(strict)
    assert "on its way it uses 63.0 % of the load chart of west; 50 % is permitted" in said_of_motions(strict, motions)


def test_a_smaller_use_than_it_is(made):
    plan, _ = made
    said = said_of(with_shares(plan, used=(0.2, 0.6302)))
    assert "it uses 63.0 % of the load chart of west at up to 15.53 m, not 20.0 % at 15.53 m" in said


def test_lifting_points_elsewhere(made):
    plan, _ = made
    first, second = plan.site.components[1].tandem.points_m
    off = Tandem(1, (first, (second[0], second[1] + 0.2, second[2])))
    assert "m off the line between its two lifting points" in said_of(with_part(plan, tandem=off))
    beyond = Tandem(1, ((2.0, *first[1:]), second))
    assert "its lifting point (2.000, 18.500, 1.000) m is not on its top" in said_of(with_part(plan, tandem=beyond))
    assert "states other cranes or lifting points" in said_of(with_shares(plan, cranes=(1, 0)))
    assert "are 6.000 m apart, not 7.000 m" in said_of(with_shares(plan, apart_m=7.0))


def test_two_cranes_that_are_left_out_or_made_up(made):
    plan, motions = made
    silent = replace(plan, lifts=tuple(replace(one, tandem=None) for one in plan.lifts))
    assert "two cranes carry it, but their shares are not stated" in said_of(silent)
    alone = with_part(plan, tandem=None)
    assert "states shares of two cranes, but one carries it" in said_of(alone)
    assert "two cranes move for it, but one carries it" in said_of_motions(alone, motions)
    assert "the rules say nothing about that" in said_of(on(plan, rules=Rules()))
    same = with_part(plan, tandem=replace(plan.site.components[1].tandem, second=0))
    assert "of a site with two that stand there at the same time" in said_of(same)


def test_one_crane_that_does_not_move(made):
    plan, motions = made
    said = said_of_motions(plan, with_second(plan, motions, lambda _: None))
    assert "two cranes carry it, but only one has a motion" in said


def test_a_hook_that_leaves_the_other_one(made):
    plan, motions = made

    def bent(second):
        radius_m = second.loaded.radius_m
        out_m = 0.3 * np.sin(np.linspace(0.0, np.pi, len(radius_m))) ** 4
        return replace(second, loaded=replace(second.loaded, radius_m=radius_m + out_m))

    said = said_of_motions(plan, with_second(plan, motions, bent))
    assert "carried, its hooks are 0.300 m from where both hang above their lifting points" in said


def test_a_hook_that_is_late(made):
    plan, motions = made
    late_ns = 2 * 10**9

    def late(second):
        return replace(
            second,
            raising=delayed(second.raising, late_ns),
            loaded=delayed(second.loaded, late_ns),
            phases=(
                replace(second.phases[0], end_ns=second.phases[0].end_ns + late_ns),
                *delayed_phases(second.phases[1:], late_ns),
            ),
            end_ns=second.end_ns + late_ns,
        )

    said = said_of_motions(plan, with_second(plan, motions, late))
    assert "its two cranes do not hook on, carry, set and release it at the same times" in said
    assert "do not begin and end at the same times while it is carried" in said


def test_another_lift_meanwhile(made):
    plan, motions = made
    _, own = beam_of(plan, motions)
    (other,) = (one for one in motions if one.order > own.order)
    by_ns = own.hooked_ns - other.hooked_ns + 10**9
    early = replace(
        other, phases=delayed_phases(other.phases, by_ns), start_ns=other.start_ns + by_ns, end_ns=other.end_ns + by_ns
    )
    said = said_of_motions(plan, tuple(early if one is other else one for one in motions))
    assert "while two cranes carry it, lift 3 goes on" in said


def test_a_second_crane_that_drives_too_fast(made):
    plan, motions = made
    west, east = plan.site.cranes
    slow = replace(east, slewing=replace(east.slewing, rate=1e-4))
    said = said_of_motions(on(plan, cranes=(west, slow)), motions)
    assert "lift 2 (beam): slewing rate" in said or "slew" in said


def test_jibs_that_are_too_near(made):
    plan, motions = made
    near = on(plan, rules=replace(plan.site.rules, crane_separation_m=6.5))
    assert "west and east" in said_of_motions(near, motions)


def test_a_part_that_came_turned(made):
    plan, _ = made
    lifts = tuple(one if one.tandem is None else replace(one, place=replace(one.place, stack=1)) for one in plan.lifts)
    assert "two cranes carry a part only as it is set" in said_of(replace(plan, lifts=lifts))


def test_a_motion_of_the_wrong_crane(made):
    plan, motions = made
    said = said_of_motions(plan, with_second(plan, motions, lambda one: replace(one, crane=0)))
    assert "the motion of its second crane is of another lift or crane" in said


def test_values_that_make_no_sense(made):
    plan, motions = made
    assert check_values(plan, motions).passed
    assert not check_values(with_shares(plan, used=(float("nan"), 0.5)), motions).passed
    wrong = on(plan, rules=replace(plan.site.rules, tandem=TandemRules(most_share=1.5)))
    assert not check_values(wrong, motions).passed


def test_both_cranes_work_at_the_same_time_from_hook_on_to_release(made):
    plan, motions = made
    _, own = beam_of(plan, motions)
    assert own.hooked_ns == own.second.hooked_ns and own.released_ns == own.second.released_ns
    for one, other in pairwise(sorted(motions, key=lambda one: one.hooked_ns)):
        if own in (one, other):
            assert one.released_ns <= other.hooked_ns
    assert own.second.phases[0].name in (PhaseName.WAIT, PhaseName.APPROACH, PhaseName.HOOK_ON)


def test_a_heavier_end_on_the_stronger_crane():
    site = tandem_site(west=crane_at("west", 7.0, most_kg=24_000.0))
    plan, motions = planned_together(site)
    assert verify_plan(plan).verified and verify_motions(plan, motions).verified
