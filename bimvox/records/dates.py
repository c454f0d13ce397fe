"""The plan and its crews in calendar time: a view on its clock, which counts crane time. No motion changes."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from datetime import datetime
from heapq import heappop, heappush
from itertools import chain
from operator import itemgetter

from bimvox.records.crews import crew_hours
from bimvox.records.done import DoneWork
from bimvox.records.lift import Lift
from bimvox.records.motion import LiftMotion
from bimvox.records.plan_dates import Block, PlanDates
from bimvox.records.programme import Weather, added_ns
from bimvox.records.steps import Step, Steps, cured_ns
from bimvox.records.unloading import is_unloaded_by_crane, unloading_by_lorry_s, unloading_of
from bimvox.records.work_time import Span, WorkTime
from bimvox.site.config.calendar import CalendarConfig, UncertaintyConfig, day_h
from bimvox.site.means import Means
from bimvox.site.site import Site
from bimvox.site.work import Work, work_of
from bimvox.units import NS_PER_H, NS_PER_S


def dates_of(
    calendar: CalendarConfig,
    site: Site,
    lifts: Iterable[Lift],
    motions: Sequence[LiftMotion],
    steps: Steps,
    start: datetime | None = None,
    *,
    numbered: bool = False,
    done: DoneWork | None = None,
) -> PlanDates | None:
    """Return the dates of a plan; None if its start is not known, or it has no motions.

    Everything keeps its order in time: a lift waits for what carried before it in elapsed time, a step for the
    lifts before it, for its crew and for what carried. Waits run through nights and breaks, work does not.
    What is done has the dates at which it was done; the rest begins after the last of these, by the same rules.

    Args:
        calendar: The working hours.
        site: The site.
        lifts: All lifts of the plan.
        motions: Their motions.
        steps: The work that the crane does not do.
        start: When work may begin, local time; None takes the calendar's.
        numbered: If neither is known, return the times of a usual Monday on, whose working days are numbered.
        done: What has been carried out.
    """
    lifts = list(lifts)
    is_dated = start is not None or calendar.start is not None
    calendar = calendar if is_dated or not numbered else calendar.usual
    begins = start or calendar.begins
    if begins is None or not motions:
        return None
    dates = _walked(calendar, site, lifts, motions, steps, begins, done)
    unloading = unloading_of(calendar, site, lifts)
    clock_ns = max(motion.end_ns for motion in motions) - min(motion.start_ns for motion in motions)
    dates = replace(dates, unloading=unloading, crane_ns=clock_ns, is_dated=is_dated)
    if not is_dated:
        return dates
    set_by_crane = {motion.order: (motion.component, dates.lifts[motion.order]) for motion in motions}
    cast = [
        dates.steps[step.order][:2] for step in steps.steps if site.components[step.component].means is Means.IN_SITU
    ]
    unloaded = [span for spans in dates.lorries.values() for span in spans]
    dates = replace(dates, crews=crew_hours(site, calendar, set_by_crane, cast, unloaded, dates.work))
    times: dict[Work, list[int]] = {}
    left = (motion for motion in motions if done is None or motion.order not in done.begun)
    for motion in sorted(left, key=lambda motion: motion.order):
        start_ns, released_ns = dates.lifts[motion.order]
        times.setdefault(work_of(site.components[motion.component]), []).append(released_ns - start_ns)
    days = (max([dates.first, *([done.until] if done else [])]).date(), dates.last.date())
    weather = Weather(
        tuple(dates.hours.weather_shares(*days, calendar.days_lost)),
        sum(days[0] <= day <= days[1] for day in dates.hours.weather),
        round(day_h(calendar) * NS_PER_H),
    )
    uncertainty = calendar.uncertainty or UncertaintyConfig()
    return replace(dates, later_ns=added_ns(uncertainty, times, unloading.deliveries, weather))


def hire_days(
    calendar: CalendarConfig, site: Site, lifts: Iterable[Lift], motions: Sequence[LiftMotion], steps: Steps
) -> int | None:
    """Return for how many days the crane of a plan is hired, see ``PlanDates.hire_days``; None without motions.

    If the calendar has no start, from a Monday on, with the mean of the days that wind takes.
    """
    known = calendar if calendar.start is not None else calendar.usual
    if not motions or known.begins is None:
        return None
    return _walked(known, site, lifts, motions, steps, known.begins).hire_days


def _walked(
    calendar: CalendarConfig,
    site: Site,
    lifts: Iterable[Lift],
    motions: Sequence[LiftMotion],
    steps: Steps,
    begins: datetime,
    done: DoneWork | None = None,
) -> PlanDates:
    work = WorkTime(calendar.hours_from(begins.date()), begins)
    return _Walk(calendar, site, work, done).over(lifts, motions, steps)


def blocks_of(site: Site, motions: Iterable[LiftMotion]) -> tuple[Block, ...]:
    """Return the lifts as blocks between which the cranes may stop; of several cranes, no load hangs then."""
    several = site.has_several_cranes
    spans = sorted(
        (motion.hooked_ns, motion.released_ns, motion.order)
        if several
        else (motion.start_ns, motion.end_ns, motion.order)
        for motion in motions
    )
    found: list[Block] = []
    for begins_ns, ends_ns, order in spans:
        if found and begins_ns < found[-1].ends_ns:
            last = found.pop()
            found.append(Block(last.begins_ns, max(last.ends_ns, ends_ns), (*last.orders, order)))
        else:
            found.append(Block(begins_ns, ends_ns, (order,)))
    return tuple(found)


class _Walk:
    """Goes through a plan in elapsed time and gives everything its date."""

    def __init__(self, calendar: CalendarConfig, site: Site, work: WorkTime, done: DoneWork | None = None) -> None:
        self.calendar, self.site, self.work = calendar, site, work
        self._begun = {order: work.ns_of(at) for order, at in done.begun.items()} if done else {}
        self._ended = {order: work.ns_of(at) for order, at in done.ended.items()} if done else {}
        self._until_ns = work.ns_of(done.until) if done else 0
        self.lifts: dict[int, tuple[int, int]] = {}
        self.steps: dict[int, tuple[int, int, int]] = {}
        self.lorries: dict[int, tuple[Span, ...]] = {}
        self.starts_ns: list[int] = []
        self.moves: dict[int, Span] = {}
        self._released: list[tuple[int, int]] = []  # of each lift: in the plan's elapsed time, in calendar time
        self._waits: list[tuple[int, int]] = []  # a heap, of the steps: when each carries, in both times
        self._carried_ns = 0
        self._crew_ns: dict[Means, int] = {}
        self._loads: dict[int, list[Lift]] = {}

    def over(self, lifts: Iterable[Lift], motions: Sequence[LiftMotion], planned: Steps) -> PlanDates:
        of_order = {motion.order: motion for motion in motions}
        delivery: dict[int, int] = {}
        for lift in lifts:
            if lift.place is not None:
                delivery[lift.order] = lift.place.delivery
                self._loads.setdefault(lift.place.delivery, []).append(lift)
        blocks, moves = blocks_of(self.site, motions), {move.order: move for move in planned.moves}
        # At the same time, a step comes first: it may carry at once.
        items: list[tuple[int, int, Step | Block]] = [(step.begins_ns, 0, step) for step in planned.steps]
        items += [(planned.starting_ns(block.begins_ns), 1, block) for block in blocks]
        setup_ns = round(self.calendar.setup_h * 3600.0 * NS_PER_S)
        setup = (self.work.fitting(0, 0), self.work.worked(0, setup_ns)) if setup_ns else None
        end_ns = setup[1] if setup else 0
        clock_ns = min(motion.start_ns for motion in motions)
        for at_ns, _, item in sorted(items, key=lambda entry: entry[:2]):
            self._carry(at_ns)
            if isinstance(item, Step):
                self._step(item)
                continue
            end_ns = self.work.worked(end_ns, item.begins_ns - clock_ns)
            for order in item.orders:
                if (move := moves.get(order)) is not None:
                    begins_ns, end_ns = end_ns, self.work.worked(end_ns, move.ends_ns - move.begins_ns)
                    self.moves[order] = (self.work.fitting(begins_ns, 0), end_ns)
            begun_ns = self._block_begun(item, of_order)
            coming = sorted({delivery[order] for order in item.orders if order in delivery} - self.lorries.keys())
            work_ns = {number: self._unloading_ns(number) for number in coming}
            ready_ns = end_ns
            for each_ns in chain.from_iterable(work_ns.values()):
                ready_ns = self.work.unloaded(ready_ns, each_ns)[1]
            if begun_ns is None:
                ready_ns = max(ready_ns, self._carried_ns, self._until_ns)
                start_ns = self.work.fitting(ready_ns, item.ends_ns - item.begins_ns)
            else:
                start_ns = begun_ns
            self._unload(work_ns, min(end_ns, start_ns), start_ns)
            if begun_ns is not None:  # what was lifted earlier than planned had come by then
                for number in coming:
                    spans = self.lorries.get(number, ())
                    self.lorries[number] = tuple((min(low, start_ns), min(high, start_ns)) for low, high in spans)
            self.starts_ns.append(start_ns)
            for motion in sorted((of_order[order] for order in item.orders), key=lambda motion: motion.released_ns):
                self.lifts[motion.order] = at = self._lift(motion, start_ns - item.begins_ns)
                released_ns = planned.ending_ns(motion.released_ns)
                self._released.append((released_ns, at[1]))
                if (cured_at_ns := cured_ns(self.site, planned, motion)) is not None:
                    heappush(self._waits, (cured_at_ns, at[1] + cured_at_ns - released_ns))
            late_ns = (self.lifts[n][1] - of_order[n].released_ns - start_ns + item.begins_ns for n in item.orders)
            end_ns, clock_ns = start_ns + item.ends_ns - item.begins_ns + max(late_ns), item.ends_ns
        long = (block for block in blocks if self.work.is_too_long(block.ends_ns - block.begins_ns))
        return PlanDates(
            self.calendar,
            self.work.begins,
            self.lifts,
            self.steps,
            self.lorries,
            setup,
            tuple(sorted(order for block in long for order in block.orders)),
            tuple(zip(blocks, self.starts_ns, strict=True)),
            self.work,
            is_unloaded_by_crane(self.calendar, self.site),
            moves=self.moves,
        )

    def _unloading_ns(self, number: int) -> tuple[int, ...]:
        """Return the working time to unload each lorry of a delivery, in the order in which they come."""
        times_s = unloading_by_lorry_s(self.calendar, self.site, self._loads[number])
        return tuple(round(time_s * NS_PER_S) for time_s in times_s if time_s)

    def _unload(self, work_ns: dict[int, tuple[int, ...]], from_ns: int, until_ns: int) -> None:
        """Note when lorries are unloaded: on the day of their delivery's first lift, or some working days earlier.

        One follows the other, and none stays overnight that can be unloaded in a day.

        ``work_ns``: the working time of each lorry of each delivery, in the order in which they come; ``from_ns``: when
        the yard is free for them; ``until_ns``: when the first lift of theirs starts.
        """
        earliest_ns = {}
        for number, lorries_ns in work_ns.items():
            earliest_ns[number] = from_ns
            for each_ns in lorries_ns:
                from_ns = self.work.unloaded(from_ns, each_ns)[1]
        for number, lorries_ns in reversed(work_ns.items()):
            if not lorries_ns:
                continue
            for each_ns in reversed(lorries_ns):
                until_ns = self.work.unloaded_by(until_ns, each_ns)
            at_ns = max(earliest_ns[number], self.work.days_before(until_ns, self.calendar.delivery_days))
            spans = []
            for each_ns in lorries_ns:
                spans.append(self.work.unloaded(at_ns, each_ns))
                at_ns = spans[-1][1]
            self.lorries[number] = tuple(spans)
            until_ns = spans[0][0]

    def _lift(self, motion: LiftMotion, shift_ns: int) -> tuple[int, int]:
        """Return start and release of a lift; the empty hook's way to it may begin after a break, not before it."""
        start_ns, hooked_ns = motion.work_starts_ns + shift_ns, motion.hooked_ns + shift_ns
        if self.site.has_several_cranes:
            start_ns = max(start_ns, min(self.work.stretch_start(hooked_ns), hooked_ns))
        begun_ns = self._begun.get(motion.order, start_ns)
        return begun_ns, self._ended.get(motion.order, motion.released_ns + shift_ns + begun_ns - start_ns)

    def _block_begun(self, block: Block, motions: Mapping[int, LiftMotion]) -> int | None:
        """Return when a block begins whose first lift has begun; None if none has."""
        begun = [order for order in block.orders if order in self._begun]
        if not begun:
            return None
        first = min(begun, key=lambda order: self._begun[order])
        return self._begun[first] - (motions[first].work_starts_ns - block.begins_ns)

    def _carry(self, at_ns: int) -> None:
        """Note what carries at a time, in the plan's elapsed time; the times that are asked for ascend."""
        while self._waits and self._waits[0][0] <= at_ns:
            self._carried_ns = max(self._carried_ns, heappop(self._waits)[1])

    def _step(self, step: Step) -> None:
        means = self.site.components[step.component].means
        earlier = bisect_right(self._released, step.begins_ns, key=itemgetter(0))
        released_ns = self._released[earlier - 1][1] if earlier else 0
        ready_ns = max(self._carried_ns, released_ns, self._crew_ns.get(means, 0), self._until_ns)
        begins_ns = self._begun.get(step.order, self.work.fitting(ready_ns, 0))
        ends_ns = self._ended.get(step.order, self.work.worked(begins_ns, step.ends_ns - step.begins_ns))
        if means is not Means.CRANE:  # one crew does one part after the other
            self._crew_ns[means] = ends_ns
        self.steps[step.order] = (begins_ns, ends_ns, ends_ns + step.carries_ns - step.ends_ns)
        heappush(self._waits, (step.carries_ns, self.steps[step.order][2]))
