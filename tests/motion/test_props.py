"""What holds parts from their release on: places of props on geometry, and when they go."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from propped_sites import COLUMN, PLANKS, ROOM, RULES, SLAB, WALL, checked, held_by_name, made

from bimvox.motion.props import props_of
from bimvox.motion.steps import steps_of
from bimvox.records.props import Hold, Props
from bimvox.records.steps import cured_ns
from bimvox.site.means import Means
from bimvox.site.props import FIELD_PROPS, PropKind, PropType
from bimvox.site.site import Rules


def test_two_props_hold_a_wall_from_its_side_towards_the_building_until_the_floor_on_it_carries():
    plan, motions = made(ROOM)
    held = held_by_name(plan, motions)
    wall, by_name = held["west"], {part.id: part.index for part in plan.site.components}
    assert wall.hold is Hold.PROPS and len(wall.props) == 2
    for prop in wall.props:
        head, foot = np.array(prop.head_m), np.array(prop.foot_m)
        assert head[0] == pytest.approx(2.2) and foot[0] > head[0]  # from its inner face inwards
        assert head[1] == pytest.approx(foot[1])  # at right angles
        assert head[2] == pytest.approx(2.8 * 2 / 3, abs=1e-3) and foot[2] == pytest.approx(0.0)
        assert prop.kind is PropKind.PUSH_PULL
    steps = steps_of(plan.site, plan.lifts, motions)
    of = {motion.component: motion for motion in motions}
    assert wall.waits_for == (by_name["west"], by_name["floor"])
    assert wall.until_ns == max(cured_ns(plan.site, steps, of[n]) for n in wall.waits_for)
    assert held["floor"].hold is Hold.BEARING
    assert set(held["floor"].by) == {by_name["west"], by_name["east"]}
    check = checked(plan, motions, props_of(plan, motions))
    assert check.passed and check.samples > 30


def test_what_a_prop_bears_is_the_wind_on_its_share_of_the_wall():
    plan, motions = made(ROOM)
    wall = held_by_name(plan, motions)["west"]
    part = plan.site.components[wall.component]
    pushes_kn = 0.5 * 6.0 * 2.8 + 0.02 * part.mass_kg * 9.80665e-3
    for prop in wall.props:
        out_m = prop.foot_m[0] - prop.head_m[0]
        length_m = float(np.linalg.norm(np.subtract(prop.head_m, prop.foot_m)))
        assert prop.load_kn == pytest.approx(pushes_kn * 1.4 / prop.head_m[2] / 2.0 * length_m / out_m, rel=1e-3)


def test_more_props_hold_a_wall_in_more_wind_and_none_if_no_type_bears_it():
    strong = dataclasses.replace(RULES, props=dataclasses.replace(FIELD_PROPS, wind_kn_m2=2.0))
    assert len(held_by_name(*made(ROOM, strong))["west"].props) == 3
    weak = PropType("a lath", PropKind.PUSH_PULL, 1.0, 9.0, 0.1)
    none = dataclasses.replace(RULES, props=dataclasses.replace(FIELD_PROPS, types=(weak,)))
    assert held_by_name(*made(ROOM, none))["west"].hold is Hold.NOTHING


def test_a_floor_at_its_head_holds_a_wall_and_without_one_its_props_stay():
    alone = held_by_name(*made(ROOM[:2]))
    assert alone["west"].props and alone["west"].until_ns is None and alone["west"].waits_for == ()


def test_props_leave_room_for_parts_that_are_set_while_they_stand():
    inner = ("inner", (2.2, 4.9, 0.0), (5.0, 5.1, 2.6), WALL)
    plan, motions = made((ROOM[0], ROOM[1], inner, ROOM[2]))
    held = held_by_name(plan, motions)
    for prop in held["west"].props:
        assert not 4.7 < prop.head_m[1] < 5.3
    assert held["inner"].hold is Hold.PROPS
    assert checked(plan, motions, props_of(plan, motions)).passed


def test_a_wall_without_a_place_for_props_is_fixed_to_a_wall_that_stands():
    tight = (
        ("one", (2.0, 2.0, 0.0), (2.2, 6.0, 2.8), WALL),
        ("other", (2.2, 2.0, 0.0), (4.2, 2.2, 2.8), WALL),
        ("opposite", (3.0, 2.4, 0.0), (3.2, 6.0, 2.8), WALL),
    )
    boxed = dataclasses.replace(RULES, props=dataclasses.replace(FIELD_PROPS, types=()))
    plan, motions = made(tight, boxed)
    held = held_by_name(plan, motions)
    assert held["one"].hold is Hold.NOTHING  # nothing stands yet that it could be fixed to
    assert held["other"].hold is Hold.NEIGHBOURS  # the first one stands at its end, across it
    assert held["other"].by == (0,)


def test_a_column_is_held_in_two_directions():
    plan, motions = made((("post", (4.0, 4.0, 0.0), (4.4, 4.4, 3.0), COLUMN),))
    (post,) = props_of(plan, motions).held
    ways = [np.subtract(one.foot_m, one.head_m)[:2] for one in post.props]
    assert len(ways) == 2
    assert abs(ways[0] @ ways[1]) < 1e-6
    assert checked(plan, motions, props_of(plan, motions)).passed


def test_what_is_hardly_higher_than_thick_stands_by_itself():
    plan, motions = made((("plinth", (4.0, 4.0, 0.0), (6.0, 4.6, 1.0), WALL),))
    (plinth,) = props_of(plan, motions).held
    assert plinth.hold is Hold.BASE and not plinth.props


def test_a_thin_plank_with_a_topping_stands_on_shores_until_the_topping_carries():
    plan, motions = made(PLANKS, means=(("topping", Means.IN_SITU),))
    held = held_by_name(plan, motions)
    plank, steps = held["plank"], steps_of(plan.site, plan.lifts, motions)
    assert plank.hold is Hold.SHORES
    assert {prop.kind for prop in plank.props} == {PropKind.SHORE}
    lines = sorted({round(prop.head_m[0], 1) for prop in plank.props})
    assert max(np.diff([2.0, *lines, 8.2])) <= FIELD_PROPS.shore_spacing_m + 0.4
    assert plank.until_ns == steps.steps[0].carries_ns
    assert checked(plan, motions, props_of(plan, motions)).passed
    thick = dataclasses.replace(RULES, props=dataclasses.replace(FIELD_PROPS, plank_m=0.05))
    assert held_by_name(*made(PLANKS, thick, (("topping", Means.IN_SITU),)))["plank"].hold is Hold.BEARING


def test_a_slab_whose_centre_of_mass_nothing_carries_stands_on_shores_until_its_designer_says_so():
    balcony = (ROOM[0], ("balcony", (0.0, 2.0, 2.8), (2.2, 8.0, 3.0), SLAB))
    plan, motions = made(balcony)
    held = held_by_name(plan, motions)["balcony"]
    assert held.hold is Hold.SHORES and held.until_ns is None
    feet = [one.foot_m for one in held.props]
    assert len(set(feet)) == len(feet)
    assert all(prop.head_m[0] < 1.6 for prop in held.props)
    assert checked(plan, motions, props_of(plan, motions)).passed


def test_a_rule_that_asks_for_none_gives_none():
    plan, motions = made(ROOM, Rules())
    assert props_of(plan, motions) == Props()
    assert checked(plan, motions, Props()).passed


def test_what_trades_build_where_props_stand_waits_for_them():
    stacks = ("stacks", (2.6, 2.4, 0.0), (7.6, 7.6, 2.0), WALL)
    plan, motions = made((*ROOM[:2], stacks), means=(("stacks", Means.BY_HAND),))
    props = props_of(plan, motions)
    by_name = {part.id: part.index for part in plan.site.components}
    assert held_by_name(plan, motions)["west"].holds_up == (by_name["stacks"],)
    assert checked(plan, motions, props).passed
    silent = Props(tuple(dataclasses.replace(one, holds_up=()) for one in props.held))
    assert any("stacks is in its way" in failure for failure in checked(plan, motions, silent).failures)


def test_a_prop_on_the_ground_stands_on_a_block_that_holds_it():
    plan, motions = made(ROOM)
    for prop in held_by_name(plan, motions)["west"].props:
        (x, _, z), load_kn = np.subtract(prop.head_m, prop.foot_m), prop.load_kn
        length_m = float(np.hypot(x, z))
        holds_kg = 1.5 * load_kn * (abs(x) / length_m / 0.4 + z / length_m) / 9.80665e-3
        assert holds_kg <= prop.ballast_kg <= holds_kg + 100.0


def test_a_beam_alone_does_not_hold_a_wall_but_the_floor_on_it_does():
    beam = ("beam", (2.2, 2.2, 2.3), (2.5, 7.8, 2.7), "IfcBeam")
    alone = held_by_name(*made((*ROOM[:2], beam)))
    assert alone["west"].props and alone["west"].until_ns is None
    plan, motions = made((*ROOM[:2], beam, ("floor", (2.2, 2.2, 2.7), (8.0, 7.8, 2.9), SLAB)))
    floored, by_name = held_by_name(plan, motions)["west"], {part.id: part.index for part in plan.site.components}
    assert by_name["floor"] in floored.waits_for


def test_what_each_prop_of_a_wall_bears_follows_from_its_place():
    window = tuple((f"late {n}", (2.3, y, 0.0), (5.0, y + 0.2, 2.6), WALL) for n, y in enumerate((2.3, 3.1, 3.9)))
    plan, motions = made((*ROOM[:2], *window))
    west = held_by_name(plan, motions)["west"]
    at_m = np.array([one.head_m[1] for one in west.props])
    part = plan.site.components[west.component]
    borne = [
        one.load_kn * abs(one.foot_m[0] - one.head_m[0]) / np.linalg.norm(np.subtract(one.head_m, one.foot_m))
        * one.head_m[2] / 1.4
        for one in west.props
    ]  # fmt: skip
    pushes_kn = 0.5 * 6.0 * 2.8 + 0.02 * part.mass_kg * 9.80665e-3
    assert sum(borne) == pytest.approx(pushes_kn, rel=1e-3)
    assert borne @ at_m == pytest.approx(pushes_kn * 5.0, rel=1e-3)  # wind and weight are in its middle
