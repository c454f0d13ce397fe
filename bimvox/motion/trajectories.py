"""Trajectories, phases and motions, made from samples, shifted in time, turned, joined and cut."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bimvox.errors import VerificationError
from bimvox.records.motion import LiftMotion, Phase, PhaseName, Trajectory


def trajectory_of(
    time_ns: NDArray[np.int64], axes: NDArray[np.float64], corner: NDArray[np.int64], bound_s: float
) -> Trajectory:
    """Return the trajectory of (N,) times and (N, 3) slew, radius and height, its arrays read-only."""
    slew_rad, radius_m, height_m = (_fixed(axis.copy()) for axis in axes.T)
    return Trajectory(_fixed(time_ns), slew_rad, radius_m, height_m, _fixed(corner.astype(np.int64)), bound_s)


def delayed(part: Trajectory, by_ns: int, *, since_ns: int | None = None) -> Trajectory:
    """Return a trajectory delayed by nanoseconds, if ``since_ns`` is given only from that time on."""
    by = np.int64(by_ns) if since_ns is None else np.where(part.time_ns >= since_ns, np.int64(by_ns), np.int64(0))
    return replace(part, time_ns=_fixed(part.time_ns + by))


def turned(part: Trajectory, turns: int) -> Trajectory:
    """Return a trajectory with whole turns added to its slewing angles."""
    return replace(part, slew_rad=_fixed(part.slew_rad + 2.0 * np.pi * turns)) if turns else part


def turned_to(part: Trajectory, slew_rad: float | None) -> Trajectory:
    """Return a trajectory with whole turns added, so that it begins nearest to a slewing angle."""
    return part if slew_rad is None else turned(part, round((slew_rad - float(part.slew_rad[0])) / (2.0 * np.pi)))


def one_after_another(parts: Sequence[Trajectory]) -> Trajectory:
    """Return trajectories that follow each other on one clock joined into one; between them the hook is at rest."""
    if len(parts) == 1:
        return parts[0]
    before = np.cumsum([0, *(len(part.time_ns) for part in parts)])
    corners = [part.corner + at for part, at in zip(parts, before, strict=False)]
    ends = np.array([[at - 1, at] for at in before[1:-1]], np.int64).ravel()
    return trajectory_of(
        np.concatenate([part.time_ns for part in parts]),
        np.concatenate([part.axes for part in parts]),
        np.unique(np.concatenate([*corners, ends])),
        sum(part.bound_s for part in parts),
    )


def between(whole: Trajectory, start_ns: int, end_ns: int) -> Trajectory:
    """Return the samples of a trajectory between two times, both included; its bound is divided by time."""
    inside = np.flatnonzero((whole.time_ns >= start_ns) & (whole.time_ns <= end_ns))
    first, last = int(inside[0]), int(inside[-1])
    corner = whole.corner[(whole.corner > first) & (whole.corner < last)] - first
    lasts_ns = max(1, int(whole.time_ns[-1]) - int(whole.time_ns[0]))
    share = (int(whole.time_ns[last]) - int(whole.time_ns[first])) / lasts_ns
    part = slice(first, last + 1)
    return trajectory_of(whole.time_ns[part].copy(), whole.axes[part], corner, share * whole.bound_s)


def stopped(part: Trajectory, stop: Trajectory, told_ns: int) -> Trajectory:
    """Return a trajectory up to the end of its stop; what follows is omitted.

    Args:
        part: The trajectory as planned.
        stop: The stop, times from its own start.
        told_ns: When braking begins, on the clock of ``part``.
    """
    driven = part.time_ns < told_ns
    return trajectory_of(
        np.concatenate([part.time_ns[driven], stop.time_ns + told_ns]),
        np.concatenate([part.axes[driven], stop.axes]),
        part.corner[part.corner < int(driven.sum())],
        part.bound_s,
    )


def _fixed(array: NDArray[Any]) -> NDArray[Any]:
    array.flags.writeable = False
    return array


def phases_from(start_ns: int, lengths_ns: Iterable[tuple[PhaseName, int]]) -> tuple[Phase, ...]:
    """Return phases that follow each other from a time on; those without duration are omitted."""
    phases = []
    for name, length_ns in lengths_ns:
        if length_ns > 0:
            phases.append(Phase(name, start_ns, start_ns + length_ns))
            start_ns += length_ns
    return tuple(phases)


def delayed_phases(phases: Iterable[Phase], by_ns: int) -> tuple[Phase, ...]:
    """Return phases moved in time."""
    return tuple(Phase(phase.name, phase.start_ns + by_ns, phase.end_ns + by_ns) for phase in phases)


def cut_at(phases: Iterable[Phase], end_ns: int) -> tuple[Phase, ...]:
    """Return the phases that start before a time, the last one cut there."""
    return tuple(Phase(p.name, p.start_ns, min(p.end_ns, end_ns)) for p in phases if p.start_ns < end_ns)


# Motions that are kept, moved in time.
#
# If a lift takes longer or shorter than before, all later lifts start later or earlier; nothing else about them
# changes. A motion counts its samples from its own start, so only its start, end and phases move. If the lift before it
# now ends after another number of turns, whole turns are added to its slewing angles.

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
    if motion.crane != before.crane:  # it has moved in between
        return starting(motion, before.end_ns)
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
    approach = None if motion.approach is None else turned(motion.approach, turns)
    raising, loaded = (turned(part, turns) for part in (motion.raising, motion.loaded))
    return replace(moved, approach=approach, raising=raising, loaded=loaded)


def approached(motion: LiftMotion, approach: Trajectory) -> LiftMotion:
    """Return a motion, from hook on the same, with another way of the empty hook to its part, and no stop on it."""
    assert motion.approach is not None
    by_ns = motion.start_ns + int(approach.time_ns[-1]) - motion.hooked_ns
    turns = round(float(approach.slew_rad[-1] - motion.approach.slew_rad[-1]) / (2.0 * np.pi))
    raising, loaded = (turned(delayed(part, by_ns), turns) for part in (motion.raising, motion.loaded))
    after = [phase for phase in motion.phases if phase.start_ns >= motion.hooked_ns]
    return replace(
        motion,
        approach=approach,
        raising=raising,
        loaded=loaded,
        phases=(
            *phases_from(motion.start_ns, [(PhaseName.APPROACH, int(approach.time_ns[-1]))]),
            *delayed_phases(after, by_ns),
        ),
        end_ns=motion.end_ns + by_ns,
    )


def waiting(motion: LiftMotion, wait_ns: int) -> LiftMotion:
    """Return a motion that begins with a stop at rest."""
    start_ns = motion.start_ns
    return replace(
        motion,
        approach=None if motion.approach is None else delayed(motion.approach, wait_ns),
        raising=delayed(motion.raising, wait_ns),
        loaded=delayed(motion.loaded, wait_ns),
        phases=(Phase(PhaseName.STOP, start_ns, start_ns + wait_ns), *delayed_phases(motion.phases, wait_ns)),
        end_ns=motion.end_ns + wait_ns,
    )


def held_longer(motion: LiftMotion, at_ns: int, by_ns: int) -> LiftMotion:
    """Return a motion that is held longer at a moment at which the crane rests; what came before stays.

    ``at_ns``: the end of a stop or the start of the load's transport, on the site's clock; all later times are delayed.
    """
    if by_ns == 0:
        return motion
    before = [phase for phase in motion.phases if phase.end_ns <= at_ns]
    after = delayed_phases(motion.phases[len(before) :], by_ns)
    stopped_ns = before.pop().start_ns if before and before[-1].name is PhaseName.STOP else at_ns
    return replace(
        motion,
        loaded=delayed(motion.loaded, by_ns, since_ns=at_ns - motion.start_ns),
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
    moved = delayed_phases(motion.phases, by_ns)
    return replace(motion, phases=moved, start_ns=start_ns, end_ns=motion.end_ns + by_ns)
