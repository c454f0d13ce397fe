"""``bimvox export`` of a log as a schedule: the building's own IFC with tasks, or Microsoft Project XML."""

from __future__ import annotations

import hashlib
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING

from bimvox.errors import InputError

if TYPE_CHECKING:
    from bimvox.crane.tower_crane import TowerCrane
    from bimvox.export.lift_schedule import LiftSchedule
    from bimvox.log.plan_log import PlanLog
    from bimvox.log.track import LoadTrack
    from bimvox.records.motion import LiftMotion

DEFAULT_BEGIN = datetime(2000, 1, 3, 7, 0, 0)
"""When the first lift starts where nobody says: a Monday, far from anyone's real one. A file has no wall clock."""


def schedule_of(log: PlanLog, begins: datetime, orders: tuple[int, ...]) -> LiftSchedule:
    """Return the planned lifts of a log as dated tasks."""
    from bimvox.export.lift_schedule import CraneResource, LiftSchedule, LiftTask
    from bimvox.log.recorder import tracks_of

    site = log.plan.site
    tasks, motions = [], {motion.order: motion for motion in log.motions}
    for track in tracks_of(log):
        if track.lift.order not in orders:
            continue
        component, method = site.components[track.lift.component], track.lift.method
        tasks.append(
            LiftTask(
                track.lift.order,
                component.id,
                component.global_id,
                f"Lift {component.name or component.id}",
                f"{component.mass_kg:.0f} kg, {track.lift.moves} moves, path by {method.value if method else 'nobody'}",
                *_span_s(track, motions.get(track.lift.order)),
                component.crane,
            )
        )
    cranes = [CraneResource(crane.name, _values(crane)) for crane in site.cranes]
    first, *further = cranes or [CraneResource("")]
    name = first.name if cranes else None
    identity = f"{site.digest} {log.revision}"
    return LiftSchedule(site.name, identity, begins, tuple(tasks), name, first.properties, tuple(further))


def _span_s(track: LoadTrack, motion: LiftMotion | None) -> tuple[float, float]:
    """From when to when a lift is worked on: a crane that waits for another one before, or leaves after, is not."""
    if motion is None:
        return track.start_ns / 1e9, track.end_ns / 1e9
    from bimvox.records.motion import PhaseName

    waited = [p.end_ns for p in motion.phases if p.name is PhaseName.WAIT and p.end_ns <= motion.released_ns]
    return max([motion.start_ns, *waited]) / 1e9, motion.released_ns / 1e9


def _values(crane: TowerCrane) -> tuple[tuple[str, str | float], ...]:
    x, y, z = (float(value) for value in crane.base_m)
    return (
        ("base_x_m", x),
        ("base_y_m", y),
        ("base_z_m", z),
        ("jib_height_m", float(crane.jib_height_m)),
        ("jib_length_m", float(crane.jib_length_m)),
    )


def parsed_begin(text: str | None) -> datetime:
    """Return the start of the schedule.

    Raises:
        InputError: If it is no date and time.
    """
    if text is None:
        return DEFAULT_BEGIN
    try:
        begins = datetime.fromisoformat(text)
    except ValueError as error:
        raise InputError(
            f"--start {text}: this is no date and time", hint="for example --start 2026-12-01T07:00"
        ) from error
    if begins.tzinfo is not None:
        raise InputError(f"--start {text}: it is local time, without a zone", hint="for example 2026-12-01T07:00")
    return begins.replace(microsecond=0)


def model_bytes(log: PlanLog, model: Path) -> tuple[Path, bytes]:
    """Return the IFC file that a plan was made from.

    Args:
        log: The log.
        model: Where it is.

    Raises:
        InputError: If the plan was made from no IFC file, or from another one.
    """
    from bimvox_pipeline.artifacts import require_input

    source = log.plan.site.source
    name, wanted = str(source.get("name", "")), str(source.get("sha256", ""))
    if not name.lower().endswith((".ifc", ".ifczip")):
        raise InputError(
            f"the plan was made from {name or 'no file'}, which is no IFC file to add a schedule to",
            hint="--to msproject writes the schedule alone",
        )
    data = require_input(model).read_bytes()
    if hashlib.sha256(data).hexdigest() != wanted:
        raise InputError(
            f"{model}: this is not the file that the plan was made from ({name}, SHA-256 {wanted[:16]}...)",
            hint="name that file, or plan again with this one",
        )
    return model, data
