"""All cranes of a site as lines and boxes, each in its own pose."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bimvox.crane.outline import HOOK_BLOCK_M, counter_jib_m, tower_head_m
from bimvox.crane.tower_crane import CranePose, LuffingJib, TowerCrane, luff_of_radius, tip_height_m
from bimvox.records.motion import LiftMotion
from bimvox.rendering.colours import CONCRETE, CRANE, CRANE_EDGE, ROPE
from bimvox.rendering.pictures.scene import Block, Layer, Strokes
from bimvox.site.component import Rgb
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


# The elements of every drawn crane: lattice masts and jibs, and boxes.

Vec = NDArray[np.float64]
_Lines = list[tuple[Vec, Vec]]
UP = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True, slots=True, eq=False)
class CraneParts:
    """The lines and boxes of a drawn crane.

    Attributes:
        strokes: Lattice, ties, rope and slings.
        blocks: Foot, cab, counterweight, trolley and hook block.
        points_m: (N, 3) points that must be visible: foot, top, and the jib a little beyond the trolley. The ends of
            jib and counter-jib may be cropped, because a long jib would make the building tiny.
    """

    strokes: tuple[Strokes, ...]
    blocks: tuple[Block, ...]
    points_m: Vec


def _mast_lattice(base: Vec, width: float, top_m: float) -> tuple[_Lines, _Lines]:
    """Return chords and lacing of the mast: one diagonal per panel and side, alternating."""
    corners = [np.array([a, b, 0.0]) * width / 2.0 for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    height = top_m - base[2]
    chords = [(base + corner, base + corner + UP * height) for corner in corners]
    panels = max(1, round(height / (1.4 * width)))
    lacing = []
    for n in range(panels):
        low, high = UP * height * n / panels, UP * height * (n + 1) / panels
        for side in range(4):
            start, end = corners[side], corners[(side + 1) % 4]
            if n % 2:
                start, end = end, start
            lacing.append((base + start + low, base + end + high))
            lacing.append((base + corners[side] + high, base + corners[(side + 1) % 4] + high))
    return chords, lacing


def _jib_lattice(foot: Vec, tip: Vec, aside: Vec, width: float, up: Vec = UP) -> tuple[_Lines, _Lines]:
    """Return chords and lacing of a jib with three chords, the upper one a panel shorter."""
    side, ridge = 0.35 * width * aside, 0.8 * width * up
    length = float(np.linalg.norm(tip - foot))
    panels = max(2, round(length / (1.1 * width)))
    step = (tip - foot) / panels
    chords = [(foot - side, tip - side), (foot + side, tip + side)]
    chords.append((foot + ridge + 0.5 * step, tip + ridge - 0.5 * step))
    lacing = []
    for n in range(panels):
        upper = foot + ridge + (n + 0.5) * step
        for s in (-1.0, 1.0):
            lacing += [(foot + n * step + s * side, upper), (upper, foot + (n + 1) * step + s * side)]
        lacing.append((foot + n * step - side, foot + n * step + side))
    return chords, lacing


def _crane_strokes(
    ties: _Lines, lacing: _Lines, chords: _Lines, ropes: _Lines, width: float, thick: float
) -> tuple[Strokes, ...]:
    """Return the strokes of a crane: ties and ropes as thin lines, lacing and chords with a dark rim.

    ``width`` is that of the lattice, ``thick`` that of a chord, metres.
    """

    def strokes(lines: _Lines, rgb: Rgb, width_px: float, width_m: float, edge: Rgb | None = None) -> Strokes:
        return Strokes(np.array(lines), rgb, width_px, width_m, edge=edge, layer=Layer.CRANE)

    return (
        strokes(ties, CRANE_EDGE, 0.9, 0.02 * width),
        strokes(lacing, CRANE, 0.9, 0.6 * thick, CRANE_EDGE),
        strokes(chords, CRANE, 1.5, thick, CRANE_EDGE),
        strokes(ropes, ROPE, 1.1, 0.02 * width),
    )


def _block_of(centre: Vec, along: Vec, aside: Vec, size: tuple[float, float, float], rgb: Rgb) -> Block:
    """Return a box from its centre, the directions of its edges in plan, and their lengths."""
    half = np.stack([along * size[0] / 2.0, aside * size[1] / 2.0, UP * size[2] / 2.0])
    return Block(centre, half, rgb)


def _hook_block(hook: Vec, along: Vec, aside: Vec) -> Block:
    """Return the hook block above the hook's point."""
    return _block_of(hook + UP * HOOK_BLOCK_M[2] / 2.0, along, aside, HOOK_BLOCK_M, CRANE)


# A crane whose jib luffs as lattice lines and a few boxes: a tower crane, or a mobile crane on its outriggers.

_PADS = ((-1, -1), (-1, 1), (1, -1), (1, 1))


def _luffing_parts(crane: TowerCrane, jib: LuffingJib, pose: CranePose, load_m: ArrayLike | None) -> CraneParts:
    """Return the lines and boxes of a crane whose jib luffs; see ``crane_parts``."""
    base, width, wide = np.array(crane.base_m), crane.mast_size_m, jib.width_m
    along = np.array([np.cos(pose.slew_rad), np.sin(pose.slew_rad), 0.0])
    aside = np.array([-along[1], along[0], 0.0])
    luff = float(luff_of_radius(jib, np.array([pose.radius_m]))[0])
    direction = np.cos(luff) * along + np.sin(luff) * UP
    normal = np.cos(luff) * UP - np.sin(luff) * along
    axis = np.array([base[0], base[1], jib.pivot_height_m])
    foot = axis + jib.pivot_offset_m * along
    tip = foot + jib.length_m * direction
    rear = axis - jib.tail_radius_m * along
    apex = (
        axis - 0.5 * jib.tail_radius_m * along + UP * (0.22 * jib.length_m if crane.kind == "luffing" else 2.0 * wide)
    )
    chords, lacing = _jib_lattice(foot, tip, aside, wide, normal)
    hook = tip.copy()
    hook[2] = pose.height_m
    falls = [(tip + s * 0.2 * wide * aside, hook + s * 0.1 * wide * aside) for s in (-1.0, 1.0)]
    slings = [] if load_m is None else [(hook, point) for point in np.asarray(load_m, np.float64)]
    side = 0.4 * wide * aside
    ties = [(apex, tip), *((apex, rear + s * side) for s in (-1.0, 1.0))]
    legs = [(foot + s * side, apex) for s in (-1.0, 1.0)]
    east, north = np.array([1.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0])
    blocks = _footing(crane, jib, base, along, aside, east, north)
    tail_m = max(0.8, jib.pivot_height_m - jib.tail_low_m)
    blocks += [
        _block_of(
            rear + along * 0.2 * jib.tail_radius_m + UP * (jib.tail_low_m + tail_m / 2.0 - jib.pivot_height_m),
            along, aside, (0.4 * jib.tail_radius_m, jib.tail_width_m, tail_m), CONCRETE,
        ),
        _hook_block(hook, along, aside),
    ]  # fmt: skip
    if crane.kind == "luffing":
        mast_chords, mast_lacing = _mast_lattice(base, width, jib.pivot_height_m)
        chords, lacing = chords + mast_chords, lacing + mast_lacing
    strokes = _crane_strokes(ties, lacing, chords + legs, falls + slings, wide, 0.06 * wide)
    return CraneParts(strokes, tuple(blocks), np.array([base, apex, tip, hook, rear]))


def _footing(
    crane: TowerCrane, jib: LuffingJib, base: Vec, along: Vec, aside: Vec, east: Vec, north: Vec
) -> list[Block]:
    """Return the foot of the mast, or undercarriage, outrigger pads and superstructure."""
    width = crane.mast_size_m
    if crane.kind == "luffing":
        platform = (jib.tail_radius_m + jib.pivot_offset_m, jib.tail_width_m, 0.4)
        centre = (
            np.array([base[0], base[1], jib.pivot_height_m]) + 0.5 * (jib.pivot_offset_m - jib.tail_radius_m) * along
        )
        return [
            _block_of(base + UP * 0.1 * width, east, north, (2.2 * width, 2.2 * width, 0.2 * width), CONCRETE),
            _block_of(centre, along, aside, platform, CRANE),
        ]
    pads = [
        _block_of(base + 0.46 * width * (a * east + b * north) + UP * 0.1, east, north, (1.0, 1.0, 0.2), CONCRETE)
        for a, b in _PADS
    ]
    beams = [
        _block_of(base + 0.46 * width * a * east + UP * 0.6, east, north, (0.4, 0.92 * width, 0.4), CRANE)
        for a in (-1, 1)
    ]
    low = jib.tail_low_m
    return [
        *pads,
        *beams,
        _block_of(base + UP * 0.5 * (0.5 + low), east, north, (1.25 * width, 2.6, low - 0.4), CRANE_EDGE),
        _block_of(
            base + UP * 0.5 * (low + jib.pivot_height_m), along, aside,
            (0.5 * width, jib.tail_width_m, jib.pivot_height_m - low), CRANE,
        ),
    ]  # fmt: skip


# A crane as lattice lines and a few boxes, in a pose.

_BEYOND = 0.1


def crane_parts(crane: TowerCrane, pose: CranePose, load_m: ArrayLike | None = None) -> CraneParts:
    """Return the lines and boxes of a crane; ``load_m`` are (N, 3) lifting points of the load, None without one."""
    if crane.luffing is not None:
        return _luffing_parts(crane, crane.luffing, pose, load_m)
    base, width, top_m = np.array(crane.base_m), crane.mast_size_m, crane.jib_height_m
    along = np.array([np.cos(pose.slew_rad), np.sin(pose.slew_rad), 0.0])
    aside = np.array([-along[1], along[0], 0.0])
    east, north = np.array([1.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0])
    axis = np.array([base[0], base[1], top_m])
    back = counter_jib_m(crane)
    apex = axis + UP * tower_head_m(crane)
    tip = axis + along * (crane.jib_length_m + 0.5 * width)
    rear = axis - along * back

    mast_chords, mast_lacing = _mast_lattice(base, width, top_m)
    jib_chords, jib_lacing = _jib_lattice(axis + along * 0.5 * width, tip, aside, width)
    side = 0.35 * width * aside
    deck = [(axis + s * side, rear + along * 0.05 * back + s * side) for s in (-1.0, 1.0)]
    legs = [(axis + 0.5 * width * (a * along + b * aside), apex) for a, b in ((-1, -1), (-1, 1), (1, -1), (1, 1))]
    ridge = UP * 0.8 * width
    ties = [
        (apex, axis + along * 0.36 * crane.jib_length_m + ridge),
        (apex, axis + along * 0.74 * crane.jib_length_m + ridge),
        *((apex, rear + s * side) for s in (-1.0, 1.0)),
    ]
    hook = axis + along * pose.radius_m
    hook[2] = pose.height_m
    trolley = hook.copy()
    trolley[2] = top_m - 0.15 * width
    falls = [(trolley + s * 0.18 * width * along, hook + s * 0.1 * width * along) for s in (-1.0, 1.0)]
    slings = [] if load_m is None else [(hook, point) for point in np.asarray(load_m, np.float64)]
    chords = mast_chords + jib_chords + deck + legs
    strokes = _crane_strokes(ties, mast_lacing + jib_lacing, chords, falls + slings, width, 0.08 * width)
    blocks = (
        _block_of(base + UP * 0.1 * width, east, north, (2.2 * width, 2.2 * width, 0.2 * width), CONCRETE),
        _block_of(axis - UP * 0.15 * width, along, aside, (1.1 * width, 1.1 * width, 0.3 * width), CRANE),
        _block_of(
            axis + aside * 0.95 * width + along * 0.3 * width - UP * 0.75 * width,
            along, aside, (0.9 * width, 0.8 * width, 1.1 * width), (196, 206, 214),
        ),
        _block_of(
            rear + along * 0.1 * back - UP * 0.5 * width, along, aside, (0.2 * back, width, 1.3 * width), CONCRETE,
        ),
        _block_of(trolley, along, aside, (0.8 * width, 0.9 * width, 0.2 * width), CRANE_EDGE),
        _hook_block(hook, along, aside),
    )  # fmt: skip
    shown = axis + along * min(pose.radius_m + _BEYOND * crane.jib_length_m, crane.jib_length_m) + ridge
    return CraneParts(strokes, blocks, np.array([base, apex, shown, hook, axis - along * _BEYOND * back]))
