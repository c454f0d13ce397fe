"""The search for a faster erection sequence, by plans: a stage of its own between the preparation and the plan.

The local search (``order/faster_order.py``) estimates. Whether a sequence that it finds leaves no lift out, only a plan
tells: of the site as the sequence is made for, without its obstructions, which come and go.
"""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import replace
from functools import partial

from bimvox.planning.contact.pairs import Contacts
from bimvox.planning.order.faster_order import FasterOrder, order_and_yard, travel_of
from bimvox.planning.order.relations import Precedence, order_graph, precedence
from bimvox.planning.order.sequence import Sequencer
from bimvox.planning.order.set_up_choice import set_ups_of
from bimvox.planning.planner import plan_lifts
from bimvox.planning.preparation import Preparation
from bimvox.planning.rollout import GREEDY, proposer
from bimvox.progress import Report
from bimvox.records.lift import LiftPlan, Status
from bimvox.site.site import Site
from bimvox.walk import Store
from bimvox.workers import ALONE, Workers


def prepare(
    site: Site, progress: Report | None = None, workers: Workers = ALONE, store: Store | None = None
) -> Preparation:
    """Return the contacts, the erection sequence and the yard places of a site.

    Args:
        site: The site.
        progress: Called with (stage, done, total).
        workers: Share the work.
        store: What was planned before is not planned again.

    Raises:
        SequenceError: If no order satisfies the site file's ``before`` and ``after``.
    """
    greedy = _prepare_greedily(site, progress or (lambda stage, done, total: None))
    # Several cranes share their time: whether their order is faster, only their motions tell. Of one that moves, the
    # estimate knows nothing.
    found = None if len(site.cranes) > 1 else faster(site, greedy, workers, store=store)
    return greedy if found is None else found[1]


def faster(
    site: Site,
    greedy: Preparation,
    workers: Workers = ALONE,
    free: Collection[str] = (),
    store: Store | None = None,
) -> tuple[Site, Preparation] | None:
    """Return the preparation with a faster sequence by the estimate, which leaves no lift out; None if there is none.

    Args:
        site: The site.
        greedy: Its preparation with the greedy sequence.
        workers: Share the work.
        free: Ids of the components that another crane may lift: the site returned has the crane of each part.
        store: What was planned before is not planned again.
    """
    if not site.cranes or not site.rules.order_search:
        return None
    sequencer = Sequencer(site, greedy.relations, greedy.contacts)
    travels = [travel_of(site, crane) for crane in site.cranes]
    found = FasterOrder(site, sequencer, greedy.relations, travels, free).than(greedy.sequence, greedy.places)
    if found is None:
        return None
    made = replace(greedy, sequence=found.sequence, places=found.places)
    lifts = _settable(plan_without_obstructions(found.site, made, workers, store))
    is_whole = lifts == sum(map(bool, found.places))
    is_whole = is_whole or lifts >= _settable(plan_without_obstructions(site, greedy, workers, store))
    return (found.site, made) if is_whole else None


def _settable(plan: LiftPlan) -> int:
    """Return how many parts can be lifted."""
    return sum(lift.status is Status.PLANNED for lift in plan.lifts)


def plan_without_obstructions(
    site: Site, preparation: Preparation, workers: Workers = ALONE, store: Store | None = None
) -> LiftPlan:
    """Return the plan of a site as its sequence is made for: obstructions come and go."""
    bare = tuple(blocker for blocker in site.blockers if blocker.kind != "obstruction")
    store = Store() if store is None else store
    if len(bare) < len(site.blockers):
        site = store.once(store.key("bare", store.itself(site)), partial(replace, site, blockers=bare))
    # Greedily, as most plans are made: their lifts are found in the store then.
    return plan_lifts(site, preparation, propose=proposer(GREEDY), workers=workers, store=store)


_SET_UP_ROUNDS = 5
"""How often the set-ups are chosen anew without those in which lifts were refused; two or three rounds are usual."""


def prepare_set_ups(
    site: Site,
    free: Collection[str],
    with_cranes: Callable[[Site, dict[int, int]], Site],
    progress: Report | None = None,
    workers: Workers = ALONE,
    store: Store | None = None,
) -> tuple[Site, Preparation]:
    """Return the site of a crane that moves with the set-up of each part, and what is prepared for it.

    The choice knows radii. What else is in the way in a set-up, only a plan tells: a part that it refuses is given to
    another set-up, as long as more lifts are planned.

    Args:
        site: The site.
        free: Ids of the components whose set-up is to be chosen.
        with_cranes: Returns a site with another crane for some components, by their index.
        progress: Called with (stage, done, total).
        workers: Share the work.
        store: What was planned before is not planned again.
    """
    contacts, relations = _met(site, progress or (lambda stage, done, total: None))
    graph, barred = order_graph(site, relations, contacts), set[tuple[int, int]]()
    best: tuple[int, Site, Preparation] | None = None
    for _ in range(_SET_UP_ROUNDS):
        choice = set_ups_of(site, graph, free, barred)
        changed = {n: crane for n, crane in enumerate(choice) if crane != site.components[n].crane}
        chosen = with_cranes(site, changed) if changed else site
        sequence, places = order_and_yard(chosen, Sequencer(chosen, relations, contacts))
        made = Preparation(contacts, relations, sequence, places)
        plan = plan_without_obstructions(chosen, made, workers, store)
        if best is None or _settable(plan) > best[0]:
            best = _settable(plan), chosen, made
        refused = [lift.component for lift in plan.lifts if lift.status is Status.INFEASIBLE]
        more = {(n, choice[n]) for n in refused if site.components[n].id in free} - barred
        if not more:
            break
        barred |= more
    assert best is not None
    return best[1:]


def _met(site: Site, report: Report) -> tuple[Contacts, Precedence]:
    report("contacts", 0, len(site.components))
    contacts = Contacts(site)
    return contacts, precedence(site, contacts, lambda done, total: report("order", done, total))


def _prepare_greedily(site: Site, report: Report) -> Preparation:
    """Return the contacts, a greedy erection sequence and the yard places of a site.

    ``report``: called with (stage, done, total). Raises SequenceError: if no order satisfies the site file's ``before``
    and ``after``.
    """
    contacts, relations = _met(site, report)
    sequence, places = order_and_yard(site, Sequencer(site, relations, contacts))
    return Preparation(contacts, relations, sequence, places)
