"""The crane as lines and boxes attached to the joints that move them, derived from the drawing of a crane in a pose."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bimvox.crane.kinematics import hook_of
from bimvox.crane.machine import identity
from bimvox.crane.tower_crane import CranePose, LuffingJib, TowerCrane, luff_of_radius
from bimvox.rendering.page.blob import Blob
from bimvox.rendering.scene.crane_parts import crane_parts
from bimvox.rendering.scene.lattice import CraneParts

FIXED, SLEWING, TROLLEY, HOOK, LUFFING = range(5)
"""Joints that move a point: none; slewing; slewing and trolley; all three axes; slewing and luffing."""
_SAME_M = 1e-6


def crane_record(crane: TowerCrane, blob: Blob) -> dict[str, Any]:
    """Return the crane's numbers, and its lines and boxes with the joint of each point.

    Coordinates are in the joint's frame: relative to the foot of the slewing axis at z = 0, at slewing angle, radius
    and height 0; on a luffing jib relative to its pivot, x along the jib.
    """
    jib = crane.luffing
    rest = CranePose(0.0, 0.5 * crane.jib_length_m, 0.5 * crane.jib_height_m)
    poses = (
        rest,
        CranePose(0.7, rest.radius_m, rest.height_m),
        CranePose(0.0, 0.6 * crane.jib_length_m, rest.height_m),
        CranePose(0.0, rest.radius_m, 0.4 * crane.jib_height_m),
    )
    drawn = [crane_parts(crane, pose) for pose in poses]
    zero = np.array([hook_of(crane, 0.0, 0.0, 0.0)] * 2 + [hook_of(crane, 0.0, rest.radius_m, 0.0)])
    zero = np.concatenate([zero, [hook_of(crane, 0.0, rest.radius_m, rest.height_m)]])
    zero[FIXED] = 0.0

    def on_joints(points: Callable[[CraneParts], NDArray[np.float64]]) -> tuple[NDArray[np.float64], NDArray[np.uint8]]:
        at, slewed, trolleyed, hoisted = (points(parts) for parts in drawn)
        joint = np.zeros(at.shape[:-1], np.uint8)
        for number, moved in ((SLEWING, slewed), (TROLLEY if jib is None else LUFFING, trolleyed), (HOOK, hoisted)):
            joint[np.linalg.norm(moved - at, axis=-1) > _SAME_M] = number
        if jib is not None:
            return _on_jib(crane, jib, rest, at, joint, at - zero[np.where(joint == LUFFING, FIXED, joint)]), joint
        # A point on the slewing axis looks the same whether it slews or not.
        return at - zero[joint], joint

    segments, joints = on_joints(lambda parts: np.concatenate([s.segments_m for s in parts.strokes]).reshape(-1, 3))
    styles = [
        [*stroke.rgb, stroke.width_px, stroke.width_m]
        for stroke in drawn[0].strokes
        for _ in range(len(stroke.segments_m))
    ]
    centres, owners = on_joints(lambda parts: np.array([block.centre_m for block in parts.blocks]))
    blocks = drawn[0].blocks
    return {
        **identity(crane),
        "kind": crane.kind,
        "luffing": None
        if jib is None
        else {"pivot_offset_m": jib.pivot_offset_m, "pivot_height_m": jib.pivot_height_m, "length_m": jib.length_m},
        "base_m": list(crane.base_m),
        "jib_height_m": crane.jib_height_m,
        "min_radius_m": crane.min_radius_m,
        "mast_size_m": crane.mast_size_m,
        "sling_m": crane.sling_m,
        "rigging_mass_kg": crane.tackle_kg,
        "chart": {"radius_m": list(crane.chart.radius_m), "capacity_kg": list(crane.chart.capacity_kg)},
        "lines": {
            "points": blob.put(segments.astype(np.float32)),
            "joints": blob.put(joints),
            "styles": blob.put(np.array(styles, np.float32)),
        },
        "blocks": [
            {"centre_m": centre.tolist(), "half_m": block.half_m.tolist(), "rgb": list(block.rgb), "joint": int(joint)}
            for block, centre, joint in zip(blocks, centres, owners, strict=True)
        ],
    }


def _on_jib(
    crane: TowerCrane,
    jib: LuffingJib,
    rest: CranePose,
    at: NDArray[np.float64],
    joint: NDArray[np.uint8],
    others: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Return the points of a luffing jib relative to its pivot, x along the jib; other points unchanged."""
    luff = float(luff_of_radius(jib, np.array([rest.radius_m]))[0])
    pivot = np.array([crane.base_m[0] + jib.pivot_offset_m, crane.base_m[1], jib.pivot_height_m])
    away = at - pivot
    turned = np.stack(
        [
            np.cos(luff) * away[..., 0] + np.sin(luff) * away[..., 2],
            away[..., 1],
            np.cos(luff) * away[..., 2] - np.sin(luff) * away[..., 0],
        ],
        axis=-1,
    )
    return np.where((joint == LUFFING)[..., None], turned, others)
