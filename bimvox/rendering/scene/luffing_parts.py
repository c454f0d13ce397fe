"""A crane whose jib luffs as lattice lines and a few boxes: a tower crane, or a mobile crane on its outriggers."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from bimvox.crane.tower_crane import CranePose, LuffingJib, TowerCrane, luff_of_radius
from bimvox.rendering.colours import CONCRETE, CRANE, CRANE_EDGE
from bimvox.rendering.scene.lattice import (
    UP,
    CraneParts,
    Vec,
    block_of,
    crane_strokes,
    hook_block,
    jib_lattice,
    mast_lattice,
)
from bimvox.rendering.scene.scene import Block

_PADS = ((-1, -1), (-1, 1), (1, -1), (1, 1))


def luffing_parts(crane: TowerCrane, jib: LuffingJib, pose: CranePose, load_m: ArrayLike | None) -> CraneParts:
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
    chords, lacing = jib_lattice(foot, tip, aside, wide, normal)
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
        block_of(
            rear + along * 0.2 * jib.tail_radius_m + UP * (jib.tail_low_m + tail_m / 2.0 - jib.pivot_height_m),
            along, aside, (0.4 * jib.tail_radius_m, jib.tail_width_m, tail_m), CONCRETE,
        ),
        hook_block(hook, along, aside),
    ]  # fmt: skip
    if crane.kind == "luffing":
        mast_chords, mast_lacing = mast_lattice(base, width, jib.pivot_height_m)
        chords, lacing = chords + mast_chords, lacing + mast_lacing
    strokes = crane_strokes(ties, lacing, chords + legs, falls + slings, wide, 0.06 * wide)
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
            block_of(base + UP * 0.1 * width, east, north, (2.2 * width, 2.2 * width, 0.2 * width), CONCRETE),
            block_of(centre, along, aside, platform, CRANE),
        ]
    pads = [
        block_of(base + 0.46 * width * (a * east + b * north) + UP * 0.1, east, north, (1.0, 1.0, 0.2), CONCRETE)
        for a, b in _PADS
    ]
    beams = [
        block_of(base + 0.46 * width * a * east + UP * 0.6, east, north, (0.4, 0.92 * width, 0.4), CRANE)
        for a in (-1, 1)
    ]
    low = jib.tail_low_m
    return [
        *pads,
        *beams,
        block_of(base + UP * 0.5 * (0.5 + low), east, north, (1.25 * width, 2.6, low - 0.4), CRANE_EDGE),
        block_of(
            base + UP * 0.5 * (low + jib.pivot_height_m), along, aside,
            (0.5 * width, jib.tail_width_m, jib.pivot_height_m - low), CRANE,
        ),
    ]  # fmt: skip
