"""Lifting points of a part, its gear, and the height of the hook above it.

The hook is above the centre of mass, because a hanging load turns until it is. The slings go to the part's lifting
anchors if the model has them. If the site file describes the crane's rigging, every other part hangs on it by one point
on its top above the centre of mass; otherwise gear is chosen for each part, with assumed points.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import ceil, hypot, inf, tan

import numpy as np

from bimvox.bim.building import Element
from bimvox.crane.choose_rig import NoGearError, choose_rig
from bimvox.crane.gear import Gear, GearKind
from bimvox.crane.kinematics import rigged
from bimvox.crane.tower_crane import TowerCrane
from bimvox.grid.frame import GridFrame
from bimvox.site.component import Component, Lifting
from bimvox.site.lifting_points import assumed_points, usable_anchors
from bimvox.site.site import Site
from bimvox.site.work import Work, work_of

Point = tuple[float, float, float]
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
    """Return what hangs on a crane's rope with a component: load, its rigging and hook block."""
    rig = component.lifting.rig
    return component.mass_kg + crane.hook_block_kg + (crane.rigging_mass_kg if rig is None else rig.mass_kg)


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

    Args:
        element: The part in the site frame.
        at: Where it hangs.
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

    Args:
        gear: The gear to choose from.
        element: The part in the site frame.
        at: Where it hangs; with a crane.
        upended: Whether it hangs on its end.
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
