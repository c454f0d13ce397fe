"""Precedence relations of the parts, from geometry and the site file, and their graph without cycles.

Two relations come from geometry, by the same swept-contact test that clears the last moves:

* *descent*: i before j if j in place would block the straight descent of i or the rope above it, or i would pass j
  closer than the tolerance;
* *support*: j before i if i rests on j: moved down by the support gap (grout joint, bearing), i meets j.

The site file's ``before`` and ``after`` are added. A part without support from a part, the ground or a structure is
hung: it waits for one of the parts that it touches.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Collection, Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from bimvox.errors import InputError, SequenceError
from bimvox.kept import kept
from bimvox.planning.contact.pairs import Contacts
from bimvox.planning.contact.sweep import FAR_M, rope_meets
from bimvox.planning.insertion import Insertion, PartToInsert, find_insertion
from bimvox.planning.occupancy import Occupancy, target_cells
from bimvox.site.ground import Ground
from bimvox.site.means import Means
from bimvox.site.site import Site
from bimvox.site.work import Work, kind_of

_ROUNDING_M = 1e-6
_MADE_THERE = (Means.IN_SITU, Means.BUILT)
"""Such a part needs no way to its place."""
_BY_ROPE_M = 0.05
"""What is farther from the hook line than this cannot be in the rope's way."""


@dataclass(frozen=True, slots=True, eq=False)
class Precedence:
    """Which part must come before which, by component index.

    Attributes:
        descent: Per component, those that must come later because they would block its straight descent; none for what
            is cast or built in its place.
        yields: Per component, those that come later unless that closes a cycle: they are above what is cast or built,
            or it would pass them closer than the tolerance, or they are cast beside it, into joints and strips.
        supports: Per component, the components that it rests on.
        grounded: Per component, whether it rests on the ground or on a structure.
        touching: Per component, the components whose cells it shares or touches.
        wanted: Per component, those that must come earlier because the site file says so.
        holds: Per component, those that can hold it if nothing below supports it: the parts to which the building file
            connects it, otherwise those that it touches.
    """

    descent: tuple[tuple[int, ...], ...]
    yields: tuple[tuple[int, ...], ...]
    supports: tuple[tuple[int, ...], ...]
    grounded: tuple[bool, ...]
    touching: tuple[tuple[int, ...], ...]
    wanted: tuple[tuple[int, ...], ...]
    holds: tuple[tuple[int, ...], ...]


def precedence(site: Site, contacts: Contacts, progress: Callable[[int, int], None] | None = None) -> Precedence:
    """Return the precedence relations of a site.

    Raises InputError: if a ``before`` or ``after`` names a component that does not exist.
    """
    count = len(site.components)
    boxes = contacts.bounds_m
    gap_m = site.rules.support_gap_m + site.rules.contact_tolerance_m
    descent, yields, supports, grounded = [], [], [], []
    on_ground = Ground.of(site).carries(gap_m)
    for i in range(count):
        low, high = boxes[i]
        over = ((boxes[:, 0, :2] < high[:2]) & (boxes[:, 1, :2] > low[:2])).all(axis=1)
        over[i] = False
        below = np.flatnonzero(over & (boxes[:, 0, 2] < low[2] + gap_m) & (boxes[:, 1, 2] > low[2] - gap_m))
        foot_m = _hook_foot_m(site, i)
        # The hook line is the middle of a column of cells: beside a narrow part, not over it.
        from_m, to_m = foot_m[:2] - _BY_ROPE_M, foot_m[:2] + _BY_ROPE_M
        by_rope = ((boxes[:, 0, :2] < to_m) & (boxes[:, 1, :2] > from_m)).all(axis=1)
        above = np.flatnonzero((over | by_rope) & (boxes[:, 1, 2] > low[2]))
        others = [int(j) for j in above if j < count and j != i]
        is_brought = site.components[i].means not in _MADE_THERE
        around = {j for j in np.flatnonzero(over).tolist() if is_brought and _is_made_around(site, contacts, i, j)}
        blocking = tuple(j for j in others if j in around or _blocks(site, contacts, i, j, foot_m))
        descent.append(blocking if is_brought else ())
        # Solids under the outline whose top may be near one of the part's undersides.
        near_below = np.flatnonzero(over & (boxes[:, 0, 2] < high[2]) & (boxes[:, 1, 2] > low[2] - gap_m))
        # From aside, the way out of a clash, a part drawn into the top of another does not meet it on its way down.
        is_top = boxes[:, 1, 2] <= low[2] + site.rules.contact_tolerance_m + _ROUNDING_M
        into = (boxes[:, 1, 2] > low[2]) & (is_top | (boxes[:, :, 2].mean(axis=1) < low[2]))
        rests = (int(j) for j in near_below)
        held = [
            j
            for j in rests
            if j not in around and (_met(contacts, i, j, -1, gap_m) or (into[j] and _clash(contacts, i, j)))
        ]
        supports.append(tuple(j for j in held if j < count))
        beside = _cast_beside(site, contacts, i, gap_m) - {*held, *blocking} if is_brought else set()
        yields.append((*_passed(site, contacts, i, blocking), *sorted(beside)) if is_brought else blocking)
        # If a part runs right through something below it in the model, no gap can be measured.
        overlaps = any(contacts.way_out_m(i, int(j)) is None for j in below)
        grounded.append(on_ground[i] or any(j >= count for j in held) or overlaps)
        if progress is not None:
            progress(i + 1, count)
    touching = tuple(tuple(j for j in contacts.neighbours[i] if j < count) for i in range(count))
    return Precedence(
        tuple(descent),
        tuple(yields),
        _one_way(supports, boxes, site.rules.contact_tolerance_m),
        tuple(grounded),
        touching,
        _wanted(site),
        _holds(site, touching),
    )


def _one_way(
    supports: list[tuple[int, ...]], boxes: NDArray[np.float64], tolerance_m: float
) -> tuple[tuple[int, ...], ...]:
    """Return the supports without those that form cycles (parts that cross or overlap): these only touch.

    A part that is wholly below the underside of another carries it all the same: a plate drawn flush into the top of a
    footing meets it in both directions, but lies on it.
    """
    group = _in_cycles(supports)
    kept = [
        tuple(j for j in below if group[i] != group[j] or boxes[j, 1, 2] <= boxes[i, 0, 2] + tolerance_m + _ROUNDING_M)
        for i, below in enumerate(supports)
    ]
    group = _in_cycles(kept)
    return tuple(tuple(j for j in below if group[i] != group[j]) for i, below in enumerate(kept))


def _in_cycles(after: Sequence[Collection[int]]) -> NDArray[np.int32]:
    """Return per component the number of the cycle that it is in; a number of its own if it is in none."""
    pairs = np.array([(i, j) for i, later in enumerate(after) for j in sorted(later)], np.int64).reshape(-1, 2)
    graph = coo_array((np.ones(len(pairs), np.int8), (pairs[:, 0], pairs[:, 1])), shape=(len(after), len(after)))
    _, group = connected_components(graph.tocsr(), connection="strong")
    return np.asarray(group, np.int32)


def _met(contacts: Contacts, i: int, j: int, direction: int, reach_m: float) -> bool:
    return bool(contacts.meets_on_move(i, np.zeros(3), j, 2, direction, reach_m, 1)[0])


def _clash(contacts: Contacts, i: int, j: int) -> bool:
    """Return whether two solids are drawn into each other in the model."""
    way_m = contacts.way_out_m(i, j)
    return way_m is None or bool(way_m.any())


def _is_made_around(site: Site, contacts: Contacts, i: int, j: int) -> bool:
    """Return whether j is cast or built around i, which lies as low: the topping that is drawn through its planks."""
    if j >= len(site.components) or site.components[j].means not in _MADE_THERE:
        return False
    lowest_m = contacts.bounds_m[i, 0, 2] - site.rules.contact_tolerance_m - _ROUNDING_M
    return bool(contacts.bounds_m[j, 0, 2] >= lowest_m) and _clash(contacts, i, j)


_FLOORS = (Work.SLAB, Work.BEAM)


def _cast_beside(site: Site, contacts: Contacts, i: int, gap_m: float) -> set[int]:
    """Return what is cast into the joints and strips beside a part of a floor: at its height, and no deeper.

    What is deeper may carry it.
    """
    parts, boxes = site.components, contacts.bounds_m
    if kind_of(parts[i]) not in _FLOORS:
        return set()
    low, high = boxes[i]
    near = (boxes[:, 0] < high + gap_m).all(axis=1) & (boxes[:, 1] > low - gap_m).all(axis=1)
    found = set()
    for j in np.flatnonzero(near[: len(parts)]).tolist():
        part, (low_j, high_j) = parts[j], boxes[j, :, 2]
        shared_m = min(high[2], high_j) - max(low[2], low_j)
        is_at_height = shared_m >= 0.5 * min(high[2] - low[2], high_j - low_j) and low_j >= low[2] - gap_m
        if j != i and part.means is Means.IN_SITU and kind_of(part) in _FLOORS and is_at_height:
            ways = ((axis, direction) for axis in (0, 1) for direction in (1, -1))
            if any(contacts.meets_on_move(i, np.zeros(3), j, *way, gap_m, 1)[0] for way in ways):
                found.add(j)
    return found


def _blocks(site: Site, contacts: Contacts, i: int, j: int, foot_m: NDArray[np.float64]) -> bool:
    """Return whether j in place blocks the straight descent of i or the rope above it."""
    if _met(contacts, i, j, 1, FAR_M):
        return True
    return bool(site.cranes) and site.rules.rope and rope_meets(contacts.triangles_m(j), foot_m)


def _passed(site: Site, contacts: Contacts, i: int, blocking: Collection[int]) -> tuple[int, ...]:
    """Return the components that i would pass closer than the tolerance on its straight descent, without blocking it.

    Its neighbours do not count: it may slide along them.
    """
    boxes, gap_m = contacts.bounds_m[: len(site.components)], site.rules.contact_tolerance_m
    low, high = boxes[i]
    near = ((boxes[:, 0, :2] < high[:2] + gap_m) & (boxes[:, 1, :2] > low[:2] - gap_m)).all(axis=1)
    near[[i, *blocking, *(j for j in contacts.neighbours[i] if j < len(near))]] = False
    near &= boxes[:, 1, 2] > low[2]
    return tuple(
        j for j in np.flatnonzero(near).tolist() if contacts.strikes_on_move(i, np.zeros(3), j, 2, 1, FAR_M, 1)[0]
    )


def _hook_foot_m(site: Site, i: int) -> NDArray[np.float64]:
    """Return the foot of the hook line above part i at its place, (3,) metres."""
    component = site.components[i]
    foot = np.add(component.target_vox, component.hook_line_vox) + np.array([0.5, 0.5, 0.0])
    foot_m: NDArray[np.float64] = np.array(site.frame.origin_m) + site.frame.voxel_size_m * foot
    return foot_m


def _wanted(site: Site) -> tuple[tuple[int, ...], ...]:
    numbers = {component.id: component.index for component in site.components}
    earlier: list[set[int]] = [set() for _ in site.components]
    for component in site.components:
        for other, key in [*((o, "after") for o in component.after), *((o, "before") for o in component.before)]:
            if other not in numbers:
                raise InputError(f"component {component.label}: {key} names {other!r}, but the site has no such part")
            if key == "after":
                earlier[component.index].add(numbers[other])
            else:
                earlier[numbers[other]].add(component.index)
    return tuple(tuple(sorted(e)) for e in earlier)


def _holds(site: Site, touching: tuple[tuple[int, ...], ...]) -> tuple[tuple[int, ...], ...]:
    numbers = {component.id: component.index for component in site.components}
    connected = (tuple(sorted(numbers[o] for o in c.hints.connected if o in numbers)) for c in site.components)
    return tuple(named or touched for named, touched in zip(connected, touching, strict=True))


# Disassembly of a group of parts whose straight descents block each other in a cycle.
#
# The parts are taken out of the finished building one by one, after everything that must come after the group. A part
# goes straight up if nothing of the group is in the way, otherwise by the last moves of a lift in reverse, sideways
# too. The reverse is an order in which each part can be set. If none of the remaining parts can be taken out, they are
# interlocked in the model: they are reported, the one that blocks the most others is set last (of equal ones, the one
# on which the least depends), and the others continue.

_TRIES = 400
"""Most searches for lateral moves in one group."""
_NAMED = 8


@dataclass(frozen=True, slots=True)
class _TakenApart:
    """The result of a disassembly.

    Attributes:
        order: The group's components in erection order.
        stuck: The largest set of which none could be taken out while the others were in place; empty if there is none.
        notes: Findings, one sentence each.
    """

    order: tuple[int, ...]
    stuck: tuple[int, ...]
    notes: tuple[str, ...]


class _Disassembly:
    """Takes groups of a site apart. Its obstructions are ignored because they come and go."""

    def __init__(self, site: Site, contacts: Contacts, relations: Precedence) -> None:
        self._site = replace(site, blockers=tuple(b for b in site.blockers if b.kind != "obstruction"))
        self._contacts, self._relations = contacts, relations

    def take_apart(self, group: Sequence[int], firm: Sequence[Collection[int]], later: Collection[int]) -> _TakenApart:
        """Return the erection order of a group.

        Args:
            group: Its components.
            firm: Per component of the site, those that must come after it whatever the path.
            later: Components that must come after the group, so they are not in place yet.
        """
        components, descent = self._site.components, self._relations.descent
        occupancy = Occupancy(self._site)
        in_place = {i for i in range(len(components)) if i not in later}
        for i in in_place:
            occupancy.add(target_cells(components[i]))
        left, reverse, sideways = set(group), [], []
        stuck: tuple[int, ...] = ()
        tries = 0
        refused: dict[int, int] = {}
        while left:
            loose = sorted(i for i in left if left.isdisjoint(firm[i]))
            free = [i for i in loose if left.isdisjoint(descent[i])]
            if free:
                chosen = max(free, key=lambda i: (components[i].target_vox[2], i))
            else:
                chosen = -1
                for i in sorted(loose, key=lambda i: (len(left.intersection(descent[i])), i)):
                    if refused.get(i) == len(left) or tries >= _TRIES:
                        continue
                    tries += 1
                    if self._comes_out(occupancy, i, in_place):
                        chosen = i
                        sideways.append(i)
                        break
                    refused[i] = len(left)
                if chosen < 0:
                    stuck = max(stuck, tuple(sorted(left)), key=len)
                    blocks = {i: sum(i in descent[j] for j in left) for i in left}
                    chosen = min(
                        loose or sorted(left),
                        key=lambda i: (-blocks[i], len(self._relying(i)), len(left.intersection(descent[i])), i),
                    )
            reverse.append(chosen)
            left.remove(chosen)
            in_place.discard(chosen)
            occupancy.remove(target_cells(components[chosen]))
        return _TakenApart(tuple(reversed(reverse)), stuck, self._notes(group, sideways, stuck))

    def _comes_out(self, occupancy: Occupancy, index: int, in_place: set[int]) -> bool:
        component = self._site.components[index]
        occupancy.remove(target_cells(component))
        fixed = range(len(self._site.components), len(self._contacts.solids))
        present, space = (in_place - {index}) | set(fixed), occupancy.space(component)
        part = PartToInsert(self._site, self._contacts, occupancy.counts, component, present, space, space, False)
        found = find_insertion(part)
        occupancy.add(target_cells(component))
        return isinstance(found, Insertion) and not found.enclosed

    def _relying(self, index: int) -> set[int]:
        """Return the parts that rest on a part, directly or through others."""
        result: set[int] = set()
        stack = [index]
        while stack:
            here = stack.pop()
            for i, below in enumerate(self._relations.supports):
                if here in below and i not in result:
                    result.add(i)
                    stack.append(i)
        return result

    def _notes(self, group: Sequence[int], sideways: Sequence[int], stuck: Sequence[int]) -> tuple[str, ...]:
        notes = []
        if sideways:
            notes.append(
                f"the straight descents of {self._named(group)} block each other in a cycle; "
                f"set from the side: {self._named(sideways)}"
            )
        if stuck:
            notes.append(
                f"interlocked in the model: none of {self._named(stuck)} can be set level while the others are in "
                "place; the last of them can be lifted in only if a crew guides it, tilted and aside"
            )
        return tuple(notes)

    def _named(self, group: Sequence[int]) -> str:
        names = [self._site.components[i].label for i in group]
        more = f" and {len(names) - _NAMED} more" if len(names) > _NAMED else ""
        return ", ".join(names[:_NAMED]) + more


# The acyclic graph of precedence: geometry and the site file's ``before`` and ``after``.
#
# Supports, ``before`` and ``after`` always hold. A blocked descent holds too, unless it is part of a cycle. Then the
# parts of the cycle are taken apart in the finished building, with lateral moves if the straight way up is blocked; the
# order is the reverse (see :mod:`bimvox.planning.order.relations`).

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

    Raises SequenceError: if no order satisfies the site file's ``before`` and ``after``; names the cycle.
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
    disassembly = _Disassembly(site, contacts, relations) if groups else None
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
    members: dict[int, list[int]] = {}
    for i, group in enumerate(_in_cycles(edges).tolist()):
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
