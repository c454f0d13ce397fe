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
    clock_ns = before.end_ns if before is not None else 0
    turns = 0
    if before is not None:
        gap_rad = float(before.loaded.slew_rad[-1] - motion.trajectories[0].slew_rad[0])
        turns = round(gap_rad / (2.0 * np.pi))
        if abs(gap_rad - turns * 2.0 * np.pi) > _SAME_RAD:
            raise VerificationError(
                f"lift {motion.number} begins {gap_rad:.6f} rad from where the lift before it ends",
                failures=(f"lift {motion.number}",),
                hint="this is a fault of bimvox; please report it with the site file",
            )
    return _turned(_at(motion, clock_ns), turns)


def waiting(motion: LiftMotion, wait_ns: int) -> LiftMotion:
    """Return a motion that begins with a stop in which the crane stands still."""

    def later(part: Trajectory) -> Trajectory:
        time_ns = part.time_ns + np.int64(wait_ns)
        time_ns.flags.writeable = False
        return replace(part, time_ns=time_ns)

    start_ns = motion.start_ns
    phases = (Phase(p.name, p.start_ns + wait_ns, p.end_ns + wait_ns) for p in motion.phases)
    return replace(
        motion,
        approach=None if motion.approach is None else later(motion.approach),
        raising=later(motion.raising),
        loaded=later(motion.loaded),
        phases=(Phase(PhaseName.STOP, start_ns, start_ns + wait_ns), *phases),
        end_ns=motion.end_ns + wait_ns,
    )


def held_longer(motion: LiftMotion, at_ns: int, by_ns: int) -> LiftMotion:
    """Return a motion whose crane stands still for longer at a moment at which it rests; what came before stays.

    Args:
        motion: The motion.
        at_ns: From then on everything is later, on the site's clock: the end of a stop, or the start of the load's way.
        by_ns: By how much.
    """
    if by_ns == 0:
        return motion
    since_ns = at_ns - motion.start_ns

    def later(part: Trajectory) -> Trajectory:
        time_ns = part.time_ns + np.where(part.time_ns >= since_ns, np.int64(by_ns), np.int64(0))
        time_ns.flags.writeable = False
        return replace(part, time_ns=time_ns)

    before = [phase for phase in motion.phases if phase.end_ns <= at_ns]
    after = [Phase(p.name, p.start_ns + by_ns, p.end_ns + by_ns) for p in motion.phases if p.end_ns > at_ns]
    if before and before[-1].name is PhaseName.STOP:
        stop = Phase(PhaseName.STOP, before.pop().start_ns, at_ns + by_ns)
    else:
        stop = Phase(PhaseName.STOP, at_ns, at_ns + by_ns)
    return replace(motion, loaded=later(motion.loaded), phases=(*before, stop, *after), end_ns=motion.end_ns + by_ns)


def chained(motions: Sequence[LiftMotion]) -> tuple[LiftMotion, ...]:
    """Return motions in order on one clock, without gaps, starting at 0."""
    result: list[LiftMotion] = []
    for motion in motions:
        result.append(joined_on(motion, result[-1] if result else None))
    return tuple(result)


def _at(motion: LiftMotion, start_ns: int) -> LiftMotion:
    by_ns = start_ns - motion.start_ns
    if by_ns == 0:
        return motion
    phases = tuple(Phase(p.name, p.start_ns + by_ns, p.end_ns + by_ns) for p in motion.phases)
    return replace(motion, phases=phases, start_ns=start_ns, end_ns=motion.end_ns + by_ns)


def _turned(motion: LiftMotion, turns: int) -> LiftMotion:
    if turns == 0:
        return motion

    def turned(part: Trajectory) -> Trajectory:
        slew_rad = part.slew_rad + 2.0 * np.pi * turns
        slew_rad.flags.writeable = False
        return replace(part, slew_rad=slew_rad)

    approach = None if motion.approach is None else turned(motion.approach)
    return replace(motion, approach=approach, raising=turned(motion.raising), loaded=turned(motion.loaded))
