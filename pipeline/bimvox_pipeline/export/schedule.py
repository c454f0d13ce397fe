"""When the schedule of an export begins."""

from __future__ import annotations

from datetime import datetime

from bimvox.errors import InputError


def parsed_begin(text: str | None) -> datetime | None:
    """Return the start of the schedule; None if none is given.

    Raises:
        InputError: If the text is not a local date and time.
    """
    if text is None:
        return None
    try:
        begins = datetime.fromisoformat(text)
    except ValueError as error:
        raise InputError(f"--start {text}: not a date and time", hint="for example --start 2026-12-01T07:00") from error
    if begins.tzinfo is not None:
        raise InputError(f"--start {text}: give local time without a zone", hint="for example 2026-12-01T07:00")
    return begins.replace(microsecond=0)
