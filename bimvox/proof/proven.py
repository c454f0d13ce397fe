"""Lifts that are proven: another plan of the same site that sets them in the same way does not prove them again."""

from __future__ import annotations

from collections.abc import Mapping

from bimvox.proof.moment import Moment
from bimvox.records.lift import LiftPlan
from bimvox.records.proof import Check


class ProvenLifts:
    """The lifts that passed all of their checks, with everything that these looked at.

    A lift is the same if it is the same object, on the same site with the same modelled clashes, the same things are
    present, and the same parts are in place.
    """

    def __init__(self) -> None:
        self._plan: LiftPlan | None = None
        self._lifts: dict[int, tuple[Moment, frozenset[int], Mapping[str, Check]]] = {}

    def turn_to(self, plan: LiftPlan) -> None:
        """Forget all lifts unless they are of plans of the same site and of the same findings in its model."""
        last, self._plan = self._plan, plan
        if last is None or last.site is not plan.site or (last.clashes, last.unheld) != (plan.clashes, plan.unheld):
            self._lifts.clear()

    def checks_of(self, moment: Moment, not_set: frozenset[int]) -> Mapping[str, Check] | None:
        """Return the checks that a lift passed, None if it is not proven.

        Args:
            moment: The moment before it.
            not_set: The components without a lift that its checks looked at.
        """
        then, not_set_then, checks = self._lifts.get(moment.lift.component, (None, frozenset(), None))
        same = (
            then is not None
            and then.lift is moment.lift
            and then.present == moment.present
            and then.placed == moment.placed
            and not_set_then == not_set
        )
        return checks if same else None

    def add(self, moment: Moment, not_set: frozenset[int], checks: Mapping[str, Check]) -> None:
        """Remember a lift if it passed."""
        if all(check.passed for check in checks.values()):
            self._lifts[moment.lift.component] = (moment, not_set, checks)
