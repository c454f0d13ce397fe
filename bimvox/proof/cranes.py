"""The proof that several cranes on one site never come too near each other, and wait for one another where they must.

By other means than the times were chosen: the cranes are put into their poses moment by moment, and points along jibs,
ropes and loads of each are measured against the other. At every moment at which a crane moves both are stopped: at
once, or one a reaction time after the other; the stops are driven out axis by axis, the load swinging as it is braked.
What has to wait for what is read from the phases.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PchipInterpolator

from bimvox.crane.outline import outline_of
from bimvox.crane.tower_crane import TowerCrane
from bimvox.motion.swing import pendulum_of
from bimvox.proof.crane_distance import POSE_COLUMNS, least_distances, stopping_swing
from bimvox.proof.space import ALWAYS_NS
from bimvox.proof.swing import swung_parts
from bimvox.records.lift import Lift, LiftPlan, Status
from bimvox.records.motion import LiftMotion, PhaseName
from bimvox.records.proof import Check
from bimvox.site.lifting import crane_for
from bimvox.site.site import Site
from bimvox.stop.braking import brake

REACTION_NS = 1_000_000_000
"""From the order to stop until the brakes take hold."""
_LOOK_NS = 250_000_000
_STOP_EVERY_NS = 1_000_000_000
_AT_REST = 1e-6
_TOLERANCE_M = 0.1
"""Points are so far apart, and poses between moments are not looked at."""
_EMPTY_M = 0.5
_AT_ONCE = 200
"""Moments of stops that are held in memory at once."""


def check_turns(
    check: Check, site: Site, plan: LiftPlan, motions: Sequence[LiftMotion], context: Collection[Lift] = ()
) -> None:
    """Check what a lift of one crane waits for from another's.

    Hooking on waits until every part before it in the order is raised, for it may be in the way in the yard; coming to
    its place until every part before it stands by itself, for it may rest on it; a delivery until the one before it is
    set.

    Args:
        check: Where the result goes.
        site: The site.
        plan: The plan.
        motions: Its motions.
        context: Lifts of the same plan that it does not carry.
    """
    lifts = {lift.order: lift for lift in (*plan.lifts, *context) if lift.status is Status.PLANNED}
    raised, stands = _Latest(), _Latest()
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
        stands.must_be_over(check, motion.order, "comes to its place", arrives_ns, "stands by itself")
        for earlier, latest in delivered.items():
            if earlier < delivery:
                latest.must_be_over(check, motion.order, "is of a later delivery, hooked on", hooked_ns, "is set")
        raised.take(motion.order, ends.get(PhaseName.RAISE, arrives_ns))
        off_ns = ends.get(PhaseName.RELEASE, ends.get(PhaseName.SET, motion.end_ns))
        stands.take(motion.order, off_ns)
        delivered.setdefault(delivery, _Latest()).take(motion.order, off_ns)
    check.about = None


class _Latest:
    """The lift of which something comes last."""

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


def check_cranes(
    check: Check,
    site: Site,
    motions: Sequence[LiftMotion],
    window_ns: tuple[int, int] = ALWAYS_NS,
    *,
    is_whole: bool = True,
) -> None:
    """Check that the cranes keep their distance at every moment, whenever one or all of them are stopped.

    Args:
        check: Where the result goes; its worst is the separation as a share of the least distance.
        site: The site.
        motions: The motions of all its cranes.
        window_ns: The time on the site's clock that is looked at.
        is_whole: Whether these are all motions: the cranes then stand before and after them. Of a part of them only the
            times are looked at for which both are known.
    """
    ways = [
        _way_of(site, number, [motion for motion in motions if motion.crane == number])
        for number in sorted({motion.crane for motion in motions})
    ]
    for one, other in combinations(ways, 2):
        _Pair(check, site, one, other, window_ns, is_whole).run()
    check.about = None


class _Hung(NamedTuple):
    """What hangs on a hook from a moment on: edges of its box about the hook on the plan, and how far down it reaches.

    Attributes:
        from_ns: When, on the site's clock.
        box_m: Lowest and highest x, lowest and highest y, from the hook.
        drop_m: From the hook to its lowest.
        below_hook_m: From the hook to its middle, of the pendulum.
    """

    from_ns: int
    box_m: tuple[float, float, float, float]
    drop_m: float
    below_hook_m: float


@dataclass(frozen=True, slots=True, eq=False)
class _Way:
    """One crane over the whole time.

    Attributes:
        crane: The crane.
        motions: Its motions, in order of time.
        time_ns: (N,) when its axes are known.
        axes: (N, 3) slew (rad), radius (m), height (m).
        hung: What hangs on the hook, ascending.
        swing: (2, M) times (ns) and amplitudes (m) of the load.
        looks_at_swing: Whether loads are taken to swing.
    """

    crane: TowerCrane
    motions: tuple[LiftMotion, ...]
    time_ns: NDArray[np.int64]
    axes: NDArray[np.float64]
    hung: tuple[_Hung, ...]
    swing: NDArray[np.float64]
    looks_at_swing: bool

    def moving_at(self, time_ns: NDArray[np.int64]) -> NDArray[np.bool_]:
        """Whether it moves within a second around times."""
        low, high = self.axes_at(time_ns - _STOP_EVERY_NS), self.axes_at(time_ns + _STOP_EVERY_NS)
        now = self.axes_at(time_ns)
        moving: NDArray[np.bool_] = (np.abs(low - now) + np.abs(high - now)).max(axis=1) > _AT_REST
        return moving

    def is_known(self, time_ns: NDArray[np.int64], is_whole: bool) -> NDArray[np.bool_]:
        """Whether it is known at times where the crane is: in its motions; of all of them also before and after."""
        first, last = int(self.time_ns[0]), int(self.time_ns[-1])
        known = ((time_ns < first) | (time_ns > last)) & is_whole
        for motion in self.motions:
            known |= (time_ns >= motion.start_ns) & (time_ns <= motion.end_ns)
        return np.asarray(known, np.bool_)

    def axes_at(self, time_ns: NDArray[np.int64]) -> NDArray[np.float64]:
        """(M, 3) axes at times; the crane stands before and after."""
        return np.stack([np.interp(time_ns, self.time_ns, axis) for axis in self.axes.T], axis=1)

    def rows_at(self, time_ns: NDArray[np.int64], axes: NDArray[np.float64]) -> NDArray[np.float64]:
        """(M, 9) axes, what hangs on the hook then, and how far it swings."""
        at = np.searchsorted([hung.from_ns for hung in self.hung], time_ns, side="right") - 1
        hung = np.array([(*hung.box_m, hung.drop_m) for hung in self.hung])[np.maximum(at, 0)]
        rows = np.empty((len(time_ns), POSE_COLUMNS))
        rows[:, :3], rows[:, 3:8] = axes, hung
        rows[:, 8] = np.interp(time_ns, self.swing[0], self.swing[1]) if self.swing.size else 0.0
        return rows

    def motion_at(self, time_ns: int) -> LiftMotion:
        """The motion at a time, or the nearest before it."""
        return next((m for m in reversed(self.motions) if m.start_ns <= time_ns), self.motions[0])


def _way_of(site: Site, number: int, motions: Sequence[LiftMotion]) -> _Way:
    crane = site.cranes[number]
    motions = sorted(motions, key=lambda motion: motion.start_ns)
    samples = [motion.samples() for motion in motions]
    time_ns = np.concatenate([times for times, _ in samples])
    axes = np.concatenate([values for _, values in samples])
    once = np.concatenate([[True], np.diff(time_ns) > 0])
    empty, size_m = crane_for(site, crane, None), site.frame.voxel_size_m
    loose = ((-_EMPTY_M, _EMPTY_M, -_EMPTY_M, _EMPTY_M), empty.sling_m, empty.sling_m)
    hung = [_Hung(motions[0].start_ns, *loose)]
    swing = []
    for motion in motions:
        component = site.components[motion.component]
        rigged = crane_for(site, crane, component)
        x, y = (n + 0.5 for n in component.hook_offset_vox[:2])
        width, depth, height = component.shape.size_vox
        box_m = (-size_m * x, size_m * (width - x), -size_m * y, size_m * (depth - y))
        height_m = size_m * height
        off_ns = next((p.start_ns for p in motion.phases if p.name is PhaseName.RELEASE), motion.end_ns)
        raised_ns = motion.start_ns + int(motion.raising.time_ns[0])
        load = (rigged.sling_m + height_m, rigged.sling_m + height_m / 2.0)
        hung += [_Hung(raised_ns, box_m, *load), _Hung(off_ns, *loose)]
        for way, part in ((motion.approach, None), (motion.loaded, component), (motion.departure, None)):
            pendulum = pendulum_of(site, crane, part)
            for swung in swung_parts(crane, motion, way, pendulum) if pendulum is not None and way is not None else ():
                at_ns = motion.start_ns + 1e9 * swung.time_s
                swing.append(np.stack([at_ns, swung.amplitude_m]))
                # While it is held it goes on swinging, until it is brought to rest before it goes on.
                held_ns = next((end for begin, end in motion.stops_ns if begin < at_ns[-1] < end), float(at_ns[-1]))
                swing.append(np.array([[held_ns, held_ns + 1.0], [swung.amplitude_m[-1], 0.0]]))
    return _Way(
        crane,
        tuple(motions),
        time_ns[once],
        axes[once],
        tuple(sorted(hung, key=lambda one: one.from_ns)),
        np.concatenate(swing, axis=1) if swing else np.empty((2, 0)),
        pendulum_of(site, crane, None) is not None,
    )


class _Pair:
    """Two cranes."""

    def __init__(
        self, check: Check, site: Site, one: _Way, other: _Way, window_ns: tuple[int, int], is_whole: bool
    ) -> None:
        self.checked, self.site, self.one, self.other = check, site, one, other
        begin_ns = min(int(way.time_ns[0]) for way in (one, other))
        end_ns = max(int(way.time_ns[-1]) for way in (one, other))
        self.begin_ns, self.end_ns = max(begin_ns, window_ns[0]), min(end_ns, window_ns[1])
        self.shapes = _shape(one.crane), _shape(other.crane)
        self.separation_m = site.rules.crane_separation_m
        self.is_whole = is_whole

    def run(self) -> None:
        if self.begin_ns >= self.end_ns:
            return
        time_ns = self._known(np.arange(self.begin_ns, self.end_ns + _LOOK_NS, _LOOK_NS, dtype=np.int64))
        rows = [way.rows_at(time_ns, way.axes_at(time_ns)) for way in (self.one, self.other)]
        self._look(rows[0], rows[1], time_ns, "")
        moments = self._known(np.arange(self.begin_ns, self.end_ns, _STOP_EVERY_NS, dtype=np.int64))
        moments = moments[self.one.moving_at(moments) | self.other.moving_at(moments)]
        stops = [_Stops(way, moments) for way in (self.one, self.other)]
        late = " told to stop, one a reaction time after the other,"
        cases = (((0, 0), " told to stop"), ((0, REACTION_NS), late), ((REACTION_NS, 0), late))
        for low in range(0, len(moments), _AT_ONCE):
            part = moments[low : low + _AT_ONCE]
            for delays, said in cases:
                pairs = [s.rows(part, delay) for s, delay in zip(stops, delays, strict=True)]
                count = max(pair.shape[1] for pair in pairs)
                flat = [_held(pair, count).reshape(-1, POSE_COLUMNS) for pair in pairs]
                self._look(flat[0], flat[1], np.repeat(part, count), said)
            for one in stops:
                one.known.clear()

    def _known(self, time_ns: NDArray[np.int64]) -> NDArray[np.int64]:
        """Those of the times at which it is known where both cranes are."""
        return time_ns[self.one.is_known(time_ns, self.is_whole) & self.other.is_known(time_ns, self.is_whole)]

    def _look(
        self, one: NDArray[np.float64], other: NDArray[np.float64], time_ns: NDArray[np.int64], said: str
    ) -> None:
        least_m = least_distances(self.shapes[0], one, self.shapes[1], other, self.separation_m)
        if not len(least_m):
            return
        worst = int(np.argmin(least_m))
        at_ns, nearest_m = int(time_ns[worst]), max(float(least_m[worst]), 0.0)
        first = self.one.motion_at(at_ns), self.other.motion_at(at_ns)
        later = max(first, key=lambda motion: motion.order)
        self.checked.about = self.site.components[later.component].id
        if np.isfinite(nearest_m):
            self.checked.measure(self.separation_m / max(nearest_m, _TOLERANCE_M))
        orders = " and ".join(str(motion.order) for motion in first)
        self.checked.look(
            nearest_m >= self.separation_m - _TOLERANCE_M,
            f"{self.one.crane.name} and {self.other.crane.name}{said} at {at_ns / 1e9:.2f} s (lifts {orders}) come "
            f"within {nearest_m:.2f} m of each other, {self.separation_m:g} m are needed",
            samples=len(least_m),
        )


class _Stops:
    """How a crane stops from every moment."""

    def __init__(self, way: _Way, moments: NDArray[np.int64]) -> None:
        self.way = way
        seconds = way.time_ns / 1e9
        self.curves = [PchipInterpolator(seconds, axis) for axis in way.axes.T]
        self.slopes = [curve.derivative() for curve in self.curves]
        self.known: dict[int, NDArray[np.float64]] = {}

    def rows(self, moments: NDArray[np.int64], delay_ns: int) -> NDArray[np.float64]:
        """(M, K, 9) poses from each moment on, ``_LOOK_NS`` apart: as planned for the delay, then braking."""
        series = []
        for moment in moments.tolist():
            braking = self._stop(moment + delay_ns)
            ahead = np.arange(moment, moment + delay_ns, _LOOK_NS, dtype=np.int64)
            before = self.way.rows_at(ahead, self.way.axes_at(ahead))
            series.append(np.concatenate([before, braking]))
        count = max(len(one) for one in series)
        return np.stack([np.concatenate([one, np.repeat(one[-1:], count - len(one), axis=0)]) for one in series])

    def _stop(self, at_ns: int) -> NDArray[np.float64]:
        """(K, 9) poses from a moment on to rest."""
        if (known := self.known.get(at_ns)) is not None:
            return known
        way, half_s, at_s = self.way, 0.25, at_ns / 1e9
        low_s, high_s = way.time_ns[0] / 1e9, way.time_ns[-1] / 1e9
        now = way.axes_at(np.array([at_ns]))
        rest = way.rows_at(np.array([at_ns]), now)
        if not low_s < at_s < high_s:
            self.known[at_ns] = rest
            return rest
        limits = way.crane.slewing, way.crane.trolley, way.crane.hoist
        axes = []
        for axis, slope in enumerate(self.slopes):
            before, rate, after = slope(np.clip([at_s - half_s, at_s, at_s + half_s], low_s, high_s)).tolist()
            axes.append(brake(float(now[0, axis]), rate, (after - before) / (2.0 * half_s), limits[axis]))
        longest_s = max(axis.duration_s for axis in axes)
        since_s = np.arange(0.0, longest_s + _LOOK_NS / 1e9, _LOOK_NS / 1e9)
        poses = np.stack([axis.at(since_s) for axis in axes], axis=1)
        rows = np.repeat(rest, len(poses), axis=0)
        rows[:, :3] = poses
        if way.looks_at_swing:
            at = int(np.searchsorted([hung.from_ns for hung in way.hung], at_ns, side="right")) - 1
            below_m = way.hung[max(at, 0)].below_hook_m
            rates = [float(slope(at_s)) for slope in self.slopes]
            rows[:, 8] += stopping_swing(poses, np.array(rates), way.crane.jib_height_m + below_m, _LOOK_NS / 1e9)
        self.known[at_ns] = rows
        return rows


def _held(series: NDArray[np.float64], count: int) -> NDArray[np.float64]:
    """The series, each held at its last pose until they are ``count`` long."""
    return np.concatenate([series, np.repeat(series[:, -1:], count - series.shape[1], axis=1)], axis=1)


def _shape(crane: TowerCrane) -> NDArray[np.float64]:
    """The crane's own solids, as the measuring takes them."""
    jib = crane.luffing
    luffing = (0.0, 0.0, 0.0, 0.0) if jib is None else (jib.pivot_offset_m, jib.pivot_height_m, jib.length_m, 1.0)
    return np.array([*outline_of(crane).solids_m, *luffing])
