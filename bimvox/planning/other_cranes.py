"""Which of several cranes could lift a part from its place in the yard."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bimvox.crane.reach import allowed_radii_m
from bimvox.planning.refusal import refused_by_crane
from bimvox.records.lift import YardPlace
from bimvox.site.component import Component
from bimvox.site.lifting import crane_for
from bimvox.site.site import Site


def could_lift(site: Site, part: Component, place: YardPlace, number: int) -> bool:
    """Return whether a crane could lift a part from its place in the yard with the slings that were chosen for it.

    Args:
        site: The site.
        part: The part.
        place: Its place.
        number: Number of the crane.
    """
    crane, given = site.cranes[number], replace(part, crane=number)
    if crane.sling_m != site.cranes[part.crane].sling_m or refused_by_crane(site, given) is not None:
        return False
    hook_vox = np.add(place.transit_start_vox, part.hook_line_vox)[:2] + 0.5
    at_m = site.frame.corner_of([*hook_vox.tolist(), 0.0])[:2]
    low_m, high_m = allowed_radii_m(crane_for(site, crane, part), part.mass_kg, site.rules.highest_utilisation)
    return bool(low_m <= np.hypot(*(at_m - np.array(crane.base_m[:2]))) <= high_m)
