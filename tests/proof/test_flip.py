"""Forged turns between two hooks are refused by name."""

from dataclasses import replace

import numpy as np
import pytest
from flipping_sites import AUXILIARY, crane_with, flipping_site

from bimvox.crane.load_chart import LoadChart
from bimvox.motion.time_plan import time_plan
from bimvox.planning.order_search import prepare
from bimvox.planning.planner import plan_lifts
from bimvox.proof.motion import verify_motions
from bimvox.proof.plan import verify_plan
from bimvox.proof.values import check_values
from bimvox.records.motion import PhaseName
from bimvox.site.default_rules import FlipRules
from bimvox.site.site import Rules


@pytest.fixture(scope="module")
def made():
    site = flipping_site()
    preparation = prepare(site)
    plan = plan_lifts(site, preparation)
    return plan, time_plan(plan, preparation)


def said_of(plan):
    found = verify_plan(plan)
    assert not found.verified
    return " ".join(found.failures)


def with_flip(plan, **values):
    (lift,) = plan.lifts
    return replace(plan, lifts=(replace(lift, flip=replace(lift.flip, **values)),))


def on(plan, **values):
    return replace(plan, site=replace(plan.site, **values))


def test_the_plan_as_it_is_is_proven(made):
    plan, motions = made
    found = verify_plan(plan)
    assert found.verified and verify_motions(plan, motions).verified
    (check,) = (one for one in found.checks if one.name == "flip")
    assert check.samples > 0


def test_a_machine_without_an_auxiliary_hook(made):
    plan, _ = made
    assert "is turned over between two hooks, of a crane with one" in said_of(on(plan, cranes=(crane_with(None),)))


def test_an_overloaded_auxiliary_hook(made):
    plan, _ = made
    weak = replace(AUXILIARY, chart=LoadChart((1000.0,), (7_000.0,)))
    said = said_of(on(plan, cranes=(crane_with(weak),)))
    assert "uses 77.9 % of the auxiliary hook; 75 % is permitted" in said


def test_a_crane_that_both_hooks_overload(made):
    plan, _ = made
    said = said_of(on(plan, cranes=(crane_with(most_kg=11_000.0),)))
    assert "uses 75.9 % of the load chart by both; 75 % is permitted" in said


def test_a_share_above_what_the_rules_permit(made):
    plan, _ = made
    said = said_of(on(plan, rules=Rules(two_hooks=FlipRules(most_share=0.5))))
    assert "% of the auxiliary hook; 50 % is permitted" in said


def test_a_foot_that_comes_too_near_to_the_ground(made):
    plan, _ = made
    said = said_of(on(plan, rules=Rules(two_hooks=FlipRules(clear_m=1.0))))
    assert "its foot comes to 0.90 m above the ground while it turns; 1 m is asked for" in said
    (lift,) = plan.lifts
    low = replace(lift.place, rise_vox=0)
    assert "its foot comes to -0.10 m above the ground" in said_of(replace(plan, lifts=(replace(lift, place=low),)))
    assert "states 0.95 m above the ground" in said_of(with_flip(plan, clear_m=0.95))


def test_shares_that_are_not_the_weight(made):
    plan, _ = made
    flip = plan.lifts[0].flip
    less = (flip.main_kg[0] - 500.0, *flip.main_kg[1:])
    said = said_of(with_flip(plan, main_kg=less))
    assert "at 0 degrees its hooks carry 6.700 t together, but it weighs 7.200 t" in said
    moved = with_flip(
        plan,
        main_kg=(flip.main_kg[0] + 500.0, *flip.main_kg[1:]),
        auxiliary_kg=(flip.auxiliary_kg[0] - 500.0, *flip.auxiliary_kg[1:]),
    )
    assert "at 0 degrees its auxiliary hook carries 4.800 t, not 4.300 t" in said_of(moved)


def test_shares_of_a_part_of_the_turn_only(made):
    plan, _ = made
    flip = plan.lifts[0].flip
    short = {key: getattr(flip, key)[:10] for key in ("angle_deg", "main_kg", "auxiliary_kg")}
    assert "does not state the shares of its hooks from lying to upright" in said_of(with_flip(plan, **short))


def test_lifting_points_elsewhere(made):
    plan, _ = made
    assert "its main hook holds it 0.100 m from the middle of its head" in said_of(
        with_flip(plan, main_m=(2.25, 2.6, 6.0))
    )
    assert "below the side that is up as it lies" in said_of(with_flip(plan, auxiliary_m=(2.25, 2.5, 1.5)))
    x, y, _ = plan.lifts[0].flip.auxiliary_m
    assert "its auxiliary hook does not hold its foot end" in said_of(with_flip(plan, auxiliary_m=(x, y, 4.0)))
    assert "a hook would have to push" in said_of(with_flip(plan, auxiliary_m=(x, y, 6.0)))


def test_a_smaller_use_than_it_is(made):
    plan, _ = made
    assert "% of the auxiliary hook, not 20.0 %" in said_of(with_flip(plan, auxiliary_used=0.2))


def test_a_turn_that_is_left_out_or_made_up(made):
    plan, _ = made
    (lift,) = plan.lifts
    assert "does not state their shares" in said_of(replace(plan, lifts=(replace(lift, flip=None),)))
    part = replace(plan.site.components[0], flip_rise_vox=0)
    assert "but is not turned over so" in said_of(on(plan, components=(part,)))
    assert "the rules say nothing about that" in said_of(on(plan, rules=Rules()))


def test_a_turn_that_is_too_fast_or_whose_hook_is_not_taken_off(made):
    plan, (motion,) = made
    slower = on(plan, rules=Rules(two_hooks=FlipRules(turn_s=200.0)))
    found = " ".join(verify_motions(slower, (motion,)).failures)
    assert "is turned over between two hooks in 120.0 s; the rules ask for 200 s" in found
    phases = []
    for phase in motion.phases:
        if phase.name is PhaseName.RAISE:
            phases += [replace(phase, end_ns=phase.end_ns - 60 * 10**9)]
            phases += [replace(phase, name=PhaseName.TURN, start_ns=phase.end_ns - 60 * 10**9)]
        else:
            phases.append(phase)
    found = " ".join(verify_motions(plan, (replace(motion, phases=tuple(phases)),)).failures)
    assert "taking the auxiliary hook off, take 40 s; the rules ask for 100 s" in found


def test_a_main_hook_that_moves_sideways_while_the_part_turns(made):
    plan, (motion,) = made
    bent = motion.raising.radius_m + 0.2 * np.sin(np.linspace(0.0, np.pi, len(motion.raising.radius_m)))
    found = " ".join(verify_motions(plan, (replace(motion, raising=replace(motion.raising, radius_m=bent)),)).failures)
    assert "is hooked on at" in found


def test_values_that_make_no_sense(made):
    plan, motions = made
    assert check_values(plan, motions).passed
    wrong = replace(plan.lifts[0].flip, auxiliary_kg=(float("nan"),) * 19)
    assert not check_values(replace(plan, lifts=(replace(plan.lifts[0], flip=wrong),)), motions).passed
    wrong_rules = Rules(two_hooks=FlipRules(most_share=1.5))
    assert not check_values(on(plan, rules=wrong_rules), motions).passed
