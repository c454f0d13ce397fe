"""Which corrections of the site file select a group of products of an IFC file."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from bimvox.bim.ifc.answer import Selected
from bimvox.bim.ifc.assembly import Group
from bimvox.bim.kinds.correction import UNTOUCHED, Corrected, Correction, all_of, refused, unmatched
from bimvox.errors import NothingSelectedError, SelectionError


class ProductCorrections:
    """The corrections of one file.

    Args:
        corrections: As the site file has them.
        select_each: Returns the step ids that queries match, or the errors about them.

    Raises:
        SelectionError: If a query is malformed; names its place in the file.
    """

    def __init__(
        self,
        corrections: Sequence[Correction] = (),
        select_each: Callable[[Sequence[str]], Sequence[Selected]] = lambda queries: (),
    ) -> None:
        self._corrections = corrections
        self._matched: set[Correction] = set()
        by_query = [one for one in corrections if not one.one_part]
        self._ids: dict[Correction, frozenset[int]] = {}
        for correction, found in zip(by_query, select_each([one.select for one in by_query]), strict=True):
            if isinstance(found, SelectionError) and not isinstance(found, NothingSelectedError):
                raise refused(correction, found)
            self._ids[correction] = frozenset() if isinstance(found, SelectionError) else found

    @property
    def step_ids(self) -> frozenset[int]:
        """The products that the queries match."""
        return frozenset().union(*self._ids.values())

    def of(self, group: Group, owner: Any) -> Corrected:
        """Return what the corrections say of a group: those that select its owner, an ancestor, or all its members."""
        if not self._corrections:
            return UNTOUCHED
        above, members = {group.owner, *group.ancestors}, frozenset(group.members)
        names = (str(owner.GlobalId), f"{owner.GlobalId}#{group.owner}")
        found = [
            one
            for one in self._corrections
            if (
                one.select in names
                if one.one_part
                else not above.isdisjoint(self._ids[one]) or members <= self._ids[one]
            )
        ]
        self._matched.update(found)
        return all_of(found)

    def notes(self) -> list[str]:
        """Return a note about each correction of types that has selected nothing."""
        return unmatched([one for one in self._corrections if not one.one_part], self._matched.__contains__)


NO_CORRECTIONS = ProductCorrections()
