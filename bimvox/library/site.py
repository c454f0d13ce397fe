"""Sites built from a site file, or from a building with everything guessed."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from bimvox.bim.building import Building
from bimvox.bim.read import ReadOptions, read_building
from bimvox.bim.strays import without_strays
from bimvox.crane.tower_crane import TowerCrane
from bimvox.files import require_regular
from bimvox.grid.voxel_grid import all_part_cells
from bimvox.library.arguments import insist, path_of, size_m, text
from bimvox.library.building import say_notes
from bimvox.library.obstructions import rasterise, survey_of
from bimvox.progress import Listener, Progress, progress_of
from bimvox.site import guess
from bimvox.site.build import PlacedModel, build_site
from bimvox.site.component import Component, IntVec
from bimvox.site.config.file import SITE_FILE, load_site_config, read_site_file
from bimvox.site.config.site_config import ModelConfig, SiteConfig
from bimvox.site.config.template import site_toml
from bimvox.site.extent import site_extent, with_room_for_slings
from bimvox.site.machine import cranes_of
from bimvox.site.machine_names import machines_called
from bimvox.site.obstructions.coordinates import Survey
from bimvox.site.placement import place_building
from bimvox.site.programme import ATTACHED
from bimvox.site.site import Site
from bimvox.voxelization.building import voxelize_building

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
        return survey_of(self.files, json.dumps(dict(self.georeference)), self.site)

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
    told, path = progress_of(progress), path_of("load_site", path, "a site file")
    read = read_site(
        path,
        told,
        model=None if model is None else path_of("load_site", model, "a model"),
        programme=None if programme is None else path_of("load_site", programme, "a programme"),
    )
    return built_site(read.config, read.building, read.files, told)


def read_site(path: Path, told: Progress, *, model: Path | None = None, programme: Path | None = None) -> ReadSite:
    """Return a site file and its building; the arguments and errors are those of :func:`load_site`."""
    require_regular(path)
    content = read_site_file(path)
    config = load_site_config(path, content, model=model, programme=programme)
    _ = config.programme  # is refused before the model is read, which takes its time
    given = config.model
    building = read_building(given.path, config.read_options, told.report)
    say_notes(building, told)
    told.stage("site")
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
    told = progress_of(progress)
    building = without_strays(insist("guess_site", building, Building, "building"))
    voxel_size_m = size_m("voxel_size_m", voxel_size_m)
    crane = text("crane", crane, "give the name of a crane: hammerhead, luffing, mobile, or a machine of the catalogue")
    options = read_with or ReadOptions()
    told.stage("guess")
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
    return built_site(config, building, {SITE_FILE: toml.encode()}, told)


def built_site(config: SiteConfig, building: Building, files: Mapping[str, bytes], progress: Progress) -> LoadedSite:
    """Return the site of a complete site file and its building.

    Args:
        config: The site file, complete.
        building: As read.
        files: The files that go into a log.
        progress: Receives the stages.
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
    for note in site.notes:
        progress.note(note)
    progress.finish()
    # The reader has said these, and a plan repeats them: what was left out, joined or assumed is signed too.
    site = replace(site, notes=(*site.notes, *building.notes))
    return LoadedSite(config, site, dict(files), building.georeference)
