"""Erection stages: the preferred order of the parts, as far as geometry permits.

Preferences rank: ``first`` in the site file, its assembly zones, the schedule in the building file, levels, and within
a level the classes of parts: footings, columns and walls, beams, slabs and stairs, then what stands on that floor. If
there are neither columns nor walls, the storeys of the building file take the place of the classes.
Every part has a stage. A part that another one needs comes no later than that one's stage. So a preference never
contradicts geometry: if it would, the part comes earlier, and a note names both.
"""

from __future__ import annotations

from collections.abc import Sequence

from bimvox.planning.order.graph import OrderGraph
from bimvox.planning.order.levels import levels_of, uprights_of
from bimvox.site.component import Component
from bimvox.site.work import kind_of

_KINDS = ("first", "zone", "task", "storey", "rank")
_CALLED = {"rank": "class"}
_NAMED = 10

Stage = tuple[int, int, int, int, int]


def stages(
    components: Sequence[Component], graph: OrderGraph, supports: Sequence[Sequence[int]]
) -> tuple[tuple[Stage, ...], tuple[str, ...]]:
    """Return the stage of every component, and notes on the preferences that were not kept.

    Args:
        components: The components.
        graph: Which must come before which.
        supports: Per component, those that it rests on.
    """
    preferred = _preferred(components, supports)
    kept = list(preferred)
    cause = list(range(len(components)))
    for i in reversed(graph.topological()):
        for j in sorted(graph.later[i]):
            if kept[j] < kept[i]:
                kept[i], cause[i] = kept[j], cause[j]
    return tuple(kept), _notes(components, preferred, kept, cause)


def _preferred(components: Sequence[Component], supports: Sequence[Sequence[int]]) -> list[Stage]:
    zones = 1 + max((c.hints.zone for c in components if c.hints.zone is not None), default=-1)
    tasks = 1 + max((c.hints.task_rank for c in components if c.hints.task_rank is not None), default=-1)
    levels = [0] * len(components)
    if any(c.hints.rank is not None or c.hints.storey_rank is not None for c in components):
        levels = levels_of(components, supports)
    by_class = any(uprights_of(components))
    return [
        (
            0 if c.hints.first else 1,
            zones if c.hints.zone is None else c.hints.zone,
            tasks if c.hints.task_rank is None else c.hints.task_rank,
            level,
            (c.hints.rank if by_class and c.hints.rank is not None else c.hints.storey_rank) or 0,
        )
        for c, level in zip(components, levels, strict=True)
    ]


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
