"""From a scene to pixels."""

from __future__ import annotations

import io
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from bimvox.compiled import kernel
from bimvox.errors import InputError
from bimvox.grid.frame import GridFrame
from bimvox.rendering.colours import PAPER
from bimvox.rendering.pictures.annotate import annotate, draw_strokes, frame_for
from bimvox.rendering.pictures.camera import PICTURE_PX, Camera, View, fitted_camera
from bimvox.rendering.pictures.raycast import Buffers, Light, Rays, cast, cropped, light_for, light_on
from bimvox.rendering.pictures.scene import Block, Scene

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
    colour = _painted(buffers.solid, buffers.light, palette)
    _draw_outline(colour, buffers, samples, min(1.0, max(0.0, (cell_px - _FACE_EDGES_FROM_PX) / 8.0)))
    for strokes in scene.strokes:
        draw_strokes(colour, buffers.depth_m, strokes, fine, samples, 0.05 * size_m)
    pixels = _joined(colour, samples)
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


# From samples to pixels.


@kernel
def _painted(solid: NDArray[np.uint32], light: NDArray[np.float32], palette: NDArray[np.uint8]) -> NDArray[np.float32]:
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
def _joined(colour: NDArray[np.float32], samples: int) -> NDArray[np.uint8]:
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


# Edges: dark between solids, faint between the faces of one solid, light on dark ones.

_SOLID_EDGE = 0.62
_FACE_EDGE = 0.22


def _draw_outline(colour: NDArray[np.float32], buffers: Buffers, samples: int, face_edges: float) -> None:
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


# Coarser solids for pictures, because cells much smaller than a pixel cost time and are invisible.

_CELL_LIMIT = 60_000_000
_EDGE_LIMIT = 1600


def coarsened(scene: Scene) -> Scene:
    """Return the scene with cells joined 2 x 2 x 2, repeatedly, until it is drawn in seconds."""
    while scene.solids.size > _CELL_LIMIT or max(scene.solids.shape) > _EDGE_LIMIT:
        frame = GridFrame(scene.frame.origin_m, 2.0 * scene.frame.voxel_size_m)
        scene = replace(scene, frame=frame, solids=_halved(scene.solids))
    return scene


@kernel
def _halved(solids: NDArray[np.unsignedinteger]) -> NDArray[np.unsignedinteger]:
    """Join 2 x 2 x 2 cells; the solid that fills most of them wins over empty cells, so that thin parts remain."""
    nx, ny, nz = solids.shape
    out = np.zeros(((nx + 1) // 2, (ny + 1) // 2, (nz + 1) // 2), solids.dtype)
    for i in range(out.shape[0]):
        for j in range(out.shape[1]):
            for k in range(out.shape[2]):
                best, votes = 0, 0
                for a in range(8):
                    x, y, z = 2 * i + (a & 1), 2 * j + ((a >> 1) & 1), 2 * k + (a >> 2)
                    if x >= nx or y >= ny or z >= nz or solids[x, y, z] == 0:
                        continue
                    count = 0
                    for b in range(8):
                        p, q, r = 2 * i + (b & 1), 2 * j + ((b >> 1) & 1), 2 * k + (b >> 2)
                        if p < nx and q < ny and r < nz and solids[p, q, r] == solids[x, y, z]:
                            count += 1
                    if count > votes:
                        best, votes = solids[x, y, z], count
                out[i, j, k] = best
    return out


# Rotated boxes, drawn into the same depth buffer as the cells.


class _Window(NamedTuple):
    """Samples from (x0, y0) up to (x1, y1)."""

    x0: int
    y0: int
    x1: int
    y1: int


def _corners_m(block: Block) -> NDArray[np.float64]:
    """Return the (8, 3) corners of a block."""
    signs = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], np.float64)
    corners: NDArray[np.float64] = block.centre_m + signs @ block.half_m
    return corners


def draw_blocks(buffers: Buffers, blocks: Sequence[Block], camera: Camera, light: Light, first_solid: int) -> None:
    """Draw blocks into the buffers; the n-th becomes solid ``first_solid + n``."""
    height, width = buffers.solid.shape
    lens = np.array([camera.focal_px, *camera.centre_px])
    axes = np.stack([camera.right, camera.up, camera.forward])
    for n, block in enumerate(blocks):
        seen = camera.project(_corners_m(block))
        low = np.clip(np.floor(seen[:, :2].min(axis=0)), 0, (width, height)).astype(int)
        high = np.clip(np.ceil(seen[:, :2].max(axis=0)), 0, (width, height)).astype(int)
        if (high <= low).any():
            continue
        to_block = np.linalg.inv(block.half_m.T)
        normals = block.half_m / np.linalg.norm(block.half_m, axis=1, keepdims=True)
        facing = light_on(np.concatenate([-normals, normals]), light).sum(axis=1).reshape(2, 3).T.copy()
        rays = Rays(to_block @ (camera.eye_m - block.centre_m), to_block @ axes.T, lens)
        _draw_block(rays, facing, first_solid + n, _Window(low[0], low[1], high[0], high[1]), buffers)


@kernel
def _draw_block(rays: Rays, facing: NDArray[np.float64], number: int, window: _Window, out: Buffers) -> None:
    """Intersect each ray with the block, which is the cube from -1 to 1 in its own coordinates."""
    eye, axes, lens = rays.eye, rays.axes, rays.lens
    for row in range(window.y0, window.y1):
        b = (lens[2] - (row + 0.5)) / lens[0]
        for column in range(window.x0, window.x1):
            a = (column + 0.5 - lens[1]) / lens[0]
            enter, leave, axis = -np.inf, np.inf, -1
            for n in range(3):
                d = axes[n, 2] + a * axes[n, 0] + b * axes[n, 1]
                if d == 0.0:
                    if abs(eye[n]) > 1.0:
                        enter = np.inf
                    continue
                near, far = (-1.0 - eye[n]) / d, (1.0 - eye[n]) / d
                if near > far:
                    near, far = far, near
                if near > enter:
                    enter, axis = near, n
                leave = min(leave, far)
            if axis < 0 or enter >= leave or enter <= 0.0 or enter >= out.depth_m[row, column]:
                continue
            side = 1 if axes[axis, 2] + a * axes[axis, 0] + b * axes[axis, 1] < 0.0 else 0
            out.solid[row, column] = number
            out.plane[row, column] = 2 * axis + side
            out.depth_m[row, column] = enter
            out.light[row, column] = facing[axis, side]


# PNG files that hold nothing but pixels, so that their bytes are deterministic.

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
