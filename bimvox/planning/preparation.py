"""What a plan is made from that does not depend on obstructions: contacts, order, yard; the replanner keeps it."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace

from bimvox.kept import kept
from bimvox.planning.contact.pairs import Contacts
from bimvox.planning.order.choose_order import order_and_yard, travel_of
from bimvox.planning.order.faster_order import FasterOrder
from bimvox.planning.order.relations import Precedence, precedence
from bimvox.planning.order.sequence import ErectionSequence, Sequencer
from bimvox.progress import Report
from bimvox.records.lift import LiftPlan, Status, YardPlace
from bimvox.site.site import Site
from bimvox.workers import ALONE, Workers


@dataclass(frozen=True, slots=True, eq=False)
class Preparation:
    """The inputs of a plan that do not depend on obstructions.

    Attributes:
        contacts: Which parts touch, and how deep.
        relations: Which part must be set before which.
        sequence: The erection sequence.
        places: Per component its place in the yard, None if it has none.
    """

    contacts: Contacts
    relations: Precedence
    sequence: ErectionSequence
    places: tuple[YardPlace | None, ...]


def prepare(site: Site, progress: Report | None = None, workers: Workers = ALONE) -> Preparation:
    """Return the contacts, the erection sequence and the yard places of a site.

    Args:
        site: The site.
        progress: Called with (stage, done, total).
        workers: Share the work.

    Raises:
        SequenceError: If no order satisfies the site file's ``before`` and ``after``.
    """
    report = progress or (lambda stage, done, total: None)
    report("contacts", 0, len(site.components))
    contacts = Contacts(site)
    relations = precedence(site, contacts, lambda done, total: report("order", done, total))
    sequence, places = order_and_yard(site, Sequencer(site, relations, contacts))
    greedy = Preparation(contacts, relations, sequence, places)
    # Several cranes share their time: whether their order is faster, only their motions tell.
    found = None if site.has_several_cranes else faster(site, greedy, workers)
    return greedy if found is None else found[1]


def preparation_in(plan: LiftPlan) -> Preparation:
    """Return the inputs of a plan as they are in it: its sequence and its places in the yard."""
    contacts = Contacts(plan.site).listing(plan.clashes)
    lifts, ids = sorted(plan.lifts, key=lambda lift: lift.order), [part.id for part in plan.site.components]
    order, unheld = tuple(lift.component for lift in lifts), tuple(ids.index(name) for name in plan.unheld)
    places = {lift.component: lift.place for lift in lifts}
    sequence = ErectionSequence(order, plan.notes, unheld)
    in_order = tuple(places.get(n) for n in range(len(ids)))
    return Preparation(contacts, precedence(plan.site, contacts), sequence, in_order)


def faster(
    site: Site, greedy: Preparation, workers: Workers = ALONE, free: Collection[str] = ()
) -> tuple[Site, Preparation] | None:
    """Return the preparation with a faster sequence by the estimate, which leaves no lift out; None if there is none.

    Args:
        site: The site.
        greedy: Its preparation with the greedy sequence.
        workers: Share the work.
        free: Ids of the components that another crane may lift: the site returned has the crane of each part.
    """
    if not site.cranes or not site.rules.order_search:
        return None
    sequencer = Sequencer(site, greedy.relations, greedy.contacts)
    travels = [travel_of(site, crane) for crane in site.cranes]
    found = FasterOrder(site, sequencer, greedy.relations, travels, free).than(greedy.sequence, greedy.places)
    if found is None:
        return None
    made = replace(greedy, sequence=found.sequence, places=found.places)
    lifts = _settable(plan_without_obstructions(found.site, made, workers))
    is_whole = lifts == sum(map(bool, found.places))
    is_whole = is_whole or lifts >= _settable(plan_without_obstructions(site, greedy, workers))
    return (found.site, made) if is_whole else None


def _settable(plan: LiftPlan) -> int:
    """Return how many parts can be lifted."""
    return sum(lift.status is Status.PLANNED for lift in plan.lifts)


@kept
def plan_without_obstructions(site: Site, preparation: Preparation, workers: Workers = ALONE) -> LiftPlan:
    """Return the plan of a site as its sequence is made for: obstructions come and go. It is made once."""
    from bimvox.planning.planner import plan_lifts  # it needs this module

    bare = replace(site, blockers=tuple(b for b in site.blockers if b.kind != "obstruction"))
    return plan_lifts(bare, preparation, workers=workers)
