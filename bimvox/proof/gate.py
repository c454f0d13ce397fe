"""Where the last moves of a lift begin, for the rules that hold until then: read from the site, not the plan."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bimvox.proof.marks import hits
from bimvox.proof.space import whole_cells
from bimvox.records.lift import Lift
from bimvox.site.component import Component
from bimvox.site.site import Site


def gate_of(
    site: Site, lift: Lift, component: Component, counts: NDArray[np.uint16], wide: NDArray[np.uint16] | None
) -> int:
    """Return the number of the placement at which the last moves begin.

    It is the one that the plan states. But if a later placement is above the part's place, with all clearances kept
    there and all the way up, the load is in transit until then: from there it could be raised out.

    Args:
        site: The site.
        lift: A lift with a path.
        component: Its part.
        counts: (X, Y, Z) how many things occupy each cell.
        wide: The same, the largest within the transit clearance; None if the rules ask for none.
    """
    path = lift.path_vox
    assert path is not None
    stated = max(0, len(path) - 1 - lift.contact_moves)
    clear_vox = _clear_from(site, lift, counts, wide)
    above = (path[:, :2] == np.array(component.target_vox[:2])).all(axis=1) & (path[:, 2] >= clear_vox)
    found = np.flatnonzero(above)
    return max(stated, int(found[-1])) if len(found) else stated


def _clear_from(site: Site, lift: Lift, counts: NDArray[np.uint16], wide: NDArray[np.uint16] | None) -> int:
    """Return the height from which a part is clear of everything above its place; above the site if it never is."""
    component = site.components[lift.component]
    margin, rope = (
        whole_cells(site.rules.kept_m(rule, lift.kept), site.frame)
        for rule in ("transit_clearance_m", "rope_clearance_m")
    )
    low, size, shape = np.array(component.target_vox), np.array(component.shape.size_vox), np.array(site.shape)
    heights = np.arange(low[2], shape[2] - size[2] - margin + 1)
    inside = (low[:2] >= margin).all() and (low[:2] + size[:2] + margin <= shape[:2]).all()
    if not inside or not len(heights):
        return site.shape[2]
    near = np.zeros(len(heights), np.bool_)
    if wide is not None:
        column = np.column_stack([np.full(len(heights), n) for n in low[:2]] + [heights]).astype(np.int64)
        near |= hits(wide, component.shape.cells, column)
    if site.cranes and site.rules.rope and rope > 0:
        x, y, z = (low + np.array(component.hook_offset_vox)).tolist()
        beside = counts[max(0, x - rope) : x + rope + 1, max(0, y - rope) : y + rope + 1].any(axis=(0, 1))
        highest = int(np.flatnonzero(beside).max(initial=-1))
        near |= z + (heights - low[2]) <= highest
    last = int(np.flatnonzero(near).max(initial=-1))
    return int(heights[last + 1]) if last + 1 < len(heights) else site.shape[2]
