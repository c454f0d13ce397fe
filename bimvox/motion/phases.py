"""Phases of a lift put on the clock."""

from __future__ import annotations

from collections.abc import Iterable

from bimvox.records.motion import Phase, PhaseName


def phases_from(start_ns: int, lengths_ns: Iterable[tuple[PhaseName, int]]) -> tuple[Phase, ...]:
    """Return phases that follow each other from a time on; those without duration are omitted."""
    phases = []
    for name, length_ns in lengths_ns:
        if length_ns > 0:
            phases.append(Phase(name, start_ns, start_ns + length_ns))
            start_ns += length_ns
    return tuple(phases)


def delayed(phases: Iterable[Phase], by_ns: int) -> tuple[Phase, ...]:
    """Return phases moved in time."""
    return tuple(Phase(phase.name, phase.start_ns + by_ns, phase.end_ns + by_ns) for phase in phases)


def cut_at(phases: Iterable[Phase], end_ns: int) -> tuple[Phase, ...]:
    """Return the phases that start before a time, the last one cut there."""
    return tuple(Phase(p.name, p.start_ns, min(p.end_ns, end_ns)) for p in phases if p.start_ns < end_ns)
