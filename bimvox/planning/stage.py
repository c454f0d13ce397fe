"""A stage: what the planner knows when it plans a lift, the transit that it asks for, or why the crane cannot do it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from math import ceil

import numpy as np
from numpy.typing import NDArray

from bimvox.crane.load_chart import capacity_kg, wind_force_n
from bimvox.crane.reach import allowed_radii_m
from bimvox.crane.sectors import NO_LOAD, sectors_of
from bimvox.crane.tower_crane import TowerCrane
from bimvox.planning.flip import no_second_hook
from bimvox.planning.insertion import Insertion
from bimvox.records.lift import YardPlace
from bimvox.site.checks import unloading_columns
from bimvox.site.collision import CollisionSpace, margin_vox, placement_is_free, turning_space
from bimvox.site.component import Component, IntVec
from bimvox.site.default_rules import ALL_KEPT, Kept
from bimvox.site.lifting import (
    asked_wind_m_s,
    crane_for,
    crane_towards,
    hook_radius_m,
    hung_kg,
    permitted_for,
    permitted_share,
    place_radius_m,
)
from bimvox.site.site import Site
from bimvox.site.tandem import halves, jibs_apart, tandem_rules
from bimvox.units import mass_text


@dataclass(frozen=True, slots=True, eq=False)
class Transit:
    """A transit to be found.

    Attributes:
        space: The collision rule at its stage.
        start_vox: Reference cell of the transit start.
        goal_vox: Reference cell of the gate.
        component: The part, if it is known.
    """

    space: CollisionSpace
    start_vox: IntVec
    goal_vox: IntVec
    component: Component | None = None


Propose = Callable[[Transit], "NDArray[np.int32] | None"]
"""Proposes a path: (N, 3) int32 from start to goal, or None if it did not arrive."""


@dataclass(frozen=True, slots=True)
class ProposedGreedily:
    """Proposes paths by greedy values, without a policy; a plan says so of each lift found by it.

    Attributes:
        ask: What proposes.
    """

    ask: Propose

    def __call__(self, transit: Transit) -> NDArray[np.int32] | None:
        """Return the path from start to goal, or None."""
        return self.ask(transit)


@dataclass(frozen=True, slots=True)
class Obstacle:
    """Why a lift cannot be planned.

    Attributes:
        reason: One sentence; "it" is the part.
        blocked_by: Ids of what blocks the lift.
        cut_off: Whether the search for its last moves was ended by its limit, so there may be a way.
        on_the_way: Whether something is in the way of its transit or its last moves: less clearance may help.
        is_unsupported: Whether what it would stand on is missing: until that is set, no other means can set it either.
    """

    reason: str
    blocked_by: tuple[str, ...] = ()
    cut_off: bool = False
    on_the_way: bool = False
    is_unsupported: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class Stage:
    """The state of the site just before a lift.

    Attributes:
        component: The part.
        place: Its place in the yard.
        space: The collision rule for its transit; the placements of its departure are cleared.
        start_vox: Start of its transit.
        insertion: Its last moves.
        free: The collision rule without any clearance, for a load that must be stopped.
        kept: What it keeps of the clearances that give way.
        turning: The rule for the transit of a load that turns with the jib; None if tag lines keep its heading.
    """

    component: Component
    place: YardPlace
    space: CollisionSpace
    start_vox: IntVec
    insertion: Insertion
    free: CollisionSpace
    kept: Kept = ALL_KEPT
    turning: CollisionSpace | None = None

    @property
    def is_turning(self) -> bool:
        """Whether the load turns with the jib."""
        return self.turning is not None

    @property
    def transit(self) -> Transit:
        """What is to be found: the way from the start to the gate."""
        space = self.space if self.turning is None else self.turning
        return Transit(space, self.start_vox, self.insertion.gate_vox, self.component)

    @property
    def clearance_with_insertion(self) -> CollisionSpace:
        """The collision rule for the crane's motion: the placements of the last moves are cleared too."""
        return with_cleared(self.space, self.insertion.path_vox)

    @property
    def free_with_insertion(self) -> CollisionSpace:
        """The rule for a load that must be stopped: without clearances, the placements of the last moves cleared."""
        return with_cleared(self.free, self.insertion.path_vox)


def with_cleared(space: CollisionSpace, path_vox: NDArray[np.int32]) -> CollisionSpace:
    """Return a collision rule with (N, 3) more placements cleared."""
    if not len(path_vox):
        return space
    low, high = path_vox.min(axis=0), path_vox.max(axis=0) + 1
    if space.cleared.size:
        low = np.minimum(low, space.cleared_low)
        high = np.maximum(high, space.cleared_low + space.cleared.shape)
    cleared = np.zeros(high - low, np.bool_)
    cleared[tuple((path_vox - low).T)] = True
    before = np.argwhere(space.cleared) + space.cleared_low - low
    cleared[tuple(before.T)] = True
    return space._replace(cleared_low=low.astype(np.int32), cleared=cleared)


_LEAST_ABOVE_M = 0.5
"""A load is turned to its final heading this far above its place, or higher ..."""
_MOST_ABOVE_M = 6.0
"""... but no higher than this, where a crew at its place can hold its tag line."""


def turning_stage(site: Site, stage: Stage) -> Stage | None:
    """Return a stage with a load that turns with the jib; None if it cannot turn above its start or above its place."""
    place = stage.insertion.path_vox[-1]
    if (stage.insertion.path_vox[:, :2] != place[:2]).any():
        return None
    margin = margin_vox(site, stage.kept)
    space = turning_space(site, stage.component, stage.space, stage.start_vox, margin)
    above = None if space is None else _where_it_turns(site, stage, space)
    if above is None or above[:2] == stage.start_vox[:2]:
        return None
    return replace(stage, insertion=_from(above, stage.insertion, site.frame.voxel_size_m), turning=space)


def _where_it_turns(site: Site, stage: Stage, space: CollisionSpace) -> IntVec | None:
    """Return the lowest placement above the place at which the load may turn, with a free column down to the gate."""
    x, y, low = stage.insertion.gate_vox
    place, size_m = int(stage.insertion.path_vox[-1, 2]), site.frame.voxel_size_m
    lowest, highest = place + ceil(_LEAST_ABOVE_M / size_m - 1e-9), place + int(_MOST_ABOVE_M / size_m + 1e-9)
    for z in range(low, min(highest + 1, site.shape[2])):
        if not placement_is_free(stage.space, x, y, z):
            return None
        if z >= lowest and placement_is_free(space, x, y, z):
            return (x, y, z)
    return None


def _from(above: IntVec, insertion: Insertion, voxel_size_m: float) -> Insertion:
    """Return last moves that begin at a placement straight above their gate."""
    x, y, gate = insertion.gate_vox
    column = np.array([(x, y, z) for z in range(above[2], gate, -1)], np.int32).reshape(-1, 3)
    path_vox = np.concatenate([column, insertion.path_vox]).astype(np.int32)
    guide = insertion.guide
    if guide is not None and len(column):
        top_m = guide.top_m + len(column) * voxel_size_m
        guide = replace(guide, poses=((top_m, 0.0, 0.0), *guide.poses))
    return replace(insertion, path_vox=path_vox, guide=guide)


# Lifts that the crane cannot do whatever the path: too heavy, out of reach, or too much sail area for the wind.
#
# The reason gives the figure that decides and the governing radius.

_SLACK_M = 1e-6


def refused_by_crane(site: Site, component: Component) -> str | None:
    """Return why the crane cannot lift a part to its place whatever the path; None if it can."""
    crane = site.crane_of(component)
    if crane is None:
        return None
    if component.lifting.no_gear:
        return f"no gear serves its {mass_text(component.mass_kg)}: {component.lifting.no_gear}"
    if component.tandem is not None:
        return _refused_by_two(site, component) or _by_access(site, crane, component)
    reasons = {
        one.name: _by_wind(site, one, component) or _by_radius(site, one, component) or _by_hooks(one, component)
        for one in site.cranes
    }
    if reasons[crane.name] is None:
        return _by_access(site, crane, component)
    if len(site.cranes) == 1:
        return reasons[crane.name]
    if site.moving is not None:
        able = [f"{one.name} could lift it" for one in site.cranes if reasons[one.name] is None]
        return "; ".join([str(reasons[crane.name]), *(able or ["no other set-up carries it to its place"])])
    could = "could lift it, but the part is assigned to another crane"
    return "; ".join(f"{name}: {reason or could}" for name, reason in reasons.items())


def _refused_by_two(site: Site, component: Component) -> str | None:
    """Return why the two cranes of a part cannot carry it to its place together; None if they can."""
    most = tandem_rules(site.rules).most_share
    for half in halves(site, component):
        one = site.cranes[half.crane]
        if (reason := _by_wind(site, one, half) or _by_reach(site, one, half)) is not None:
            return f"{reason}; two cranes hold it"
        radius_m, hung = place_radius_m(site, one, half), hung_kg(one, half)
        carries_kg = capacity_kg(crane_towards(site, one, half, half.target_vox).chart, radius_m)
        if hung > most * carries_kg * (1.0 + _SLACK_M):
            used = 100.0 * hung / carries_kg if carries_kg > 0.0 else np.inf
            return (
                f"two cranes hold it, and {one.name} would carry {mass_text(hung)} at its place, with rigging and "
                f"hook block: {used:.0f} % of its load chart at {radius_m:.1f} m; [rules.tandem] most_share permits "
                f"{100.0 * most:g} %"
            )
    x, y, _ = np.add(component.target_vox, component.hook_offset_vox).tolist()
    if not jibs_apart(site, component)[x, y]:
        first, second = (site.cranes[half.crane].name for half in halves(site, component))
        return (
            f"two cranes hold it, and above its place jib and rope of {first} and {second} would come too near to each "
            f"other ([rules] crane_separation_m is {site.rules.crane_separation_m:g} m, and they must brake)"
        )
    return None


def share_for(site: Site, component: Component, place: YardPlace | None) -> float:
    """Return the share of the load chart that a lift from a place in the yard may use."""
    crane = site.crane_of(component)
    if crane is None:
        return 1.0
    return permitted_share(site, crane, component, None if place is None else place.transit_start_vox)


def _by_access(site: Site, crane: TowerCrane, component: Component) -> str | None:
    if site.access is None or len(unloading_columns(site, component)):
        return None
    return (
        f"it cannot be unloaded: {carried_where(site, crane, component)}, and no truck can stand there ([areas] access)"
    )


def carried_where(site: Site, crane: TowerCrane, component: Component) -> str:
    """Return at which radii a crane carries a part, in words."""
    share, rigged = permitted_share(site, crane, component), crane_for(site, crane, component)
    low_m, high_m = allowed_radii_m(rigged, component.mass_kg, share)
    radii = f"at radii from {low_m:.1f} to {high_m:.1f} m" if low_m <= high_m else "at no radius"
    for one in sectors_of(crane):
        there = NO_LOAD if one.chart is None else one.chart
        _, far_m = allowed_radii_m(replace(rigged, chart=there), component.mass_kg, share)
        radii += f", {one.name} " + (f"to {far_m:.1f} m" if low_m <= far_m else "at no radius")
    return f"{crane.name} carries {mass_text(hung_kg(crane, component))} with rigging and hook block {radii}"


def _by_wind(site: Site, crane: TowerCrane, component: Component) -> str | None:
    wind, drag, area = asked_wind_m_s(site.rules), site.rules.drag_coefficient, component.sail_area_m2
    if wind <= 0.0:
        return None
    if wind > crane.max_wind_m_s:
        return f"the site's wind speed is {wind:g} m/s, but {crane.name} works only up to {crane.max_wind_m_s:g} m/s"
    permitted = permitted_for(site, crane, component)
    if wind <= permitted:
        return None
    force_kn = wind_force_n(wind, area, drag) / 1000.0
    return (
        f"its sail area of {area:.1f} m2 (drag {drag:g}, {mass_text(component.mass_kg)}) permits a wind speed of "
        f"{permitted:.1f} m/s; at the site's {wind:g} m/s the wind force is {force_kn:.1f} kN"
    )


def _by_hooks(crane: TowerCrane, component: Component) -> str | None:
    return no_second_hook(crane) if component.flip_rise_vox and crane.auxiliary is None else None


def _by_reach(site: Site, crane: TowerCrane, component: Component) -> str | None:
    radius = place_radius_m(site, crane, component)
    if crane.min_radius_m - _SLACK_M <= radius <= crane.jib_length_m + _SLACK_M:
        return None
    return (
        f"its place is at a radius of {radius:.1f} m, but the hook of {crane.name} reaches from "
        f"{crane.min_radius_m:.1f} to {crane.jib_length_m:.1f} m"
    )


def _by_radius(site: Site, crane: TowerCrane, component: Component) -> str | None:
    radius = place_radius_m(site, crane, component)
    if (out := _by_reach(site, crane, component)) is not None:
        return out
    most_used = permitted_share(site, crane, component)
    crane = crane_towards(site, crane, component, component.target_vox)
    _, furthest = allowed_radii_m(crane_for(site, crane, component), component.mass_kg, most_used)
    if radius <= furthest + _SLACK_M:
        return None
    mass_kg = hung_kg(crane, component)
    up_to = f"only up to {furthest:.1f} m" if furthest > 0.0 else "at no radius"
    carries_kg = capacity_kg(crane.chart, radius)
    where = f"governing radius {radius:.1f} m, at its place: {mass_text(mass_kg)} with rigging and hook block"
    if mass_kg <= carries_kg:
        return (
            f"{where}, {100.0 * mass_kg / carries_kg:.1f} % of the capacity of {crane.name} on {crane.falls} falls; "
            f"[rules] highest_utilisation permits {100.0 * most_used:g} %, {up_to}"
        )
    return (
        f"{where}, but there {crane.name} on {crane.falls} falls carries {mass_text(carries_kg)}; "
        f"it carries that mass {up_to}"
    )


def could_lift(site: Site, part: Component, place: YardPlace, number: int) -> bool:
    """Return whether a crane could lift a part from its place in the yard with the slings that were chosen for it."""
    crane, given = site.cranes[number], replace(part, crane=number)
    if crane.sling_m != site.cranes[part.crane].sling_m or refused_by_crane(site, given) is not None:
        return False
    share = permitted_share(site, crane, given)
    picked = crane_towards(site, crane, part, place.transit_start_vox)
    low_m, high_m = allowed_radii_m(crane_for(site, picked, part), part.mass_kg, share)
    return low_m <= hook_radius_m(site, crane, part, place.transit_start_vox) <= high_m
