"""The crew's times by class of work, with the crane standing: slings, tag lines, aligning and bracing.

The defaults are typical values of the field: together with the crane's motion a precast column or wall takes 12 to 25
minutes, a slab 5 to 10, and a crane sets 30 to 50 parts a day. How a lift is divided into these times is
professional judgement without a source. Of the totals, these sources give:

* slabs: up to 400 m2 of hollow-core slabs a day, 40 to 55 planks (VCON, Hollow-Core Usage Manual); 1,170 m2 in four
  days (Coreslab, in Construction Trends 4): 9 to 15 minutes a plank at most, with everything that interrupts the work;
* walls: 30 and more tilt-up panels in a day under good conditions (Concrete Construction, Tilt-up rigging procedures):
  16 to 20 minutes a panel;
* columns take as long as walls: both must be held in line, level and plumb at once (C. D. Johnson, Erection of precast
  concrete, PCI Journal, April 1969);
* beams, stairs, steel: typical, no source at hand.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Protocol

from bimvox.site.default_rules import FlipRules
from bimvox.site.work import Part, Work, work_of
from bimvox.sparse import SPARSE

TRIAL_LIFT_S = 10.0
"""Holding the raised part to check that it hangs properly; nominal."""

UPEND_S = 120.0
"""Upending a part that lies, besides the crane's motion: its foot is bedded and held, and it is tilted up slowly, the
rope kept upright, with looks at foot and anchors (professional judgement)."""


@dataclass(frozen=True, slots=True, order=True)
class CrewTimes:
    """What the crew takes for one part while the crane stands: ``CrewTimesConfig`` says what its fields mean."""

    sling_s: float
    brace_s: float
    release_s: float
    tag_line_s: float = field(default=0.0, metadata=SPARSE)

    @property
    def hook_on_s(self) -> float:
        """Attaching the slings and fixing the tag lines."""
        return self.sling_s + self.tag_line_s

    @property
    def hook_off_s(self) -> float:
        """Taking slings and tag lines off."""
        return self.release_s + self.tag_line_s

    @property
    def total_s(self) -> float:
        """All that the crane stands for in a lift, with the trial lift."""
        return self.hook_on_s + TRIAL_LIFT_S + self.brace_s + self.hook_off_s


@dataclass(frozen=True, slots=True)
class TimesByWork:
    """The crew's times by class of work; the fields are the values of ``Work``."""

    footing: CrewTimes
    column: CrewTimes
    wall: CrewTimes
    beam: CrewTimes
    slab: CrewTimes
    stair: CrewTimes
    steel: CrewTimes
    other: CrewTimes


FIELD_TIMES = TimesByWork(
    footing=CrewTimes(120.0, 300.0, 60.0, 30.0),
    column=CrewTimes(120.0, 720.0, 120.0, 30.0),
    wall=CrewTimes(120.0, 900.0, 120.0, 30.0),
    beam=CrewTimes(120.0, 300.0, 90.0, 30.0),
    slab=CrewTimes(120.0, 180.0, 60.0, 30.0),
    stair=CrewTimes(120.0, 300.0, 60.0, 30.0),
    steel=CrewTimes(90.0, 300.0, 60.0, 30.0),
    other=CrewTimes(120.0, 300.0, 90.0, 30.0),
)
"""The defaults of the site file."""


class _Rules(Protocol):
    @property
    def times(self) -> TimesByWork: ...

    @property
    def bracing_s(self) -> float | None: ...

    @property
    def release_s(self) -> float | None: ...

    @property
    def upend_s(self) -> float: ...

    @property
    def two_hooks(self) -> FlipRules | None: ...


def crew_times(rules: _Rules, part: Part, *, tag_lines: bool = True) -> CrewTimes:
    """Return the crew's times for a part: those of its class, unless the rules give one value for all classes.

    A load without tag lines turns with the jib.
    """
    own = times_of(rules.times, work_of(part))
    brace_s = own.brace_s if rules.bracing_s is None else rules.bracing_s
    release_s = own.release_s if rules.release_s is None else rules.release_s
    return CrewTimes(own.sling_s, brace_s, release_s, own.tag_line_s if tag_lines else 0.0)


def standing_s(rules: _Rules, part: Part, *, upended: bool, flipped: bool = False) -> float:
    """Return how long the crane stands for a part, with the trial lift, and upending if it lies in the yard."""
    return crew_times(rules, part).total_s + upending_s(rules, upended=upended, flipped=flipped)


def upending_s(rules: _Rules, *, upended: bool, flipped: bool) -> float:
    """Return how long a part takes to upend about its foot, or to turn over between two hooks (``flipped``)."""
    if flipped and rules.two_hooks is not None:
        return rules.two_hooks.turn_s + rules.two_hooks.unhook_s
    return rules.upend_s if upended else 0.0


def times_of(times: TimesByWork, work: Work) -> CrewTimes:
    """Return the times of a class of work."""
    result: CrewTimes = getattr(times, work.value)
    return result
