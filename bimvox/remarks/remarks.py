"""All remarks about a plan; also about one from a file, whose values need not make sense."""

from __future__ import annotations

from collections.abc import Collection

from bimvox.proof.values import check_values
from bimvox.records.lift import Lift, LiftPlan
from bimvox.records.motion import LiftMotion
from bimvox.records.proof import Remark, Severity
from bimvox.remarks.conditions import assumptions
from bimvox.remarks.cranes import carried_low, crane_feet, doubtful_mass, high_utilisation, machines, rooms, tails
from bimvox.remarks.parts import densities, floating, guided, held, lorries, overlaps, stated_masses, storage, transport
from bimvox.remarks.rules import earlier, outside, rules
from bimvox.remarks.set_ups import set_ups
from bimvox.remarks.subject import Subject
from bimvox.remarks.tandem import tandem_lifts

_FAMILIES = (
    machines, crane_feet, tails, rooms, set_ups, outside, floating, held, overlaps, densities, stated_masses, transport,
    storage, lorries, carried_low, high_utilisation, doubtful_mass, guided, tandem_lifts, earlier, rules, assumptions,
)  # fmt: skip
"""Every rule, in the order in which its remarks are listed within a severity."""


def remarks_of(plan: LiftPlan, motions: Collection[LiftMotion], context: Collection[Lift] = ()) -> tuple[Remark, ...]:
    """Return the remarks about a plan, the gravest first; the same plan always gives the same ones.

    Each part has at most one remark of a kind. The values of the plan make sense (``bimvox.proof.values``); there
    are no motions without a crane; ``context`` are lifts of the same plan that it does not contain.
    """
    subject = Subject(plan, tuple(motions), tuple(context))
    found = [remark for family in _FAMILIES for remark in family(subject)]
    rank = list(Severity)
    return tuple(sorted(found, key=lambda remark: rank.index(remark.severity)))


def remarks_if_sensible(
    plan: LiftPlan, motions: Collection[LiftMotion], context: Collection[Lift] = ()
) -> tuple[Remark, ...] | None:
    """Return the remarks about a plan; None if its values make no sense, because nothing follows from them."""
    if not check_values(plan, tuple(motions), context).passed:
        return None
    return remarks_of(plan, motions, context)
