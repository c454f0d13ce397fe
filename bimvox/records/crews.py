"""The crews of a plan, and the time of each."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from bimvox.records.work_time import Span, WorkTime
from bimvox.site.component import Component
from bimvox.site.config.calendar import CalendarConfig
from bimvox.site.site import Site
from bimvox.units import NS_PER_H


@dataclass(frozen=True, slots=True)
class Crew:
    """People who work together."""

    name: str
    people: float


@dataclass(frozen=True, slots=True)
class CrewHours:
    """The time of a crew.

    Attributes:
        crew: The crew.
        works_ns: How long it works.
        idle_ns: Working time from its first to its last work in which it has none.
    """

    crew: Crew
    works_ns: int
    idle_ns: int

    def document(self) -> dict[str, object]:
        """Return it for the JSON documents: hours of the crew, and those of its people together."""
        works_h, idle_h = self.works_ns / NS_PER_H, self.idle_ns / NS_PER_H
        return {
            "crew": self.crew.name,
            "people": self.crew.people,
            "works_h": round(works_h, 3),
            "idle_h": round(idle_h, 3),
            "man_hours": round(works_h * self.crew.people, 2),
            "idle_man_hours": round(idle_h * self.crew.people, 2),
        }


def erection_crews(site: Site, calendar: CalendarConfig) -> tuple[Crew, ...]:
    """Return the crew of each crane."""
    several = site.has_several_cranes
    names = [f"Erection crew, {one.name}" for one in site.cranes] if several else ["Erection crew"]
    return tuple(Crew(name, float(calendar.erection_people)) for name in names)


def crew_of(site: Site, component: Component) -> int:
    """Return the number of the erection crew that sets a part: that of its crane; a crane that moves has one."""
    return component.crane if site.has_several_cranes else 0


def unloading_crew(calendar: CalendarConfig) -> Crew | None:
    """Return the crew that unloads deliveries; None if the site file does not say how many people it has."""
    people = calendar.unloading_people
    return None if people is None else Crew("Unloading crew", float(people))


def casting_crew(site: Site) -> Crew:
    """Return the crew that casts in place."""
    return Crew("Casting crew", site.rules.casting.people)


def crew_hours(
    site: Site,
    calendar: CalendarConfig,
    lifts: Mapping[int, tuple[int, Span]],
    cast: Sequence[Span],
    deliveries: Sequence[Span],
    work: WorkTime,
) -> tuple[CrewHours, ...]:
    """Return the time of each crew of known size that has work.

    Where nobody else is stated, the first erection crew unloads.

    ``lifts``: component, start and release of each lift, by order, in nanoseconds of calendar time; ``cast`` and
    ``deliveries``: begin and end of the work at each part that is cast in place, and of the unloading of each
    delivery.
    """
    of_crane: dict[int, list[Span]] = {}
    for component, span in lifts.values():
        of_crane.setdefault(crew_of(site, site.components[component]), []).append(span)
    unloading, found = unloading_crew(calendar), []
    for number, crew in enumerate(erection_crews(site, calendar)):
        if number in of_crane:
            # A lift is not interrupted: one that is longer than a shift is worked beyond it.
            lifted_ns = sum(end_ns - start_ns for start_ns, end_ns in of_crane[number])
            unloads = deliveries if unloading is None and number == min(of_crane) else ()
            unloaded_ns = sum(work.between(*span) for span in unloads)
            found.append(_hours(crew, [*of_crane[number], *unloads], lifted_ns + unloaded_ns, work))
    for other, spans in ((unloading, deliveries), (casting_crew(site), cast)):
        if other is not None and spans:
            found.append(_hours(other, spans, sum(work.between(*span) for span in spans), work))
    return tuple(found)


def _hours(crew: Crew, spans: Sequence[Span], works_ns: int, work: WorkTime) -> CrewHours:
    there_ns = work.between(min(span[0] for span in spans), max(span[1] for span in spans))
    return CrewHours(crew, works_ns, max(0, there_ns - works_ns))
