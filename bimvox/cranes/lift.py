"""One lift of one of several cranes before it is scheduled: its carry, its legs, and the bounds of its crane then."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import kernel
from bimvox.crane.conflict import (
    COLUMNS,
    HOOK_HIGH,
    HOOK_LOW,
    LOAD_HALF,
    LOWEST,
    RADIUS_HIGH,
    RADIUS_LOW,
    ROPE_HALF,
    SLEW_HIGH,
    SLEW_LOW,
    SPAN_NS,
    CraneTrack,
    joined,
)
from bimvox.crane.tower_crane import TowerCrane
from bimvox.errors import MotionError
from bimvox.kept import kept
from bimvox.motion.swept import HookEnd, in_cell
from bimvox.motion.swing import (
    GRAVITY_M_S2,
    STEP_S,
    Pendulum,
    pendulum_lengths_m,
    pendulum_of,
    pendulum_on,
    swing_of,
)
from bimvox.records.lift import Lift
from bimvox.records.motion import LiftMotion, PhaseName, Trajectory
from bimvox.site.collision import HOOK_FORBIDDEN, CollisionSpace
from bimvox.site.component import Component
from bimvox.site.lifting import crane_for
from bimvox.site.site import Site
from bimvox.site.tandem import ROPE_HALF_M
from bimvox.stop.brake_axes import braking_distances
from bimvox.units import NS_PER_S

REST_NS = NS_PER_S
"""Between two legs of an empty hook."""


class HookError(MotionError):
    """The empty hook has no free path to a part."""


class NoFreeTimeError(MotionError):
    """A crane has no free time for a lift alongside the others, or for several lifts.

    Args:
        component: The part of the first one.
        message: Why it has none.
        hint: What to do about it.
        more: Messages for the other parts, by component.
    """

    def __init__(
        self, component: str, message: str, *, hint: str | None = None, more: Mapping[str, str] | None = None
    ) -> None:
        super().__init__(component, message, hint=hint)
        self._more = {} if more is None else {part: f"{part}: {why}" for part, why in more.items()}

    @property
    def reasons(self) -> Mapping[str, str]:
        """The message by component."""
        return {**super().reasons, **self._more}


@dataclass(frozen=True, slots=True, eq=False)
class Leg:
    """A leg of the empty hook: a move from rest to rest.

    Attributes:
        trajectory: Its samples, from 0.
        before: Orders of the lifts of other cranes that must not be set before the hook has passed.
        last: Whether it starts only after every earlier lift of the sequence has ended.
    """

    trajectory: Trajectory
    before: frozenset[int] = frozenset()
    last: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class Parking:
    """A place where the empty hook waits.

    Attributes:
        aside: The leg to it; None if the crane starts there.
        back: The leg from it to the part.
        across: Legs from it to each of the lift's parking places, in their order, the fastest first.
    """

    aside: Leg | None
    back: Leg
    across: tuple[tuple[Leg, ...], ...] = ()


@dataclass(frozen=True, slots=True, eq=False)
class Carried:
    """A lift of one of several cranes, as far as the empty hooks depend on it.

    Attributes:
        lift: The lift.
        crane: Number of its crane.
        track: Where the crane may be during the carry.
        hooked_rad: Slewing angle at which its part is hooked on.
        left_rad: Slewing angle at which its slings are off.
        other: Number of the crane that carries the part together with it; None if it does so alone.
    """

    lift: Lift
    crane: int
    track: CraneTrack
    hooked_rad: float
    left_rad: float
    other: int | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Legs:
    """The legs of the empty hook to a part, and after a crane's last lift from it.

    Attributes:
        early: See ``CraneLift``.
        late: See ``CraneLift``.
        parkings: See ``CraneLift``.
        hooked_rad: Slewing angle at which they end, and the part is hooked on.
        starts_there: See ``CraneLift``.
        leaves: See ``CraneLift``; from where the carry ends if its part is hooked on as in ``Carried``.
    """

    early: Leg | None
    late: Leg | None
    parkings: tuple[Parking, ...]
    hooked_rad: float
    starts_there: bool = True
    leaves: tuple[Leg, ...] = ()


@dataclass(frozen=True, slots=True, eq=False)
class CraneLift:
    """One lift of one crane before it is scheduled.

    Attributes:
        lift: The lift.
        crane: Number of its crane.
        carry: From hook on to slings off, from 0.
        early: The early leg (see ``lifts``); None if there is none, or the crane has no earlier lift.
        late: The late leg; None likewise.
        parkings: Legs to a parking place and back, best first.
        track: Where the crane may be during the carry.
        leaves: Legs to a parking place after the crane's last lift.
        starts_there: Whether the crane can wait over the part from the start of the clock.
        every_parking: Makes all parking places that can be found, these first, with legs between them.
        other: Number of the crane that carries the part together with it; None if it does so alone.
        is_second: Whether it is the second crane of a part that two carry.
    """

    lift: Lift
    crane: int
    carry: LiftMotion
    early: Leg | None
    late: Leg | None
    parkings: tuple[Parking, ...]
    track: CraneTrack
    leaves: tuple[Leg, ...] = ()
    starts_there: bool = True
    every_parking: Callable[[], tuple[Parking, ...]] | None = None
    other: int | None = None
    is_second: bool = False


# Where a crane may be during a lift and where it waits, for its separation from others: bounds that include braking.
#
# A stop may be ordered at every sample. The crane then continues for the reaction time, as planned or at its current
# speed, whichever leads further, and every axis brakes as fast as its acceleration and jerk allow. The bounds of the
# spans around the sample contain all of this motion. The load swings as in its proof, plus what braking adds: a
# deceleration a adds at most 2 a l / g on a rope of length l, and at most v sqrt(l / g), as if the speed v were lost at
# once.

REACTION_S = 1.0
"""From the order to stop until the brakes act; until then the crane continues."""

EMPTY_HALF_M = 0.5
"""Radius of the disc that contains hook block and slings."""
_ROPE_HALF_M = 0.1


class _Hung(NamedTuple):
    """The load on the hook.

    Attributes:
        half_m: Radius of the disc about the hook that contains it in plan view.
        drop_m: From the hook down to its lowest point.
        pendulum: How it swings; None if swing is ignored.
    """

    half_m: float
    drop_m: float
    pendulum: Pendulum | None


def standing_track(site: Site, crane: TowerCrane, axes: NDArray[np.float64]) -> CraneTrack:
    """Return the track of a crane at rest with an empty hook at a pose ((3,) slew, radius, height)."""
    row = _rows(axes[None], axes[None], _empty(site, crane), np.zeros(1))
    return CraneTrack(0, row, row[0], row[0])


def approach_track(site: Site, crane: TowerCrane, approach: Trajectory, start_ns: int) -> CraneTrack:
    """Return where a crane may be while its empty hook moves to a part, from ``start_ns`` on the site's clock."""
    return _track(
        crane_for(site, crane, None), _empty(site, crane), approach.time_ns + np.int64(start_ns), approach.axes
    )


def carrying_track(
    site: Site, crane: TowerCrane, lift: Lift, motion: LiftMotion, since_ns: int | None = None
) -> CraneTrack:
    """Return where a crane may be from hook-on until the slings are off; its approach and any wait are left out.

    If the load was stopped and held, it hangs at rest when it continues. If ``since_ns`` is given, the track begins
    then, with the crane at rest.
    """
    component, time_ns, axes = site.components[lift.component], *motion.samples()
    raised_ns, carried_ns = (motion.start_ns + int(part.time_ns[0]) for part in (motion.raising, motion.loaded))
    starts = {phase.name: phase.start_ns for phase in motion.phases}
    hooked_ns = starts.get(PhaseName.HOOK_ON, raised_ns)
    off_ns, ends_ns = starts.get(PhaseName.RELEASE, motion.end_ns), motion.end_ns
    if motion.departure is not None:
        ends_ns = motion.released_ns
    rests_ns = [end_ns for _, end_ns in motion.stops_ns if carried_ns < end_ns < off_ns]
    empty, rigged = crane_for(site, crane, None), crane_for(site, crane, component)
    loose = _empty(site, crane)
    pieces = (
        (empty, loose, hooked_ns, raised_ns),
        (rigged, _raised(site, rigged, component, lift), raised_ns, carried_ns),
        *(
            (rigged, _hanging(site, rigged, component), from_ns, until_ns)
            for from_ns, until_ns in pairwise([carried_ns, *rests_ns, off_ns])
        ),
        (empty, loose, off_ns, ends_ns),
    )
    first_ns = hooked_ns if since_ns is None else since_ns
    return joined(
        [
            _track(machine, hung, *_between(time_ns, axes, max(from_ns, first_ns), until_ns))
            for machine, hung, from_ns, until_ns in pieces
            if until_ns > max(from_ns, first_ns)
        ]
    )


def bare_track(site: Site, crane: TowerCrane, component: Component, motion: LiftMotion) -> CraneTrack:
    """Return where a crane may be during a lift, from hook-on on, without the load, whose swing its rope follows.

    The load that two cranes share is no obstacle for the other one, nor is the other hook; jibs and ropes are.

    ``component``: the part as the crane sees it.
    """
    rigged = crane_for(site, crane, component)
    rope = _Hung(ROPE_HALF_M, rigged.sling_m, pendulum_on(site, rigged, component))
    return _track(rigged, rope, *motion.samples())


def _empty(site: Site, crane: TowerCrane) -> _Hung:
    sling_m = crane_for(site, crane, None).sling_m
    return _Hung(EMPTY_HALF_M, sling_m, pendulum_of(site, crane, None))


def _hanging(site: Site, rigged: TowerCrane, component: Component) -> _Hung:
    """Return the part upright, its hook line above its centre of mass."""
    size_m, at = site.frame.voxel_size_m, np.array(component.hook_line_vox[:2]) + 0.5
    width = np.array(component.shape.size_vox[:2])
    half_m = size_m * float(np.hypot(*np.maximum(at, width - at)))
    height_m = size_m * component.shape.size_vox[2]
    return _Hung(half_m, rigged.sling_m + height_m, pendulum_on(site, rigged, component))


def _raised(site: Site, rigged: TowerCrane, component: Component, lift: Lift) -> _Hung:
    """Return the part during upending and turning: it stays within its diagonals about the hook."""
    upright = _hanging(site, rigged, component)
    if lift.place is None:
        return upright
    stored_m = site.frame.voxel_size_m * lift.place.reach_vox(component)
    return upright._replace(half_m=max(upright.half_m, stored_m))


def _between(
    time_ns: NDArray[np.int64], axes: NDArray[np.float64], from_ns: int, until_ns: int
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Return the samples in a span of the clock, with one at each end."""
    inside = (time_ns > from_ns) & (time_ns < until_ns)
    ends = np.array([from_ns, until_ns], np.int64)
    at_ends = np.stack([np.interp(ends, time_ns, axis) for axis in axes.T], axis=1)
    times = np.concatenate([ends[:1], time_ns[inside], ends[1:]])
    return times, np.concatenate([at_ends[:1], axes[inside], at_ends[1:]])


def _track(crane: TowerCrane, hung: _Hung, time_ns: NDArray[np.int64], axes: NDArray[np.float64]) -> CraneTrack:
    """Return the bounds of one series of samples that starts and ends at rest."""
    time_s = (time_ns - time_ns[0]) / NS_PER_S
    rate, acceleration = _derivatives(time_s, axes)
    low, high = axes.copy(), axes.copy()
    for axis, limits in enumerate((crane.slewing, crane.trolley, crane.hoist)):
        x, v = axes[:, axis], rate[:, axis]
        a = np.clip(acceleration[:, axis], -limits.acceleration, limits.acceleration)
        reacted = v * REACTION_S
        for first, distances in (
            (x, braking_distances(v, _around(a, np.minimum), limits)),
            (x, braking_distances(v, _around(a, np.maximum), limits)),
            (x + reacted, braking_distances(v, np.zeros_like(v), limits)),
        ):
            low[:, axis] = np.minimum(low[:, axis], first + distances[0])
            high[:, axis] = np.maximum(high[:, axis], first + distances[1])
    rows = _rows(low, high, hung, _swing_m(crane, hung, time_s, axes, rate))
    count = max(1, -(-int(time_ns[-1] - time_ns[0]) // SPAN_NS))
    begins = time_ns[0] + SPAN_NS * np.arange(count)
    ends = begins + SPAN_NS + round(REACTION_S * NS_PER_S)
    first = np.maximum(np.searchsorted(time_ns, begins, side="right") - 1, 0)
    last = np.minimum(np.searchsorted(time_ns, ends, side="left"), len(time_ns) - 1)
    low_columns = np.isin(np.arange(COLUMNS), (SLEW_LOW, RADIUS_LOW, LOWEST, HOOK_LOW))
    spans = _hulls(rows, first.astype(np.int64), last.astype(np.int64), low_columns)
    return CraneTrack(int(time_ns[0]), spans, rows[0], rows[-1])


def _rows(
    low: NDArray[np.float64], high: NDArray[np.float64], hung: _Hung, swing_m: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return (N, 9) rows of a track from (N, 3) the lowest and highest axes and (N,) how far the load swings."""
    rows = np.empty((len(low), COLUMNS))
    rows[:, SLEW_LOW], rows[:, SLEW_HIGH] = low[:, 0], high[:, 0]
    rows[:, RADIUS_LOW], rows[:, RADIUS_HIGH] = np.maximum(low[:, 1], 0.0), high[:, 1]
    rows[:, HOOK_LOW], rows[:, HOOK_HIGH] = low[:, 2], high[:, 2]
    rows[:, LOWEST] = low[:, 2] - hung.drop_m
    rows[:, LOAD_HALF], rows[:, ROPE_HALF] = hung.half_m + swing_m, _ROPE_HALF_M + swing_m
    return rows


def _derivatives(
    time_s: NDArray[np.float64], axes: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return (N, 3) rates at the samples, 0 at both ends, and the accelerations from each to the next."""
    rate = np.zeros_like(axes)
    if len(time_s) > 2:
        h = np.diff(time_s)[:, None]
        rise = np.diff(axes, axis=0) / h
        rate[1:-1] = (h[1:] * rise[:-1] + h[:-1] * rise[1:]) / (h[1:] + h[:-1])
        # Next to a standstill the rate of the axis is 0.
        rate[1:-1] = np.where((rise[:-1] == 0.0) | (rise[1:] == 0.0), 0.0, rate[1:-1])
    acceleration = np.zeros_like(axes)
    if len(time_s) > 1:
        acceleration[:-1] = np.diff(rate, axis=0) / np.diff(time_s)[:, None]
    return rate, acceleration


def _around(values: NDArray[np.float64], extreme: np.ufunc) -> NDArray[np.float64]:
    """Return the extreme of every value and the one before it."""
    around: NDArray[np.float64] = extreme(values, np.concatenate([values[:1], values[:-1]]))
    return around


def _swing_m(
    crane: TowerCrane, hung: _Hung, time_s: NDArray[np.float64], axes: NDArray[np.float64], rate: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return (N,) how far the load may swing out, both during the motion and when the crane is stopped."""
    if hung.pendulum is None or time_s[-1] <= 0.0:
        return np.zeros(len(time_s))
    at_s = np.linspace(0.0, time_s[-1], int(np.ceil(time_s[-1] / STEP_S)) + 1)
    even = np.stack([np.interp(at_s, time_s, axis) for axis in axes.T], axis=1)
    swing = swing_of(crane, even, float(at_s[1] - at_s[0]), hung.pendulum)
    own_m = np.interp(time_s, at_s, swing.amplitude_m)
    length_m = pendulum_lengths_m(crane, axes, hung.pendulum.below_hook_m)
    pulse = np.sqrt(GRAVITY_M_S2 / length_m)
    across_m_s = np.abs(rate[:, 0]) * axes[:, 1]
    across_m = np.minimum(across_m_s / pulse, 2.0 * crane.slewing.acceleration * axes[:, 1] / pulse**2)
    along_m = np.minimum(np.abs(rate[:, 1]) / pulse, 2.0 * crane.trolley.acceleration / pulse**2)
    whole: NDArray[np.float64] = own_m + np.hypot(across_m, along_m)
    return whole


@kernel
def _hulls(
    rows: NDArray[np.float64], first: NDArray[np.int64], last: NDArray[np.int64], is_low: NDArray[np.bool_]
) -> NDArray[np.float64]:
    """Return (M, C) the extremes of rows ``first[m]`` to ``last[m]``, both included."""
    spans = np.empty((first.shape[0], rows.shape[1]))
    for m in range(first.shape[0]):
        spans[m] = rows[first[m]]
        for n in range(first[m] + 1, last[m] + 1):
            for c in range(rows.shape[1]):
                value = rows[n, c]
                if (value < spans[m, c]) if is_low[c] else (value > spans[m, c]):
                    spans[m, c] = value
    return spans


KEPT_PARKINGS = 5
"""Places at which an empty hook may wait for a lift: so many are tried."""
_SECTORS = 24
_SHARES = (0.0, 0.5)
"""Where the hook may wait in a sector, as shares of its columns from the nearest to the furthest."""
_OFF_VOX = 3.0
"""Distance from the smallest radius at which the hook can slew: columns nearer to it are only partly in reach."""


def drawn_up(site: Site, rule: CollisionSpace, end_vox: HookEnd) -> NDArray[np.int32]:
    """Return the highest cell of the slings' lower end over a column."""
    x, y, _ = in_cell(end_vox)
    return np.array([x, y, _top(site, rule)[x, y]], np.int32)


def _top(site: Site, rule: CollisionSpace) -> NDArray[np.int32]:
    top = np.full(rule.hook_floor.shape, site.shape[2] - 1, np.int32)
    return np.minimum(top, rule.hook_ceiling) if rule.hook_ceiling.size else top


def parking_cells(site: Site, number: int, rule: CollisionSpace, sectors: int = _SECTORS) -> list[NDArray[np.int32]]:
    """Return cells of the slings' lower end at which a crane can wait, in every direction, with the hook raised."""
    top, (columns, ends) = _top(site, rule), _by_sector(site, number, sectors)
    free = ((rule.hook_floor < HOOK_FORBIDDEN) & (rule.hook_floor <= top))[columns[:, 0], columns[:, 1]]
    cells = []
    for first, end in pairwise(ends):
        own = first + np.flatnonzero(free[first:end])
        for share in _SHARES if len(own) else ():
            x, y = columns[own[int(share * (len(own) - 1))]].tolist()
            cells.append(np.array([x, y, top[x, y]], np.int32))
    return cells


@kept
def _by_sector(site: Site, number: int, sectors: int) -> tuple[NDArray[np.int64], list[int]]:
    """Return (N, 2) columns where the hook can slew by sector, the nearest first, and where each sector begins."""
    columns = np.argwhere(np.ones(site.shape[:2], np.bool_))
    base_m = np.array(site.cranes[number].base_m[:2])
    from_base_m = np.array(site.frame.origin_m[:2]) + site.frame.voxel_size_m * (columns + 0.5) - base_m
    radius_m, angle = np.hypot(*from_base_m.T), np.arctan2(*from_base_m.T[::-1])
    nearest_m = site.cranes[number].min_radius_m + _OFF_VOX * site.frame.voxel_size_m
    sector = np.floor((angle + np.pi) / (2.0 * np.pi) * sectors).astype(np.int64) % sectors
    order = np.lexsort((radius_m, sector))
    order = order[radius_m[order] >= nearest_m]
    return columns[order], [0, *np.searchsorted(sector[order], np.arange(sectors), side="right").tolist()]
