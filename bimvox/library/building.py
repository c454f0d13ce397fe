"""Buildings read from files, and their voxel grids."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

from bimvox.bim.building import Building
from bimvox.bim.read import ReadOptions, read_building
from bimvox.files import require_input
from bimvox.grid.voxel_grid import VoxelGrid
from bimvox.library.arguments import insist, path_of, size_m, whole
from bimvox.progress import Listener, Progress, progress_of
from bimvox.voxelization.building import voxelize_building
from bimvox.voxelization.lattice import default_voxel_size_m


def read(
    path: Path | str,
    *,
    select: str | None = None,
    unit: str | None = None,
    up: Literal["y", "z"] | None = None,
    assemblies: Literal["whole", "parts"] = "whole",
    progress: Listener = None,
) -> Building:
    """Return the building of an IFC or mesh file: its elements with triangles in metres, z up.

    Args:
        path: ``.ifc``, ``.ifczip``, ``.stl``, ``.obj``, ``.ply``, ``.off``, ``.glb``, ``.gltf`` or ``.3mf``.
        select: What is lifted: an IfcOpenShell selector (``IfcColumn, IfcBeam``), for meshes names with wildcards.
            None selects by class (IFC) or everything (meshes).
        unit: Length unit of a mesh file (``m``, ``mm``, ``ft`` ...) that does not state one; default metres.
        up: Axis of a mesh file that points up.
        assemblies: ``whole`` lifts an assembly in one piece if that makes sense, ``parts`` lifts each part alone.
        progress: A ``Progress``, or a function that takes a line of text.

    Raises:
        FileError: If the file is missing or cannot be used (``IfcError``, ``MeshError``); ``path`` names it.
        SelectionError: If nothing is selected.
        InputError: If an argument is of another kind, or an option is out of range.
    """
    told, path = progress_of(progress), require_input(path_of("read", path))
    options = ReadOptions(select=select, unit=unit, up=up, assemblies=assemblies)
    building = read_building(path, options, told.report)
    told.finish()
    say_notes(building, told)
    return building


def voxelize(
    building: Building, voxel_size_m: float | None = None, *, threads: int = 1, progress: Listener = None
) -> VoxelGrid:
    """Return the labelled voxel grid of a building, indexed [x, y, z].

    Args:
        building: As read.
        voxel_size_m: Edge of a cell in metres; None: the smallest round size that keeps the grid below 20 million
            cells.
        threads: Parts voxelized in parallel; the grid does not depend on it.
        progress: A ``Progress``, or a function that takes a line of text.

    Raises:
        InputError: If ``building`` is not a building, or a number is out of range.
        GridTooLargeError: If there would be too many cells; ``fitting_voxel_size_m`` is a size that fits.
    """
    told, building = progress_of(progress), insist("voxelize", building, Building, "building")
    edge_m = size_m("voxel_size_m", voxel_size_m) or default_voxel_size_m(building.bounds_m)
    grid = voxelize_building(building, edge_m, threads=whole("threads", threads, 1) or 1, progress=told.report)
    told.finish()
    return grid


def say_notes(building: Building, progress: Progress) -> None:
    """Report the notes of the reader."""
    for note in building.notes:
        progress.note(note)
