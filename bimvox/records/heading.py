"""The heading of a load: kept, or turning with the jib, and how long a crew takes to turn it to its final heading."""

from __future__ import annotations

from math import pi

import numpy as np
from numpy.typing import NDArray

from bimvox.records.lift import Lift
from bimvox.records.motion import LiftMotion


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
    found: NDArray[np.float64] = np.where(time_ns < start_ns, off_rad, back_rad)
    return found


def _full_turns_rad(angle_rad: float) -> float:
    """Return the full turns nearest to an angle."""
    return 2.0 * pi * round(angle_rad / (2.0 * pi))
