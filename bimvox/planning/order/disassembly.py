"""Taking a group of parts apart whose straight descents go round in a circle.

In the finished building, without what must come after the group, parts are taken out one by one: straight up where
nothing of the group is in the way, else by the last moves of a lift in reverse, sideways too. The reverse is an order
in which each can be set. Where none of those left can be taken out, they are interlocked as drawn: they are named, the
one on which the least depends is left to be set last, and the others go on.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace

from bimvox.planning.contact.pairs import Contacts
from bimvox.planning.insertion import Insertion, find_insertion
from bimvox.planning.occupancy import Occupancy, target_cells
from bimvox.planning.order.relations import Precedence
from bimvox.site.site import Site

_TRIES = 400
"""Lateral ways looked for in one group at most."""
_NAMED = 8


@dataclass(frozen=True, slots=True)
class TakenApart:
    """A group taken apart.

    Attributes:
        order: Its components in assembly order.
        stuck: The largest set of which none could be taken out while the others stood; empty where there was none.
        notes: What was found, one sentence each.
    """

    order: tuple[int, ...]
    stuck: tuple[int, ...]
    notes: tuple[str, ...]


class Disassembly:
    """Takes groups of a site apart.

    Args:
        site: The site; obstructions come and go, and are not looked at.
        contacts: Its contacts.
        relations: What geometry says.
    """

    def __init__(self, site: Site, contacts: Contacts, relations: Precedence) -> None:
        self._site = replace(site, blockers=tuple(b for b in site.blockers if b.kind != "obstruction"))
        self._contacts, self._relations = contacts, relations

    def take_apart(self, group: Sequence[int], firm: Sequence[Collection[int]], gone: Collection[int]) -> TakenApart:
        """Take a group apart.

        Args:
            group: Its components.
            firm: Per component, those that must come after it whatever the way in (all of the site).
            gone: Components that are not there yet when the group is set: what must come after it.
        """
        components = self._site.components
        occupancy = Occupancy(self._site)
        standing = {i for i in range(len(components)) if i not in gone}
        for i in standing:
            occupancy.add(target_cells(components[i]))
        left, reverse, sideways = set(group), [], []
        stuck: tuple[int, ...] = ()
        tries = 0
        refused: dict[int, int] = {}
        while left:
            loose = sorted(i for i in left if left.isdisjoint(firm[i]))
            free = [i for i in loose if left.isdisjoint(self._relations.descent[i])]
            if free:
                chosen = max(free, key=lambda i: (components[i].target_vox[2], i))
            else:
                chosen = -1
                for i in sorted(loose, key=lambda i: (len(left.intersection(self._relations.descent[i])), i)):
                    if refused.get(i) == len(left) or tries >= _TRIES:
                        continue
                    tries += 1
                    if self._comes_out(occupancy, i, standing):
                        chosen = i
                        sideways.append(i)
                        break
                    refused[i] = len(left)
                if chosen < 0:
                    stuck = max(stuck, tuple(sorted(left)), key=len)
                    chosen = min(
                        loose or sorted(left), key=lambda i: (len(self._relying(i)), len(left & self._in_way(i)), i)
                    )
            reverse.append(chosen)
            left.remove(chosen)
            standing.discard(chosen)
            occupancy.remove(target_cells(components[chosen]))
        return TakenApart(tuple(reversed(reverse)), stuck, self._notes(group, sideways, stuck))

    def _comes_out(self, occupancy: Occupancy, index: int, standing: set[int]) -> bool:
        component = self._site.components[index]
        occupancy.remove(target_cells(component))
        fixed = range(len(self._site.components), len(self._contacts.solids))
        found = find_insertion(
            self._site,
            self._contacts,
            occupancy.counts,
            component,
            occupancy.space(component),
            (standing - {index}) | set(fixed),
        )
        occupancy.add(target_cells(component))
        return isinstance(found, Insertion) and not found.enclosed

    def _in_way(self, index: int) -> set[int]:
        return set(self._relations.descent[index])

    def _relying(self, index: int) -> set[int]:
        """What rests on a part, directly or through others."""
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
                f"{self._named(group)} block each other's straight way down in a circle; "
                f"set sideways: {self._named(sideways)}"
            )
        if stuck:
            notes.append(
                f"interlocked as drawn: none of {self._named(stuck)} can be set while the others of them stand; "
                "the last of them cannot be lifted in"
            )
        return tuple(notes)

    def _named(self, group: Sequence[int]) -> str:
        names = [self._site.components[i].id for i in group]
        more = f" and {len(names) - _NAMED} more" if len(names) > _NAMED else ""
        return ", ".join(names[:_NAMED]) + more
