"""The ``[rules]`` table of a site file: clearances, swing, wind, times of the crew and of work cast in place."""

from __future__ import annotations

import math
from dataclasses import asdict, replace
from functools import partial
from typing import Annotated, Literal, Self

from pydantic import AfterValidator, Field

from bimvox.site.building_times import FIELD_BUILDING, BuildingTimes
from bimvox.site.casting import FIELD_CASTING, Casting, CastTimes, Curing
from bimvox.site.config.validation import (
    Flag,
    NotNegative,
    Number,
    Positive,
    Table,
    not_below,
)
from bimvox.site.crew_times import FIELD_TIMES, CrewTimes, TimesByWork
from bimvox.site.default_rules import DEFAULT_RULES
from bimvox.site.limits import (
    MOST_CONTACT_TOLERANCE_M,
    MOST_SAMPLE_PERIOD_S,
    MOST_SUPPORT_GAP_M,
)
from bimvox.site.site import HeadingRule, Rules, SwingRule

_RULES = Rules()


Pause = Annotated[NotNegative, Field(le=86_400.0)]
"""A time that the crane waits in a lift: at most a day."""


Period = Annotated[Positive, Field(le=MOST_SAMPLE_PERIOD_S), AfterValidator(partial(not_below, 1e-3))]


class CrewTimesConfig(Table):
    """Times of the crew at a standing crane."""

    sling_s: Pause | None = None
    """To attach the slings."""
    brace_s: Pause | None = None
    """To align, fix and brace the part on the hook."""
    release_s: Pause | None = None
    """To remove the slings."""
    tag_line_s: Pause | None = None
    """To fix the tag lines; removing them takes as long."""

    @classmethod
    def of(cls, times: CrewTimes) -> Self:
        """Return the table of these times."""
        return cls(**asdict(times))


class TimesConfig(Table):
    """The crew's times by class of work."""

    footing: CrewTimesConfig = CrewTimesConfig.of(FIELD_TIMES.footing)
    """Footings, piles, base slabs."""
    column: CrewTimesConfig = CrewTimesConfig.of(FIELD_TIMES.column)
    """Columns, upright slender parts."""
    wall: CrewTimesConfig = CrewTimesConfig.of(FIELD_TIMES.wall)
    """Walls, thin upright parts."""
    beam: CrewTimesConfig = CrewTimesConfig.of(FIELD_TIMES.beam)
    """Beams, long parts."""
    slab: CrewTimesConfig = CrewTimesConfig.of(FIELD_TIMES.slab)
    """Slabs, planks, roofs, flat parts."""
    stair: CrewTimesConfig = CrewTimesConfig.of(FIELD_TIMES.stair)
    """Flights, ramps, landings."""
    steel: CrewTimesConfig = CrewTimesConfig.of(FIELD_TIMES.steel)
    """All parts of steel."""
    other: CrewTimesConfig = CrewTimesConfig.of(FIELD_TIMES.other)
    """All others."""

    def times(self) -> TimesByWork:
        """Return the times, those that the file does not give from the defaults."""
        return TimesByWork(
            **{
                name: replace(getattr(FIELD_TIMES, name), **getattr(self, name).model_dump(exclude_none=True))
                for name in type(self).model_fields
            }
        )


class CastTimesConfig(Table):
    """The time of one class of work that is cast in place."""

    hours_m3: Annotated[NotNegative, Field(le=1e4)] | None = None
    """Hours of one person for a cubic metre (2,400 kg): formwork, reinforcement, pouring."""
    wait_h: Annotated[NotNegative, Field(le=2e4)] | None = None
    """Hours from the end of the work until it carries what rests on it."""

    @classmethod
    def of(cls, times: CastTimes) -> Self:
        """Return the table of these times."""
        return cls(**asdict(times))


class CastingConfig(Table):
    """Work that is cast in place, by class of work, or set by hand."""

    people: Annotated[Positive, Field(le=1e4)] = FIELD_CASTING.people
    """People who cast, one part after the other."""
    hand_s: Pause = FIELD_CASTING.hand_s
    """Time to set a part by hand, one after the other."""
    bundle_kg: NotNegative = FIELD_CASTING.bundle_kg
    """A heavier bundle of parts set by hand is a material lift."""
    bundle_s: Pause = FIELD_CASTING.bundle_s
    """Crane time of a material lift."""
    footing: CastTimesConfig = CastTimesConfig.of(FIELD_CASTING.footing)
    """Footings, piles, base slabs."""
    column: CastTimesConfig = CastTimesConfig.of(FIELD_CASTING.column)
    """Columns, upright slender parts."""
    wall: CastTimesConfig = CastTimesConfig.of(FIELD_CASTING.wall)
    """Walls, thin upright parts."""
    beam: CastTimesConfig = CastTimesConfig.of(FIELD_CASTING.beam)
    """Beams, long parts."""
    slab: CastTimesConfig = CastTimesConfig.of(FIELD_CASTING.slab)
    """Slabs, flat parts."""
    stair: CastTimesConfig = CastTimesConfig.of(FIELD_CASTING.stair)
    """Flights, ramps, landings."""
    steel: CastTimesConfig = CastTimesConfig.of(FIELD_CASTING.steel)
    """Steel built up in place; for 2.4 t."""
    other: CastTimesConfig = CastTimesConfig.of(FIELD_CASTING.other)
    """All others."""

    def casting(self) -> Casting:
        """Return the times, those that the file does not give from the defaults."""
        given = self.model_dump(exclude_none=True)
        own = {
            name: replace(getattr(FIELD_CASTING, name), **value) if isinstance(value, dict) else value
            for name, value in given.items()
        }
        return replace(FIELD_CASTING, **own)


class BuildingConfig(Table):
    """Parts that their trade builds in place: working hours of one person."""

    people: Annotated[Positive, Field(le=1e4)] = FIELD_BUILDING.people
    """People of a trade, at one part after the other."""
    masonry_h_m3: NotNegative = FIELD_BUILDING.masonry_h_m3
    """For a cubic metre of masonry."""
    light_h_m2: NotNegative = FIELD_BUILDING.light_h_m2
    """For a square metre of partitions, cladding, roof covering."""
    glazing_h_m2: NotNegative = FIELD_BUILDING.glazing_h_m2
    """For a square metre of glass."""
    earth_h_m3: NotNegative = FIELD_BUILDING.earth_h_m3
    """For a cubic metre of earth."""
    other_h_m3: NotNegative = FIELD_BUILDING.other_h_m3
    """For a cubic metre of anything else."""
    wait_h: Annotated[NotNegative, Field(le=2e4)] = FIELD_BUILDING.wait_h
    """Until it carries what rests on it."""


Cures = Annotated[NotNegative, Field(le=2e4)]


class CuringConfig(Table):
    """Hours, nights included, from the release of a lifted part until its joints carry what rests on it."""

    footing_h: Cures = 0.0
    """Footings, piles, base slabs."""
    column_h: Cures = 0.0
    """Columns, upright slender parts."""
    wall_h: Cures = 0.0
    """Walls, thin upright parts."""
    beam_h: Cures = 0.0
    """Beams, long parts."""
    slab_h: Cures = 0.0
    """Slabs, planks, roofs, flat parts."""
    stair_h: Cures = 0.0
    """Flights, ramps, landings."""
    steel_h: Cures = 0.0
    """All parts of steel."""
    other_h: Cures = 0.0
    """All others."""


class RulesConfig(Table):
    """The rules of the site; clearances are rounded up to whole cells."""

    clearance_m: NotNegative = _RULES.clearance_m
    """Of loads and ropes, to obstructions and the crane's mast."""
    transit_clearance_m: NotNegative | None = None
    """Of the load in transit, to everything. Default: 2 with a crane, as far as a lift can keep it. A value here is
    kept, or the lift is infeasible."""
    rope_clearance_m: NotNegative | None = None
    """Of hook and rope in transit, on plan, to everything higher. Default: 0.5, as above."""
    contact_tolerance_m: Annotated[NotNegative, Field(le=MOST_CONTACT_TOLERANCE_M)] = _RULES.contact_tolerance_m
    """How deep neighbours may overlap on the last moves."""
    support_gap_m: Annotated[NotNegative, Field(le=MOST_SUPPORT_GAP_M)] = _RULES.support_gap_m
    """How far below a part its support may be."""
    rope: Flag = _RULES.rope
    """Whether the column above the hook must be free."""
    sample_period_s: Period = _RULES.sample_period_s
    """Sampling interval of the log."""
    times: TimesConfig = TimesConfig()
    """How long the crew takes, by class of work."""
    casting: CastingConfig = CastingConfig()
    """How long work takes that the crane does not do."""
    building: BuildingConfig = BuildingConfig()
    """How long trades take for what they build in place."""
    curing: CuringConfig | None = None
    """Grout and other joints of lifted parts. Default: they carry at once."""
    bracing_s: Pause | None = None
    """One ``brace_s`` for all classes, instead of ``times``."""
    release_s: Pause | None = None
    """One value for all classes, instead of ``times``."""
    turn_s: Pause = _RULES.turn_s
    """Time to turn a hanging part by a quarter."""
    heading: Literal["kept", "with_jib"] = _RULES.heading.value
    """Of loads while the jib turns: "Heading" in the documentation of cranes."""
    swing: Literal["shaped", "off"] = _RULES.swing.value
    """``shaped``: no load swings when it is set. ``off``: swing is ignored."""
    truckload_kg: NotNegative = _RULES.truckload_kg
    """Largest mass of a delivery; a heavier part comes alone. 0: as much as the yard holds."""
    wind_speed_m_s: Annotated[NotNegative, Field(le=100.0)] | None = None
    """Gust of 3 s at jib height in which every lift must be possible; 0: no wind. Default: 9.8 with a crane, as far as
    a part permits it."""
    drag_coefficient: Positive = _RULES.drag_coefficient
    """Of the parts: 1.1 for a cube to 2.0 for a long plate."""
    sling_angle_deg: Annotated[Number, Field(gt=0.0, le=120.0)] = round(math.degrees(_RULES.sling_angle_rad), 12)
    """Largest angle between opposite legs of a sling."""
    critical_share: Annotated[Number, Field(gt=0.0, le=1.0)] = _RULES.critical_share
    """Share of the capacity from which a lift is critical."""
    highest_utilisation: Annotated[Number, Field(gt=0.0, le=1.0)] = _RULES.highest_utilisation
    """Highest permitted share of the capacity: no crane carries a load where it would use more."""
    crane_separation_m: Positive = _RULES.crane_separation_m
    """Between cranes and their loads, on plan or in height, also while they brake."""
    by_other_means: Flag = _RULES.by_other_means
    """Whether a part that the crane cannot set counts as set by other means. ``false``: what rests on it is infeasible
    too."""

    def rules(self, *, has_crane: bool = False) -> Rules:
        """Return the rules as a value for the planner, those that the file does not give by their defaults."""
        own: dict[str, object] = {"swing": SwingRule(self.swing), "heading": HeadingRule(self.heading)}
        own |= {"times": self.times.times(), "casting": self.casting.casting()}
        own |= {"building": BuildingTimes(**self.building.model_dump())}
        own["curing"] = None if self.curing is None else Curing(**self.curing.model_dump())
        own["sling_angle_rad"] = math.radians(self.sling_angle_deg)
        given = self.model_dump(exclude={"sling_angle_deg"}) | own
        left = tuple(key for key in DEFAULT_RULES if given[key] is None)
        defaults = {key: DEFAULT_RULES[key] if has_crane else 0.0 for key in left}
        return Rules(**(given | defaults), gives_way=left if has_crane else ())
