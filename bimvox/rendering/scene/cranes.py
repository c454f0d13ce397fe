"""All cranes of a site as lines and boxes, each in its own pose."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from bimvox.crane.tower_crane import CranePose, TowerCrane, tip_height_m
from bimvox.records.motion import LiftMotion
from bimvox.rendering.scene.crane_parts import crane_parts
from bimvox.rendering.scene.lattice import CraneParts
from bimvox.site.site import Site


def site_cranes(
    site: Site,
    poses: Mapping[int, CranePose | None] | None = None,
    loads_m: Mapping[int, NDArray[np.float64] | None] | None = None,
) -> CraneParts:
    """Return the lines and boxes of all cranes of a site.

    Poses and loads ((N, 3) lifting points) are given by the crane's index; other cranes are parked, other hooks empty.
    """
    poses, loads_m = poses or {}, loads_m or {}
    parts = [
        crane_parts(crane, poses.get(number) or parked_pose(site, crane), loads_m.get(number))
        for number, crane in enumerate(site.cranes)
    ]
    if len(parts) == 1:
        return parts[0]
    return CraneParts(
        tuple(stroke for part in parts for stroke in part.strokes),
        tuple(block for part in parts for block in part.blocks),
        np.concatenate([np.zeros((0, 3)), *(part.points_m for part in parts)]),
    )


def poses_at(site: Site, motions: Sequence[LiftMotion], time_ns: int) -> dict[int, CranePose]:
    """Return every crane's pose at a time; a crane rests where its last motion ends."""
    poses = {}
    for number in range(len(site.cranes)):
        own = [motion for motion in motions if motion.crane == number]
        begun = [motion for motion in own if motion.start_ns <= time_ns]
        if own:
            motion = max(begun, key=lambda motion: motion.start_ns) if begun else own[0]
            at_ns, axes = motion.samples()
            slew, radius, height = (float(np.interp(time_ns, at_ns, axis)) for axis in axes.T)
            poses[number] = CranePose(slew, radius, height)
    return poses


def parked_pose(site: Site, crane: TowerCrane) -> CranePose:
    """Return the pose of an idle crane: the jib over the building, the hook up."""
    middle = building_centre_m(site)
    dx, dy = middle[0] - crane.base_m[0], middle[1] - crane.base_m[1]
    radius = min(max(math.hypot(dx, dy), crane.min_radius_m), crane.jib_length_m)
    height = crane.jib_height_m - 2.0 * crane.mast_size_m
    if crane.luffing is not None:
        height = float(tip_height_m(crane.luffing, np.array([radius]))[0]) - 3.0
    return CranePose(math.atan2(dy, dx), radius, height)


def building_centre_m(site: Site) -> NDArray[np.float64]:
    """Return the middle of all targets, metres: (3,)."""
    centres = [np.array(c.target_vox) + np.array(c.shape.size_vox) / 2.0 for c in site.components]
    middle: NDArray[np.float64] = site.frame.corner_of(np.mean(centres, axis=0))
    return middle
