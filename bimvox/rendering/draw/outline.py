"""Edges: dark between solids, faint between the faces of one solid, light on dark ones."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import kernel
from bimvox.rendering.draw.raycast import Buffers

_SOLID_EDGE = 0.62
_FACE_EDGE = 0.22


def draw_outline(colour: NDArray[np.float32], buffers: Buffers, samples: int, face_edges: float) -> None:
    """Draw the edges over a picture.

    Args:
        colour: (H, W, 3) float32 sRGB 0..1, changed in place.
        buffers: What each sample sees.
        samples: Samples per pixel in each direction.
        face_edges: Strength of the edges between faces of the same solid, 0..1.
    """
    radius = max(1, round(samples / 2))
    _outline(buffers.solid, buffers.plane, radius, _SOLID_EDGE, _FACE_EDGE * face_edges, colour)


@kernel
def _outline(
    solid: NDArray[np.uint32],
    plane: NDArray[np.int32],
    radius: int,
    solid_edge: float,
    face_edge: float,
    colour: NDArray[np.float32],
) -> None:
    rows, columns = solid.shape
    for row in range(rows):
        for column in range(columns):
            own, face = solid[row, column], plane[row, column]
            if own == 0:
                continue
            strength = 0.0
            for step in range(1, radius + 1):
                for side in range(4):
                    r = row + (step if side == 0 else (-step if side == 1 else 0))
                    c = column + (step if side == 2 else (-step if side == 3 else 0))
                    if not (0 <= r < rows and 0 <= c < columns):
                        continue
                    if solid[r, c] != own:
                        strength = max(strength, solid_edge)
                    elif plane[r, c] != face:
                        strength = max(strength, face_edge)
            if strength <= 0.0:
                continue
            red, green, blue = colour[row, column, 0], colour[row, column, 1], colour[row, column, 2]
            # A dark edge would be invisible on a dark solid.
            towards = 0.62 if 0.3 * red + 0.59 * green + 0.11 * blue < 0.27 else 0.0
            for channel in range(3):
                value = colour[row, column, channel]
                colour[row, column, channel] = value + strength * (towards + 0.18 * value - value)
