"""The crews of a plan in calendar time: how long each works, and how long it has no work in between."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from bimvox.site.config.calendar import CalendarConfig
from bimvox.site.site import Site

if TYPE_CHECKING:
    from bimvox.records.dates import WorkTime

_NS_PER_H = 3.6e12
_Span = tuple[int, int]


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
        works_h, idle_h = self.works_ns / _NS_PER_H, self.idle_ns / _NS_PER_H
        return {
            "crew": self.crew.name,
            "people": self.crew.people,
            "works_h": round(works_h, 3),
            "idle_h": round(idle_h, 3),
            "man_hours": round(works_h * self.crew.people, 2),
            "idle_man_hours": round(idle_h * self.crew.people, 2),
        }


def erection_crews(site: Site, calendar: CalendarConfig) -> tuple[Crew, ...]:
    """Return the crew of each crane; none if the site file does not say how many people it has."""
    people = calendar.erection_people
    if people is None:
        return ()
    names = ["Erection crew"] if not site.has_several_cranes else [f"Erection crew, {one.name}" for one in site.cranes]
    return tuple(Crew(name, float(people)) for name in names)


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
    lifts: Mapping[int, tuple[int, _Span]],
    cast: Sequence[_Span],
    deliveries: Sequence[_Span],
    work: WorkTime,
) -> tuple[CrewHours, ...]:
    """Return the time of each crew of known size that has work.

    Args:
        site: The site.
        calendar: Its calendar.
        lifts: Component, start and release of each lift, by order, in nanoseconds of calendar time.
        cast: Begin and end of the work at each part that is cast in place.
        deliveries: Begin and end of the unloading of each delivery.
        work: The working time.
    """
    of_crane: dict[int, list[_Span]] = {}
    for component, span in lifts.values():
        of_crane.setdefault(site.components[component].crane, []).append(span)
    found = [
        # A lift is not interrupted: one that is longer than a shift is worked beyond it.
        _hours(crew, of_crane[number], sum(end_ns - start_ns for start_ns, end_ns in of_crane[number]), work)
        for number, crew in enumerate(erection_crews(site, calendar))
        if number in of_crane
    ]
    for other, spans in ((unloading_crew(calendar), deliveries), (casting_crew(site), cast)):
        if other is not None and spans:
            found.append(_hours(other, spans, sum(work.between(*span) for span in spans), work))
    return tuple(found)


def _hours(crew: Crew, spans: Sequence[_Span], works_ns: int, work: WorkTime) -> CrewHours:
    there_ns = work.between(min(span[0] for span in spans), max(span[1] for span in spans))
    return CrewHours(crew, works_ns, max(0, there_ns - works_ns))
