"""Chosen lifts of a log as the bytes of one file, in every format but the ROS 2 bag, which is a folder."""

from __future__ import annotations

import re
from datetime import datetime
from pathlib import Path

from bimvox.errors import InputError
from bimvox.exporters.formats import Format
from bimvox.log.plan_log import PlanLog, with_full_rate
from bimvox.records.dates import PlanDates


def log_bytes(
    log: PlanLog,
    wanted: Format,
    orders: tuple[int, ...],
    *,
    begins: datetime,
    dates: PlanDates | None = None,
    model: tuple[Path, bytes] | None = None,
) -> bytes:
    """Return chosen lifts in a format.

    Args:
        log: The log.
        wanted: A format of logs that is one file.
        orders: The lifts.
        begins: When the first lift starts, local time; of the dated formats.
        dates: The plan in calendar time; None for round the clock.
        model: Name and bytes of the IFC file that the plan was made from; needed for ``ifc`` alone.

    Raises:
        InputError: If the format needs a model and there is none.
        IfcError: If the model cannot be read, or lacks a part of the plan.
    """
    part = log.extract(orders)
    match wanted.name:
        case "csv":
            from bimvox.exporters.csv_json import to_csv

            return to_csv(part).encode()
        case "json":
            from bimvox.exporters.csv_json import json_bytes

            return json_bytes(part, dates)
        case "glb":
            from bimvox.exporters.animation import to_animated_glb

            return to_animated_glb(part)
        case "layout":
            from bimvox.log.layout import layout_bytes

            return layout_bytes(log.plan.site)
        case "msproject":
            from bimvox.exporters.lift_schedule import schedule_of
            from bimvox.exporters.ms_project import to_ms_project

            return to_ms_project(schedule_of(log, begins, orders, dates))
        case "ifc":
            from bimvox.exporters.ifc import with_schedule
            from bimvox.exporters.lift_schedule import schedule_of

            if model is None:
                raise InputError("the ifc format adds the schedule to the building's own file", hint="give it as model")
            return with_schedule(*model, schedule_of(log, begins, orders, dates))
        case "mcap" | "full-rate":
            from bimvox.exporters.csv_json import to_mcap

            chosen = log if len(orders) == len(log.plan.lifts) else part
            return to_mcap(with_full_rate(chosen) if wanted.name == "full-rate" else chosen)
    raise InputError(f"the format {wanted.name} is not one file of a log")


def messages_in(data: bytes, wanted: Format) -> int:
    """Return how many messages (MCAP), rows (CSV) or samples (JSON) a file holds; 0 for formats without them."""
    if wanted.name in ("mcap", "full-rate"):
        from bimvox.log.mcap.reader import read_contents

        return len(read_contents(data, "export").messages)
    if wanted.name == "csv":
        return max(0, data.count(b"\n") - 1)
    if wanted.name == "json":
        times = (found[1] for found in re.finditer(rb'"time_s": \[([^\]]*)\]', data))
        return sum(len(series.split()) for series in times)
    return 0
