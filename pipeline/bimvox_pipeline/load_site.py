"""From a site file to a site: read, place, voxelize, build."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from bimvox.errors import ObstructionFileError
from bimvox_pipeline.artifacts import require_input
from bimvox_pipeline.progress import Progress

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bimvox.bim.building import Building, TriangleMesh
    from bimvox.grid.frame import GridFrame
    from bimvox.site.config import SiteConfig
    from bimvox.site.obstructions.obstruction_set import ObstructionSet
    from bimvox.site.site import Site

    Rasterise = Callable[[TriangleMesh, GridFrame, tuple[int, int, int]], "NDArray[np.int32]"]


@dataclass(frozen=True, slots=True, eq=False)
class LoadedSite:
    """A site and what it was made from.

    Attributes:
        config: The site file, everything that it leaves out filled in.
        site: The site, without obstructions.
        files: What goes into the log as it is: file name -> bytes.
        georeference: The model's map conversion, as plain values; empty where it has none.
    """

    config: SiteConfig
    site: Site
    files: dict[str, bytes]
    georeference: Mapping[str, str | float]


def load_site(path: Path, progress: Progress) -> LoadedSite:
    """Read a site file and its model, and build the site without obstructions.

    Args:
        path: The site file.
        progress: Told of the stages.
    """
    from bimvox.bim.read import ReadOptions, read_building
    from bimvox.grid.part_cells import all_part_cells
    from bimvox.site.build import build_site
    from bimvox.site.config_file import load_site_config
    from bimvox.site.extent import site_extent
    from bimvox.site.guess import complete_config
    from bimvox.site.machine import cranes_of
    from bimvox.site.placement import place_building
    from bimvox.voxelization.building import voxelize_building

    require_input(path)
    text = path.read_bytes()
    config = load_site_config(path)
    model = config.model
    options = ReadOptions(select=model.select, unit=model.unit, up=model.up, assemblies=model.assemblies)
    building = read_building(model.path, options, progress.report)
    say_notes(building, progress)
    progress.stage("site")
    config = complete_config(config, building)
    placed, site_to_ifc = place_building(config, building)
    cranes = cranes_of(config)
    frame, shape = site_extent(config, placed, *cranes)
    low = np.round(np.array(frame.origin_m) / frame.voxel_size_m).astype(np.int64)
    grid = voxelize_building(
        placed, frame.voxel_size_m, low_vox=low, high_vox=low + np.array(shape), progress=progress.report
    )
    progress.stage("site")
    site = build_site(
        config,
        list(zip(placed.elements, all_part_cells(grid), strict=True)),
        frame,
        shape,
        cranes=cranes,
        rasterise=rasterise,
        site_to_ifc=site_to_ifc,
        source=grid.source,
        connections=placed.connections,
    )
    for note in site.notes:
        progress.note(note)
    progress.finish()
    return LoadedSite(config, site, {"site.toml": text}, building.georeference)


def load_obstructions(path: Path, site: Site) -> ObstructionSet:
    """Read what is in the way: an obstruction file (JSON or TOML), or an IFC, mesh or point file as it is.

    Args:
        path: The file.
        site: The site: IFC and mesh files are in the model's coordinates, and are put into the site's frame. Scans
            (files of points) are in the site's frame, in metres.

    Raises:
        ObstructionFileError: If it cannot be used; names the place inside it.
        FileError: If it is missing or unreadable.
    """
    from bimvox.bim.building import TriangleMesh
    from bimvox.bim.read import IFC_SUFFIXES, MESH_SUFFIXES, read_building
    from bimvox.site.obstructions.file import parse_obstructions
    from bimvox.site.obstructions.obstruction_set import ObstructionSet
    from bimvox.site.obstructions.point_file import is_scan

    if is_scan(path):
        entry = {"id": path.stem, "points": path.name}
        return parse_obstructions(
            json.dumps({"version": 1, "obstructions": [entry]}).encode(), path.name, path.resolve().parent
        )
    if path.suffix.lower() not in IFC_SUFFIXES + MESH_SUFFIXES:
        return parse_obstructions(path.read_bytes(), path.name, path.resolve().parent)
    building = read_building(path)
    ifc_to_site = np.linalg.inv(site.site_to_ifc)
    meshes = []
    for element in building.elements:
        points = np.c_[element.mesh.vertices_m + building.origin_m, np.ones(len(element.mesh.vertices_m))]
        meshes.append((element.id, TriangleMesh((points @ ifc_to_site.T)[:, :3], element.mesh.faces)))
    if not meshes:
        raise ObstructionFileError(path, "holds no shape that could be in the way")
    return ObstructionSet.from_meshes(meshes, path.name)


def rasterise(mesh: TriangleMesh, frame: GridFrame, shape: tuple[int, int, int]) -> NDArray[np.int32]:
    """Return the (N, 3) int32 cells inside the grid that the solid of a mesh meets."""
    from bimvox.voxelization.part import voxelize_mesh

    part = voxelize_mesh(mesh, frame.voxel_size_m, frame.origin_m, clip=((0, 0, 0), shape))
    cells = np.argwhere(part.cells) + part.low
    inside = ((cells >= 0) & (cells < np.array(shape))).all(axis=1)
    return cells[inside].astype(np.int32)


def say_notes(building: Building, progress: Progress) -> None:
    """Pass on what the reader noticed."""
    for note in building.notes:
        progress.note(note)
