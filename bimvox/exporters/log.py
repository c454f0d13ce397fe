"""Chosen lifts of a log as the bytes of one file: a table of every format that is not a folder."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

from bimvox.errors import InputError
from bimvox.exporters.animation import to_animated_glb
from bimvox.exporters.csv_json import json_bytes, to_csv, to_mcap
from bimvox.exporters.hung_load import hung_load_of
from bimvox.exporters.ifc import with_schedule
from bimvox.exporters.lift_schedule import LiftSchedule, schedule_of
from bimvox.exporters.mjcf import mjcf
from bimvox.exporters.ms_project import to_ms_project
from bimvox.exporters.urdf import urdf
from bimvox.log.layout import layout_bytes
from bimvox.log.mcap.reader import read_contents
from bimvox.log.plan_log import PlanLog, with_full_rate
from bimvox.records.done import DoneWork
from bimvox.records.plan_dates import PlanDates


@dataclass(frozen=True, slots=True, eq=False)
class Chosen:
    """Chosen lifts of a log.

    Attributes:
        log: The log.
        orders: The lifts.
        begins: When the first lift starts, local time; of the dated formats.
        dates: The plan in calendar time; None for round the clock.
        model: Name and bytes of the IFC file that the plan was made from; needed for ``ifc`` alone.
        note: Told what the format does not have of it.
        done: What has been carried out; ``dates`` are by it.
        baseline: Another version of the plan with its dates: those that were planned.
    """

    log: PlanLog
    orders: tuple[int, ...]
    begins: datetime
    dates: PlanDates | None = None
    model: tuple[Path, bytes] | None = None
    note: Callable[[str], None] = lambda _: None
    done: DoneWork | None = None
    baseline: tuple[PlanLog, PlanDates] | None = None

    @property
    def part(self) -> PlanLog:
        """The log, or its extract with these lifts."""
        return self.log if len(self.orders) == len(self.log.plan.lifts) else self.log.extract(self.orders)

    @property
    def schedule(self) -> LiftSchedule:
        """The lifts as dated tasks."""
        schedule = schedule_of(self.log, self.begins, self.orders, self.dates)
        if self.done is None or self.baseline is None:
            return schedule
        log, dates = self.baseline
        planned = schedule_of(log, self.begins, [lift.order for lift in log.plan.lifts], dates)
        return schedule.with_progress(self.done, planned.all_times)


def _with_schedule(chosen: Chosen) -> bytes:
    if chosen.model is None:
        raise InputError("the ifc format adds the schedule to the building's own file", hint="give it as model")
    return with_schedule(*chosen.model, chosen.schedule, chosen.note)


WRITERS: dict[str, Callable[[Chosen], bytes]] = {
    "mcap": lambda chosen: to_mcap(chosen.part),
    "csv": lambda chosen: to_csv(chosen.part).encode(),
    "json": lambda chosen: json_bytes(chosen.part, chosen.dates),
    "full-rate": lambda chosen: to_mcap(with_full_rate(chosen.part)),
    "glb": lambda chosen: to_animated_glb(chosen.part),
    "mjcf": lambda chosen: mjcf(hung_load_of(chosen.log, chosen.orders)),
    "urdf": lambda chosen: urdf(hung_load_of(chosen.log, chosen.orders)),
    "layout": lambda chosen: layout_bytes(chosen.log.plan.site),
    "ifc": _with_schedule,
    "msproject": lambda chosen: to_ms_project(chosen.schedule),
}
"""Returns the bytes of a file, by the name of its format."""


def messages_in(data: bytes, name: str) -> int:
    """Return how many messages (MCAP), rows (CSV) or samples (JSON) a file holds; 0 for formats without them."""
    if name in ("mcap", "full-rate"):
        return len(read_contents(data, "export").messages)
    if name == "csv":
        return max(0, data.count(b"\n") - 1)
    if name == "json":
        times = (found[1] for found in re.finditer(rb'"time_s": \[([^\]]*)\]', data))
        return sum(len(series.split()) for series in times)
    return 0
