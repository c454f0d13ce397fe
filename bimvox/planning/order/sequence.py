"""The erection sequence: it satisfies the precedence relations and keeps preferred stages and levels where possible.

Of the parts that may come next, those of the earliest stage count, and of these the ones whose foot is not much higher
than the lowest: a building grows level by level. Among the rest the choice is free: the lowest first, or the part that
the crane reaches fastest.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from graphlib import TopologicalSorter

import numpy as np
from numpy.typing import NDArray

from bimvox.bim.building import TriangleMesh
from bimvox.kept import kept
from bimvox.planning.contact.pairs import Contacts
from bimvox.planning.order.relations import OrderGraph, Precedence, order_graph
from bimvox.planning.order.set_up_choice import times_of_set_ups
from bimvox.site.component import Component
from bimvox.site.site import Site
from bimvox.site.work import Work, kind_of

# Between which heights the body of a part lies: what is small at its top or foot does not count.
#
# The railing of a stair, the upstand of a slab and the bolts under a column hold little of its volume, and little of it
# at any height. They say nothing about the floor to which the part belongs.

_SLICES = 64
_SMALL = 0.1
"""What is left out at one end holds no more than this share of the volume ..."""
_THIN = 0.25
"""... and its section is less than this share of the mean section, in every slice."""
_OPEN = 1e-3
"""Surfaces seen from above whose area differs by more than this share from that seen from below enclose no volume."""


@kept
def body_m(mesh: TriangleMesh) -> tuple[float, float]:
    """Return the lowest and the highest height of the body of a part, metres; of an open mesh, of all of it."""
    low_m, high_m = mesh.bounds_m[:, 2].tolist()
    slices_m3 = _slices_m3(mesh.triangles_m, np.linspace(low_m, high_m, _SLICES + 1))
    first, last = (_left_out(slices) for slices in (slices_m3, slices_m3[::-1]))
    if first > _SLICES // 2:
        first = 0  # long legs are what it stands on
    step_m = (high_m - low_m) / _SLICES
    return low_m + first * step_m, high_m - last * step_m


def _left_out(slices_m3: NDArray[np.float64]) -> int:
    """Return how many slices from the first one on hold nothing but a small piece."""
    total_m3 = float(slices_m3.sum())
    small = (slices_m3 < _THIN * total_m3 / _SLICES) & (slices_m3.cumsum() <= _SMALL * total_m3)
    return int(np.argmin(small))


def _slices_m3(triangles_m: NDArray[np.float64], heights_m: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the volume between neighbouring heights, (N,) from (N + 1,); zeros if the mesh is open above or below."""
    one, two = triangles_m[:, 1, :2] - triangles_m[:, 0, :2], triangles_m[:, 2, :2] - triangles_m[:, 0, :2]
    above_m2 = 0.5 * (one[:, 0] * two[:, 1] - one[:, 1] * two[:, 0])  # seen from above positive, from below negative
    seen = above_m2 != 0.0
    if abs(above_m2.sum()) > _OPEN * np.abs(above_m2).sum():
        return np.zeros(len(heights_m) - 1)
    below_m3 = -above_m2[seen] @ _depths_m(triangles_m[seen, :, 2], heights_m)
    slices_m3: NDArray[np.float64] = np.abs(np.diff(below_m3))
    return slices_m3


def _depths_m(corners_m: NDArray[np.float64], heights_m: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return how far triangles are below heights, (F, N) from (F, 3) and (N,): the mean over each; zero above them.

    The share of a triangle below a height grows with the square of the height over its lowest corner, up to the middle
    one, and then likewise to one. This is its integral.
    """
    low, middle, high = (column[:, None] for column in np.sort(corners_m, axis=1).T)
    at, mean = np.clip(heights_m, low, high), (low + middle + high) / 3.0
    with np.errstate(divide="ignore", invalid="ignore"):
        lower = (at - low) ** 3 / (3.0 * (high - low) * (middle - low))
        upper = at - mean + (high - at) ** 3 / (3.0 * (high - low) * (high - middle))
    within = np.where(at < middle, lower, np.where(at < high, upper, at - mean))
    depths_m: NDArray[np.float64] = within + np.maximum(heights_m - high, 0.0)
    return depths_m


# The level of every part, from the feet of columns and walls.
#
# Columns and walls with feet at about the same height stand on one level. All other parts belong to the level whose
# columns and walls carry them: their top is at the feet of the next level, or above the last. So a floor is finished
# before what stands on it. What rests on columns or walls, also through other parts, is of no lower level than they.
# Feet and tops are those of the bodies: neither a railing nor a bolt changes the level. Without columns and walls, the
# feet of all parts make the levels.
#
# The storeys of the file are not asked: some files keep a slab in the storey whose floor it is, others in the storey
# below, and some state a wrong one.

_STEP_M = 0.5
"""Feet further apart than this are on different levels."""
_SPAN_M = 1.5
"""The feet of one level differ by no more than this."""
_SUNK_M = 0.4
"""A column or wall may stand this much below the top of the floor that it stands on: in a pocket, or past its edge."""
_UPRIGHT = (Work.COLUMN, Work.WALL)


def _uprights_of(components: Sequence[Component]) -> list[bool]:
    """Return which parts are columns or walls."""
    return [kind_of(component) in _UPRIGHT for component in components]


def levels_of(components: Sequence[Component], supports: Sequence[Sequence[int]]) -> list[int]:
    """Return the level of every part, from 0; -1 for what the lowest columns and walls stand on.

    ``supports``: per part, those that it rests on; without cycles.
    """
    bodies_m, stands = [body_m(component.mesh) for component in components], _uprights_of(components)
    if not any(stands):
        stands = [True] * len(components)
    bounds_m = _bounds_m([foot_m for (foot_m, _), is_upright in zip(bodies_m, stands, strict=True) if is_upright])
    lowest_m, highest_m = np.array(bounds_m).T
    levels, carried = [-1] * len(components), [-1] * len(components)
    for i in TopologicalSorter(dict(enumerate(supports))).static_order():
        foot_m, top_m = bodies_m[i]
        if stands[i]:
            levels[i] = carried[i] = int(np.searchsorted(lowest_m, foot_m, side="right")) - 1
        else:
            carried[i] = max((carried[j] for j in supports[i]), default=-1)
            levels[i] = max(int(np.searchsorted(highest_m, top_m - _SUNK_M, side="left")) - 1, carried[i])
    return levels


def _bounds_m(feet_m: Sequence[float]) -> list[tuple[float, float]]:
    """Return the lowest and the highest foot of each level, ascending."""
    result: list[tuple[float, float]] = []
    for foot_m in sorted(feet_m):
        if result and foot_m - result[-1][1] <= _STEP_M and foot_m - result[-1][0] <= _SPAN_M:
            result[-1] = (result[-1][0], foot_m)
        else:
            result.append((foot_m, foot_m))
    return result


# Erection stages: the preferred order of the parts, as far as geometry permits.
#
# If a crane moves, its set-ups come first: each part belongs to one. Preferences rank: ``first`` in the site file, its
# assembly zones, the schedule in the building file, levels, and within a level the classes of parts: footings, columns
# and walls, beams, slabs and stairs, then what stands on that floor. If there are neither columns nor walls, the
# storeys of the building file take the place of the classes. Every part has a stage. A part that another one needs
# comes no later than that one's stage. So a preference never contradicts geometry: if it would, the part comes
# earlier, and a note names both.

_KINDS = ("set-up", "first", "zone", "task", "storey", "rank")
_CALLED = {"rank": "class"}
_NAMED = 10

Stage = tuple[int, int, int, int, int, int]


def stages(
    components: Sequence[Component],
    graph: OrderGraph,
    supports: Sequence[Sequence[int]],
    set_ups: Sequence[int] | None = None,
) -> tuple[tuple[Stage, ...], tuple[str, ...]]:
    """Return the stage of every component, and notes on the preferences that were not kept.

    Args:
        components: The components.
        graph: Which must come before which.
        supports: Per component, those that it rests on.
        set_ups: Per component, in which set-up of a crane that moves it is set; None if no crane moves.
    """
    preferred = _preferred(components, supports, set_ups or [0] * len(components))
    kept = list(preferred)
    cause = list(range(len(components)))
    for i in reversed(graph.topological()):
        for j in sorted(graph.later[i]):
            if kept[j] < kept[i]:
                kept[i], cause[i] = kept[j], cause[j]
    return tuple(kept), _notes(components, preferred, kept, cause)


def _preferred(
    components: Sequence[Component], supports: Sequence[Sequence[int]], set_ups: Sequence[int]
) -> list[Stage]:
    zones = 1 + max((c.hints.zone for c in components if c.hints.zone is not None), default=-1)
    tasks = 1 + max((c.hints.task_rank for c in components if c.hints.task_rank is not None), default=-1)
    levels = [0] * len(components)
    if any(c.hints.rank is not None or c.hints.storey_rank is not None for c in components):
        levels = levels_of(components, supports)
    by_class = any(_uprights_of(components))
    return [
        (
            set_up,
            0 if c.hints.first else 1,
            zones if c.hints.zone is None else c.hints.zone,
            tasks if c.hints.task_rank is None else c.hints.task_rank,
            level,
            (c.hints.rank if by_class and c.hints.rank is not None else c.hints.storey_rank) or 0,
        )
        for c, level, set_up in zip(components, levels, set_ups, strict=True)
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
    for kind in _KINDS[2:]:
        notes += found[kind][:_NAMED]
        if len(found[kind]) > _NAMED:
            notes.append(
                f"{len(found[kind]) - _NAMED} more parts come earlier than their {_CALLED.get(kind, kind)}, "
                "because others need them"
            )
    return tuple(notes)


_LEVEL_M = 1.5
"""Parts whose feet differ by no more than this are on one level."""

Prefer = Callable[[list[int], list[int]], int]
"""(components that may come next, the order so far) -> the next component."""


@dataclass(frozen=True, slots=True)
class ErectionSequence:
    """An erection sequence.

    Attributes:
        order: Component indices, first lift first.
        notes: Relations and preferences that the order could not keep, and parts without support, one sentence each.
        unheld: Components that had to come before any part that could hold them.
    """

    order: tuple[int, ...]
    notes: tuple[str, ...] = ()
    unheld: tuple[int, ...] = ()


class Sequencer:
    """Makes erection sequences of a site.

    Attributes:
        waits_for: Per component, those that it rests on, or without such ones may be held by, and those that the site
            file asks to be earlier.

    Raises:
        SequenceError: If no order satisfies the site file's ``before`` and ``after``; names the cycle.
    """

    def __init__(self, site: Site, relations: Precedence, contacts: Contacts) -> None:
        self._site, self._relations = site, relations
        self._graph = order_graph(site, relations, contacts)
        own, self._stage_notes = stages(
            site.components,
            self._graph,
            relations.supports,
            None if site.moving is None else times_of_set_ups(site, self._graph),
        )
        number = {stage: n for n, stage in enumerate(sorted(set(own)))}
        self._stages = np.array([number[stage] for stage in own], np.int64)
        self._foot_m = np.array([float(c.mesh.bounds_m[0, 2]) for c in site.components])
        self._rank = [(c.target_vox[2], c.target_vox[:2], c.index) for c in site.components]
        self.waits_for = [
            (*(on or (() if ground else holds)), *first)
            for on, ground, holds, first in zip(
                relations.supports, relations.grounded, relations.holds, relations.wanted, strict=True
            )
        ]
        # Whether a part is held before any other one is placed, and by part those that it can hold.
        held = zip(relations.supports, relations.grounded, relations.holds, strict=True)
        self._is_held = np.array([bool(on) or ground or not holds for on, ground, holds in held], np.bool_)
        self._may_hold: list[list[int]] = [[] for _ in site.components]
        for i, holds in enumerate(relations.holds):
            for j in holds:
                self._may_hold[j].append(i)

    def lowest_first(self) -> ErectionSequence:
        """Return the sequence that takes the lowest part first, then from the near corner onwards."""
        return self.order(lambda ready, _: min(ready, key=self._rank.__getitem__), level_m=0.0)

    def order(self, prefer: Prefer, *, level_m: float = _LEVEL_M) -> ErectionSequence:
        """Return the sequence that follows a preference.

        Args:
            prefer: Chooses among the parts that may come next.
            level_m: How much higher than the lowest of them the foot of a part may be.
        """
        graph, components = self._graph, self._site.components
        missing = [len(earlier) for earlier in graph.earlier]
        is_open, is_held = np.array([n == 0 for n in missing], np.bool_), self._is_held.copy()
        order: list[int] = []
        unheld: list[int] = []
        notes = [*self.geometry_notes(), *self._stage_notes]
        while is_open.any():
            ready = np.flatnonzero(is_open & is_held)
            if not len(ready):
                waiting = min(np.flatnonzero(is_open).tolist(), key=self._rank.__getitem__)
                unheld.append(waiting)
                notes.append(f"{components[waiting].label}: set before any part that could hold it")
                ready = np.array([waiting])
            ready = ready[self._stages[ready] == self._stages[ready].min()]
            highest_m = self._foot_m[ready].min() + level_m
            chosen = prefer(ready[self._foot_m[ready] <= highest_m].tolist(), order)
            order.append(chosen)
            is_open[chosen] = False
            is_held[self._may_hold[chosen]] = True
            for later in graph.later[chosen]:
                missing[later] -= 1
                is_open[later] = missing[later] == 0
        return ErectionSequence(tuple(order), tuple(notes), tuple(unheld))

    def following(self, order: Sequence[int]) -> ErectionSequence:
        """Return the sequence that keeps to an order wherever it may."""
        rank = {i: n for n, i in enumerate(order)}
        return self.order(lambda ready, _: min(ready, key=rank.__getitem__))

    def fixed_pairs(self, order: Sequence[int]) -> NDArray[np.bool_]:
        """Return (N, N) whether a part must stay before another one if an order is changed only a little.

        They do if they are not of one stage, level or assembly, if the later one needs the other one, or if that is the
        first that can hold it.
        """
        numbers, stage, foot_m = np.array(order), self._stages, self._foot_m
        names = [component.hints.assembly for component in self._site.components]
        assembly = np.array([-1 if name is None else names.index(name) for name in names])
        apart: NDArray[np.bool_] = (stage[:, None] != stage[None]) | (assembly[:, None] != assembly[None])
        fixed: NDArray[np.bool_] = apart | (foot_m[None] > foot_m[:, None] + _LEVEL_M)
        for i, later in enumerate(self._graph.later):
            fixed[i, list(later)] = True
        position = np.empty(len(numbers), np.int64)
        position[numbers] = np.arange(len(numbers))
        for i, holds in enumerate(self._relations.holds):
            if holds and not self._relations.supports[i]:
                fixed[min(holds, key=lambda j: position[j]), i] = True
        fixed &= position[:, None] < position[None]
        return fixed

    def geometry_notes(self) -> tuple[str, ...]:
        """Return the notes that any sequence has: parts without support, and cycles of geometry."""
        return (*self._floating_notes(), *self._graph.notes)

    def _floating_notes(self) -> list[str]:
        site, relations = self._site, self._relations
        gap_m = site.rules.support_gap_m
        return [
            f"{component.label}: nothing supports it within {gap_m:g} m; it is set after a part that it "
            + ("is connected to" if component.hints.connected else "touches")
            if relations.holds[i]
            else f"{component.label}: floats {self._foot_m[i]:.2f} m above the ground and touches nothing"
            for i, component in enumerate(site.components)
            if not relations.supports[i] and not relations.grounded[i]
        ]
