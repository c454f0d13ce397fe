"""The ``[rules]`` table of a site file: clearances, swing, wind, times of the crew and of work cast in place."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import asdict, fields, is_dataclass, replace
from enum import StrEnum
from functools import partial
from typing import Annotated, Any, Literal, Self

from pydantic import AfterValidator, Field

from bimvox.site.casting import FIELD_BUILDING, FIELD_CASTING, FIELD_CURING, BuildingTimes, Casting, CastTimes, Curing
from bimvox.site.config.validation import Flag, NotNegative, Number, Positive, Table, Text, Whole, not_below
from bimvox.site.crew_times import FIELD_TIMES, UPEND_S, CrewTimes, TimesByWork
from bimvox.site.default_rules import (
    DEFAULT_RULES,
    HIGHEST_UTILISATION,
    MOST_CONTACT_TOLERANCE_M,
    MOST_SAMPLE_PERIOD_S,
    MOST_SUPPORT_GAP_M,
    TRUCK_M,
    USUAL_YARD,
    FlipRules,
    TandemRules,
    YardRules,
)
from bimvox.site.props import FIELD_PROPS, PROP_TYPES, PropKind, PropRules, PropType
from bimvox.site.site import HeadingRule, Rules, SwingRule

_RULES, _FLIP, _TANDEM = Rules(), FlipRules(), TandemRules()


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
    """The crew's times by class of work, while the crane stands.

    Typical of the field, not measured; sources: docs/work.md.
    """

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
    """Work that the crane does not do: cast in place, by class of work, or set by hand.

    It begins when all earlier parts are set and what it rests on carries. The crane goes on with what does not rest on
    it, then it pauses. Work before the first lift is done when the clock starts. Typical of the field, not measured;
    sources: docs/work.md.
    """

    people: Annotated[Positive, Field(le=1e4)] = FIELD_CASTING.people
    """People who cast, one part after the other."""
    hand_s: Pause = FIELD_CASTING.hand_s
    """Time to set a part by hand, one after the other."""
    bundle_kg: NotNegative = FIELD_CASTING.bundle_kg
    """A heavier bundle of parts set by hand is a material lift."""
    bundle_s: Pause = FIELD_CASTING.bundle_s
    """Crane time of a material lift; it has no path."""
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
    """What its trade builds in place, of pieces, and then is in the way: working hours of one person."""

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
    """Hours, nights included, from the release of a lifted part until its joints carry what rests on it.

    Sources: docs/work.md. All 0: they carry at once.
    """

    footing_h: Cures = FIELD_CURING.footing_h
    """Footings, piles, base slabs."""
    column_h: Cures = FIELD_CURING.column_h
    """Columns, upright slender parts."""
    wall_h: Cures = FIELD_CURING.wall_h
    """Walls, thin upright parts."""
    beam_h: Cures = FIELD_CURING.beam_h
    """Beams, long parts."""
    slab_h: Cures = FIELD_CURING.slab_h
    """Slabs, planks, roofs, flat parts."""
    stair_h: Cures = FIELD_CURING.stair_h
    """Flights, ramps, landings."""
    steel_h: Cures = FIELD_CURING.steel_h
    """All parts of steel."""
    other_h: Cures = FIELD_CURING.other_h
    """All others."""
    floors_wait: Flag = FIELD_CURING.floors_wait
    """Whether all parts wait. ``false``: only columns and walls do, so that a storey waits for the joints of the one
    below; packers and props carry floors, beams and stairs meanwhile."""

    def value(self) -> Curing | None:
        """Return the times as a value for the planner; None if all joints carry at once."""
        curing = Curing(**self.model_dump())
        return curing if replace(curing, floors_wait=True) != Curing() else None


_AS_IN_TRANSIT = ("upending_clearance_m", "turning_clearance_m")
"""Clearances that are those of loads in transit if the file does not give them: the same value, and kept as that is."""


class PropTypeConfig(Table):
    """A type of props."""

    name: Text
    """Its name."""
    kind: PropKind
    """What it is."""
    least_m: Positive
    """Its shortest length."""
    most_m: Positive
    """Its longest length."""
    load_kn: Positive
    """What it carries along its axis at its longest length."""


class PropsConfig(Table):
    """Push-pull props of walls and columns, shores below planks. Sources: docs/props.md."""

    planned: Flag = True
    """``false``: the plan says nothing of what holds a part when its slings come off."""
    wind_kn_m2: Annotated[NotNegative, Field(le=1e3)] = FIELD_PROPS.wind_kn_m2
    """Wind on a part that stands on its props."""
    clearance_m: Annotated[NotNegative, Field(le=10.0)] = FIELD_PROPS.clearance_m
    """Of loads, to props."""
    shore_spacing_m: Annotated[Positive, Field(le=100.0)] = FIELD_PROPS.shore_spacing_m
    """Between lines of shores below planks that get a topping, and between the shores of a line."""
    plank_m: Annotated[NotNegative, Field(le=1e5)] = FIELD_PROPS.plank_m
    """Mean thickness up to which such a plank needs shores; 0: none does."""
    types: Annotated[tuple[PropTypeConfig, ...], Field(max_length=100)] = ()
    """Your own props; without them, generic ones. The first one that is long and strong enough is taken."""

    def value(self) -> PropRules | None:
        """Return the table as a value; None if no props are planned."""
        own = tuple(PropType(**one.model_dump()) for one in self.types)
        rules = PropRules(**self.model_dump(exclude={"planned", "types"}), types=own or PROP_TYPES)
        return rules if self.planned else None


class TwoHooksConfig(Table):
    """How a part that lies is turned over in the air by the main and the auxiliary hook of its crane.

    Typical of the field, not measured; sources: docs/slings.md.
    """

    clear_m: Annotated[NotNegative, Field(le=20.0)] = _FLIP.clear_m
    """How far it stays clear of the ground while it turns."""
    most_share: Annotated[Positive, Field(le=1.0)] = _FLIP.most_share
    """Share of the capacity of each hook, and of the load chart by both, that may be used."""
    turn_s: Pause = _FLIP.turn_s
    """Shortest time of the turn."""
    unhook_s: Pause = _FLIP.unhook_s
    """Time to take the auxiliary hook off when it stands upright."""

    def value(self) -> FlipRules:
        """Return the table as a value for the planner."""
        return FlipRules(**self.model_dump())


class TandemConfig(Table):
    """How two cranes of the site carry a part together. With this table, they carry what none of them carries alone."""

    most_share: Annotated[Positive, Field(le=1.0)] = _TANDEM.most_share
    """Share of each load chart that may be used."""
    off_level_deg: Annotated[NotNegative, Field(le=15.0)] = round(math.degrees(_TANDEM.off_level_rad), 9)
    """How far the load may hang out of level while it is carried; it moves mass from one hook to the other."""

    def value(self) -> TandemRules:
        """Return the table as a value for the planner."""
        return TandemRules(self.most_share, math.radians(self.off_level_deg))


class RulesConfig(Table):
    """The rules of the site; clearances are rounded up to whole cells."""

    clearance_m: NotNegative = _RULES.clearance_m
    """Of loads and ropes, to obstructions and the crane's mast."""
    transit_clearance_m: NotNegative | None = None
    """Of the load in transit, to everything. Default: 2 with a crane, as far as a lift can keep it. A value here is
    kept, or the lift is infeasible."""
    rope_clearance_m: NotNegative | None = None
    """Of hook and rope in transit, on plan, to everything higher. Default: 0.5, as above."""
    departure_clearance_m: NotNegative | None = None
    """Of the load straight up from the yard, until transit, to everything but what is next to the part as it lies, up
    to 1 m above its top. Default: 0.5 with a crane (EN ISO 13854: a body is not trapped), as above."""
    approach_clearance_m: NotNegative | None = None
    """Of the load on its last moves, to everything but what is next to or below the part at its place, up to 1 m
    above its top. Default: 0.5, as above."""
    upending_clearance_m: NotNegative | None = None
    """Of a part while it is upended in the yard, to everything that reaches above its underside. Default:
    ``transit_clearance_m``, as above."""
    turning_clearance_m: NotNegative | None = None
    """Of a part while it is turned above its place in the yard, to everything. Default: ``transit_clearance_m``, as
    above."""
    contact_tolerance_m: Annotated[NotNegative, Field(le=MOST_CONTACT_TOLERANCE_M)] = _RULES.contact_tolerance_m
    """How deep neighbours may overlap on the last moves."""
    support_gap_m: Annotated[NotNegative, Field(le=MOST_SUPPORT_GAP_M)] = _RULES.support_gap_m
    """How far below a part its support may be."""
    rope: Flag = _RULES.rope
    """Whether the column above the hook, with the hoist rope, must be free."""
    sample_period_s: Period = _RULES.sample_period_s
    """Sampling interval of the log."""
    times: TimesConfig = TimesConfig()
    """How long the crew takes, by class of work."""
    casting: CastingConfig = CastingConfig()
    """How long work takes that the crane does not do."""
    building: BuildingConfig = BuildingConfig()
    """How long trades take for what they build in place."""
    curing: CuringConfig | None = None
    """Grout and other joints of lifted parts. Default: the table's with a crane."""
    props: PropsConfig | None = None
    """What holds parts until their joints carry. Default: the table's with a crane."""
    bracing_s: Pause | None = Field(default=None, examples=[120])
    """One ``brace_s`` for all classes of work, instead of ``times``."""
    release_s: Pause | None = Field(default=None, examples=[30])
    """One value for all classes of work, instead of ``times``."""
    turn_s: Pause = _RULES.turn_s
    """Time to turn a hanging part by a quarter."""
    upend_s: Pause | None = Field(default=None, examples=[180])
    """Time to upend a part that lies, with one hook about its foot, besides the crane's motion. Default: 120 with a
    crane."""
    flip: Literal["foot", "two_hooks"] = "foot"
    """How parts that lie are upended: about their ``foot``, with one hook, or in the air between ``two_hooks`` of a
    crane that has an auxiliary one."""
    two_hooks: TwoHooksConfig | None = None
    """How that is done. Default: the table's, if ``flip`` asks for it anywhere."""
    tandem: TandemConfig | None = None
    """Two cranes carry together what none carries alone. Default: they do not, but where ``[[component]] tandem`` asks
    for it."""
    heading: Literal["kept", "with_jib"] = _RULES.heading.value
    """``kept``: tag lines keep the heading of loads. ``with_jib``: loads turn with the jib where there is room."""
    swing: Literal["shaped", "off"] = _RULES.swing.value
    """``shaped``: no load swings when it is set. ``off``: swing is ignored."""
    truckload_kg: NotNegative = _RULES.truckload_kg
    """Payload of a lorry; a heavier part comes alone. 0: as much as the yard holds."""
    wind_speed_m_s: Annotated[NotNegative, Field(le=100.0)] | None = None
    """Gust of 3 s at jib height in which every lift must be possible, and its load swing no further than it keeps clear
    in transit; 0: no wind. Default: 9.8 with a crane, as far as a part permits it."""
    least_wind_m_s: Annotated[NotNegative, Field(le=100.0)] | None = None
    """Gust of 3 s at jib height in which every lift must be permitted at least: a lift that needs less wind is
    infeasible. Default: 7 with a crane, less than the 8 at which the lifting of panels stops (GGR, for vacuum lifters);
    such a lift is planned then, with a serious remark."""
    drag_coefficient: Positive = _RULES.drag_coefficient
    """Of the parts: 1.1 for a cube to 2.0 for a long plate."""
    sling_angle_deg: Annotated[Number, Field(gt=0.0, le=120.0)] = round(math.degrees(_RULES.sling_angle_rad), 12)
    """Largest angle between opposite legs of a sling."""
    critical_share: Annotated[Number, Field(gt=0.0, le=1.0)] = _RULES.critical_share
    """Share of the capacity from which a lift is critical."""
    highest_utilisation: Annotated[Number, Field(gt=0.0, le=1.0)] | None = None
    """Highest permitted share of the capacity: no crane carries a load where it would use more. Default: 0.85 with a
    crane, more only where a part needs it at its place, or lies nowhere in the yard with less."""
    crane_separation_m: Positive = _RULES.crane_separation_m
    """Between cranes and their loads, on plan or in height, also while they brake."""
    by_other_means: Flag = _RULES.by_other_means
    """Whether a part that the crane cannot set counts as set by other means. ``false``: what rests on it is infeasible
    too."""

    @property
    def usual_utilisation(self) -> float:
        """The share of the load chart that lifts use at most where they can."""
        return HIGHEST_UTILISATION if self.highest_utilisation is None else self.highest_utilisation

    @property
    def utmost_utilisation(self) -> float:
        """The share of the load chart that no lift may exceed."""
        return 1.0 if self.highest_utilisation is None else self.highest_utilisation

    def rules(self, *, has_crane: bool = False) -> Rules:
        """Return the rules as a value for the planner, those that the file does not give by their defaults."""
        own: dict[str, object] = {"swing": SwingRule(self.swing), "heading": HeadingRule(self.heading)}
        own |= {"times": self.times.times(), "casting": self.casting.casting()}
        own |= {"building": BuildingTimes(**self.building.model_dump())}
        own["curing"] = (self.curing or CuringConfig()).value() if has_crane else None
        own["props"] = (self.props or PropsConfig()).value() if has_crane else None
        own["sling_angle_rad"] = math.radians(self.sling_angle_deg)
        own["upend_s"] = (UPEND_S if has_crane else 0.0) if self.upend_s is None else self.upend_s
        asked = self.flip == "two_hooks" or self.two_hooks is not None
        own["two_hooks"] = (self.two_hooks or TwoHooksConfig()).value() if asked and has_crane else None
        own["tandem"] = self.tandem.value() if self.tandem is not None and has_crane else None
        given = self.model_dump(exclude={"sling_angle_deg", "flip"}) | own
        for key in _AS_IN_TRANSIT:
            given[key] = given["transit_clearance_m"] if given[key] is None else given[key]
        left = tuple(key for key in DEFAULT_RULES if given[key] is None)
        defaults = {key: DEFAULT_RULES[key] if has_crane else getattr(_RULES, key) for key in left}
        return Rules(**(given | defaults), gives_way=left if has_crane else ())


class RiggingConfig(Table):
    """How gear is chosen for the parts of a crane without ``sling_m`` and ``rigging_mass_kg``."""

    gear: Annotated[tuple[Text, ...], Field(max_length=20)] = Field(default=(), examples=[("my-slings.toml",)])
    """Files of your own gear next to the site file. Of a kind that they have, the catalogue's gear is not used."""
    spreader_from_m: Positive = 6.0
    """Lifting points further apart hang on a spreader."""


class YardConfig(Table):
    """How parts lie in the yard. Without this table: one cell apart and never on each other.

    In a stack, the part that is lifted first lies on top. Flat parts that fill their box are stacked: slabs and beams
    that are not upended, no higher together than the lowest one is wide. In a rack, thin upright walls stand one behind
    the other, the one that is lifted first outermost.
    """

    gap_m: Annotated[NotNegative, Field(le=10.0)] = USUAL_YARD.gap_m
    """Free width around a part when it is picked, for the slinger; rounded up to whole cells."""
    stack_parts: Annotated[Whole, Field(ge=1, le=100)] = USUAL_YARD.stack_parts
    """Most parts in a stack; 1: no stacks."""
    stack_height_m: Annotated[Positive, Field(le=10.0)] = USUAL_YARD.stack_height_m
    """Largest height of a stack."""
    stack_kg: Positive = USUAL_YARD.stack_kg
    """Largest mass of a stack."""
    dunnage_m: Annotated[NotNegative, Field(le=1.0)] = USUAL_YARD.dunnage_m
    """Between two parts of a stack or rack; at least one cell."""
    rack_parts: Annotated[Whole, Field(ge=0, le=100)] = USUAL_YARD.rack_parts
    """Most walls that stand one behind the other in a rack; 0: no racks."""
    rack_depth: Annotated[NotNegative, Field(le=2.0)] = USUAL_YARD.rack_depth
    """Depth of a rack's frame behind the last wall, as a share of the highest wall's height; at least one cell."""
    truck_length_m: Annotated[Positive, Field(le=100.0)] = TRUCK_M[0]
    """Length on a truck. A larger part comes by a special transport, panels may come in an inloader."""
    truck_width_m: Annotated[Positive, Field(le=100.0)] = TRUCK_M[1]
    """Width that parts may take on a truck."""
    truck_height_m: Annotated[Positive, Field(le=100.0)] = TRUCK_M[2]
    """Height that parts may take above the bed of a truck."""
    lorries: Annotated[Whole, Field(ge=1, le=20)] = USUAL_YARD.lorries
    """Most lorries of a delivery, as far as the yard holds their parts. With several, panels that need an inloader have
    theirs, and deliveries end where the fewest lorries come in all. 1: walls and others share a lorry."""

    def rules(self) -> YardRules:
        """Return the table as a value for the planner."""
        values = self.model_dump()
        truck_m = (values.pop("truck_length_m"), values.pop("truck_width_m"), values.pop("truck_height_m"))
        return YardRules(**values, truck_m=truck_m)


MORE_IS_WEAKER = frozenset(
    (
        "contact_tolerance_m",
        "support_gap_m",
        "sample_period_s",
        "sling_angle_rad",
        "critical_share",
        "highest_utilisation",
        "shore_spacing_m",
        "people",
        "bundle_kg",
        "most_share",
    )
)
"""Rules, and times in them, of which a larger value asks for less; of all other numbers, a smaller one does."""
NONE_IS_WEAKER = frozenset(
    (
        "bracing_s",
        "release_s",
        "truckload_kg",
        "by_other_means",
        "floors_wait",
        "gives_way",
        "heading",
        "yard",
        "order_search",
        "types",
    )
)
"""Rules whose default asks for nothing, or that are a choice; one time of all classes is compared with ``times``."""

_NO_PROPS = PropRules(0.0, 0.0, FIELD_PROPS.shore_spacing_m, 0.0)


def weaker_rules(rules: Rules, *, has_crane: bool) -> list[str]:
    """Return the rules that ask for less than the defaults of this version, each as ``key = value (default: value)``.

    ``has_crane``: whether it has a crane: some defaults are for cranes only.
    """
    default = RulesConfig().rules(has_crane=has_crane)
    result = [
        f"{key} = {_written(own)} (default: {_written(usual)})"
        for key, own, usual in _pairs("", rules, default)
        if _is_weaker(key.rpartition(".")[2], own, usual)
    ]
    for key in ("bracing_s", "release_s"):
        own = getattr(rules, key)
        most_s = max(
            getattr(getattr(default.times, work.name), key.replace("bracing", "brace"))
            for work in fields(default.times)
        )
        if own is not None and own < most_s:
            result.append(f"{key} = {_written(own)} (default: by class of work, up to {_written(most_s)})")
    return result


def _pairs(prefix: str, own: Any, usual: Any) -> Iterator[tuple[str, Any, Any]]:
    """Yield the rules, and each value of those that are tables, by their keys."""
    for field in fields(usual):
        key, one, other = f"{prefix}{field.name}", getattr(own, field.name), getattr(usual, field.name)
        if field.name in NONE_IS_WEAKER:
            continue
        if field.name == "curing":  # None: all joints carry at once
            one, other = one or Curing(), other or Curing()
        if field.name == "props":  # None: nobody asks what holds a part
            one, other = one or _NO_PROPS, other or _NO_PROPS
        if field.name == "two_hooks":  # None: no part is turned over so
            one, other = one or _FLIP, other or _FLIP
        if field.name == "tandem":  # None: no part is carried so
            one, other = one or _TANDEM, other or _TANDEM
        if is_dataclass(other):
            yield from _pairs(f"{key}.", one, other)
        else:
            yield key, one, other


def _is_weaker(key: str, own: Any, usual: Any) -> bool:
    """Return whether a value asks for less than the default; one that cannot be compared does if it differs."""
    if isinstance(usual, StrEnum):
        return bool(own != usual)
    return bool(own > usual if key in MORE_IS_WEAKER else own < usual)


def _written(value: Any) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    return f"{value:g}" if isinstance(value, int | float) else str(value)
