"""Rotated boxes, drawn into the same depth buffer as the cells."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import kernel
from bimvox.rendering.draw.camera import Camera
from bimvox.rendering.draw.light import Light, light_on
from bimvox.rendering.draw.raycast import Buffers, Rays
from bimvox.rendering.scene.scene import Block


class _Window(NamedTuple):
    """Samples from (x0, y0) up to (x1, y1)."""

    x0: int
    y0: int
    x1: int
    y1: int


def corners_m(block: Block) -> NDArray[np.float64]:
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
        seen = camera.project(corners_m(block))
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
