"""Motions that are kept, moved in time.

If a lift takes longer or shorter than before, all later lifts start later or earlier; nothing else about them changes.
A motion counts its samples from its own start, so only its start, end and phases move. If the lift before it now ends
after another number of turns, whole turns are added to its slewing angles.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from bimvox.errors import VerificationError
from bimvox.motion import phases, trajectories
from bimvox.motion.phases import phases_from
from bimvox.records.motion import LiftMotion, Phase, PhaseName
from bimvox.records.trajectory import Trajectory

_SAME_RAD = 1e-7


def joined_on(motion: LiftMotion, before: LiftMotion | None) -> LiftMotion:
    """Return a motion that begins when and where the one before it ends; the same object if it already does.

    Args:
        motion: The motion; it was made to follow a motion that ends in the same place.
        before: The motion that it follows now; None for the first.

    Raises:
        VerificationError: If the one before ends at another slewing angle, apart from whole turns.
    """
    if before is None:
        return starting(motion, 0)
    gap_rad = float(before.loaded.slew_rad[-1] - motion.trajectories[0].slew_rad[0])
    turns = round(gap_rad / (2.0 * np.pi))
    if abs(gap_rad - turns * 2.0 * np.pi) > _SAME_RAD:
        raise VerificationError(
            f"lift {motion.number} begins {gap_rad:.6f} rad from where the lift before it ends",
            failures=(f"lift {motion.number}",),
            hint="this is a fault of bimvox; please report it with the site file",
        )
    moved = starting(motion, before.end_ns)
    if turns == 0:
        return moved
    approach = None if motion.approach is None else trajectories.turned(motion.approach, turns)
    raising, loaded = (trajectories.turned(part, turns) for part in (motion.raising, motion.loaded))
    return replace(moved, approach=approach, raising=raising, loaded=loaded)


def approached(motion: LiftMotion, approach: Trajectory) -> LiftMotion:
    """Return a motion, from hook on the same, with another way of the empty hook to its part, and no stop on it."""
    assert motion.approach is not None
    by_ns = motion.start_ns + int(approach.time_ns[-1]) - motion.hooked_ns
    turns = round(float(approach.slew_rad[-1] - motion.approach.slew_rad[-1]) / (2.0 * np.pi))
    raising, loaded = (
        trajectories.turned(trajectories.delayed(part, by_ns), turns) for part in (motion.raising, motion.loaded)
    )
    after = [phase for phase in motion.phases if phase.start_ns >= motion.hooked_ns]
    return replace(
        motion,
        approach=approach,
        raising=raising,
        loaded=loaded,
        phases=(
            *phases_from(motion.start_ns, [(PhaseName.APPROACH, int(approach.time_ns[-1]))]),
            *phases.delayed(after, by_ns),
        ),
        end_ns=motion.end_ns + by_ns,
    )


def waiting(motion: LiftMotion, wait_ns: int) -> LiftMotion:
    """Return a motion that begins with a stop at rest."""
    start_ns = motion.start_ns
    return replace(
        motion,
        approach=None if motion.approach is None else trajectories.delayed(motion.approach, wait_ns),
        raising=trajectories.delayed(motion.raising, wait_ns),
        loaded=trajectories.delayed(motion.loaded, wait_ns),
        phases=(Phase(PhaseName.STOP, start_ns, start_ns + wait_ns), *phases.delayed(motion.phases, wait_ns)),
        end_ns=motion.end_ns + wait_ns,
    )


def held_longer(motion: LiftMotion, at_ns: int, by_ns: int) -> LiftMotion:
    """Return a motion that is held longer at a moment at which the crane rests; what came before stays.

    Args:
        motion: The motion.
        at_ns: The end of a stop or the start of the load's transport, on the site's clock; all later times are delayed.
        by_ns: The delay.
    """
    if by_ns == 0:
        return motion
    before = [phase for phase in motion.phases if phase.end_ns <= at_ns]
    after = phases.delayed(motion.phases[len(before) :], by_ns)
    stopped_ns = before.pop().start_ns if before and before[-1].name is PhaseName.STOP else at_ns
    return replace(
        motion,
        loaded=trajectories.delayed(motion.loaded, by_ns, since_ns=at_ns - motion.start_ns),
        phases=(*before, Phase(PhaseName.STOP, stopped_ns, at_ns + by_ns), *after),
        end_ns=motion.end_ns + by_ns,
    )


def chained(motions: Sequence[LiftMotion]) -> tuple[LiftMotion, ...]:
    """Return motions in order on one clock, without gaps, starting at 0."""
    result: list[LiftMotion] = []
    for motion in motions:
        result.append(joined_on(motion, result[-1] if result else None))
    return tuple(result)


def starting(motion: LiftMotion, start_ns: int) -> LiftMotion:
    """Return a motion that starts at a time on the site's clock; the same object if it already does."""
    by_ns = start_ns - motion.start_ns
    if by_ns == 0:
        return motion
    moved = phases.delayed(motion.phases, by_ns)
    return replace(motion, phases=moved, start_ns=start_ns, end_ns=motion.end_ns + by_ns)
