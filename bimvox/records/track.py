"""Where the load is at every moment of a lift, and how it is turned: with the jib or kept, and by the crew."""

from __future__ import annotations

from dataclasses import dataclass
from math import pi

import numpy as np
from numpy.typing import NDArray

from bimvox.records.lift import Lift
from bimvox.records.motion import LiftMotion
from bimvox.site.component import ConstructionState


@dataclass(frozen=True, slots=True, eq=False)
class LiftTimes:
    """When the load of a lift enters each state, on the site's clock.

    Attributes:
        lift: The lift.
        start_ns: When the lift starts.
        lifted_ns: When the load leaves its place in the yard.
        arrived_ns: When it is at its place in the building.
        assembled_ns: When it is fixed there; until then it hangs on the hook.
        end_ns: When the lift ends.
    """

    lift: Lift
    start_ns: int
    lifted_ns: int
    arrived_ns: int
    assembled_ns: int
    end_ns: int

    @property
    def states(self) -> tuple[tuple[int, ConstructionState], ...]:
        """When the load enters each state, ascending."""
        return (
            (self.start_ns, ConstructionState.UNBUILT),
            (self.lifted_ns, ConstructionState.IN_TRANSIT),
            (self.arrived_ns, ConstructionState.ARRIVED),
            (self.assembled_ns, ConstructionState.ASSEMBLED),
        )

    def state_at(self, time_ns: int) -> ConstructionState:
        """Return the state at a time on the site's clock."""
        return next((state for at_ns, state in self.states[::-1] if at_ns <= time_ns), ConstructionState.UNBUILT)


@dataclass(frozen=True, slots=True, eq=False)
class LoadTrack(LiftTimes):
    """The track of a lift's load on the site's clock.

    Attributes:
        time_ns: (N,) int64 samples from ``lifted_ns`` to ``assembled_ns``.
        corner_m: (N, 3) float64 origin of the component's frame: the lowest corner of its reference cell, site metres.
        tilt: (N, 4) float64 quaternion x, y, z, w: its rotation relative to the built-in position; the identity except
            while a part stored lying is tipped up, until a part stored turned is turned back, and while a load turns
            with the jib.
    """

    time_ns: NDArray[np.int64]
    corner_m: NDArray[np.float64]
    tilt: NDArray[np.float64]


def heading_in_words(lift: Lift, motion: LiftMotion | None) -> str | None:
    """Return "kept", or "with jib" and by how much the crew turns the load back; None without a motion."""
    if motion is None or not lift.ever_with_jib:
        return None if motion is None else "kept"
    turned_rad = 0.0
    if motion.turned_ns is not None:
        ends_ns = np.array(motion.turned_ns)
        slew_rad = np.interp(ends_ns - motion.start_ns, motion.loaded.time_ns, motion.loaded.slew_rad)
        turned_rad = float(np.diff(headings_off_rad(motion, ends_ns, slew_rad))[0])
    return f"with jib, {np.degrees(abs(turned_rad)):.0f} deg"


def turn_back_s(off_rad: float, quarter_s: float) -> float:
    """Return the time to turn a load back to its final heading, the shorter way, at ``quarter_s`` for a quarter."""
    return abs(off_rad - _full_turns_rad(off_rad)) / (pi / 2.0) * quarter_s


def headings_off_rad(
    motion: LiftMotion, time_ns: NDArray[np.int64], slew_rad: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return (N,) by how much the heading of a load that turns with the jib differs from its final one.

    It differs by as much as the jib has turned since the load left the yard. It goes to the nearest full turn at a
    constant rate while the load is turned to its final heading.

    Args:
        motion: The motion of its lift.
        time_ns: (N,) times on the site's clock.
        slew_rad: (N,) slewing angles at these times.
    """
    left_ns = motion.start_ns + int(motion.loaded.time_ns[0])
    off_rad = np.where(time_ns < left_ns, 0.0, slew_rad - motion.loaded.slew_rad[0])
    if motion.turned_ns is None:
        return off_rad
    start_ns, end_ns = motion.turned_ns
    at_start = np.interp(start_ns - motion.start_ns, motion.loaded.time_ns, motion.loaded.slew_rad)
    begins_rad = float(at_start - motion.loaded.slew_rad[0])
    left = np.clip((end_ns - time_ns) / (end_ns - start_ns), 0.0, 1.0)
    full_rad = _full_turns_rad(begins_rad)
    back_rad = full_rad + left * (begins_rad - full_rad)
    result: NDArray[np.float64] = np.where(time_ns < start_ns, off_rad, back_rad)
    return result


def _full_turns_rad(angle_rad: float) -> float:
    """Return the full turns nearest to an angle."""
    return 2.0 * pi * round(angle_rad / (2.0 * pi))
