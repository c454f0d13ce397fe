"""Obstructions read from a file, and the site with them."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from hashlib import sha256
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bimvox.bim.building import Building, TriangleMesh
from bimvox.bim.read import IFC_SUFFIXES, MESH_SUFFIXES, read_building
from bimvox.errors import ObstructionFileError
from bimvox.files import read_input, require_input, resolved
from bimvox.grid.frame import GridFrame
from bimvox.log.plan_log import GEOREFERENCE, PlanLog
from bimvox.progress import Progress
from bimvox.site.build import with_obstructions
from bimvox.site.config.file import SITE_FILE
from bimvox.site.map_frame import ifc_to_map, map_of_model
from bimvox.site.nested import toml_values
from bimvox.site.obstructions.coordinates import Survey, in_site_frame
from bimvox.site.obstructions.file import parse_obstructions, read_obstruction_file
from bimvox.site.obstructions.notes import MOST_NAMED
from bimvox.site.obstructions.obstruction_set import ObstructionSet
from bimvox.site.obstructions.point_file import SCAN_SUFFIXES, is_scan
from bimvox.site.site import Site
from bimvox.voxelization.part import voxelize_mesh

KINDS = frozenset({".json", ".toml", *IFC_SUFFIXES, *MESH_SUFFIXES, *SCAN_SUFFIXES})
"""Suffixes of the files that hold obstructions."""


@dataclass(frozen=True, slots=True, eq=False)
class ReadObstructions:
    """An obstruction file that has been read and can be used.

    Attributes:
        path: The file.
        content: Its bytes.
        on: Its obstructions in the frame of a site.
    """

    path: Path
    content: bytes
    on: Callable[[Site, Survey], ObstructionSet]


def read_obstructions(path: Path) -> ReadObstructions:
    """Return an obstruction file (JSON or TOML), or an IFC, mesh or point file, read before its site is.

    Raises:
        ObstructionFileError: If it cannot be used; names the place inside it.
        FileError: If it is missing or unreadable.
    """
    content = read_input(require_input(path))
    return ReadObstructions(path, content, _obstructions(path))


def load_obstructions(path: Path, site: Site, survey: Survey, *, scan_id: str | None = None) -> ObstructionSet:
    """Return the obstructions of a file on a site; errors as of :func:`read_obstructions`.

    Args:
        path: The file.
        site: The site.
        survey: What is known about the coordinates of its files.
        scan_id: Id of a scan; default: the file's name without its suffix.
    """
    return _obstructions(path, scan_id)(site, survey)


def survey_of(files: Mapping[str, bytes], georeference: str, site: Site) -> Survey:
    """Return what is known about the coordinates of a site's obstruction files.

    Args:
        files: The files that go into its log, by name.
        georeference: The map conversion of its model as JSON, as a log's metadata have it; empty if it has none.
        site: The site.
    """
    stated = "site"
    with suppress(ValueError):
        stated = str(toml_values(files.get(SITE_FILE, b"").decode("utf-8-sig")).get("coordinates"))
    return Survey(map_of_model(georeference, site.source), "map" if stated == "map" else "site")


def survey_in(log: PlanLog) -> Survey:
    """Return what a log states about the coordinates of its obstruction file."""
    return survey_of(log.attachments, log.metadata.get(GEOREFERENCE, ""), log.plan.site)


def _obstructions(path: Path, scan_id: str | None = None) -> Callable[[Site, Survey], ObstructionSet]:
    if path.suffix.lower() in IFC_SUFFIXES + MESH_SUFFIXES and not is_scan(path):
        building = read_building(path)
        if not building.elements:
            raise ObstructionFileError(path, "it contains no shape that could be an obstruction")
        if building.source.sha256 != sha256(read_input(path)).hexdigest():
            raise ObstructionFileError(
                path,
                "its triangles are in other files, and a log carries this one alone",
                hint='export a GLB, or name the file as the "mesh" of an obstruction in a JSON file',
            )
        return partial(_of_building, path, building)
    return partial(in_site_frame, as_written(path, scan_id))


def as_written(path: Path, scan_id: str | None = None) -> ObstructionSet:
    """Return the obstructions of an obstruction file or a scan in metres, in the coordinates of the file."""
    if not is_scan(path):
        return read_obstruction_file(path)
    entry = {"id": scan_id or path.stem, "points": path.name}
    document = json.dumps({"version": 1, "obstructions": [entry]}).encode()
    return parse_obstructions(document, path.name, resolved(path).parent)


def _of_building(path: Path, building: Building, site: Site, survey: Survey) -> ObstructionSet:
    """Return the obstructions of an IFC or mesh file, which is in the model's coordinates or has a map conversion."""
    meshes = [
        (element.id, TriangleMesh(element.mesh.vertices_m + building.origin_m, element.mesh.faces))
        for element in building.elements
    ]
    found = replace(ObstructionSet.from_meshes(meshes, path.name), coordinates=None)
    own_map = ifc_to_map(building.georeference, building.source.unit)
    if own_map == survey.ifc_to_map:
        own_map = None
    return in_site_frame(found, site, replace(survey, coordinates="model"), own_map=own_map)


def rasterise(mesh: TriangleMesh, frame: GridFrame, shape: tuple[int, int, int]) -> NDArray[np.int32]:
    """Return the (N, 3) int32 cells inside the grid that the solid of a mesh meets."""
    part = voxelize_mesh(mesh, frame.voxel_size_m, frame.origin_m, clip=((0, 0, 0), shape))
    cells = np.argwhere(part.cells) + part.low
    inside = ((cells >= 0) & (cells < np.array(shape))).all(axis=1)
    return cells[inside].astype(np.int32)


def obstructed(site: Site, obstructions: ObstructionSet, progress: Progress) -> Site:
    """Return the site with these obstructions in place of its own; clipped ones are noted."""
    changed = with_obstructions(site, obstructions, rasterise)
    first, others = changed.obstruction_notes[:MOST_NAMED], changed.obstruction_notes[MOST_NAMED:]
    for note in (*first, *others[-1:]):  # the last one may count obstructions
        progress.note(note)
    if len(others) > 1:
        progress.note(f"the log has {len(others) - 1:,} more notes about obstructions")
    return changed
