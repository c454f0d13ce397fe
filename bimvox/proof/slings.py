"""The proof that a part hangs on points of its own, by slings as long as the rules ask for."""

from __future__ import annotations

from math import ceil, hypot, tan

import numpy as np

from bimvox.records.proof import Check
from bimvox.site.component import Component
from bimvox.site.site import Site

NEAR_M = 0.5
"""A lifting point is no further outside the box around its part than this and one cell."""
_ROUNDING_M = 1e-6
_SAME_M = 1e-3
_ANCHORS = "anchors"
"""The points are of the model."""
_ASSUMED = "assumed"
"""The points were chosen with the gear."""
_ABOVE = "centre_of_mass"
"""The model has no points: it hangs on one, on its top above its centre of mass."""


def check_slings(check: Check, site: Site, component: Component) -> None:
    """Check that lifting points lie on or near their part, and that its hook hangs as high as they need it."""
    points_m, rise = component.lifting.points_m, component.lifting.sling_rise_vox
    size_m, crane = site.frame.voxel_size_m, site.crane_of(component)
    low, high = component.mesh.bounds_m
    for point_m in points_m:
        off_m = float(np.maximum(low - point_m, point_m - high).max())
        at = ", ".join(f"{value:.3f}" for value in point_m)
        check.measure(max(off_m, 0.0))
        check.look(
            off_m <= NEAR_M + size_m, f"{component.id}: its lifting point ({at}) m is {off_m:.2f} m away from it"
        )
    wanted = fewest = 0
    cell = np.array(component.target_vox) + np.array(component.hook_line_vox) + (0.5, 0.5, 0.0)
    x, y, top_m = site.frame.corner_of(cell).tolist()
    source = component.lifting.source
    if source == _ABOVE:
        off_m = max((float(np.abs(np.subtract(point_m, (x, y, top_m))).max()) for point_m in points_m), default=0.0)
        good = len(points_m) <= 1 and off_m <= _SAME_M
        check.look(good, f"{component.id}: its lifting point is {off_m:.3f} m from its top above its centre of mass")
    else:
        good = source in ((_ANCHORS,) if component.lifting.rig is None else (_ANCHORS, _ASSUMED)) and len(points_m) > 0
        check.look(good, f"{component.id}: it hangs on {len(points_m)} points of the kind {source!r}")
    if source == _ANCHORS and crane is not None and points_m:
        slope = tan(site.rules.sling_angle_rad / 2.0)
        highest_m = max(point[2] + hypot(point[0] - x, point[1] - y) / slope for point in points_m)
        missing_m = highest_m - top_m - crane.sling_m
        wanted, fewest = (max(0, ceil((missing_m + off_m) / size_m)) for off_m in (_ROUNDING_M, -_ROUNDING_M))
    if component.lifting.rig is not None:
        return  # its height follows from its gear: see ``rigging``
    check.look(
        fewest <= rise <= wanted,
        f"{component.id}: its slings raise the hook by {rise} cells; its lifting points need {fewest}",
    )
