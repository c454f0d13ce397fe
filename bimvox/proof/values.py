"""Checks that a site and a plan make sense before anything is proven, are complete, and that the checks saw something.

A proof compares numbers. NaN compares false with everything, and with a tolerance of 1 m every overlap is allowed.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from dataclasses import astuple, fields
from math import isfinite
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bimvox.crane.carrier import Carrier
from bimvox.crane.tower_crane import AxisLimits, TowerCrane
from bimvox.errors import shown
from bimvox.records.lift import NOT_LIFTED, Lift, LiftPlan, Status
from bimvox.records.motion import LiftMotion, by_each_crane
from bimvox.records.proof import Check, turn_to
from bimvox.site.component import Component
from bimvox.site.default_rules import DEFAULT_RULES, MOST_CONTACT_TOLERANCE_M, MOST_SAMPLE_PERIOD_S, MOST_SUPPORT_GAP_M
from bimvox.site.means import Means
from bimvox.site.site import Rules, Site

_OBSTRUCTION = "obstruction"
_KINDS = frozenset(("ground", "crane", "structure", _OBSTRUCTION))
_COPY = "#"
"""Follows the GlobalId in the id of a part whose GlobalId occurs more than once in the model."""


def _check_names(check: Check, plan: LiftPlan, context: Collection[Lift]) -> None:
    """Check that every id in a plan is that of a part or a fixed object, and that every id is that of its GlobalId.

    ``check``: receives the result; ``context``: lifts of the same plan that it does not carry.
    """
    site = plan.site
    parts = {component.id for component in site.components}
    past = {blocker.id for epoch in plan.history for blocker in epoch.obstructions}
    known = parts | past | {blocker.id for blocker in site.blockers}
    numbers = {lift.component: lift.number for lift in (*plan.lifts, *context)}
    for component in site.components:
        name = f"lift {numbers.get(component.index, '-')} ({component.label})"
        own = component.id == component.global_id or component.id.startswith(component.global_id + _COPY)
        check.look(own, f"{name}: its GlobalId {component.global_id!r} is not that of its id {component.id!r}")
        for key, others in (("before", component.before), ("after", component.after)):
            for other in others:
                check.look(other in parts, f"{name}: {key} names {other!r}, which is not a part of the site")
    for other in plan.unheld:
        check.look(other in parts, f"unheld: {other!r} is not a part of the site")
    for blocker in site.blockers:
        check.look(blocker.kind in _KINDS, f"fixed object {blocker.id!r}: there is no kind {blocker.kind!r}")
    fixed = parts | {blocker.id for blocker in site.blockers if blocker.kind != _OBSTRUCTION}
    for number, epoch in enumerate(plan.history):
        seen: set[str] = set()
        for blocker in epoch.obstructions:
            check.look(blocker.id not in seen | fixed, f"history[{number}]: {blocker.id!r}: the id occurs twice")
            seen.add(blocker.id)
    for lift in (*plan.lifts, *context):
        name = f"lift {lift.number} ({site.components[lift.component].label})"
        why = site.components[lift.component].means_reason if lift.status in NOT_LIFTED else None
        check.look(
            lift.status is Status.INFEASIBLE or (lift.reason == why and not lift.blocked_by),
            f"{name}: it is {lift.status.value}, yet it says why it is not possible",
        )
        found = (lift.method is not None) == (lift.status is Status.PLANNED)
        check.look(found, f"{name}: it is {lift.status.value}, and its path was found by {lift.method or 'nothing'}")
        for other in lift.blocked_by:
            check.look(other in known, f"{name}: it is blocked by {other!r}, which is not on the site")


def check_complete(check: Check, plan: LiftPlan, lifts: Collection[Lift]) -> None:
    """Check the lifts of a plan by themselves; ``lifts`` are all, also those that an extract of it does not carry."""
    parts = plan.site.components
    seen = [lift.component for lift in lifts]
    check.look(sorted(seen) == list(range(len(parts))), "not every component has exactly one lift")
    orders = sorted(lift.order for lift in lifts)
    check.look(orders == list(range(len(orders))), "the lifts are not numbered 0, 1, 2 ...")
    for lift in plan.lifts:
        name, means = parts[lift.component].id, parts[lift.component].means
        good = (lift.path_vox is not None and lift.place is not None) == (lift.status is Status.PLANNED)
        check.look(good or lift.path_vox is None, f"{name}: its path and its status disagree")
        if lift.status is Status.INFEASIBLE:
            check.look(bool(lift.reason), f"{name}: infeasible without a reason")
        check.look(
            lift.status.value == means.value if lift.status in NOT_LIFTED else means is Means.CRANE,
            f"{name}: its means is {means.value}, but its lift is {lift.status.value}",
        )
    for lift in lifts:
        allowed = lift.status is Status.INFEASIBLE and plan.site.rules.by_other_means
        check.look(
            allowed or not lift.by_other_means,
            f"{parts[lift.component].id}: set by other means, but it is planned or the site's rules do not allow that",
        )


_ALWAYS = ("complete", "shapes", "mass", "slings", "unit_moves", "boundary", "cells", "yard")
_WITH_A_CRANE = (
    "reach",
    "timeline",
    "axis_limits",
    "axis_range",
    "ends",
    "rests",
    "spacing",
    "capacity",
    "motion_cells",
)
_WITH_A_ROPE = ("rope", "motion_rope")


def with_coverage(plan: LiftPlan, checks: Sequence[Check]) -> tuple[Check, ...]:
    """Return all checks of a plan and its motions, failed where they had to look at something and did not.

    A plan that carries no planned lift fails ``complete``: nothing of it was proven.
    """
    found = {check.name: check for check in checks}
    carried = sum(lift.status is Status.PLANNED for lift in plan.lifts)
    if not carried:
        found.setdefault("complete", Check("complete")).look(
            False, "nothing was proven: no lift of this log is both carried and planned"
        )
        return tuple(found.values())
    crane = _WITH_A_CRANE if plan.site.cranes else ()
    rope = _WITH_A_ROPE if plan.site.cranes and plan.site.rules.rope else ()
    for name in (*_ALWAYS, *crane, *rope):
        check = found.setdefault(name, Check(name))
        if not check.samples:
            check.look(False, f"looked at nothing, although {carried} planned lifts are carried")
    return tuple(found.values())


"""Clearances of which a lift may keep less, if they are defaults."""
_DAY_S = 86_400.0
_LONGEST_NS = 3652 * 86_400 * 10**9
_FAR_M = 1e5
_FAR_VOX = 2.0**20
_HEAVY_KG = 1e8
_MASSIVE_KG = 1e15
"""Of a part that no crane lifts; its mass decides nothing."""
_RIGID = 1e-9
_FAST = (10.0, 100.0, 1e4)
"""Highest rate, acceleration and jerk of an axis, rad or m, that a crane could have."""


class _Range(NamedTuple):
    """Values that make sense: ``low`` to ``high``; ``low`` itself only if ``with_low``."""

    low: float
    high: float
    with_low: bool = True


_MOVES = _Range(0.0, 1e9)
_PROPS = {
    "wind_kn_m2": _Range(0.0, 1e3),
    "clearance_m": _Range(0.0, 10.0),
    "shore_spacing_m": _Range(0.0, 100.0, with_low=False),
    "plank_m": _Range(0.0, _FAR_M),
}
_RULES = {
    "clearance_m": _Range(0.0, _FAR_M),
    "contact_tolerance_m": _Range(0.0, MOST_CONTACT_TOLERANCE_M),
    "support_gap_m": _Range(0.0, MOST_SUPPORT_GAP_M),
    "sample_period_s": _Range(0.0, MOST_SAMPLE_PERIOD_S, with_low=False),
    "bracing_s": _Range(0.0, _DAY_S),
    "release_s": _Range(0.0, _DAY_S),
    "turn_s": _Range(0.0, _DAY_S),
    "upend_s": _Range(0.0, _DAY_S),
    "transit_clearance_m": _Range(0.0, _FAR_M),
    "rope_clearance_m": _Range(0.0, _FAR_M),
    "departure_clearance_m": _Range(0.0, _FAR_M),
    "approach_clearance_m": _Range(0.0, _FAR_M),
    "upending_clearance_m": _Range(0.0, _FAR_M),
    "turning_clearance_m": _Range(0.0, _FAR_M),
    "truckload_kg": _Range(0.0, _HEAVY_KG),
    "wind_speed_m_s": _Range(0.0, 100.0),
    "least_wind_m_s": _Range(0.0, 100.0),
    "drag_coefficient": _Range(0.0, 100.0, with_low=False),
    "sling_angle_rad": _Range(0.0, 2.0943951023931957, with_low=False),
    "critical_share": _Range(0.0, 1.0, with_low=False),
    "highest_utilisation": _Range(0.0, 1.0, with_low=False),
    "crane_separation_m": _Range(0.0, _FAR_M, with_low=False),
}
_YARD = {
    "gap_m": _Range(0.0, 10.0),
    "stack_parts": _Range(1.0, 100.0),
    "stack_height_m": _Range(0.0, 10.0, with_low=False),
    "stack_kg": _Range(0.0, _HEAVY_KG, with_low=False),
    "dunnage_m": _Range(0.0, 1.0),
    "rack_parts": _Range(0.0, 100.0),
    "rack_depth": _Range(0.0, 2.0),
    "lorries": _Range(1.0, 20.0),
}
_TWO_HOOKS = {
    "clear_m": _Range(0.0, _FAR_M),
    "most_share": _Range(0.0, 1.0, with_low=False),
    "turn_s": _Range(0.0, _DAY_S),
    "unhook_s": _Range(0.0, _DAY_S),
}
_CRANE = {
    "mast_size_m": _Range(0.0, 100.0, with_low=False),
    "jib_height_m": _Range(0.0, 1e3, with_low=False),
    "jib_length_m": _Range(0.0, 1e3, with_low=False),
    "min_radius_m": _Range(0.0, 1e3),
    "sling_m": _Range(0.0, 1e3),
    "rigging_mass_kg": _Range(0.0, _HEAVY_KG),
    "hook_block_kg": _Range(0.0, _HEAVY_KG),
    "falls": _Range(1.0, 100.0),
    "max_wind_m_s": _Range(0.0, 100.0, with_low=False),
}
_FOUNDATION_M2 = _Range(0.0, 1e4, with_low=False)


_LUFFING = {
    "pivot_offset_m": _Range(-100.0, 100.0),
    "pivot_height_m": _Range(0.0, 1e3, with_low=False),
    "length_m": _Range(0.0, 1e3, with_low=False),
    "tail_radius_m": _Range(0.0, 100.0, with_low=False),
    "tail_low_m": _Range(-100.0, 1e3),
    "tail_width_m": _Range(0.0, 100.0, with_low=False),
    "width_m": _Range(0.0, 100.0, with_low=False),
}


def check_values(plan: LiftPlan, motions: Sequence[LiftMotion] = (), context: Collection[Lift] = ()) -> Check:
    """Check that every number of a plan and its site is finite and in a sane range, and that ids are unique.

    ``context``: lifts of the same plan that it does not carry.
    """
    check = Check("values")
    site = plan.site
    numbers = {lift.component: lift.number for lift in (*plan.lifts, *context)}
    _check_frame(check, site)
    _check_rules(check, site.rules)
    for crane in site.cranes:
        _check_crane(check, crane)
    lifted = {lift.component for lift in (*plan.lifts, *context) if lift.status is Status.PLANNED}
    for component in site.components:
        turn_to([check], component.id)
        name = f"lift {numbers.get(component.index, '-')} ({component.label})"
        _check_component(check, component, name, _HEAVY_KG if component.index in lifted else _MASSIVE_KG)
    turn_to([check], None)
    _check_ids(check, "part", (component.id for component in site.components))
    _check_ids(check, "fixed object", (blocker.id for blocker in site.blockers))
    parts = {component.id for component in site.components}
    for number, blocker in enumerate(site.blockers):
        check.look(blocker.id not in parts, f"fixed object {blocker.id!r}: a part has the same id")
        bare = blocker.kind == "structure" and (blocker.mesh is None or not len(blocker.mesh.faces))
        check.look(not bare, f"fixed object {blocker.id!r}: a structure without a surface")
        if blocker.mesh is not None:
            only = f"fixed object {blocker.id!r}: it has a surface; only structures have, which parts may touch"
            check.look(blocker.kind == "structure", only)
            _finite(check, f"site.blockers[{number}] ({blocker.id}).mesh.vertices_m", blocker.mesh.vertices_m)
    _check_clashes(check, plan)
    _check_names(check, plan, context)
    for lift in plan.lifts:
        name = f"lift {lift.number} ({site.components[lift.component].label})"
        _check_lift(check, lift, name)
        for rule, own_m in lift.kept._asdict().items():
            may = own_m is None or rule in site.rules.gives_way
            check.look(may, f"{name}: it keeps {own_m} m of {rule}, which does not give way on this site")
    for number, epoch in enumerate(plan.history):
        _check_time(check, f"history[{number}]: it ends", epoch.until_ns)
    check_motion_values(check, site, motions)
    return check


def check_motion_values(check: Check, site: Site, motions: Sequence[LiftMotion]) -> None:
    """Add what :func:`check_values` checks of motions to a check of the values of their plan."""
    for motion in by_each_crane(motions):
        there = 0 <= motion.component < len(site.components)
        check.look(there, f"lift {motion.number}: its motion is of component {motion.component}, which does not exist")
        name = f"lift {motion.number} ({site.components[motion.component].label})" if there else "a motion"
        turn_to([check], site.components[motion.component].id if there else None)
        _finite(check, f"{name}: joint states", motion.samples()[1])
        for what in ("approach", "raising", "loaded", "departure"):
            if (way := getattr(motion, what)) is not None:
                _within(check, f"{name}: bound_s of its {what} motion", way.bound_s, _Range(0.0, 1e9))
        longer = motion.loaded.bound_s > motion.loaded.duration_s * (1.0 + 1e-6) and not motion.stops_ns
        check.look(not longer, f"{name}: bound_s is longer than its loaded motion")
        if motion.wind is not None:
            _within(check, f"{name}: wind.speed_m_s", motion.wind.speed_m_s, _Range(0.0, 100.0))
            _within(check, f"{name}: wind.swing_m", motion.wind.swing_m, _Range(0.0, _FAR_M))
        _check_time(check, f"{name}: it ends", motion.end_ns)
        for phase in motion.phases:
            _check_time(check, f"{name}: its phase {phase.name.value} begins", phase.start_ns)
            _check_time(check, f"{name}: its phase {phase.name.value} ends", phase.end_ns)
    turn_to([check], None)


def _check_frame(check: Check, site: Site) -> None:
    _within(check, "site.frame.voxel_size_m", site.frame.voxel_size_m, _Range(0.0, 100.0, with_low=False))
    _finite(check, "site.frame.origin_m", site.frame.origin_m, most=_FAR_M)
    _check_transform(check, site.site_to_ifc)
    if site.natural_ground_m is not None:
        _finite(check, "site.natural_ground_m", site.natural_ground_m)
    if site.hook_heights is not None:
        unknown = np.isnan(site.hook_heights.low_m).any() or np.isnan(site.hook_heights.high_m).any()
        check.look(not unknown, "site.hook_heights: a limit is not a number")


def _check_transform(check: Check, site_to_ifc: NDArray[np.float64]) -> None:
    """Check that the site lies in the model as it is: moved, and turned about the vertical."""
    _finite(check, "site.site_to_ifc", site_to_ifc)
    turn = site_to_ifc[:2, :2]
    rigid = np.allclose(turn @ turn.T, np.eye(2), atol=_RIGID) and np.linalg.det(turn) > 0.0
    upright = np.allclose(site_to_ifc[2, :3], (0.0, 0.0, 1.0), atol=_RIGID)
    upright &= np.allclose(site_to_ifc[:2, 2], 0.0, atol=_RIGID)
    last = np.array_equal(site_to_ifc[3], (0.0, 0.0, 0.0, 1.0))
    check.look(bool(rigid and upright and last), "site.site_to_ifc is not a move and a turn about the vertical")


def _check_clashes(check: Check, plan: LiftPlan) -> None:
    """Check that pairs are listed once, of things that are there, and as deep as their way out is long."""
    ids = {component.id for component in plan.site.components} | {blocker.id for blocker in plan.site.blockers}
    seen: set[frozenset[str]] = set()
    for clash in plan.clashes:
        where = f"clashes: {clash.first} and {clash.second}"
        _within(check, f"{where}: depth_m", clash.depth_m, _Range(0.0, _FAR_M))
        _finite(check, f"{where}: way_out_m", clash.way_out_m or ())
        pair = frozenset((clash.first, clash.second))
        check.look(pair not in seen, f"{where}: listed twice")
        check.look(len(pair) == 2 and pair <= ids, f"{where}: these are not two parts or structures of the site")
        seen.add(pair)
        if clash.way_out_m is not None:
            length_m = float(np.abs(clash.way_out_m).sum())
            good = abs(length_m - clash.depth_m) <= 1e-5
            check.look(good, f"{where}: depth_m is {clash.depth_m:g}, but the way out is {length_m:g} m long")


def _check_rules(check: Check, rules: Rules) -> None:
    for key in fields(Rules):
        value = getattr(rules, key.name)
        if key.name in _RULES and value is not None:
            _within(check, f"site.rules.{key.name}", value, _RULES[key.name])
    check.look(
        set(rules.gives_way) <= DEFAULT_RULES.keys(),
        f"site.rules.gives_way is {shown(rules.gives_way)}: only {', '.join(DEFAULT_RULES)} can give way",
    )
    for work in fields(rules.times):
        own = getattr(rules.times, work.name)
        for key in fields(own):
            _within(check, f"site.rules.times.{work.name}.{key.name}", getattr(own, key.name), _Range(0.0, _DAY_S))

    if rules.two_hooks is not None:
        for key in fields(rules.two_hooks):
            _within(check, f"site.rules.two_hooks.{key.name}", getattr(rules.two_hooks, key.name), _TWO_HOOKS[key.name])
    if rules.tandem is not None:
        _within(check, "site.rules.tandem.most_share", rules.tandem.most_share, _Range(0.0, 1.0, with_low=False))
        _within(check, "site.rules.tandem.off_level_rad", rules.tandem.off_level_rad, _Range(0.0, 0.3))
    if rules.yard is not None:
        for limit, most in _YARD.items():
            _within(check, f"site.rules.yard.{limit}", getattr(rules.yard, limit), most)
        for edge_m in rules.yard.truck_m or ():
            _within(check, "site.rules.yard.truck_m", edge_m, _Range(0.0, 100.0, with_low=False))
    if rules.curing is not None:
        for own_h in fields(rules.curing)[:-1]:
            _within(check, f"site.rules.curing.{own_h.name}", getattr(rules.curing, own_h.name), _Range(0.0, 2e4))
    if rules.props is not None:
        for limit, most in _PROPS.items():
            _within(check, f"site.rules.props.{limit}", getattr(rules.props, limit), most)
        for one in rules.props.types:
            for length in (one.least_m, one.most_m, one.load_kn):
                _within(check, f"site.rules.props.types: {one.name}", length, _Range(0.0, _FAR_M, with_low=False))
    _within(check, "site.rules.casting.people", rules.casting.people, _Range(0.0, 1e4, with_low=False))
    _within(check, "site.rules.casting.hand_s", rules.casting.hand_s, _Range(0.0, _DAY_S))
    _within(check, "site.rules.casting.bundle_kg", rules.casting.bundle_kg, _Range(0.0, _HEAVY_KG))
    _within(check, "site.rules.casting.bundle_s", rules.casting.bundle_s, _Range(0.0, _DAY_S))
    for work in fields(rules.casting)[4:]:
        own = getattr(rules.casting, work.name)
        _within(check, f"site.rules.casting.{work.name}.hours_m3", own.hours_m3, _Range(0.0, 1e4))
        _within(check, f"site.rules.casting.{work.name}.wait_h", own.wait_h, _Range(0.0, 2e4))


def _check_crane(check: Check, crane: TowerCrane) -> None:
    where = f"crane {crane.name!r}"
    for key, good in _CRANE.items():
        _within(check, f"{where}: {key}", getattr(crane, key), good)
    if crane.foundation_m2 is not None:
        _within(check, f"{where}: foundation_m2", crane.foundation_m2, _FOUNDATION_M2)
    if (hook := crane.auxiliary) is not None:
        numbers = (hook.hook_block_kg, hook.ahead_m, hook.most_share or 0.0)
        _finite(check, f"{where}: auxiliary", numbers, most=_HEAVY_KG)
        _within(check, f"{where}: auxiliary.hook_block_kg", hook.hook_block_kg, _Range(0.0, _HEAVY_KG))
        _check_chart(check, f"{where}: auxiliary", zip(hook.chart.radius_m, hook.chart.capacity_kg, strict=True))
    if crane.stand is not None:
        own = (crane.stand.edge_m, crane.stand.ballast_kg, crane.stand.free_standing_m, crane.stand.mass_kg)
        _finite(check, f"{where}: stand", [one or 0.0 for one in own], most=_HEAVY_KG)
        if crane.stand.tail_radius_m is not None:
            _within(check, f"{where}: stand.tail_radius_m", crane.stand.tail_radius_m, _LUFFING["tail_radius_m"])
    _finite(check, f"{where}: base_m", crane.base_m, most=_FAR_M)
    axes = {"slewing": crane.slewing, "trolley": crane.trolley, "hoist": crane.hoist}
    if (jib := crane.luffing) is not None:
        axes |= {"luffing.limits": jib.limits, "luffing.winch": jib.winch}
        for key, good in _LUFFING.items():
            _within(check, f"{where}: luffing.{key}", getattr(jib, key), good)
    for name, axis in axes.items():
        for limit, value, most in zip(fields(AxisLimits), astuple(axis), _FAST, strict=True):
            _within(check, f"{where}: {name}.{limit.name}", value, _Range(0.0, most, with_low=False))
    for one in fields(crane.working_range):
        if (limits := getattr(crane.working_range, one.name)) is not None:
            _finite(check, f"{where}: working_range.{one.name}", limits, most=1e3)
    _check_chart(check, where, zip(crane.chart.radius_m, crane.chart.capacity_kg, strict=True))
    if crane.carrier is not None:
        _check_carrier(check, where, crane.carrier)
    for mass_kg, rate_m_s in crane.gears:
        _within(check, f"{where}: gears, mass in kg", mass_kg, _Range(0.0, _HEAVY_KG, with_low=False))
        _within(check, f"{where}: gears, rate in m/s", rate_m_s, _Range(0.0, _FAST[0], with_low=False))
    for zone in crane.slow_zones:
        _within(check, f"{where}: slow zone, share", zone.share, _Range(0.0, 1.0, with_low=False))
        _finite(check, f"{where}: slow zone, polygon", zone.polygon, most=_FAR_M)
        check.look(len(zone.polygon) > 2, f"{where}: slow zone, polygon: it has fewer than three corners")


def _check_chart(check: Check, where: str, listed: Iterable[tuple[float, float]]) -> None:
    for radius_m, capacity_kg in listed:
        _within(check, f"{where}: chart, radius", radius_m, _Range(0.0, 1e3, with_low=False))
        _within(check, f"{where}: chart, capacity in kg", capacity_kg, _Range(0.0, _HEAVY_KG, with_low=False))


def _check_carrier(check: Check, where: str, carrier: Carrier) -> None:
    """Check that heading, counterweight, outriggers, masses and sectors have values that a mobile crane may have."""
    _finite(check, f"{where}: heading_rad", (carrier.heading_rad,), most=1e3)
    _within(check, f"{where}: counterweight_kg", carrier.counterweight_kg or 0.0, _Range(0.0, _HEAVY_KG))
    for name, kg in carrier.deductions:
        _within(check, f"{where}: deduction {name!r}", kg, _Range(0.0, _HEAVY_KG, with_low=False))
    if (base := carrier.outriggers) is not None:
        for edge in fields(base)[1:]:
            _within(check, f"{where}: outriggers.{edge.name}", getattr(base, edge.name), _Range(0.0, 100.0))
    if carrier.masses is not None:
        for one in fields(carrier.masses):
            value, most = getattr(carrier.masses, one.name), _HEAVY_KG if one.name.endswith("_kg") else 100.0
            _finite(check, f"{where}: masses.{one.name}", (value,), most=most)
    for sector in carrier.sectors:
        _finite(check, f"{where}: sector {sector.name!r}", (sector.from_rad, sector.to_rad), most=15.0)
        if sector.chart is not None:
            listed = zip(sector.chart.radius_m, sector.chart.capacity_kg, strict=True)
            _check_chart(check, f"{where}: sector {sector.name!r}", listed)


def _check_component(check: Check, component: Component, name: str, most_kg: float) -> None:
    _within(check, f"{name}: mass_kg", component.mass_kg, _Range(0.0, most_kg, with_low=False))
    _within(check, f"{name}: sail_area_m2", component.sail_area_m2, _Range(0.0, 1e6))
    _within(check, f"{name}: lifting.sling_rise_vox", component.lifting.sling_rise_vox, _Range(0.0, 1e5))
    _within(check, f"{name}: flip_rise_vox", component.flip_rise_vox, _Range(0.0, 1e5))
    _finite(check, f"{name}: target_vox", component.target_vox, most=_FAR_VOX)
    _finite(check, f"{name}: hook_offset_vox", component.hook_offset_vox, most=_FAR_VOX)
    if component.tandem is not None:
        _finite(check, f"{name}: tandem.points_m", component.tandem.points_m, most=_FAR_M)
    _finite(check, f"{name}: start_vox", component.start_vox or (), most=_FAR_VOX)
    _finite(check, f"{name}: lifting.points_m", component.lifting.points_m, most=_FAR_M)
    if (rig := component.lifting.rig) is not None:
        of_pieces = [(p.rated_kg, p.wll_kg, p.load_kg, p.mass_kg, p.angle_rad, p.length_m, p.made_m) for p in rig.parts]
        own = (rig.height_m, rig.mass_kg, rig.drop_m, rig.eye_m)
        _finite(check, f"{name}: lifting.rig", [number for row in (own, *of_pieces) for number in row], most=_HEAVY_KG)
    _finite(check, f"{name}: hook_aside_vox", component.hook_aside_vox, most=0.5)
    _finite(check, f"{name}: mesh.vertices_m", component.mesh.vertices_m, most=_FAR_M)
    check.look(len(component.mesh.faces) > 0, f"{name}: mesh.faces: it has no surface")


def _check_lift(check: Check, lift: Lift, name: str) -> None:
    if lift.status in NOT_LIFTED:
        way = (lift.shortest_moves, *lift.kept, lift.guide, lift.contact_moves or None, lift.with_jib or None)
        check.look(way == (None,) * len(way), f"{name}: the crane does not lift it, but it has the values of a way")
    _within(check, f"{name}: contact_moves", lift.contact_moves, _MOVES)
    if lift.moves is not None:  # a load that was stopped may be in its last moves
        moves = max(lift.moves, *(len(left.path_vox) - 1 for left in lift.left)) if lift.left else lift.moves
        most = f"{name}: contact_moves is {lift.contact_moves:,}, but its path has {moves:,} moves"
        check.look(lift.contact_moves <= moves, most)
    for left in lift.left:
        _within(check, f"{name}: contact_moves of a path that it left", left.contact_moves, _MOVES)
        _check_time(check, f"{name}: it leaves a path", left.until_ns)
    if lift.place is not None:
        place = lift.place
        _finite(
            check,
            f"{name}: place.cell_vox",
            (*place.cell_vox, place.rise_vox, place.delivery, place.stack),
            most=_FAR_VOX,
        )
    if lift.guide is not None:
        _finite(check, f"{name}: guide.poses", lift.guide.poses, most=_FAR_M)
        _finite(check, f"{name}: guide.centre_m", lift.guide.centre_m, most=_FAR_M)
        _within(check, f"{name}: guide.heading_rad", lift.guide.heading_rad, _Range(-10.0, 10.0))
    if (flip := lift.flip) is not None:
        own = (*flip.main_m, *flip.auxiliary_m, *flip.angle_deg, *flip.main_kg, *flip.auxiliary_kg)
        _finite(check, f"{name}: flip", (*own, flip.used, flip.radius_m, flip.clear_m, flip.lean_rad), most=_HEAVY_KG)
    if (shared := lift.tandem) is not None:
        own = (*shared.load_kg, *shared.most_kg, *shared.used, *shared.radius_m, shared.apart_m, shared.off_level_rad)
        _finite(check, f"{name}: tandem", own, most=_HEAVY_KG)
        _finite(check, f"{name}: tandem.points_m", shared.points_m, most=_FAR_M)
    for rule, own_m in lift.kept._asdict().items():
        if own_m is not None:
            _within(check, f"{name}: {rule}", own_m, _Range(0.0, _FAR_M))
    if lift.shortest_moves is not None:
        _within(check, f"{name}: shortest_moves", lift.shortest_moves, _MOVES)


def _check_time(check: Check, what: str, time_ns: int) -> None:
    in_range = 0 <= time_ns <= _LONGEST_NS
    check.look(in_range, f"{what} at {time_ns / 1e9:.10g} s on the site's clock, not within ten years from its start")


def _check_ids(check: Check, what: str, ids: Iterable[str]) -> None:
    seen: set[str] = set()
    for name in ids:
        check.look(name not in seen, f"{what} {name!r}: the id occurs twice")
        seen.add(name)


def _within(check: Check, name: str, value: float, good: _Range) -> None:
    low, high, with_low = good
    inside = isfinite(value) and (low <= value if with_low else low < value) and value <= high
    span = f"from {low:g}" if with_low else f"above {low:g}"
    check.look(inside, f"{name} is {value:g}; it must be {span}, at most {high:g}")


def _finite(check: Check, name: str, values: ArrayLike, most: float = 1e12) -> None:
    array = np.asarray(values, np.float64)
    good = np.isfinite(array) & (np.abs(array) <= most)
    bad = "" if good.all() else f"{array[~good].reshape(-1)[0]:g}"
    check.look(not bad, f"{name}: {bad} is not a coordinate in range")
