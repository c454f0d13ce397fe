"""The inputs of a schedule export: when it begins, and the building's own IFC file."""

from __future__ import annotations

import hashlib
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING

from bimvox.errors import InputError

if TYPE_CHECKING:
    from bimvox.log.plan_log import PlanLog


def parsed_begin(text: str | None) -> datetime:
    """Return the start of the schedule.

    Raises:
        InputError: If the text is not a local date and time.
    """
    from bimvox.exporters.lift_schedule import DEFAULT_BEGIN

    if text is None:
        return DEFAULT_BEGIN
    try:
        begins = datetime.fromisoformat(text)
    except ValueError as error:
        raise InputError(f"--start {text}: not a date and time", hint="for example --start 2026-12-01T07:00") from error
    if begins.tzinfo is not None:
        raise InputError(f"--start {text}: give local time without a zone", hint="for example 2026-12-01T07:00")
    return begins.replace(microsecond=0)


def model_bytes(log: PlanLog, model: Path) -> tuple[Path, bytes]:
    """Return the path and bytes of the IFC file that a plan was made from.

    Raises:
        InputError: If the plan was made from a mesh, or from another file.
    """
    from bimvox.files import read_input

    source = log.plan.site.source
    name, wanted = str(source.get("name", "")), str(source.get("sha256", ""))
    if not name.lower().endswith((".ifc", ".ifczip")):
        raise InputError(
            f"the plan was made from {name or 'no file'}, which is not an IFC file to add a schedule to",
            hint="--to msproject writes the schedule alone",
        )
    data = read_input(model)
    if hashlib.sha256(data).hexdigest() != wanted:
        raise InputError(
            f"{model}: this is not the file that the plan was made from ({name}, SHA-256 {wanted[:16]}...)",
            hint="give that file, or plan again with this one",
        )
    return model, data
