"""Cranes that are not of the catalogue, or differ from the entry of their name."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import astuple
from math import isclose

import numpy as np

from bimvox.crane.axis_limits import AxisLimits
from bimvox.crane.catalogue import BUILT_IN
from bimvox.crane.defaults import DEFAULT_REEVINGS
from bimvox.crane.load_chart import LoadChart, capacity_kg
from bimvox.crane.rigging import with_reeving
from bimvox.crane.tower_crane import TowerCrane
from bimvox.records.remark import Remark, Severity
from bimvox.remarks.subject import Subject, tonnes

CRANE_UNKNOWN = "crane_unknown"
CRANE_ALTERED = "crane_altered"
CRANE_GENERIC = "crane_generic"

SAME = 2e-3
"""Site files hold rates with four digits."""
SCALED = " scaled "
"""In the names of machines that ``bimvox init`` scales up if no machine of the catalogue suffices."""
LARGEST_TM = 10_000.0
"""Load moment of the largest tower crane ever built (Kroll K-10000: 120 t at 82 m)."""


def machines(subject: Subject) -> Iterator[Remark]:
    """Yield remarks about cranes that are not machines of the catalogue, and what differs by how much."""
    for crane in subject.site.cranes:
        entries = [entry for machine in BUILT_IN for entry in _reeved(machine)]
        if any(not _differences(crane, entry) for entry in entries if _may_be(crane, entry)):
            yield Remark(
                CRANE_GENERIC,
                Severity.NOTE,
                f"crane {crane.name!r} is a built-in machine with typical data, not a manufacturer's product: its load "
                "chart must be replaced by that of the machine on site",
            )
            continue
        entry = _entry_of(crane)
        if entry is None:
            yield _unknown(crane)
        else:
            yield _altered(crane, entry)


def _may_be(crane: TowerCrane, entry: TowerCrane) -> bool:
    """Return whether a crane may be an entry of the catalogue: of this name, or under a name of its own."""
    return crane.name == entry.name or all(crane.name != machine.name for machine in BUILT_IN)


def _reeved(machine: TowerCrane) -> tuple[TowerCrane, ...]:
    """Return a machine of the catalogue with each of its reevings."""
    reevings = DEFAULT_REEVINGS.get(machine.name)
    return (machine,) if reevings is None else tuple(with_reeving(machine, reeving) for reeving in reevings)


def _entry_of(crane: TowerCrane) -> TowerCrane | None:
    """Return the entry of the catalogue that has the crane's name, with the reeving of its falls if there is one.

    For a name of its own: the entry that has its load chart, as far as its jib reaches.
    """
    named = next((machine for machine in BUILT_IN if machine.name == crane.name), None)
    if named is not None:
        return next((entry for entry in _reeved(named) if entry.falls == crane.falls), named)
    entries = (entry for machine in BUILT_IN for entry in _reeved(machine))
    return next((entry for entry in entries if entry.kind == crane.kind and entry.chart == crane.chart), None)


def _unknown(crane: TowerCrane) -> Remark:
    """Return the remark about a crane that no entry of the catalogue describes."""
    radii, carries = np.array(crane.chart.radius_m), np.array(crane.chart.capacity_kg)
    moment_tm = float((radii * carries).max()) / 1000.0
    data = (
        f"{tonnes(float(carries[0]))} up to {radii[0]:g} m, {tonnes(float(carries[-1]))} at {radii[-1]:g} m, "
        f"jib {crane.jib_length_m:g} m"
    )
    if SCALED in crane.name:
        said = f"crane {crane.name!r} does not exist: it is a built-in machine scaled up by calculation ({data})"
        return Remark(CRANE_UNKNOWN, Severity.SERIOUS, f"{said}; name a real machine and give its load chart")
    if moment_tm > LARGEST_TM:
        said = f"crane {crane.name!r} lifts {moment_tm:,.0f} tm, more than any tower crane ever built ({data})"
        return Remark(CRANE_UNKNOWN, Severity.SERIOUS, said)
    said = f"crane {crane.name!r} is not in the catalogue ({data})"
    return Remark(CRANE_UNKNOWN, Severity.MINOR, f"{said}: check its data against the manufacturer's load chart")


def _altered(crane: TowerCrane, entry: TowerCrane) -> Remark:
    """Return the remark about a crane that differs from its entry; serious if it carries or reaches more."""
    differences = _differences(crane, entry)
    does_more = _does_more(crane, entry)
    known = "as the catalogue has it" if crane.name == entry.name else f"{entry.name!r} of the catalogue"
    said = f"crane {crane.name!r} is not {known}: {'; '.join(differences)}"
    return Remark(CRANE_ALTERED, Severity.SERIOUS if does_more else Severity.MINOR, said)


def _differences(crane: TowerCrane, entry: TowerCrane) -> list[str]:
    """Return what differs between two machines, and by how much; base, mast height, slings and limiters are the site's.

    The mast of a luffing crane carries its pivot, so only lengths above the pivot are compared.
    """
    found = []
    if crane.kind != entry.kind:
        found.append(f"kind {crane.kind} instead of {entry.kind}")
    for name, unit, own, wanted in (
        ("mast", "m", crane.mast_size_m, entry.mast_size_m),
        ("jib", "m", crane.jib_length_m, entry.jib_length_m),
        ("smallest radius", "m", crane.min_radius_m, entry.min_radius_m),
        ("hook block", "kg", crane.hook_block_kg, entry.hook_block_kg),
        ("wind limit", "m/s", crane.max_wind_m_s, entry.max_wind_m_s),
        ("falls", "", float(crane.falls), float(entry.falls)),
    ):
        if not _same(own, wanted):
            found.append(f"{name} {own:g} {unit}".rstrip() + f" instead of {wanted:g}{_by(own, wanted)}")
    if (said := _chart_difference(crane.chart, entry.chart)) is not None:
        found.append(said)
    if not _same_gears(crane, entry):
        fastest, usual = (max((rate for _, rate in one.gears), default=0.0) for one in (crane, entry))
        found.append(f"gears up to {fastest:g} m/s instead of {usual:g} m/s" + _by(fastest, usual))
    found += [
        f"{name} {said}"
        for name, own, wanted in _axes(crane, entry)
        if (said := _axis_difference(own, wanted)) is not None
    ]
    return found


def _axes(crane: TowerCrane, entry: TowerCrane) -> Iterator[tuple[str, AxisLimits, AxisLimits]]:
    yield "slewing", crane.slewing, entry.slewing
    if crane.luffing is None or entry.luffing is None:
        yield "trolley", crane.trolley, entry.trolley
        yield "hoist", crane.hoist, entry.hoist
    else:
        yield "luffing", crane.luffing.limits, entry.luffing.limits
        yield "winch", crane.luffing.winch, entry.luffing.winch


def _axis_difference(own: AxisLimits, wanted: AxisLimits) -> str | None:
    """Return how the limits of an axis differ, by the limit that differs most."""
    worst, said = 0.0, None
    names = ("rate", "acceleration", "jerk")
    for name, value, usual in zip(names, astuple(own), astuple(wanted), strict=True):
        off = abs(value / usual - 1.0)
        if off > max(SAME, worst):
            worst, said = off, f"{name} {value:.4g} instead of {usual:.4g}{_by(value, usual)}"
    return said


def _chart_difference(own: LoadChart, wanted: LoadChart) -> str | None:
    """Return how a load chart differs, at the radius where it differs most."""
    radii = np.union1d(own.radius_m, wanted.radius_m)
    carries, usual = (np.asarray(capacity_kg(chart, radii)) for chart in (own, wanted))
    off = np.abs(carries - usual)
    if (off <= SAME * np.maximum(usual, 1.0)).all():
        return None
    at = int(np.argmax(off))
    return f"chart {tonnes(float(carries[at]))} instead of {tonnes(float(usual[at]))} at {radii[at]:g} m" + _by(
        float(carries[at]), float(usual[at])
    )


def _does_more(crane: TowerCrane, entry: TowerCrane) -> bool:
    """Return whether a crane carries or reaches more than an entry of the catalogue, or hides some of its own mass."""
    radii = np.union1d(crane.chart.radius_m, entry.chart.radius_m)
    carries, usual = (np.asarray(capacity_kg(one.chart, radii)) for one in (crane, entry))
    return (
        crane.kind != entry.kind
        or bool((carries > usual * (1.0 + SAME)).any())
        or crane.jib_length_m > entry.jib_length_m * (1.0 + SAME)
        or crane.hook_block_kg < entry.hook_block_kg * (1.0 - SAME)
        or crane.max_wind_m_s > entry.max_wind_m_s * (1.0 + SAME)
    )


def _same_gears(crane: TowerCrane, entry: TowerCrane) -> bool:
    if len(crane.gears) != len(entry.gears):
        return False
    pairs = zip(crane.gears, entry.gears, strict=True)
    return all(_same(own, wanted) for one, other in pairs for own, wanted in zip(one, other, strict=True))


def _same(own: float, wanted: float) -> bool:
    return isclose(own, wanted, rel_tol=SAME, abs_tol=1e-9)


def _by(own: float, wanted: float) -> str:
    """Return the difference in percent as text."""
    return f" ({100.0 * (own / wanted - 1.0):+.0f} %)" if wanted > 0.0 else ""
