"""The erection sequence: it satisfies the precedence relations and keeps the preferred stages as far as possible.

Of the parts that may come next, those of the earliest stage count, and of these the ones whose foot is not much higher
than the lowest: a building grows level by level. Among the rest the choice is free: the lowest first, or the part that
the crane reaches fastest.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bimvox.planning.contact.pairs import Contacts
from bimvox.planning.order.graph import order_graph
from bimvox.planning.order.relations import Precedence
from bimvox.planning.order.stages import stages
from bimvox.site.site import Site

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

    Raises:
        SequenceError: If no order satisfies the site file's ``before`` and ``after``; names the cycle.
    """

    def __init__(self, site: Site, relations: Precedence, contacts: Contacts) -> None:
        self._site, self._relations = site, relations
        self._graph = order_graph(site, relations, contacts)
        own, self._stage_notes = stages(site.components, self._graph, relations.supports)
        number = {stage: n for n, stage in enumerate(sorted(set(own)))}
        self._stages = np.array([number[stage] for stage in own], np.int64)
        self._foot_m = np.array([float(c.mesh.bounds_m[0, 2]) for c in site.components])
        self._rank = [(c.target_vox[2], c.target_vox[:2], c.index) for c in site.components]
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
        notes = [*self._floating_notes(), *graph.notes, *self._stage_notes]
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
