"""A part that two cranes carry together: which two could, the share of each by statics, and how each crane sees it.

Both ropes hang straight down, so the moments about a lifting point balance: with the centre of mass at ``a`` from the
first point and ``b`` from the second one, the first hook carries ``b / (a + b)`` of the mass. If the load hangs out of
level by an angle, its centre of mass, which is ``h`` below the points, moves towards the lower one: that hook carries
``h tan(angle) / (a + b)`` more.

The load is moved without turning, so each crane sees a part of the same shape that hangs on its own hook alone, at
another point and with its share of the mass: a half. What is known about one hook then holds for each of the two.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import permutations
from math import floor, tan

import numpy as np
from numpy.typing import NDArray

from bimvox.crane.conflict import (
    COLUMNS,
    HOOK_HIGH,
    HOOK_LOW,
    LOAD_HALF,
    LOWEST,
    RADIUS_HIGH,
    RADIUS_LOW,
    ROPE_HALF,
    SLEW_HIGH,
    SLEW_LOW,
    each_clear,
    numbers_of,
)
from bimvox.crane.load_chart import capacity_kg
from bimvox.crane.outline import outline_of
from bimvox.crane.sectors import towards
from bimvox.crane.tower_crane import TowerCrane
from bimvox.grid.frame import GridFrame
from bimvox.kept import kept
from bimvox.site.component import Component, Lifting, Tandem
from bimvox.site.default_rules import TandemRules
from bimvox.site.parts import centre_of_mass_m
from bimvox.site.site import Rules, Site

_FROM_END = 0.2
"""Where each crane holds the part, as a share of its length from the end: about where a beam bends least."""
_NEAR_END = 0.05
_ROOM_M = 2.0
"""Two hook blocks of 1 m, which come to a part one after the other, keep the separation of the cranes and may brake."""
_SAME_USE = 1e-3
ROPE_HALF_M = 0.1
"""Half the width of a rope whose load two cranes share: the hooks cannot come nearer to each other than the load is."""
_BRAKING_M = 0.5
"""Added to the separation of the cranes where a path is looked for: so far a jib may go on while it brakes."""
_USUAL = TandemRules()
HELD = "tandem"
"""The ``source`` of the lifting points of a part that two cranes hold."""


@dataclass(frozen=True, slots=True)
class Pair:
    """Two cranes that hold a part at its place.

    Attributes:
        cranes: Indices in ``Site.cranes``.
        tandem: The second of them, and where each holds the part.
        load_kg: Share of the part's mass on each while it hangs level.
        used: Share of the load chart of each, rigging and hook block included, with the part out of level.
        radius_m: Radius of each hook.
        apart_m: Distance of the hooks.
    """

    cranes: tuple[int, int]
    tandem: Tandem
    load_kg: tuple[float, float]
    used: tuple[float, float]
    radius_m: tuple[float, float]
    apart_m: float


def pairs_for(site: Site, component: Component) -> list[Pair]:
    """Return the pairs of cranes that hold a part at its place, those first that use the least of their load charts.

    Each holds it at a point near one of its ends. Its place in the yard is not looked at, nor the way between.
    """
    points_m, found = _points(component, site.rules.crane_separation_m + _ROOM_M), list[Pair]()
    if points_m is None:
        return []
    for first, second in permutations(range(len(site.cranes)), 2):
        held = replace(component, crane=first, tandem=Tandem(second, points_m))
        ends = [
            _used(site.cranes[half.crane], np.array(point[:2]), half.mass_kg)
            for half, point in zip(halves(site, held), points_m, strict=True)
        ]
        used, radius_m = (ends[0][0], ends[1][0]), (ends[0][1], ends[1][1])
        if max(used) < np.inf:
            load_kg = level_kg(held)
            found.append(Pair((first, second), Tandem(second, points_m), load_kg, used, radius_m, apart_m(points_m)))
    return sorted(found, key=lambda one: (round(max(one.used) / _SAME_USE), sum(one.radius_m), one.cranes))


def level_kg(component: Component) -> tuple[float, float]:
    """Return the share of the mass of a part on each of the two hooks while it hangs level."""
    first, second = _arms_m(component)
    whole_m = first + second
    return float(component.mass_kg * second / whole_m), float(component.mass_kg * first / whole_m)


def most_kg(component: Component, off_level_rad: float) -> tuple[float, float]:
    """Return the largest share of the mass on each hook while the part hangs out of level by no more than an angle."""
    first_kg, second_kg = level_kg(component)
    assert component.tandem is not None
    points_m = component.tandem.points_m
    below_m = max(0.0, points_m[0][2] - float(_centre_m(component)[2]))
    more_kg = component.mass_kg * below_m * tan(off_level_rad) / apart_m(points_m)
    return first_kg + more_kg, second_kg + more_kg


def apart_m(points_m: Sequence[tuple[float, float, float]]) -> float:
    """Return the level distance of two points."""
    return float(np.hypot(*np.subtract(points_m[1], points_m[0])[:2]))


def halves(site: Site, component: Component) -> tuple[Component, Component]:
    """Return a part as each of its two cranes sees it, with the largest mass on its hook."""
    first, second = _halves(component, site.frame, site.rules)
    return first, second


@kept
def _halves(component: Component, frame: GridFrame, rules: Rules) -> list[Component]:
    tandem, given = component.tandem, tandem_rules(rules)
    assert tandem is not None
    masses_kg, cranes = most_kg(component, given.off_level_rad), (component.crane, tandem.second)
    corner_m = frame.corner_of(component.target_vox)
    result = []
    for crane, point_m, mass_kg, level in zip(cranes, tandem.points_m, masses_kg, level_kg(component), strict=True):
        x, y = ((point_m[axis] - float(corner_m[axis])) / frame.voxel_size_m for axis in (0, 1))
        cell = (floor(x + 1e-9), floor(y + 1e-9), component.hook_offset_vox[2])
        half = replace(
            component,
            crane=crane,
            tandem=None,
            mass_kg=mass_kg,
            hook_offset_vox=cell,
            hook_aside_vox=(round(x - 0.5 - cell[0], 9), round(y - 0.5 - cell[1], 9)),
            lifting=Lifting((point_m,), HELD),
            sail_area_m2=component.sail_area_m2 * level / component.mass_kg,
        )
        result.append(half)
    return result


def over_both(site: Site, component: Component, maps: Sequence[NDArray[np.int32]], outside: int) -> NDArray[np.int32]:
    """Return (2, X, Y) maps of the columns of both hooks, each moved to the hook line of the whole part.

    ``outside``: the value where a hook would be off the grid.
    """
    result = np.full((2, *maps[0].shape), outside, np.int32)
    for moved, own, half in zip(result, maps, halves(site, component), strict=True):
        to, come_from = [], []
        for axis in (0, 1):
            by, count = half.hook_offset_vox[axis] - component.hook_offset_vox[axis], own.shape[axis]
            to.append(slice(max(0, -by), min(count, count - by)))
            come_from.append(slice(max(0, by), min(count, count + by)))
        if all(one.start < one.stop for one in to):
            moved[tuple(to)] = own[tuple(come_from)]
    return result


def jibs_apart(site: Site, component: Component) -> NDArray[np.bool_]:
    """Return (X, Y) whether jibs and ropes of its two cranes keep apart with the hook line of a part above a column."""
    cranes = tuple(site.cranes[number] for number in cranes_of(component))
    return _jibs_apart(component, site.frame, site.shape[:2], cranes, site.rules.crane_separation_m, site.rules)


@kept
def _jibs_apart(
    component: Component,
    frame: GridFrame,
    columns: tuple[int, int],
    cranes: tuple[TowerCrane, ...],
    separation_m: float,
    rules: Rules,
) -> NDArray[np.bool_]:
    rows, outlines = [], [outline_of(crane) for crane in cranes]
    for crane, outline, half in zip(cranes, outlines, _halves(component, frame, rules), strict=True):
        line = np.subtract(half.hook_line_vox[:2], component.hook_offset_vox[:2]) + 0.5
        over_m = np.moveaxis(np.indices(columns), 0, -1).reshape(-1, 2) + line
        at_m = np.array(frame.origin_m[:2]) + frame.voxel_size_m * over_m - np.array(crane.base_m[:2])
        own = np.zeros((len(at_m), COLUMNS))
        own[:, SLEW_LOW] = own[:, SLEW_HIGH] = np.arctan2(at_m[:, 1], at_m[:, 0])
        own[:, RADIUS_LOW] = own[:, RADIUS_HIGH] = np.hypot(*at_m.T)
        own[:, [LOAD_HALF, ROPE_HALF]] = ROPE_HALF_M
        own[:, [LOWEST, HOOK_LOW]], own[:, HOOK_HIGH] = frame.origin_m[2], outline.rope_top_m
        rows.append(own)
    first, second = (numbers_of(outline) for outline in outlines)
    clear = each_clear(first, rows[0], second, rows[1], separation_m + _BRAKING_M)
    apart: NDArray[np.bool_] = clear.reshape(columns)
    apart.flags.writeable = False
    return apart


def tandem_rules(rules: Rules) -> TandemRules:
    """Return the rules for parts that two cranes carry; the usual ones where a site has none."""
    return rules.tandem or _USUAL


@kept
def seen_by(site: Site, number: int) -> Site:
    """Return a site as one of its cranes sees it: of parts that it carries with another one, its halves."""
    parts = tuple(
        next((half for half in halves(site, one) if half.crane == number), one) if one.tandem is not None else one
        for one in site.components
    )
    return replace(site, components=parts)


def part_on(site: Site, component: int, crane: int) -> Component:
    """Return a part as a crane sees it that carries it, alone or with another one."""
    part = site.components[component]
    return part if part.tandem is None else seen_by(site, crane).components[component]


def has_tandems(site: Site) -> bool:
    """Return whether two cranes carry a part of the site together."""
    return any(one.tandem is not None for one in site.components)


def cranes_of(component: Component) -> tuple[int, ...]:
    """Return the cranes that carry a part: one, or two."""
    return (component.crane,) if component.tandem is None else (component.crane, component.tandem.second)


def _points(
    component: Component, least_m: float
) -> tuple[tuple[float, float, float], tuple[float, float, float]] | None:
    """Return where two cranes hold a part, along its longest direction on plan; None if it has no such places.

    ``least_m``: how far apart they are at least, if the part is long enough.
    """
    plan_m, centre = component.mesh.vertices_m[:, :2], _centre_m(component)[:2]
    _, _, axes = np.linalg.svd(plan_m - plan_m.mean(axis=0), full_matrices=False)
    along = axes[0] * (1.0 if tuple(axes[0]) > (0.0, 0.0) else -1.0)
    at_m = (plan_m - centre) @ along
    length_m = float(np.ptp(at_m))
    inwards_m = min(_FROM_END * length_m, max(_NEAR_END * length_m, (length_m - least_m) / 2.0))
    ends = (float(at_m.min()) + inwards_m, float(at_m.max()) - inwards_m)
    if not ends[0] < 0.0 < ends[1]:
        return None
    top_m = float(component.mesh.bounds_m[1, 2])
    (x, y), (u, v) = (np.round(centre + end * along, 6).tolist() for end in ends)
    return (x, y, top_m), (u, v, top_m)


def _arms_m(component: Component) -> tuple[float, float]:
    """Return how far the centre of mass is from each lifting point, level."""
    assert component.tandem is not None
    first, second = (np.array(point[:2]) for point in component.tandem.points_m)
    along = (second - first) / max(float(np.hypot(*(second - first))), 1e-9)
    centre = _centre_m(component)[:2]
    return float((centre - first) @ along), float((second - centre) @ along)


def _centre_m(component: Component) -> NDArray[np.float64]:
    found = centre_of_mass_m(component.mesh)
    centre: NDArray[np.float64] = component.mesh.bounds_m.mean(axis=0) if found is None else found
    return centre


def _used(crane: TowerCrane, point_m: NDArray[np.float64], load_kg: float) -> tuple[float, float]:
    """Return the share of a crane's load chart with the hook above a point, and its radius; infinite out of reach."""
    dx, dy = point_m - np.array(crane.base_m[:2])
    radius_m = float(np.hypot(dx, dy))
    carries_kg = capacity_kg(towards(crane, float(np.arctan2(dy, dx))).chart, radius_m)
    if carries_kg <= 0.0 or not crane.min_radius_m <= radius_m <= crane.jib_length_m:
        return np.inf, radius_m
    return float((load_kg + crane.tackle_kg) / carries_kg), radius_m
