"""The proof that several cranes on one site keep their distance, and that their lifts wait for each other.

It shares no code with the scheduler. At each time step it computes the poses of the cranes and measures points along
the jib, rope and load of each crane against the other. At every step at which a crane moves, both are stopped: at the
same time, or one a reaction time after the other. The stops are integrated for each axis (``braking``), and the load
swings during braking.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from itertools import combinations
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bimvox.crane.outline import outline_of
from bimvox.crane.tower_crane import TowerCrane
from bimvox.proof.crane.distance import POSE_COLUMNS, least_distances
from bimvox.proof.crane.way import LOOK_NS, STOP_EVERY_NS, CraneWay, Stops, way_of_crane
from bimvox.proof.space import ALWAYS_NS
from bimvox.proof.tandem import as_crane_sees
from bimvox.records.lift import Lift, LiftPlan, Status
from bimvox.records.motion import LiftMotion, PhaseName
from bimvox.records.proof import Check
from bimvox.site.site import Site
from bimvox.workers import ALONE, Workers, in_chunks

REACTION_NS = 1_000_000_000
"""Time from the stop command until braking starts."""
_TOLERANCE_M = 0.1
"""Allowance for the spacing of points and for poses between time steps, which are not compared."""
_AT_ONCE = 200
"""Number of moments whose stops are kept in memory at once."""


def check_cranes(
    check: Check,
    site: Site,
    motions: Sequence[LiftMotion],
    window_ns: tuple[int, int] = ALWAYS_NS,
    *,
    is_whole: bool = True,
    workers: Workers = ALONE,
) -> None:
    """Check that the cranes always keep their distance, whenever one or all of them are stopped.

    Args:
        check: Receives the result; its worst is the separation as a share of the least distance.
        site: The site.
        motions: The motions of all its cranes.
        window_ns: The checked span of the site's clock.
        is_whole: Whether these are all motions: the cranes are then still before and after them. In an extract, only
            times at which both poses are known are checked.
        workers: Share the work.
    """
    by_crane = {
        number: [motion for motion in motions if motion.crane == number]
        for number in sorted({motion.crane for motion in motions})
    }
    for pair in combinations(by_crane, 2):
        shared = frozenset.intersection(*(frozenset(motion.order for motion in by_crane[number]) for number in pair))
        one, other = (way_of_crane(as_crane_sees(site, n), n, by_crane[n], shared) for n in pair)
        both = _Pair(site, one, other, window_ns, is_whole)
        if both.begin_ns >= both.end_ns:
            continue
        check.add(both.undisturbed())
        with workers.knowing(both):
            found = workers.run(_Pair.stopped, [(both, part) for part in in_chunks(both.moments(), workers.count)])
        for part in found:
            check.add(part)


class _Pair:
    """Two cranes."""

    def __init__(self, site: Site, one: CraneWay, other: CraneWay, window_ns: tuple[int, int], is_whole: bool) -> None:
        self.site, self.one, self.other = site, one, other
        begin_ns = min(int(way.time_ns[0]) for way in (one, other))
        end_ns = max(int(way.time_ns[-1]) for way in (one, other))
        self.window_ns, self.is_whole = window_ns, is_whole
        self.begin_ns, self.end_ns = max(begin_ns, window_ns[0]), min(end_ns, window_ns[1])
        self.shapes = _shape(one.crane), _shape(other.crane)
        self.separation_m = site.rules.crane_separation_m
        self.stops: list[Stops] = []

    def __reduce__(self) -> tuple[Any, ...]:
        """Return how another process makes it anew."""
        return _Pair, (self.site, self.one, self.other, self.window_ns, self.is_whole)

    def undisturbed(self) -> Check:
        """Return what the check finds while no crane is stopped."""
        check = Check("cranes")
        time_ns = self._known(np.arange(self.begin_ns, self.end_ns + LOOK_NS, LOOK_NS, dtype=np.int64))
        rows = [way.rows_at(time_ns, way.axes_at(time_ns)) for way in (self.one, self.other)]
        self._look(check, rows[0], rows[1], time_ns, "")
        return check

    def moments(self) -> list[NDArray[np.int64]]:
        """Return the moments at which the cranes are stopped, those whose stops are kept in memory together."""
        moments = self._known(np.arange(self.begin_ns, self.end_ns, STOP_EVERY_NS, dtype=np.int64))
        moments = moments[self.one.moving_at(moments) | self.other.moving_at(moments)]
        return [moments[low : low + _AT_ONCE] for low in range(0, len(moments), _AT_ONCE)]

    def stopped(self, parts: Sequence[NDArray[np.int64]]) -> Check:
        """Return what the check finds if the cranes are stopped at moments."""
        check = Check("cranes")
        self.stops = self.stops or [Stops(way) for way in (self.one, self.other)]
        late = " told to stop, one a reaction time after the other,"
        for part in parts:
            for delays, said in (((0, 0), " told to stop"), ((0, REACTION_NS), late), ((REACTION_NS, 0), late)):
                pairs = [s.rows(part, delay) for s, delay in zip(self.stops, delays, strict=True)]
                count = max(pair.shape[1] for pair in pairs)
                flat = [_held(pair, count).reshape(-1, POSE_COLUMNS) for pair in pairs]
                self._look(check, flat[0], flat[1], np.repeat(part, count), said)
            for one in self.stops:
                one.forget()
        return check

    def _known(self, time_ns: NDArray[np.int64]) -> NDArray[np.int64]:
        """Return the times at which both poses are known."""
        return time_ns[self.one.is_known(time_ns, self.is_whole) & self.other.is_known(time_ns, self.is_whole)]

    def _look(
        self, check: Check, one: NDArray[np.float64], other: NDArray[np.float64], time_ns: NDArray[np.int64], said: str
    ) -> None:
        least_m = least_distances(self.shapes[0], one, self.shapes[1], other, self.separation_m)
        if not len(least_m):
            return
        worst = int(np.argmin(least_m))
        at_ns, nearest_m = int(time_ns[worst]), max(float(least_m[worst]), 0.0)
        first = self.one.drive_at(at_ns), self.other.drive_at(at_ns)
        later = max(first, key=lambda drive: drive.order)
        check.about = self.site.components[later.component].id
        if np.isfinite(nearest_m):
            check.measure(self.separation_m / max(nearest_m, _TOLERANCE_M))
        orders = " and ".join(str(drive.order + 1) for drive in first)
        check.look(
            nearest_m >= self.separation_m - _TOLERANCE_M,
            f"{self.one.crane.name} and {self.other.crane.name}{said} at {at_ns / 1e9:.2f} s (lifts {orders}) come "
            f"within {nearest_m:.2f} m of each other, {self.separation_m:g} m are needed",
            samples=len(least_m),
        )


def _held(series: NDArray[np.float64], count: int) -> NDArray[np.float64]:
    """Return the series, each extended with its last pose to a length of ``count``."""
    return np.concatenate([series, np.repeat(series[:, -1:], count - series.shape[1], axis=1)], axis=1)


def _shape(crane: TowerCrane) -> NDArray[np.float64]:
    """Return the crane's own solids in the form that the distance kernel takes."""
    jib = crane.luffing
    luffing = (0.0, 0.0, 0.0, 0.0) if jib is None else (jib.pivot_offset_m, jib.pivot_height_m, jib.length_m, 1.0)
    return np.array([*outline_of(crane).solids_m, *luffing])


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
