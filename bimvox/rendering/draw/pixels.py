"""From samples to pixels."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import kernel


@kernel
def painted(solid: NDArray[np.uint32], light: NDArray[np.float32], palette: NDArray[np.uint8]) -> NDArray[np.float32]:
    """Return the lit colour of every sample: (H, W, 3) float32 sRGB, 0..1 and a little above."""
    rows, columns = solid.shape
    colour = np.empty((rows, columns, 3), np.float32)
    for row in range(rows):
        for column in range(columns):
            for channel in range(3):
                value = palette[solid[row, column], channel] * light[row, column]
                colour[row, column, channel] = value / np.float32(255.0)
    return colour


@kernel
def joined(colour: NDArray[np.float32], samples: int) -> NDArray[np.uint8]:
    """Return the mean of each pixel's samples: (H, W, 3) float32 0..1 -> (H / samples, W / samples, 3) uint8."""
    rows, columns = colour.shape[0] // samples, colour.shape[1] // samples
    pixels = np.empty((rows, columns, 3), np.uint8)
    for row in range(rows):
        for column in range(columns):
            for channel in range(3):
                total = 0.0
                for a in range(samples):
                    for b in range(samples):
                        total += min(1.0, max(0.0, colour[row * samples + a, column * samples + b, channel]))
                pixels[row, column, channel] = int(255.0 * total / (samples * samples) + 0.5)
    return pixels
