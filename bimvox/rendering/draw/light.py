"""Light: one sun to the side of the camera, and the sky."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bimvox.rendering.draw.camera import View

_SUN_LEFT_DEG = 62.0
_SUN_ELEVATION_DEG = 46.0
_SUN_RADIUS_DEG = 1.6
_SKY = 0.62
"""Share of the light on level ground that comes from the sky."""
_NEAR_M = 0.9
"""Solids nearer than this block the sky's light."""


@dataclass(frozen=True, slots=True)
class Light:
    """The sun.

    Attributes:
        azimuth_deg: Counter-clockwise from the site's +x axis.
        elevation_deg: Above the horizon.
        radius_deg: Its apparent radius, which makes shadows soft.
    """

    azimuth_deg: float
    elevation_deg: float = _SUN_ELEVATION_DEG
    radius_deg: float = _SUN_RADIUS_DEG

    def directions(self, samples: int) -> NDArray[np.float64]:
        """Return a direction towards the sun's disc for each sample of a pixel: (samples * samples, 3)."""
        at = (np.arange(samples) + 0.5) / samples * 2.0 - 1.0 if samples > 1 else np.zeros(1)
        across, along = np.meshgrid(at, at)
        # A rotated lattice, so that the shadows of vertical and horizontal edges have equally soft rims.
        turn = math.atan(0.5)
        side = math.cos(turn) * across - math.sin(turn) * along
        rise = math.sin(turn) * across + math.cos(turn) * along
        azimuth = np.radians(self.azimuth_deg + self.radius_deg * side.ravel())
        elevation = np.radians(self.elevation_deg + self.radius_deg * rise.ravel())
        return np.stack(
            [np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)], axis=1
        )


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
    """Return the density of solids, blurred over about a metre.

    Args:
        solids: (X, Y, Z), 0 for none.
        voxel_size_m: Edge of a cell.

    Returns:
        The density on a lattice coarser by an integer factor, with one empty row around it, and that factor.
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
