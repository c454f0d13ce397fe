"""Where the answers are judged: a fixed sample of parts, and all the cells of their boxes."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from benchmarks.voxelize.case import Scene, Window

LONGEST_VOX = 40
"""Of a longer box only a stretch of this length, around a random triangle, is judged."""
_DENSE_VOX = 12
_SEED = 20240611


def sample_windows(scene: Scene, *, dense: bool, count: int = 60) -> list[Window]:
    """Return the windows of a case, at most ``count`` of them; deterministic.

    Parts are taken evenly over the list, so that every kind and storey of a building is represented; the window of a
    part is its box and one cell around it. A single dense body is judged in many small windows along its surface, and
    in some deep inside.
    """
    rng = np.random.default_rng(_SEED)
    parts = len(scene.starts) - 1
    chosen = np.unique(np.linspace(0, parts - 1, min(count, parts)).round().astype(np.int64))
    bounds = _part_ranges(scene)
    boxes = []
    if dense:
        for n in range(count):
            middle = _on_surface(scene, 0, rng)
            if n % 6 == 5:
                middle = (middle + (bounds[0, 0] + bounds[0, 1]) // 2) // 2
            boxes.append((middle - _DENSE_VOX // 2, middle + _DENSE_VOX // 2))
    else:
        for part in chosen.tolist():
            low, high = bounds[part, 0] - 1, bounds[part, 1] + 1
            middle = _on_surface(scene, part, rng)
            long = high - low > LONGEST_VOX
            start = np.clip(middle - LONGEST_VOX // 2, low, np.maximum(low, high - LONGEST_VOX))
            boxes.append((np.where(long, start, low), np.where(long, start + LONGEST_VOX, high)))
    windows = []
    for low, high in boxes:
        low, high = np.maximum(low, scene.low), np.minimum(high, scene.high)
        reach = np.all((bounds[:, 0] < high) & (bounds[:, 1] > low), axis=1)
        windows.append(Window(low, high, np.flatnonzero(reach)))
    return windows


def _part_ranges(scene: Scene) -> NDArray[np.int64]:
    """Return (P, 2, 3): half-open cells around each part, borders included."""
    bounds = np.stack([mesh.bounds_m for mesh in scene.parts]) / scene.voxel_size_m
    ranges: NDArray[np.int64] = np.stack([np.floor(bounds[:, 0]), np.ceil(bounds[:, 1])], axis=1).astype(np.int64)
    ranges += np.array([[-1], [1]])
    return ranges


def _on_surface(scene: Scene, part: int, rng: np.random.Generator) -> NDArray[np.int64]:
    """Return a cell at the middle of a part's triangle, large ones more often."""
    triangles = scene.parts[part].triangles_m
    area = np.linalg.norm(np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]), axis=1)
    face = rng.choice(len(triangles), p=area / area.sum())
    cell: NDArray[np.int64] = np.floor(triangles[face].mean(axis=0) / scene.voxel_size_m).astype(np.int64)
    return cell
