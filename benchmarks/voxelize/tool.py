"""The interface of a measured voxelizer, and the list of all of them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from benchmarks.voxelize.case import Scene, Window

Masks = NDArray[np.bool_]


class Voxelizer(Protocol):
    """A voxelizer of a scene: created from it (not timed), run (timed), queried (not timed)."""

    def run(self) -> None:
        """Voxelize, and keep the result."""

    def forget(self) -> None:
        """Drop the result."""

    def cells_in(self, window: Window) -> Masks:
        """Return the cells of a window.

        Tools that know the parts: (P, A, B, C), one mask for each of the window's parts. Others: (A, B, C).
        """

    def solid_cells(self) -> int | None:
        """Return how many cells of the whole grid are not air, if the tool counts them anyway."""


@dataclass(frozen=True, slots=True)
class ToolInfo:
    """The properties of a tool.

    Attributes:
        key: Unique key of the tool.
        title: For the table.
        distribution: The package whose version is reported.
        solid: Whether it fills the interior; a surface is judged only on the cells that a boundary runs through.
        by_part: Whether it distinguishes parts.
        labels: What the tool records for a cell, for the table.
        dense: Whether it is run on a single solid body; not if another tool gives the same there.
    """

    key: str
    title: str
    distribution: str
    solid: bool
    by_part: bool
    labels: str
    dense: bool = True


OURS = ToolInfo("bimvox", "bimvox", "bimvox", solid=True, by_part=True, labels="owner, and the share of every part")
PEERS = (
    ToolInfo("open3d", "Open3D surface", "open3d", solid=False, by_part=False, labels="none"),
    ToolInfo("pyvista-mask", "PyVista, one mask", "pyvista", solid=True, by_part=False, labels="none"),
    ToolInfo(
        "pyvista-parts", "PyVista, per part", "pyvista", solid=True, by_part=True, labels="one mask a part", dense=False
    ),
    ToolInfo(
        "sparse-cubes", "sparse-cubes, per part", "sparse-cubes", solid=True, by_part=True, labels="one list a part"
    ),
    ToolInfo("trimesh-ray", "trimesh ray", "trimesh", solid=False, by_part=False, labels="none"),
    ToolInfo("trimesh-subdivide", "trimesh subdivide", "trimesh", solid=False, by_part=False, labels="none"),
)
TOOLS = {tool.key: tool for tool in (OURS, *PEERS)}


def make_voxelizer(key: str, scene: Scene) -> Voxelizer:
    """Import a tool and give it the scene's triangles in its own form.

    Raises:
        ImportError: If the tool is not installed, or cannot be loaded.
    """
    if key == "bimvox":
        from benchmarks.voxelize.ours import Bimvox

        return Bimvox(scene)
    if key == "open3d":
        from benchmarks.voxelize.peer_open3d import Open3dSurface

        return Open3dSurface(scene)
    if key.startswith("pyvista"):
        from benchmarks.voxelize.peer_pyvista import PyvistaMask, PyvistaParts

        return PyvistaMask(scene) if key == "pyvista-mask" else PyvistaParts(scene)
    if key == "sparse-cubes":
        from benchmarks.voxelize.peer_sparse_cubes import SparseCubesParts

        return SparseCubesParts(scene)
    from benchmarks.voxelize.peer_trimesh import TrimeshSurface

    return TrimeshSurface(scene, key.removeprefix("trimesh-"))


def mask_of(cells: NDArray[np.integer], window: Window) -> Masks:
    """Return a window's mask of a list of lattice cells: (N, 3) -> (A, B, C)."""
    mask = np.zeros(window.shape, np.bool_)
    here = cells[np.all((cells >= window.low) & (cells < window.high), axis=1)] - window.low
    mask[tuple(here.T)] = True
    return mask


def cut_out(mask: NDArray[np.bool_], low: NDArray[np.int64], window: Window) -> Masks:
    """Return a window's part of a dense mask whose first cell is the lattice cell ``low``; outside it is False."""
    out = np.zeros(window.shape, np.bool_)
    start, stop = np.maximum(low, window.low), np.minimum(low + mask.shape, window.high)
    if np.all(stop > start):
        to = tuple(slice(int(a), int(b)) for a, b in zip(start - window.low, stop - window.low, strict=True))
        of = tuple(slice(int(a), int(b)) for a, b in zip(start - low, stop - low, strict=True))
        out[to] = mask[of]
    return out
