"""A crane as lattice lines and a few boxes, in a pose."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from bimvox.crane.outline import counter_jib_m, tower_head_m
from bimvox.crane.tower_crane import CranePose, TowerCrane
from bimvox.rendering.colours import CONCRETE, CRANE, CRANE_EDGE
from bimvox.rendering.scene.lattice import (
    UP,
    CraneParts,
    block_of,
    crane_strokes,
    hook_block,
    jib_lattice,
    mast_lattice,
)
from bimvox.rendering.scene.luffing_parts import luffing_parts

_BEYOND = 0.1


def crane_parts(crane: TowerCrane, pose: CranePose, load_m: ArrayLike | None = None) -> CraneParts:
    """Return the lines and boxes of a crane; ``load_m`` are (N, 3) lifting points of the load, None without one."""
    if crane.luffing is not None:
        return luffing_parts(crane, crane.luffing, pose, load_m)
    base, width, top_m = np.array(crane.base_m), crane.mast_size_m, crane.jib_height_m
    along = np.array([np.cos(pose.slew_rad), np.sin(pose.slew_rad), 0.0])
    aside = np.array([-along[1], along[0], 0.0])
    east, north = np.array([1.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0])
    axis = np.array([base[0], base[1], top_m])
    back = counter_jib_m(crane)
    apex = axis + UP * tower_head_m(crane)
    tip = axis + along * (crane.jib_length_m + 0.5 * width)
    rear = axis - along * back

    mast_chords, mast_lacing = mast_lattice(base, width, top_m)
    jib_chords, jib_lacing = jib_lattice(axis + along * 0.5 * width, tip, aside, width)
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
    strokes = crane_strokes(ties, mast_lacing + jib_lacing, chords, falls + slings, width, 0.08 * width)
    blocks = (
        block_of(base + UP * 0.1 * width, east, north, (2.2 * width, 2.2 * width, 0.2 * width), CONCRETE),
        block_of(axis - UP * 0.15 * width, along, aside, (1.1 * width, 1.1 * width, 0.3 * width), CRANE),
        block_of(
            axis + aside * 0.95 * width + along * 0.3 * width - UP * 0.75 * width,
            along, aside, (0.9 * width, 0.8 * width, 1.1 * width), (196, 206, 214),
        ),
        block_of(
            rear + along * 0.1 * back - UP * 0.5 * width, along, aside, (0.2 * back, width, 1.3 * width), CONCRETE,
        ),
        block_of(trolley, along, aside, (0.8 * width, 0.9 * width, 0.2 * width), CRANE_EDGE),
        hook_block(hook, along, aside),
    )  # fmt: skip
    shown = axis + along * min(pose.radius_m + _BEYOND * crane.jib_length_m, crane.jib_length_m) + ridge
    return CraneParts(strokes, blocks, np.array([base, apex, shown, hook, axis - along * _BEYOND * back]))
