"""Lifting points of a part, and the height of the hook above it.

The hook is above the centre of mass, because a hanging load turns until it is. The slings go to the part's lifting
anchors if the model has them, otherwise to one point on its top above the centre of mass.
"""

from __future__ import annotations

from dataclasses import replace
from math import ceil, hypot, inf, tan

import numpy as np

from bimvox.bim.building import Element
from bimvox.crane.rigging import rigged
from bimvox.crane.tower_crane import TowerCrane
from bimvox.grid.frame import GridFrame
from bimvox.site.component import Component, Lifting
from bimvox.site.site import Site

Point = tuple[float, float, float]
_ANCHORS = "anchors"
_ABOVE = "centre_of_mass"


def crane_for(site: Site, crane: TowerCrane, component: Component | None) -> TowerCrane:
    """Return the crane as rigged for a component, or for the empty hook (None).

    The empty hook has the usual slings: longer ones are hooked back into their ring.
    """
    if component is None:
        return rigged(crane, 0.0)
    return rigged(crane, component.mass_kg, component.lifting.sling_rise_vox * site.frame.voxel_size_m)


def lifting_of(
    element: Element, hook_m: tuple[float, float], top_m: float, sling_m: float, angle_rad: float, step_m: float
) -> Lifting:
    """Return the lifting points of a part, and how much higher than usual the hook must be for them.

    Two opposite legs with ``angle_rad`` between them lean by half of it each: a leg to an anchor at distance d from the
    hook's vertical needs a height of ``d / tan(angle_rad / 2)``.

    Args:
        element: The part in the site frame.
        hook_m: (x, y) of the hook.
        top_m: Height of the part's top, rounded up to whole cells; the usual slings are measured from it.
        sling_m: Height of the usual slings above it.
        angle_rad: Largest angle between two legs.
        step_m: The hook is raised by whole multiples of this length.
    """
    points = element.lifting_points_m
    if not points:
        return Lifting(((*hook_m, top_m),), _ABOVE, 0)
    needed_m = max(z + hypot(x - hook_m[0], y - hook_m[1]) / tan(angle_rad / 2.0) for x, y, z in points)
    rise = max(0, ceil((needed_m - top_m - sling_m) / step_m - 1e-9)) if sling_m < inf else 0
    return Lifting(points, _ANCHORS, rise)


def hung(
    component: Component, element: Element, crane: TowerCrane | None, angle_rad: float, frame: GridFrame
) -> Component:
    """Return a component with its lifting points and slings.

    Args:
        component: The component of the element.
        element: In the site frame.
        crane: The crane; without one the slings are not raised.
        angle_rad: Largest angle between two legs of a sling.
        frame: Frame of the grid.
    """
    x, y, z = np.array(component.target_vox) + np.array(component.hook_line_vox)
    hook = frame.corner_of([x + 0.5, y + 0.5, z])
    sling_m = np.inf if crane is None else crane.sling_m
    at, top_m = (float(hook[0]), float(hook[1])), float(hook[2])
    return replace(component, lifting=lifting_of(element, at, top_m, sling_m, angle_rad, frame.voxel_size_m))
