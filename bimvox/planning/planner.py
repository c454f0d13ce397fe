"""The planner: every lift in order, each by what ``bimvox.planning.one_lift`` finds at its turn.

With several processes, lifts are searched before it is known which parts before them are set. A lift depends on the
lifts before it only through which of their parts are in place. That is predicted: all are, except those that the crane,
the yard or a missing support refuses, for which no path is needed. What is found is stored by what it read, so it is
used only where the parts before it turn out as predicted; from the first that does not, the rest is searched again.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

from bimvox.planning.assembly import Assembly
from bimvox.planning.external import External
from bimvox.planning.insertion import Insertion
from bimvox.planning.one_lift import planned_by, policies_of, unplanned_lift, with_planner_note
from bimvox.planning.preparation import Preparation
from bimvox.planning.rounds import OtherWays, Refused
from bimvox.planning.stage import Obstacle, Propose
from bimvox.progress import Report
from bimvox.records.lift import Lift, LiftPlan, Method, not_lifted
from bimvox.site.means import Means
from bimvox.site.site import Site
from bimvox.walk import Store, Walk, at_rest
from bimvox.workers import ALONE, Workers

_ROUNDS = 3
"""How often lifts are searched ahead; after that they are searched one by one, each where its turn comes."""

_FEW = 16
"""So few lifts are not worth a round."""


def plan_lifts(  # noqa: PLR0913 - what refuses and what proposes are inputs of their own
    site: Site,
    preparation: Preparation,
    *,
    propose: Propose | None = None,
    retrained: Propose | None = None,
    refused: Refused | None = None,
    other_ways: OtherWays | None = None,
    progress: Report | None = None,
    workers: Workers = ALONE,
    store: Store | None = None,
) -> LiftPlan:
    """Plan every lift of a site.

    Args:
        site: The site.
        preparation: Contacts, order and yard of its geometry.
        propose: The policy; None for search alone.
        retrained: The policy after more training on this site; asked if the first one fails.
        refused: Components whose lift was planned but not proven, with the reason: they are infeasible.
        other_ways: The last moves that lifts must avoid, because a proof refused them.
        progress: Called with (stage, done, total).
        workers: Share the work.
        store: What was found before is not searched again.

    Returns:
        The plan, infeasible lifts included with their reason.
    """
    store = Store() if store is None else store
    task_of = partial(_task, refused or {}, other_ways or OtherWays())
    order, policies = preparation.sequence.order, tuple(policies_of(propose, retrained))
    lifts: list[Lift] = []
    walk = LiftSearch(site, preparation, policies, passed := [])
    rounds = _ROUNDS if workers.count > 1 and store.is_on else 0
    for number, index in enumerate(order):
        component = site.components[index]
        if component.means is not Means.CRANE:
            lifts.append(not_lifted(component, number))
        else:
            task = task_of(component.id, number)
            key = walk.key(store, task)
            if rounds and not store.has(key) and len(order) - number >= _FEW:
                rounds -= 1
                _search_ahead(walk, task_of, lifts, store, workers, progress)
            lifts.append(store.once(key, lambda task=task: walk.steps([task])[0]))  # type: ignore[misc]
        passed.append(lifts[-1].is_set)
        if progress is not None:
            progress("lifts", number + 1, len(order))
    at_rest(LiftSearch)
    sequence = preparation.sequence
    unheld = tuple(site.components[i].id for i in sequence.unheld)
    return LiftPlan(site, tuple(lifts), preparation.contacts.clashes, sequence.notes, unheld)


class LiftTask(NamedTuple):
    """How a lift is to be found.

    Attributes:
        number: Its order.
        reason: Why it is refused; None if it is not.
        why: Why its first ways were refused; None if none was.
        avoided: The last moves that it must not take.
        unproven: Why the path of a planner that the caller brought was refused; None if it was not. None is asked then.
    """

    number: int
    reason: str | None = None
    why: str | None = None
    avoided: tuple[Insertion, ...] = ()
    unproven: str | None = None


def _task(refused: Refused, other_ways: OtherWays, name: str, number: int) -> LiftTask:
    avoided, why = other_ways.of(name)
    return LiftTask(number, refused.get(name), why, avoided, other_ways.unproven(name))


def _search_ahead(
    walk: LiftSearch,
    task_of: Callable[[str, int], LiftTask],
    before: Sequence[Lift],
    store: Store,
    workers: Workers,
    progress: Report | None,
) -> None:
    """Store the lifts after some, searched by all processes as if the parts before each were set as predicted."""
    site, order = walk.site, walk.preparation.sequence.order
    ahead = LiftSearch(site, walk.preparation, walk.policies, predicted(site, walk.preparation, before))
    parts = [(n, site.components[order[n]]) for n in range(len(before), len(order))]
    tasks = [task_of(part.id, n) for n, part in parts if part.means is Means.CRANE]

    def tell(done: int, of: int) -> None:
        if progress is not None:
            progress("lifts", len(order) * done // of, len(order))

    ahead.results(tasks, store, workers, tell)


@dataclass(frozen=True, eq=False)
class LiftSearch(Walk[Assembly, LiftTask, Lift]):
    """Searches the lifts of a plan.

    Attributes:
        site: The site.
        preparation: What was prepared for it.
        policies: The policies to ask.
        is_set: By order, whether the part is set before later ones: those that are decided, or predicted.
    """

    site: Site
    preparation: Preparation
    policies: tuple[tuple[Propose, Method], ...]
    is_set: Sequence[bool]

    @property
    def passed(self) -> Sequence[bool]:
        """By order, whether the part is set."""
        return self.is_set

    @property
    def roots(self) -> tuple[object, ...]:
        """The site and what was prepared for it."""
        return self.site, self.preparation

    def begin(self) -> Assembly:
        """Return the site before the first lift."""
        return Assembly(self.site, self.preparation, one_at_a_time=True)

    def go_past(self, state: Assembly, turn: int, until: int) -> None:
        """Set the part of a lift, or leave it in the yard."""
        index = self.preparation.sequence.order[turn]
        if self.site.components[index].means is Means.CRANE:
            state.skip(index)
        state.finish(index, placed=self.is_set[turn])

    def turn_of(self, task: LiftTask) -> int:
        """Return the order of the lift."""
        return task.number

    def read(self, task: LiftTask) -> tuple[object, ...]:
        """Return the task and the policies."""
        return task, self.policies

    def step(self, state: Assembly, task: LiftTask) -> Lift:
        """Return a lift."""
        number, reason, why, avoided, unproven = task
        index = self.preparation.sequence.order[number]
        unplanned = unplanned_lift(self.site, index, number, self.preparation.places[index])
        state.keep_heading(index, kept=why is not None)
        stage = state.begin(index, avoided=avoided)
        reason = reason or (why if isinstance(stage, Obstacle) else None)
        policies = self.policies
        if unproven is not None:
            unplanned = with_planner_note(unplanned, unproven)
            policies = tuple(one for one in policies if not isinstance(one[0], External))
        return planned_by(state, stage if reason is None else Obstacle(reason), unplanned, None, policies)


def predicted(site: Site, preparation: Preparation, before: Sequence[Lift]) -> tuple[bool, ...]:
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
