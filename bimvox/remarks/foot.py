"""Cranes that stand inside the building."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray
from shapely import MultiPoint, box

from bimvox.crane.outline import mast_box_m
from bimvox.grid.frame import GridFrame
from bimvox.records.remark import Remark, Severity
from bimvox.remarks.subject import Subject, name_of
from bimvox.site.site import Site

CRANE_FOOT = "crane_foot"
_LEVEL_M = 0.5


def crane_feet(subject: Subject) -> Iterator[Remark]:
    """Yield a remark about every crane whose mast goes through something, or stands in the building's outline."""
    site = subject.site
    for crane in site.cranes:
        low, high = np.array(mast_box_m(crane))
        met = [
            name_of(component)
            for component in subject.in_place
            if _meets(component.shape.boxes + np.tile(component.target_vox, 2), site.frame, low, high)
        ]
        for blocker in site.blockers:
            if blocker.kind in ("structure", "obstruction"):
                cells = np.concatenate([blocker.cells, blocker.cells + 1], axis=1)
                if _meets(cells, site.frame, low, high):
                    met.append(blocker.name or blocker.id)
        if met:
            more = f" and {len(met) - 1:,} more" if len(met) > 1 else ""
            said = f"the mast of crane {crane.name!r} goes through {met[0]}{more}"
            yield Remark(CRANE_FOOT, Severity.SERIOUS, said)
        elif abs(off_m := low[2] - _ground_m(site, low, high)) > _LEVEL_M:
            where = "above" if off_m > 0.0 else "below"
            said = (
                f"the foot of crane {crane.name!r} is {abs(off_m):.1f} m {where} the ground there: give its height, or "
            )
            yield Remark(CRANE_FOOT, Severity.SERIOUS, said + "move it clear of the excavation")
        elif _stands_in(subject, low, high):
            said = f"crane {crane.name!r} stands inside the outline of the building: its mast must stay until the end"
            yield Remark(CRANE_FOOT, Severity.MINOR, f"{said}, and its foundation must fit between the parts")


def _ground_m(site: Site, low: NDArray[np.float64], high: NDArray[np.float64]) -> float:
    """Return the height of the lowest ground under a mast; that of its foot outside the site."""
    first, last = np.clip(site.frame.cells_over(low, high), 0, site.shape)
    tops = site.ground_vox[first[0] : last[0], first[1] : last[1]]
    return site.frame.origin_m[2] + site.frame.voxel_size_m * (int(tops.min()) + 1) if tops.size else float(low[2])


def _meets(boxes_vox: NDArray[np.int32], frame: GridFrame, low: NDArray[np.float64], high: NDArray[np.float64]) -> bool:
    """Return whether any of (N, 6) boxes of cells reaches more than half a cell into a mast."""
    origin, size = np.array(frame.origin_m), frame.voxel_size_m
    first, last = origin + size * boxes_vox[:, :3], origin + size * boxes_vox[:, 3:]
    shared = np.minimum(last, high) - np.maximum(first, low)
    return bool((shared > size / 2.0).all(axis=1).any())


def _stands_in(subject: Subject, low: NDArray[np.float64], high: NDArray[np.float64]) -> bool:
    """Return whether a mast stands completely within the convex outline of the parts on plan."""
    bounds = [component.mesh.bounds_m[:, :2] for component in subject.in_place]
    if not bounds:
        return False
    corners = np.concatenate([[a, b, (a[0], b[1]), (b[0], a[1])] for a, b in bounds])
    return bool(MultiPoint(corners).convex_hull.contains(box(*low[:2], *high[:2])))
