"""The acyclic graph of precedence: geometry and the site file's ``before`` and ``after``.

Supports, ``before`` and ``after`` always hold. A blocked descent holds too, unless it is part of a cycle. Then the
parts of the cycle are taken apart in the finished building, with lateral moves if the straight way up is blocked; the
order is the reverse (see :mod:`bimvox.planning.order.disassembly`).
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from bimvox.errors import SequenceError
from bimvox.kept import kept
from bimvox.planning.contact.pairs import Contacts
from bimvox.planning.order.disassembly import Disassembly
from bimvox.planning.order.relations import Precedence
from bimvox.site.site import Site

Edges = list[set[int]]
"""Per component, the components that come later."""


@dataclass(frozen=True, slots=True, eq=False)
class OrderGraph:
    """Which part must come before which, without cycles.

    Attributes:
        earlier: Per component, those that must come before it.
        later: Per component, those that must come after it.
        notes: Cycles of geometry and how they were resolved, one sentence each.
    """

    earlier: tuple[frozenset[int], ...]
    later: tuple[frozenset[int], ...]
    notes: tuple[str, ...]

    def topological(self) -> tuple[int, ...]:
        """Return all components in topological order; the lowest index first among equals."""
        missing = [len(earlier) for earlier in self.earlier]
        ready = deque(i for i, n in enumerate(missing) if n == 0)
        order = []
        while ready:
            i = ready.popleft()
            order.append(i)
            for j in sorted(self.later[i]):
                missing[j] -= 1
                if missing[j] == 0:
                    ready.append(j)
        return tuple(order)


@kept
def order_graph(site: Site, relations: Precedence, contacts: Contacts) -> OrderGraph:
    """Return the precedence graph of a site; made once for it.

    Raises:
        SequenceError: If no order satisfies the site file's ``before`` and ``after``; names the cycle.
    """
    count = len(site.components)
    firm: Edges = [set() for _ in range(count)]
    for i in range(count):
        for j in (*relations.supports[i], *relations.wanted[i]):
            firm[j].add(i)
    for group in _cycles(firm):
        raise _no_order(site, relations, firm, group)
    needed: Edges = [firm[i] | set(relations.descent[i]) for i in range(count)]
    edges: Edges = [needed[i] | set(relations.yields[i]) for i in range(count)]
    for group in _cycles(edges):
        for i in group:
            edges[i] = needed[i] | (edges[i] - set(group))
    notes: list[str] = []
    groups = list(_cycles(edges))
    disassembly = Disassembly(site, contacts, relations) if groups else None
    for group in groups:
        assert disassembly is not None
        inside = frozenset(group)
        taken = disassembly.take_apart(group, firm, _reached(edges, inside))
        if taken.stuck and any(set(relations.wanted[i]) & inside for i in inside):
            raise _no_order(site, relations, edges, taken.stuck)
        notes += taken.notes
        for i in inside:
            edges[i] -= inside
        for first, then in zip(taken.order, taken.order[1:], strict=False):
            edges[first].add(then)
    earlier: Edges = [set() for _ in range(count)]
    for i, later in enumerate(edges):
        for j in later:
            earlier[j].add(i)
    return OrderGraph(tuple(map(frozenset, earlier)), tuple(map(frozenset, edges)), tuple(notes))


def _cycles(edges: Edges) -> Iterable[tuple[int, ...]]:
    """Yield the groups of components that form cycles, lowest index first."""
    pairs = np.array([(i, j) for i, later in enumerate(edges) for j in sorted(later)], np.int64).reshape(-1, 2)
    graph = coo_array((np.ones(len(pairs), np.int8), (pairs[:, 0], pairs[:, 1])), shape=(len(edges), len(edges)))
    _, label = connected_components(graph.tocsr(), connection="strong")
    members: dict[int, list[int]] = {}
    for i, group in enumerate(label.tolist()):
        members.setdefault(group, []).append(i)
    for group in members.values():
        if len(group) > 1 or group[0] in edges[group[0]]:
            yield tuple(group)


def _reached(edges: Edges, group: frozenset[int]) -> frozenset[int]:
    """Return everything that must come after a part of the group, without the group itself."""
    found: set[int] = set()
    queue = deque(sorted(group))
    while queue:
        for j in edges[queue.popleft()]:
            if j not in found and j not in group:
                found.add(j)
                queue.append(j)
    return frozenset(found)


def _no_order(site: Site, relations: Precedence, edges: Edges, group: Sequence[int]) -> SequenceError:
    cycle = _shortest_cycle(edges, group, relations)
    ids = [site.components[i].id for i in cycle]
    names = [site.components[i].label for i in cycle]
    reasons = [
        f"{names[n]} before {names[(n + 1) % len(ids)]} ({_reason(relations, i, cycle[(n + 1) % len(cycle)])})"
        for n, i in enumerate(cycle)
    ]
    return SequenceError(
        f"no erection sequence is possible: {', '.join(reasons)}",
        cycle=ids,
        hint="change before or after of one of these parts in the site file",
    )


def _shortest_cycle(edges: Edges, group: Sequence[int], relations: Precedence) -> list[int]:
    """Return a shortest cycle within a group, through a ``before`` or ``after`` of the site file if there is one."""
    inside = set(group)
    required = [(j, i) for i in sorted(inside) for j in relations.wanted[i] if j in inside]
    best: list[int] = []
    for start, then in required or [(i, j) for i in sorted(inside) for j in sorted(edges[i] & inside)]:
        back = {then: then}
        queue = deque([then])
        while queue and start not in back:
            here = queue.popleft()
            for there in sorted(edges[here] & inside):
                if there not in back:
                    back[there] = here
                    queue.append(there)
        if start not in back:
            continue
        cycle = [start]
        while cycle[-1] != then:
            cycle.append(back[cycle[-1]])
        if not best or len(cycle) < len(best):
            best = cycle[::-1]
    return [best[-1], *best[:-1]] if best else list(group)


def _reason(relations: Precedence, first: int, then: int) -> str:
    if first in relations.wanted[then]:
        return "required by the site file"
    if first in relations.supports[then]:
        return "which rests on it"
    return "which would block its descent"
