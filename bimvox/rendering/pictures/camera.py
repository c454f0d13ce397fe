"""The camera: a mild perspective, fitted to its subject."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Final, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bimvox.errors import InputError

_DISTANCE_RADII = 7.0
"""Distance of the eye in radii of the subject: far enough that parallels look parallel, near enough for depth."""


@dataclass(frozen=True, slots=True)
class View:
    """The direction of view.

    Attributes:
        azimuth_deg: Direction from the site to the eye, counter-clockwise from the site's +x axis.
        elevation_deg: Angle of the eye above the horizon, 5..89.
    """

    azimuth_deg: float = -60.0
    elevation_deg: float = 28.0

    def __post_init__(self) -> None:
        if not math.isfinite(self.azimuth_deg):
            raise InputError(f"the azimuth is {self.azimuth_deg:g} degrees", hint="give a finite angle")
        if not 5.0 <= self.elevation_deg <= 89.0:
            raise InputError(
                f"an elevation of {self.elevation_deg:g} degrees cannot be drawn", hint="give an angle from 5 to 89"
            )


@dataclass(frozen=True, slots=True, eq=False)
class Camera:
    """A pinhole camera with a shifted lens.

    A point at ``eye_m + depth * (forward + a * right + b * up)`` is drawn at pixel coordinates
    ``(centre_px[0] + focal_px * a, centre_px[1] - focal_px * b)``; the middle of the top left pixel is (0.5, 0.5).

    Attributes:
        eye_m: (3,) float64.
        right: (3,) float64 unit vector.
        up: (3,) float64 unit vector.
        forward: (3,) float64 unit vector.
        focal_px: Pixels per unit of a and b.
        centre_px: Where the viewing axis meets the picture.
        size_px: Width and height of the picture.
    """

    eye_m: NDArray[np.float64]
    right: NDArray[np.float64]
    up: NDArray[np.float64]
    forward: NDArray[np.float64]
    focal_px: float
    centre_px: tuple[float, float]
    size_px: tuple[int, int]

    def project(self, points_m: ArrayLike) -> NDArray[np.float64]:
        """Return points projected: (..., 3) metres -> (..., 3) pixel x, pixel y, depth along the viewing axis in m."""
        offset = np.asarray(points_m, np.float64) - self.eye_m
        depth = offset @ self.forward
        x = self.centre_px[0] + self.focal_px * (offset @ self.right) / depth
        y = self.centre_px[1] - self.focal_px * (offset @ self.up) / depth
        return np.stack([x, y, depth], axis=-1)

    def scaled(self, factor: int) -> Camera:
        """Return the same view with ``factor`` times as many pixels in each direction."""
        (x, y), (width, height) = self.centre_px, self.size_px
        centre, size = (x * factor, y * factor), (width * factor, height * factor)
        return replace(self, focal_px=self.focal_px * factor, centre_px=centre, size_px=size)

    def pixels_per_metre(self, point_m: ArrayLike) -> float:
        """Return the pixels per metre across the view at a point."""
        return self.focal_px / float(self.project(point_m)[2])


def fitted_camera(
    view: View, points_m: ArrayLike, size_px: tuple[int, int], frame_px: tuple[float, float, float, float]
) -> Camera:
    """Return the camera that shows (N, 3) points as large as the frame ``x0 y0 x1 y1`` inside the picture allows."""
    points = np.asarray(points_m, np.float64)
    azimuth, elevation = math.radians(view.azimuth_deg), math.radians(view.elevation_deg)
    towards_eye = np.array(
        [math.cos(elevation) * math.cos(azimuth), math.cos(elevation) * math.sin(azimuth), math.sin(elevation)]
    )
    right = np.array([-math.sin(azimuth), math.cos(azimuth), 0.0])
    up = np.cross(towards_eye, right)
    low, high = points.min(axis=0), points.max(axis=0)
    radius = max(float(np.linalg.norm(high - low)) / 2.0, 1e-3)
    eye = (low + high) / 2.0 + towards_eye * _DISTANCE_RADII * radius
    unit = Camera(eye, right, up, -towards_eye, 1.0, (0.0, 0.0), size_px)
    seen = unit.project(points)[:, :2]
    first, last = seen.min(axis=0), seen.max(axis=0)
    x0, y0, x1, y1 = frame_px
    spread = np.maximum(last - first, 1e-9)
    focal = float(min((x1 - x0) / spread[0], (y1 - y0) / spread[1]))
    middle = (first + last) / 2.0 * focal
    centre = ((x0 + x1) / 2.0 - float(middle[0]), (y0 + y1) / 2.0 - float(middle[1]))
    return Camera(eye, right, up, -towards_eye, focal, centre, size_px)


# Sizes of pictures and animations, and which suffixes are animations.

PICTURE_PX: Final = (1280, 800)
FILM_PX: Final = (640, 400)
FILMS: Final[dict[str, Literal["gif", "webp"]]] = {".gif": "gif", ".webp": "webp"}
"""The formats of animations, by suffix."""
