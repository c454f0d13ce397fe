"""What a plan is made from that does not depend on obstructions: contacts, order, yard; the replanner keeps it."""

from __future__ import annotations

from dataclasses import dataclass

from bimvox.planning.contact.pairs import Contacts
from bimvox.planning.order.relations import Precedence, precedence
from bimvox.planning.order.sequence import ErectionSequence
from bimvox.records.lift import LiftPlan, YardPlace


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


def preparation_in(plan: LiftPlan) -> Preparation:
    """Return the inputs of a plan as they are in it: its sequence and its places in the yard."""
    contacts = Contacts(plan.site).listing(plan.clashes)
    lifts, ids = sorted(plan.lifts, key=lambda lift: lift.order), [part.id for part in plan.site.components]
    order, unheld = tuple(lift.component for lift in lifts), tuple(ids.index(name) for name in plan.unheld)
    places = {lift.component: lift.place for lift in lifts}
    sequence = ErectionSequence(order, plan.notes, unheld)
    in_order = tuple(places.get(n) for n in range(len(ids)))
    return Preparation(contacts, precedence(plan.site, contacts), sequence, in_order)
