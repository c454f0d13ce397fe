"""The elements of every drawn crane: lattice masts and jibs, and boxes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bimvox.crane.outline import HOOK_BLOCK_M
from bimvox.rendering.colours import CRANE, CRANE_EDGE, ROPE
from bimvox.rendering.scene.layers import Layer
from bimvox.rendering.scene.scene import Block, Strokes
from bimvox.site.construction import Rgb

Vec = NDArray[np.float64]
Lines = list[tuple[Vec, Vec]]
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


def mast_lattice(base: Vec, width: float, top_m: float) -> tuple[Lines, Lines]:
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


def jib_lattice(foot: Vec, tip: Vec, aside: Vec, width: float, up: Vec = UP) -> tuple[Lines, Lines]:
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


def crane_strokes(
    ties: Lines, lacing: Lines, chords: Lines, ropes: Lines, width: float, thick: float
) -> tuple[Strokes, ...]:
    """Return the strokes of a crane: ties and ropes as thin lines, lacing and chords with a dark rim.

    ``width`` is that of the lattice, ``thick`` that of a chord, metres.
    """

    def strokes(lines: Lines, rgb: Rgb, width_px: float, width_m: float, edge: Rgb | None = None) -> Strokes:
        return Strokes(np.array(lines), rgb, width_px, width_m, edge=edge, layer=Layer.CRANE)

    return (
        strokes(ties, CRANE_EDGE, 0.9, 0.02 * width),
        strokes(lacing, CRANE, 0.9, 0.6 * thick, CRANE_EDGE),
        strokes(chords, CRANE, 1.5, thick, CRANE_EDGE),
        strokes(ropes, ROPE, 1.1, 0.02 * width),
    )


def block_of(centre: Vec, along: Vec, aside: Vec, size: tuple[float, float, float], rgb: Rgb) -> Block:
    """Return a box from its centre, the directions of its edges in plan, and their lengths."""
    half = np.stack([along * size[0] / 2.0, aside * size[1] / 2.0, UP * size[2] / 2.0])
    return Block(centre, half, rgb)


def hook_block(hook: Vec, along: Vec, aside: Vec) -> Block:
    """Return the hook block above the hook's point."""
    return block_of(hook + UP * HOOK_BLOCK_M[2] / 2.0, along, aside, HOOK_BLOCK_M, CRANE)
