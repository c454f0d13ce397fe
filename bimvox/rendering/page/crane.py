"""The crane as lines and boxes attached to the joints that move them, derived from the drawing of a crane in a pose."""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated, Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from bimvox.crane.kinematics import hook_of
from bimvox.crane.machine import identity
from bimvox.crane.tower_crane import CranePose, LuffingJib, TowerCrane, luff_of_radius
from bimvox.records.declared import LATER, Count, Maybe, Record, Several
from bimvox.rendering.page.geometry import COLOUR, NUMBERS, Blob
from bimvox.rendering.pictures.cranes import CraneParts, crane_parts
from bimvox.site.config.validation import Point3

FIXED, SLEWING, TROLLEY, HOOK, LUFFING = range(5)
"""Joints that move a point: none; slewing; slewing and trolley; all three axes; slewing and luffing."""
_SAME_M = 1e-6

_LINES = Record(
    "PageLines",
    "The lines of a drawn crane.",
    ("points", NUMBERS, "Two ends of each line, x, y, z in the frame of their joints."),
    ("joints", NUMBERS, "The joint of each end."),
    ("styles", NUMBERS, "Of each line: red, green, blue, width in pixels, width in metres."),
)
_BLOCK = Record(
    "PageBlock",
    "A box of a drawn crane.",
    ("centre_m", Point3, "Its centre in the frame of its joint."),
    ("half_m", tuple[Point3, Point3, Point3], "Its three half edges."),
    ("rgb", COLOUR, "Its colour."),
    ("joint", Annotated[int, Field(ge=0, le=4)], "Its joint."),
)
_OVERRIDE = Record(
    "PageOverride",
    "What the site file changes in a machine.",
    ("key", str, "The key."),
    ("catalogue", str, "The machine's value."),
    ("site", str, "The site's value."),
)
_JIB = Record(
    "PageJib",
    "A luffing jib, or a boom.",
    ("pivot_offset_m", float, "Radius of the pivot."),
    ("pivot_height_m", float, "Height of the pivot."),
    ("length_m", float, "From pivot to tip."),
)
_CHART = Record(
    "PageChart",
    "A load chart.",
    ("radius_m", tuple[float, ...], "Radii, ascending.", lambda chart: list(chart.radius_m)),
    (
        "capacity_kg", tuple[float, ...], "Capacity at each: load, rigging and hook block.",
        lambda chart: list(chart.capacity_kg),
    ),
)  # fmt: skip
CRANE = Record(
    "PageCrane",
    "A crane. Joints: 0 fixed; 1 slewing; 2 with the trolley; 3 with the hook; 4 with the luffing jib.",
    ("name", str, "Its name.", LATER),
    ("machine", str, "Its machine.", LATER),
    ("jib_length_m", float, "Largest hook radius.", LATER),
    ("falls", Count, "Parts of rope that carry the hook.", LATER),
    ("overrides", Several(_OVERRIDE), "What the site file changes.", LATER),
    ("kind", Literal["hammerhead", "luffing", "mobile"], "Its kind."),
    ("luffing", Maybe(_JIB), "Null for a jib with a trolley.", lambda crane: crane.luffing and _JIB.of(crane.luffing)),
    ("base_m", Point3, "Foot of the slewing axis.", lambda crane: list(crane.base_m)),
    ("jib_height_m", float, "Height of the rope exit; of a luffing jib its highest."),
    ("min_radius_m", float, "Smallest hook radius."),
    ("mast_size_m", float, "Edge of the mast."),
    ("sling_m", float, "Height of the slings of the empty hook."),
    ("rigging_mass_kg", float, "Mass of rigging and hook block.", "tackle_kg"),
    ("chart", _CHART, "Its load chart.", lambda crane: _CHART.of(crane.chart)),
    ("lines", _LINES, "How it is drawn: lines.", LATER),
    ("blocks", Several(_BLOCK), "How it is drawn: boxes.", LATER),
)


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
    lines = [blob.put(each) for each in (segments.astype(np.float32), joints, np.array(styles, np.float32))]
    blocks = [
        _BLOCK.made(centre.tolist(), block.half_m.tolist(), list(block.rgb), int(joint))
        for block, centre, joint in zip(drawn[0].blocks, centres, owners, strict=True)
    ]
    return identity(crane) | CRANE.of(crane) | {"lines": _LINES.made(*lines), "blocks": blocks}


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
