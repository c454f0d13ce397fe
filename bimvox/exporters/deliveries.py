"""The deliveries of a plan: each truck, when it is needed, and what it carries in the order of loading."""

from __future__ import annotations

from typing import Any

from bimvox.exporters.text import table
from bimvox.log.moving import tracks_of
from bimvox.log.plan_log import PlanLog
from bimvox.records.dates import PlanDates
from bimvox.records.lift import Lift
from bimvox.records.unloading import UnloadingLift, unloading_lifts
from bimvox.site.upright_box import laid_flat_m

TRUCK_COLUMNS = {
    "truck": "number of the delivery, from 1",
    "needed": "when the truck must be there, local time; empty if no start is known",
    "unloaded": "when it is empty, in the same way",
    "needed_s": "start of its first lift, in elapsed time; empty if none of its parts is lifted",
    "parts_on_truck": "how many parts it carries",
    "truck_mass_kg": "their mass",
}
PART_COLUMNS = {
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
DELIVERY_COLUMNS = TRUCK_COLUMNS | PART_COLUMNS


def delivery_records(log: PlanLog, dates: PlanDates | None = None) -> list[dict[str, Any]]:
    """Return every delivery as plain values: ``TRUCK_COLUMNS``, and its ``parts`` as in ``PART_COLUMNS``.

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
        truck: dict[str, Any] = dict(zip(TRUCK_COLUMNS, values, strict=True))
        found.append(truck | {"parts": [dict(zip(PART_COLUMNS, row, strict=True)) for row in rows]})
    return found


def _unloading(lift: UnloadingLift | None) -> tuple[float | None, ...]:
    return (None,) * 3 if lift is None else (lift.radius_m, lift.utilisation, lift.duration_s)


def deliveries_csv(log: PlanLog, dates: PlanDates | None = None) -> str:
    """Return the deliveries as CSV, a row for each part, columns as in ``DELIVERY_COLUMNS``."""
    rows = (
        (*(truck[name] for name in TRUCK_COLUMNS), *part.values())
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
