"""Erection stages: the preferred order of the parts, as far as geometry permits.

Preferences rank: ``first`` in the site file, its assembly zones, the schedule in the building file, storeys, and within
a storey the classes of parts: footings, columns and walls, beams, slabs and stairs, then what stands on that floor.
Every part has a stage. A part that another one needs comes no later than that one's stage. So a preference never
contradicts geometry: if it would, the part comes earlier, and a note names both.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bimvox.planning.order.graph import OrderGraph
from bimvox.planning.order.levels import levels_of
from bimvox.site.component import Component
from bimvox.site.work import kind_of

_KINDS = ("first", "zone", "task", "storey", "rank")
_CALLED = {"rank": "class"}
_NAMED = 10
_SAME_M = 0.1

Stage = tuple[int, int, int, int, int]


def stages(components: Sequence[Component], graph: OrderGraph) -> tuple[tuple[Stage, ...], tuple[str, ...]]:
    """Return the stage of every component, and notes on the preferences that were not kept."""
    preferred = _preferred(components)
    kept = list(preferred)
    cause = list(range(len(components)))
    for i in reversed(graph.topological()):
        for j in sorted(graph.later[i]):
            if kept[j] < kept[i]:
                kept[i], cause[i] = kept[j], cause[j]
    return tuple(kept), _notes(components, preferred, kept, cause)


def _preferred(components: Sequence[Component]) -> list[Stage]:
    zones = 1 + max((c.hints.zone for c in components if c.hints.zone is not None), default=-1)
    tasks = 1 + max((c.hints.task_rank for c in components if c.hints.task_rank is not None), default=-1)
    ranked = any(c.hints.rank is not None for c in components)
    levels = levels_of(components) if ranked else None
    storeys = _storeys(components) if levels is None else levels
    return [
        (
            0 if c.hints.first else 1,
            zones if c.hints.zone is None else c.hints.zone,
            tasks if c.hints.task_rank is None else c.hints.task_rank,
            storeys[n],
            0 if levels is None else c.hints.rank or 0,
        )
        for n, c in enumerate(components)
    ]


def _storeys(components: Sequence[Component]) -> list[int]:
    """Return storey numbers; a part outside all storeys joins the highest one that begins no higher than the part."""
    known = sorted({c.hints.storey_rank for c in components if c.hints.storey_rank is not None})
    if not known:
        return [0] * len(components)
    low = [float(c.mesh.bounds_m[0, 2]) for c in components]
    feet = [
        float(np.median([low[n] for n, c in enumerate(components) if c.hints.storey_rank == rank])) for rank in known
    ]
    begins = np.maximum.accumulate(feet)
    found = []
    for n, component in enumerate(components):
        rank = component.hints.storey_rank
        if rank is None:
            rank = known[max(0, int(np.searchsorted(begins, low[n] + _SAME_M, side="right")) - 1)]
        found.append(rank)
    return found


def _notes(
    components: Sequence[Component], preferred: Sequence[Stage], kept: Sequence[Stage], cause: Sequence[int]
) -> tuple[str, ...]:
    found: dict[str, list[str]] = {kind: [] for kind in _KINDS}
    for i, (own_stage, stage) in enumerate(zip(preferred, kept, strict=True)):
        if stage >= own_stage:
            continue
        kind = _KINDS[next(n for n in range(len(own_stage)) if stage[n] != own_stage[n])]
        own, other = components[i], components[cause[i]]
        if kind == "zone":
            where = f"is set with {other.hints.zone_name}, not with {own.hints.zone_name or 'parts outside all zones'}"
        elif kind == "task":
            task = f"task {own.hints.task!r}" if own.hints.task is not None else "no task"
            where = f"({task}) is set before task {other.hints.task!r}, against the schedule"
        elif kind == "storey" and own.storey != other.storey:
            where = f"(storey {own.storey!r}) is set with storey {other.storey!r}"
        else:
            found[kind].append(
                f"{own.label} ({kind_of(own)}) comes before its turn: {other.label} ({kind_of(other)}) needs it"
            )
            continue
        found[kind].append(f"{own.label} {where}: {other.label} needs it")
    notes = []
    for kind in _KINDS[1:]:
        notes += found[kind][:_NAMED]
        if len(found[kind]) > _NAMED:
            notes.append(
                f"{len(found[kind]) - _NAMED} more parts come earlier than their {_CALLED.get(kind, kind)}, "
                "because others need them"
            )
    return tuple(notes)
