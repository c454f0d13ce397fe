"""Cranes that are not of the catalogue, or differ from the entry of their name."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from bimvox.crane.machine import Machine, differences, does_more, is_same
from bimvox.crane.tower_crane import TowerCrane
from bimvox.records.remark import Remark, Severity
from bimvox.remarks.subject import Subject, tonnes
from bimvox.site.catalogue import catalogue, machine_called
from bimvox.site.fictitious import FICTITIOUS

CRANE_UNKNOWN = "crane_unknown"
CRANE_ALTERED = "crane_altered"
CRANE_GENERIC = "crane_generic"

SCALED = " scaled "
"""In the names of machines that do not exist; earlier versions did not call them fictitious."""
LARGEST_TM = 10_000.0
"""Load moment of the largest tower crane ever built (Kroll K-10000: 120 t at 82 m)."""


def machines(subject: Subject) -> Iterator[Remark]:
    """Yield remarks about cranes that are not machines of the catalogue, and what differs by how much."""
    for crane in subject.site.cranes:
        named = machine_called(crane.machine or crane.name)
        possible = catalogue() if named is None else (named,)
        if any(is_same(crane, entry) for machine in possible for entry in machine.cranes):
            yield Remark(
                CRANE_GENERIC,
                Severity.NOTE,
                f"crane {crane.name!r} is a machine of the catalogue with typical data, not a manufacturer's product: "
                "its load chart must be replaced by that of the machine on site",
            )
            continue
        entry = _entry_of(crane, named)
        if entry is None:
            yield _unknown(crane)
        else:
            yield _altered(crane, entry)


def _entry_of(crane: TowerCrane, named: Machine | None) -> TowerCrane | None:
    """Return the entry of a crane's machine with its jib, or the longest, and its falls, or those that carry most.

    For a name of its own: the entry that has its load chart, as far as its jib reaches.
    """
    if named is None:
        entries = (entry for machine in catalogue() for entry in (machine.usual, *machine.cranes))
        return next((entry for entry in entries if entry.kind == crane.kind and entry.chart == crane.chart), None)
    entries_of_jib = named.with_jib(crane.jib_own_m) or named.with_jib(max(named.lengths_m))
    return next((entry for entry in entries_of_jib if entry.falls == crane.falls), entries_of_jib[-1])


def _unknown(crane: TowerCrane) -> Remark:
    """Return the remark about a crane that no entry of the catalogue describes."""
    radii, carries = np.array(crane.chart.radius_m), np.array(crane.chart.capacity_kg)
    moment_tm = float((radii * carries).max()) / 1000.0
    data = (
        f"{tonnes(float(carries[0]))} up to {radii[0]:g} m, {tonnes(float(carries[-1]))} at {radii[-1]:g} m, "
        f"jib {crane.jib_length_m:g} m"
    )
    if crane.name.startswith(FICTITIOUS) or SCALED in crane.name:
        said = f"crane {crane.name!r} is fictitious, it does not exist: a machine scaled up by calculation ({data})"
        return Remark(CRANE_UNKNOWN, Severity.SERIOUS, f"{said}; name a real machine and give its load chart")
    if moment_tm > LARGEST_TM:
        said = f"crane {crane.name!r} lifts {moment_tm:,.0f} tm, more than any tower crane ever built ({data})"
        return Remark(CRANE_UNKNOWN, Severity.SERIOUS, said)
    if crane.overrides:
        data += f"; the site file changes the machine {crane.machine or crane.name!r}: {_listed(crane.overrides)}"
    said = f"crane {crane.name!r} is not in the catalogue ({data})"
    return Remark(CRANE_UNKNOWN, Severity.MINOR, f"{said}: check its data against the manufacturer's load chart")


def _altered(crane: TowerCrane, entry: TowerCrane) -> Remark:
    """Return the remark about a crane that differs from its entry; serious if it carries or reaches more."""
    known = "as the catalogue has it" if crane.name == entry.name else f"{entry.name!r} of the catalogue"
    declared = ", as its [crane.override] says" if crane.overrides else ""
    said = f"crane {crane.name!r} is not {known}{declared}: {_listed(differences(crane, entry))}"
    return Remark(CRANE_ALTERED, Severity.SERIOUS if does_more(crane, entry) else Severity.MINOR, said)


def _listed(found: tuple[object, ...]) -> str:
    return "; ".join(map(str, found))
