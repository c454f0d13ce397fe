"""The ray caster: which cell each pixel sees, at which depth, in which light.

A ray walks from cell to cell (Amanatides and Woo, "A Fast Voxel Traversal Algorithm for Ray Tracing", 1987) and reads
the volume only below the highest solid of a column. Light comes from one sun, whose shadow rays differ between the
samples of a pixel to give shadows a soft rim, and from the sky, which nearby solids block.
"""

from __future__ import annotations

import math
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import kernel
from bimvox.grid.frame import GridFrame
from bimvox.processes import processors
from bimvox.rendering.pictures.camera import Camera, View

NOTHING = np.float32(np.inf)
"""Depth of a sample that sees nothing."""

_BAND_ROWS = 32


class Buffers(NamedTuple):
    """What each sample of a picture sees.

    Attributes:
        solid: (H, W) uint32, 0 for none.
        plane: (H, W) int32, equal for samples on the same plane of the same solid.
        depth_m: (H, W) float32 along the viewing axis.
        light: (H, W) float32 factor on the colour.
    """

    solid: NDArray[np.uint32]
    plane: NDArray[np.int32]
    depth_m: NDArray[np.float32]
    light: NDArray[np.float32]


class _Volume(NamedTuple):
    """What rays run through.

    Attributes:
        solids: (X, Y, Z), 0 for none.
        top: (X, Y) int32, one above the highest filled cell of every column.
        density: Share of solids in blocks of ``stride`` cells.
        stride: Edge of such a block, in cells.
    """

    solids: NDArray[np.unsignedinteger]
    top: NDArray[np.int32]
    density: NDArray[np.float32]
    stride: int


class Rays(NamedTuple):
    """Where rays start and go, in cells.

    Attributes:
        eye: (3,) the camera.
        axes: (3, 3) right, up and forward.
        lens: (3,) focal length and the picture's centre, in samples.
    """

    eye: NDArray[np.float64]
    axes: NDArray[np.float64]
    lens: NDArray[np.float64]


class _Shading(NamedTuple):
    """How a hit is lit.

    Attributes:
        suns: (samples^2, 3) direction to the sun, one for each sample of a pixel.
        facing: (6, 2) light of the sky and of the sun on each face.
        samples: Samples per pixel in each direction.
        size_m: Edge of a cell.
        lines: Strength of the borders of cells, 0..1.
    """

    suns: NDArray[np.float64]
    facing: NDArray[np.float64]
    samples: int
    size_m: float
    lines: float


def cast(
    solids: NDArray[np.unsignedinteger], frame: GridFrame, camera: Camera, light: Light, samples: int, *, lines: float
) -> Buffers:
    """Return what every sample of a picture of solids (X, Y, Z; 0 for none) sees.

    The camera's pixels are the samples, ``samples`` per pixel in each direction. ``lines`` is the strength of the
    borders of cells, 0..1.
    """
    width, height = camera.size_px
    buffers = Buffers(
        np.zeros((height, width), np.uint32),
        np.zeros((height, width), np.int32),
        np.full((height, width), NOTHING, np.float32),
        np.ones((height, width), np.float32),
    )
    low, solids = cropped(solids)
    if solids.size == 0:
        return buffers
    size_m = frame.voxel_size_m
    rays = Rays(
        (camera.eye_m - frame.corner_of(low)) / size_m,
        np.stack([camera.right, camera.up, camera.forward]),
        np.array([camera.focal_px, *camera.centre_px]),
    )
    shading = _Shading(light.directions(samples), _face_light(light), samples, size_m, lines)
    volume = _Volume(solids, tops(solids), *_sky_density(solids, size_m))

    def band(first: int) -> None:
        _cast_rows(volume, rays, shading, buffers, first, min(first + _BAND_ROWS, height))

    with ThreadPoolExecutor(processors()) as pool:
        list(pool.map(band, range(0, height, _BAND_ROWS)))
    return buffers


def cropped(solids: NDArray[np.unsignedinteger]) -> tuple[NDArray[np.int64], NDArray[np.unsignedinteger]]:
    """Return the lowest cell of the bounding box of all filled cells, and the cells in it; empty if none is filled."""
    filled = solids != 0
    low, high = np.zeros(3, np.int64), np.zeros(3, np.int64)
    for axis in range(3):
        there = np.flatnonzero(filled.any(axis=tuple(other for other in range(3) if other != axis)))
        if not len(there):
            return low, np.zeros((0, 0, 0), solids.dtype)
        low[axis], high[axis] = there[0], there[-1] + 1
    box = tuple(slice(int(a), int(b)) for a, b in zip(low, high, strict=True))
    return low, np.ascontiguousarray(solids[box])


@kernel
def tops(solids: NDArray[np.unsignedinteger]) -> NDArray[np.int32]:
    """Return one above the highest filled cell of every column: (X, Y) int32."""
    nx, ny, nz = solids.shape
    top = np.zeros((nx, ny), np.int32)
    for i in range(nx):
        for j in range(ny):
            k = nz
            while k > 0 and solids[i, j, k - 1] == 0:
                k -= 1
            top[i, j] = k
    return top


@kernel
def first_hit(
    solids: NDArray[np.unsignedinteger],
    top: NDArray[np.int32],
    ox: float,
    oy: float,
    oz: float,
    dx: float,
    dy: float,
    dz: float,
) -> tuple[int, int, int, int, float]:
    """Return the first filled cell on a ray, the axis of the face that it enters by (-1: no hit), and the distance.

    The ray goes from (ox, oy, oz) towards (dx, dy, dz), in cells; the distance is in multiples of that vector.
    """
    nx, ny, nz = solids.shape
    # Where the ray enters and leaves the box of all cells.
    enter, leave, axis = 0.0, np.inf, 2
    for a in range(3):
        o = ox if a == 0 else (oy if a == 1 else oz)
        d = dx if a == 0 else (dy if a == 1 else dz)
        n = nx if a == 0 else (ny if a == 1 else nz)
        if d == 0.0:
            if o < 0.0 or o >= n:
                return 0, 0, 0, -1, 0.0
            continue
        near, far = -o / d, (n - o) / d
        if near > far:
            near, far = far, near
        if near > enter:
            enter, axis = near, a
        leave = min(leave, far)
    if enter >= leave:
        return 0, 0, 0, -1, 0.0
    # The first cell; how far along the ray the borders between cells are apart, and the next border of each axis.
    i = min(max(int(np.floor(ox + dx * enter + dx * 1e-9)), 0), nx - 1)
    j = min(max(int(np.floor(oy + dy * enter + dy * 1e-9)), 0), ny - 1)
    k = min(max(int(np.floor(oz + dz * enter + dz * 1e-9)), 0), nz - 1)
    step_i, step_j, step_k = (1 if dx > 0 else -1), (1 if dy > 0 else -1), (1 if dz > 0 else -1)
    wide_x = abs(1.0 / dx) if dx != 0.0 else np.inf
    wide_y = abs(1.0 / dy) if dy != 0.0 else np.inf
    wide_z = abs(1.0 / dz) if dz != 0.0 else np.inf
    next_x = (i + (dx > 0) - ox) / dx if dx != 0.0 else np.inf
    next_y = (j + (dy > 0) - oy) / dy if dy != 0.0 else np.inf
    next_z = (k + (dz > 0) - oz) / dz if dz != 0.0 else np.inf
    along = enter
    while True:
        # Step over the nearest of the three next borders, until a cell is filled.
        if k < top[i, j] and solids[i, j, k] != 0:
            return i, j, k, axis, along
        if next_x < next_y and next_x < next_z:
            i += step_i
            if i < 0 or i >= nx:
                return 0, 0, 0, -1, 0.0
            along, axis = next_x, 0
            next_x += wide_x
        elif next_y < next_z:
            j += step_j
            if j < 0 or j >= ny:
                return 0, 0, 0, -1, 0.0
            along, axis = next_y, 1
            next_y += wide_y
        else:
            k += step_k
            if k < 0 or k >= nz:
                return 0, 0, 0, -1, 0.0
            along, axis = next_z, 2
            next_z += wide_z


@kernel
def _cast_rows(volume: _Volume, rays: Rays, shading: _Shading, out: Buffers, first: int, last: int) -> None:
    """Look through the samples of the rows from ``first`` up to ``last``."""
    solids, top, axes, samples = volume.solids, volume.top, rays.axes, shading.samples
    focal, centre_x, centre_y = rays.lens[0], rays.lens[1], rays.lens[2]
    ox, oy, oz = rays.eye[0], rays.eye[1], rays.eye[2]
    for row in range(first, last):
        b = (centre_y - (row + 0.5)) / focal
        for column in range(out.solid.shape[1]):
            a = (column + 0.5 - centre_x) / focal
            dx = axes[2, 0] + a * axes[0, 0] + b * axes[1, 0]
            dy = axes[2, 1] + a * axes[0, 1] + b * axes[1, 1]
            dz = axes[2, 2] + a * axes[0, 2] + b * axes[1, 2]
            i, j, k, axis, along = first_hit(solids, top, ox, oy, oz, dx, dy, dz)
            if axis < 0:
                continue
            x, y, z = ox + dx * along, oy + dy * along, oz + dz * along
            out.solid[row, column] = solids[i, j, k]
            out.depth_m[row, column] = along * shading.size_m
            # The cell before the face, and where on the face.
            nx, ny, nz = 0, 0, 0
            if axis == 0:
                nx = -1 if dx > 0 else 1
                face, at, u, v = (0 if nx < 0 else 1), i, y - j, z - k
            elif axis == 1:
                ny = -1 if dy > 0 else 1
                face, at, u, v = (2 if ny < 0 else 3), j, x - i, z - k
            else:
                nz = -1 if dz > 0 else 1
                face, at, u, v = (4 if nz < 0 else 5), k, x - i, y - j
            out.plane[row, column] = face * (1 << 24) + at
            sun = shading.suns[(row % samples) * samples + column % samples]
            lit = shading.facing[face, 1]
            if lit > 0.0:
                _, _, _, shadow, _ = first_hit(
                    solids, top, x + nx * 1e-4, y + ny * 1e-4, z + nz * 1e-4, sun[0], sun[1], sun[2]
                )
                if shadow >= 0:
                    lit = 0.0
            sky = _openness(volume.density, volume.stride, x, y, z, nx, ny, nz)
            corner = _corner_light(solids, i + nx, j + ny, k + nz, axis, u, v)
            light = shading.facing[face, 0] * (0.45 + 0.55 * sky) * (0.75 + 0.25 * corner) + lit * (0.8 + 0.2 * sky)
            if shading.lines > 0.0:
                border = min(min(u, 1.0 - u), min(v, 1.0 - v))
                across = focal / along * border / samples
                light *= 1.0 - shading.lines * max(0.0, 1.0 - across)
            out.light[row, column] = light


# Light: one sun to the side of the camera, and the sky.

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


def _face_light(light: Light) -> NDArray[np.float64]:
    """Return the light on the six faces of a cell (-x, +x, -y, +y, -z, +z): (6, 2) from the sky, from the sun."""
    normals = np.array([[-1, 0, 0], [1, 0, 0], [0, -1, 0], [0, 1, 0], [0, 0, -1], [0, 0, 1]], np.float64)
    return light_on(normals, light)


def _sky_density(solids: NDArray[np.unsignedinteger], voxel_size_m: float) -> tuple[NDArray[np.float32], int]:
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
def _openness(
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
def _corner_light(solids: NDArray[np.unsignedinteger], i: int, j: int, k: int, axis: int, u: float, v: float) -> float:
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
