"""The dates of a log: its plan in calendar time, by the attached site file."""

from __future__ import annotations

from datetime import datetime

from pydantic import ValidationError

from bimvox.log.plan_log import PlanLog
from bimvox.records.dates import PlanDates, dates_of
from bimvox.site.config.calendar import CalendarConfig
from bimvox.site.config.file import SITE_FILE
from bimvox.site.nested import toml_values


def log_dates(log: PlanLog, start: datetime | None = None) -> PlanDates | None:
    """Return the dates of a log.

    Args:
        log: The log.
        start: When work may begin, local time; None takes the site file's.

    Returns:
        The dates; None if the start is not known, or of an extract or a plan without a crane: dates follow from the
        motions of all lifts.
    """
    if log.context:
        return None
    return dates_of(_calendar(log), log.plan.site, log.plan.lifts, log.motions, log.steps, start)


def _calendar(log: PlanLog) -> CalendarConfig:
    """Return the calendar of the attached site file; other tables of an earlier version's may not be readable."""
    try:
        values = toml_values(log.attachments.get(SITE_FILE, b"").decode("utf-8-sig"))
        return CalendarConfig.model_validate(values.get("calendar", {}))
    except (ValueError, ValidationError):
        return CalendarConfig()
