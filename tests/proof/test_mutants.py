"""The proof finds errors of the planner: each test plants one, and a check of the proof names it.

The error stays planted while the proof runs, so a proof that shared the function would share the error as well.
"""

from __future__ import annotations

import hashlib
import importlib
import inspect
import tomllib
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
from box_sites import box_site, test_crane
from flipping_sites import flipping_site
from guided_sites import slab_between_beams
from planned_sites import rectangle
from turning_sites import BESIDE_THE_PORTAL, turning_site

from bimvox.crane.carrier import Carrier, SectorChart
from bimvox.crane.load_chart import LoadChart
from bimvox.crane.sectors import charts_of
from bimvox.crane.tower_crane import AxisLimits, TowerCrane
from bimvox.cranes.schedule import time_lifts
from bimvox.errors import NoPlanError
from bimvox.library.prove import plan_and_prove
from bimvox.motion.swing import rigged_crane
from bimvox.planning.assembly import replay
from bimvox.planning.beside import Apart
from bimvox.planning.order_search import prepare
from bimvox.planning.planner import plan_lifts
from bimvox.planning.search import shortest_path
from bimvox.policy.choice import NO_POLICY
from bimvox.progress import progress_of
from bimvox.proof.motion import verify_motions
from bimvox.proof.plan import verify_plan
from bimvox.records.lift import LiftPlan
from bimvox.records.motion import LiftMotion, PhaseName
from bimvox.site.crew_times import CrewTimes
from bimvox.site.parts import sail_area_m2
from bimvox.site.site import HookHeights, Rules, Site
from bimvox.site.work import Work
from bimvox.stop.choose_stop import manoeuvre
from bimvox.stop.resume import interrupted, resume, resume_cells

Made = tuple[LiftPlan, tuple[LiftMotion, ...]]
Wrong = Callable[[Any], Any]
"""Returns the faulty version of a function or value of the planner."""


class Mutant(NamedTuple):
    """An error of the planner.

    Attributes:
        site: A site on which it matters.
        check: The check of the proof that must fail.
        errors: What is replaced, by its names in the planner, and the replacement.
    """

    site: Callable[[], Site]
    check: str
    errors: dict[str, Wrong]


PORTAL = [
    ("slab", (1.0, 1.0, 3.4), (5.0, 2.0, 3.6)),
    ("beam", (1.0, 1.4, 3.0), (5.0, 1.6, 3.4)),
    ("left", (1.0, 1.4, 0.0), (1.2, 1.6, 2.98), {"ifc_class": "IfcColumn", "erected": True}),
    ("right", (4.8, 1.4, 0.0), (5.0, 1.6, 2.98), {"ifc_class": "IfcColumn", "erected": True}),
]
WALL = ("wall", (8.0, 0.0, 0.0), (8.5, 15.0, 3.0))
ALONG = {"shape": (40, 30, 24)}
BLOCK = ("block", (1.0, 4.0, 0.0), (2.0, 5.0, 1.0))
NEXT = ("next", (4.0, 4.0, 0.0), (5.0, 5.0, 1.0))


def crane(**more: Any) -> Any:
    return replace(test_crane(base=(10.0, -3.0, 0.0), jib=40.0, height=14.0), **more)


@cache
def portal(**rules: Any) -> Site:
    """Return a portal of two columns, beam and slab, behind a wall."""
    return box_site(PORTAL, structure=[WALL], crane=crane(), rules=Rules(**rules), **ALONG)


def under_a_lip(depth_m: float) -> Callable[[], Site]:
    """Return a block whose place is partly under a ledge that it touches: it is inserted from the side."""
    block, ledge = ("block", (1.0, 4.0, 0.0), (2.0, 5.0, 1.1)), ("ledge", (2.0 - depth_m, 4.0, 1.1), (3.0, 5.0, 1.5))
    return cache(lambda: box_site([block], structure=[ledge], rules=Rules(rope=False), **ALONG))


@cache
def drawn_into_each_other() -> Site:
    pier = ("pier", (1.94, 4.0, 0.0), (3.0, 5.0, 1.0))
    return box_site([BLOCK, ("pier", *pier[1:])], rules=Rules(rope=False), **ALONG)


@cache
def behind_a_screen() -> Site:
    """Return a screen from boundary to boundary; without a crane, only its cells are in the way."""
    return box_site(
        [BLOCK], obstructions=[("screen", (8.0, 0.0, 0.0), (8.5, 15.0, 6.0))], rules=Rules(rope=False), **ALONG
    )


@cache
def under_a_bridge() -> Site:
    """Return a bridge under which a load could pass, if its rope could pass through the bridge."""
    bridge = ("bridge", (8.0, 0.0, 5.5), (8.5, 15.0, 6.0))
    return box_site([BLOCK], obstructions=[bridge], crane=crane(), **ALONG)


@cache
def past_a_mast() -> Site:
    """Return two high screens and a gap between them, its edge in line with start and place."""
    screens = [("south", (8.0, 0.0, 0.0), (8.5, 3.5, 10.0)), ("north", (8.0, 7.5, 0.0), (8.5, 15.0, 10.0))]
    block = ("block", (1.0, 3.5, 0.0), (2.0, 4.5, 1.0), {"start_vox": (24, 7, 1)})
    return box_site([block], obstructions=screens, crane=crane(), rules=Rules(rope_clearance_m=1.0), **ALONG)


@cache
def one_too_heavy() -> Site:
    """Return two blocks, one with 108 % of the capacity at its place."""
    heavy, light = (*BLOCK, {}), NEXT
    site = box_site([heavy, light], crane=crane(), **ALONG)
    first = replace(site.components[0], mass_kg=20_500.0)
    return replace(site, components=(first, site.components[1]))


@cache
def one_between_two_radii() -> Site:
    """Return two blocks, one heavier than its chart lists at the radius beyond its place."""
    site = one_too_heavy()
    chart = LoadChart((5.0, 20.0, 40.0), (30_000.0, 20_000.0, 8_000.0))
    return replace(site, cranes=(replace(site.cranes[0], chart=chart),))


def as_over_the_front(crane: TowerCrane) -> TowerCrane:
    """Return a crane that carries in every direction what it carries over its front."""
    return crane if crane.carrier is None else replace(crane, chart=charts_of(crane)[-1], carrier=None)


@cache
def over_the_side() -> Site:
    """Return two blocks, one heavier than the crane carries over its side, where it is set."""
    side, rear = LoadChart((5.0, 40.0), (20_000.0, 20_000.0)), LoadChart((5.0, 40.0), (30_000.0, 30_000.0))
    site, placed = one_too_heavy(), -np.pi + np.arctan2(-7.5, 8.5)
    carrier = Carrier(placed, None, None, (SectorChart("over front", 1.0, 5.0, rear),))
    return replace(site, cranes=(replace(site.cranes[0], chart=side, carrier=carrier),))


def along_the_chord(crane: TowerCrane) -> TowerCrane:
    """Return a crane whose chart lists every decimetre of the straight lines between the radii of its own."""
    own = crane.chart
    radii = np.arange(10.0 * own.radius_m[0], 10.0 * own.radius_m[-1] + 1.0) / 10.0
    return replace(crane, chart=LoadChart(tuple(radii), tuple(np.interp(radii, own.radius_m, own.capacity_kg))))


@cache
def one_out_of_reach() -> Site:
    return box_site([BLOCK, NEXT], crane=crane(jib_length_m=11.0), **ALONG)


@cache
def one_in_too_much_wind() -> Site:
    """Return two blocks in a wind of 16 m/s, one with a sail area that permits only 15 m/s."""
    site = box_site([BLOCK, NEXT], crane=crane(), rules=Rules(wind_speed_m_s=16.0), **ALONG)
    one, other = (replace(part, sail_area_m2=sail_area_m2(part.mesh)) for part in site.components)
    return replace(site, components=(replace(one, mass_kg=800.0), other))


@cache
def one_in_too_little_wind() -> Site:
    """Return the same if every lift must be permitted in 16 m/s, whatever wind is planned."""
    return replace(one_in_too_much_wind(), rules=Rules(least_wind_m_s=16.0))


@cache
def with_a_closed_zone() -> Site:
    site = portal()
    return replace(site, prohibited=rectangle(site, 6.0, 0.0, 7.0, 12.0))


@cache
def closed_to_loads() -> Site:
    site = portal()
    return replace(site, no_load=rectangle(site, 6.0, 0.0, 7.0, 12.0))


@cache
def limited_in_height() -> Site:
    """Return a site whose hook must be above 9 m where it crosses."""
    site = portal()
    low_m = np.where(rectangle(site, 6.0, 0.0, 7.0, 15.0), 9.0, -np.inf)
    return replace(site, hook_heights=HookHeights(low_m, np.full(low_m.shape, np.inf)))


@cache
def in_a_wanted_order() -> Site:
    blocks = [(*BLOCK, {"after": ("next",)}), NEXT]
    return box_site(blocks, rules=Rules(rope=False), **ALONG)


@cache
def upended_beside_something(**rules: float) -> Site:
    """Return two columns, one of which lies in the yard half a metre from a pallet."""
    columns = [
        ("first", (1.0, 1.0, 0.0), (1.5, 1.5, 3.0), {"erected": True, "start_vox": (24, 8, 1)}),
        ("second", (4.0, 1.0, 0.0), (4.5, 1.5, 3.0), {"erected": True, "start_vox": (24, 20, 1)}),
    ]
    pallet = ("pallet", (12.0, 5.0, 0.0), (14.0, 6.0, 1.0))
    return box_site(columns, obstructions=[pallet], rules=Rules(rope=False, **rules), **ALONG)


def lowered_beside_something() -> Site:
    """Return a part whose place is half a metre from a wall that is much higher."""
    wall = ("wall", (3.5, 0.0, 0.0), (4.0, 9.0, 5.0))
    rules = Rules(rope=False, transit_clearance_m=1.0, approach_clearance_m=1.0)
    return box_site([("part", (2.0, 2.0, 0.0), (3.0, 3.0, 1.0))], structure=[wall], rules=rules, **ALONG)


def raised_beneath_something() -> Site:
    """Return two columns that lie in the yard, one of them under a cable on its way up."""
    column = {"ifc_class": "IfcColumn", "erected": True}
    parts = [
        ("first", (1.0, 1.0, 0.0), (1.5, 1.5, 3.0), column | {"start_vox": (24, 8, 1)}),
        ("second", (4.0, 1.0, 0.0), (4.5, 1.5, 3.0), column),
    ]
    return box_site(
        parts, obstructions=[("cable", (13.5, 3.5, 1.5), (14.0, 5.0, 2.0))], rules=Rules(rope=False), **ALONG
    )


@cache
def quick_to_start() -> Site:
    """Return the portal under a crane whose loads swing."""
    site = portal()
    own = site.cranes[0]
    slewing, trolley = AxisLimits(0.16, 0.02, 0.02), AxisLimits(2.0, 0.5, 1.0)
    return replace(site, cranes=(replace(own, slewing=slewing, trolley=trolley),))


@cache
def turned() -> Site:
    """Return a portal whose loads turn with the jib."""
    return turning_site()


@cache
def turned_beside_a_tower() -> Site:
    """Return the same where its beam has no room to turn."""
    return turning_site(obstructions=BESIDE_THE_PORTAL)


@cache
def close_to_a_wall() -> Site:
    """Return two blocks behind a high wall, with little room on both sides of it."""
    blocks = [
        ("block", (6.0, 4.0, 0.0), (7.0, 5.0, 1.0), {"start_vox": (18, 8, 1)}),
        ("next", (6.0, 6.0, 0.0), (7.0, 7.0, 1.0), {"start_vox": (18, 12, 1)}),
    ]
    wall = ("wall", (7.5, 0.0, 0.0), (8.0, 15.0, 6.0))
    return box_site(blocks, structure=[wall], crane=crane(), **ALONG)


def two_cranes(west: tuple, east: tuple, back: tuple) -> Site:
    """Return two cranes 20 m apart whose jibs cross, and three parts; the eastern crane lifts the second one."""
    first = replace(test_crane(base=(10.0, -3.0, 0.0), height=14.0), name="west", jib_length_m=14.5)
    second = replace(first, name="east", base_m=(30.0, -3.0, 0.0))
    site = box_site([west, east, back], shape=(80, 40, 40), yard=((0.0, 8.0), (80.0, 22.0)), crane=first)
    components = tuple(replace(part, crane=int(part.id == "east")) for part in site.components)
    return replace(site, components=components, cranes=(first, second))


@cache
def crossing_cranes() -> Site:
    """Return the same with an eastern crane that follows the western one to where they meet, and brakes slowly."""
    site = two_cranes(
        ("west", (18.0, 2.0, 0.0), (19.0, 3.0, 1.0), {"start_vox": (8, 14, 1)}),
        ("east", (21.0, 2.0, 0.0), (22.0, 3.0, 1.0), {"start_vox": (66, 14, 1), "after": ("west",)}),
        ("back", (4.0, 2.0, 0.0), (5.0, 3.0, 1.0), {"start_vox": (6, 18, 1), "after": ("east",)}),
    )
    west, east = site.cranes
    return replace(site, cranes=(west, replace(east, slewing=AxisLimits(0.08, 0.004, 0.004))))


@cache
def taking_turns() -> Site:
    """Return the same with a long lift for the first part and a short one for the second."""
    return two_cranes(
        ("west", (16.0, 1.0, 0.0), (17.0, 2.0, 1.0), {"start_vox": (4, 14, 1)}),
        ("east", (36.0, 2.0, 0.0), (37.0, 3.0, 1.0), {"start_vox": (72, 10, 1), "after": ("west",)}),
        ("back", (4.0, 1.0, 0.0), (5.0, 2.0, 1.0), {"start_vox": (6, 18, 1), "after": ("east",)}),
    )


@cache
def one_behind_a_wall() -> Site:
    site = close_to_a_wall()
    return replace(site, components=site.components[:1])


def given(**wrong: Wrong) -> Wrong:
    """Return the function with other values of some parameters, which must be given by position or name."""

    def planted(true: Callable[..., Any]) -> Callable[..., Any]:
        signature = inspect.signature(true)

        def called(*args: Any, **kwargs: Any) -> Any:
            bound = signature.bind(*args, **kwargs)
            for name, change in wrong.items():
                bound.arguments[name] = change(bound.arguments[name])
            return true(*bound.args, **bound.kwargs)

        return called

    return planted


def returning(change: Wrong) -> Wrong:
    """Return the function with a change of what it returns."""
    return lambda true: lambda *args, **kwargs: change(true(*args, **kwargs))


def always(value: Any) -> Wrong:
    """Return a function that always returns one value."""
    return lambda true: lambda *args, **kwargs: value


def times(factor: float) -> Wrong:
    return lambda value: factor * value


def by(rate: float = 1.0, acceleration: float = 1.0, jerk: float = 1.0) -> Wrong:
    """Return the limits of an axis, multiplied."""
    return lambda own: AxisLimits(own.rate * rate, own.acceleration * acceleration, own.jerk * jerk)


def never_blocked(*args: Any) -> Any:
    return np.zeros(args[5], np.bool_)


def without_obstructions(site: Site) -> Site:
    return replace(site, blockers=tuple(blocker for blocker in site.blockers if blocker.kind != "obstruction"))


def upside_down(relations: Any) -> Any:
    """Return the relations, each reversed."""

    def turned(edges: Any) -> Any:
        return tuple(tuple(i for i in range(len(edges)) if j in edges[i]) for j in range(len(edges)))

    return replace(relations, supports=turned(relations.supports), descent=turned(relations.descent))


def shortened(name: PhaseName) -> Wrong:
    """Return motions in which phases of this name take one second."""
    return lambda spans: [(one, 10**9 if one is name else length_ns) for one, length_ns in spans]


RATES = "bimvox.motion.timeline.share_limits"
HOOK_ROOM = "bimvox.planning.occupancy.hook_room"
MUTANTS: dict[str, Mutant] = {
    "tolerance ten times": Mutant(
        under_a_lip(0.06),
        "triangles",
        {"bimvox.planning.contact.pairs.pair_depths_m": given(tolerance_m=times(10.0))},
    ),
    "tolerance in the overlaps of the model": Mutant(
        drawn_into_each_other,
        "triangles",
        {"bimvox.planning.contact.pairs.pair_depths_m": given(tolerance_m=times(10.0))},
    ),
    "overlaps of the model deeper than they are": Mutant(
        drawn_into_each_other,
        "triangles",
        {"bimvox.planning.contact.pairs._clash": given(way_m=lambda way_m: way_m + 0.05 * np.sign(way_m))},
    ),
    "swept contact finds nothing": Mutant(
        under_a_lip(0.3), "triangles", {"bimvox.planning.contact.pairs.blocked_steps": lambda true: never_blocked}
    ),
    "a guided load that seems to meet nothing": Mutant(
        slab_between_beams,
        "triangles",
        {
            "bimvox.planning.guided.meets": always(False),
            "bimvox.planning.guided.meets_between": always(False),
        },
    ),
    "a load guided as fast as the crane goes": Mutant(
        slab_between_beams,
        "timeline",
        {"bimvox.motion.timeline._no_shorter": lambda true: lambda limits, least_s: limits},
    ),
    "an obstruction forgotten": Mutant(
        behind_a_screen,
        "cells",
        {
            "bimvox.planning.assembly.Occupancy": lambda true: (
                lambda site, **more: true(without_obstructions(site), **more)
            )
        },
    ),
    "rope through three cells": Mutant(under_a_bridge, "rope", {HOOK_ROOM: given(top=lambda top: top - 3)}),
    "chart 10 % too good": Mutant(
        one_too_heavy,
        "reach",
        {
            "bimvox.site.collision.floor_of_hook": given(mass_kg=times(1.0 / 1.1)),
            "bimvox.planning.stage.allowed_radii_m": given(mass_kg=times(1.0 / 1.1)),
        },
    ),
    "chart interpolated": Mutant(
        one_between_two_radii,
        "reach",
        {
            "bimvox.site.collision.floor_of_hook": given(crane=along_the_chord),
            "bimvox.planning.stage.allowed_radii_m": given(crane=along_the_chord),
        },
    ),
    "sector forgotten": Mutant(
        over_the_side,
        "reach",
        {
            "bimvox.site.collision.floor_of_hook": given(crane=as_over_the_front),
            "bimvox.planning.stage.crane_towards": lambda true: lambda site, crane, *where: as_over_the_front(crane),
            "bimvox.planning.stage.allowed_radii_m": given(crane=as_over_the_front),
        },
    ),
    "jib 3 m too long": Mutant(
        one_out_of_reach,
        "reach",
        {
            "bimvox.site.collision.crane_for": returning(lambda own: replace(own, jib_length_m=own.jib_length_m + 3.0)),
            "bimvox.planning.assembly.refused_by_crane": always(None),
        },
    ),
    "transit clearance forgotten": Mutant(
        lambda: portal(transit_clearance_m=1.0),
        "margin",
        {"bimvox.planning.occupancy.margin_vox": always(0), "bimvox.planning.assembly.margin_vox": always(0)},
    ),
    "transit clearance a cell too small": Mutant(
        lambda: portal(transit_clearance_m=1.0),
        "margin",
        {"bimvox.planning.occupancy.margin_vox": always(1), "bimvox.planning.assembly.margin_vox": always(1)},
    ),
    "rope clearance forgotten": Mutant(
        past_a_mast, "rope_margin", {"bimvox.planning.occupancy.rope_margin_vox": always(0)}
    ),
    "upending clearance forgotten": Mutant(
        lambda: upended_beside_something(upending_clearance_m=1.0),
        "yard_margin",
        {"bimvox.planning.assembly.upending": always(Apart(2, np.zeros((0, 3), np.int32)))},
    ),
    "mass of the gear forgotten on both hooks": Mutant(
        flipping_site, "flip", {"bimvox.planning.flip.hoisted_kg": returning(lambda own: own - 600.0)}
    ),
    "share of the auxiliary hook too small": Mutant(
        flipping_site,
        "flip",
        {
            "bimvox.planning.flip._turn_of": returning(
                lambda own: replace(own, auxiliary_share=0.9 * own.auxiliary_share)
            )
        },
    ),
    "foot end held elsewhere": Mutant(
        flipping_site,
        "flip",
        {"bimvox.planning.flip._turn_of": returning(lambda own: replace(own, auxiliary_m=own.auxiliary_m + 0.1))},
    ),
    "sinking foot forgotten": Mutant(
        flipping_site, "flip", {"bimvox.planning.flip.least_clear_vox": returning(lambda own: own + 0.3)}
    ),
    "turned over in half the time": Mutant(
        flipping_site,
        "timeline",
        {"bimvox.motion.time_lift.Move": returning(lambda own: replace(own, least_s=0.5 * own.least_s))},
    ),
    "auxiliary hook taken off in no time": Mutant(
        flipping_site, "timeline", {"bimvox.motion.time_lift.raised_s": returning(lambda own: own - 90.0)}
    ),
    "clearance of last moves forgotten": Mutant(
        lowered_beside_something, "rest_margin", {"bimvox.planning.beside.Column.kept_vox": always(2)}
    ),
    "support the other way round": Mutant(
        portal, "support", {"bimvox.planning.order_search.precedence": returning(upside_down)}
    ),
    "wanted order dropped": Mutant(
        in_a_wanted_order,
        "support",
        {"bimvox.planning.order.relations._wanted": returning(lambda own: tuple(() for _ in own))},
    ),
    "closed zone forgotten": Mutant(
        with_a_closed_zone, "reach", {HOOK_ROOM: given(site=lambda site: replace(site, prohibited=None))}
    ),
    "zone without loads forgotten": Mutant(
        closed_to_loads, "reach", {HOOK_ROOM: given(site=lambda site: replace(site, no_load=None))}
    ),
    "height limiter forgotten": Mutant(
        limited_in_height, "reach", {HOOK_ROOM: given(site=lambda site: replace(site, hook_heights=None))}
    ),
    "wind limit 10 % too high": Mutant(
        one_in_too_much_wind, "wind", {"bimvox.planning.stage.permitted_for": returning(times(1.1))}
    ),
    "least wind of a lift ignored": Mutant(
        one_in_too_little_wind, "wind", {"bimvox.planning.stage.asked_wind_m_s": always(0.0)}
    ),
    "gusts half as strong": Mutant(
        one_in_too_much_wind, "gust", {"bimvox.motion.swing.wind_force_n": returning(times(0.5))}
    ),
    "gusts as if they came slowly": Mutant(one_in_too_much_wind, "gust", {"bimvox.motion.swing._SUDDEN": times(0.5)}),
    "raised through something": Mutant(
        raised_beneath_something, "yard", {"bimvox.planning.assembly.Assembly.who_is_at": always(())}
    ),
    "rates 10 % too high": Mutant(portal, "axis_limits", {RATES: returning(by(rate=1.1))}),
    "accelerations 10 % too high": Mutant(portal, "axis_limits", {RATES: returning(by(acceleration=1.1))}),
    "jerks 10 % too high": Mutant(portal, "axis_limits", {RATES: returning(by(jerk=1.1))}),
    "rope half as long": Mutant(
        quick_to_start,
        "swing",
        {"bimvox.motion.swing.pendulum_on": returning(lambda own: own._replace(rope_share=0.5))},
    ),
    "gravity of a giant planet": Mutant(quick_to_start, "swing", {"bimvox.motion.swing.GRAVITY_M_S2": times(2.0)}),
    "hook block ignored": Mutant(
        quick_to_start,
        "swing",
        {"bimvox.motion.swing.pendulum_on": returning(lambda own: own._replace(load_ratio=0.0))},
    ),
    "swing ignored": Mutant(portal, "swing", {"bimvox.motion.swing.pendulum_of": always(None)}),
    "residual swing ten times": Mutant(
        quick_to_start,
        "swing",
        {f"bimvox.motion.{where}.PLANNED_RESIDUAL_M": times(10.0) for where in ("steady", "swing")},
    ),
    "turned back in no time": Mutant(turned, "timeline", {"bimvox.motion.drive.turn_back_s": always(0.0)}),
    "turned back in half the time": Mutant(
        turned, "timeline", {"bimvox.motion.drive.turn_back_s": returning(times(0.5))}
    ),
    "turning as if its heading were kept": Mutant(
        turned_beside_a_tower,
        "motion_cells",
        {"bimvox.site.collision.turning_shape": lambda own: lambda component: component.shape},
    ),
    "turning without room": Mutant(
        turned_beside_a_tower,
        "cells",
        {"bimvox.site.collision.turning_shape": lambda own: lambda component: component.shape},
    ),
    "no tag lines for a kept heading": Mutant(
        turned_beside_a_tower,
        "timeline",
        {"bimvox.motion.time_lift.crew_times": lambda own: lambda rules, part, **_: own(rules, part, tag_lines=False)},
    ),
    "no time to hook on": Mutant(
        portal,
        "timeline",
        {"bimvox.motion.time_lift.crew_times": returning(lambda own: replace(own, sling_s=0.1 * own.sling_s))},
    ),
    "no time for tag lines": Mutant(
        portal, "timeline", {"bimvox.motion.time_lift.crew_times": returning(lambda own: replace(own, tag_line_s=0.0))}
    ),
    "a column braced as fast as a slab": Mutant(
        portal, "timeline", {"bimvox.site.crew_times.work_of": always(Work.SLAB)}
    ),
    "one time for all although there are times by class": Mutant(
        portal, "timeline", {"bimvox.motion.time_lift.crew_times": always(CrewTimes(60.0, 120.0, 30.0))}
    ),
    "a column tilted up in no time": Mutant(
        cache(lambda: portal(upend_s=90.0)), "timeline", {"bimvox.motion.time_lift.raised_s": always(10.0)}
    ),
    "no trial lift": Mutant(portal, "timeline", {"bimvox.motion.time_lift.TRIAL_LIFT_S": times(0.0)}),
    "no time to set": Mutant(
        portal, "timeline", {"bimvox.motion.time_lift.phases_from": given(lengths_ns=shortened(PhaseName.SET))}
    ),
    "no time to release": Mutant(
        portal, "timeline", {"bimvox.motion.time_lift.phases_from": given(lengths_ns=shortened(PhaseName.RELEASE))}
    ),
    "load a second early": Mutant(
        portal, "timeline", {"bimvox.motion.time_lift.delayed": given(by_ns=lambda by_ns: by_ns - 10**9)}
    ),
    "hook a fifth of a cell aside": Mutant(
        portal,
        "ends",
        {"bimvox.motion.swing.load_frame": returning(lambda own: own._replace(axis_x=own.axis_x + 0.2))},
    ),
    "slings 0.2 m too long": Mutant(
        portal,
        "ends",
        {"bimvox.motion.swing.load_frame": returning(lambda own: own._replace(zero_height_m=own.zero_height_m + 0.2))},
    ),
    "corners cut through": Mutant(
        close_to_a_wall,
        "motion_cells",
        {
            "bimvox.motion.timeline.longest_overlap_s": lambda true: (
                lambda packed, begins_s, corner, *rule: corner.longest_s
            )
        },
    ),
    "straight lines through": Mutant(portal, "motion_cells", {"bimvox.motion.shortcut.line_is_free": always(True)}),
    "empty hook anywhere": Mutant(
        close_to_a_wall,
        "empty_hook",
        {
            "bimvox.motion.time_lift.empty_hook_clearance": returning(
                lambda own: own._replace(table=np.zeros_like(own.table), hook_floor=np.zeros_like(own.hook_floor))
            )
        },
    ),
    "samples three times as far apart": Mutant(
        portal,
        "spacing",
        {"bimvox.motion.timeline._SPACING_VOX": times(3.0), "bimvox.motion.timeline._DENSE_VOX": times(3.0)},
    ),
    "cranes that never meet": Mutant(
        crossing_cranes,
        "cranes",
        {
            "bimvox.cranes.clocks.first_conflict": always(None),
            "bimvox.cranes.clocks.first_start": lambda _: lambda cranes, a, b, apart_m, starts_ns, *rest: starts_ns[0],
        },
    ),
    "cranes that brake at once": Mutant(
        crossing_cranes,
        "cranes",
        {
            "bimvox.cranes.lift.braking_distances": returning(lambda own: (0.0 * own[0], 0.0 * own[1])),
            "bimvox.cranes.lift.REACTION_S": times(0.0),
        },
    ),
    "cranes that take no turns": Mutant(
        taking_turns, "turns", {"bimvox.cranes.clocks.Clocks._set_after_ns": always(0)}
    ),
}


BRAKE = "bimvox.stop.brake_axes.brake"
STOPPED: dict[str, tuple[Mutant, float]] = {
    "brakes 10 % better than the crane's": (
        Mutant(one_behind_a_wall, "axis_limits", {BRAKE: given(limits=by(acceleration=1.1))}),
        0.5,
    ),
    "brakes that bite at once": (Mutant(one_behind_a_wall, "axis_limits", {BRAKE: given(limits=by(jerk=2.0))}), 0.5),
    "no braking distance": (
        Mutant(one_behind_a_wall, "axis_limits", {BRAKE: given(rate=times(0.0), acceleration=times(0.0))}),
        0.5,
    ),
}
"""Errors in emergency stops, each with the share of the loaded motion at which the stop is ordered."""


def made(site: Site) -> Made:
    """Return the plan and motions of a site as the planner makes them."""
    preparation = prepare(site)
    plan = plan_lifts(site, preparation)
    return plan, time_lifts(plan, preparation) if site.cranes else ()


def digest(plan: LiftPlan, motions: tuple[LiftMotion, ...]) -> str:
    """Return a digest of everything that the planner decides."""
    found = hashlib.sha256()
    for lift in plan.lifts:
        path = () if lift.path_vox is None else lift.path_vox.tolist()
        found.update(
            repr((lift.component, lift.status, lift.contact_moves, path, lift.place and lift.place.cell_vox)).encode()
        )
        found.update(repr(lift.flip).encode())
    found.update(repr(plan.clashes).encode())
    for motion in motions:
        time_ns, axes = motion.samples()
        found.update(repr((motion.phases, motion.wind)).encode() + time_ns.tobytes() + axes.tobytes())
    return found.hexdigest()


def failed(plan: LiftPlan, motions: tuple[LiftMotion, ...]) -> dict[str, tuple[str, ...]]:
    checks = (*verify_plan(plan).checks, *verify_motions(plan, motions).checks)
    return {check.name: tuple(check.failures) for check in checks if not check.passed}


@cache
def good(site: Callable[[], Site]) -> str:
    """Return the digest of the plan without an error, which is proven."""
    plan, motions = made(site())
    assert not failed(plan, motions)
    return digest(plan, motions)


def plant(monkeypatch: pytest.MonkeyPatch, errors: dict[str, Wrong]) -> None:
    for where, wrong in errors.items():
        owner, _, name = where.rpartition(".")
        try:
            found = importlib.import_module(owner)
        except ModuleNotFoundError:
            module, _, kind = owner.rpartition(".")
            found = getattr(importlib.import_module(module), kind)
        monkeypatch.setattr(found, name, wrong(getattr(found, name)))


@pytest.mark.parametrize("name", MUTANTS)
def test_an_error_in_the_planner_is_found(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    mutant = MUTANTS[name]
    without = good(mutant.site)
    plant(monkeypatch, mutant.errors)
    plan, motions = made(mutant.site())
    assert digest(plan, motions) != without, "the error changes nothing on this site"
    found = failed(plan, motions)
    assert mutant.check in found, f"seen by {sorted(found)}"


def independent_of() -> tuple[str, ...]:
    """Return the modules that the proof may not import, by the import contracts."""
    project = tomllib.loads((Path(__file__).parents[2] / "pyproject.toml").read_text())
    contracts = {contract["id"]: contract for contract in project["tool"]["importlinter"]["contracts"]}
    return (*contracts["proof"]["forbidden_modules"], *contracts["proof-rules"]["forbidden_modules"])


def test_errors_are_planted_only_in_modules_that_the_proof_may_not_import() -> None:
    forbidden = independent_of()
    planted = {where for mutant in MUTANTS.values() for where in mutant.errors} | {
        where for mutant, _ in STOPPED.values() for where in mutant.errors
    }
    assert not [where for where in planted if not where.startswith(tuple(f"{room}." for room in forbidden))]


def stopped(site: Site, share: float) -> Made:
    """Return the lift of a site's only part, stopped after a share of its loaded motion and resumed 20 s later."""
    preparation = prepare(site)
    plan = plan_lifts(site, preparation)
    (motion,) = time_lifts(plan, preparation)
    ((lift, space),) = replay(site, preparation, plan)
    rigged = rigged_crane(site, site.cranes[0], site.components[0])
    first, last = motion.loaded.time_ns[[0, -1]].tolist()
    stop = manoeuvre(rigged, motion, motion.loaded, motion.start_ns + int(first + share * (last - first)), space).stop
    goal = tuple(int(n) for n in lift.path_vox[-1])
    path = shortest_path(space, resume_cells(space, rigged.load, stop.pose)[0], goal).path_vox
    onward, needed_m = resume(rigged, space, stop.pose, path, 0)
    return plan, (interrupted(motion, stop, stop.end_ns + 20 * 10**9, onward, needed_m, rigged),)


@pytest.mark.parametrize("name", STOPPED)
def test_an_error_in_an_emergency_stop_is_found(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    mutant, share = STOPPED[name]
    plan, motions = stopped(mutant.site(), share)
    assert not failed(plan, motions)
    plant(monkeypatch, mutant.errors)
    spoiled = stopped(mutant.site(), share)
    assert digest(*spoiled) != digest(plan, motions), "the error changes nothing on this site"
    found = failed(*spoiled)
    assert mutant.check in found, f"seen by {sorted(found)}"


REFUSED = {
    "rope through three cells": "rope",
    "an obstruction forgotten": "cells",
    "jib 3 m too long": "reach",
    "rates 10 % too high": "axis_limits",
}


@pytest.mark.parametrize("name", REFUSED)
def test_no_lift_with_an_error_is_returned_as_planned(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    mutant = MUTANTS[name]
    site = mutant.site()
    preparation = prepare(site)
    plant(monkeypatch, mutant.errors)
    told: list[str] = []
    try:
        planned = plan_and_prove(site, preparation, NO_POLICY, progress=progress_of(told.append))
    except NoPlanError as error:
        told += error.reasons.values()
    else:
        assert not failed(planned.plan, planned.motions)
        told += [lift.reason or "" for lift in planned.plan.lifts]
    assert any(REFUSED[name] in line for line in told), told
