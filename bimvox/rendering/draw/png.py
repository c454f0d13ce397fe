"""PNG files that hold nothing but pixels, so that their bytes are deterministic."""

from __future__ import annotations

import io

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from bimvox.rendering.draw.picture import PictureOptions, picture_of
from bimvox.rendering.scene.scene import Scene

_FEW_COLOURS = 192


def png_of(scene: Scene, options: PictureOptions) -> bytes:
    """Return the picture of a scene as a PNG file; deterministic.

    Raises:
        InputError: If the scene is empty.
    """
    return png_from_pixels(picture_of(scene, options))


def small_png_of(scene: Scene, options: PictureOptions) -> bytes:
    """Return the picture of a scene as a PNG file with few colours, about a third of the size; deterministic.

    Raises:
        InputError: If the scene is empty.
    """
    image = Image.fromarray(picture_of(scene, options))
    # Without dithering, so that flat colours stay flat.
    small = image.quantize(_FEW_COLOURS, method=Image.Quantize.MEDIANCUT, dither=Image.Dither.NONE)
    buffer = io.BytesIO()
    small.save(buffer, format="PNG", compress_level=9)
    return buffer.getvalue()


def png_from_pixels(pixels: NDArray[np.uint8]) -> bytes:
    """Return (height, width, 3) uint8 pixels as a PNG file without time or text chunks."""
    buffer = io.BytesIO()
    Image.fromarray(pixels).save(buffer, format="PNG", compress_level=6)
    return buffer.getvalue()
