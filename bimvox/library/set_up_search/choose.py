"""The whole search of a site: every machine on every place, other yards, pairs, and which of them are planned."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from bimvox.crane.machine import Machine
from bimvox.errors import InputError
from bimvox.library.set_up_search.front import front_of, proven_front, to_plan
from bimvox.library.set_up_search.pairs import may_pair, pairs
from bimvox.library.set_up_search.placed import PlacedSite
from bimvox.library.set_up_search.refine import better_placed, closer, refined
from bimvox.library.set_up_search.search import Search
from bimvox.library.set_up_search.set_up import Effort, Tried
from bimvox.library.set_up_search.yards import may_move, other_yards
from bimvox.progress import Progress


@dataclass(frozen=True, slots=True, eq=False)
class Searched:
    """What a search found.

    Attributes:
        search: The parts.
        lattice: Every machine with each jib and reeving on its best places.
        found: The same, then those with other yards and those of two cranes.
        front: Those that no other beats, by their estimates.
        chosen: Those to be planned.
        trials: How many other yards were tried.
    """

    search: Search
    lattice: tuple[Tried, ...]
    found: tuple[Tried, ...]
    front: tuple[Tried, ...]
    chosen: tuple[Tried, ...]
    trials: int

    @property
    def rigs(self) -> tuple[Tried, ...]:
        """Every machine with each jib and reeving, once."""
        return tuple(one for one in self.lattice if not one.is_least_used)

    @property
    def tried(self) -> int:
        """Number of set-ups that were estimated."""
        return sum(len(one.bases_m) for one in self.rigs)

    def planned(
        self, documents_of: Callable[[Sequence[Tried]], list[dict[str, Any]]], effort: Effort
    ) -> tuple[list[Tried], list[dict[str, Any]]]:
        """Return what is planned, and the documents of that: the chosen ones, :meth:`instead`, :meth:`around_fastest`.

        Args:
            documents_of: Returns the documents of set-ups, as for ``proven_front``; called with more each time.
            effort: How much is tried.
        """
        tried = list(self.chosen)
        planned = documents_of(tried)
        for more_of in (self.instead, partial(self.around_fastest, tried, effort=effort)):
            if more := more_of(planned):
                tried += more
                planned = documents_of(tried)
        return tried, planned

    def instead(self, planned: Sequence[dict[str, Any]]) -> list[Tried]:
        """Return as many others to plan as chosen ones have no plan, or refuse more parts than another one.

        Args:
            planned: Documents of the chosen set-ups, in their order, as for ``proven_front``.
        """
        fewest = min((one["refused"] for one in planned if one["hours"] is not None), default=0)
        lost = sum(one["hours"] is None or one["refused"] > fewest for one in planned)
        left = [one for one in self.found if one not in self.chosen]
        return to_plan(left, front_of(left), lost)

    def around_fastest(self, tried: Sequence[Tried], planned: Sequence[dict[str, Any]], effort: Effort) -> list[Tried]:
        """Return more to plan around the fastest planned set-up of one crane; see ``refined``.

        Args:
            tried: What was planned.
            planned: Documents of that, as for ``proven_front``.
            effort: How much is tried.
        """
        front = proven_front(planned, self.search.config.costs.budget)
        fastest = next((one for one in front if one["second"] is None), None)
        return [] if fastest is None else refined(self.search, tried[planned.index(fastest)], effort)


def search_set_ups(
    site: PlacedSite, name: str, machines: Sequence[Machine], effort: Effort, folder: Path | None, progress: Progress
) -> Searched:
    """Return what to plan for a site of one crane.

    Args:
        site: The site.
        name: What messages call it.
        machines: The machines.
        effort: How much is tried.
        folder: Where the journal of other yards is kept, so that a killed call is continued; None: in memory.
        progress: Receives the stages.

    Raises:
        InputError: If the site has several cranes or none, no machine serves any part, or all cost more than the
            budget.
    """
    count = len(site.config.cranes)
    if count != 1 or site.config.cranes[0].kind == "none":
        raise InputError(
            f"{name}: the place of one crane is looked for, but the site has {count if count > 1 else 0}",
            hint="give the site file one crane",
        )
    search = Search(site, progress)
    progress.stage("try", len(machines))
    lattice: list[Tried] = []
    for machine in machines:
        lattice += search.tried([machine])
        progress.advance()
    lattice = closer(search, lattice, effort.members)
    progress.finish()
    found, trials = list(lattice), 0
    if effort.yards and may_move(site.config):
        most = max((one.served for one in lattice), default=0)
        able = [machine for machine in machines if search.carries(machine) >= most]
        moved, trials = other_yards(site, search, able, folder, effort, progress)
        found += [better_placed(search, one) if one.served >= most else one for one in moved]
    if effort.cranes > 1 and may_pair(site.config):
        progress.stage("pairs")
        found += pairs(search, machines)
        progress.finish()
    front = front_of(found)
    chosen = to_plan(found, front, effort.members)
    if not chosen and any(one.served for one in found):
        cheapest = min(one.cost for one in found if one.served)
        raise InputError(
            f"{name}: no set-up is within the budget; the cheapest costs {cheapest:,.0f}",
            hint="raise [costs] budget",
        )
    if not chosen:
        raise InputError(
            f"{name}: no machine serves any part", hint="`bimvox cranes SITE` says why; move the yard, or lift less"
        )
    return Searched(search, tuple(lattice), tuple(found), tuple(front), tuple(chosen), trials)
