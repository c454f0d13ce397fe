"""The ``[crane]`` table of a site file."""

from __future__ import annotations

from dataclasses import astuple
from functools import partial
from itertools import pairwise
from typing import Annotated, Literal, Self

from pydantic import AfterValidator, Field, model_validator

from bimvox.crane.auxiliary import Auxiliary
from bimvox.crane.load_chart import LoadChart
from bimvox.crane.tower_crane import AxisLimits, Reeving, WorkingRange
from bimvox.site.config.validation import (
    NotNegative,
    Number,
    Point2or3,
    Positive,
    Table,
    Text,
    Whole,
    in_radians,
    not_below,
)


class _AxisConfig(Table):
    """Limits of an axis: rate, acceleration and jerk, each with its unit in the key."""

    @classmethod
    def of(cls, limits: AxisLimits) -> Self:
        """Return the table of these limits."""
        return cls(**dict(zip(cls.model_fields, astuple(limits), strict=True)))

    def limits(self) -> AxisLimits:
        """Return the limits as a value for the crane."""
        return AxisLimits(*self.model_dump().values())


Rate = Annotated[Positive, Field(le=1e4), AfterValidator(partial(not_below, 1e-4))]
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
    """Mass of the hook block."""
    trolley_rate_m_s: Rate | None = None
    """Highest speed of the trolley with it. Default: the rate of ``trolley``."""
    gears: tuple[tuple[Positive, Rate], ...] = ()
    """Hoist rates: [largest mass on the rope in kg, hook block and rigging included; rate in m/s]. Above the last mass:
    the rate of ``hoist``."""


_ANY_RADIUS_M = 1e3


class AuxiliaryConfig(Table):
    """The second hook, with which a part can be turned over in the air. Without this table the crane has none."""

    capacity_kg: Positive | None = None
    """What it carries at every radius, its hook block and slings included: line pull times falls."""
    chart: Chart | None = None
    """The same by its own radius, instead of ``capacity_kg``: [radius in m, capacity in kg] pairs."""
    hook_block_kg: NotNegative
    """Mass of its hook block. It hangs from the boom in every lift of a site where a part is turned with it."""
    ahead_m: Annotated[Number, Field(ge=-20.0, le=20.0)]
    """How far its rope hangs ahead of the main hook's, away from the slewing axis; negative behind."""
    rated_percent: Annotated[Positive, Field(le=100.0)] | None = None
    """Share of the capacities that the maker permits while both hooks carry one load. Default: the site's rule."""

    @model_validator(mode="after")
    def _one_capacity(self) -> Self:
        if (self.capacity_kg is None) == (self.chart is None):
            raise ValueError("give capacity_kg, or chart, and not both")
        return self

    def value(self) -> Auxiliary:
        """Return the table as a value for the crane."""
        own = None if self.capacity_kg is None else LoadChart((_ANY_RADIUS_M,), (self.capacity_kg,))
        chart = own or chart_of(self.chart or ())
        share = None if self.rated_percent is None else self.rated_percent / 100.0
        return Auxiliary(chart, self.hook_block_kg, self.ahead_m, share)

    @classmethod
    def of(cls, hook: Auxiliary) -> Self:
        """Return the table of a second hook."""
        listed = tuple(zip(hook.chart.radius_m, hook.chart.capacity_kg, strict=True))
        constant = len(listed) == 1 and listed[0][0] == _ANY_RADIUS_M
        percent = None if hook.most_share is None else round(100.0 * hook.most_share, 9)
        return cls(
            capacity_kg=listed[0][1] if constant else None,
            chart=None if constant else listed,
            hook_block_kg=hook.hook_block_kg,
            ahead_m=hook.ahead_m,
            rated_percent=percent,
        )


class WorkingRangeConfig(Table):
    """Settings of its limiters (EN 17076)."""

    slew_deg: tuple[Number, Number] | None = None
    """First and last slewing angle from the x axis, counter-clockwise, at most one turn."""
    radius_m: tuple[NotNegative, Positive] | None = None
    """Smallest and largest hook radius."""
    highest_hook_m: Positive | None = None
    """Highest hook above z = 0."""

    @model_validator(mode="after")
    def _ranges(self) -> Self:
        if self.slew_deg is not None and not 0.0 < self.slew_deg[1] - self.slew_deg[0] <= 360.0:
            raise ValueError(
                "slew_deg goes counter-clockwise from the first angle to the second, at most one full turn"
            )
        if self.radius_m is not None and self.radius_m[0] >= self.radius_m[1]:
            raise ValueError("radius_m must give the smallest radius, then the largest")
        return self

    def limiters(self) -> WorkingRange:
        """Return the range as a value for the planner."""
        slew_rad = None if self.slew_deg is None else in_radians(self.slew_deg)
        return WorkingRange(slew_rad, self.radius_m, self.highest_hook_m)


class LuffAxisConfig(SlewingConfig):
    """Limits of the luffing axis."""


class LuffingConfig(Table):
    """A luffing jib, or the boom of a mobile crane."""

    pivot_height_m: Positive | None = None
    """Height of the pivot above z = 0."""
    pivot_offset_m: Number | None = None
    """Radius of the pivot; negative behind the slewing axis."""
    length_m: Positive | None = None
    """Length from the pivot to the rope exit at the tip."""
    luff_deg: tuple[Positive, Positive] | None = None
    """Smallest and largest angle to the horizontal."""
    luffing: LuffAxisConfig | None = None
    """Limits of the luffing axis."""
    tail_radius_m: NotNegative | None = None
    """Radius of the counterweight behind the slewing axis."""
    tail_low_m: NotNegative | None = None
    """Height of the counterweight's underside above z = 0."""
    tail_width_m: Positive | None = None
    """Width of the counterweight."""
    width_m: Positive | None = None
    """Width of the jib."""


class OverrideConfig(Table):
    """What differs from the machine, on purpose."""

    jib: LuffingConfig | None = None
    """A luffing jib, or the boom of a mobile crane."""
    jib_length_m: Positive | None = None
    """Largest hook radius."""
    min_radius_m: NotNegative | None = None
    """Smallest hook radius."""
    mast_size_m: Positive | None = None
    """Edge of the square mast section."""
    hook_block_kg: NotNegative | None = None
    """Mass of the hook block."""
    gears: tuple[tuple[Positive, Rate], ...] | None = None
    """Hoist rates: [largest mass on the rope in kg, hook block and rigging included; rate in m/s]. Above the last mass:
    the rate of ``hoist``."""
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
    """Its reevings, instead of one ``chart``; ``falls`` selects one."""
    auxiliary: AuxiliaryConfig | None = None
    """Its second hook, with which a part can be turned over in the air."""

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


class SetUpConfig(Table):
    """A place at which a mobile crane that moves during the job stands for a while."""

    name: Text
    """Its name."""
    base_m: Point2or3
    """Foot of the slewing axis."""
    heading_deg: Number | None = None
    """Direction of the carrier's front from the x axis, counter-clockwise. Default: that of ``[crane]``."""
    outriggers: Text | None = None
    """Name of the base of outriggers in use. Default: that of ``[crane]``."""
    boom_m: Positive | None = None
    """Length of the boom, from its pivot to the tip. Default: that of ``[crane]``."""
    counterweight_kg: NotNegative | None = None
    """Counterweight that is fitted. Default: that of ``[crane]``."""


class MovingConfig(Table):
    """How long a mobile crane takes to move from one of its set-ups to the next one.

    The defaults follow the crane's largest capacity (professional judgement): up to 60 t 30 and 45 min, up to 130 t 45
    and 60 min, above that 90 and 120 min.
    """

    derig_min: Annotated[NotNegative, Field(le=10_000.0)] | None = None
    """Time until the crane can drive: boom in, counterweight and outriggers as the way needs it. Default: by class."""
    drive_km_h: Annotated[Positive, Field(le=100.0), AfterValidator(partial(not_below, 0.1))] = 3.0
    """Speed on the site, along the straight line between the two places (professional judgement)."""
    rig_min: Annotated[NotNegative, Field(le=10_000.0)] | None = None
    """Time from the arrival to the first lift: mats, outriggers, counterweight, boom, check. Default: by class."""


MOST_SET_UPS = 9
"""The most set-ups of a crane: the choice of those that are needed looks at every set of them."""


class CraneConfig(OverrideConfig):
    """The crane. Default: one is chosen. Several are an array of tables, ``[[crane]]``."""

    kind: Literal["hammerhead", "luffing", "mobile", "none"] | None = None
    """``luffing`` and ``mobile`` use ``jib`` instead of ``jib_height_m``, ``jib_length_m``, ``min_radius_m`` and
    ``trolley``. ``none``: no crane. Default: the machine's, otherwise ``hammerhead``."""
    name: Text | None = None
    """A machine's name selects the machine. Default: the machine's."""
    machine: Text | None = None
    """A machine of the catalogue, or the file of your own next to the site file."""
    base_m: Point2or3 | None = None
    """Foot of the slewing axis."""
    jib_height_m: Positive | None = None
    """Height of the trolley's rope exit above z = 0."""
    jib_length_m: Positive | None = None
    """Largest hook radius: one of the machine's jib lengths. Default: the longest."""
    sling_m: NotNegative | None = None
    """Height of the slings, from the load's top to the hook."""
    rigging_mass_kg: NotNegative | None = None
    """Mass of slings and spreader."""
    falls: Annotated[Whole, Field(ge=1)] | None = None
    """Parts of rope that carry the hook. Default: the reeving that carries most."""
    heading_deg: Number | None = None
    """Only for a mobile crane: direction of the carrier's front from the x axis, counter-clockwise. Default: 0."""
    counterweight_kg: NotNegative | None = None
    """Only for a mobile crane: counterweight that is fitted. Default: the machine's largest."""
    outriggers: Text | None = None
    """Only for a mobile crane: name of the base of outriggers in use. Default: the machine's widest."""
    working_range: WorkingRangeConfig | None = None
    """Settings of its limiters."""
    setup: Annotated[tuple[SetUpConfig, ...], Field(max_length=MOST_SET_UPS)] = ()
    """Only for a mobile crane that moves during the job: its places, in the order in which it stands there, each a
    table ``[[crane.setup]]``, instead of ``base_m``."""
    moving: MovingConfig | None = None
    """Only with ``setup``: how long it takes to move."""
    override: OverrideConfig | None = None
    """What differs from the machine."""

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

    @model_validator(mode="after")
    def _set_ups(self) -> Self:
        if not self.setup:
            if self.moving is not None:
                raise ValueError("moving is for a crane with several places: give them as [[crane.setup]]")
            return self
        if self.kind in ("hammerhead", "luffing"):
            raise ValueError(f"setup is for a mobile crane; a {self.kind} crane stays where it is")
        if len(self.setup) == 1:
            raise ValueError("there is one setup: give its place as base_m of [crane], or a second one")
        if self.base_m is not None:
            raise ValueError("base_m is given per setup: leave it out")
        names = [one.name for one in self.setup]
        if again := sorted({name for name in names if names.count(name) > 1}):
            raise ValueError(f"two setups are called {again[0]!r}")
        return self

    def at_set_ups(self) -> tuple[CraneConfig, ...]:
        """Return the table of the crane in each of its set-ups; itself if it does not move."""
        if not self.setup:
            return (self,)
        found = []
        for one in self.setup:
            own = one.model_dump(include={"base_m", "heading_deg", "outriggers", "counterweight_kg"}, exclude_none=True)
            if one.boom_m is not None:
                own["jib"] = (self.jib or LuffingConfig()).model_copy(update={"length_m": one.boom_m})
            found.append(self.model_copy(update={**own, "setup": (), "moving": None}))
        return tuple(found)


SET_UP_KEYS = ("base_m", "heading_deg", "outriggers", "counterweight_kg", "jib")
"""Keys of a crane's table that a set-up may give."""


def reeving_of(given: ReevingConfig) -> Reeving:
    """Return the reeving that a table describes."""
    return Reeving(given.falls, chart_of(given.chart), given.hook_block_kg, given.trolley_rate_m_s, given.gears)
