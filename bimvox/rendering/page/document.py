"""The data of the page: plain values and one block of numbers."""

from __future__ import annotations

import json
from collections.abc import Sequence
from datetime import datetime
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bimvox.grid.boxes import boxes_of
from bimvox.grid.labels import Label
from bimvox.records.dates import PlanDates
from bimvox.records.lift import Lift, Status, by_change
from bimvox.records.steps import Steps
from bimvox.records.unloading import unloading_lifts
from bimvox.rendering.colours import CLASSES, NO_GROUP, REMARKS, SHARES
from bimvox.rendering.page.blob import Blob, rounded
from bimvox.rendering.page.crane import crane_record
from bimvox.rendering.page.geometry import Shapes, shapes_of
from bimvox.rendering.page.lifts import lift_record, proof_record, remark_records
from bimvox.rendering.page.motions import (
    ANGLE_STEPS_PER_RAD,
    LENGTH_STEPS_PER_M,
    TICKS_PER_S,
    carried_motion,
    crane_motion,
)
from bimvox.rendering.page.source import PageSource, Revision
from bimvox.rendering.scene.site import view_of_site
from bimvox.site.construction import KIND_RGB, STATE_RGB
from bimvox.site.part_names import names_by_id, with_names
from bimvox.site.site import Blocker, Site

FORMAT = 1
GEOMETRY_BUDGET_BYTES = 1_900_000
"""Compressed size; with motions, text and base64 a page of 500 parts stays below 4 MB."""


def document_of(source: PageSource) -> tuple[dict[str, Any], bytes]:
    """Return the data of the page: plain values for JSON, and the block of numbers that they refer to.

    Values that the revisions share are taken from the last one.
    """
    blob = Blob()
    last = source.revisions[-1]
    site, others = last.plan.site, last.plan.site.cranes[1:]
    fixed = standing(site)
    solid = [blocker.mesh for blocker in fixed if blocker.mesh is not None]
    shapes = shapes_of([component.mesh for component in site.components] + solid, GEOMETRY_BUDGET_BYTES)
    motions = _Motions(blob)
    document = {
        "format": FORMAT,
        "site": _site_record(site, blob),
        "colours": {
            "states": {state.value: list(rgb) for state, rgb in STATE_RGB.items()},
            "kinds": {kind: list(rgb) for kind, rgb in KIND_RGB.items()},
            "groups": [list(rgb) for rgb in CLASSES],
            "shares": [list(rgb) for rgb in SHARES],
            "remarks": {severity.value: list(rgb) for severity, rgb in REMARKS.items()},
            "none": list(NO_GROUP),
        },
        "crane": crane_record(site.cranes[0], blob) if site.cranes else None,
        **({"other_cranes": [crane_record(crane, blob) for crane in others]} if others else {}),
        "geometries": [
            {
                "step_m": geometry.step_m,
                "points": blob.put(geometry.points),
                "faces": blob.put(_short(geometry.faces)),
                "edges": blob.put(_short(geometry.edges)),
            }
            for geometry in shapes.geometries
        ],
        "parts": [_part_record(site, n, shapes, blob) for n in range(len(site.components))],
        "standing": _standing_records(site, shapes, blob),
        "revisions": [
            _revision_record(revision, source.revisions[n - 1] if n else None, motions, blob)
            for n, revision in enumerate(source.revisions)
        ],
        "left_out": source.left_out,
        "scales": {"time": TICKS_PER_S, "length": LENGTH_STEPS_PER_M, "angle": ANGLE_STEPS_PER_RAD},
    }
    document["motions"] = motions.records
    return document, blob.to_bytes()


class _Motions:
    """Motions, each stored once, because a replan keeps most of them."""

    def __init__(self, blob: Blob) -> None:
        self.blob = blob
        self.records: list[dict[str, Any]] = []
        self._known: dict[str, int] = {}

    def number(self, record: dict[str, Any]) -> int:
        key = json.dumps(record)
        if key not in self._known:
            self._known[key] = len(self.records)
            self.records.append(record)
        return self._known[key]


def _named(site: Site, notes: Sequence[str]) -> list[str]:
    """Return notes with the parts' names before their ids."""
    names = names_by_id(site)
    return [with_names(note, names) for note in notes]


def _site_record(site: Site, blob: Blob) -> dict[str, Any]:
    view = view_of_site(site)
    return {
        "name": site.name,
        "model": str(site.source.get("name", "")),
        "model_sha256": str(site.source.get("sha256", "")),
        "model_format": str(site.source.get("format", "")),
        "shape": list(site.shape),
        "voxel_size_m": site.frame.voxel_size_m,
        "origin_m": list(site.frame.origin_m),
        "slab": blob.put(slab_map(site)),
        "slab_low_m": float(site.frame.corner_of([0, 0, site.yard_floor_vox - 1])[2]),
        "notes": _named(site, site.notes),
        "geometry_digest": site.geometry_digest,
        "view_deg": [round(view.azimuth_deg, 3), round(view.elevation_deg, 3)],
    }


def _part_record(site: Site, n: int, shapes: Shapes, blob: Blob) -> dict[str, Any]:
    component = site.components[n]
    corner_m = site.frame.corner_of(component.target_vox)
    return {
        "id": component.id,
        "global_id": component.global_id,
        "name": component.name,
        "ifc_class": component.ifc_class,
        "type_name": component.type_name,
        "storey": component.storey,
        "material": component.material,
        "mass_kg": component.mass_kg,
        "mass_source": component.mass_source,
        "cells": len(component.shape.cells),
        "target_m": rounded(corner_m),
        "size_m": rounded(np.array(component.shape.size_vox) * site.frame.voxel_size_m),
        "geometry": shapes.of_mesh[n],
        "low_m": rounded(shapes.low_m[n] - corner_m),
        "boxes": blob.put(component.shape.boxes.astype(np.uint16)),
    }


def _standing_records(site: Site, shapes: Shapes, blob: Blob) -> list[dict[str, Any]]:
    records = []
    number = len(site.components)
    for blocker in standing(site):
        record = boxes_record(site, blocker, blob) | {"geometry": None, "low_m": None}
        if blocker.mesh is not None:
            record |= {"geometry": shapes.of_mesh[number], "low_m": rounded(shapes.low_m[number])}
            number += 1
        records.append(record)
    return records


def _blocks(dates: PlanDates) -> list[list[float]]:
    """Return begin and end of each block of lifts on the site's clock, and its local begin after 1970, seconds."""
    return [
        [block.begins_ns / 1e9, block.ends_ns / 1e9, (dates.moment(start_ns) - datetime(1970, 1, 1)).total_seconds()]
        for block, start_ns in dates.blocks
    ]


def _revision_record(revision: Revision, before: Revision | None, motions: _Motions, blob: Blob) -> dict[str, Any]:
    site = revision.plan.site
    driven = {motion.order: motion for motion in revision.motions}
    tracks = {track.lift.order: track for track in revision.tracks}
    lifts = []
    unloading, deliveries = _unloading_records(revision)
    for lift in revision.lifts:
        record = lift_record(revision, lift) | {"motion": None, "begins_s": None}
        if lift.order in unloading:
            record["unloading"] = unloading[lift.order]
        if (track := tracks.get(lift.order)) is not None:
            own = driven.get(lift.order)
            made = crane_motion(site, own, track, blob) if own is not None else carried_motion(track, blob)
            record |= {"motion": motions.number(made), "begins_s": track.start_ns / 1e9}
        lifts.append(record)
    planned = [lift for lift in revision.lifts if lift.status is Status.PLANNED]
    return {
        "number": revision.number,
        "log": revision.log,
        "sha256": revision.sha256,
        "digest": site.digest,
        "planned": len(planned),
        "infeasible": revision.infeasible,
        "carried": len(revision.plan.lifts),
        "begins_s": min((track.start_ns for track in revision.tracks), default=0) / 1e9,
        "ends_s": max((track.end_ns for track in revision.tracks), default=0) / 1e9,
        "timed": bool(revision.motions),
        "critical_share": site.rules.critical_share,
        "elapsed_s": revision.steps.elapsed_ns(revision.motions) / 1e9 if revision.steps != Steps() else None,
        "paused_s": revision.steps.paused_ns / 1e9,
        **({"dates": _blocks(revision.dates)} if revision.dates else {}),
        **({"deliveries": deliveries} if deliveries else {}),
        "lifts": lifts,
        "obstructions": [boxes_record(site, blocker, blob) for blocker in _obstructions(site)],
        "obstruction_notes": _named(site, site.obstruction_notes),
        "notes": _named(site, revision.plan.notes),
        "clashes": [
            {"first": c.first, "second": c.second, "depth_m": c.depth_m, "at_least": c.at_least}
            for c in revision.plan.clashes
        ],
        "proof": proof_record(revision),
        "verdict": revision.verdict.to_dict(),
        "conditions": list(revision.conditions),
        "remarks": remark_records(revision),
        "changes": _changes(before, revision) if before else None,
        "metadata": dict(sorted(revision.metadata.items())),
    }


def _short(indices: Any) -> Any:
    return indices.astype(np.uint16) if not indices.size or int(indices.max()) < 2**16 else indices


# What a revision changed: which lifts were kept, replanned, or are infeasible.


def _changes(before: Revision, after: Revision) -> dict[str, Any]:
    """Return the changed components, by index, and how many obstruction cells differ."""
    kept, replanned, infeasible = ([lift.component for lift in some] for some in by_change(before.lifts, after.lifts))
    obstructed = [revision.plan.site.labels == Label.OBSTRUCTION for revision in (before, after)]
    return {
        "since": before.number,
        "kept": kept,
        "replanned": replanned,
        "infeasible": infeasible,
        "changed_cells": int(np.count_nonzero(obstructed[0] != obstructed[1])),
    }


# Deliveries that the crane unloads, as records of the page.

_EPOCH = datetime(1970, 1, 1)


def _unloading_records(revision: Revision) -> tuple[dict[int, dict[str, float]], list[dict[str, Any]]]:
    """Return how the crane unloads each part, by order of its lift, and every delivery; nothing without an access."""
    loads: dict[int, list[Lift]] = {}
    for lift in revision.lifts:
        if lift.place is not None:
            loads.setdefault(lift.place.delivery, []).append(lift)
    lifts: dict[int, dict[str, float]] = {}
    deliveries = []
    for number, load in sorted(loads.items()):
        found = unloading_lifts(revision.plan.site, load)
        if not found:
            continue
        for one in found:
            lifts[one.order] = {
                "radius_m": one.radius_m,
                "utilisation": one.utilisation,
                "crane_s": one.duration_s,
            }
        begins_s, ends_s = _local_s(revision, number)
        deliveries.append({"number": number, "begins_s": begins_s, "ends_s": ends_s})
    return lifts, deliveries


def _local_s(revision: Revision, number: int) -> tuple[float | None, float | None]:
    """Return when a delivery is unloaded, local time, seconds after 1970; None without dates."""
    dates = revision.dates
    if dates is None or number not in dates.deliveries:
        return None, None
    begin_ns, end_ns = dates.deliveries[number]
    return (dates.moment(begin_ns) - _EPOCH).total_seconds(), (dates.moment(end_ns) - _EPOCH).total_seconds()


# The fixed things on a site: the slab with its areas, structure, obstructions.

NOTHING, _GROUND, _AREA, _YARD, _ACCESS = range(5)
_PROHIBITED = 8
"""Added to a column's value if a zone forbids the hook there."""


def slab_map(site: Site) -> NDArray[np.uint8]:
    """Return the label of the ground in every column, (Y, X) uint8: nothing where it is not as high as the yard."""
    slab = site.labels[:, :, 0]
    columns = np.full(slab.shape, _GROUND, np.uint8)
    columns[slab == Label.AIR] = NOTHING
    columns[slab == Label.CONSTRUCTION_AREA] = _AREA
    # `Site.yard` defines the yard; the labels of the slab need not repeat it.
    columns[(slab == Label.YARD) | (site.yard & (columns == _GROUND))] = _YARD
    if site.access is not None:
        columns[site.access & (columns != NOTHING)] = _ACCESS
    columns[site.ground_vox != site.yard_floor_vox - 1] = NOTHING
    closed = [zone for zone in (site.prohibited, site.no_load) if zone is not None]
    if closed:
        columns[np.logical_or.reduce(closed) & (columns != NOTHING)] += _PROHIBITED
    return np.ascontiguousarray(columns.T)


def standing(site: Site) -> tuple[Blocker, ...]:
    """Return the blockers other than obstructions: structure, terrain, and a mast without a crane."""
    return tuple(
        blocker
        for n, blocker in enumerate(site.blockers)
        if blocker.kind == "structure"
        or (blocker.kind == "crane" and not site.cranes)
        or (n == 0 and bool((blocker.cells[:, 2] > 0).any()))
    )


def _obstructions(site: Site) -> tuple[Blocker, ...]:
    """Return the obstructions."""
    return tuple(blocker for blocker in site.blockers if blocker.kind == "obstruction")


def boxes_record(site: Site, blocker: Blocker, blob: Blob) -> dict[str, Any]:
    """Return the cells above the lowest layer as a few boxes, in cells; of the ground what the slab does not show."""
    cells = blocker.cells[blocker.cells[:, 2] > 0]
    if blocker.kind == "ground":
        cells, level = blocker.cells, site.yard_floor_vox - 1
        cells = cells[(cells[:, 2] != level) | (site.ground_vox[cells[:, 0], cells[:, 1]] != level)]
    boxes = np.zeros((0, 6), np.int32)
    if len(cells):
        low = cells.min(axis=0)
        dense = np.zeros(cells.max(axis=0) - low + 1, np.bool_)
        dense[tuple((cells - low).T)] = True
        boxes = boxes_of(dense) + np.tile(low, 2)
    return {"id": blocker.id, "kind": blocker.kind, "name": blocker.name, "boxes": blob.put(boxes.astype(np.uint16))}
