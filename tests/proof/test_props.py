"""The proof of props finds what is wrong with them, by name."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

import numpy as np
import pytest
from propped_sites import PLANKS, ROOM, WALL, checked, made

from bimvox.motion.props import props_of
from bimvox.records.props import Held, Hold, Prop, Props
from bimvox.site.means import Means

H = 3600 * 10**9
INNER = ("inner", (2.2, 4.9, 0.0), (5.0, 5.1, 2.6), WALL)
Change = Callable[[Held], Held]


def _moved(prop: Prop, head: tuple = (0, 0, 0), foot: tuple = (0, 0, 0)) -> Prop:
    ends = np.add(prop.head_m, head).tolist(), np.add(prop.foot_m, foot).tolist()
    return dataclasses.replace(prop, head_m=tuple(ends[0]), foot_m=tuple(ends[1]))


def _with(**of_first: object) -> Change:
    def change(held: Held) -> Held:
        first = dataclasses.replace(held.props[0], **of_first)
        return dataclasses.replace(held, props=(first, *held.props[1:]))

    return change


def _by(head: tuple = (0, 0, 0), foot: tuple = (0, 0, 0)) -> Change:
    return lambda held: dataclasses.replace(held, props=(_moved(held.props[0], head, foot), *held.props[1:]))


FORGED: dict[str, tuple[Change, str]] = {
    "one of two": (lambda held: dataclasses.replace(held, props=held.props[:1]), "holds a wall"),
    "too early": (lambda held: dataclasses.replace(held, until_ns=held.until_ns - H), "before"),
    "late": (lambda held: dataclasses.replace(held, from_ns=held.from_ns + H), "before it is held"),
    "in the air": (_by((-0.1, 0, 0)), "head is not at the part"),
    "above the floor": (_by(foot=(0, 0, 0.2)), "foot is not on a whole floor"),
    "too low": (_by((0, 0, -0.7)), "of its height"),
    "too flat": (_by(foot=(1.5, 0, 0)), "is inclined by"),
    "at the edge": (_by((0, -2.0, 0), (0, -2.0, 0)), "opening or an edge"),
    "through a wall": (_by((0, 1.45, 0), (0, 1.45, 0)), "is in its way"),
    "too weak": (_with(load_kn=1.0), "it bears"),
    "overloaded": (_with(load_kn=99.0), "kN of"),
    "no such type": (_with(type="a broom"), "has no such"),
    "too short": (_with(type="push-pull prop 1.2-2.1 m"), "m long"),
    "a shore": (_with(type="shore EN 1065 D30"), "has no such"),
    "on a light block": (_with(ballast_kg=100.0), "its block on the ground weighs"),
    "at one place": (
        lambda held: dataclasses.replace(held, props=(held.props[0], held.props[0])),
        "another prop stands at its place",
    ),
    "no number": (_with(load_kn=float("nan")), "makes no sense"),
    "far away": (_with(head_m=(1e9, 0.0, 0.0)), "makes no sense"),
    "no part": (lambda held: dataclasses.replace(held, by=(99,)), "makes no sense"),
    "stands by itself": (
        lambda held: dataclasses.replace(held, hold=Hold.BASE, props=(), until_ns=None),
        "cannot stand on its base",
    ),
    "lies": (lambda held: dataclasses.replace(held, hold=Hold.BEARING, props=(), until_ns=None), "needs props"),
    "fixed to what is far": (
        lambda held: dataclasses.replace(held, hold=Hold.NEIGHBOURS, props=(), by=(1,), until_ns=None),
        "",
    ),
}


@pytest.mark.parametrize(("change", "says"), FORGED.values(), ids=FORGED.keys())
def test_a_forged_prop_is_named(change: Change, says: str):
    plan, motions = made((ROOM[0], ROOM[1], INNER, ROOM[2]))
    props = props_of(plan, motions)
    assert checked(plan, motions, props).passed
    first = next(one for one in props.held if plan.site.components[one.component].id == "west")
    forged = Props(tuple(change(one) if one is first else one for one in props.held))
    check = checked(plan, motions, forged)
    assert not check.passed
    assert "west" in check.culprits or "makes no sense" in check.failures[0]
    assert any(says in failure for failure in check.failures), check.failures


def test_a_load_that_passes_through_a_prop_is_named():
    plan, motions = made((ROOM[0], ROOM[1], INNER, ROOM[2]))
    props = props_of(plan, motions)
    first = props.held[0]
    # Below the floor's way down, and where the inner wall comes down.
    moved = Props((_by((0, 1.45, 0), (0, 1.45, 0))(first), *props.held[1:]))
    assert any("passes through it" in failure for failure in checked(plan, motions, moved).failures)


def test_a_part_that_is_left_out_and_a_plank_without_shores_are_named():
    plan, motions = made(PLANKS, means=(("topping", Means.IN_SITU),))
    props = props_of(plan, motions)
    assert not checked(plan, motions, Props(props.held[1:])).passed
    without = [
        dataclasses.replace(one, hold=Hold.BEARING, props=(), until_ns=None) if one.hold is Hold.SHORES else one
        for one in props.held
    ]
    check = checked(plan, motions, Props(tuple(without)))
    assert any("no shores" in failure for failure in check.failures)
