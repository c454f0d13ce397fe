"""Lifting points of a part, its gear, and the height of the hook above it.

The hook is above the centre of mass, because a hanging load turns until it is. The slings go to the part's lifting
anchors if the model has them. If the site file describes the crane's rigging, every other part hangs on it by one point
on its top above the centre of mass; otherwise gear is chosen for each part, with assumed points.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from math import atan2, ceil, hypot, inf, tan

import numpy as np
import shapely
from numpy.typing import NDArray

from bimvox.bim.building import Element, TriangleMesh
from bimvox.crane.choose_rig import NoGearError, choose_rig
from bimvox.crane.gear import Gear, GearKind
from bimvox.crane.kinematics import rigged
from bimvox.crane.load_chart import capacity_kg, permitted_wind_m_s
from bimvox.crane.sectors import towards
from bimvox.crane.tower_crane import TowerCrane
from bimvox.grid.frame import GridFrame
from bimvox.kept import kept
from bimvox.site.component import Component, IntVec, Lifting
from bimvox.site.site import Rules, Site
from bimvox.site.work import Work, work_of

# Lifting points of a part whose model has none, or whose anchors are not where a sling can use them.
#
# All of it is assumed: a part's designer decides where its anchors are. A long part hangs on two points on its long
# axis, a wide one on four, each halfway between the centre of mass and the end; a small one, and one that is upended,
# on one point above the centre of mass.

Point = tuple[float, float, float]

SMALL_M = 1.0
"""A part that is nowhere longer on plan hangs on one point."""
NARROW_M = 0.8
"""A part that is no wider on plan hangs on points in one line."""
_AROUND_M = 0.25
"""Anchors hold a part level if its centre of mass is between them, or no further outside than this."""
MOST_POINTS = 4


@kept
def assumed_points(
    mesh: TriangleMesh, hook_m: tuple[float, float], top_m: float, *, upended: bool
) -> tuple[Point, ...]:
    """Return lifting points on the top of a part, metres in its frame: one, two or four.

    Args:
        mesh: Its triangles, in the orientation in which it hangs.
        hook_m: (x, y) of its centre of mass.
        top_m: Height of its top, where no triangle is below a point.
        upended: Whether it hangs on its end.
    """
    corners = _plan_box(mesh)
    one, two = corners[1] - corners[0], corners[3] - corners[0]
    long, wide = (one, two) if np.hypot(*one) >= np.hypot(*two) else (two, one)
    length_m, width_m = float(np.hypot(*long)), float(np.hypot(*wide))
    if upended or length_m <= SMALL_M:
        return ((*hook_m, top_m),)
    hook = np.array(hook_m)
    along = long / length_m * _halfway_m(corners, hook, long / length_m)
    places = [hook - along, hook + along]
    if width_m > NARROW_M:
        across = wide / width_m * _halfway_m(corners, hook, wide / width_m)
        places = [place + side for place in places for side in (-across, across)]
    return tuple((float(x), float(y), _top_at_m(mesh, (float(x), float(y)), top_m)) for x, y in places)


def usable_anchors(anchors_m: Sequence[Point], hook_m: tuple[float, float]) -> tuple[Point, ...]:
    """Return the anchors on which a part can hang level: at most the four outermost; empty if there are none."""
    points = tuple(dict.fromkeys(anchors_m))
    if len(points) > MOST_POINTS:
        off = np.array(points)[:, :2] - np.array(hook_m)
        outermost = [int(np.argmax(off @ side)) for side in np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]], float)]
        points = tuple(points[n] for n in sorted(set(outermost)))
    if not points:
        return ()
    hull = shapely.MultiPoint([point[:2] for point in points]).convex_hull
    return points if hull.distance(shapely.Point(hook_m)) <= _AROUND_M else ()


def _plan_box(mesh: TriangleMesh) -> NDArray[np.float64]:
    """Return the (4, 2) corners of the smallest box around a part on plan."""
    low, high = mesh.bounds_m
    outline = shapely.MultiPoint(mesh.vertices_m[:, :2]).convex_hull
    if outline.geom_type != "Polygon":
        return np.array([[low[0], low[1]], [high[0], low[1]], [high[0], high[1]], [low[0], high[1]]])
    square = np.array([[low[0], low[1]], [high[0], low[1]], [high[0], high[1]], [low[0], high[1]]])
    if outline.area >= (1.0 - 1e-6) * float(np.prod(high[:2] - low[:2])):
        return square
    return np.asarray(shapely.minimum_rotated_rectangle(outline).exterior.coords)[:4]


def _halfway_m(corners: NDArray[np.float64], hook: NDArray[np.float64], axis: NDArray[np.float64]) -> float:
    """Return half the distance from the hook to the nearer end of the box along an axis."""
    ends = (corners - hook) @ axis
    return max(0.0, min(-float(ends.min()), float(ends.max()))) / 2.0


def _top_at_m(mesh: TriangleMesh, at_m: tuple[float, float], otherwise_m: float) -> float:
    """Return the height of a part's surface at a point on plan."""
    a, b, c = (mesh.vertices_m[mesh.faces[:, n]] for n in range(3))
    det = (b[:, 1] - c[:, 1]) * (a[:, 0] - c[:, 0]) + (c[:, 0] - b[:, 0]) * (a[:, 1] - c[:, 1])
    with np.errstate(divide="ignore", invalid="ignore"):
        x, y = at_m[0] - c[:, 0], at_m[1] - c[:, 1]
        u = ((b[:, 1] - c[:, 1]) * x + (c[:, 0] - b[:, 0]) * y) / det
        v = ((c[:, 1] - a[:, 1]) * x + (a[:, 0] - c[:, 0]) * y) / det
        inside = (np.abs(det) > 1e-12) & (u >= -1e-9) & (v >= -1e-9) & (u + v <= 1.0 + 1e-9)
        heights = (u * a[:, 2] + v * b[:, 2] + (1.0 - u - v) * c[:, 2])[inside]
    return float(heights.max()) if len(heights) else otherwise_m


_ANCHORS = "anchors"
_ABOVE = "centre_of_mass"
_ASSUMED = "assumed"


def crane_for(site: Site, crane: TowerCrane, component: Component | None) -> TowerCrane:
    """Return the crane as rigged for a component, or for the empty hook (None).

    The empty hook has the usual slings: longer ones are hooked back into their ring.
    """
    if component is None:
        return rigged(crane, 0.0)
    rig = component.lifting.rig
    rise_m = component.lifting.sling_rise_vox * site.frame.voxel_size_m
    return rigged(crane, component.mass_kg, rise_m, None if rig is None else rig.mass_kg)


def hung_kg(crane: TowerCrane, component: Component) -> float:
    """Return what the load chart carries with a component: what is hoisted, and the block of a second hook."""
    return hoisted_kg(crane, component) + crane.second_block_kg


def hoisted_kg(crane: TowerCrane, component: Component) -> float:
    """Return what hangs on a crane's rope with a component: load, its rigging and hook block."""
    rig = component.lifting.rig
    return component.mass_kg + crane.hook_block_kg + (crane.rigging_mass_kg if rig is None else rig.mass_kg)


HOOK_BLOCK_SHARE = 0.03
"""Mass of a hook block that the site file does not give, as a share of the largest capacity: as in the catalogue, on
two falls (professional judgement)."""


def masses_on_rope_kg(rigged: TowerCrane, component: Component) -> tuple[float, float]:
    """Return what swings at the hook, and what below it: hook block and part, each with half of the gear.

    ``rigged``: the crane as rigged for the component.
    """
    block_kg = rigged.hook_block_kg or HOOK_BLOCK_SHARE * max(rigged.chart.capacity_kg)
    half_kg = 0.5 * rigged.rigging_mass_kg
    return block_kg + half_kg, component.mass_kg + half_kg


@dataclass(frozen=True, slots=True)
class HangsAt:
    """Where a part hangs, and what limits its slings.

    Attributes:
        hook_m: (x, y) of the hook.
        top_m: Height of the part's top, rounded up to whole cells; slings are measured from it.
        sling_m: Height of the usual slings above it; infinite without a crane.
        angle_rad: Largest angle between two legs.
        step_m: The hook is raised by whole multiples of this length.
    """

    hook_m: tuple[float, float]
    top_m: float
    sling_m: float
    angle_rad: float
    step_m: float


def lifting_of(element: Element, at: HangsAt) -> Lifting:
    """Return the lifting points of a part on the crane's usual rigging, and how much higher the hook must be for them.

    Two opposite legs with ``angle_rad`` between them lean by half of it each: a leg to an anchor at distance d from the
    hook's vertical needs a height of ``d / tan(angle_rad / 2)``.

    ``at``: where it hangs.
    """
    points = element.lifting_points_m
    if not points:
        return Lifting(((*at.hook_m, at.top_m),), _ABOVE, 0)
    slope = tan(at.angle_rad / 2.0)
    needed_m = max(z + hypot(x - at.hook_m[0], y - at.hook_m[1]) / slope for x, y, z in points)
    rise = max(0, ceil((needed_m - at.top_m - at.sling_m) / at.step_m - 1e-9)) if at.sling_m < inf else 0
    return Lifting(points, _ANCHORS, rise)


def lifting_by(gear: Gear, element: Element, at: HangsAt, *, upended: bool) -> Lifting:
    """Return the lifting points of a part with the gear chosen for them.

    ``at``: where it hangs; with a crane; ``upended``: whether it hangs on its end.
    """
    anchors = usable_anchors(element.lifting_points_m, at.hook_m)
    points = anchors or assumed_points(element.mesh, at.hook_m, at.top_m, upended=upended)
    by = GearKind.ROUND_SLING if not anchors and work_of(element) is Work.STEEL else GearKind.SHACKLE
    try:
        rig = choose_rig(
            element.mass_kg,
            [(x - at.hook_m[0], y - at.hook_m[1], z - at.top_m) for x, y, z in points],
            usual_m=at.sling_m,
            step_m=at.step_m,
            most_angle_rad=at.angle_rad / 2.0,
            attached_by=by,
            gear=gear,
        )
    except NoGearError as error:
        return replace(lifting_of(element, at), no_gear=str(error))
    rise = round((rig.height_m - at.sling_m) / at.step_m)
    return Lifting(points, _ANCHORS if anchors else _ASSUMED, rise, rig)


def hung(
    component: Component,
    element: Element,
    crane: TowerCrane | None,
    angle_rad: float,
    frame: GridFrame,
    gear: Gear | None = None,
) -> Component:
    """Return a component with its lifting points and slings.

    Args:
        component: The component of the element.
        element: In the site frame.
        crane: The crane; without one the slings are not raised.
        angle_rad: Largest angle between two legs of a sling.
        frame: Frame of the grid.
        gear: What its rig is chosen from; None: it hangs on the crane's usual rigging.
    """
    x, y, z = np.array(component.target_vox) + np.array(component.hook_line_vox)
    hook = frame.corner_of([x + 0.5, y + 0.5, z])
    sling_m = np.inf if crane is None else crane.sling_m
    at = HangsAt((float(hook[0]), float(hook[1])), float(hook[2]), sling_m, angle_rad, frame.voxel_size_m)
    if gear is None or crane is None:
        return replace(component, lifting=lifting_of(element, at))
    return replace(component, lifting=lifting_by(gear, element, at, upended=component.erected))


@dataclass(frozen=True, slots=True)
class GoverningWind:
    """The smallest wind in which every lift is permitted.

    Attributes:
        speed_m_s: It (gust of 3 s at jib height).
        component: Id of the part that governs; None if the crane's own limit does.
        name: Name of that part, or of the crane.
    """

    speed_m_s: float
    component: str | None
    name: str


def place_radius_m(site: Site, crane: TowerCrane, component: Component) -> float:
    """Return the radius of the hook when a part is set."""
    return hook_radius_m(site, crane, component, component.target_vox)


def hook_radius_m(site: Site, crane: TowerCrane, component: Component, cell_vox: IntVec) -> float:
    """Return the radius of the hook when a part, in its final orientation, is at a cell."""
    return hypot(*_from_axis_m(site, crane, component, cell_vox))


def _from_axis_m(site: Site, crane: TowerCrane, component: Component, cell_vox: IntVec) -> tuple[float, float]:
    """Return where the hook is on plan, from the slewing axis, when a part is at a cell."""
    x, y = (cell_vox[axis] + component.hook_line_vox[axis] + 0.5 for axis in (0, 1))
    at = site.frame.corner_of([x, y, 0])
    return float(at[0]) - crane.base_m[0], float(at[1]) - crane.base_m[1]


def crane_towards(site: Site, crane: TowerCrane, component: Component, cell_vox: IntVec) -> TowerCrane:
    """Return a crane with the chart that holds where a part, in its final orientation, is at a cell."""
    dx, dy = _from_axis_m(site, crane, component, cell_vox)
    return towards(crane, atan2(dy, dx))


_SHARE_SLACK = 1e-9


def shares_to_try(rules: Rules) -> tuple[float | None, ...]:
    """Return the shares of the load chart to try, as in ``hook_room``: the usual one, then all if that gives way."""
    return (None, 1.0) if "highest_utilisation" in rules.gives_way else (None,)


def permitted_share(site: Site, crane: TowerCrane, component: Component, picked_vox: IntVec | None = None) -> float:
    """Return the share of the load chart that a crane may use for a part.

    It is that of the rules. Where that is a default, it is no less than what the part needs at its place, and where it
    is picked (``picked_vox``, its cell there).
    """
    most = site.rules.highest_utilisation
    if "highest_utilisation" not in site.rules.gives_way:
        return most
    carries_kg = min(
        capacity_kg(crane_towards(site, crane, component, cell).chart, hook_radius_m(site, crane, component, cell))
        for cell in (component.target_vox, picked_vox)
        if cell is not None
    )
    needed = hung_kg(crane, component) / carries_kg if carries_kg > 0.0 else 1.0
    return max(most, min(1.0, needed + _SHARE_SLACK))


def permitted_for(site: Site, crane: TowerCrane, component: Component) -> float:
    """Return the wind up to which a crane may lift a part, m/s."""
    return permitted_wind_m_s(
        crane.max_wind_m_s, hoisted_kg(crane, component), component.sail_area_m2, site.rules.drag_coefficient
    )


def needs_less_wind(site: Site, component: Component, limit_m_s: float | None = None) -> bool:
    """Return whether a part may be lifted only in less wind than the rules ask for, where these give way.

    ``limit_m_s``: the wind in which its motion permits it; None: what crane and sail area permit.
    """
    crane = site.crane_of(component)
    if crane is None or "wind_speed_m_s" not in site.rules.gives_way:
        return False
    permitted_m_s = permitted_for(site, crane, component) if limit_m_s is None else limit_m_s
    return permitted_m_s < min(site.rules.wind_speed_m_s, crane.max_wind_m_s)


def asked_wind_m_s(rules: Rules) -> float:
    """Return the wind in which the site file asks for every lift: the rules that do not give way; 0 for none."""
    asked = ("wind_speed_m_s", "least_wind_m_s")
    return max((getattr(rules, rule) for rule in asked if rule not in rules.gives_way), default=0.0)


def is_below_least_wind(site: Site, component: Component, limit_m_s: float | None = None) -> bool:
    """Return whether a part may be lifted only in less wind than any lift should need, where that gives way.

    Not if the site has no wind (``rules.wind_speed_m_s`` is 0), and not for the limit of the crane itself.
    ``limit_m_s``: as for ``needs_less_wind``.
    """
    crane, rules = site.crane_of(component), site.rules
    if crane is None or rules.wind_speed_m_s == 0.0 or "least_wind_m_s" not in rules.gives_way:
        return False
    permitted_m_s = permitted_for(site, crane, component) if limit_m_s is None else limit_m_s
    return permitted_m_s < min(rules.least_wind_m_s, crane.max_wind_m_s)


LEAST_SECTOR_DEG = 20
"""Wind that turns by less to either side is usual within minutes (professional judgement)."""


def edge_on_deg(site: Site, component: Component) -> int | None:
    """Return how far, to either side of a part's narrow side, wind of the least speed may come from.

    Tag lines turn that side to the wind, and never hold a load against it (SEAA, "Controlling Loads with Taglines").
    None if there is no such sector, or it is too small to rely on
    (``LEAST_SECTOR_DEG``), or the part is upended, which turns other sides to the wind.
    """
    from bimvox.site.parts import sail_areas_m2  # takes long to import, and few plans need it

    crane, least_m_s = site.crane_of(component), site.rules.least_wind_m_s
    if crane is None or component.erected or least_m_s <= 0.0:
        return None
    areas_m2 = sail_areas_m2(component.mesh.triangles_m, component.mesh.vertices_m)
    hung, drag = hoisted_kg(crane, component), site.rules.drag_coefficient
    good = [permitted_wind_m_s(crane.max_wind_m_s, hung, area, drag) >= least_m_s for area in areas_m2.tolist()]
    if all(good) or not any(good):
        return None
    count, narrow = len(good), int(areas_m2.argmin())
    aside = next(n for n in range(count) if not (good[(narrow + n) % count] and good[(narrow - n) % count])) - 1
    sector_deg = aside * 180 // count
    return sector_deg if sector_deg >= LEAST_SECTOR_DEG else None


def governing_wind(
    site: Site, lifted: Iterable[Component], limits: Mapping[int, float] | None = None
) -> GoverningWind | None:
    """Return the smallest wind in which these parts may be lifted; None without a crane or parts.

    ``limits``: the wind up to which a lift is permitted, by component, if its motion says that.
    """
    least: GoverningWind | None = None
    for component in lifted:
        if (crane := site.crane_of(component)) is None:
            return None
        speed_m_s = (limits or {}).get(component.index, permitted_for(site, crane, component))
        if least is None or speed_m_s < least.speed_m_s:
            by_part = speed_m_s < crane.max_wind_m_s
            name = (component.name or component.id) if by_part else crane.name
            least = GoverningWind(speed_m_s, component.id if by_part else None, name)
    return least
