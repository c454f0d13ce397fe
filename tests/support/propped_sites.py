"""Sites whose walls, columns and planks need props, small enough for fast tests."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from functools import cache

from box_sites import box_site, test_crane

from bimvox.motion.props import props_of
from bimvox.motion.steps import steps_of
from bimvox.motion.time_plan import time_plan
from bimvox.planning.order_search import prepare
from bimvox.planning.planner import plan_lifts
from bimvox.proof.props import verify_props
from bimvox.records.lift import LiftPlan
from bimvox.records.motion import LiftMotion
from bimvox.records.proof import Check
from bimvox.records.props import Held, Props
from bimvox.site.casting import FIELD_CURING
from bimvox.site.component import OrderHints
from bimvox.site.means import Means
from bimvox.site.props import FIELD_PROPS
from bimvox.site.site import Rules

Made = tuple[LiftPlan, tuple[LiftMotion, ...]]
WALL, SLAB, COLUMN = "IfcWall", "IfcSlab", "IfcColumn"
Box = tuple[str, tuple[float, float, float], tuple[float, float, float], str]
RULES = Rules(curing=FIELD_CURING, props=FIELD_PROPS)
ROOM = (
    ("west", (2.0, 2.0, 0.0), (2.2, 8.0, 2.8), WALL),
    ("east", (8.0, 2.0, 0.0), (8.2, 8.0, 2.8), WALL),
    ("floor", (2.0, 2.0, 2.8), (8.2, 8.0, 3.0), SLAB),
)
PLANKS = (
    *ROOM[:2],
    ("plank", (2.0, 2.0, 2.8), (8.2, 4.0, 2.86), SLAB),
    ("topping", (2.0, 2.0, 2.86), (8.2, 4.0, 3.0), SLAB),
)


@cache
def made(boxes: tuple[Box, ...], rules: Rules = RULES, means: tuple[tuple[str, Means], ...] = ()) -> Made:
    """Return the plan of boxes that are set in their order, with its motions."""
    crane = test_crane(base=(14.0, 5.0, 0.0), jib=40.0, height=20.0)
    of_class = [(name, low, high, {"ifc_class": kind, "erected": kind == COLUMN}) for name, low, high, kind in boxes]
    site = box_site(of_class, crane=crane, shape=(70, 60, 34), rules=rules)
    others: Mapping[str, Means] = dict(means)
    order = [name for name, *_ in boxes]
    parts = (
        dataclasses.replace(
            part,
            means=others.get(part.id, Means.CRANE),
            means_reason="so",
            hints=OrderHints(rank=order.index(part.id)),
            after=tuple(order[: order.index(part.id)][-1:]),
        )
        for part in site.components
    )
    site = dataclasses.replace(site, components=tuple(parts))
    preparation = prepare(site)
    plan = plan_lifts(site, preparation)
    return plan, time_plan(plan, preparation)


def held_by_name(plan: LiftPlan, motions: tuple[LiftMotion, ...]) -> dict[str, Held]:
    """Return what holds each part, by its name."""
    return {plan.site.components[one.component].id: one for one in props_of(plan, motions).held}


def checked(plan: LiftPlan, motions: tuple[LiftMotion, ...], props: Props) -> Check:
    """Return what the proof says of props."""
    return verify_props(plan, motions, steps_of(plan.site, plan.lifts, motions), props)
