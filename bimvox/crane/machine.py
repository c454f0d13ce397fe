"""A machine of the catalogue: everything that can stand on a site under one name, and how a crane differs from it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import astuple, dataclass
from math import degrees, isclose
from typing import Any

import numpy as np

from bimvox.crane.load_chart import LoadChart, capacity_kg
from bimvox.crane.tower_crane import AxisLimits, LuffingJib, Override, TowerCrane


@dataclass(frozen=True, slots=True)
class Source:
    """A publication with figures of a machine.

    Attributes:
        title: Its title.
        publisher: Who published it.
        date: Its date or edition; empty if it has none.
        address: Where it is.
        states: The figures that it gives.
    """

    title: str
    publisher: str
    date: str
    address: str
    states: str


@dataclass(frozen=True, slots=True)
class Machine:
    """A machine with all its jib lengths and reevings.

    Attributes:
        name: Its name.
        kind: ``hammerhead``, ``luffing`` or ``mobile``.
        about: One line about what it is and where its data come from.
        jibs_m: Length of the jib of each of ``cranes``; from the pivot for a luffing jib.
        cranes: The machine with each jib and reeving, on the origin: shorter jibs first, then fewer falls.
        file: Name and content of its file; None for a machine of the catalogue.
        hoist_kw: Power of its hoist motor; None if nobody states it.
        sources: What publishes the figures of a real machine; empty for a generic one.
        assumed: Keys whose values are those of the generic class ``like``, because no source states them.
        not_found: What no source states, and what the machine therefore does not have.
        like: Name of the generic machine of its class; empty for a generic one.
    """

    name: str
    kind: str
    about: str
    jibs_m: tuple[float, ...]
    cranes: tuple[TowerCrane, ...]
    file: tuple[str, bytes] | None = None
    hoist_kw: float | None = None
    sources: tuple[Source, ...] = ()
    assumed: tuple[str, ...] = ()
    not_found: tuple[str, ...] = ()
    like: str = ""

    @property
    def load_moment_tm(self) -> float:
        """Largest load moment, tonne-metres: the size of a machine."""
        return max(
            radius_m * mass_kg / 1000.0
            for crane in self.cranes
            for radius_m, mass_kg in zip(crane.chart.radius_m, crane.chart.capacity_kg, strict=True)
        )

    @property
    def lengths_m(self) -> tuple[float, ...]:
        """Its jib lengths, ascending."""
        return tuple(sorted(set(self.jibs_m)))

    @property
    def usual(self) -> TowerCrane:
        """The machine with its longest jib, and the reeving that carries most."""
        return carries_most(self.with_jib(max(self.jibs_m)))

    def with_jib(self, length_m: float) -> tuple[TowerCrane, ...]:
        """Return the machine with a jib length and each reeving; empty if it has no such jib."""
        return tuple(crane for crane, own in zip(self.cranes, self.jibs_m, strict=True) if abs(own - length_m) < 1e-3)


def carries_most(cranes: Sequence[TowerCrane]) -> TowerCrane:
    """Return the crane with the reeving that carries most."""
    return max(cranes, key=lambda crane: (crane.chart.capacity_kg[0], crane.falls))


def identity(crane: TowerCrane) -> dict[str, Any]:
    """Return name, machine, largest hook radius, falls and overrides of a crane, for JSON documents."""
    return {
        "name": crane.name,
        "machine": crane.machine or crane.name,
        "jib_length_m": crane.jib_length_m,
        "falls": crane.falls,
        "overrides": [override.to_dict() for override in crane.overrides],
    }


SAME = 2e-3
"""Site files may hold rates with four digits."""


def differences(crane: TowerCrane, machine: TowerCrane) -> tuple[Override, ...]:
    """Return what differs between a crane and a machine, and by how much; empty if they are the same."""
    return tuple(_differences(crane, machine))


def is_same(crane: TowerCrane, machine: TowerCrane) -> bool:
    """Return whether nothing differs. It looks no further than the first difference: a catalogue has 90 entries."""
    return next(_differences(crane, machine), None) is None


def _differences(crane: TowerCrane, machine: TowerCrane) -> Iterator[Override]:
    if crane.kind != machine.kind:
        yield Override("kind", "kind", machine.kind, crane.kind)
    yield from _numbers(crane, machine, _PLAIN if crane.luffing is None else _PLAIN[2:])
    if crane.luffing is not None and machine.luffing is not None:
        # The mast of a luffing tower crane carries the pivot, so its height is the site's.
        numbers = _JIB if crane.kind == "mobile" else _JIB[2:]
        yield from _numbers(crane.luffing, machine.luffing, numbers, prefix="jib.")
        yield from _luff_range(crane.luffing, machine.luffing)
    if (found := _chart(crane.chart, machine.chart)) is not None:
        yield found
    if not _same_gears(crane, machine):
        fastest, usual = (max((rate for _, rate in one.gears), default=0.0) for one in (crane, machine))
        yield Override("gears", "gears", f"up to {usual:g} m/s", f"up to {fastest:g} m/s", _by(fastest, usual))
    if crane.auxiliary is not None and crane.auxiliary != machine.auxiliary:
        had = "none" if machine.auxiliary is None else "the machine's"
        yield Override("auxiliary", "auxiliary hook", had, "the site's")
    for key, name, own, wanted in _axes(crane, machine):
        if (found := _axis(key, name, own, wanted)) is not None:
            yield found


_PLAIN = (
    ("jib_length_m", "jib", "m"),
    ("min_radius_m", "smallest radius", "m"),
    ("mast_size_m", "mast", "m"),
    ("hook_block_kg", "hook block", "kg"),
    ("max_wind_m_s", "wind limit", "m/s"),
    ("falls", "falls", ""),
)
_JIB = (
    ("pivot_height_m", "height of the pivot", "m"),
    ("tail_low_m", "height of the counterweight", "m"),
    ("pivot_offset_m", "radius of the pivot", "m"),
    ("length_m", "jib", "m"),
    ("tail_radius_m", "radius of the counterweight", "m"),
    ("tail_width_m", "width of the counterweight", "m"),
    ("width_m", "width of the jib", "m"),
)


def _numbers(
    own: object, wanted: object, keys: tuple[tuple[str, str, str], ...], prefix: str = ""
) -> Iterator[Override]:
    for key, name, unit in keys:
        value, usual = float(getattr(own, key)), float(getattr(wanted, key))
        if not _same(value, usual):
            machine, site = (f"{number:g} {unit}".rstrip() for number in (usual, value))
            yield Override(prefix + key, name, machine, site, _by(value, usual))


def _luff_range(own: LuffingJib, wanted: LuffingJib) -> Iterator[Override]:
    if all(_same(value, usual) for value, usual in zip(own.luff_rad, wanted.luff_rad, strict=True)):
        return
    site, machine = ("{:.1f} to {:.1f} degrees".format(*map(degrees, jib.luff_rad)) for jib in (own, wanted))
    yield Override("jib.luff_deg", "luffing range", machine, site)


def _axes(crane: TowerCrane, machine: TowerCrane) -> Iterator[tuple[str, str, AxisLimits, AxisLimits]]:
    yield "slewing", "slewing", crane.slewing, machine.slewing
    if crane.luffing is None or machine.luffing is None:
        yield "trolley", "trolley", crane.trolley, machine.trolley
        yield "hoist", "hoist", crane.hoist, machine.hoist
    else:
        yield "jib.luffing", "luffing", crane.luffing.limits, machine.luffing.limits
        yield "hoist", "winch", crane.luffing.winch, machine.luffing.winch


def _axis(key: str, name: str, own: AxisLimits, wanted: AxisLimits) -> Override | None:
    """Return how the limits of an axis differ, by the limit that differs most."""
    if own == wanted:
        return None
    worst, result = 0.0, None
    for limit, value, usual in zip(("rate", "acceleration", "jerk"), astuple(own), astuple(wanted), strict=True):
        off = abs(value / usual - 1.0)
        if off > max(SAME, worst):
            worst = off
            result = Override(key, f"{name} {limit}", f"{usual:.4g}", f"{value:.4g}", _by(value, usual))
    return result


def same_chart(own: LoadChart, wanted: LoadChart) -> bool:
    """Return whether a chart lists nothing but what another lists; it may leave out radii in between."""
    return _chart(own, wanted) is None


def _chart(own: LoadChart, wanted: LoadChart) -> Override | None:
    """Return how a load chart differs, at the radius where it differs most.

    Radii that it leaves out between its own are not compared: it carries less there.
    """
    if own == wanted:
        return None
    ends = [at for at in wanted.radius_m if not own.radius_m[0] <= at <= own.radius_m[-1]]
    radii = np.union1d(own.radius_m, ends)
    carries, usual = (np.asarray(capacity_kg(chart, radii)) for chart in (own, wanted))
    off = np.abs(carries - usual)
    if (off <= SAME * np.maximum(usual, 1.0)).all():
        return None
    at = int(np.argmax(off))
    value, wants = float(carries[at]), float(usual[at])
    return Override(
        "chart", "chart", f"{wants / 1000:.1f} t at {radii[at]:g} m", f"{value / 1000:.1f} t", _by(value, wants)
    )


def _same_gears(crane: TowerCrane, machine: TowerCrane) -> bool:
    if len(crane.gears) != len(machine.gears):
        return False
    pairs = zip(crane.gears, machine.gears, strict=True)
    return all(_same(own, wanted) for one, other in pairs for own, wanted in zip(one, other, strict=True))


def does_more(crane: TowerCrane, machine: TowerCrane) -> bool:
    """Return whether a crane carries or reaches more than a machine, or hides some of its own mass."""
    radii = np.union1d(crane.chart.radius_m, machine.chart.radius_m)
    carries, usual = (np.asarray(capacity_kg(one.chart, radii)) for one in (crane, machine))
    return (
        crane.kind != machine.kind
        or bool((carries > usual * (1.0 + SAME)).any())
        or crane.jib_length_m > machine.jib_length_m * (1.0 + SAME)
        or crane.hook_block_kg < machine.hook_block_kg * (1.0 - SAME)
        or crane.max_wind_m_s > machine.max_wind_m_s * (1.0 + SAME)
    )


def _same(own: float, wanted: float) -> bool:
    return isclose(own, wanted, rel_tol=SAME, abs_tol=1e-9)


def _by(own: float, wanted: float) -> str:
    """Return the difference in percent as text."""
    return f"{100.0 * (own / wanted - 1.0):+.0f} %" if wanted > 0.0 else ""
