"""The picture of a voxelized building."""

from __future__ import annotations

from collections import Counter

import numpy as np
from numpy.typing import NDArray

from bimvox.grid.frame import GridFrame, Label
from bimvox.grid.voxel_grid import Part, VoxelGrid
from bimvox.rendering.colours import CLASSES, FLOOR, GROUND, STRUCTURE
from bimvox.rendering.scene.scene import LegendEntry, Scene
from bimvox.rendering.scene.solids import index_type
from bimvox.rendering.words import counted
from bimvox.site.construction import Rgb

_FLOOR_SHARE = 0.12
"""Width of the floor around the building, as a share of its longer side."""


def scene_of_grid(grid: VoxelGrid, *, title: str = "") -> Scene:
    """Return the picture of a grid: components coloured by class, other parts gray.

    Without ground, a floor is added to receive the shadow.
    """
    # 0 empty, 1 floor, then parts.
    numbers = np.arange(1, len(grid.parts) + 2, dtype=index_type(len(grid.parts) + 2))
    numbers[0] = 0
    solids = grid.owners.mapped(numbers)
    counts = _components_by_class(grid)
    rgb_of_class = _rgb_by_class(counts)
    palette = np.concatenate([np.array([(0, 0, 0), FLOOR], np.uint8), part_colours(grid)])
    cells = grid.counts()
    has_ground = bool(cells.get("ground"))
    frame, solids = (grid.frame, solids) if has_ground else on_floor(grid.frame, solids)
    legend = [LegendEntry(f"{name} ({counts[name]})", rgb_of_class[name]) for name in rgb_of_class]
    rest = Counter(part.label for part in grid.parts if part.label is not Label.COMPONENT)
    if rest[Label.STRUCTURE]:
        legend.append(LegendEntry(f"not lifted ({rest[Label.STRUCTURE]})", STRUCTURE))
    if rest[Label.GROUND]:
        legend.append(LegendEntry("ground", GROUND))
    x, y, z = grid.shape
    filled = sum(cells.values()) - cells["air"]
    return Scene(
        frame=frame,
        solids=solids,
        palette=palette,
        legend=tuple(legend),
        title=title or str(grid.source.get("name", "")),
        caption=f"{counted(len(grid.parts), 'part')}, {x} x {y} x {z} cells of {grid.frame.voxel_size_m:g} m, "
        f"{filled:,} filled",
    )


def on_floor(frame: GridFrame, solids: NDArray[np.unsignedinteger]) -> tuple[GridFrame, NDArray[np.unsignedinteger]]:
    """Return the solids on a slightly wider floor (number 1), one cell thick; empty solids are returned unchanged."""
    if not solids.any():
        return frame, solids
    margin = max(1, round(_FLOOR_SHARE * max(solids.shape[:2])))
    low = int(np.flatnonzero(solids.any(axis=(0, 1)))[0])
    padded = np.pad(solids[:, :, low:], ((margin, margin), (margin, margin), (1, 0)))
    padded[:, :, 0] = 1
    x, y, z = (float(n) for n in frame.corner_of(np.array([-margin, -margin, low - 1])))
    return GridFrame((x, y, z), frame.voxel_size_m), padded


def part_colours(grid: VoxelGrid) -> NDArray[np.uint8]:
    """Return the colour of every part, (P, 3) uint8 sRGB: components by class, other parts gray."""
    rgb_of_class = _rgb_by_class(_components_by_class(grid))
    colours = [_rgb_of(part, rgb_of_class) for part in grid.parts]
    return np.array(colours, np.uint8).reshape(-1, 3)


def _components_by_class(grid: VoxelGrid) -> Counter[str]:
    return Counter(part.ifc_class for part in grid.parts if part.label is Label.COMPONENT)


def _rgb_by_class(counts: Counter[str]) -> dict[str, Rgb]:
    return {name: CLASSES[min(n, len(CLASSES) - 1)] for n, (name, _) in enumerate(counts.most_common())}


def _rgb_of(part: Part, rgb_of_class: dict[str, Rgb]) -> Rgb:
    if part.label is Label.COMPONENT:
        return rgb_of_class[part.ifc_class]
    return GROUND if part.label is Label.GROUND else STRUCTURE
