"""The pose of one of several cranes at any time, its hung load, and how it brakes and stops from there."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import kernel
from bimvox.crane.tower_crane import AxisLimits, TowerCrane
from bimvox.proof.crane.distance import POSE_COLUMNS, stopping_swing
from bimvox.proof.crane.pendulum import hung_on, swung_parts
from bimvox.records.motion import LiftMotion, PhaseName
from bimvox.site.lifting import crane_for
from bimvox.site.site import Site

# How an axis brakes from any state, computed from its limits alone.
#
# The axis stops as fast as its limits on acceleration and jerk allow: the deceleration grows to a peak, holds, and
# fades to zero. Bisection finds the peak: the highest, up to the limit, at which the braking does not reverse the rate.
# The position is the acceleration's trapezium integrated twice, exactly from corner to corner.

_HALVINGS = 60


def braked(
    position: float, rate: float, acceleration: float, limits: AxisLimits, time_s: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return (N,) the position of an axis at times after braking starts; at rest it stays in place.

    Args:
        position: Position at time 0, in the axis's unit.
        rate: Rate at time 0, unit/s.
        acceleration: Acceleration at time 0, unit/s^2; clipped to the limit.
        limits: The axis's limits.
        time_s: (N,) ascending, 0 or later.
    """
    most, jerk = limits.acceleration, limits.jerk
    acceleration = float(np.clip(acceleration, -most, most))
    corner_s, corner_a = _trapezium(rate, acceleration, most, jerk)
    return np.asarray(_integrated(position, rate, corner_s, corner_a, np.asarray(time_s, np.float64)), np.float64)


def braking_time_s(rate: float, acceleration: float, limits: AxisLimits) -> float:
    """Return how long an axis takes to stop; arguments as for :func:`braked`."""
    acceleration = float(np.clip(acceleration, -limits.acceleration, limits.acceleration))
    return float(_trapezium(rate, acceleration, limits.acceleration, limits.jerk)[0][-1])


@kernel
def _trapezium(
    rate: float, acceleration: float, most: float, jerk: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Corners of the acceleration over time: (4,) seconds and (4,) values, the last one 0."""
    # The rate that remains if the acceleration fades at once determines the braking direction.
    way = 1.0 if rate + acceleration * abs(acceleration) / (2.0 * jerk) >= 0.0 else -1.0
    v, a = way * rate, way * acceleration
    low, high = max(0.0, -a), most
    if _remains(v, a, high, jerk) < 0.0:
        for _ in range(_HALVINGS):
            middle = 0.5 * (low + high)
            if _remains(v, a, middle, jerk) < 0.0:
                high = middle
            else:
                low = middle
        peak = 0.5 * (low + high)
    else:
        peak = high
    held = max(_remains(v, a, peak, jerk), 0.0) / peak if peak > 0.0 else 0.0
    seconds, values = np.zeros(4), np.zeros(4)
    seconds[1] = (a + peak) / jerk
    seconds[2] = seconds[1] + held
    seconds[3] = seconds[2] + peak / jerk
    values[0], values[1], values[2] = acceleration, -way * peak, -way * peak
    return seconds, values


@kernel
def _remains(rate: float, acceleration: float, peak: float, jerk: float) -> float:
    """Return the remaining rate if the deceleration rises to a peak and fades without being held."""
    rising_s, fading_s = (acceleration + peak) / jerk, peak / jerk
    return rate + 0.5 * (acceleration - peak) * rising_s - 0.5 * peak * fading_s


@kernel
def _integrated(
    position: float,
    rate: float,
    corner_s: NDArray[np.float64],
    corner_a: NDArray[np.float64],
    time_s: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Return positions at ascending times for an acceleration that is linear between corners, then constant."""
    reached = np.empty(time_s.shape[0])
    at, v, p = 0, rate, position
    for n in range(time_s.shape[0]):
        while at < 3 and corner_s[at + 1] <= time_s[n]:
            span = corner_s[at + 1] - corner_s[at]
            p += v * span + (2.0 * corner_a[at] + corner_a[at + 1]) * span * span / 6.0
            v += 0.5 * (corner_a[at] + corner_a[at + 1]) * span
            at += 1
        reached[n] = p
        if at < 3:
            since = time_s[n] - corner_s[at]
            slope = (corner_a[at + 1] - corner_a[at]) / (corner_s[at + 1] - corner_s[at])
            reached[n] = p + since * (v + since * (0.5 * corner_a[at] + since * slope / 6.0))
    return reached


LOOK_NS = 250_000_000
"""Time between compared poses."""
STOP_EVERY_NS = 1_000_000_000
"""Time between the moments at which a crane is stopped."""
_AT_REST = 1e-6
_ROPE_M = 0.1
"""Half the width of a rope whose load the other crane carries too: its hook cannot come nearer than the load is."""
_EMPTY_M = 0.5
"""Half the width of the empty hook with its slings."""


class _Hung(NamedTuple):
    """What hangs on a hook from a time on: its box around the hook in plan, and how far down it reaches.

    Attributes:
        from_ns: Start time on the site's clock.
        box_m: Lowest and highest x, lowest and highest y, relative to the hook.
        drop_m: From the hook to its lowest point.
        below_hook_m: From the hook to its middle, for the pendulum.
    """

    from_ns: int
    box_m: tuple[float, float, float, float]
    drop_m: float
    below_hook_m: float


class _Drive(NamedTuple):
    """When a lift is carried out, on the site's clock, its order, and its component."""

    start_ns: int
    end_ns: int
    order: int
    component: int


@dataclass(frozen=True, slots=True, eq=False)
class CraneWay:
    """One crane over the whole time.

    Attributes:
        crane: The crane.
        drives: Its lifts, in order of time.
        time_ns: (N,) times at which its axes are known.
        axes: (N, 3) slew (rad), radius (m), height (m).
        hung: What hangs on the hook, by ascending time.
        swing: (2, M) times (ns) and amplitudes (m) of the load.
        swings: Whether the site's rules include swing.
    """

    crane: TowerCrane
    drives: tuple[_Drive, ...]
    time_ns: NDArray[np.int64]
    axes: NDArray[np.float64]
    hung: tuple[_Hung, ...]
    swing: NDArray[np.float64]
    swings: bool

    def moving_at(self, time_ns: NDArray[np.int64]) -> NDArray[np.bool_]:
        """Return (M,) whether it moves within a second of each time."""
        low, high = self.axes_at(time_ns - STOP_EVERY_NS), self.axes_at(time_ns + STOP_EVERY_NS)
        now = self.axes_at(time_ns)
        moving: NDArray[np.bool_] = (np.abs(low - now) + np.abs(high - now)).max(axis=1) > _AT_REST
        return moving

    def is_known(self, time_ns: NDArray[np.int64], is_whole: bool) -> NDArray[np.bool_]:
        """Return (M,) whether its pose is known: during its motions; if these are all, also outside them."""
        first, last = int(self.time_ns[0]), int(self.time_ns[-1])
        known = ((time_ns < first) | (time_ns > last)) & is_whole
        for drive in self.drives:
            known |= (time_ns >= drive.start_ns) & (time_ns <= drive.end_ns)
        return np.asarray(known, np.bool_)

    def axes_at(self, time_ns: NDArray[np.int64]) -> NDArray[np.float64]:
        """Return (M, 3) axes at times; the crane is still before its first and after its last motion."""
        return np.stack([np.interp(time_ns, self.time_ns, axis) for axis in self.axes.T], axis=1)

    def rows_at(self, time_ns: NDArray[np.int64], axes: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return (M, 9) axes, hung load and swing at times (see ``crane_distance``)."""
        at = np.searchsorted([hung.from_ns for hung in self.hung], time_ns, side="right") - 1
        hung = np.array([(*hung.box_m, hung.drop_m) for hung in self.hung])[np.maximum(at, 0)]
        rows = np.empty((len(time_ns), POSE_COLUMNS))
        rows[:, :3], rows[:, 3:8] = axes, hung
        rows[:, 8] = np.interp(time_ns, self.swing[0], self.swing[1]) if self.swing.size else 0.0
        return rows

    def drive_at(self, time_ns: int) -> _Drive:
        """Return the lift at a time, otherwise the last one before it."""
        return next((one for one in reversed(self.drives) if one.start_ns <= time_ns), self.drives[0])


def way_of_crane(site: Site, number: int, motions: Sequence[LiftMotion], shared: Collection[int] = ()) -> CraneWay:
    """Return the poses of one of a site's cranes over time.

    Args:
        site: The site.
        number: Of the crane in ``Site.cranes``.
        motions: Its motions, at least one.
        shared: Orders of lifts of which only the rope counts, because the other crane carries the load too.
    """
    crane = site.cranes[number]
    motions = sorted(motions, key=lambda motion: motion.start_ns)
    samples = [motion.samples() for motion in motions]
    time_ns = np.concatenate([times for times, _ in samples])
    axes = np.concatenate([values for _, values in samples])
    once = np.concatenate([[True], time_ns[1:] > np.maximum.accumulate(time_ns)[:-1]])  # forged motions may overlap
    swing = [piece for motion in motions for piece in _swing_of(site, crane, motion)]
    return CraneWay(
        crane,
        tuple(_Drive(one.start_ns, one.end_ns, one.order, one.component) for one in motions),
        time_ns[once],
        axes[once],
        _hung_by(site, crane, motions, shared),
        np.concatenate(swing, axis=1) if swing else np.empty((2, 0)),
        hung_on(site, crane, None) is not None,
    )


def _hung_by(
    site: Site, crane: TowerCrane, motions: Sequence[LiftMotion], shared: Collection[int]
) -> tuple[_Hung, ...]:
    """Return what hangs on the hook during motions in order of time: a load from its raising to its release."""
    size_m, empty_m = site.frame.voxel_size_m, crane_for(site, crane, None).sling_m
    loose = ((-_EMPTY_M, _EMPTY_M, -_EMPTY_M, _EMPTY_M), empty_m, empty_m)
    hung = [_Hung(motions[0].start_ns, *loose)]
    for motion in motions:
        component = site.components[motion.component]
        rigged = crane_for(site, crane, component)
        x, y = (n + 0.5 for n in component.hook_line_vox[:2])
        width, depth, height = component.shape.size_vox
        box_m = (-size_m * x, size_m * (width - x), -size_m * y, size_m * (depth - y))
        height_m = size_m * height
        off_ns = next((p.start_ns for p in motion.phases if p.name is PhaseName.RELEASE), motion.end_ns)
        raised_ns = motion.start_ns + int(motion.raising.time_ns[0])
        load = (rigged.sling_m + height_m, rigged.sling_m + height_m / 2.0)
        if motion.order in shared:
            box_m, load = (-_ROPE_M, _ROPE_M, -_ROPE_M, _ROPE_M), (rigged.sling_m, load[1])
        hung += [_Hung(raised_ns, box_m, *load), _Hung(off_ns, *loose)]
    return tuple(sorted(hung, key=lambda one: one.from_ns))


def _swing_of(site: Site, crane: TowerCrane, motion: LiftMotion) -> list[NDArray[np.float64]]:
    """Return (2, K) times (ns) and amplitudes (m), one array for each piece of the motion."""
    component = site.components[motion.component]
    result = []
    for way, load in ((motion.approach, None), (motion.loaded, component), (motion.departure, None)):
        hung = hung_on(site, crane, load)
        if way is None or hung is None:
            continue
        for swung in swung_parts(crane, motion, way, hung):
            at_ns = motion.start_ns + 1e9 * swung.time_s
            result.append(np.stack([at_ns, swung.amplitude_m]))
            # A held load keeps swinging until it is brought to rest before the crane resumes.
            held_ns = next((end for begin, end in motion.stops_ns if begin < at_ns[-1] < end), float(at_ns[-1]))
            result.append(np.array([[held_ns, held_ns + 1.0], [swung.amplitude_m[-1], 0.0]]))
    return result


class Stops:
    """How a crane stops from any moment of its motions."""

    def __init__(self, way: CraneWay) -> None:
        from scipy.interpolate import PchipInterpolator  # takes long to import, and few plans need it

        self.way = way
        seconds = way.time_ns / 1e9
        self._slopes = [PchipInterpolator(seconds, axis).derivative() for axis in way.axes.T]
        self._known: dict[int, NDArray[np.float64]] = {}

    def rows(self, moments: NDArray[np.int64], delay_ns: int) -> NDArray[np.float64]:
        """Return (M, K, 9) poses after each moment, ``LOOK_NS`` apart: as planned for a delay, then braking."""
        ahead = moments[:, None] + np.arange(0, delay_ns, LOOK_NS, dtype=np.int64)
        before = self.way.rows_at(ahead.ravel(), self.way.axes_at(ahead.ravel())).reshape(*ahead.shape, POSE_COLUMNS)
        self._find_stops(moments + delay_ns)
        stops = [self._known[moment] for moment in (moments + delay_ns).tolist()]
        series = [np.concatenate(pair) for pair in zip(before, stops, strict=True)]
        count = max(len(one) for one in series)
        return np.stack([np.concatenate([one, np.repeat(one[-1:], count - len(one), axis=0)]) for one in series])

    def forget(self) -> None:
        """Free the cached stops."""
        self._known.clear()

    def _find_stops(self, moments: NDArray[np.int64]) -> None:
        """Find those stops that are not known yet."""
        new = np.array([moment for moment in moments.tolist() if moment not in self._known], np.int64)
        if not len(new):
            return
        way, half_s, at_s = self.way, 0.25, new / 1e9
        low_s, high_s = way.time_ns[0] / 1e9, way.time_ns[-1] / 1e9
        now = way.axes_at(new)
        rest = way.rows_at(new, now)
        around_s = np.clip(at_s[:, None] + [-half_s, 0.0, half_s], low_s, high_s)
        slopes = np.stack([slope(around_s) for slope in self._slopes], axis=1)
        for n, (at_ns, before, rates, after) in enumerate(zip(new.tolist(), *np.moveaxis(slopes, 2, 0), strict=True)):
            known = rest[n : n + 1]
            if low_s < at_s[n] < high_s:
                states = list(zip(rates.tolist(), ((after - before) / (2.0 * half_s)).tolist(), strict=True))
                known = self._stop(at_ns, now[n], known, states)
            self._known[at_ns] = known

    def _stop(
        self, at_ns: int, now: NDArray[np.float64], rest: NDArray[np.float64], states: list[tuple[float, float]]
    ) -> NDArray[np.float64]:
        """Return (K, 9) poses from a moment until the crane is at rest, given its axes, pose, and (rate, change)."""
        way = self.way
        limits = way.crane.slewing, way.crane.trolley, way.crane.hoist
        longest_s = max(braking_time_s(*state, limit) for state, limit in zip(states, limits, strict=True))
        since_s = np.arange(0.0, longest_s + LOOK_NS / 1e9, LOOK_NS / 1e9)
        poses = np.stack([braked(float(now[k]), *states[k], limits[k], since_s) for k in range(3)], axis=1)
        rows = np.repeat(rest, len(poses), axis=0)
        rows[:, :3] = poses
        if way.swings:
            at = int(np.searchsorted([hung.from_ns for hung in way.hung], at_ns, side="right")) - 1
            below_m = way.hung[max(at, 0)].below_hook_m
            rates = np.array([rate for rate, _ in states])
            rows[:, 8] += stopping_swing(poses, rates, way.crane.jib_height_m + below_m, LOOK_NS / 1e9)
        return rows
