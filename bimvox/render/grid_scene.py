"""The picture of a voxelized building."""

from __future__ import annotations

from collections import Counter

import numpy as np
from numpy.typing import NDArray

from bimvox.grid.frame import GridFrame
from bimvox.grid.labels import Label
from bimvox.grid.voxel_grid import Part, VoxelGrid
from bimvox.render.colours import CLASSES, FLOOR, GROUND, OBSTRUCTION, STRUCTURE
from bimvox.render.scene import LegendEntry, Scene
from bimvox.render.solids import index_type
from bimvox.render.words import counted
from bimvox.site.construction import Rgb

_FLOOR_SHARE = 0.12
"""Width of the floor around the building, as a share of its longer side."""
_UNOWNED: dict[Label, Rgb] = {Label.GROUND: GROUND, Label.STRUCTURE: STRUCTURE, Label.OBSTRUCTION: OBSTRUCTION}


def scene_of_grid(grid: VoxelGrid, *, title: str = "") -> Scene:
    """Return the picture of a grid: parts by class, what is not lifted in gray.

    Where there is no ground, a floor takes the shadow.
    """
    counts = Counter(part.ifc_class for part in grid.parts if part.label is Label.COMPONENT)
    rgb_of_class = {name: CLASSES[min(n, len(CLASSES) - 1)] for n, (name, _) in enumerate(counts.most_common())}
    others = list(_UNOWNED)
    dtype = index_type(len(grid.parts) + len(others) + 2)
    # 0 nothing, 1 floor, then labels of cells that no part owns, then parts.
    first = 2 + len(others)
    solids = (grid.owners + first).astype(dtype)
    unowned = grid.owners < 0
    solids[unowned] = 0
    for n, label in enumerate(others):
        solids[unowned & (grid.labels == label)] = 2 + n
    palette = np.zeros((first + len(grid.parts), 3), np.uint8)
    palette[1] = FLOOR
    palette[2:first] = [_UNOWNED[label] for label in others]
    for n, part in enumerate(grid.parts):
        palette[first + n] = _rgb_of(part, rgb_of_class)
    has_ground = bool((grid.labels == Label.GROUND).any())
    frame, solids = (grid.frame, solids) if has_ground else on_floor(grid.frame, solids)
    legend = [LegendEntry(f"{name} ({counts[name]})", rgb_of_class[name]) for name in rgb_of_class]
    rest = Counter(part.label for part in grid.parts if part.label is not Label.COMPONENT)
    if rest[Label.STRUCTURE]:
        legend.append(LegendEntry(f"not lifted ({rest[Label.STRUCTURE]})", STRUCTURE))
    if rest[Label.GROUND]:
        legend.append(LegendEntry("ground", GROUND))
    x, y, z = grid.shape
    cells = f"{x} x {y} x {z} cells of {grid.frame.voxel_size_m:g} m"
    filled = int(np.count_nonzero(grid.labels))
    return Scene(
        frame=frame,
        solids=solids,
        palette=palette,
        legend=tuple(legend),
        title=title or str(grid.source.get("name", "")),
        caption=f"{counted(len(grid.parts), 'part')}, {cells}, {filled:,} filled",
    )


def on_floor(frame: GridFrame, solids: NDArray[np.unsignedinteger]) -> tuple[GridFrame, NDArray[np.unsignedinteger]]:
    """Return the solids on a floor (number 1) one cell thick and a little wider; empty solids stay as they are."""
    if not solids.any():
        return frame, solids
    margin = max(1, round(_FLOOR_SHARE * max(solids.shape[:2])))
    low = int(np.flatnonzero(solids.any(axis=(0, 1)))[0])
    padded = np.pad(solids[:, :, low:], ((margin, margin), (margin, margin), (1, 0)))
    padded[:, :, 0] = 1
    x, y, z = (float(n) for n in frame.corner_of(np.array([-margin, -margin, low - 1])))
    return GridFrame((x, y, z), frame.voxel_size_m), padded


def _rgb_of(part: Part, rgb_of_class: dict[str, Rgb]) -> Rgb:
    if part.label is Label.COMPONENT:
        return rgb_of_class[part.ifc_class]
    return GROUND if part.label is Label.GROUND else STRUCTURE
