"""Jerk-limited rest-to-rest profiles, from ruckig.

One degree of freedom per move: the share of its line. Ruckig's own phase synchronisation of several axes silently falls
back to time synchronisation if scaling the slowest axis's profile would break another axis's limit; the line is then
not straight. With the limits of all axes projected onto the line first (:func:`bimvox.motion.move.share_limits`) it is
straight by construction, and just as fast.

Only state-to-state motions are computed: ruckig sends waypoints to a network service, so they are never used.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray
from ruckig import InputParameter, Ruckig, RuckigError
from ruckig import Trajectory as RuckigTrajectory

from bimvox.compiled import leaf_kernel
from bimvox.crane.axis_limits import AxisLimits
from bimvox.crane.bound import rest_to_rest_s
from bimvox.errors import PlanningError

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
        add_shares(share, time_s, 0.0, self.pieces, self.duration_s, 1.0)
        return share


@leaf_kernel
def add_shares(
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

    Raises:
        PlanningError: If ruckig finds none (limits that are not positive).
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
