"""All remarks about a plan."""

from __future__ import annotations

from collections.abc import Collection

from bimvox.records.lift import Lift, LiftPlan
from bimvox.records.motion import LiftMotion
from bimvox.records.remark import Remark, Severity
from bimvox.remarks.assumptions import assumptions
from bimvox.remarks.carrying import carried_low, doubtful_mass, high_utilisation
from bimvox.remarks.density import density
from bimvox.remarks.earlier import earlier
from bimvox.remarks.floating import floating
from bimvox.remarks.foot import crane_feet
from bimvox.remarks.guided import guided
from bimvox.remarks.machine import machines
from bimvox.remarks.outside import outside
from bimvox.remarks.overlaps import overlaps
from bimvox.remarks.rules import rules
from bimvox.remarks.storage import storage
from bimvox.remarks.subject import Subject
from bimvox.remarks.transport import transport

_FAMILIES = (
    machines, crane_feet, outside, floating, overlaps, density, transport, storage, carried_low, high_utilisation,
    doubtful_mass, guided, earlier, rules, assumptions,
)  # fmt: skip
"""Every rule, in the order in which its remarks are listed within a severity."""


def remarks_of(plan: LiftPlan, motions: Collection[LiftMotion], context: Collection[Lift] = ()) -> tuple[Remark, ...]:
    """Return the remarks about a plan, the gravest first; the same plan always gives the same ones.

    Each part has at most one remark of a kind.

    Args:
        plan: The plan; its values make sense (``bimvox.proof.values``).
        motions: The timed motions of its lifts; empty without a crane.
        context: Lifts of the same plan that it does not contain (it is an extract of a log).
    """
    subject = Subject(plan, tuple(motions), tuple(context))
    found = [remark for family in _FAMILIES for remark in family(subject)]
    rank = list(Severity)
    return tuple(sorted(found, key=lambda remark: rank.index(remark.severity)))
