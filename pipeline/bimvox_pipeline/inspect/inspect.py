"""``bimvox inspect``: kind and content of a file."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from bimvox.errors import FileError
from bimvox.files import sha256_of
from bimvox.progress import Progress
from bimvox_pipeline.inspect.kind_file import check_kind_file, write_kind_file
from bimvox_pipeline.inspect.kinds import Kind, kind_of

if TYPE_CHECKING:
    from collections.abc import Callable

    from bimvox.grid.voxel_grid import VoxelGrid


_WITH_KINDS = (Kind.IFC, Kind.MESH, Kind.SITE)


def inspect(
    path: Path, progress: Progress, *, part: str | None = None, kind_file: Path | None = None
) -> dict[str, Any]:
    """Describe a file: its kind and content.

    Args:
        path: Any bimvox file, an IFC or a mesh; its content decides, not its name alone.
        progress: Receives stages and notes.
        part: Id or name of a part of a grid, to describe only that part, with its boxes.
        kind_file: Where to write the types of a model or a site as CSV, to be corrected there.

    Returns:
        ``kind``, ``file`` and the keys of that kind.

    Raises:
        FileError: If it is missing, damaged, or not of a known kind; or if ``kind_file`` exists.
        InputError: If the grid has no such part.
    """
    kind = kind_of(path)
    if kind_file is not None:
        if kind not in _WITH_KINDS:
            said = f"is of the kind {kind.value!r}; only models and sites have types of parts"
            raise FileError(path, said, hint="leave --csv out")
        check_kind_file(kind_file, [path])
    describe: dict[Kind, Callable[[Path, Progress], dict[str, Any]]] = {
        Kind.IFC: _model,
        Kind.MESH: _model,
        Kind.GRID: _grid,
        Kind.SITE: _site,
        Kind.LOG: _log,
        Kind.OBSTRUCTIONS: _obstructions,
        Kind.POLICY: _policy,
    }
    document = describe[kind](path, progress) if part is None else _one_part(path, kind, part, progress)
    if kind_file is not None:
        write_kind_file(kind_file, document["kinds"], document.get("corrections", ()), [path])
        document = {"csv": str(kind_file), **document}
    progress.finish()
    size = {} if path.is_dir() else {"bytes": path.stat().st_size}
    return {"kind": kind.value, "file": str(path), **size, **document}


def _model(path: Path, progress: Progress) -> dict[str, Any]:
    progress.stage("read")
    from bimvox.bim.read import IFC_SUFFIXES, read_building
    from bimvox_pipeline.inspect.building import describe_building

    if kind_of(path) is Kind.IFC and path.suffix.lower() not in IFC_SUFFIXES:
        raise FileError(path, "holds IFC, but its name says otherwise", hint=f"rename it to {path.stem}.ifc")
    building = read_building(path, None, progress.report)
    progress.stage("describe")
    return describe_building(building)


def _one_part(path: Path, kind: Kind, part: str, progress: Progress) -> dict[str, Any]:
    from bimvox_pipeline.inspect.grid import describe_part

    if kind is not Kind.GRID:
        raise FileError(path, f"is of the kind {kind.value!r}; only a grid has parts", hint="leave --part out")
    return {"part": describe_part(_grid_of(path, progress), part)}


def _grid(path: Path, progress: Progress) -> dict[str, Any]:
    from bimvox_pipeline.inspect.grid import describe_grid

    return {"sha256": sha256_of(path), **describe_grid(_grid_of(path, progress))}


def _grid_of(path: Path, progress: Progress) -> VoxelGrid:
    from bimvox.grid.storage import read_grid

    progress.stage("read")
    with path.open("rb") as stream:
        return read_grid(stream, path.name)


def _site(path: Path, progress: Progress) -> dict[str, Any]:
    from bimvox_pipeline.inspect.site import describe_site

    return describe_site(path, progress)


def _log(path: Path, progress: Progress) -> dict[str, Any]:
    from bimvox_pipeline.inspect.log import describe_log

    progress.stage("read")
    return describe_log(path)


def _obstructions(path: Path, progress: Progress) -> dict[str, Any]:
    from bimvox.library.site import as_written
    from bimvox_pipeline.inspect.obstructions import describe_obstruction, extent_of, how_read

    progress.stage("read")
    found = as_written(path)
    head = {"sha256": sha256_of(path), **how_read(path, found)}
    described = [describe_obstruction(one) for one in found.obstructions]
    return {**head, **extent_of(described), "obstructions": described}


def _policy(path: Path, progress: Progress) -> dict[str, Any]:
    from bimvox.policy import store

    progress.stage("read")
    place = path.resolve()
    return store.load(place.name, folder=place.parent).manifest.to_dict()
