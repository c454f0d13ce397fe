"""A stage of a load that turns with the jib, and is turned to its final heading straight above its place."""

from __future__ import annotations

from dataclasses import replace
from math import ceil

import numpy as np

from bimvox.planning.insertion import Insertion
from bimvox.planning.stage import Stage
from bimvox.site.collision import CollisionSpace, placement_is_free
from bimvox.site.component import IntVec
from bimvox.site.site import Site
from bimvox.site.transit_clearance import margin_vox
from bimvox.site.turning import turning_space

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
