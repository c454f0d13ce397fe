"""The proof that several cranes on one site keep their distance from each other.

It shares no code with the scheduler. At each time step it computes the poses of the cranes and measures points along
the jib, rope and load of each crane against the other. At every step at which a crane moves, both are stopped: at the
same time, or one a reaction time after the other. The stops are integrated for each axis (``braking``), and the load
swings during braking.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from bimvox.crane.outline import outline_of
from bimvox.crane.tower_crane import TowerCrane
from bimvox.proof.crane.distance import POSE_COLUMNS, least_distances
from bimvox.proof.crane.way import LOOK_NS, STOP_EVERY_NS, CraneWay, Stops, way_of_crane
from bimvox.proof.space import ALWAYS_NS
from bimvox.records.motion import LiftMotion
from bimvox.records.proof import Check
from bimvox.site.site import Site

REACTION_NS = 1_000_000_000
"""Time from the stop command until braking starts."""
_TOLERANCE_M = 0.1
"""Allowance for the spacing of points and for poses between time steps, which are not compared."""
_AT_ONCE = 200
"""Number of time steps whose stops are kept in memory at once."""


def check_cranes(
    check: Check,
    site: Site,
    motions: Sequence[LiftMotion],
    window_ns: tuple[int, int] = ALWAYS_NS,
    *,
    is_whole: bool = True,
) -> None:
    """Check that the cranes always keep their distance, whenever one or all of them are stopped.

    Args:
        check: Receives the result; its worst is the separation as a share of the least distance.
        site: The site.
        motions: The motions of all its cranes.
        window_ns: The checked span of the site's clock.
        is_whole: Whether these are all motions: the cranes are then still before and after them. In an extract, only
            times at which both poses are known are checked.
    """
    ways = [
        way_of_crane(site, number, [motion for motion in motions if motion.crane == number])
        for number in sorted({motion.crane for motion in motions})
    ]
    for one, other in combinations(ways, 2):
        _Pair(check, site, one, other, window_ns, is_whole).run()
    check.about = None


class _Pair:
    """Two cranes."""

    def __init__(
        self, check: Check, site: Site, one: CraneWay, other: CraneWay, window_ns: tuple[int, int], is_whole: bool
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
        time_ns = self._known(np.arange(self.begin_ns, self.end_ns + LOOK_NS, LOOK_NS, dtype=np.int64))
        rows = [way.rows_at(time_ns, way.axes_at(time_ns)) for way in (self.one, self.other)]
        self._look(rows[0], rows[1], time_ns, "")
        moments = self._known(np.arange(self.begin_ns, self.end_ns, STOP_EVERY_NS, dtype=np.int64))
        moments = moments[self.one.moving_at(moments) | self.other.moving_at(moments)]
        stops = [Stops(way) for way in (self.one, self.other)]
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
                one.forget()

    def _known(self, time_ns: NDArray[np.int64]) -> NDArray[np.int64]:
        """Return the times at which both poses are known."""
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
        orders = " and ".join(str(motion.number) for motion in first)
        self.checked.look(
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
