"""Disassembly of a group of parts whose straight descents block each other in a cycle.

The parts are taken out of the finished building one by one, after everything that must come after the group. A part
goes straight up if nothing of the group is in the way, otherwise by the last moves of a lift in reverse, sideways too.
The reverse is an order in which each part can be set. If none of the remaining parts can be taken out, they are
interlocked in the model: they are reported, the one that blocks the most others is set last (of equal ones, the one on
which the least depends), and the others continue.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace

from bimvox.planning.contact.pairs import Contacts
from bimvox.planning.insertion import Insertion, PartToInsert, find_insertion
from bimvox.planning.occupancy import Occupancy, target_cells
from bimvox.planning.order.relations import Precedence
from bimvox.site.site import Site

_TRIES = 400
"""Most searches for lateral moves in one group."""
_NAMED = 8


@dataclass(frozen=True, slots=True)
class TakenApart:
    """The result of a disassembly.

    Attributes:
        order: The group's components in erection order.
        stuck: The largest set of which none could be taken out while the others were in place; empty if there is none.
        notes: Findings, one sentence each.
    """

    order: tuple[int, ...]
    stuck: tuple[int, ...]
    notes: tuple[str, ...]


class Disassembly:
    """Takes groups of a site apart. Its obstructions are ignored because they come and go."""

    def __init__(self, site: Site, contacts: Contacts, relations: Precedence) -> None:
        self._site = replace(site, blockers=tuple(b for b in site.blockers if b.kind != "obstruction"))
        self._contacts, self._relations = contacts, relations

    def take_apart(self, group: Sequence[int], firm: Sequence[Collection[int]], later: Collection[int]) -> TakenApart:
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
        return TakenApart(tuple(reversed(reverse)), stuck, self._notes(group, sideways, stuck))

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
        found: set[int] = set()
        stack = [index]
        while stack:
            here = stack.pop()
            for i, below in enumerate(self._relations.supports):
                if here in below and i not in found:
                    found.add(i)
                    stack.append(i)
        return found

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
