"""The proof that lifts of several cranes wait for the lifts that they depend on, derived from the phases."""

from __future__ import annotations

from collections.abc import Collection, Sequence

import numpy as np

from bimvox.proof.space import ALWAYS_NS
from bimvox.records.lift import Lift, LiftPlan, Status
from bimvox.records.motion import LiftMotion, PhaseName
from bimvox.records.proof import Check
from bimvox.site.site import Site

_NEAR_M = 3.0
"""Boxes of parts that are nearer than this are next to each other: the props of the one may stand at the other."""


def check_turns(
    check: Check, site: Site, plan: LiftPlan, motions: Sequence[LiftMotion], context: Collection[Lift] = ()
) -> None:
    """Check that the lifts of one crane wait for those of the others.

    A part is hooked on after all previous parts in the order are raised, because they may block it in the yard. It
    reaches its place after all previous parts are at theirs, and after those are released that are next to it: it may
    rest on them, and they are being braced. A delivery waits until all parts of the previous one are set.

    Args:
        check: Receives the result.
        site: The site.
        plan: The plan.
        motions: Its motions.
        context: Lifts of the same plan that it does not contain.
    """
    lifts = {lift.order: lift for lift in (*plan.lifts, *context) if lift.status is Status.PLANNED}
    raised, placed, near = _Latest(), _Latest(), _Near(site)
    delivered: dict[int, _Latest] = {}
    for motion in sorted(motions, key=lambda motion: motion.order):
        if motion.order not in lifts:
            continue
        place = lifts[motion.order].place
        delivery = 0 if place is None else place.delivery
        ends = {phase.name: phase.end_ns for phase in motion.phases}
        check.about = site.components[motion.component].id
        arrives_ns = motion.start_ns + int(motion.loaded.time_ns[-1])
        starts = (p.start_ns for p in motion.phases if p.name in (PhaseName.HOOK_ON, PhaseName.RAISE))
        hooked_ns = next(starts, arrives_ns)
        raised.must_be_over(check, motion.order, "is hooked on", hooked_ns, "is raised")
        placed.must_be_over(check, motion.order, "comes to its place", arrives_ns, "is at its place")
        near.of(motion).must_be_over(
            check, motion.order, "comes to its place", arrives_ns, "next to it stands by itself"
        )
        for earlier, latest in delivered.items():
            if earlier < delivery:
                latest.must_be_over(check, motion.order, "is of a later delivery, hooked on", hooked_ns, "is set")
        raised.take(motion.order, ends.get(PhaseName.RAISE, arrives_ns))
        off_ns = ends.get(PhaseName.RELEASE, ends.get(PhaseName.SET, motion.end_ns))
        placed.take(motion.order, arrives_ns)
        near.take(motion, off_ns)
        delivered.setdefault(delivery, _Latest()).take(motion.order, off_ns)
    check.about = None


class _Latest:
    """Return the lift that reaches a state last."""

    def __init__(self) -> None:
        self.order, self.time_ns = -1, ALWAYS_NS[0]

    def take(self, order: int, time_ns: int) -> None:
        if time_ns >= self.time_ns:
            self.order, self.time_ns = order, time_ns

    def must_be_over(self, check: Check, order: int, does: str, at_ns: int, done: str) -> None:
        check.look(
            at_ns >= self.time_ns,
            f"lift {order + 1} {does} at {at_ns / 1e9:.3f} s, "
            f"before lift {self.order + 1} {done} at {self.time_ns / 1e9:.3f} s",
        )


class _Near:
    """When the parts stand by themselves that are next to a part: near it, connected to it, or before or after it."""

    def __init__(self, site: Site) -> None:
        bounds_m = [component.mesh.bounds_m for component in site.components]
        self._low_m, self._high_m = (np.array([one[n] for one in bounds_m]).reshape(-1, 3) for n in (0, 1))
        numbers = {component.id: component.index for component in site.components}
        self._related = [set[int]() for _ in site.components]
        for component in site.components:
            for other in (*component.hints.connected, *component.before, *component.after):
                if (number := numbers.get(other)) is not None:
                    self._related[component.index].add(number)
                    self._related[number].add(component.index)
        self._released_ns = np.full(len(bounds_m), ALWAYS_NS[0])
        self._orders = np.full(len(bounds_m), -1)

    def take(self, motion: LiftMotion, released_ns: int) -> None:
        self._released_ns[motion.component], self._orders[motion.component] = released_ns, motion.order

    def of(self, motion: LiftMotion) -> _Latest:
        """Return the one of those taken so far that is released last."""
        part = motion.component
        gap_m = np.maximum(self._low_m - self._high_m[part], self._low_m[part] - self._high_m).max(axis=1)
        latest = _Latest()
        for n in {*np.flatnonzero((gap_m < _NEAR_M) & (self._orders >= 0)).tolist(), *self._related[part]}:
            if self._orders[n] >= 0:
                latest.take(int(self._orders[n]), int(self._released_ns[n]))
        return latest
