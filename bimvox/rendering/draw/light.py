"""Light: one sun to the side of the camera, and the sky."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import kernel
from bimvox.rendering.draw.camera import View

_SUN_LEFT_DEG = 62.0
_SUN_ELEVATION_DEG = 46.0
_SUN_RADIUS_DEG = 1.6
"""Apparent radius of the sun, which makes shadows soft."""
_SKY = 0.62
"""Share of the light on level ground that comes from the sky."""
_NEAR_M = 0.9
"""Solids nearer than this block the sky's light."""


@dataclass(frozen=True, slots=True)
class Light:
    """The sun.

    Attributes:
        azimuth_deg: Counter-clockwise from the site's +x axis.
    """

    azimuth_deg: float

    def directions(self, samples: int) -> NDArray[np.float64]:
        """Return a direction towards the sun's disc for each sample of a pixel: (samples * samples, 3)."""
        at = (np.arange(samples) + 0.5) / samples * 2.0 - 1.0 if samples > 1 else np.zeros(1)
        across, along = np.meshgrid(at, at)
        # A rotated lattice, so that the shadows of vertical and horizontal edges have equally soft rims.
        turn = math.atan(0.5)
        side = math.cos(turn) * across - math.sin(turn) * along
        rise = math.sin(turn) * across + math.cos(turn) * along
        azimuth = np.radians(self.azimuth_deg + _SUN_RADIUS_DEG * side.ravel())
        elevation = np.radians(_SUN_ELEVATION_DEG + _SUN_RADIUS_DEG * rise.ravel())
        level = np.cos(elevation)
        return np.stack([level * np.cos(azimuth), level * np.sin(azimuth), np.sin(elevation)], axis=1)


def light_for(view: View) -> Light:
    """Return the sun behind the viewer's left shoulder: of the two visible sides one is lit, the other is not."""
    return Light(view.azimuth_deg - _SUN_LEFT_DEG)


def light_on(normals: NDArray[np.float64], light: Light) -> NDArray[np.float64]:
    """Return the light on faces with these unit normals: (N, 3) -> (N, 2) from the sky, from the sun.

    Level ground in full sun has 1 in total, so that it is drawn in its own colour.
    """
    sun = light.directions(1)[0]
    rise = normals[:, 2]
    # A wall sees half the sky, and light reflected from the ground instead of the other half.
    sky = _SKY * (1.05 - 0.05 * np.maximum(rise, 0.0) - 0.25 * np.maximum(-rise, 0.0))
    direct = (1.0 - _SKY) * np.maximum(normals @ sun, 0.0) / sun[2]
    return np.stack([sky, direct], axis=1)


def face_light(light: Light) -> NDArray[np.float64]:
    """Return the light on the six faces of a cell (-x, +x, -y, +y, -z, +z): (6, 2) from the sky, from the sun."""
    normals = np.array([[-1, 0, 0], [1, 0, 0], [0, -1, 0], [0, 1, 0], [0, 0, -1], [0, 0, 1]], np.float64)
    return light_on(normals, light)


def sky_density(solids: NDArray[np.unsignedinteger], voxel_size_m: float) -> tuple[NDArray[np.float32], int]:
    """Return the density of solids (X, Y, Z; 0 for none), blurred over about a metre.

    The density is on a lattice coarser by an integer factor, with one empty row around it; the factor is returned too.
    """
    stride = max(1, round(_NEAR_M / voxel_size_m / 2.0))
    padded = tuple(-(-n // stride) * stride for n in solids.shape)
    filled = np.zeros(padded, np.float32)
    x, y, z = solids.shape
    filled[:x, :y, :z] = solids != 0
    a, b, c = (n // stride for n in padded)
    coarse = filled.reshape(a, stride, b, stride, c, stride).mean(axis=(1, 3, 5), dtype=np.float32)
    density: NDArray[np.float32] = np.pad(coarse, 1)
    for axis in range(3):
        ahead, behind = np.roll(density, 1, axis), np.roll(density, -1, axis)
        density = 0.5 * density + 0.25 * (ahead + behind)
    return np.ascontiguousarray(density), stride


@kernel
def openness(
    density: NDArray[np.float32], stride: int, x: float, y: float, z: float, nx: float, ny: float, nz: float
) -> float:
    """Return the share of the sky visible from a point with a normal, 0..1, from the density of solids before it."""
    reach = 1.5 * stride
    gx, gy, gz = (x + nx * reach) / stride + 0.5, (y + ny * reach) / stride + 0.5, (z + nz * reach) / stride + 0.5
    i, j, k = int(np.floor(gx)), int(np.floor(gy)), int(np.floor(gz))
    fx, fy, fz = gx - i, gy - j, gz - k
    total = 0.0
    for a in range(2):
        for b in range(2):
            for c in range(2):
                p, q, r = i + a, j + b, k + c
                inside = 0 <= p < density.shape[0] and 0 <= q < density.shape[1] and 0 <= r < density.shape[2]
                weight = (fx if a else 1.0 - fx) * (fy if b else 1.0 - fy) * (fz if c else 1.0 - fz)
                if inside:
                    total += weight * density[p, q, r]
    return max(0.0, 1.0 - total)


@kernel
def _filled(solids: NDArray[np.unsignedinteger], i: int, j: int, k: int) -> bool:
    nx, ny, nz = solids.shape
    return 0 <= i < nx and 0 <= j < ny and 0 <= k < nz and bool(solids[i, j, k])


@kernel
def corner_light(solids: NDArray[np.unsignedinteger], i: int, j: int, k: int, axis: int, u: float, v: float) -> float:
    """Return the light at the point (u, v) of a face, reduced near the neighbours of the cell before it (i, j, k)."""
    shade = 0.0
    for a in range(-1, 2):
        for b in range(-1, 2):
            # Nearness to that neighbour: 1 at its border, 0 half a cell away.
            near_u = 1.0 if a == 0 else max(0.0, 1.0 - 2.0 * (1.0 - u if a > 0 else u))
            near_v = 1.0 if b == 0 else max(0.0, 1.0 - 2.0 * (1.0 - v if b > 0 else v))
            near = near_u * near_v
            if near <= shade or (a == 0 and b == 0):
                continue
            if axis == 0:
                there = _filled(solids, i, j + a, k + b)
            elif axis == 1:
                there = _filled(solids, i + a, j, k + b)
            else:
                there = _filled(solids, i + a, j + b, k)
            if there:
                shade = near
    return 1.0 - shade * shade
