"""The proof that the phases of a carried load say what the crane does in them.

Hoist lasts until slewing or trolleying begins, and traverse begins then. Lower begins with the final lowering, and goes
down until the load is at its place. Where a stop interrupts them, the same holds for what follows it.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from bimvox.records.motion import LiftMotion, Phase, PhaseName
from bimvox.records.proof import Check

_STILL = 1e-6
"""An axis that moves by less, rad or m, is at rest."""
_LATE_S = 2.0
"""A move that accelerates from rest, or comes to rest, stays within ``_STILL`` for less than this."""
_CARRYING = (PhaseName.HOIST, PhaseName.TRAVERSE, PhaseName.LOWER)


def check_phase_names(check: Check, name: str, motion: LiftMotion) -> None:
    """Check hoist, traverse and lower of a lift by the samples of its loaded motion."""
    last: Phase | None = None
    for phase, time_s, axes in _sampled_phases(motion):
        last = phase
        at_s = phase.start_ns / 1e9
        if phase.name is PhaseName.HOIST:
            good = _still_until(axes[:, :2]) == len(axes)
            check.look(good, f"{name}: it slews or trolleys in its phase hoist, which begins at {at_s:.3f} s")
        elif phase.name is PhaseName.TRAVERSE:
            late_s = float(time_s[_still_until(axes[:, :2]) - 1] - time_s[0])
            check.look(
                late_s <= _LATE_S,
                f"{name}: in its phase traverse, which begins at {at_s:.3f} s, it slews or trolleys "
                f"only after {late_s:.1f} s",
            )
        else:
            height_m = np.minimum.accumulate(axes[:, 2])
            rises = float((axes[:, 2] - height_m).max())
            check.look(rises <= _STILL, f"{name}: it is hoisted in its phase lower, which begins at {at_s:.3f} s")
            waits_s = _longest_level_s(time_s, height_m) if rises <= _STILL else 0.0
            check.look(
                waits_s <= _LATE_S,
                f"{name}: in its phase lower, which begins at {at_s:.3f} s, it is not lowered for {waits_s:.1f} s",
            )
    if last is not None and last.name is not PhaseName.LOWER and _is_followed_by_set(motion, last):
        down_s = _lowered_last_s(motion)
        check.look(
            down_s <= _LATE_S, f"{name}: it is lowered for {down_s:.1f} s before it is set, in its phase {last.name}"
        )


def _sampled_phases(motion: LiftMotion) -> Iterator[tuple[Phase, NDArray[np.float64], NDArray[np.float64]]]:
    """Yield the carrying phases with the times and axes of the samples in them; those without samples are left out."""
    time_ns = motion.loaded.time_ns + motion.start_ns
    for phase in motion.phases:
        inside = (time_ns >= phase.start_ns) & (time_ns <= phase.end_ns)
        if phase.name in _CARRYING and inside.any():
            yield phase, time_ns[inside] / 1e9, motion.loaded.axes[inside]


def _still_until(axes: NDArray[np.float64]) -> int:
    """Return how many samples from the first one are where it is."""
    moved = (np.abs(axes - axes[0]) > _STILL).any(axis=1)
    return int(np.argmax(moved)) if moved.any() else len(axes)


def _longest_level_s(time_s: NDArray[np.float64], height_m: NDArray[np.float64]) -> float:
    """Return the longest time between samples that do not descend; the heights never rise."""
    after = np.searchsorted(-height_m, _STILL - height_m, side="right")
    return float((time_s[after - 1] - time_s).max())


def _is_followed_by_set(motion: LiftMotion, last: Phase) -> bool:
    return any(phase.name is PhaseName.SET and phase.start_ns == last.end_ns for phase in motion.phases)


def _lowered_last_s(motion: LiftMotion) -> float:
    """Return for how long the load is only lowered at the end of its way; 0 if it is also hoisted there."""
    time_s, axes = motion.loaded.time_ns / 1e9, motion.loaded.axes[::-1]
    straight = _still_until(axes[:, :2])
    upward_m = np.diff(axes[:straight, 2], prepend=axes[0, 2])
    if (upward_m < -_STILL).any() or upward_m.sum() <= _STILL:
        return 0.0
    level = _still_until(axes[:straight, 2:][::-1])
    return float(time_s[-1] - time_s[len(time_s) - straight + level - 1])
