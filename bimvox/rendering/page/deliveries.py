"""Deliveries that the crane unloads, as records of the page."""

from __future__ import annotations

from datetime import datetime
from typing import Any

from bimvox.records.lift import Lift
from bimvox.records.unloading import unloading_lifts
from bimvox.rendering.page.source import Revision

_EPOCH = datetime(1970, 1, 1)


def unloading_records(revision: Revision) -> tuple[dict[int, dict[str, float]], list[dict[str, Any]]]:
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
