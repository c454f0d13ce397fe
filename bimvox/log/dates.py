"""The dates of a log: its plan in calendar time, by the attached site file, next to those of its programme."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace
from datetime import datetime

from pydantic import ValidationError

from bimvox.errors import ConfigError
from bimvox.log.plan_log import PlanLog
from bimvox.records.dates import PlanDates, dates_of
from bimvox.records.programme import against_programme
from bimvox.records.proof import Remark, Severity
from bimvox.remarks.rules import late
from bimvox.site.config.calendar import CalendarConfig
from bimvox.site.config.file import SITE_FILE
from bimvox.site.nested import toml_values
from bimvox.site.programme import ATTACHED, read_programme


def log_dates(log: PlanLog, start: datetime | None = None) -> PlanDates | None:
    """Return the dates of a log.

    ``start``: when work may begin, local time; None takes the site file's.

    Returns:
        The dates; None if the start is not known, or of an extract or a plan without a crane: dates follow from the
        motions of all lifts.
    """
    if log.context:
        return None
    site = log.plan.site
    dates = dates_of(_calendar(log), site, log.plan.lifts, log.motions, log.steps, start)
    if dates is None or (given := attached_programme(log)) is None:
        return dates
    with suppress(ConfigError):
        programme = read_programme(given[1], given[0], None)
        parts = {lift.order: site.components[lift.component] for lift in log.plan.lifts}
        return replace(dates, programme=against_programme(programme, parts, dates.spans, dates.calendar.hours))
    return dates


def attached_programme(log: PlanLog) -> tuple[str, bytes] | None:
    """Return name and bytes of the programme that a log carries; None if it carries none."""
    found = ((name, data) for name, data in sorted(log.attachments.items()) if name.startswith(ATTACHED))
    return next(((name.removeprefix(ATTACHED), data) for name, data in found), None)


def all_remarks(log: PlanLog) -> tuple[Remark, ...]:
    """Return the remarks of a log with those about its dates, the gravest first; none if its values make no sense.

    Those about dates are not in the log: public holidays change with the package that knows them.
    """
    if log.remarks is None or attached_programme(log) is None:
        return log.remarks or ()
    dates, rank = log_dates(log), list(Severity)
    found = [*log.remarks, *late(dates.programme if dates else ())]
    return tuple(sorted(found, key=lambda remark: rank.index(remark.severity)))


def _calendar(log: PlanLog) -> CalendarConfig:
    """Return the calendar of the attached site file; other tables of an earlier version's may not be readable."""
    try:
        values = toml_values(log.attachments.get(SITE_FILE, b"").decode("utf-8-sig"))
        return CalendarConfig.model_validate(values.get("calendar", {}))
    except (ValueError, ValidationError):
        return CalendarConfig()
