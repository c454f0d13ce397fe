"""A tower crane as lattice lines and a few boxes, in the pose of its three axes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bimvox.crane.outline import counter_jib_m, tower_head_m
from bimvox.crane.tower_crane import CranePose, TowerCrane
from bimvox.rendering.colours import CONCRETE, CRANE, CRANE_EDGE, ROPE
from bimvox.rendering.scene.layers import Layer
from bimvox.rendering.scene.scene import Block, Strokes

Vec = NDArray[np.float64]
_UP = np.array([0.0, 0.0, 1.0])
_BEYOND = 0.1


@dataclass(frozen=True, slots=True, eq=False)
class CraneParts:
    """What a crane is drawn as.

    Attributes:
        strokes: Lattice, ties, rope and slings.
        blocks: Foot, cab, counterweight, trolley and hook block.
        points_m: (N, 3) what must be seen of it: foot, top, and the jib a little beyond the trolley. The ends of jib
            and counter-jib may run out of the picture: a long jib would make the building tiny.
    """

    strokes: tuple[Strokes, ...]
    blocks: tuple[Block, ...]
    points_m: Vec


def crane_parts(crane: TowerCrane, pose: CranePose, load_m: ArrayLike | None = None) -> CraneParts:
    """Return the lines and boxes of a crane.

    Args:
        crane: The crane.
        pose: Where its axes are.
        load_m: (N, 3) points that the slings are fixed to; None for an empty hook.
    """
    if crane.luffing is not None:
        from bimvox.rendering.scene.luffing_parts import luffing_parts

        return luffing_parts(crane, crane.luffing, pose, load_m)
    base, width, top_m = np.array(crane.base_m), crane.mast_size_m, crane.jib_height_m
    along = np.array([np.cos(pose.slew_rad), np.sin(pose.slew_rad), 0.0])
    aside = np.array([-along[1], along[0], 0.0])
    east, north = np.array([1.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0])
    axis = np.array([base[0], base[1], top_m])
    back = counter_jib_m(crane)
    apex = axis + _UP * tower_head_m(crane)
    tip = axis + along * (crane.jib_length_m + 0.5 * width)
    rear = axis - along * back

    mast_chords, mast_lacing = mast_lattice(base, width, top_m)
    jib_chords, jib_lacing = jib_lattice(axis + along * 0.5 * width, tip, aside, width)
    side = 0.35 * width * aside
    deck = [(axis + s * side, rear + along * 0.05 * back + s * side) for s in (-1.0, 1.0)]
    legs = [(axis + 0.5 * width * (a * along + b * aside), apex) for a, b in ((-1, -1), (-1, 1), (1, -1), (1, 1))]
    ridge = _UP * 0.8 * width
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
    thick = 0.08 * width
    strokes = (
        Strokes(np.array(ties), CRANE_EDGE, width_px=0.9, width_m=0.02 * width, layer=Layer.CRANE),
        Strokes(
            np.array(mast_lacing + jib_lacing),
            CRANE,
            width_px=0.9,
            width_m=0.6 * thick,
            edge=CRANE_EDGE,
            layer=Layer.CRANE,
        ),
        Strokes(
            np.array(mast_chords + jib_chords + deck + legs),
            CRANE,
            width_px=1.5,
            width_m=thick,
            edge=CRANE_EDGE,
            layer=Layer.CRANE,
        ),
        Strokes(np.array(falls + slings), ROPE, width_px=1.1, width_m=0.02 * width, layer=Layer.CRANE),
    )
    blocks = (
        block_of(base + _UP * 0.1 * width, east, north, (2.2 * width, 2.2 * width, 0.2 * width), CONCRETE),
        block_of(axis - _UP * 0.15 * width, along, aside, (1.1 * width, 1.1 * width, 0.3 * width), CRANE),
        block_of(
            axis + aside * 0.95 * width + along * 0.3 * width - _UP * 0.75 * width,
            along, aside, (0.9 * width, 0.8 * width, 1.1 * width), (196, 206, 214),
        ),
        block_of(
            rear + along * 0.1 * back - _UP * 0.5 * width, along, aside, (0.2 * back, width, 1.3 * width), CONCRETE,
        ),
        block_of(trolley, along, aside, (0.8 * width, 0.9 * width, 0.2 * width), CRANE_EDGE),
        block_of(hook + _UP * 0.2 * width, along, aside, (0.35 * width, 0.25 * width, 0.4 * width), CRANE),
    )  # fmt: skip
    shown = axis + along * min(pose.radius_m + _BEYOND * crane.jib_length_m, crane.jib_length_m) + ridge
    return CraneParts(strokes, blocks, np.array([base, apex, shown, hook, axis - along * _BEYOND * back]))


def mast_lattice(base: Vec, width: float, top_m: float) -> tuple[list[tuple[Vec, Vec]], list[tuple[Vec, Vec]]]:
    """Chords and lacing of the mast: one diagonal per panel and side, turning at every panel."""
    corners = [np.array([a, b, 0.0]) * width / 2.0 for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    height = top_m - base[2]
    chords = [(base + corner, base + corner + _UP * height) for corner in corners]
    panels = max(1, round(height / (1.4 * width)))
    lacing = []
    for n in range(panels):
        low, high = _UP * height * n / panels, _UP * height * (n + 1) / panels
        for side in range(4):
            start, end = corners[side], corners[(side + 1) % 4]
            if n % 2:
                start, end = end, start
            lacing.append((base + start + low, base + end + high))
            lacing.append((base + corners[side] + high, base + corners[(side + 1) % 4] + high))
    return chords, lacing


def jib_lattice(
    foot: Vec, tip: Vec, aside: Vec, width: float, up: Vec = _UP
) -> tuple[list[tuple[Vec, Vec]], list[tuple[Vec, Vec]]]:
    """Chords and lacing of a jib of three chords, the upper one shorter by a panel."""
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


def block_of(centre: Vec, along: Vec, aside: Vec, size: tuple[float, float, float], rgb: tuple[int, int, int]) -> Block:
    """Return a box from its middle, the directions of its edges on the plan, and their lengths."""
    half = np.stack([along * size[0] / 2.0, aside * size[1] / 2.0, _UP * size[2] / 2.0])
    return Block(centre, half, rgb)
