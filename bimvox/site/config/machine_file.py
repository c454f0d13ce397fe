"""The file of a machine: geometry, rates, and its load charts as the data sheet prints them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise
from math import acos, degrees, floor, inf, pi, radians
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from bimvox.crane.carrier import BaseLoads, Carrier, Masses, Outriggers, SectorChart, Stand
from bimvox.crane.kinematics import with_luffing_jib, with_reeving
from bimvox.crane.load_chart import LoadChart
from bimvox.crane.machine import Machine
from bimvox.crane.sectors import least_of
from bimvox.crane.tower_crane import AxisLimits, LuffingJib, Reeving, TowerCrane
from bimvox.site.config.crane import (
    AuxiliaryConfig,
    LuffAxisConfig,
    Rate,
    ReevingConfig,
    SlewingConfig,
    TravelConfig,
    chart_of,
    reeving_of,
)
from bimvox.site.config.validation import (
    NotNegative,
    Number,
    Positive,
    Table,
    TableFiles,
    Text,
    Whole,
    in_radians,
)

_FOLLOWS = AxisLimits(1.0, 1.0, 1.0)  # replaced by what follows from the jib


class LuffingMachineConfig(Table):
    """Geometry of a luffing jib or a mobile crane's boom, and of the counterweight."""

    pivot_height_m: Positive
    """Height of the pivot above the ground; the site file says how high a tower crane stands."""
    pivot_offset_m: Number
    """Radius of the pivot; negative behind the slewing axis."""
    luff_deg: tuple[Positive, Positive]
    """Smallest and largest angle to the horizontal."""
    luffing: LuffAxisConfig
    """Limits of the luffing axis."""
    tail_radius_m: NotNegative
    """Radius of the counterweight behind the slewing axis."""
    tail_low_m: NotNegative
    """Height of the counterweight's underside above the ground."""
    tail_width_m: Positive
    """Width of the counterweight."""
    width_m: Positive
    """Width of the jib."""


class JibConfig(Table):
    """One or more jib lengths with the same load charts."""

    lengths_m: Annotated[tuple[Positive, ...], Field(min_length=1)]
    """The largest hook radius; of a luffing jib, from pivot to tip."""
    reeving: Annotated[tuple[ReevingConfig, ...], Field(min_length=1)]
    """Its reevings, each with its load chart."""


class TackleConfig(Table):
    """A reeving of a machine whose charts are tables: they hold with it up to its own limit."""

    falls: Annotated[Whole, Field(ge=1)]
    """Parts of rope that carry the hook."""
    most_kg: Positive | None = None
    """Largest mass on the rope with it: line pull times falls. Default: the tables alone limit it."""
    hook_block_kg: NotNegative = 0.0
    """Mass of the hook block."""
    trolley_rate_m_s: Rate | None = None
    """Highest speed of the trolley with it. Default: the rate of ``trolley``."""
    gears: tuple[tuple[Positive, Rate], ...] = ()
    """Hoist rates: [largest mass on the rope in kg, hook block and rigging included; rate in m/s]. Above the last mass:
    the rate of ``hoist``."""


class OutriggersConfig(Table):
    """A base of outriggers of a mobile crane: how far its pads are from the slewing axis."""

    name: Text
    """As the maker calls it: ``full``, ``half``."""
    front_m: Positive
    """Of the front pads, towards the carrier's front."""
    rear_m: Positive
    """Of the rear pads, towards its rear."""
    left_m: Positive
    """Of the left pads."""
    right_m: Positive
    """Of the right pads."""


class SectorConfig(Table):
    """A sector for which a mobile crane has charts of its own."""

    name: Text
    """As the maker calls it: ``over rear``."""
    deg: tuple[Number, Number]
    """First and last angle of the boom from the carrier's front, counter-clockwise, at most one turn: over the rear
    [150, 210]."""

    @model_validator(mode="after")
    def _is_sector(self) -> Self:
        if not (-360.0 <= self.deg[0] < self.deg[1] <= self.deg[0] + 360.0):
            raise ValueError("deg goes counter-clockwise from the first angle to the second, at most one full turn")
        return self


ALL_AROUND = "360"
"""The sector of a table that holds in every direction."""


class ChartTableConfig(Table):
    """A table of the data sheet: capacity by radius and by length of boom or jib."""

    lengths_m: Annotated[tuple[Positive, ...], Field(min_length=1)]
    """Lengths of its columns: of a trolley's jib the largest hook radius, of others from pivot to tip."""
    rows: Annotated[tuple[tuple[NotNegative, ...], ...], Field(min_length=1)]
    """[radius in m, capacity in kg for each length]; 0 where the sheet has a blank."""
    counterweight_kg: NotNegative | None = None
    """Counterweight for which it holds. Default: there is no choice."""
    outriggers: Text | None = None
    """Name of the base of outriggers for which it holds. Default: there is no choice."""
    sector: Text = ALL_AROUND
    """Name of its sector; ``360``: it holds in every direction."""
    falls: Annotated[Whole, Field(ge=1)] | None = None
    """Reeving for which it holds. Default: every reeving."""

    @model_validator(mode="after")
    def _is_table(self) -> Self:
        if len(set(self.lengths_m)) < len(self.lengths_m):
            raise ValueError("lengths_m: a length is given twice")
        for number, row in enumerate(self.rows):
            if len(row) != len(self.lengths_m) + 1:
                raise ValueError(f"rows[{number}] has {len(row) - 1} capacities for {len(self.lengths_m)} lengths_m")
            if row[0] <= (0.0 if number == 0 else self.rows[number - 1][0]):
                raise ValueError(f"rows[{number}]: radii must be above 0 and ascend")
        for column, length in enumerate(self.lengths_m, start=1):
            _check_column([(row[0], row[column]) for row in self.rows], length)
        return self


def _check_column(pairs: list[tuple[float, float]], length_m: float) -> None:
    held = [(radius, mass) for radius, mass in pairs if mass > 0.0]
    if not held:
        raise ValueError(f"rows: the column of {length_m:g} m is blank")
    inner = [radius for radius, mass in pairs if mass == 0.0 and held[0][0] < radius < held[-1][0]]
    if inner:
        raise ValueError(f"rows: the column of {length_m:g} m is blank at {inner[0]:g} m, between two capacities")
    for (_, more), (radius, less) in pairwise(held):
        if less > more:
            raise ValueError(f"rows: in the column of {length_m:g} m the capacity grows at {radius:g} m")


class DeductionConfig(Table):
    """What the charts of the data sheet are reduced by: a stowed jib, a second hook block."""

    name: Text
    """What it is."""
    mass_kg: Positive
    """By how much every capacity is smaller."""


class MassesConfig(Table):
    """Masses of a mobile crane, for the loads on its outriggers."""

    carrier_kg: Positive
    """Undercarriage with outriggers, without everything that slews."""
    carrier_ahead_m: Number = 0.0
    """Its centre ahead of the slewing axis, towards the carrier's front; negative behind."""
    superstructure_kg: NotNegative
    """What slews, without boom and counterweight."""
    superstructure_ahead_m: Number = 0.0
    """Its centre ahead of the slewing axis, towards the hook; negative behind."""
    boom_kg: Positive
    """The boom, with everything on it."""
    boom_share: Annotated[Positive, Field(le=1.0)] = 0.4
    """Its centre as a share of its length, from the pivot: 0.4, because a telescope is heaviest at its foot
    (professional judgement)."""
    counterweight_kg: NotNegative | None = None
    """The counterweight, if no table has one."""
    counterweight_behind_m: NotNegative | None = None
    """Its centre behind the slewing axis. Default: 0.5 m less than ``tail_radius_m`` (professional judgement)."""


class BaseLoadsConfig(Table):
    """Loads on the foundation of a tower crane, from the maker's table."""

    vertical_kn: NotNegative | None = None
    """Vertical load."""
    horizontal_kn: NotNegative | None = None
    """Horizontal load."""
    moment_knm: NotNegative | None = None
    """Overturning moment."""
    slewing_knm: NotNegative | None = None
    """Moment of slewing."""
    corner_kn: NotNegative | None = None
    """Largest load of a corner."""

    def loads(self) -> BaseLoads:
        """Return the loads as a value for the report."""
        return BaseLoads(**self.model_dump())


class StandConfig(Table):
    """How a tower crane stands, from the maker's table; leave out what it does not state."""

    lengths_m: tuple[Positive, ...] = ()
    """Jib lengths for which it holds. Default: all."""
    base: Text | None = None
    """What it stands on: ``cross base 6 x 6 m``."""
    edge_m: Positive | None = None
    """Edge of the square that this covers."""
    ballast_kg: NotNegative | None = None
    """Ballast on the base."""
    free_standing_m: Positive | None = None
    """Highest hook above the foot without ties."""
    mass_kg: Positive | None = None
    """Mass of the crane without ``ballast_kg``."""
    tail_radius_m: Positive | None = None
    """Only for a hammerhead: how far the counter-jib reaches back from the slewing axis. Default: 0.28 of the jib, at
    least three widths of the mast."""
    in_service: BaseLoadsConfig | None = None
    """Loads on the foundation in service."""
    out_of_service: BaseLoadsConfig | None = None
    """Loads on the foundation out of service."""


class MachineConfig(Table):
    """A machine, as its data sheet describes it."""

    name: Text
    """Its name, not one of the catalogue's."""
    kind: Literal["hammerhead", "luffing", "mobile"]
    """``hammerhead``: any tower crane with a trolley."""
    about: Text
    """What it is, and where its data come from."""
    mast_size_m: Positive
    """Edge of the square mast section, or of the pad."""
    jib_height_m: Positive | None = None
    """Only for a hammerhead: usual height of the trolley's rope exit; the site file says how high it stands."""
    min_radius_m: NotNegative | None = None
    """Only for a hammerhead: smallest hook radius."""
    sling_m: NotNegative
    """Usual height of the slings, from the load's top to the hook."""
    rigging_mass_kg: NotNegative
    """Usual mass of slings and spreader."""
    max_wind_m_s: Positive = 20.0
    """Wind (gust of 3 s) up to which the crane works; 20 m/s for tower cranes (EN 14439)."""
    hoist_kw: Positive | None = None
    """Power of the hoist motor, against which an import checks the rates."""
    slewing: SlewingConfig
    """Limits of the slewing axis."""
    trolley: TravelConfig | None = None
    """Only for a hammerhead."""
    hoist: TravelConfig
    """Limits of the hoist."""
    luffing: LuffingMachineConfig | None = None
    """Not for a hammerhead."""
    jib: tuple[JibConfig, ...] = ()
    """The jib lengths with their load charts, if each has one chart for each reeving."""
    table: tuple[ChartTableConfig, ...] = ()
    """The load charts as the data sheet prints them, instead of ``jib``."""
    reeving: tuple[TackleConfig, ...] = ()
    """The reevings of the tables."""
    outriggers: tuple[OutriggersConfig, ...] = ()
    """Bases of outriggers of a mobile crane."""
    sector: tuple[SectorConfig, ...] = ()
    """Sectors of a mobile crane that have tables of their own."""
    deduction: tuple[DeductionConfig, ...] = ()
    """What every capacity of the tables is reduced by, as long as it is fitted."""
    rated_percent: Annotated[Positive, Field(le=100.0)] | None = None
    """Capacity as a share of the tipping load, as the sheet states it: 75 or 85."""
    standard: Text | None = None
    """Standard by which the charts are rated: ``EN 13000``, ``ASME B30.5``."""
    masses: MassesConfig | None = None
    """Masses of a mobile crane, for the loads on its outriggers."""
    stand: tuple[StandConfig, ...] = ()
    """How a tower crane stands, by jib length."""
    auxiliary: AuxiliaryConfig | None = None
    """Its second hook; without it, the machine has none."""

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        own = ("jib_height_m", "min_radius_m", "trolley")
        needed, other = (own, ("luffing",)) if self.kind == "hammerhead" else (("luffing",), own)
        for key in needed:
            if getattr(self, key) is None:
                raise ValueError(f'{key} is missing: kind = "{self.kind}" needs it')
        for key in other:
            if getattr(self, key) is not None:
                raise ValueError(f'{key} is not for kind = "{self.kind}"')
        if bool(self.jib) == bool(self.table):
            raise ValueError("jib is missing: give the load charts in jib, or as tables in table and reeving, not both")
        for key in ("outriggers", "sector", "masses"):
            if getattr(self, key) and self.kind != "mobile":
                raise ValueError(f'{key} is only for kind = "mobile"')
        if self.stand and self.kind == "mobile":
            raise ValueError('stand is not for kind = "mobile"')
        if self.kind == "luffing" and any(one.tail_radius_m is not None for one in self.stand):
            raise ValueError("stand: tail_radius_m of a luffing crane is in luffing")
        if self.table:
            self._check_tables()
        elif self.reeving or self.sector or self.deduction:
            raise ValueError("reeving, sector and deduction belong to table: leave them out, or give tables")
        lengths = [length for jib in self.jib for length in jib.lengths_m]
        if len(set(lengths)) < len(lengths):
            raise ValueError("jib: a length is given twice")
        lengths = lengths or [length for table in self.table for length in table.lengths_m]
        if self.min_radius_m is not None and self.min_radius_m >= min(lengths):
            raise ValueError(f"min_radius_m must be smaller than the shortest jib of {min(lengths):g} m")
        for number, jib in enumerate(self.jib):
            falls = [one.falls for one in jib.reeving]
            if len(set(falls)) < len(falls):
                raise ValueError(f"jib[{number}].reeving: two reevings have the same falls")
        return self

    def _check_tables(self) -> None:
        """Raise an error if a table names what the file does not describe."""
        falls = [one.falls for one in self.reeving]
        if not falls:
            raise ValueError("reeving is missing: give the falls and the hook block of each, [[reeving]]")
        if len(set(falls)) < len(falls):
            raise ValueError("reeving: two have the same falls")
        bases, sectors = [one.name for one in self.outriggers], [one.name for one in self.sector]
        for name, given in (("outriggers", bases), ("sector", sectors)):
            if len(set(given)) < len(given):
                raise ValueError(f"{name}: two have the same name")
        seen = set()
        for number, one in enumerate(self.table):
            known = (("falls", one.falls, falls), ("outriggers", one.outriggers, bases))
            for key, value, names in (*known, ("sector", one.sector, [ALL_AROUND, *sectors])):
                if value is not None and value not in names:
                    raise ValueError(
                        f"table[{number}].{key} is {value!r}, which the file does not describe: "
                        f"there are {', '.join(map(str, names)) or 'none'}"
                    )
            if self.kind != "mobile" and (
                one.counterweight_kg is not None or one.outriggers or one.sector != ALL_AROUND
            ):
                raise ValueError(f'table[{number}]: counterweight, outriggers and sector are for kind = "mobile"')
            for length in one.lengths_m:
                case = (one.counterweight_kg, one.outriggers, one.sector, one.falls, length)
                if case in seen:
                    raise ValueError(f"table[{number}]: another table has the same case with {length:g} m")
                seen.add(case)


def _machine(given: MachineConfig) -> Machine:
    """Return the machine that a file describes."""
    pairs = sorted(cranes_of_machine(given), key=lambda pair: (pair[0], pair[1].falls))
    lengths_m, cranes = zip(*pairs, strict=True)
    return Machine(given.name, given.kind, given.about, lengths_m, cranes, hoist_kw=given.hoist_kw)


def cranes_of_machine(given: MachineConfig) -> Iterator[tuple[float, TowerCrane]]:
    """Yield every jib length with the crane, once per reeving, counterweight and base of outriggers."""
    for jib in given.jib:
        for length_m in jib.lengths_m:
            for one in jib.reeving:
                carrier = _carrier(given, None, _widest(given), ())
                yield length_m, _crane(given, length_m, reeving_of(one), carrier)
    if given.table:
        yield from _cranes_of_tables(given)


def _cranes_of_tables(given: MachineConfig) -> Iterator[tuple[float, TowerCrane]]:
    bases = {base.name: base for base in given.outriggers}
    cases = dict.fromkeys((one.counterweight_kg, one.outriggers) for one in given.table)
    for weight_kg, base in cases:
        tables = [one for one in given.table if (one.counterweight_kg, one.outriggers) == (weight_kg, base)]
        for length_m in sorted({length for one in tables for length in one.lengths_m}):
            for tackle in given.reeving:
                charts = _by_sector(given, tables, length_m, tackle)
                if not charts:
                    continue
                sectors = _sectors(given, charts)
                rest = [chart for name, chart in charts.items() if name == ALL_AROUND] or list(charts.values())
                reeving = Reeving(
                    tackle.falls, least_of(rest), tackle.hook_block_kg, tackle.trolley_rate_m_s, tackle.gears
                )
                own = bases[base] if base is not None else _widest(given)
                carrier = _carrier(given, weight_kg, own, sectors)
                nearest_m = max(chart.radius_m[0] for chart in charts.values())
                yield length_m, _crane(given, length_m, reeving, carrier, nearest_m)


def _by_sector(
    given: MachineConfig, tables: list[ChartTableConfig], length_m: float, tackle: TackleConfig
) -> dict[str, LoadChart]:
    """Return the charts of a length and a reeving by sector, less what is deducted.

    A table for the reeving goes before one for all.
    """
    less_kg = sum(one.mass_kg for one in given.deduction)
    charts: dict[str, LoadChart] = {}
    for one in sorted(tables, key=lambda one: one.falls is not None):
        if length_m not in one.lengths_m or one.falls not in (None, tackle.falls):
            continue
        column = 1 + one.lengths_m.index(length_m)
        pairs = [(row[0], min(row[column], tackle.most_kg or inf) - less_kg) for row in one.rows if row[column]]
        held = tuple(pair for pair in pairs if pair[1] > 0.0)
        if held:
            charts[one.sector] = chart_of(held)
    return charts


def _sectors(given: MachineConfig, charts: dict[str, LoadChart]) -> tuple[SectorChart, ...]:
    """Return the charts by sector, and sectors without a chart where none holds."""
    named = sorted(
        (
            SectorChart(one.name, *in_radians(one.deg), charts.get(one.name))
            for one in given.sector
            if one.name in charts or ALL_AROUND not in charts
        ),
        key=lambda one: one.from_rad,
    )
    if ALL_AROUND in charts or not named:
        return tuple(named)
    result = []
    for one, after in zip(named, [*named[1:], named[0]], strict=True):
        until_rad = after.from_rad + (2.0 * pi if after is named[0] else 0.0)
        result.append(one)
        if until_rad > one.to_rad + 1e-6:
            result.append(SectorChart("no chart", one.to_rad, until_rad))
    return tuple(result)


def _widest(given: MachineConfig) -> OutriggersConfig | None:
    return max(given.outriggers, key=lambda base: _base(base).area_m2, default=None)


def _base(given: OutriggersConfig) -> Outriggers:
    return Outriggers(**given.model_dump())


def _carrier(
    given: MachineConfig,
    counterweight_kg: float | None,
    base: OutriggersConfig | None,
    sectors: tuple[SectorChart, ...],
) -> Carrier | None:
    """Return how a mobile crane is set up; None if the file says nothing about it."""
    masses = given.masses
    if counterweight_kg is None and masses is not None:
        counterweight_kg = masses.counterweight_kg
    rated = "" if given.rated_percent is None else f"{given.rated_percent:g} % of the tipping load"
    carrier = Carrier(
        counterweight_kg=counterweight_kg,
        outriggers=None if base is None else _base(base),
        sectors=sectors,
        rating=", ".join(one for one in (rated, given.standard or "") if one),
        deductions=tuple((one.name, one.mass_kg) for one in given.deduction),
        masses=None if masses is None else _masses(given, masses),
    )
    return None if given.kind != "mobile" or carrier == Carrier() else carrier


def _masses(given: MachineConfig, own: MassesConfig) -> Masses:
    assert given.luffing is not None
    behind_m = own.counterweight_behind_m
    if behind_m is None:
        behind_m = max(given.luffing.tail_radius_m - 0.5, 0.0)
    values = own.model_dump(exclude={"counterweight_kg", "counterweight_behind_m"})
    return Masses(**values, counterweight_behind_m=behind_m)


def _stand(given: MachineConfig, length_m: float) -> Stand | None:
    """Return how a tower crane stands with a jib: a table for it goes before one for all."""
    own = [one for one in given.stand if length_m in one.lengths_m] or [s for s in given.stand if not s.lengths_m]
    if not own:
        return None
    one = own[0]
    return Stand(
        one.base or "",
        one.edge_m,
        one.ballast_kg,
        one.free_standing_m,
        None if one.in_service is None else one.in_service.loads(),
        None if one.out_of_service is None else one.out_of_service.loads(),
        one.mass_kg,
        one.tail_radius_m,
    )


def _crane(
    given: MachineConfig, length_m: float, reeving: Reeving, carrier: Carrier | None = None, nearest_m: float = 0.0
) -> TowerCrane:
    """Return the machine on the origin, with one jib and one reeving.

    ``nearest_m``: the first radius of its table, below which it has no capacity: a boom is not raised further.
    """
    crane = TowerCrane(
        name=given.name,
        base_m=(0.0, 0.0, 0.0),
        mast_size_m=given.mast_size_m,
        jib_height_m=given.jib_height_m or 0.0,
        jib_length_m=length_m,
        min_radius_m=given.min_radius_m or 0.0,
        sling_m=given.sling_m,
        rigging_mass_kg=given.rigging_mass_kg,
        slewing=given.slewing.limits(),
        trolley=given.trolley.limits() if given.trolley else _FOLLOWS,
        hoist=given.hoist.limits(),
        chart=reeving.chart,
        max_wind_m_s=given.max_wind_m_s,
        kind=given.kind,
        carrier=carrier,
        stand=_stand(given, length_m),
        auxiliary=None if given.auxiliary is None else given.auxiliary.value(),
    )
    crane = with_reeving(crane, reeving)
    if given.luffing is None:
        return replace(crane, min_radius_m=max(crane.min_radius_m, nearest_m))
    own = given.luffing
    low_rad, high_rad = in_radians(own.luff_deg)
    share = (nearest_m - own.pivot_offset_m) / length_m
    if nearest_m > 0.0 and share < 1.0:
        # In whole millionths of a degree: a site file holds it without rounding.
        highest_rad = radians(floor(1e6 * degrees(acos(max(share, 0.0)))) / 1e6)
        high_rad = max(min(high_rad, highest_rad), low_rad + 0.01)
    return with_luffing_jib(
        crane,
        LuffingJib(
            own.pivot_offset_m, own.pivot_height_m, length_m, (low_rad, high_rad),
            own.luffing.limits(), given.hoist.limits(),
            own.tail_radius_m, own.tail_low_m, own.tail_width_m, own.width_m,
        ),
    )  # fmt: skip


MACHINE_FILE = ".toml"
"""How the name of such a file ends."""
MACHINE_FILES = TableFiles(MachineConfig, _machine, "catalogue", "machine")
