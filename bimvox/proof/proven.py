"""Lifts and motions that are proven: another plan of the same site with the same ones does not prove them again."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

from bimvox.proof.bodies.triangles import TriangleCheck
from bimvox.proof.moment import Moment, Thing
from bimvox.records.lift import Lift, LiftPlan
from bimvox.records.motion import LiftMotion, Trajectory
from bimvox.records.proof import Check

_Course = tuple[tuple[Trajectory | None, ...], tuple[tuple[object, ...], ...], int]
"""A motion without the time at which it starts: its trajectories, and its phases and its end from its own start."""


class _Then(NamedTuple):
    """What is kept of a moment."""

    lift: Lift
    before: Lift | None
    present: tuple[Thing, ...]
    arrived: frozenset[Thing]


class ProvenLifts:
    """The lifts and motions that passed all of their checks, with everything that these looked at.

    A lift is the same if it is the same object, on the same site with the same modelled clashes, and the same things
    are present. The parts in place are among these, as objects of their own, and are not kept once more: for thousands
    of lifts, sets of thousands of parts would need gigabytes. A motion is the same if it is of the same lift after the
    same lift, and both move in the same way, whenever they start.
    """

    def __init__(self) -> None:
        self._plan: LiftPlan | None = None
        self._triangles: TriangleCheck | None = None
        self._lifts: dict[int, tuple[_Then, frozenset[int], Mapping[str, Check]]] = {}
        self._motions: dict[int, tuple[_Then, _Course, _Course | None, Mapping[str, Check]]] = {}

    def turn_to(self, plan: LiftPlan) -> TriangleCheck:
        """Forget all lifts unless they are of plans of the same site and of the same findings in its model.

        Returns:
            The triangles of the site, with what was measured of them.
        """
        last, self._plan = self._plan, plan
        if last is None or last.site is not plan.site or (last.clashes, last.unheld) != (plan.clashes, plan.unheld):
            self._lifts.clear()
            self._motions.clear()
            self._triangles = TriangleCheck(plan)
        assert self._triangles is not None
        return self._triangles

    def checks_of(self, moment: Moment, not_set: frozenset[int]) -> Mapping[str, Check] | None:
        """Return the checks that a lift passed, None if it is not proven.

        Args:
            moment: The moment before it.
            not_set: The components without a lift that its checks looked at.
        """
        then, not_set_then, checks = self._lifts.get(moment.lift.component, (None, frozenset(), None))
        same = then is not None and _is_same(then, moment) and not_set_then == not_set
        return checks if same else None

    def add(self, moment: Moment, not_set: frozenset[int], checks: Mapping[str, Check]) -> None:
        """Remember a lift if it passed."""
        if all(check.passed for check in checks.values()):
            self._lifts[moment.lift.component] = (self._then(moment), not_set, checks)

    def checks_of_motion(
        self, moment: Moment, motion: LiftMotion, before: LiftMotion | None
    ) -> Mapping[str, Check] | None:
        """Return the checks that the motion of a lift passed, None if it is not proven.

        Args:
            moment: The moment before the lift.
            motion: Its motion.
            before: The motion before it that the checks compared it with.
        """
        then, own, previous, checks = self._motions.get(moment.lift.component, (None, None, None, {}))
        same = (
            then is not None
            and _is_same(then, moment)
            and then.before is moment.before
            and then.arrived == moment.arrived
            and own == _course(motion)
            and previous == (None if before is None else _course(before))
        )
        return checks if same else None

    def add_motion(
        self, moment: Moment, motion: LiftMotion, before: LiftMotion | None, checks: Mapping[str, Check]
    ) -> None:
        """Remember a motion if it passed."""
        if all(check.passed and not check.undecided for check in checks.values()):
            courses = _course(motion), None if before is None else _course(before)
            self._motions[moment.lift.component] = (self._then(moment), *courses, checks)

    def _then(self, moment: Moment) -> _Then:
        """Return what is kept of a moment; a lift and its motion share what is present."""
        present, of_lift = moment.present, self._lifts.get(moment.lift.component)
        if of_lift is not None and of_lift[0].present == present:
            present = of_lift[0].present
        return _Then(moment.lift, moment.before, present, moment.arrived)


def _is_same(then: _Then, now: Moment) -> bool:
    return then.lift is now.lift and then.present == now.present


def _course(motion: LiftMotion) -> _Course:
    phases = tuple((p.name, p.start_ns - motion.start_ns, p.end_ns - motion.start_ns) for p in motion.phases)
    parts = (motion.approach, motion.raising, motion.loaded, motion.departure)
    return parts, phases, motion.end_ns - motion.start_ns
