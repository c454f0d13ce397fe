"""Buildings and sites read from files, or with everything guessed; their voxel grids; obstructions read into sites."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from hashlib import sha256
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from bimvox.bim.building import Building, TriangleMesh
from bimvox.bim.read import IFC_SUFFIXES, MESH_SUFFIXES, ReadOptions, read_building
from bimvox.bim.strays import without_strays
from bimvox.crane.tower_crane import TowerCrane
from bimvox.errors import InputError, ObstructionFileError, shown
from bimvox.files import read_input, require_input, require_regular, resolved
from bimvox.grid.frame import GridFrame
from bimvox.grid.voxel_grid import VoxelGrid, all_part_cells
from bimvox.library.arguments import insist, path_of, text, whole
from bimvox.log.plan_log import GEOREFERENCE, PlanLog
from bimvox.progress import Listener, Progress, progress_of
from bimvox.site import guess
from bimvox.site.build import PlacedModel, build_site, with_obstructions
from bimvox.site.catalogue import machines_called
from bimvox.site.component import Component, IntVec
from bimvox.site.config.file import SITE_FILE, load_site_config, read_site_file
from bimvox.site.config.site_config import ModelConfig, SiteConfig
from bimvox.site.config.template import site_toml
from bimvox.site.machine import cranes_of
from bimvox.site.map_frame import ifc_to_map, map_of_model
from bimvox.site.nested import toml_values
from bimvox.site.obstructions.cells import MOST_NAMED
from bimvox.site.obstructions.coordinates import Survey, in_site_frame
from bimvox.site.obstructions.file import parse_obstructions, read_obstruction_file
from bimvox.site.obstructions.obstruction_set import ObstructionSet
from bimvox.site.obstructions.point_file import SCAN_SUFFIXES, is_scan
from bimvox.site.placement import place_building, site_extent, with_room_for_slings
from bimvox.site.programme import ATTACHED
from bimvox.site.site import Site
from bimvox.voxelization.building import voxelize_building
from bimvox.voxelization.lattice import default_voxel_size_m
from bimvox.voxelization.part import voxelize_mesh


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
    reporter, path = progress_of(progress), require_input(path_of("read", path))
    options = ReadOptions(select=select, unit=unit, up=up, assemblies=assemblies)
    building = read_building(path, options, reporter.report)
    reporter.finish()
    say_notes(building, reporter)
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
    reporter, building = progress_of(progress), insist("voxelize", building, Building, "building")
    edge_m = _size_m("voxel_size_m", voxel_size_m) or default_voxel_size_m(building.bounds_m)
    grid = voxelize_building(building, edge_m, threads=whole("threads", threads, 1) or 1, progress=reporter.report)
    reporter.finish()
    return grid


def say_notes(building: Building, progress: Progress) -> None:
    """Report the notes of the reader."""
    for note in building.notes:
        progress.note(note)


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

    ``survey``: what is known about the coordinates of its files; ``scan_id``: id of a scan; default: the file's name
    without its suffix.
    """
    return _obstructions(path, scan_id)(site, survey)


def _survey_of(files: Mapping[str, bytes], georeference: str, site: Site) -> Survey:
    """Return what is known about the coordinates of a site's obstruction files.

    ``files``: the files that go into its log, by name; ``georeference``: the map conversion of its model as JSON, as a
    log's metadata have it; empty if it has none.
    """
    stated = "site"
    with suppress(ValueError):
        stated = str(toml_values(files.get(SITE_FILE, b"").decode("utf-8-sig")).get("coordinates"))
    return Survey(map_of_model(georeference, site.source), "map" if stated == "map" else "site")


def survey_in(log: PlanLog) -> Survey:
    """Return what a log states about the coordinates of its obstruction file."""
    return _survey_of(log.attachments, log.metadata.get(GEOREFERENCE, ""), log.plan.site)


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


MACHINE = "machine."
"""Begins the name of a machine's file among the files attached to a log."""
OBSTRUCTIONS = "obstructions."
"""Begins the name of an obstruction file among the files attached to a log."""


LISTED = ("json", "toml")
"""Formats of an obstruction file that lists obstructions by id, and may name other files."""


def attached_as(obstructions: Path) -> str:
    """Return the name of an obstruction file among the files attached to a log; without a suffix it is JSON.

    A scan is called after its file: the log's copy keeps that name, so that it can be read again as the same.
    """
    kind = obstructions.suffix.lower()[1:] or "json"
    return OBSTRUCTIONS + (kind if kind in LISTED else f"{obstructions.stem}.{kind}")


@dataclass(frozen=True, slots=True, eq=False)
class LoadedSite:
    """A site and what it was made from.

    Attributes:
        config: The site file with all defaults filled in.
        site: The site, without obstructions.
        files: The files that go into a log unchanged: name -> bytes.
        georeference: The model's map conversion as plain values; empty if it has none.
    """

    config: SiteConfig
    site: Site
    files: dict[str, bytes]
    georeference: Mapping[str, str | float]

    def __repr__(self) -> str:
        return f"<Loaded{repr(self.site)[1:]}"

    @property
    def components(self) -> tuple[Component, ...]:
        """What is lifted."""
        return self.site.components

    @property
    def cranes(self) -> tuple[TowerCrane, ...]:
        """The cranes; empty on a site without a crane."""
        return self.site.cranes

    @property
    def notes(self) -> tuple[str, ...]:
        """Notes about the site, one sentence each."""
        return self.site.notes

    @property
    def survey(self) -> Survey:
        """What is known about the coordinates of its obstruction files."""
        return _survey_of(self.files, json.dumps(dict(self.georeference)), self.site)

    def to_toml(self) -> str:
        """Return the site file, complete and commented; :func:`load_site` reads it back."""
        return site_toml(self.config)


@dataclass(frozen=True, slots=True, eq=False)
class ReadSite:
    """A site file and its building, before its cells are known.

    Attributes:
        config: The site file with all defaults filled in, in the site's frame.
        building: Its model, as read.
        files: The files that go into a log unchanged: name -> bytes.
    """

    config: SiteConfig
    building: Building
    files: dict[str, bytes]


def load_site(
    path: Path | str,
    progress: Listener = None,
    *,
    model: Path | str | None = None,
    programme: Path | str | None = None,
) -> LoadedSite:
    """Return the site of a site file, without obstructions; its model is read and voxelized.

    Args:
        path: The site file (``.site.toml``).
        progress: A ``Progress``, or a function that takes a line of text.
        model: The model; None: where the site file says.
        programme: The programme whose order is wished; None: the one that the site file names, if any.

    Raises:
        ConfigError: If a key is unknown or a value impossible; ``key`` is its place in the file.
        FileError: If the site file or its model is missing or cannot be used.
        SelectionError: If nothing is to be lifted.
    """
    reporter, path = progress_of(progress), path_of("load_site", path, "a site file")
    read = read_site(
        path,
        reporter,
        model=None if model is None else path_of("load_site", model, "a model"),
        programme=None if programme is None else path_of("load_site", programme, "a programme"),
    )
    return built_site(read.config, read.building, read.files, reporter)


def read_site(path: Path, reporter: Progress, *, model: Path | None = None, programme: Path | None = None) -> ReadSite:
    """Return a site file and its building; the arguments and errors are those of :func:`load_site`."""
    require_regular(path)
    content = read_site_file(path)
    config = load_site_config(path, content, model=model, programme=programme)
    _ = config.programme  # is refused before the model is read, which takes its time
    given = config.model
    building = read_building(given.path, config.read_options, reporter.report)
    say_notes(building, reporter)
    reporter.stage("site")
    files = {SITE_FILE: content} | {MACHINE + name: data for name, data in config.machine_files.items()}
    if config.programme_file is not None:
        files[ATTACHED + str(config.programme_name)] = config.programme_file
    return ReadSite(guess.complete_config(config, building), building, files)


def guess_site(
    building: Building,
    *,
    read_with: ReadOptions | None = None,
    voxel_size_m: float | None = None,
    crane: str | None = None,
    progress: Listener = None,
) -> LoadedSite:
    """Return a site for a building with everything guessed: cell size, ground, areas, yard, crane.

    ``site.to_toml()`` is the site file, to be edited and loaded with :func:`load_site`.

    Args:
        building: As read.
        read_with: The options that it was read with, for the site file; default: none.
        voxel_size_m: Edge of a cell in metres; default: guessed.
        crane: A kind of crane (``hammerhead``, ``luffing``, ``mobile``), a machine of the catalogue, or ``fictitious``;
            default: the smallest hammerhead that serves the site.
        progress: A ``Progress``, or a function that takes a line of text.

    Raises:
        SelectionError: If nothing is to be lifted.
        InputError: If ``building`` is not a building, the cell size is not positive, there is no such crane, or none
            can serve the site.
    """
    reporter = progress_of(progress)
    building = without_strays(insist("guess_site", building, Building, "building"))
    voxel_size_m = _size_m("voxel_size_m", voxel_size_m)
    crane = text("crane", crane, "give the name of a crane: hammerhead, luffing, mobile, or a machine of the catalogue")
    options = read_with or ReadOptions()
    reporter.stage("guess")
    config = guess.guess_site(
        building,
        ModelConfig(
            path=Path(building.source.name),
            select=options.select,
            unit=options.unit,  # type: ignore[arg-type]  # checked when the file was read
            up=options.up,
            assemblies=options.assemblies,
            voxel_size_m=voxel_size_m,
        ),
        machines=() if crane is None else machines_called(crane),
    )
    toml = site_toml(config, ground_why=guess.ground_why(config, building))
    return built_site(config, building, {SITE_FILE: toml.encode()}, reporter)


def built_site(config: SiteConfig, building: Building, files: Mapping[str, bytes], progress: Progress) -> LoadedSite:
    """Return the site of a complete site file and its building.

    ``files``: the files that go into a log.
    """
    placed, site_to_ifc = place_building(config, building)
    cranes = cranes_of(config)
    frame, shape = site_extent(config, placed, *cranes)

    def on_grid(shape: IntVec) -> Site:
        low = np.round(np.array(frame.origin_m) / frame.voxel_size_m).astype(np.int64)
        grid = voxelize_building(
            placed, frame.voxel_size_m, low_vox=low, high_vox=low + np.array(shape), progress=progress.report
        )
        progress.stage("site")
        parts = list(zip(placed.elements, all_part_cells(grid), strict=True))
        model = PlacedModel(parts, frame, shape, site_to_ifc, grid.source, placed.connections)
        return build_site(config, model, cranes=cranes, rasterise=rasterise)

    site = on_grid(shape)
    higher = with_room_for_slings(config, frame, shape, site.components)
    if higher != shape:
        site = on_grid(higher)
    for note in (*site.notes, *placed.notes[len(building.notes) :]):
        progress.note(note)
    progress.finish()
    # The reader has said the rest, and a plan repeats it: what was left out, joined or assumed is signed too.
    site = replace(site, notes=(*site.notes, *placed.notes))
    return LoadedSite(config, site, dict(files), building.georeference)


def _size_m(name: str, value: Any) -> float | None:
    """Return a length in metres, or None if there is none.

    Raises InputError: if it is not a positive number.
    """
    if value is None:
        return None
    try:
        length_m = math.nan if isinstance(value, str | bytes) else float(value)
    except (TypeError, ValueError):
        length_m = math.nan
    if not 0.0 < length_m < math.inf:
        raise InputError(f"{name} is {shown(value)}", hint="give a positive length in metres, for example 0.1")
    return length_m
