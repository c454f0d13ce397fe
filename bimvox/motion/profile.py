"""Jerk-limited profiles of moves from rest to rest, from ruckig: plain, shaped against swing, and packed for kernels.

One degree of freedom per move: the share of its line. Ruckig's own phase synchronisation of several axes silently falls
back to time synchronisation if scaling the slowest axis's profile would break another axis's limit; the line is then
not straight. With the limits of all axes projected onto the line first (:func:`bimvox.motion.move.share_limits`) it is
straight by construction, and just as fast.

Only state-to-state motions are computed: ruckig sends waypoints to a network service, so they are never used.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from operator import and_
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from ruckig import InputParameter, Ruckig, RuckigError
from ruckig import Trajectory as RuckigTrajectory

from bimvox.compiled import kernel, leaf_kernel
from bimvox.crane.tower_crane import AxisLimits, TowerCrane
from bimvox.crane.travel import rest_to_rest_s
from bimvox.errors import PlanningError
from bimvox.motion.move import LINES, Line, Move, axes_of, write_along

# A limit this far beyond what the motion needs has no effect.
_BEYOND = 1e9


ROW = (9, 5)
"""A profile as kernels take it: in rows 0 to 6 its pieces (start, then position, velocity, acceleration and jerk
there), in row 7 its duration, the time from one part to the next, the time of all parts, and the numbers of pieces and
parts, in row 8 the sizes of the parts in which it is driven."""

TIMES, PARTS = 7, 8


@dataclass(frozen=True, slots=True, eq=False)
class Profile:
    """A rest-to-rest profile of the share 0..1 as pieces of constant jerk.

    Attributes:
        pieces: (P, 5) float64 start of each piece, and position, velocity, acceleration and jerk there; P <= 7.
        duration_s: Time at which the share 1 is reached.
        top_rate: Highest rate of the share, 1/s.
        row: ``ROW`` float64 for kernels.
    """

    pieces: NDArray[np.float64]
    duration_s: float
    top_rate: float = field(init=False)
    row: NDArray[np.float64] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        _, _, rate, acceleration, jerk = self.pieces.T
        # If a piece goes from speeding up to slowing down, the peak is inside it.
        peaks = jerk < 0.0
        inside = rate[peaks] - acceleration[peaks] ** 2 / (2.0 * jerk[peaks])
        object.__setattr__(self, "top_rate", float(max(rate.max(), inside.max(initial=0.0))))
        row = np.zeros(ROW)
        row[: len(self.pieces)] = self.pieces
        row[TIMES] = self.duration_s, 0.0, self.duration_s, len(self.pieces), 1
        row[PARTS, 0] = 1.0
        object.__setattr__(self, "row", row)

    def share_at(self, time_s: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the share driven at ascending times: 0 before the start, 1 after the end."""
        share = np.zeros(len(time_s))
        _add_shares(share, time_s, 0.0, self.pieces, self.duration_s, 1.0)
        return share


@leaf_kernel
def _add_shares(
    shares: NDArray[np.float64],
    time_s: NDArray[np.float64],
    later_s: float,
    pieces: NDArray[np.float64],
    duration_s: float,
    size: float,
) -> None:
    """Add ``size`` times the share driven at ascending times, this much later, to ``shares`` ((N,), in place)."""
    piece, last = 0, pieces.shape[0] - 1
    for i in range(time_s.shape[0]):
        at_s = time_s[i] - later_s
        if at_s >= duration_s:
            shares[i] += size
            continue
        while piece < last and pieces[piece + 1, 0] <= at_s:
            piece += 1
        t = max(at_s - pieces[piece, 0], 0.0)
        p, v, a, j = pieces[piece, 1], pieces[piece, 2], pieces[piece, 3], pieces[piece, 4]
        shares[i] += size * min(max(p + t * (v + t * (a / 2.0 + t * j / 6.0)), 0.0), 1.0)


@lru_cache(maxsize=8192)
def profile_of(limits: AxisLimits) -> Profile:
    """Return the fastest profile of the share from 0 to 1 under limits on the share.

    Raises PlanningError: if ruckig finds none (limits that are not positive).
    """
    if not min(limits.rate, limits.acceleration, limits.jerk) > 0.0:
        raise PlanningError(
            f"no motion under rate {limits.rate:g}, acceleration {limits.acceleration:g}, jerk {limits.jerk:g}",
            hint="the crane's limits must all be positive",
        )
    # Scaled so that the motion has length 1 and duration 1: ruckig's tolerances are absolute.
    unit_s = rest_to_rest_s(1.0, limits)
    scaled = AxisLimits(
        min(limits.rate * unit_s, _BEYOND),
        min(limits.acceleration * unit_s**2, _BEYOND),
        min(limits.jerk * unit_s**3, _BEYOND),
    )
    trajectory = _ruckig(scaled, limits)
    pieces = trajectory.profiles[0][0]
    lengths = np.array(pieces.t)
    used = lengths > 0.0
    states = np.array([pieces.p[:7], pieces.v[:7], pieces.a[:7], pieces.j[:7]]).T / unit_s ** np.arange(4)
    starts = np.concatenate([[0.0], np.cumsum(lengths)[:-1]]) * unit_s
    return Profile(np.column_stack([starts, states])[used], float(trajectory.duration) * unit_s)


def _ruckig(scaled: AxisLimits, limits: AxisLimits) -> Any:
    """Return ruckig's trajectory of length 1 under ``scaled`` limits."""
    # If a piece of the profile has no duration (a move of 2 a^3 / j^2), rounding can keep ruckig from finding it.
    # With slightly less acceleration, which the limits allow, it succeeds.
    for less in (0.0, 1e-6, 1e-4):
        state, trajectory = InputParameter(1), RuckigTrajectory(1)
        state.current_position, state.target_position = [0.0], [1.0]
        state.max_velocity, state.max_jerk = [scaled.rate], [scaled.jerk]
        state.max_acceleration = [scaled.acceleration * (1.0 - less)]
        try:
            Ruckig(1).calculate(state, trajectory)
        except RuckigError:
            continue
        return trajectory
    raise PlanningError(
        f"ruckig found no motion under rate {limits.rate:g}, acceleration {limits.acceleration:g}, "
        f"jerk {limits.jerk:g} (per way)",
        hint="look at the crane's limits",
    )


# Moves shaped so that the load hangs at rest when they end.
#
# Zero-vibration shaping (Singer & Seering, "Preshaping Command Inputs to Reduce System Vibration", J. Dyn. Sys., Meas.,
# Control 112, 1990): a command in two halves, half a period apart, leaves no swing; in three parts (1/4, 1/2, 1/4)
# little even if the period differs from the assumed one. The share driven of a move's line is shaped, so the hook keeps
# to the line that was found free, and no limit is exceeded because the result is a mean of the profile. A load below a
# hook block swings with two periods: the parts are set apart for the slow swing, ramps of the acceleration take out the
# fast one.

TWO = (0.5, 0.5)
THREE = (0.25, 0.5, 0.25)


@dataclass(frozen=True, slots=True, eq=False)
class ShapedProfile:
    """A rest-to-rest profile of the share 0..1, driven in parts.

    Attributes:
        base: The profile that is driven in parts.
        parts: Their sizes, together 1.
        apart_s: Time from one part to the next.
        duration_s: Time at which the share 1 is reached.
        row: ``ROW`` float64 for kernels.
    """

    base: Profile
    parts: tuple[float, ...]
    apart_s: float
    duration_s: float = field(init=False)
    row: NDArray[np.float64] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        count = len(self.parts)
        object.__setattr__(self, "duration_s", self.base.duration_s + (count - 1) * self.apart_s)
        row = self.base.row.copy()
        row[TIMES, 1:] = self.apart_s, self.duration_s, len(self.base.pieces), count
        row[PARTS, :count] = self.parts
        object.__setattr__(self, "row", row)

    @property
    def top_rate(self) -> float:
        """Upper bound of the rate of the share, 1/s."""
        return self.base.top_rate

    def share_at(self, time_s: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the share driven at each time: 0 before the start, 1 after the end."""
        share = np.zeros(len(time_s))
        for n, part in enumerate(self.parts):
            share += part * self.base.share_at(time_s - n * self.apart_s)
        return np.where(time_s >= self.duration_s, 1.0, share)


@dataclass(frozen=True, slots=True)
class Calm:
    """How a move is shaped to keep its load from swinging.

    Attributes:
        parts: Sizes of the parts in which it is driven.
        stretch: Time between the parts, in half periods of the load's slow swing at the move's height.
        pace: Share of the axes' rates at which it is driven; accelerations scale with its square. Along a line that is
            straight in the site only these and the jerks are scaled.
        smooth: Whether its accelerations grow and fade in a period of the load's fast swing each.
    """

    parts: tuple[float, ...] = TWO
    stretch: float = 1.0
    pace: float = 1.0
    smooth: bool = False


def smoothed(limits: AxisLimits, ramp_s: float) -> AxisLimits:
    """Return limits on the share driven under which its acceleration grows and fades in ramps of exactly this time.

    A load swings by the mean of the acceleration over a ramp: of a swing whose period is the ramp's, nothing is left.
    """
    most = min(limits.acceleration, limits.jerk * ramp_s, limits.rate / ramp_s, 0.5 / ramp_s**2)
    return AxisLimits(limits.rate, most, most / ramp_s)


_SHAPED = (
    Calm(),
    Calm(smooth=True),
    Calm(TWO, 1.1, smooth=True),
    Calm(TWO, 1.2, smooth=True),
    Calm(THREE, 1.05, smooth=True),
    Calm(THREE, 0.95, smooth=True),
    Calm(THREE, 1.15, smooth=True),
)
FIRST_SLOW = len(_SHAPED)
"""From here on each rung of the ladder is the rung before it, driven slower."""
_PACES = (0.95, 0.9, 0.8, 0.72, 0.65, 0.57, 0.5, 0.42, 0.35, 0.3, 0.25, 0.21, 0.18, 0.15, 0.12)
LADDER = (*_SHAPED, *(Calm(THREE, 1.05, pace, smooth=True) for pace in _PACES))
"""Shapings of a move, tried in this order until the load hangs at rest where it must. Slewing differs from what shaping
assumes (the jib turns under the swinging load and pulls it inward), and hoisting changes the period."""


class Moves:
    """Moves that follow each other, with everything about them that does not depend on their profiles.

    Args:
        crane: The crane.
        moves: In order; each starts where the one before ends.

    Attributes:
        crane: The crane.
        moves: The moves.
        ends: (N, 2, 3) float64 slew, radius and height where each starts and ends.
        travel_m: Upper bound of the hook's travel in each.
        swings: Whether each makes the load swing.
        overlaps: Whether each may begin before the one before it ends: joint lines that drive different axes.
        lines: (N,) int64 the line of each, its place in ``LINES``.
    """

    def __init__(self, crane: TowerCrane, moves: Sequence[Move]) -> None:
        self.crane, self.moves = crane, tuple(moves)
        self.ends = np.array([[axes_of(move.start), axes_of(move.end)] for move in moves])
        self.lines = np.array([LINES.index(move.line) for move in moves])
        self.travel_m = tuple(_travel_m(move) for move in moves)
        self.swings = tuple(move.swings for move in moves)
        moving, joint = [move.moving for move in moves], [move.line is Line.JOINT for move in moves]
        self.overlaps = tuple(
            n > 0 and joint[n - 1] and joint[n] and not any(map(and_, moving[n - 1], moving[n]))
            for n in range(len(moves))
        )


class Packed(NamedTuple):
    """Moves and their profiles as the kernels take them.

    Attributes:
        ends: (N, 2, 3) float64 slew, radius and height where each move starts and ends.
        lines: (N,) int64 the line of each, its place in ``LINES``.
        rows: (N, 9, 5) float64 their profiles, see ``ROW``.
        x_m: The slewing axis.
        y_m: The slewing axis.
    """

    ends: NDArray[np.float64]
    lines: NDArray[np.int64]
    rows: NDArray[np.float64]
    x_m: float
    y_m: float


class Room(NamedTuple):
    """Room in which a kernel works.

    Attributes:
        shares: (2, N) float64.
        axes: (N, 3) float64.
    """

    shares: NDArray[np.float64]
    axes: NDArray[np.float64]


class Course:
    """Moves with their profiles, whenever each begins. Neither moves nor profiles change.

    Attributes:
        profiles: One per move.
        packed: For kernels.
        duration_s: How long each move takes.
        top_speed_m_s: Upper bound of the hook's speed in each move.
    """

    def __init__(self, moves: Moves, profiles: Sequence[Profile | ShapedProfile]) -> None:
        self._moves = moves
        self.profiles = tuple(profiles)
        self.duration_s = tuple(profile.duration_s for profile in profiles)
        self.top_speed_m_s = tuple(
            travel_m * profile.top_rate for travel_m, profile in zip(moves.travel_m, profiles, strict=True)
        )
        self.packed = Packed(
            moves.ends, moves.lines, np.array([profile.row for profile in profiles]), *moves.crane.base_m[:2]
        )

    @property
    def crane(self) -> TowerCrane:
        """The crane."""
        return self._moves.crane

    @property
    def moves(self) -> tuple[Move, ...]:
        """In order; each starts where the one before ends."""
        return self._moves.moves

    @property
    def swings(self) -> tuple[bool, ...]:
        """Whether each move makes the load swing."""
        return self._moves.swings

    @property
    def overlaps(self) -> tuple[bool, ...]:
        """Whether each move may begin before the one before it ends."""
        return self._moves.overlaps

    def axes_at(self, time_s: NDArray[np.float64], start_s: Sequence[float]) -> NDArray[np.float64]:
        """Return (N, 3) float64 slew, radius and height at times ((N,)) that ascend, with each move's start."""
        axes: NDArray[np.float64] = _axes_at(time_s, np.array(start_s), self.packed)
        return axes


def _travel_m(move: Move) -> float:
    slew, radius, height = move.difference
    reach = max(move.start.radius_m, move.end.radius_m)
    # 2: an arc is at most pi / 2 times its chord, and no line is longer.
    longer = 1.0 if move.line is Line.JOINT else 2.0
    return float(np.hypot(longer * np.hypot(reach * slew, radius), longer * height))


@kernel
def _axes_at(time_s: NDArray[np.float64], begins_s: NDArray[np.float64], packed: Packed) -> NDArray[np.float64]:
    count = time_s.shape[0]
    axes, room = np.empty((count, 3)), Room(np.empty((2, count)), np.empty((count, 3)))
    for i in range(count):
        for k in range(3):
            axes[i, k] = packed.ends[0, 0, k]
    for n in range(packed.ends.shape[0]):
        add_move(axes, time_s, begins_s[n], packed, n, room)
    return axes


@leaf_kernel
def add_move(
    axes: NDArray[np.float64], time_s: NDArray[np.float64], begin_s: float, packed: Packed, n: int, room: Room
) -> None:
    """Add the movement of one move to axes ((N, 3)) at times ((N,)) that ascend; there is ``room`` for N or more."""
    count = time_s.shape[0]
    times_s = packed.rows[n, TIMES]
    base_s, apart_s, whole_s = times_s[0], times_s[1], times_s[2]
    # Before the move begins it adds nothing; after its end it adds its whole movement.
    low = first_from(time_s, begin_s, 0.0)
    high = first_from(time_s, begin_s, whole_s)
    since_s, shares, along = room.shares[0, : high - low], room.shares[1, : high - low], room.axes[: high - low]
    for i in range(low, high):
        since_s[i - low], shares[i - low] = time_s[i] - begin_s, 0.0
    pieces = packed.rows[n, : int(times_s[3])]
    for part in range(int(times_s[4])):
        _add_shares(shares, since_s, part * apart_s, pieces, base_s, packed.rows[n, PARTS, part])
    write_along(along, shares, packed.ends[n], packed.lines[n], packed.x_m, packed.y_m)
    for k in range(3):
        first, last = packed.ends[n, 0, k], packed.ends[n, 1, k]
        for i in range(low, high):
            axes[i, k] += along[i - low, k] - first
        for i in range(high, count):
            axes[i, k] += first + (last - first) - first


@leaf_kernel
def first_from(time_s: NDArray[np.float64], begins_s: float, since_s: float) -> int:
    """Return the index of the first of ascending times at or after ``since_s`` from the start of a move."""
    low, high = 0, time_s.shape[0]
    while low < high:
        middle = (low + high) // 2
        if time_s[middle] - begins_s < since_s:
            low = middle + 1
        else:
            high = middle
    return low
