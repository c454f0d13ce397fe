"""The pace of an animation: moments of the site's clock, close together where something moves.

The slings of a part are fixed and taken off for minutes, and for seconds it moves; a film at an even pace would show a
crane that stands. Time in which the hook stands still passes ``STANDING`` times as fast; the clock in the picture says
the true time.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bimvox.errors import InputError
from bimvox.records.motion import LiftMotion, PhaseName
from bimvox.rendering.page.source import Track

STANDING = 20.0
_STILL = frozenset((PhaseName.HOOK_ON, PhaseName.SET, PhaseName.RELEASE))
_MOST_FRAMES = 5000


def frame_times_ns(tracks: Sequence[Track], motions: Sequence[LiftMotion], frames: int) -> list[int]:
    """Return the moments of an animation's frames, ascending: the first at the first lift's start, the last at the end.

    Args:
        tracks: Lifts to be shown, ascending order.
        motions: Of those lifts; none without a crane, where the pace is even.
        frames: How many, at least 2.

    Raises:
        InputError: If there are too few or too many of them, or no lifts.
    """
    if not tracks:
        raise InputError("no lift of the plan has a time", hint="bimvox render LOG -o LOG.png shows it as it is")
    if not 2 <= frames <= _MOST_FRAMES:
        raise InputError(
            f"an animation of {frames} frames cannot be made",
            hint=f"seconds times frames a second may be from 2 to {_MOST_FRAMES}",
        )
    by_order = {motion.order: motion for motion in motions}
    at_ns, weights = [tracks[0].start_ns], [0.0]
    for track in tracks:
        motion = by_order.get(track.lift.order)
        spans = [(track.start_ns, track.end_ns, False)]
        if motion is not None and motion.phases:
            spans = [(phase.start_ns, phase.end_ns, phase.name in _STILL) for phase in motion.phases]
        for start_ns, end_ns, still in spans:
            # A gap before it (lifts that are not shown) takes no time.
            if start_ns > at_ns[-1]:
                at_ns.append(start_ns)
                weights.append(weights[-1])
            at_ns.append(end_ns)
            weights.append(weights[-1] + (end_ns - start_ns) / (STANDING if still else 1.0))
    wanted = np.linspace(0.0, weights[-1], frames)
    times = np.interp(wanted, weights, np.array(at_ns, np.float64))
    return [int(time) for time in np.rint(times)]


def default_seconds(lifts: int) -> float:
    """Return how long an animation of so many lifts takes."""
    return 8.0 if lifts == 1 else float(min(24.0, max(6.0, 0.2 * lifts)))
