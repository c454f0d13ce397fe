"""The schema of the site file. ``bimvox schema site`` prints it.

Everything except the path of the model is optional; :mod:`bimvox.site.guess` fills in what is missing.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, astuple, replace
from functools import partial
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any, Literal, Self

import shapely
from pydantic import AfterValidator, Discriminator, Field, PrivateAttr, Tag, model_validator

from bimvox.bim.options import MOST_SELECT
from bimvox.crane.axis_limits import AxisLimits
from bimvox.crane.load_chart import LoadChart
from bimvox.errors import ConfigError, shown
from bimvox.site.casting import FIELD_CASTING, Casting, CastTimes
from bimvox.site.component import StoredPose
from bimvox.site.crew_times import FIELD_TIMES, CrewTimes, TimesByWork
from bimvox.site.default_rules import DEFAULT_RULES
from bimvox.site.limits import (
    FEW_HANDS_KG,
    MOST_CONTACT_TOLERANCE_M,
    MOST_SAMPLE_PERIOD_S,
    MOST_SUPPORT_GAP_M,
    ROAD_HEIGHT_M,
    ROAD_KG,
    ROAD_LENGTH_M,
    ROAD_WIDTH_M,
)
from bimvox.site.site import Rules, SwingRule
from bimvox.site.validation import (
    ONE,
    SEVERAL,
    Flag,
    NotNegative,
    Number,
    Point2,
    Point2or3,
    Point3,
    Positive,
    Table,
    Text,
    Whole,
)

_RULES = Rules()


def _not_below(least: float, value: float) -> float:
    if value < least:
        raise ValueError(f"{value:g} is too small: at least {least:g}")
    return value


CellSize = Annotated[Positive, Field(le=100.0), AfterValidator(partial(_not_below, 1e-3))]


def _simple_polygon(corners: tuple[Point2, ...]) -> tuple[Point2, ...]:
    """Return the corners; raise an error if the polygon has no area or crosses itself."""
    polygon = shapely.Polygon(corners)
    if not polygon.is_valid:
        raise ValueError(f"not a simple polygon: {shapely.is_valid_reason(polygon)}")
    if polygon.area <= 0.0:
        raise ValueError("the polygon has no area")
    return corners


MOST_CORNERS = 10_000
MOST_AREAS = 1000
"""The most corners of a polygon, and the most zones and yard areas: no site needs more, and they would take minutes."""
Polygon = Annotated[tuple[Point2, ...], Field(min_length=3, max_length=MOST_CORNERS), AfterValidator(_simple_polygon)]
"""Corners [x, y] in site metres, in either direction, without repeating the first one."""


class ModelConfig(Table):
    """The building model."""

    path: Path
    """IFC or mesh file, path relative to the site file's folder."""
    select: Annotated[Text, Field(max_length=MOST_SELECT)] | None = None
    """What is to be lifted: an IfcOpenShell selector query, or names of bodies for a mesh. Default: every part that is
    prefabricated by its class."""
    unit: Literal["m", "dm", "cm", "mm", "ft", "in"] | None = None
    """Length unit of a mesh file; IFC files contain theirs."""
    up: Literal["y", "z"] | None = None
    """Axis of a mesh file that points up. Default: the axis of its format (glTF: y), otherwise z."""
    voxel_size_m: CellSize | None = None
    """Edge length of a planning cell, metres."""
    yaw_rad: Annotated[Number, Field(ge=-1e3, le=1e3)] = 0.0
    """Angle of the site's x axis in the model, counter-clockwise. It aligns the grid with a building that is turned on
    its plot."""
    ground_m: Annotated[Number, Field(ge=-1e6, le=1e6)] | None = None
    """Height in the model that becomes the site's z = 0. Default: the lowest point of components and structure, rounded
    down to a whole cell."""
    assemblies: Literal["whole", "parts"] = "whole"
    """Whether an assembly is lifted as one, or part by part."""


class GridConfig(Table):
    """The extent of the site. Default: the building, the areas and the crane, with a margin."""

    low_m: Point2or3
    """Lowest corner [x, y]; a third value must be minus one cell, the bottom of the slab."""
    high_m: Point3
    """Highest corner [x, y, z]."""

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        if any(high <= low for low, high in zip((*self.low_m[:2], 0.0), self.high_m, strict=True)):
            raise ValueError("high_m must lie above low_m in x and y, and above 0 in z")
        return self


class AreasConfig(Table):
    """Areas on the ground. A column belongs to an area if its centre lies inside."""

    construction: Polygon | None = None
    """The construction area."""
    yard: Annotated[tuple[Polygon, ...], Field(min_length=1, max_length=MOST_AREAS)] | None = None
    """One or more areas where parts are stored, without their overlap with the construction area."""


class _AxisConfig(Table):
    """Limits of an axis: rate, acceleration and jerk, each with its unit in the key."""

    @classmethod
    def of(cls, limits: AxisLimits) -> Self:
        """Return the table of these limits."""
        return cls(**dict(zip(cls.model_fields, astuple(limits), strict=True)))

    def limits(self) -> AxisLimits:
        """Return the limits as a value for the crane."""
        return AxisLimits(*self.model_dump().values())


Rate = Annotated[Positive, Field(le=1e4), AfterValidator(partial(_not_below, 1e-4))]
"""A rate, acceleration or jerk, in radians or metres: a slower crane would take days for a lift."""


class SlewingConfig(_AxisConfig):
    """Limits of the slewing axis."""

    rate_rad_s: Rate
    acceleration_rad_s2: Rate
    jerk_rad_s3: Rate


class TravelConfig(_AxisConfig):
    """Limits of the trolley or the hoist."""

    rate_m_s: Rate
    acceleration_m_s2: Rate
    jerk_m_s3: Rate


def _falling(pairs: tuple[tuple[float, float], ...]) -> tuple[tuple[float, float], ...]:
    for (near, more), (far, less) in pairwise(pairs):
        if far <= near or less > more:
            raise ValueError("must have ascending radii and no ascending capacity")
    return pairs


Chart = Annotated[tuple[tuple[Positive, Positive], ...], Field(min_length=1), AfterValidator(_falling)]
"""[radius in m, capacity in kg] pairs."""


def chart_of(pairs: tuple[tuple[float, float], ...]) -> LoadChart:
    """Return the load chart of [radius in m, capacity in kg] pairs."""
    radii, capacities = zip(*pairs, strict=True)
    return LoadChart(radii, capacities)


class ReevingConfig(Table):
    """One reeving of the hoist rope."""

    falls: Annotated[Whole, Field(ge=1)]
    """Parts of rope that carry the hook."""
    chart: Chart
    """Load chart: [radius in m, capacity in kg] pairs, load, rigging and hook block together."""
    hook_block_kg: NotNegative = 0.0
    """Mass of its hook block, added to every load."""
    trolley_rate_m_s: Rate | None = None
    """Highest speed of the trolley with it. Default: the rate of ``trolley``."""
    gears: tuple[tuple[Positive, Rate], ...] = ()
    """Hoist rates: [largest mass on the rope in kg, rate in m/s]."""


class WorkingRangeConfig(Table):
    """Settings of the crane's limiters on this site (EN 17076)."""

    slew_rad: tuple[Number, Number] | None = None
    """Slew range of the jib, counter-clockwise from the x axis: [first, last], at most one full turn."""
    radius_m: tuple[NotNegative, Positive] | None = None
    """Smallest and largest hook radius."""
    highest_hook_m: Positive | None = None
    """Highest hook above z = 0."""

    @model_validator(mode="after")
    def _ranges(self) -> Self:
        if self.slew_rad is not None and not 0.0 < self.slew_rad[1] - self.slew_rad[0] <= 2.0 * math.pi:
            raise ValueError(
                "slew_rad goes counter-clockwise from the first angle to the second, at most one full turn"
            )
        if self.radius_m is not None and self.radius_m[0] >= self.radius_m[1]:
            raise ValueError("radius_m must give the smallest radius, then the largest")
        return self


class LuffAxisConfig(SlewingConfig):
    """Limits of the luffing axis."""


class LuffingConfig(Table):
    """A luffing jib, or the boom of a mobile crane."""

    pivot_height_m: Positive | None = None
    """Height of its pivot above the site's z = 0."""
    pivot_offset_m: Number | None = None
    """Radius of its pivot; negative behind the slewing axis."""
    length_m: Positive | None = None
    """Length from the pivot to the rope exit at the tip."""
    luff_rad: tuple[Positive, Positive] | None = None
    """Smallest and largest angle to the horizontal."""
    luffing: LuffAxisConfig | None = None
    """Limits of the luffing axis."""
    tail_radius_m: NotNegative | None = None
    """Radius of the counterweight behind the slewing axis."""
    tail_low_m: NotNegative | None = None
    """Height of the counterweight's underside above the site's z = 0."""
    tail_width_m: Positive | None = None
    """Width of the counterweight."""
    width_m: Positive | None = None
    """Width of the jib."""


class OverrideConfig(Table):
    """What a site changes in a machine of the catalogue, on purpose. Every output lists it."""

    jib: LuffingConfig | None = None
    """The luffing jib, or the boom."""
    jib_length_m: Positive | None = None
    """Largest hook radius."""
    min_radius_m: NotNegative | None = None
    """Smallest hook radius."""
    mast_size_m: Positive | None = None
    """Edge of the square mast section."""
    hook_block_kg: NotNegative | None = None
    """Mass of the hook block, added to every load."""
    gears: tuple[tuple[Positive, Rate], ...] | None = None
    """Hoist rates: [largest mass on the rope in kg, including hook block and rigging; rate in m/s]. Above the last
    mass, the rate of ``hoist`` applies."""
    max_wind_m_s: Positive | None = None
    """Wind (gust of 3 s) up to which the crane works; 20 m/s for tower cranes (EN 14439)."""
    slewing: SlewingConfig | None = None
    """Limits of the slewing axis."""
    trolley: TravelConfig | None = None
    """Limits of the trolley."""
    hoist: TravelConfig | None = None
    """Limits of the hoist."""
    chart: Chart | None = None
    """Load chart: [radius in m, capacity in kg] pairs, load, rigging and hook block together."""
    reeving: Annotated[tuple[ReevingConfig, ...], Field(min_length=1)] | None = None
    """Load chart, hook block and rates per reeving, instead of one ``chart``; ``falls`` selects the reeving."""

    @model_validator(mode="after")
    def _one_reeving(self) -> Self:
        if self.reeving is None:
            return self
        for key in ("chart", "gears", "hook_block_kg"):
            if getattr(self, key) is not None:
                raise ValueError(f"{key} is given per reeving: leave it out, or leave reeving out")
        counts = [one.falls for one in self.reeving]
        if len(set(counts)) < len(counts):
            raise ValueError("two reevings have the same falls")
        return self


class CraneConfig(OverrideConfig):
    """The crane. Without this table one is chosen; ``kind = "none"`` plans without a crane: no rope, no reach.

    A machine of the catalogue has its data from there. A key that differs from them is an error, unless it stands in
    ``[crane.override]``. Without ``machine``, and with a ``name`` that the catalogue does not have, the table describes
    the crane itself, with every key. Several cranes are an array of tables, ``[[crane]]``, each with its own ``name``
    and ``base_m``.
    """

    kind: Literal["hammerhead", "luffing", "mobile", "none"] | None = None
    """Kind of crane. ``luffing``: a tower crane with a luffing jib. ``mobile``: a mobile crane on a fixed pad with a
    luffing boom. Both use ``jib`` instead of ``jib_height_m``, ``jib_length_m``, ``min_radius_m`` and ``trolley``,
    which follow from it. Default: the machine's, otherwise ``hammerhead``."""
    name: Text | None = None
    """Name of the crane. Default: the machine's. The name of a machine of the catalogue selects that machine."""
    machine: Text | None = None
    """Name of a machine of the catalogue (``bimvox cranes`` lists them), or a file next to the site file that describes
    your own: ``"my-crane.toml"`` (``bimvox schema crane``)."""
    base_m: Point2or3 | None = None
    """Foot of the slewing axis [x, y] or [x, y, z], site metres."""
    jib_height_m: Positive | None = None
    """Height of the trolley's rope exit above the site's z = 0."""
    jib_length_m: Positive | None = None
    """Largest hook radius: one of the machine's jib lengths. Default: the longest."""
    sling_m: NotNegative | None = None
    """Height of the slings, from the load's top to the hook."""
    rigging_mass_kg: NotNegative | None = None
    """Mass of slings and spreader, added to every load."""
    falls: Annotated[Whole, Field(ge=1)] | None = None
    """Parts of rope that carry the hook, for the whole job. Default: the reeving that carries most."""
    working_range: WorkingRangeConfig | None = None
    """Settings of its limiters."""
    override: OverrideConfig | None = None
    """What differs from the machine, on purpose."""

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        if self.kind == "none" and len(self.model_fields_set) > 1:
            raise ValueError('kind = "none" allows no other key')
        luffs = self.kind in ("luffing", "mobile")
        if self.jib is not None and self.kind == "hammerhead":
            raise ValueError('jib is for kind = "luffing" and kind = "mobile"')
        for key in ("jib_height_m", "jib_length_m", "min_radius_m", "trolley"):
            if luffs and getattr(self, key) is not None:
                raise ValueError(f"{key} follows from the jib: leave it out")
        if self.min_radius_m is not None and self.jib_length_m is not None and self.min_radius_m >= self.jib_length_m:
            raise ValueError("min_radius_m must be smaller than jib_length_m")
        counts = [one.falls for one in self.reeving or ()]
        if counts and self.falls is not None and self.falls not in counts:
            raise ValueError(f"no reeving has {self.falls} falls; there are {', '.join(map(str, sorted(counts)))}")
        return self


def _one_or_several(given: object) -> str:
    return SEVERAL if isinstance(given, list | tuple) else ONE


class ComponentConfig(Table):
    """Settings of one component that differ from the defaults."""

    global_id: Text
    """GlobalId of the part, or the body's name."""
    start: Point2or3 | None = None
    """Lowest corner [x, y] or [x, y, z] of the part as stored in the yard, site metres. Default: planned."""
    pose: StoredPose | None = None
    """How it is stored: as in the building, or lying along x or y with its foot at the lowest end, to be upended."""
    turn: Annotated[Whole, Field(ge=0, le=3)] | None = None
    """Quarter turns, counter-clockwise, between its orientation in the building and in the yard. It is turned back
    while it hangs upright above its place in the yard; a lying part is upended first (also give its ``pose``, otherwise
    it is stored as in the building). Default: 0, or 1 if it fits the yard only that way."""
    before: tuple[Text, ...] = ()
    """Ids of components that must be set later than this one."""
    after: tuple[Text, ...] = ()
    """Ids of components that must be set earlier than this one."""
    pinned: Flag = False
    """Whether it already exists, so that it is not lifted."""
    crane: Text | None = None
    """Name of the crane that lifts it, if the site has several. Default: chosen by its place in the building."""
    means: Literal["crane", "in_situ", "by_hand"] | None = None
    """How it gets to its place: lifted by the crane, cast (or built up) there, or set by hand. Default: decided by
    ``[means]``."""

    @model_validator(mode="after")
    def _liftable(self) -> Self:
        given = self.start or self.pose or self.turn or self.before or self.after or self.crane or self.means
        if self.pinned and given:
            raise ValueError(
                "a pinned part is not lifted: remove its start, pose, turn, before, after, crane and means"
            )
        return self


class ZoneConfig(Table):
    """A zone on the plan."""

    kind: Literal["prohibited", "no_load", "public", "slow", "limiter", "assembly"] = "prohibited"
    """``prohibited``: the hook may not be above it (EN 17076). ``no_load``: no part of a load may be above it; the
    empty hook may. ``public``: an area open to the public; neither load nor hook may be above it. ``slow``: while the
    hook is above it, every axis stays below ``share`` of its highest rate. ``limiter``: above it, the hook stays
    between ``lowest_hook_m`` and ``highest_hook_m``. ``assembly``: parts whose centre lies in it are set together, zone
    by zone in the order of the file, before the parts outside all zones."""
    polygon: Polygon
    """Corners of the zone."""
    name: Text | None = None
    """Name of the zone, for people."""
    share: Annotated[Number, Field(gt=0.0, le=1.0)] | None = None
    """Share of the highest rates in a ``slow`` zone. Default: 0.5."""
    lowest_hook_m: Number | None = None
    """Lowest hook above z = 0 in a ``limiter`` zone."""
    highest_hook_m: Number | None = None
    """Highest hook above z = 0 in a ``limiter`` zone."""

    @model_validator(mode="after")
    def _own_keys(self) -> Self:
        low, high = self.lowest_hook_m, self.highest_hook_m
        if self.kind != "slow" and self.share is not None:
            raise ValueError('share is only for kind = "slow"')
        if self.kind != "limiter" and (low is not None or high is not None):
            raise ValueError('lowest_hook_m and highest_hook_m are only for kind = "limiter"')
        if self.kind == "limiter" and low is None and high is None:
            raise ValueError("a limiter needs lowest_hook_m or highest_hook_m")
        if low is not None and high is not None and low >= high:
            raise ValueError("lowest_hook_m must be below highest_hook_m")
        return self


Pause = Annotated[NotNegative, Field(le=86_400.0)]
"""A time that the crane waits in a lift: at most a day."""


Period = Annotated[Positive, Field(le=MOST_SAMPLE_PERIOD_S), AfterValidator(partial(_not_below, 1e-3))]


class CrewTimesConfig(Table):
    """The crew's times for a part of one class of work, while the crane stands. Default: typical of the field."""

    sling_s: Pause | None = None
    """Time to attach the slings."""
    brace_s: Pause | None = None
    """Time to align, fix and brace the part while it hangs on the hook."""
    release_s: Pause | None = None
    """Time to remove the slings."""
    tag_line_s: Pause | None = None
    """Time to fix the tag lines that keep the heading of the part; removing them takes as long."""

    @classmethod
    def of(cls, times: CrewTimes) -> Self:
        """Return the table of these times."""
        return cls(**asdict(times))


class TimesConfig(Table):
    """The crew's times by class of work: by the part's IFC class and predefined type, or its shape, and its material.

    The sources of the defaults: section "Crew times" of the documentation of formats.
    """

    footing: CrewTimesConfig = CrewTimesConfig.of(FIELD_TIMES.footing)
    """Footings, piles, base slabs."""
    column: CrewTimesConfig = CrewTimesConfig.of(FIELD_TIMES.column)
    """Columns, and upright slender parts."""
    wall: CrewTimesConfig = CrewTimesConfig.of(FIELD_TIMES.wall)
    """Walls, and thin upright parts."""
    beam: CrewTimesConfig = CrewTimesConfig.of(FIELD_TIMES.beam)
    """Beams, and long parts."""
    slab: CrewTimesConfig = CrewTimesConfig.of(FIELD_TIMES.slab)
    """Slabs, planks of a floor, and flat parts."""
    stair: CrewTimesConfig = CrewTimesConfig.of(FIELD_TIMES.stair)
    """Flights of stairs, ramps and landings."""
    steel: CrewTimesConfig = CrewTimesConfig.of(FIELD_TIMES.steel)
    """Every part whose material is steel."""
    other: CrewTimesConfig = CrewTimesConfig.of(FIELD_TIMES.other)
    """All other parts."""

    def times(self) -> TimesByWork:
        """Return the times, those that the file does not give from the defaults."""
        return TimesByWork(
            **{
                name: replace(getattr(FIELD_TIMES, name), **getattr(self, name).model_dump(exclude_none=True))
                for name in type(self).model_fields
            }
        )


class CastTimesConfig(Table):
    """The time of work of one class that is cast in place. Default: typical of the field."""

    hours_m3: Annotated[NotNegative, Field(le=1e4)] | None = None
    """Working hours of one person for a cubic metre: formwork, reinforcement and pouring. The volume is the mass over
    2400 kg/m3."""
    wait_h: Annotated[NotNegative, Field(le=2e4)] | None = None
    """Hours from the end of the work until it carries what rests on it."""

    @classmethod
    def of(cls, times: CastTimes) -> Self:
        """Return the table of these times."""
        return cls(**asdict(times))


class CastingConfig(Table):
    """The times of work that the crane does not do: cast in place, by class of work, and set by hand.

    Such work begins when all earlier lifts of the sequence are set and what it rests on carries. The crane goes on with
    the parts that do not rest on it, then it pauses. The sources of the defaults: section "Work cast in place" of the
    documentation of formats.
    """

    people: Annotated[Positive, Field(le=1e4)] = FIELD_CASTING.people
    """People who cast; they do one part after the other."""
    hand_s: Pause = FIELD_CASTING.hand_s
    """Time to set a part by hand; one part after the other."""
    bundle_kg: NotNegative = FIELD_CASTING.bundle_kg
    """Parts that are set by hand come up in bundles, one a storey and kind. A heavier bundle is a material lift of the
    crane: it is listed with its mass and its crane time, but has no path and is not proven."""
    bundle_s: Pause = FIELD_CASTING.bundle_s
    """Crane time of a material lift."""
    footing: CastTimesConfig = CastTimesConfig.of(FIELD_CASTING.footing)
    """Footings, piles, base slabs."""
    column: CastTimesConfig = CastTimesConfig.of(FIELD_CASTING.column)
    """Columns, and upright slender parts."""
    wall: CastTimesConfig = CastTimesConfig.of(FIELD_CASTING.wall)
    """Walls, and thin upright parts."""
    beam: CastTimesConfig = CastTimesConfig.of(FIELD_CASTING.beam)
    """Beams, and long parts."""
    slab: CastTimesConfig = CastTimesConfig.of(FIELD_CASTING.slab)
    """Slabs, and flat parts."""
    stair: CastTimesConfig = CastTimesConfig.of(FIELD_CASTING.stair)
    """Flights of stairs, ramps and landings."""
    steel: CastTimesConfig = CastTimesConfig.of(FIELD_CASTING.steel)
    """Parts of steel that are built up in place; for 2.4 t."""
    other: CastTimesConfig = CastTimesConfig.of(FIELD_CASTING.other)
    """All other parts."""

    def casting(self) -> Casting:
        """Return the times, those that the file does not give from the defaults."""
        given = self.model_dump(exclude_none=True)
        own = {
            name: replace(getattr(FIELD_CASTING, name), **value) if isinstance(value, dict) else value
            for name, value in given.items()
        }
        return replace(FIELD_CASTING, **own)


class RulesConfig(Table):
    """The rules of the site."""

    clearance_m: NotNegative = _RULES.clearance_m
    """Distance to obstructions and the crane's mast, rounded up to whole cells."""
    transit_clearance_m: NotNegative | None = None
    """Distance of a part in transit to everything, including the site boundary, rounded up to whole cells. It applies
    once the part is raised that far above the yard, until its last moves begin. Default: 2 with a crane, as far as a
    lift can keep it; otherwise 0. A value here is kept by every lift, or the lift is infeasible."""
    rope_clearance_m: NotNegative | None = None
    """Distance on plan of hook and rope in transit to everything higher than the lower end of the hook line:
    structure, stored parts, the crane's own mast. Rounded up to whole cells; at least half the width of the hook block
    is good practice. Default: 0.5 with a crane, as far as a lift can keep it; otherwise 0."""
    contact_tolerance_m: Annotated[NotNegative, Field(le=MOST_CONTACT_TOLERANCE_M)] = _RULES.contact_tolerance_m
    """How deep the real triangles of neighbours may overlap during the last moves."""
    support_gap_m: Annotated[NotNegative, Field(le=MOST_SUPPORT_GAP_M)] = _RULES.support_gap_m
    """How far below a part its support may be (grout joints, bearings)."""
    rope: Flag = _RULES.rope
    """Whether the hoist rope above the load must be kept free."""
    sample_period_s: Period = _RULES.sample_period_s
    """Sampling interval of the trajectory in the log."""
    times: TimesConfig = TimesConfig()
    """The crew's times by class of work."""
    casting: CastingConfig = CastingConfig()
    """The times of work that the crane does not do."""
    bracing_s: Pause | None = None
    """Time to align, fix and brace a part while it hangs on the hook: one value for all classes, instead of ``times``.
    """
    release_s: Pause | None = None
    """Time to remove the slings: one value for all classes, instead of ``times``."""
    turn_s: Pause = _RULES.turn_s
    """Time to turn a hanging part by a quarter (tag lines, or a rotator)."""
    swing: Literal["shaped", "off"] = _RULES.swing.value
    """`shaped`: the crane's moves are shaped so that no load swings when it is set, and the swing in transit is proven
    clear. `off`: swing is ignored."""
    truckload_kg: NotNegative = _RULES.truckload_kg
    """Largest mass of a delivery; a heavier part comes alone. Default: as much as the yard holds. A smaller value means
    more deliveries and shorter travel: each delivery uses the nearest places of the yard as soon as they are empty."""
    wind_speed_m_s: Annotated[NotNegative, Field(le=100.0)] | None = None
    """Wind (gust of 3 s at jib height) in which every lift must be possible. A part whose sail area permits only less
    wind (EN 13000: 1.2 m2 per tonne, drag included) is not lifted. 0: no wind. Default: 9.8 with a crane, and a part
    that permits only less is lifted in less wind: a remark and a condition state how much."""
    drag_coefficient: Positive = _RULES.drag_coefficient
    """Drag coefficient of the parts in that wind: 1.1 for a cube to 2.0 for a long plate."""
    sling_angle_rad: Annotated[Number, Field(gt=0.0, le=2.0943951023931957)] = _RULES.sling_angle_rad
    """Largest angle between two legs of a sling to the part's lifting anchors."""
    critical_share: Annotated[Number, Field(gt=0.0, le=1.0)] = _RULES.critical_share
    """Share of the crane's capacity above which a lift is critical."""
    crane_separation_m: Positive = _RULES.crane_separation_m
    """Distance between several cranes and their loads, on plan or in height, at every moment, including while they
    brake."""
    by_other_means: Flag = _RULES.by_other_means
    """Whether a part that the crane cannot set counts as set by other means from its turn on: it is in the way then and
    carries what rests on it. `false`: it is missing, and what rests on it is infeasible too."""

    def rules(self, *, has_crane: bool = False) -> Rules:
        """Return the rules as a value for the planner, those that the file does not give by their defaults."""
        own = {"swing": SwingRule(self.swing), "times": self.times.times(), "casting": self.casting.casting()}
        given = self.model_dump() | own
        left = tuple(key for key in DEFAULT_RULES if given[key] is None)
        defaults = {key: DEFAULT_RULES[key] if has_crane else 0.0 for key in left}
        return Rules(**(given | defaults), gives_way=left if has_crane else ())


class MeansConfig(Table):
    """What the crane lifts, and what is cast in place or set by hand. Size, mass and casting method decide."""

    heaviest_kg: Positive = ROAD_KG
    """A heavier part of concrete that is not stated to be precast is cast in place: no road takes it."""
    longest_m: Positive = ROAD_LENGTH_M
    """The same for its longest side,"""
    widest_m: Positive = ROAD_WIDTH_M
    """for its second side,"""
    highest_m: Positive = ROAD_HEIGHT_M
    """and for its shortest side."""
    lift_from_kg: NotNegative = FEW_HANDS_KG
    """A lighter part is set by hand, in a bundle with others of its storey and kind. 0: every part is a lift."""


Rank = Annotated[Whole, Field(ge=0, le=100)]


class RanksConfig(Table):
    """The order of the classes of parts within a level, lower ranks first; equal ranks in any order."""

    footing: Rank = 0
    """Footings, piles, base slabs."""
    column: Rank = 1
    """Columns."""
    wall: Rank = 1
    """Walls and panels."""
    beam: Rank = 2
    """Beams."""
    slab: Rank = 3
    """Slabs, planks and roofs."""
    stair: Rank = 3
    """Stairs, ramps and landings."""
    other: Rank = 3
    """All other parts."""


class SequenceConfig(Table):
    """Wishes about the erection sequence. Geometry takes precedence: the parts that a part needs come before it."""

    first: tuple[Text, ...] = ()
    """Ids of components that are set before all others, together with the parts that they need."""
    storeys: Flag = True
    """Whether a storey is finished before the next one begins, as far as geometry permits: columns and walls that stand
    on a floor come after the beams, slabs and stairs of that floor."""
    ranks: RanksConfig = RanksConfig()
    """The order of the classes of parts within a storey."""
    schedule: Flag = True
    """Whether the order of the tasks in the building file is kept, as far as geometry permits."""


class PolicyConfig(Table):
    """The policy that proposes paths."""

    id: Text | None = None
    """Id of a policy in the store. Default: the one trained for this site, otherwise the one that ships with bimvox."""
    steps: Annotated[Whole, Field(ge=1)] | None = None
    """Training budget in environment steps."""
    seed: Annotated[Whole, Field(ge=0)] = 0
    """Seed of the training."""
    required_success: Annotated[Number, Field(gt=0.0, le=1.0)] = 1.0
    """Share of test episodes that must succeed for training to stop."""


class SiteConfig(Table):
    """A site file."""

    _file: Path = PrivateAttr(default=Path("site.toml"))
    _machine_files: Mapping[str, bytes] = PrivateAttr(default_factory=dict)
    name: Text | None = None
    """Name of the site. Default: the file's name."""
    model: ModelConfig
    grid: GridConfig | None = None
    areas: AreasConfig = AreasConfig()
    crane: (
        Annotated[
            Annotated[CraneConfig, Tag(ONE)] | Annotated[tuple[CraneConfig, ...], Field(min_length=1), Tag(SEVERAL)],
            Discriminator(_one_or_several),
        ]
        | None
    ) = None
    component: tuple[ComponentConfig, ...] = ()
    zone: Annotated[tuple[ZoneConfig, ...], Field(max_length=MOST_AREAS)] = ()
    sequence: SequenceConfig = SequenceConfig()
    means: MeansConfig = MeansConfig()
    rules: RulesConfig = RulesConfig()
    policy: PolicyConfig = PolicyConfig()

    @property
    def file(self) -> Path:
        """The file it was read from, for messages."""
        return self._file

    @property
    def machine_files(self) -> Mapping[str, bytes]:
        """The files of machines that it names, by name: their bytes."""
        return self._machine_files

    @property
    def cranes(self) -> tuple[CraneConfig, ...]:
        """The tables of the cranes; empty if a crane is to be chosen."""
        if self.crane is None:
            return ()
        return (self.crane,) if isinstance(self.crane, CraneConfig) else self.crane

    @property
    def rules_in_force(self) -> Rules:
        """The rules; their defaults depend on whether the site has a crane, or one is to be chosen for it."""
        return self.rules.rules(has_crane=any(crane.kind != "none" for crane in self.cranes) or self.crane is None)

    @property
    def one_crane(self) -> CraneConfig | None:
        """The table of the (first) crane."""
        return self.cranes[0] if self.cranes else None

    def error(self, key: str | None, message: str, **more: Any) -> ConfigError:
        """Return an error about a key of this file."""
        return ConfigError(self._file, key, message, **more)

    @model_validator(mode="after")
    def _each_component_once(self) -> Self:
        first: dict[str, int] = {}
        for number, entry in enumerate(self.component):
            if first.setdefault(entry.global_id, number) != number:
                raise ValueError(f"component[{number}].global_id: {shown(entry.global_id)} is listed twice")
        return self

    @model_validator(mode="after")
    def _cranes_apart(self) -> Self:
        if len(self.cranes) < 2:
            return self
        names: list[str] = []
        for number, crane in enumerate(self.cranes):
            key = f"crane[{number}]"
            if crane.kind == "none":
                raise ValueError(f'{key}.kind: "none" is for a site without a crane, but there are {len(self.cranes)}')
            if crane.name is None:
                raise ValueError(f"{key}.name is missing: each of several cranes needs its own name")
            if crane.name in names:
                raise ValueError(f"{key}.name: {crane.name!r} is also crane[{names.index(crane.name)}]'s name")
            if crane.base_m is None:
                raise ValueError(f"{key}.base_m is missing: give the position of {crane.name}")
            names.append(crane.name)
        return self


def site_json_schema() -> dict[str, Any]:
    """Return the JSON Schema (draft 2020-12) of the site file."""
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **SiteConfig.model_json_schema()}
