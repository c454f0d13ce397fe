"""A log, whole or an extract, as MCAP, CSV and JSON."""

from __future__ import annotations

import io
import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from bimvox.bim.own_box import laid_flat_m
from bimvox.crane.gear import Rig
from bimvox.crane.tower_crane import TowerCrane
from bimvox.exporters.text import table
from bimvox.log.moving import tracks_of
from bimvox.log.plan_log import PlanLog, log_times
from bimvox.log.recorder import write_log
from bimvox.records.declared import Maybe, Number, Record
from bimvox.records.lift import Lift, Status
from bimvox.records.motion import by_each_crane
from bimvox.records.plan_dates import PlanDates
from bimvox.records.track import LoadTrack
from bimvox.records.unloading import Lorries, UnloadingLift, average, deliveries_of, lorries_of, unloading_lifts
from bimvox.rendering.page.lifts import LIFT as PAGE_LIFT
from bimvox.rendering.page.lifts import Shown, needed_ns
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


@dataclass(frozen=True, slots=True, eq=False)
class _Exported(Shown):
    """A lift with all that its record is made from."""

    dates: PlanDates | None
    track: LoadTrack | None
    times: PlanDates | None

    @property
    def crane(self) -> TowerCrane | None:
        return self.site.crane_of(self.component)

    @property
    def rig(self) -> Rig | None:
        return self.component.lifting.rig

    @property
    def elapsed_s(self) -> tuple[float | None, float | None, float | None]:
        """Start and end of the lift or its work in elapsed time, and when that work carries."""
        if self.motion is not None:
            steps = self.source.steps
            return steps.starting_ns(self.motion.start_ns) / 1e9, steps.ending_ns(self.motion.end_ns) / 1e9, None
        if self.step is None:
            return None, None, None
        return self.step.begins_ns / 1e9, self.step.ends_ns / 1e9, self.step.carries_ns / 1e9

    @property
    def span(self) -> tuple[str | None, str | None]:
        return self.dates.span(self.lift.order) if self.dates else (None, None)

    @property
    def in_words(self) -> tuple[str | None, str | None]:
        return (self.times and self.times.span_in_words(self.lift.order)) or (None, None)


LIFT = Record(
    "ExportedLift",
    "A lift.",
    *PAGE_LIFT.keys("number", "order"),
    ("component", str, "GlobalId, made unique", "component.id"),
    ("global_id", str, "IFC GlobalId, or the body's name", "component.global_id"),
    ("ifc_class", str, "for example IfcBeam", "component.ifc_class"),
    ("name", str, "the source's name", "component.name"),
    ("mass_kg", float, "mass without rigging", "component.mass_kg"),
    *PAGE_LIFT.keys("status", "method", "moves", "shortest_moves", "contact_moves", "delivery"),
    ("stored_pose", Maybe(str), "in the yard", "place.pose.value"),
    ("start_s", Maybe(float), "on the site's clock", lambda it: it.track and it.track.start_ns / 1e9),
    ("duration_s", Maybe(float), "of the lift", lambda it: it.track and (it.track.end_ns - it.track.start_ns) / 1e9),
    ("elapsed_start_s", Maybe(float), "its start in elapsed time, or that of work that the crane does not do",
     lambda it: it.elapsed_s[0]),
    ("elapsed_end_s", Maybe(float), "its end, in the same way", lambda it: it.elapsed_s[1]),
    ("carries_s", Maybe(float), "when that work carries, in elapsed time", lambda it: it.elapsed_s[2]),
    ("bound_s", Maybe(float), "least time of the loaded motion, point to point",
     lambda it: it.motion.loaded.bound_s if it.motion and np.isfinite(it.motion.loaded.bound_s) else None),
    ("reason", Maybe(str), "why it is infeasible", "lift.reason"),
    *PAGE_LIFT.keys("by_other_means", "needed_by_s", "blocked_by"),
    ("crane", Maybe(str), "name of the crane", "crane.name"),
    ("begins", Maybe(str), "its start, or that of work that the crane does not do, local time; empty if unknown",
     lambda it: it.span[0]),
    ("ends", Maybe(str), "its end, the part in place, in the same way", lambda it: it.span[1]),
    ("rigging", Maybe(str), "gear between hook and part, from the hook down; empty if the site file describes it",
     lambda it: it.rig and "; ".join(f"{part.count} x {part.words}" for part in it.rig.parts)),
    ("rigging_mass_kg", Maybe(float), "its mass",
     lambda it: it.rig.document()["mass_kg"] if it.rig else it.crane and it.crane.rigging_mass_kg),
    ("leg_angle_deg", Maybe(float), "largest angle of the upper sling's legs to the vertical; empty in that case",
     lambda it: it.rig and it.rig.document()["leg_angle_deg"]),
    ("stack", Maybe(Number), "number of its stack in the delivery, from 1; empty if it lies alone",
     lambda it: it.place and (it.place.stack or None)),
    *PAGE_LIFT.keys("heading"),
    ("begins_in_words", Maybe(str),
     "its start in words: date and clock; working day and clock if no start is known; empty of an extract",
     lambda it: it.in_words[0]),
    ("ends_in_words", Maybe(str), "its end, in the same way", lambda it: it.in_words[1]),
    ("carries_in_words", Maybe(str), "when work that the crane does not do carries, in the same way",
     lambda it: (found := it.times and it.times.of_work([it.lift.order])) and it.times.in_words(found[2])),
    ("needed_by_in_words", Maybe(str), "when a part that the crane does not set is needed, in the same way",
     lambda it: it.times and it.times.clock_in_words(needed_ns(it.source.motions, it.lift))),
)  # fmt: skip


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
    """Return the lifts as CSV, one per row, columns as in ``LIFT``."""
    rows = (record | {"blocked_by": " ".join(record["blocked_by"])} for record in _lift_records(log, dates))
    return table(LIFT.meanings, (row.values() for row in rows))


def json_bytes(log: PlanLog, dates: PlanDates | None = None) -> bytes:
    """Return the lifts as JSON: every lift as in ``LIFT``, its path, and its samples by column.

    The deliveries are those of :func:`delivery_records`. One lift at a time has a Python object for each of its
    numbers.
    """
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
        "time": times.time if (times := dates or log_times(log)) else None,
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
        found: list[tuple[Any, ...]] = []
        for own in by_each_crane([motion]):  # of a part that two cranes carry, the rows of the one, then of the other
            times, axes = own.samples()
            crane = log.plan.site.cranes[own.crane].name
            none = (None, None, None)
            rows = zip(times.tolist(), axes.tolist(), strict=True)
            found += [(own.phase_name_at(t), t / 1e9, *corner.get(t, none), *at, crane) for t, at in rows]
        yield track.lift, found


def _lift_records(log: PlanLog, dates: PlanDates | None) -> list[dict[str, Any]]:
    tracks = {track.lift.order: track for track in tracks_of(log)}
    motions, times = {motion.order: motion for motion in log.motions}, dates or log_times(log)
    return [
        LIFT.of(
            _Exported(
                log,
                lift,
                motions.get(lift.order),
                log.steps.of_order.get(lift.order),
                dates,
                tracks.get(lift.order),
                times,
            )
        )
        for lift in log.plan.lifts
    ]


# The deliveries of a plan: each truck, when it is needed, and what it carries in the order of loading.


class _Truck(NamedTuple):
    """A delivery with all that its record is made from."""

    log: PlanLog
    dates: PlanDates | None
    number: int
    load: list[Lift]
    starts_ns: Mapping[int, int]
    lorries: Lorries

    @property
    def parts(self) -> list[Component]:
        return [self.log.plan.site.components[lift.component] for lift in self.load]

    @property
    def times(self) -> tuple[str | None, str | None]:
        """When it must be there and when it is unloaded; at its first lift if unloading takes no time."""
        if self.dates is None:
            return None, None
        if self.number in self.dates.deliveries:
            begin_ns, end_ns = self.dates.deliveries[self.number]
            return self.dates.moment(begin_ns).isoformat(), self.dates.moment(end_ns).isoformat()
        begins = [self.dates.lifts[lift.order][0] for lift in self.load if lift.order in self.dates.lifts]
        moment = self.dates.moment(min(begins)).isoformat() if begins else None
        return moment, moment


class _Loaded(NamedTuple):
    """A part on a truck: its place in the order of loading, its lorry, its lift, and how it is unloaded."""

    loaded: int
    lorry: int | None
    part: Component
    lift: Lift
    size_m: tuple[float, float, float]
    unloading: UnloadingLift | None


_TRUCK = Record(
    "ExportedTruck",
    "A delivery.",
    ("truck", Number, "number of the delivery, from 1", lambda it: it.number + 1),
    ("needed", Maybe(str), "when the truck must be there, local time; empty if no start is known",
     lambda it: it.times[0]),
    ("unloaded", Maybe(str), "when it is empty, in the same way", lambda it: it.times[1]),
    ("needed_s", Maybe(float), "start of its first lift, in elapsed time; empty if none of its parts is lifted",
     lambda it: min(
         (it.starts_ns[lift.order] / 1e9 for lift in it.load if lift.order in it.starts_ns), default=None
     )),
    ("parts_on_truck", Number, "how many parts it carries", lambda it: len(it.load)),
    ("truck_mass_kg", float, "their mass", lambda it: sum(part.mass_kg for part in it.parts)),
    ("lorries", Maybe(Number), "on how many lorries; empty if nothing limits them",
     lambda it: it.lorries.count or None),
    ("lorries_share", Maybe(float), "how full these are on average, 0..1: by mass or by room, whichever is larger",
     lambda it: average(it.lorries.shares)),
    ("lorries_mass_share", Maybe(float), "how much of their payload they carry on average, 0..1",
     lambda it: average(it.lorries.mass_shares)),
    ("lorries_room_share", Maybe(float), "how far their beds are filled on average, 0..1; 0 for a special transport",
     lambda it: average(it.lorries.room_shares)),
)  # fmt: skip
_PART = Record(
    "ExportedPart",
    "A part of a delivery.",
    ("loaded", Number,
     "place in the order of loading, from 1: what is loaded first is unloaded last, and lifted first"),
    ("lorry", Maybe(Number), "on which of the delivery's lorries, from 1; the last one is unloaded first"),
    ("component", str, "GlobalId, made unique", "part.id"),
    ("global_id", str, "IFC GlobalId, or the body's name", "part.global_id"),
    ("name", str, "the source's name", "part.name"),
    ("ifc_class", str, "for example IfcBeam", "part.ifc_class"),
    ("mass_kg", float, "mass without rigging", "part.mass_kg"),
    ("length_m", float, "of the smallest upright box around the part, its longest edge", lambda it: it.size_m[0]),
    ("width_m", float, "its second edge", lambda it: it.size_m[1]),
    ("height_m", float, "its shortest edge", lambda it: it.size_m[2]),
    ("number", Number, "number of the part's lift, from 1", "lift.number"),
    ("status", str, "planned or infeasible", "lift.status.value"),
    ("stack", Maybe(Number), "number of its stack in the yard, from 1; empty if it lies alone",
     lambda it: it.lift.place.stack or None),
    ("rack", Maybe(Number), "number of its rack in the yard, from 1; empty if it stands in none",
     lambda it: abs(it.lift.place.rack) or None),
    ("truck_radius_m", Maybe(float),
     "radius of the hook over the truck when the crane unloads the part; empty without an access",
     "unloading.radius_m"),
    ("truck_utilisation", Maybe(float), "share of the capacity there", "unloading.utilisation"),
    ("unloading_s", Maybe(float), "crane time from the truck to its place and back", "unloading.duration_s"),
)  # fmt: skip
DELIVERY_COLUMNS = _TRUCK.meanings | _PART.meanings


def delivery_records(log: PlanLog, dates: PlanDates | None = None) -> list[dict[str, Any]]:
    """Return every delivery as plain values: ``_TRUCK``, and its ``parts`` as in ``_PART``.

    Of an extract, only its own lifts are listed.
    """
    loads = deliveries_of(log.plan.lifts)
    starts_ns = {track.lift.order: log.steps.starting_ns(track.start_ns) for track in tracks_of(log)}
    result = []
    for number, load in sorted(loads.items()):
        truck = _Truck(log, dates, number, load, starts_ns, lorries_of(log.plan.site, load))
        unloading = {one.order: one for one in unloading_lifts(log.plan.site, load)}
        lorry = {part.id: n for n, own in enumerate(truck.lorries.loads, start=1) for part in own}
        parts = [
            _PART.of(_Loaded(loaded, lorry.get(part.id), part, lift, laid_flat_m(part.mesh), unloading.get(lift.order)))
            for loaded, (part, lift) in enumerate(zip(truck.parts, load, strict=True), start=1)
        ]
        result.append(_TRUCK.of(truck) | {"parts": parts})
    return result


def deliveries_csv(log: PlanLog, dates: PlanDates | None = None) -> str:
    """Return the deliveries as CSV, a row for each part, columns as in ``DELIVERY_COLUMNS``."""
    rows = (
        (*(truck[name] for name in _TRUCK.meanings), *part.values())
        for truck in delivery_records(log, dates)
        for part in truck["parts"]
    )
    return table(DELIVERY_COLUMNS, rows)
