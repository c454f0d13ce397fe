"""The content of a log, as a value."""

from __future__ import annotations

import dataclasses
import difflib
from collections.abc import Collection, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from datetime import datetime
from enum import StrEnum
from functools import cached_property
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray
from pydantic import ValidationError

from bimvox.errors import ConfigError, SelectionError
from bimvox.motion.steps import steps_of_log
from bimvox.records.dates import dates_of
from bimvox.records.done import DoneWork
from bimvox.records.lift import Lift, LiftPlan, Status
from bimvox.records.motion import TRACKS, CarriedOut, LiftMotion
from bimvox.records.plan_dates import PlanDates
from bimvox.records.programme import against_programme
from bimvox.records.proof import Remark, Severity
from bimvox.records.props import Props, Standing
from bimvox.records.steps import Steps
from bimvox.remarks.proven_props import proven_props
from bimvox.remarks.remarks import remarks_if_sensible
from bimvox.remarks.rules import late
from bimvox.site.component import Component
from bimvox.site.config.calendar import CalendarConfig, CostsConfig
from bimvox.site.config.file import SITE_FILE
from bimvox.site.means import HOW
from bimvox.site.nested import toml_values
from bimvox.site.programme import ATTACHED, read_programme
from bimvox.version import __version__

_STEPS = 2.0**30
"""Viewers are shown values in such parts of a metre or radian, about a nanometre: finer ones compress badly."""


class LogRate(StrEnum):
    """Which samples the topics for viewers have."""

    MOTION = "motion"
    """Those that the motion needs: :mod:`bimvox.log.driven` says which."""
    FULL = "full"
    """Every sample; commands once a period of the site's rules."""


def shown_values(exact: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return values as viewers are shown them."""
    return np.round(exact * _STEPS) / _STEPS + 0.0  # no negative zero


GEOREFERENCE = "georeference"
"""Metadata key: the model's map conversion, as JSON."""

PENDING = "pending_lifts"
"""Metadata key of a segment: orders of planned lifts that are proven only in a later segment, as a JSON list."""


@dataclass(frozen=True, slots=True)
class LogEvent:
    """A span to mark on the timeline, such as a replan.

    Attributes:
        kind: Its kind; ``lift`` and ``phase`` are the recorder's own.
        start_ns: When it starts on the site's clock.
        end_ns: When it ends.
        fields: Plain values about it.
    """

    kind: str
    start_ns: int
    end_ns: int
    fields: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class PlanLog:
    """A plan over time, with all its inputs.

    Attributes:
        plan: The site and the lifts that the log carries.
        motions: One per planned lift, in order; empty on a site without a crane.
        attachments: Files that the plan was made from (site file, obstruction file, grid ...), by name.
        metadata: Plain values about the plan (seed, policy, hashes ...).
        revision: Number of the plan among those for the same site; 0 for the first.
        events: Spans other than lifts and phases.
        context: Lifts of the same plan that the log, an extract, does not carry; they have no paths.
        recovered: Whether it was recovered from a damaged log, of which something was lost.
        version: The version of bimvox that made the plan.
        carried_out: How the plan was carried out among people and vehicles; None if it was not. An extract has none.
        rate: Which samples its topics for viewers have.
    """

    plan: LiftPlan
    motions: tuple[LiftMotion, ...] = field(default=(), repr=False)
    attachments: Mapping[str, bytes] = field(default_factory=dict, repr=False)
    metadata: Mapping[str, str] = field(default_factory=dict)
    revision: int = 0
    events: tuple[LogEvent, ...] = ()
    context: tuple[Lift, ...] = ()
    recovered: bool = False
    version: str = __version__
    carried_out: CarriedOut | None = field(default=None, repr=False)
    rate: LogRate = LogRate.MOTION

    @property
    def all_lifts(self) -> tuple[Lift, ...]:
        """All lifts, carried or not, in ascending order."""
        return self.plan.lifts_with(self.context)

    @property
    def whole_plan(self) -> LiftPlan:
        """The plan with all lifts."""
        return dataclasses.replace(self.plan, lifts=self.all_lifts)

    @cached_property
    def planned(self) -> tuple[Lift, ...]:
        """The carried lifts that have a path."""
        return tuple(lift for lift in self.plan.lifts if lift.status is Status.PLANNED)

    @cached_property
    def steps(self) -> Steps:
        """The steps of work that the crane does not do, and its pauses; none of an extract, because all lifts count."""
        return steps_of_log(self.plan, self.motions, self.context)

    @cached_property
    def props(self) -> Props:
        """What holds the lifted parts when they are released; nothing of an extract, because all lifts count."""
        return proven_props(self.plan, tuple(self.motions), tuple(self.context))

    @property
    def props_standing(self) -> tuple[Standing, ...]:
        """The parts that have props, and when these stand on the site's clock."""
        return self.props.standing(self.steps, max((motion.end_ns for motion in self.motions), default=0))

    @cached_property
    def remarks(self) -> tuple[Remark, ...] | None:
        """What a person should look at although the plan is proven; None if its values make no sense."""
        return remarks_if_sensible(self.plan, self.motions, self.context)

    def extract(self, orders: Collection[int]) -> PlanLog:
        """Return the extract with the lifts of those orders; the others become context.

        A segment of a watch of which lifts are left out is not a segment: what it says about itself goes too. So do the
        tracks of the execution, which an extract does not hold.
        """
        left = tuple(lift for lift in self.plan.lifts if lift.order not in orders)
        motions = tuple(motion for motion in self.motions if motion.order in orders)
        return dataclasses.replace(
            self,
            plan=dataclasses.replace(self.plan, lifts=tuple(lift for lift in self.plan.lifts if lift.order in orders)),
            motions=motions,
            carried_out=None,
            attachments={name: data for name, data in self.attachments.items() if not name.startswith(TRACKS)},
            metadata={
                key: value
                for key, value in self.metadata.items()
                if not (left and key == PENDING) and not key.startswith(f"sha256 {TRACKS}")
            },
            events=() if left else self.events,
            context=tuple(
                sorted(
                    (*self.context, *(dataclasses.replace(lift, path_vox=None) for lift in left)),
                    key=lambda lift: lift.order,
                )
            ),
        )


def with_full_rate(log: PlanLog) -> PlanLog:
    """Return the log that shows every sample of its motions."""
    return dataclasses.replace(log, rate=LogRate.FULL)


# Which lifts of a log a person means: by number from 1, by id, GlobalId or name of the part.

_NEAREST, _ALIKE = 3, 0.4


def chosen_lifts(log: PlanLog, names: Sequence[str] = ()) -> tuple[int, ...]:
    """Return the orders of the chosen lifts, ascending.

    Args:
        log: The log; lifts of an extract's context cannot be chosen.
        names: Lift numbers from 1, or component ids, GlobalIds or names; none means all.

    Raises:
        SelectionError: If the log has no such lift, or several parts have that name.
    """
    if not names:
        return tuple(lift.order for lift in log.plan.lifts)
    return tuple(sorted({order for name in names for order in _orders(log, log.plan.lifts, name)}))


def chosen_lift(log: PlanLog, name: str) -> int:
    """Return the order of one lift, which may be one that the log (an extract) does not carry.

    Raises:
        SelectionError: If there is no such lift, or several fit.
    """
    found = _orders(log, log.all_lifts, name)
    if len(found) > 1:
        raise _several(name, found)
    return found[0]


def _orders(log: PlanLog, lifts: Sequence[Lift], name: str) -> list[int]:
    components = log.plan.site.components
    for key in ("id", "global_id", "name"):
        result = [lift.order for lift in lifts if getattr(components[lift.component], key) == name]
        if len(result) > 1 and key == "name":
            raise _several(name, result)
        if result:
            return result
    if name.removeprefix("-").isdecimal():
        result = [lift.order for lift in lifts if lift.number == int(name)]
        if not result:
            raise SelectionError(f"there is no lift {name} in this log", hint=_range(lifts))
        return result
    known = [text for lift in lifts for part in [components[lift.component]] for text in (part.name, part.id) if text]
    near = difflib.get_close_matches(name, list(dict.fromkeys(known)), n=_NEAREST, cutoff=_ALIKE)
    hint = f"did you mean {' or '.join(near)}?" if near else f"{_range(lifts)}; bimvox inspect LOG lists them"
    raise SelectionError(f"no lift {name!r} in this log of {len(lifts)} lifts", hint=hint)


def _several(name: str, orders: Sequence[int]) -> SelectionError:
    numbers = ", ".join(str(order + 1) for order in orders[:5])
    return SelectionError(
        f"{len(orders)} lifts are of parts called {name!r}", hint=f"give the lift's number: {numbers}"
    )


def _range(lifts: Sequence[Lift]) -> str:
    """Say which numbers there are; those of an extract may have gaps."""
    numbers = [lift.number for lift in lifts]
    if not numbers:
        return "the log has no lifts"
    if len(numbers) == numbers[-1] - numbers[0] + 1:
        return f"its lifts are numbered {numbers[0]} to {numbers[-1]}"
    return f"its lifts are numbered {numbers[0]} to {numbers[-1]}, with gaps (it is an extract)"


# The dates of a log: its plan in calendar time, by the attached site file, next to those of its programme.


def task_name(component: Component, number: int, *, is_lift: bool) -> str:
    """Return what the task of a lift, or a step of other work, is called in schedules."""
    name = component.name or component.id
    return f"Lift {number}: {name}" if is_lift else f"Step {number}: {name}, {how_set(component)}"


def how_set(component: Component) -> str:
    """Return how a part is set that the crane does not set."""
    return HOW.get(component.means, "set by other means")


def log_dates(log: PlanLog, start: datetime | None = None, done: DoneWork | None = None) -> PlanDates | None:
    """Return the dates of a log.

    ``start``: when work may begin, local time; None takes the site file's. ``done``: what has been carried out.

    Returns:
        The dates; None if the start is not known, or of an extract or a plan without a crane: dates follow from the
        motions of all lifts.
    """
    if log.context:
        return None
    site = log.plan.site
    dates = dates_of(log_calendar(log), site, log.plan.lifts, log.motions, log.steps, start, done=done)
    if dates is None or (given := attached_programme(log)) is None:
        return dates
    with suppress(ConfigError):
        programme = read_programme(given[1], given[0], None)
        parts = {lift.order: site.components[lift.component] for lift in log.plan.lifts}
        return replace(dates, programme=against_programme(programme, parts, dates.spans, dates.hours))
    return dates


def log_times(log: PlanLog) -> PlanDates | None:
    """Return the dates of a log; if no start is known, its times from a usual Monday on, by numbered working days.

    None of an extract, of a plan without a crane, or of motions without the phases that say when a part is released.
    """
    if log.context or not all(motion.is_phased for motion in log.motions):
        return None
    site = log.plan.site
    return log_dates(log) or dates_of(log_calendar(log), site, log.plan.lifts, log.motions, log.steps, numbered=True)


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


_T = TypeVar("_T", CalendarConfig, CostsConfig)


def log_calendar(log: PlanLog) -> CalendarConfig:
    """Return the calendar of the attached site file; other tables of an earlier version's may not be readable."""
    return _table_of(log, "calendar", CalendarConfig)


def log_costs(log: PlanLog) -> CostsConfig:
    """Return what cranes, crew and lorries cost by the attached site file, in the same way."""
    return _table_of(log, "costs", CostsConfig)


def _table_of(log: PlanLog, name: str, table: type[_T]) -> _T:
    try:
        values = toml_values(log.attachments.get(SITE_FILE, b"").decode("utf-8-sig"))
        return table.model_validate(values.get(name, {}))
    except (ValueError, ValidationError):
        return table()
