"""The request for a revision."""

from __future__ import annotations

from dataclasses import dataclass

from bimvox.planning.preparation import Preparation
from bimvox.planning.propose import Propose
from bimvox.revision.current_plan import RetrainedPolicy
from bimvox.site.site import Site
from bimvox.stop.redirect import HOLD_S
from bimvox.workers import ALONE, Workers


@dataclass(frozen=True, slots=True, eq=False)
class RevisionRequest:
    """What to revise a plan for, and how.

    Attributes:
        site: The same site with its current obstructions.
        preparation: What was prepared for it.
        propose: The policy; None for search without a policy.
        first: How many new lifts the first part contains; the rest follows in larger parts. With several cranes there
            is one part.
        now_ns: The time on the site's clock if the plan is being carried out, otherwise None. What was done until then
            stays as driven; a load under way that the change meets is stopped, and continues from where it is.
        hold_s: The shortest time for which a stopped load is held.
        retrained: A policy that was trained further, asked again for some lifts; its paths are taken if they are proven
            and no longer.
        workers: Share the work.
    """

    site: Site
    preparation: Preparation
    propose: Propose | None = None
    first: int = 20
    now_ns: int | None = None
    hold_s: float = HOLD_S
    retrained: RetrainedPolicy | None = None
    workers: Workers = ALONE
