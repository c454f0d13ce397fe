"""From a scene to pixels."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from bimvox.errors import InputError
from bimvox.rendering.colours import PAPER
from bimvox.rendering.draw.annotate import annotate, frame_for
from bimvox.rendering.draw.blocks import draw_blocks
from bimvox.rendering.draw.camera import Camera, View, fitted_camera
from bimvox.rendering.draw.light import light_for
from bimvox.rendering.draw.outline import draw_outline
from bimvox.rendering.draw.pixels import joined, painted
from bimvox.rendering.draw.raycast import cast, cropped
from bimvox.rendering.draw.strokes import draw_strokes
from bimvox.rendering.scene.coarsen import coarsened
from bimvox.rendering.scene.scene import Scene
from bimvox.rendering.sizes import PICTURE_PX

_SMALLEST_PX, _LARGEST_PX = 16, 4096
_CELL_LINES_FROM_PX, _FACE_EDGES_FROM_PX = 9.0, 2.0


@dataclass(frozen=True, slots=True)
class PictureOptions:
    """Options of a picture.

    Attributes:
        size_px: Width and height.
        view: The direction of view.
        samples: Samples per pixel in each direction.
        annotated: Whether title, caption and legend are drawn.
    """

    size_px: tuple[int, int] = PICTURE_PX
    view: View = field(default_factory=View)
    samples: int = 2
    annotated: bool = True

    def __post_init__(self) -> None:
        for value in self.size_px:
            if not _SMALLEST_PX <= value <= _LARGEST_PX:
                raise InputError(
                    f"a picture of {self.size_px[0]}x{self.size_px[1]} pixels cannot be made",
                    hint=f"both sides must be from {_SMALLEST_PX} to {_LARGEST_PX} pixels",
                )


def camera_of(scene: Scene, options: PictureOptions) -> Camera:
    """Return the camera that shows the whole scene."""
    if scene.focus_m is not None:
        seen = _corners(scene.focus_m)
    else:
        low, solids = cropped(scene.solids)
        ends = scene.frame.corner_of(np.stack([low, low + np.array(solids.shape)]))
        seen = np.concatenate([scene.points_m, *([_corners(ends)] if solids.size else [])])
    if not len(seen):
        raise InputError("there is nothing to draw", hint="the grid or site holds no filled cell")
    frame = frame_for(scene, options.size_px) if options.annotated else _bare_frame(options.size_px)
    return fitted_camera(options.view, seen, options.size_px, frame)


def picture_of(scene: Scene, options: PictureOptions | None = None, camera: Camera | None = None) -> NDArray[np.uint8]:
    """Return the picture of a scene: (height, width, 3) uint8 sRGB; deterministic.

    An animation gives a fixed camera with the options' size and view; otherwise one is fitted to the scene.

    Raises:
        InputError: If the scene is empty.
    """
    options = options or PictureOptions()
    scene = coarsened(scene)
    camera = camera or camera_of(scene, options)
    samples = options.samples
    fine = camera.scaled(samples)
    light = light_for(options.view)
    size_m = scene.frame.voxel_size_m
    cell_px = size_m * camera.pixels_per_metre(camera.eye_m + camera.forward * _distance_m(camera, scene))
    cell_lines = 0.10 * min(1.0, max(0.0, cell_px / _CELL_LINES_FROM_PX - 1.0))
    buffers = cast(scene.solids, scene.frame, fine, light, samples, lines=cell_lines)
    draw_blocks(buffers, scene.blocks, fine, light, len(scene.palette))
    palette = np.concatenate([scene.palette, np.array([b.rgb for b in scene.blocks], np.uint8).reshape(-1, 3)])
    palette[0] = PAPER
    colour = painted(buffers.solid, buffers.light, palette)
    draw_outline(colour, buffers, samples, min(1.0, max(0.0, (cell_px - _FACE_EDGES_FROM_PX) / 8.0)))
    for strokes in scene.strokes:
        draw_strokes(colour, buffers.depth_m, strokes, fine, samples, 0.05 * size_m)
    pixels = joined(colour, samples)
    return annotate(pixels, scene) if options.annotated else pixels


def solids_seen(scene: Scene, options: PictureOptions) -> NDArray[np.uint32]:
    """Return which solid each sample of a picture sees, 0 for none; without rotated boxes and lines.

    Raises:
        InputError: If the scene is empty.
    """
    scene = coarsened(scene)
    camera = camera_of(scene, options).scaled(options.samples)
    return cast(scene.solids, scene.frame, camera, light_for(options.view), options.samples, lines=0.0).solid


def _corners(ends: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the (8, 3) corners of the box between two corners."""
    return np.array([[ends[a, 0], ends[b, 1], ends[c, 2]] for a in (0, 1) for b in (0, 1) for c in (0, 1)])


def _distance_m(camera: Camera, scene: Scene) -> float:
    if scene.focus_m is not None:
        return float((scene.focus_m.mean(axis=0) - camera.eye_m) @ camera.forward)
    middle = scene.frame.corner_of(np.array(scene.solids.shape) / 2.0)
    return float((middle - camera.eye_m) @ camera.forward)


def _bare_frame(size_px: tuple[int, int]) -> tuple[float, float, float, float]:
    width, height = size_px
    margin = 0.03 * min(width, height)
    return margin, margin, width - margin, height - margin
