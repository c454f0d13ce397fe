"""The share of each of two cranes that carry a part together, along its path."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bimvox.crane.sectors import utilisations
from bimvox.records.lift import Lift
from bimvox.records.tandem import SharedLoad
from bimvox.site.lifting import hung_kg
from bimvox.site.site import Site
from bimvox.site.tandem import apart_m, halves, level_kg, tandem_rules


def with_shares(site: Site, lift: Lift) -> Lift:
    """Return a planned lift with the share of each of its two cranes; the lift itself if one crane carries it."""
    component = site.components[lift.component]
    if component.tandem is None or lift.path_vox is None:
        return lift
    both, used, radius_m = halves(site, component), [], []
    for half in both:
        crane = site.cranes[half.crane]
        line_vox = lift.path_vox[:, :2] + np.array(half.hook_line_vox[:2]) + 0.5
        over_m = np.array(site.frame.origin_m[:2]) + site.frame.voxel_size_m * line_vox - np.array(crane.base_m[:2])
        radii_m, slew_rad = np.hypot(*over_m.T), np.arctan2(over_m[:, 1], over_m[:, 0])
        used.append(float(utilisations(crane, slew_rad, radii_m, hung_kg(crane, half)).max()))
        radius_m.append(float(radii_m.max()))
    shared = SharedLoad(
        cranes=(both[0].crane, both[1].crane),
        points_m=component.tandem.points_m,
        load_kg=level_kg(component),
        most_kg=(both[0].mass_kg, both[1].mass_kg),
        used=(used[0], used[1]),
        radius_m=(radius_m[0], radius_m[1]),
        apart_m=apart_m(component.tandem.points_m),
        off_level_rad=tandem_rules(site.rules).off_level_rad,
    )
    return replace(lift, tandem=shared)
