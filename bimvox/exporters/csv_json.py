"""A log, whole or an extract, as MCAP, CSV and JSON."""

from __future__ import annotations

import io
import json
from collections.abc import Iterator
from typing import Any

import numpy as np

from bimvox.bim.own_box import laid_flat_m
from bimvox.crane.tower_crane import TowerCrane
from bimvox.exporters.text import table
from bimvox.log.moving import tracks_of
from bimvox.log.plan_log import PlanLog
from bimvox.log.recorder import write_log
from bimvox.records.dates import PlanDates
from bimvox.records.lift import Lift, Status
from bimvox.records.motion import LiftMotion
from bimvox.records.steps import Steps, needed_by_ns
from bimvox.records.track import heading_in_words
from bimvox.records.unloading import UnloadingLift, unloading_lifts
from bimvox.site.component import Component

SAMPLE_COLUMNS = {
    "number": "number of the lift, from 1",
    "order": "the same from 0",
    "component": "GlobalId, made unique",
    "phase": "of the lift; `path` without a crane",
    "time_s": "on the site's clock; without a crane 1 s a unit move",
    "x_m": "lowest corner of the load's reference cell, site frame; empty without a load",
    "y_m": "the same",
    "z_m": "the same",
    "slew_rad": "from the x axis, counter-clockwise, unwrapped",
    "radius_m": "from the slewing axis to the hook",
    "hook_height_m": "above z = 0",
    "crane": "name of the crane",
}
LIFT_COLUMNS = {
    "number": "number of the lift, from 1",
    "order": "the same from 0",
    "component": "GlobalId, made unique",
    "global_id": "IFC GlobalId, or the body's name",
    "ifc_class": "for example IfcBeam",
    "name": "the source's name",
    "mass_kg": "mass without rigging",
    "status": "planned or infeasible",
    "method": "greedy, policy, retrained or search",
    "moves": "of the path",
    "shortest_moves": "the fewest possible; empty if unknown",
    "contact_moves": "last placements that the narrow phase cleared",
    "delivery": "from 0",
    "stored_pose": "in the yard",
    "start_s": "on the site's clock",
    "duration_s": "of the lift",
    "elapsed_start_s": "its start in elapsed time, or that of work that the crane does not do",
    "elapsed_end_s": "its end, in the same way",
    "carries_s": "when that work carries, in elapsed time",
    "bound_s": "least time of the loaded motion, point to point",
    "reason": "why it is infeasible",
    "by_other_means": "whether it is set by other means",
    "needed_by_s": "by when, on the site's clock",
    "blocked_by": "ids, separated by spaces",
    "crane": "name of the crane",
    "begins": "its start, or that of work that the crane does not do, local time; empty if no start is known",
    "ends": "its end, the part in place, in the same way",
    "rigging": "gear between hook and part, from the hook down; empty if the site file describes the crane's rigging",
    "rigging_mass_kg": "its mass",
    "leg_angle_deg": "largest angle of the upper sling's legs to the vertical; empty in the same case",
    "stack": "number of its stack in the delivery, from 1; empty if it lies alone",
    "heading": "`kept` by tag line, or `with jib` and by how much the crew turns it back",
}


def to_mcap(log: PlanLog) -> bytes:
    """Return a log, which may be an extract, as the bytes of an MCAP file."""
    stream = io.BytesIO()
    write_log(stream, log)
    return stream.getvalue()


def to_csv(log: PlanLog) -> str:
    """Return the samples of the lifts' motions as CSV, columns as in ``SAMPLE_COLUMNS``."""
    rows = (
        (lift.number, lift.order, log.plan.site.components[lift.component].id, *row)
        for lift, samples in _samples(log)
        for row in samples
    )
    return table(SAMPLE_COLUMNS, rows)


def lifts_csv(log: PlanLog, dates: PlanDates | None = None) -> str:
    """Return the lifts as CSV, one per row, columns as in ``LIFT_COLUMNS``."""
    rows = (record | {"blocked_by": " ".join(record["blocked_by"])} for record in _lift_records(log, dates))
    return table(LIFT_COLUMNS, (row.values() for row in rows))


def to_json(log: PlanLog, dates: PlanDates | None = None) -> dict[str, Any]:
    """Return the lifts as plain values: every lift as in ``LIFT_COLUMNS``, its path, and its samples by column.

    The deliveries are those of :func:`delivery_records`.
    """
    return _document(log, dates) | {"lifts": [*_lifts(log, dates)]}


def json_bytes(log: PlanLog, dates: PlanDates | None = None) -> bytes:
    """Return :func:`to_json` as text; one lift at a time has a Python object for each of its numbers."""
    encoder = json.JSONEncoder(ensure_ascii=False, indent=1)
    before, after = encoder.encode(_document(log, dates)).split('\n "lifts": []')
    stream = io.BytesIO()
    stream.write(f'{before}\n "lifts": ['.encode())
    end = "]"
    for n, lift in enumerate(_lifts(log, dates)):
        text = "\n" + encoder.encode(lift)
        stream.write(("," * (n > 0) + text.replace("\n", "\n  ")).encode())
        end = "\n ]"
    stream.write(f"{end}{after}\n".encode())
    return stream.getvalue()


def _lifts(log: PlanLog, dates: PlanDates | None) -> Iterator[dict[str, Any]]:
    """Yield every lift with its path and samples."""
    samples = _samples(log)
    columns = list(SAMPLE_COLUMNS)[3:]
    for lift, record in zip(log.plan.lifts, _lift_records(log, dates), strict=True):
        cells = None if lift.path_vox is None else lift.path_vox.tolist()
        corner_m = None if lift.path_vox is None else log.plan.site.frame.corner_of(lift.path_vox).tolist()
        rows = next(samples)[1] if lift.status is Status.PLANNED else []
        series = {name: [row[n] for row in rows] for n, name in enumerate(columns)}
        yield {**record, "path_vox": cells, "path_m": corner_m, "samples": series}


def _document(log: PlanLog, dates: PlanDates | None) -> dict[str, Any]:
    """Return what there is, without the lifts."""
    site = log.plan.site
    return {
        "site": site.name,
        "site_digest": site.digest,
        "revision": log.revision,
        "metadata": dict(log.metadata),
        "frame": {
            "origin_m": list(site.frame.origin_m),
            "voxel_size_m": site.frame.voxel_size_m,
            "shape": list(site.shape),
            "site_to_ifc": site.site_to_ifc.tolist(),
        },
        "calendar": dates.document() if dates else None,
        "deliveries": delivery_records(log, dates),
        "lifts": [],
        "clashes": [
            {"first": c.first, "second": c.second, "depth_m": c.depth_m, "way_out_m": c.way_out_m}
            for c in log.plan.clashes
        ],
        "notes": list(log.plan.notes),
    }


def _samples(log: PlanLog) -> Iterator[tuple[Lift, list[tuple[Any, ...]]]]:
    """Yield every planned lift with its rows: the columns of ``SAMPLE_COLUMNS`` after ``component``."""
    motions = {motion.order: motion for motion in log.motions}
    for track in tracks_of(log):
        corner = dict(zip(track.time_ns.tolist(), track.corner_m.tolist(), strict=True))
        motion = motions.get(track.lift.order)
        if motion is None:
            yield track.lift, [("path", t / 1e9, *xyz, None, None, None, None) for t, xyz in corner.items()]
            continue
        times, axes = motion.samples()
        crane = log.plan.site.cranes[motion.crane].name
        none = (None, None, None)
        rows = zip(times.tolist(), axes.tolist(), strict=True)
        yield track.lift, [(motion.phase_name_at(t), t / 1e9, *corner.get(t, none), *at, crane) for t, at in rows]


def _lift_records(log: PlanLog, dates: PlanDates | None) -> list[dict[str, Any]]:
    tracks = {track.lift.order: track for track in tracks_of(log)}
    motions: dict[int, LiftMotion] = {motion.order: motion for motion in log.motions}
    needed_ns, steps = needed_by_ns(log.all_lifts, log.motions), log.steps
    records = []
    for lift in log.plan.lifts:
        component = log.plan.site.components[lift.component]
        track, motion, crane = tracks.get(lift.order), motions.get(lift.order), log.plan.site.crane_of(component)
        values = (
            lift.number,
            lift.order,
            component.id,
            component.global_id,
            component.ifc_class,
            component.name,
            component.mass_kg,
            lift.status.value,
            None if lift.method is None else lift.method.value,
            lift.moves,
            lift.shortest_moves,
            lift.contact_moves,
            None if lift.place is None else lift.place.delivery,
            None if lift.place is None else lift.place.pose.value,
            None if track is None else track.start_ns / 1e9,
            None if track is None else (track.end_ns - track.start_ns) / 1e9,
            *_elapsed_s(steps, lift, motion),
            None if motion is None or not np.isfinite(motion.loaded.bound_s) else motion.loaded.bound_s,
            lift.reason,
            lift.by_other_means,
            None if (at_ns := needed_ns.get(lift.order)) is None else at_ns / 1e9,
            list(lift.blocked_by),
            None if crane is None else crane.name,
            *(dates.span(lift.order) if dates else (None, None)),
            *_rigging(component, crane),
            None if lift.place is None else lift.place.stack or None,
            heading_in_words(lift, motion),
        )
        records.append(dict(zip(LIFT_COLUMNS, values, strict=True)))
    return records


def _rigging(component: Component, crane: TowerCrane | None) -> tuple[str | None, float | None, float | None]:
    """Return the gear of a part in words, its mass, and the angle of its legs."""
    rig = component.lifting.rig
    if rig is None:
        return None, None if crane is None else crane.rigging_mass_kg, None
    said = rig.document()
    return "; ".join(f"{part.count} x {part.words}" for part in rig.parts), said["mass_kg"], said["leg_angle_deg"]


def _elapsed_s(steps: Steps, lift: Lift, motion: LiftMotion | None) -> tuple[float | None, float | None, float | None]:
    """Return start and end of a lift or step in elapsed time, and when a step carries."""
    if motion is not None:
        return steps.starting_ns(motion.start_ns) / 1e9, steps.ending_ns(motion.end_ns) / 1e9, None
    step = steps.of_order.get(lift.order)
    if step is None:
        return None, None, None
    return step.begins_ns / 1e9, step.ends_ns / 1e9, step.carries_ns / 1e9


# The deliveries of a plan: each truck, when it is needed, and what it carries in the order of loading.

_TRUCK_COLUMNS = {
    "truck": "number of the delivery, from 1",
    "needed": "when the truck must be there, local time; empty if no start is known",
    "unloaded": "when it is empty, in the same way",
    "needed_s": "start of its first lift, in elapsed time; empty if none of its parts is lifted",
    "parts_on_truck": "how many parts it carries",
    "truck_mass_kg": "their mass",
}
_PART_COLUMNS = {
    "loaded": "place in the order of loading, from 1: what is loaded first is unloaded last, and lifted first",
    "component": "GlobalId, made unique",
    "global_id": "IFC GlobalId, or the body's name",
    "name": "the source's name",
    "ifc_class": "for example IfcBeam",
    "mass_kg": "mass without rigging",
    "length_m": "of the smallest upright box around the part, its longest edge",
    "width_m": "its second edge",
    "height_m": "its shortest edge",
    "number": "number of the part's lift, from 1",
    "status": "planned or infeasible",
    "stack": "number of its stack in the yard, from 1; empty if it lies alone",
    "rack": "number of its rack in the yard, from 1; empty if it stands in none",
    "truck_radius_m": "radius of the hook over the truck when the crane unloads the part; empty without an access",
    "truck_utilisation": "share of the capacity there",
    "unloading_s": "crane time from the truck to its place in the yard and back",
}
DELIVERY_COLUMNS = _TRUCK_COLUMNS | _PART_COLUMNS


def delivery_records(log: PlanLog, dates: PlanDates | None = None) -> list[dict[str, Any]]:
    """Return every delivery as plain values: ``_TRUCK_COLUMNS``, and its ``parts`` as in ``_PART_COLUMNS``.

    Of an extract, only its own lifts are listed.
    """
    loads: dict[int, list[Lift]] = {}
    for lift in sorted(log.plan.lifts, key=lambda lift: lift.order):
        if lift.place is not None:
            loads.setdefault(lift.place.delivery, []).append(lift)
    starts_ns = {track.lift.order: log.steps.starting_ns(track.start_ns) for track in tracks_of(log)}
    found = []
    for number, load in sorted(loads.items()):
        parts = [log.plan.site.components[lift.component] for lift in load]
        first_ns = min((starts_ns[lift.order] for lift in load if lift.order in starts_ns), default=None)
        values = (
            number + 1,
            *_times(number, load, dates),
            None if first_ns is None else first_ns / 1e9,
            len(parts),
            sum(part.mass_kg for part in parts),
        )
        lifted = {one.order: one for one in unloading_lifts(log.plan.site, load)}
        rows = [
            (
                loaded,
                part.id,
                part.global_id,
                part.name,
                part.ifc_class,
                part.mass_kg,
                *laid_flat_m(part.mesh),
                lift.number,
                lift.status.value,
                None if lift.place is None else lift.place.stack or None,
                None if lift.place is None else abs(lift.place.rack) or None,
                *_unloading(lifted.get(lift.order)),
            )
            for loaded, (lift, part) in enumerate(zip(load, parts, strict=True), start=1)
        ]
        truck: dict[str, Any] = dict(zip(_TRUCK_COLUMNS, values, strict=True))
        found.append(truck | {"parts": [dict(zip(_PART_COLUMNS, row, strict=True)) for row in rows]})
    return found


def _unloading(lift: UnloadingLift | None) -> tuple[float | None, ...]:
    return (None,) * 3 if lift is None else (lift.radius_m, lift.utilisation, lift.duration_s)


def deliveries_csv(log: PlanLog, dates: PlanDates | None = None) -> str:
    """Return the deliveries as CSV, a row for each part, columns as in ``DELIVERY_COLUMNS``."""
    rows = (
        (*(truck[name] for name in _TRUCK_COLUMNS), *part.values())
        for truck in delivery_records(log, dates)
        for part in truck["parts"]
    )
    return table(DELIVERY_COLUMNS, rows)


def _times(number: int, load: list[Lift], dates: PlanDates | None) -> tuple[str | None, str | None]:
    """Return when a delivery must be there and when it is unloaded; at its first lift if unloading takes no time."""
    if dates is None:
        return None, None
    if number in dates.deliveries:
        begin_ns, end_ns = dates.deliveries[number]
        return dates.moment(begin_ns).isoformat(), dates.moment(end_ns).isoformat()
    begins = min((dates.lifts[lift.order][0] for lift in load if lift.order in dates.lifts), default=None)
    moment = None if begins is None else dates.moment(begins).isoformat()
    return moment, moment
