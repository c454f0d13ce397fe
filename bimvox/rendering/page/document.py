"""The data of the page: plain values and one block of numbers."""

from __future__ import annotations

import base64
import json
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime, time, timedelta
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from bimvox.grid.frame import Label
from bimvox.grid.summed_area import boxes_of
from bimvox.records.declared import LATER, Count, Maybe, Record, Several
from bimvox.records.lift import Lift, Status, by_change
from bimvox.records.plan_dates import TIME, PlanDates
from bimvox.records.proof import REMARK
from bimvox.records.steps import Steps
from bimvox.records.unloading import unloading_lifts
from bimvox.remarks.not_covered import NOT_COVERED
from bimvox.rendering.colours import CLASSES, NO_GROUP, REMARKS, SHARES
from bimvox.rendering.page.crane import CRANE, crane_record
from bimvox.rendering.page.geometry import COLOUR, NUMBERS, Blob, Shapes, rounded, shapes_of
from bimvox.rendering.page.lifts import (
    DELIVERY,
    LIFT,
    PROOF,
    UNLOADING,
    is_critical,
    lift_record,
    local_s,
    proof_record,
)
from bimvox.rendering.page.motions import (
    ANGLE_STEPS_PER_RAD,
    LENGTH_STEPS_PER_M,
    MOTION,
    TICKS_PER_S,
    carried_motion,
    crane_motion,
)
from bimvox.rendering.page.source import PageSource, Revision
from bimvox.rendering.pictures.site import view_of_site
from bimvox.site.component import KIND_RGB, STATE_RGB
from bimvox.site.config.validation import Point2, Point3
from bimvox.site.site import Blocker, Site, names_by_id, with_names

GEOMETRY_BUDGET_BYTES = 1_900_000
"""Compressed size; with motions, text and base64 a page of 500 parts stays below 4 MB."""


_GEOMETRY = Record(
    "PageGeometry",
    "A shape that parts share.",
    ("step_m", float, "Length of a step of its lattice.", lambda shape, _: shape.step_m),
    ("points", NUMBERS, "x, y, z of each point in steps, from the shape's lowest corner.",
     lambda shape, blob: blob.put(shape.points)),
    ("faces", NUMBERS, "Three points of each triangle.", lambda shape, blob: blob.put(_short(shape.faces))),
    ("edges", NUMBERS, "Two points of each visible edge.", lambda shape, blob: blob.put(_short(shape.edges))),
)  # fmt: skip
_STANDING = Record(
    "PageStanding",
    "Something that stands on the site: structure, or an obstruction.",
    ("id", str, "Its id."),
    ("kind", str, "Its kind."),
    ("name", str, "Its name in the model; empty if it has none."),
    ("boxes", NUMBERS, "Its cells as boxes: lowest x, y, z and the ends, in cells of the site.", LATER),
    ("geometry", Maybe(Count), "Index in ``geometries``; null without a shape. Only in ``standing``.", LATER, None),
    ("low_m", Maybe(Point3), "Lowest corner of the shape. Only in ``standing``.", LATER, None),
)  # fmt: skip
_SITE = Record(
    "PageSite",
    "The site.",
    ("name", str, "Its name."),
    ("model", str, "Name of the model's file.", lambda site, _: str(site.source.get("name", ""))),
    ("model_sha256", str, "SHA-256 of that file.", lambda site, _: str(site.source.get("sha256", ""))),
    ("model_format", str, "Its format.", lambda site, _: str(site.source.get("format", ""))),
    ("shape", tuple[Count, Count, Count], "Cells along x, y and z.", lambda site, _: list(site.shape)),
    ("voxel_size_m", float, "Edge of a cell.", "frame.voxel_size_m"),
    ("origin_m", Point3, "Lowest corner of cell (0, 0, 0).", lambda site, _: list(site.frame.origin_m)),
    ("slab", NUMBERS,
     "Columns, y slowest: 0 nothing, 1 ground, 2 construction area, 3 yard, 4 access of trucks; 8 more where hook or"
     "\nload must not be. Nothing where the ground is not as high as the yard: it stands among the fixed things.",
     lambda site, blob: blob.put(slab_map(site))),
    ("slab_low_m", float, "Lower side of the slab, a cell thick, whose top is the level of the yard.",
     lambda site, _: float(site.frame.corner_of([0, 0, site.yard_floor_vox - 1])[2])),
    ("notes", tuple[str, ...], "Notes about the site.", lambda site, _: _named(site, site.notes)),
    ("geometry_digest", str, "Digest of its geometry."),
    ("view_deg", Point2, "Azimuth and elevation from which to look.",
     lambda site, _: [round(n, 3) for n in (view_of_site(site).azimuth_deg, view_of_site(site).elevation_deg)]),
)  # fmt: skip
_COLOURS = Record(
    "PageColours",
    "Colours, 0 to 255.",
    ("states", dict[str, COLOUR], "Of parts by state."),
    ("kinds", dict[str, COLOUR], "Of areas and fixed things by kind."),
    ("groups", tuple[COLOUR, ...], "Of groups without an order, such as classes; the last is of all others."),
    ("shares", tuple[COLOUR, ...], "Of ranges of utilisation, from low to critical."),
    ("remarks", dict[str, COLOUR], "Of parts by their most severe remark."),
    ("none", COLOUR, "Of parts that belong to no group."),
)
_PART = Record(
    "PagePart",
    "A part.",
    ("id", str, "Its id."),
    ("global_id", str, "Its GlobalId; of a mesh the body's name."),
    ("name", str, "Its name."),
    ("ifc_class", str, "Its IFC class."),
    ("type_name", Maybe(str), "Its type."),
    ("storey", Maybe(str), "Its storey."),
    ("material", Maybe(str), "Its material."),
    ("mass_kg", float, "Its mass."),
    ("mass_source", str, "Where its mass comes from."),
    ("cells", Count, "Its volume in cells.", lambda part, *_: len(part.shape.cells)),
    ("target_m", Point3, "Lowest corner of its cells when it is set.", LATER),
    ("size_m", Point3, "Size of its cells' box.", LATER),
    ("geometry", Count, "Index in ``geometries``.", LATER),
    ("low_m", Point3, "From ``target_m`` to the shape's lowest corner.", LATER),
    ("boxes", NUMBERS, "Its cells as boxes: lowest x, y, z and the ends, in cells from ``target_m``.", LATER),
)
_PROPS = Record(
    "PageProps",
    "The props of a part, or its shores, as they stand.",
    ("part", Count, "Index of the part.", "held.component"),
    ("from_s", float, "From when they stand, crane time.", lambda it: it.from_ns / 1e9),
    ("until_s", Maybe(float), "When they go; null: not before the end.",
     lambda it: None if it.until_ns is None else it.until_ns / 1e9),
    ("ends_m", tuple[tuple[Point3, Point3], ...], "Head and foot of each.",
     lambda it: [[list(one.head_m), list(one.foot_m)] for one in it.held.props]),
)  # fmt: skip
_CLASH = Record(
    "PageClash",
    "Two parts that overlap in the model.",
    ("first", str, "Id of one."),
    ("second", str, "Id of the other."),
    ("depth_m", float, "How deep."),
    ("at_least", bool, "Whether it may be deeper."),
)
_CHANGES = Record(
    "PageChanges",
    "What a revision changes.",
    ("since", Count, "Number of the revision before."),
    ("kept", tuple[Count, ...], "Parts whose lifts are kept."),
    ("replanned", tuple[Count, ...], "Parts whose lifts are new."),
    ("infeasible", tuple[Count, ...], "Parts whose lifts are infeasible."),
    ("changed_cells", Count, "Cells of obstructions that differ."),
)
_LIGHT = Literal["clean", "remarked", "serious", "refused", "plain"]
_VERDICT = Record(
    "PageVerdict",
    "The verdict in words, each with its light.",
    ("proof", str, "Whether it is proven."),
    ("proof_light", _LIGHT, "Its light.", "proof_light.value"),
    ("remarks", str, "How many remarks there are."),
    ("remarks_light", _LIGHT, "Their light.", "remarks_light.value"),
)
_MOVE = Record(
    "PageMove",
    "A move of a crane to another set-up.",
    ("to", Count, "The set-up: index in ``set_ups``.", "goes_to"),
    ("takes_s", float, "How long it takes, from derigging until it is rigged.",
     lambda move: (move.ends_ns - move.begins_ns) / 1e9),
)  # fmt: skip
_REVISION = Record(
    "PageRevision",
    "One plan of the site.",
    ("number", Count, "Its revision number."),
    ("log", str, "Name of its log."),
    ("sha256", str, "SHA-256 of that file."),
    ("digest", str, "Digest of the site with its obstructions.", "plan.site.digest"),
    ("planned", Count, "Lifts that are planned.",
     lambda it, _: sum(lift.status is Status.PLANNED for lift in it.lifts)),
    ("infeasible", Count, "Lifts that are infeasible."),
    ("carried", Count, "Lifts that the log carries.", lambda it, _: len(it.plan.lifts)),
    ("begins_s", float, "When the first motion begins, crane time.",
     lambda it, _: min((track.start_ns for track in it.tracks), default=0) / 1e9),
    ("ends_s", float, "When the last one ends.",
     lambda it, _: max((track.end_ns for track in it.tracks), default=0) / 1e9),
    ("timed", bool, "Whether a crane moves the loads; otherwise times are nominal.", lambda it, _: bool(it.motions)),
    ("critical_share", float, "Share of the capacity from which a lift is critical.", "plan.site.rules.critical_share"),
    ("elapsed_s", Maybe(float), "Elapsed time, if there is work that the crane does not do.",
     lambda it, _: it.steps.elapsed_ns(it.motions) / 1e9 if it.steps != Steps() else None),
    ("paused_s", float, "How long the crane pauses.", lambda it, _: it.steps.paused_ns / 1e9),
    ("moves", Several(_MOVE), "Moves of the crane to other set-ups.",
     lambda it, _: [_MOVE.of(one) for one in it.steps.moves] or None, ()),
    ("dates", tuple[tuple[float, float, float], ...],
     "Of each block of lifts: begin and end, crane time, and its begin in local time, seconds after 1970.",
     lambda it, _: _blocks(it.times) if it.times else None, ()),
    ("days", tuple[float, ...],
     "Midnights of its working days, local time: told by their numbers, because the day of the start is not known.",
     lambda it, _: _numbered_days(it.times) if it.times and not it.times.is_dated else None, ()),
    ("time", Maybe(TIME), "When it is carried out; none of an extract, or without a crane.",
     lambda it, _: it.times and it.times.time, None),
    ("deliveries", Several(DELIVERY), "What the crane unloads; none if no place for trucks is known.",
     lambda _, made: made.deliveries or None, ()),
    ("lifts", Several(LIFT), "All lifts in their order.", lambda _, made: made.lifts),
    ("props", Several(_PROPS), "Props of its parts; none of a site without a crane.",
     lambda it, _: [_PROPS.of(one) for one in it.props_standing] or None, ()),
    ("obstructions", Several(_STANDING), "Its obstructions.",
     lambda it, made: [boxes_record(it.plan.site, blocker, made.blob) for blocker in it.plan.site.blockers
                       if blocker.kind == "obstruction"]),
    ("obstruction_notes", tuple[str, ...], "Notes about them.",
     lambda it, _: _named(it.plan.site, it.plan.site.obstruction_notes)),
    ("notes", tuple[str, ...], "Notes about the plan.", lambda it, _: _named(it.plan.site, it.plan.notes)),
    ("clashes", Several(_CLASH), "Parts that overlap in the model.",
     lambda it, _: [_CLASH.of(clash) for clash in it.plan.clashes]),
    ("proof", Maybe(PROOF), "The proof made for this page; null: none.", lambda it, _: proof_record(it)),
    ("verdict", _VERDICT, "The verdict.", lambda it, _: _VERDICT.of(it.verdict)),
    ("conditions", tuple[str, ...], "What the proof takes as given.", lambda it, _: list(it.conditions)),
    ("not_covered", Several(NOT_COVERED), "What the plan does not cover, each a line that a person ticks.",
     lambda it, _: [one.to_dict() for one in it.not_covered]),
    ("remarks", Several(REMARK), "What a person should look at.", lambda it, _: [one.to_dict() for one in it.remarks]),
    ("changes", Maybe(_CHANGES), "What it changes; null for the first.",
     lambda it, made: _changes(made.before, it) if made.before else None),
    ("metadata", dict[str, str], "Metadata of the log.", lambda it, _: dict(sorted(it.metadata.items()))),
)  # fmt: skip
_SCALES = Record(
    "PageScales",
    "Steps in keyframes for each unit.",
    ("time", Count, "For a second."),
    ("length", Count, "For a metre."),
    ("angle", Count, "For a radian."),
)
DOCUMENT = Record(
    "PageData",
    """What the page of ``bimvox render`` shows. Lengths in metres, in the site's frame; times in seconds.

A list ``[type, offset, count]`` refers to little-endian values in ``numbers``: ``u8``, ``u16``, ``u32``, ``i32``
or ``f32``, the offset in bytes.
""",
    ("format", Literal[1], "Version of this format."),
    ("site", _SITE, "Grid, model and ground."),
    ("colours", _COLOURS, "Of states and kinds."),
    ("crane", Maybe(CRANE), "The (first) crane."),
    ("other_cranes", Several(CRANE), "The others.", None, ()),
    ("set_ups", tuple[str, ...], "Set-ups, if the cranes are one that moves.", None, ()),
    ("geometries", Several(_GEOMETRY), "Shapes."),
    ("parts", Several(_PART), "Parts."),
    ("standing", Several(_STANDING), "Existing structure."),
    ("revisions", Several(_REVISION, 1), "Plans of the site, the newest last."),
    ("left_out", Count, "How many earlier ones are left out."),
    ("scales", _SCALES, "Steps of the keyframes."),
    ("motions", Several(MOTION), "Motions, each once."),
    ("numbers", str, "All numbers that the others refer to, base64."),
)


def page_json(source: PageSource) -> bytes:
    """Return the data of a page as one JSON document, UTF-8, as ``page_json_schema`` describes it."""
    document, numbers = document_of(source)
    document["numbers"] = base64.b64encode(numbers).decode()
    return json.dumps(document, ensure_ascii=False, allow_nan=False, separators=(",", ":")).encode() + b"\n"


def page_json_schema() -> dict[str, Any]:
    """Return the JSON Schema (draft 2020-12) of the page's data."""
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **DOCUMENT.model.model_json_schema()}


def document_of(source: PageSource) -> tuple[dict[str, Any], bytes]:
    """Return the data of the page: plain values for JSON, and the block of numbers that they refer to.

    Values that the revisions share are taken from the last one.
    """
    blob = Blob()
    last = source.revisions[-1]
    site, others = last.plan.site, last.plan.site.cranes[1:]
    solid = [blocker.mesh for blocker in standing(site) if blocker.mesh is not None]
    shapes = shapes_of([component.mesh for component in site.components] + solid, GEOMETRY_BUDGET_BYTES)
    motions = _Motions(blob)
    colours = _COLOURS.made(
        {state.value: list(rgb) for state, rgb in STATE_RGB.items()},
        {kind: list(rgb) for kind, rgb in KIND_RGB.items()},
        [list(rgb) for rgb in CLASSES],
        [list(rgb) for rgb in SHARES],
        {severity.value: list(rgb) for severity, rgb in REMARKS.items()},
        list(NO_GROUP),
    )
    document = {
        "format": 1,
        "site": _SITE.of(site, blob),
        "colours": colours,
        "crane": crane_record(site.cranes[0], blob) if site.cranes else None,
        **({"other_cranes": [crane_record(crane, blob) for crane in others]} if others else {}),
        **({} if site.moving is None else {"set_ups": list(site.moving.names)}),
        "geometries": [_GEOMETRY.of(geometry, blob) for geometry in shapes.geometries],
        "parts": [_part_record(site, n, shapes, blob) for n in range(len(site.components))],
        "standing": _standing_records(site, shapes, blob),
        "revisions": [
            _revision_record(revision, source.revisions[n - 1] if n else None, motions)
            for n, revision in enumerate(source.revisions)
        ],
        "left_out": source.left_out,
        "scales": _SCALES.made(TICKS_PER_S, LENGTH_STEPS_PER_M, ANGLE_STEPS_PER_RAD),
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


def _part_record(site: Site, n: int, shapes: Shapes, blob: Blob) -> dict[str, Any]:
    component = site.components[n]
    corner_m = site.frame.corner_of(component.target_vox)
    return _PART.of(component) | {
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


def _numbered_days(times: PlanDates) -> list[float]:
    """Return the midnights of the working days from the start until all carries, seconds after 1970."""
    carries = (times.moment(at_ns) for _, _, at_ns in times.steps.values())
    first, last = times.begins.date(), max([times.last, *carries]).date()
    days = (first + timedelta(days=n) for n in range((last - first).days + 1))
    return [local_s(datetime.combine(day, time())) for day in days if times.hours.works(day)]


@dataclass(frozen=True, slots=True, eq=False)
class _Made:
    """What is made for a revision before its record."""

    before: Revision | None
    lifts: list[dict[str, Any]]
    deliveries: list[dict[str, Any]]
    blob: Blob


def _revision_record(revision: Revision, before: Revision | None, motions: _Motions) -> dict[str, Any]:
    site, blob = revision.plan.site, motions.blob
    driven = {motion.order: motion for motion in revision.motions}
    tracks = {track.lift.order: track for track in revision.tracks}
    lifts = []
    unloading, deliveries = _unloading_records(revision)
    for lift in revision.lifts:
        record = lift_record(revision, lift) | {"motion": None, "begins_s": None}
        record["critical"] = is_critical(record, site.rules.critical_share)
        if lift.order in unloading:
            record["unloading"] = unloading[lift.order]
        if (track := tracks.get(lift.order)) is not None:
            own = driven.get(lift.order)
            made = crane_motion(site, own, track, blob) if own is not None else carried_motion(track, blob)
            record |= {"motion": motions.number(made), "begins_s": track.start_ns / 1e9}
        lifts.append(record)
    return _REVISION.of(revision, _Made(before, lifts, deliveries, blob))


def _short(indices: Any) -> Any:
    return indices.astype(np.uint16) if not indices.size or int(indices.max()) < 2**16 else indices


# What a revision changed: which lifts were kept, replanned, or are infeasible.


def _changes(before: Revision, after: Revision) -> dict[str, Any]:
    """Return the changed components, by index, and how many obstruction cells differ."""
    kept, replanned, infeasible = ([lift.component for lift in some] for some in by_change(before.lifts, after.lifts))
    obstructed = [revision.plan.site.labels == Label.OBSTRUCTION for revision in (before, after)]
    differ = int(np.count_nonzero(obstructed[0] != obstructed[1]))
    return _CHANGES.made(before.number, kept, replanned, infeasible, differ)


# Deliveries that the crane unloads, as records of the page.


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
        lifts |= {one.order: UNLOADING.of(one) for one in found}
        deliveries.append(DELIVERY.made(number, *_local_s(revision, number)))
    return lifts, deliveries


def _local_s(revision: Revision, number: int) -> tuple[float | None, float | None]:
    """Return when a delivery is unloaded, local time, seconds after 1970; None without dates."""
    dates = revision.dates
    if dates is None or number not in dates.deliveries:
        return None, None
    begin_ns, end_ns = dates.deliveries[number]
    return local_s(dates.moment(begin_ns)), local_s(dates.moment(end_ns))


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
    return _STANDING.of(blocker) | {"boxes": blob.put(boxes.astype(np.uint16))}
