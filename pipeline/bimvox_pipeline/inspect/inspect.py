"""``bimvox inspect``: kind and content of a file."""

from __future__ import annotations

import hashlib
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bimvox.errors import FileError
from bimvox.files import sha256_of
from bimvox.progress import Progress
from bimvox_pipeline.inspect.building import check_kind_file, rounded_m, write_kind_file
from bimvox_pipeline.inspect.kinds import Kind, kind_of

if TYPE_CHECKING:
    from collections.abc import Callable

    from bimvox.grid.voxel_grid import VoxelGrid
    from bimvox.log.plan_log import PlanLog
    from bimvox.site.obstructions.obstruction_set import Obstruction, ObstructionSet, Vec3


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
        Kind.LOG: _describe_log,
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
    from bimvox_pipeline.inspect.building import describe_site

    return describe_site(path, progress)


def _obstructions(path: Path, progress: Progress) -> dict[str, Any]:
    from bimvox.library.site import as_written

    progress.stage("read")
    found = as_written(path)
    head = {"sha256": sha256_of(path), **_how_read(path, found)}
    described = [_describe_obstruction(one) for one in found.obstructions]
    return {**head, **_extent_of(described), "obstructions": described}


def _policy(path: Path, progress: Progress) -> dict[str, Any]:
    from bimvox.policy import store

    progress.stage("read")
    place = path.resolve()
    return store.load(place.name, folder=place.parent).manifest.to_dict()


# The content of a log, as plain values.


def _describe_log(path: Path, progress: Progress) -> dict[str, Any]:
    """Return topics with their counts, lifts, metadata, and the attached files with their digests.

    Raises:
        LogFileError: If it is damaged or not a bimvox log.
    """
    from bimvox.log.mcap.reader import read_contents, read_file
    from bimvox.log.reader import read_log
    from bimvox.log.schema import METADATA, topics_of
    from bimvox.records.lift import infeasible_among

    progress.stage("read")
    data = read_file(path)
    contents = read_contents(data, path)
    log = read_log(path)
    counts = Counter(message.topic for message in contents.messages)
    site = log.plan.site
    schemas = {topic.name: topic.schema for topic in topics_of(max(1, len(site.cranes)), traffic=True)}
    return {
        "sha256": hashlib.sha256(data).hexdigest(),
        "library": contents.library,
        "revision": log.revision,
        "recovered": log.recovered,
        "messages": len(contents.messages),
        "duration_s": _duration_s(log),
        "site": site.name,
        "shape": list(site.shape),
        "voxel_size_m": site.frame.voxel_size_m,
        "crane": site.cranes[0].name if site.cranes else None,
        **({"cranes": [crane.name for crane in site.cranes]} if site.names_cranes else {}),
        "planned": len(log.planned),
        "infeasible": len(infeasible_among(log.plan.lifts)),
        "left_out": len(log.context),
        "obstructions": sorted(blocker.id for blocker in site.blockers if blocker.kind == "obstruction"),
        "source": dict(site.source),
        "metadata": contents.metadata.get(METADATA, {}),
        "remarks": _remarks(log),
        "notes": list(log.plan.notes),
        "site_to_ifc": (site.site_to_ifc + 0.0).tolist(),
        "lifts": _lifts(log),
        "topics": [
            {"topic": topic, "schema": schemas.get(topic), "messages": count} for topic, count in sorted(counts.items())
        ],
        "attachments": [
            {"file": name, "bytes": len(content), "sha256": hashlib.sha256(content).hexdigest()}
            for name, content in contents.attachments.items()
        ],
    }


def _remarks(log: PlanLog) -> dict[str, int] | None:
    """Return the number of remarks by severity; None if the values of the plan make no sense."""
    from bimvox.records.proof import counts_of

    return None if log.remarks is None else counts_of(log.remarks)


def _duration_s(log: PlanLog) -> float | None:
    """Return the time from the start of the first motion to the end of the last; None without motions."""
    if not log.motions:
        return None
    start_ns = min(motion.start_ns for motion in log.motions)
    return round((max(motion.end_ns for motion in log.motions) - start_ns) / 1e9, 3)


def _lifts(log: PlanLog) -> list[dict[str, Any]]:
    motions = {motion.order: motion for motion in log.motions}
    components = log.plan.site.components
    return [
        {
            "number": lift.number,
            "order": lift.order,
            "name": component.name,
            "ifc_class": component.ifc_class,
            "component": component.id,
            "status": lift.status.value,
            "method": lift.found_by,
            "moves": lift.moves,
            "start_s": round(motion.start_ns / 1e9, 3) if motion else None,
            "end_s": round(motion.end_ns / 1e9, 3) if motion else None,
        }
        for lift in log.plan.lifts
        for component, motion in [(components[lift.component], motions.get(lift.order))]
    ]


# The content of an obstruction file, as plain values.


def _describe_obstruction(obstruction: Obstruction) -> dict[str, Any]:
    """Return an obstruction's form and bounding box: metres in the site's frame, cells for voxels."""
    import numpy as np

    from bimvox.site.obstructions.obstruction_set import Box, Cylinder, Points, Voxels

    form = obstruction.form
    if isinstance(form, Box):  # there may be a million of them
        return {"id": obstruction.id, "form": "box", "low_m": _rounded_m(form.low_m), "high_m": _rounded_m(form.high_m)}
    document: dict[str, Any] = {"id": obstruction.id, "form": type(form).__name__.lower()}
    if isinstance(form, Voxels):
        cells = np.array(form.cells)
        return {
            **document,
            "cells": len(cells),
            "low_vox": cells.min(axis=0).tolist(),
            "high_vox": cells.max(axis=0).tolist(),
        }
    if isinstance(form, Cylinder):
        reach = np.array([form.radius_m, form.radius_m, 0.0])
        low = np.array(form.base_m) - reach
        high = np.array(form.base_m) + reach + np.array([0.0, 0.0, form.height_m])
    elif isinstance(form, Points):
        low, high = form.points_m.min(axis=0), form.points_m.max(axis=0)
        document |= {"points": len(form.points_m)}
    else:
        low, high = form.bounds_m
        document |= {"form": "mesh", "triangles": len(form.faces)}
    return {**document, "low_m": rounded_m(low), "high_m": rounded_m(high)}


def _how_read(path: Path, found: ObstructionSet) -> dict[str, Any]:
    """Return the coordinates that a file states, and how a scan is read."""
    from bimvox.site.obstructions.point_file import is_scan, scan_in_words

    stated = found.coordinates or "not stated: those of the site file, or those that put it inside the site"
    read_as = {"read_as": scan_in_words(path)} if is_scan(path) else {}
    return {"coordinates": stated, **read_as}


def _extent_of(described: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Return the box around all obstructions but those of cells, metres in the coordinates of the file."""
    boxes = [(one["low_m"], one["high_m"]) for one in described if "low_m" in one]
    if not boxes:
        return {}
    low = [min(values) for values in zip(*(low for low, _ in boxes), strict=True)]
    high = [max(values) for values in zip(*(high for _, high in boxes), strict=True)]
    return {"low_m": low, "high_m": high}


def _rounded_m(corner_m: Vec3) -> list[float]:
    """Return the same numbers if nothing is to be rounded, which saves memory."""
    x, y, z = corner_m
    rounded = [round(x, 4) + 0.0, round(y, 4) + 0.0, round(z, 4) + 0.0]
    return [x, y, z] if rounded == [x, y, z] and 0.0 not in corner_m else rounded  # -0.0 is rounded too
