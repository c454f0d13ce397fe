"""Lifts searched by several processes at once, before it is known which parts before them are set.

A lift depends on the lifts before it only through which of their parts are in place. That is foretold: all are, except
those that the crane, the yard or a missing support refuses, for which no path is needed. A lift is used only if the
parts before it turned out as foretold; from the first that did not, the rest is searched again.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from bimvox.planning.assembly import Assembly
from bimvox.planning.one_lift import planned_by, unplanned_lift
from bimvox.planning.preparation import Preparation
from bimvox.planning.propose import Propose
from bimvox.progress import Report
from bimvox.records.lift import Lift, Method
from bimvox.site.means import Means
from bimvox.site.site import Site
from bimvox.workers import Workers, in_chunks

_ROUNDS = 3
"""How often lifts are searched ahead; after that they are searched one by one, each where its turn comes."""

_FEW = 16
"""So few lifts are not worth a round."""

Policies = Sequence[tuple[Propose, Method]]


class SearchedAhead:
    """Lifts of a plan that several processes have searched.

    Args:
        site: The site.
        preparation: What was prepared for it.
        policies: The policies to ask.
        workers: The processes; with one alone nothing is searched ahead.
        progress: Called with (stage, done, total).
    """

    def __init__(
        self, site: Site, preparation: Preparation, policies: Policies, workers: Workers, progress: Report | None
    ) -> None:
        self._site, self._preparation, self._policies = site, preparation, tuple(policies)
        self._workers, self._progress = workers, progress
        self._found: dict[int, tuple[Lift, int]] = {}
        self._foretold: tuple[bool, ...] = ()
        self._as_foretold = self._rounds = 0

    def lift(self, number: int, before: Sequence[Lift]) -> Lift | None:
        """Return a lift, None if it must be searched now.

        Args:
            number: Its order.
            before: The lifts before it.
        """
        if self._workers.count == 1:
            return None
        if not self._is_valid(number, before) and self._rounds < _ROUNDS and len(self._order) - number >= _FEW:
            self._search(number, before)
        return self._found[number][0] if self._is_valid(number, before) else None

    @property
    def _order(self) -> Sequence[int]:
        return self._preparation.sequence.order

    def _is_valid(self, number: int, before: Sequence[Lift]) -> bool:
        """Return whether a lift was searched, with the parts before its chunk as they are."""
        if number not in self._found:
            return False
        chunk = self._found[number][1]
        while self._as_foretold < chunk and before[self._as_foretold].is_set == self._foretold[self._as_foretold]:
            self._as_foretold += 1
        return self._as_foretold >= chunk

    def _search(self, first: int, before: Sequence[Lift]) -> None:
        """Search all lifts from one on, in chunks."""
        self._rounds += 1
        self._foretold, self._as_foretold = foretold(self._site, self._preparation, before), first
        searches = LiftSearches(self._site, self._preparation, self._policies, self._foretold)
        chunks = in_chunks(
            [n for n in range(first, len(self._order)) if self._site.components[self._order[n]].means is Means.CRANE],
            self._workers.count,
        )
        with self._workers.knowing(searches):
            found = self._workers.run(LiftSearches.lifts, [(searches, chunk) for chunk in chunks], self._told(chunks))
        self._found = {
            number: (lift, chunk[0])
            for chunk, lifts in zip(chunks, found, strict=True)
            for number, lift in zip(chunk, lifts, strict=True)
        }

    def _told(self, chunks: Sequence[Sequence[int]]) -> Any:
        """Return what tells of finished chunks, as numbers of lifts."""
        total = len(self._order)

        def tell(done: int) -> None:
            if self._progress is not None:
                self._progress("lifts", total * done // len(chunks), total)

        return tell


class LiftSearches:
    """Searches lifts of a plan whose parts are set as foretold; goes through it once if asked in ascending order.

    Args:
        site: The site.
        preparation: What was prepared for it.
        policies: The policies to ask.
        set_before: For every lift, whether its part is set before later ones.
    """

    def __init__(self, site: Site, preparation: Preparation, policies: Policies, set_before: tuple[bool, ...]) -> None:
        self._site, self._preparation, self._policies, self._set_before = site, preparation, policies, set_before
        self._begin()

    def __reduce__(self) -> tuple[Any, ...]:
        """Return how another process begins it anew."""
        return LiftSearches, (self._site, self._preparation, self._policies, self._set_before)

    def lifts(self, numbers: Sequence[int]) -> list[Lift]:
        """Return the lifts of a chunk, in ascending order: within it, parts are set as its own lifts say."""
        self._go_to(numbers[0])
        found = []
        for number in numbers:
            self._pass(number)
            index = self._preparation.sequence.order[number]
            unplanned = unplanned_lift(self._site, index, number, self._preparation.places[index])
            stage = self._assembly.begin(index)
            lift = planned_by(self._assembly, stage, unplanned, None, self._policies)
            self._assembly.finish(index, placed=lift.is_set)
            self._next = number + 1
            self._is_as_foretold &= lift.is_set == self._set_before[number]
            found.append(lift)
        return found

    def _begin(self) -> None:
        self._assembly = Assembly(self._site, self._preparation, one_at_a_time=True)
        self._next = 0
        self._is_as_foretold: bool = True

    def _go_to(self, number: int) -> None:
        """Come to a lift with all parts before it as foretold."""
        if number < self._next or not self._is_as_foretold:
            self._begin()
        self._pass(number)

    def _pass(self, until: int) -> None:
        for number in range(self._next, until):
            index = self._preparation.sequence.order[number]
            if self._site.components[index].means is Means.CRANE:
                self._assembly.skip(index)
            self._assembly.finish(index, placed=self._set_before[number])
        self._next = until


def foretold(site: Site, preparation: Preparation, before: Sequence[Lift]) -> tuple[bool, ...]:
    """Return for every lift whether its part will be set, if every path that is needed is found.

    Args:
        site: The site.
        preparation: What was prepared for it.
        before: The first lifts of the plan, which are known.
    """
    assembly = Assembly(site, preparation)
    found: list[bool] = []
    for number, index in enumerate(preparation.sequence.order):
        is_set = True
        if number < len(before):
            is_set = before[number].is_set
        elif site.components[index].means is Means.CRANE:
            obstacle = assembly.unsupported(index)
            is_set = obstacle is None or (site.rules.by_other_means and not obstacle.is_unsupported)
        assembly.finish(index, placed=is_set)
        found.append(is_set)
    return tuple(found)
