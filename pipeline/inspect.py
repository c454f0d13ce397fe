"""What a file is and what it holds."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from bimvox.errors import FileError
from pipeline.artifacts import sha256_of
from pipeline.kinds import Kind, kind_of

if TYPE_CHECKING:
    from collections.abc import Callable

    from pipeline.progress import Progress


def inspect(path: Path, progress: Progress) -> dict[str, Any]:
    """Say what a file is and what it holds.

    Args:
        path: Any of our files, an IFC or a mesh; what it is is told by what it holds, not by its name alone.
        progress: Is told of stages and notes.

    Returns:
        ``kind``, ``file`` and what fits the kind.

    Raises:
        FileError: If it is missing, damaged, or nothing that bimvox knows.
    """
    kind = kind_of(path)
    describe: dict[Kind, Callable[[Path, Progress], dict[str, Any]]] = {
        Kind.IFC: _model,
        Kind.MESH: _model,
        Kind.GRID: _grid,
        Kind.SITE: _site,
        Kind.LOG: _log,
        Kind.OBSTRUCTIONS: _obstructions,
        Kind.POLICY: _policy,
    }
    document = describe[kind](path, progress)
    progress.finish()
    size = {} if path.is_dir() else {"bytes": path.stat().st_size}
    return {"kind": kind.value, "file": str(path), **size, **document}


def _model(path: Path, progress: Progress) -> dict[str, Any]:
    progress.stage("read")
    from bimvox.bim.read import IFC_SUFFIXES, read_building
    from pipeline.describe_building import describe_building

    if kind_of(path) is Kind.IFC and path.suffix.lower() not in IFC_SUFFIXES:
        raise FileError(path, "holds IFC, but its name says otherwise", hint=f"rename it to {path.stem}.ifc")
    building = read_building(path, None, progress.report)
    progress.stage("describe")
    return describe_building(building)


def _grid(path: Path, progress: Progress) -> dict[str, Any]:
    import numpy as np

    from bimvox.grid.storage import grid_from_bytes
    from pipeline.voxelize import part_document

    progress.stage("read")
    grid = grid_from_bytes(path.read_bytes(), path.name)
    return {
        "sha256": sha256_of(path),
        "shape": list(grid.shape),
        "cells": grid.labels.size,
        "voxel_size_m": grid.frame.voxel_size_m,
        "origin_m": list(grid.frame.origin_m),
        "source": dict(grid.source),
        "source_origin_m": list(grid.origin_m),
        "counts": grid.counts(),
        "shared_cells": len(np.unique(grid.shared_cells, axis=0)),
        "parts": [part_document(part) for part in grid.parts],
    }


def _site(path: Path, progress: Progress) -> dict[str, Any]:
    from pipeline.describe_site import describe_site

    return describe_site(path, progress)


def _log(path: Path, progress: Progress) -> dict[str, Any]:
    from pipeline.describe_log import describe_log

    progress.stage("read")
    return describe_log(path)


def _obstructions(path: Path, progress: Progress) -> dict[str, Any]:
    from bimvox.site.obstruction_file import parse_obstructions
    from pipeline.describe_obstructions import describe_obstruction

    progress.stage("read")
    found = parse_obstructions(path.read_bytes(), path.name, path.resolve().parent)
    return {"sha256": sha256_of(path), "obstructions": [describe_obstruction(one) for one in found.obstructions]}


def _policy(path: Path, progress: Progress) -> dict[str, Any]:
    from bimvox.policy import store

    progress.stage("read")
    place = path.resolve()
    return store.load(place.name, folder=place.parent).manifest.to_dict()
