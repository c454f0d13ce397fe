"""The pace of an animation: times on the site's clock, denser while something moves.

Slinging takes minutes and motion seconds, so a film at a constant pace would mostly show a crane at rest. Time while
the hook rests passes ``STANDING`` times as fast; the clock in the picture shows the true time.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bimvox.errors import InputError
from bimvox.records.motion import LiftMotion, PhaseName
from bimvox.records.track import LoadTrack

STANDING = 20.0
_STILL = frozenset((PhaseName.HOOK_ON, PhaseName.SET, PhaseName.RELEASE))
_MOST_FRAMES = 5000


def frame_times_ns(tracks: Sequence[LoadTrack], motions: Sequence[LiftMotion], frames: int) -> list[int]:
    """Return the times of an animation's frames, ascending, from the first lift's start to the last lift's end.

    The tracks are those of the lifts to show, in ascending order. Without motions (no crane), the pace is constant.

    Raises:
        InputError: If there are fewer than 2 or too many frames, or no lifts.
    """
    if not tracks:
        raise InputError("no lift of the plan has a time", hint="a picture (.png) shows the plan without times")
    if not 2 <= frames <= _MOST_FRAMES:
        raise InputError(
            f"an animation of {frames} frames cannot be made",
            hint=f"seconds times frames a second must be from 2 to {_MOST_FRAMES}",
        )
    by_order = {motion.order: motion for motion in motions}
    at_ns, weights = [tracks[0].start_ns], [0.0]
    for track in tracks:
        motion = by_order.get(track.lift.order)
        spans = [(track.start_ns, track.end_ns, False)]
        if motion is not None and motion.phases:
            spans = [(phase.start_ns, phase.end_ns, phase.name in _STILL) for phase in motion.phases]
        for start_ns, end_ns, still in spans:
            # A gap before it (lifts that are not shown) is skipped.
            if start_ns > at_ns[-1]:
                at_ns.append(start_ns)
                weights.append(weights[-1])
            at_ns.append(end_ns)
            weights.append(weights[-1] + (end_ns - start_ns) / (STANDING if still else 1.0))
    wanted = np.linspace(0.0, weights[-1], frames)
    times = np.interp(wanted, weights, np.array(at_ns, np.float64))
    return [int(time) for time in np.rint(times)]


def default_seconds(lifts: int) -> float:
    """Return the default length of an animation of this many lifts, seconds."""
    return 8.0 if lifts == 1 else float(min(24.0, max(6.0, 0.2 * lifts)))
