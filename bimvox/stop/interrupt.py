"""A lift that was stopped with its load in the air and resumed, as one motion."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from bimvox.errors import InputError
from bimvox.motion.swing import Pendulum
from bimvox.motion.time_plan import carrying_phases
from bimvox.motion.timeline import Timeline
from bimvox.motion.timing import NS_PER_S, frozen, sampled
from bimvox.records.motion import LiftMotion, Phase, PhaseName
from bimvox.records.trajectory import Trajectory
from bimvox.stop.emergency_stop import EmergencyStop

_CARRYING = (PhaseName.HOIST, PhaseName.TRAVERSE, PhaseName.LOWER, PhaseName.STOP)


def interrupted(
    motion: LiftMotion,
    stop: EmergencyStop,
    resume_ns: int,
    onward: Timeline,
    clearance_height_m: float,
    *,
    pendulum: Pendulum | None = None,
    sample_period_s: float,
    voxel_size_m: float,
) -> LiftMotion:
    """Return the motion of a lift that is stopped while its load is carried.

    Up to the stop it is unchanged; then the crane brakes, holds, and resumes from where it rests. Setting and releasing
    take as long as before. A lift may be interrupted more than once.

    Args:
        motion: The lift as planned.
        stop: Its stop (``stop_at``), begun while the load was carried.
        resume_ns: When the crane resumes, on the site's clock, not before it is at rest.
        onward: The motion from there to the place (``resume``).
        clearance_height_m: Height that the hook has to reach on it, for the lower bound of its time.
        pendulum: What hangs on the hook, if its moves are shaped.
        sample_period_s: Largest time between samples.
        voxel_size_m: Edge of a cell.

    Raises:
        InputError: If the stop does not begin while the load is carried, or the crane resumes before it is at rest.
    """
    loaded = motion.loaded
    told_ns = stop.start_ns - motion.start_ns
    if not loaded.time_ns[0] < told_ns < loaded.time_ns[-1]:
        raise InputError(f"lift {motion.number} carries nothing at {stop.start_ns / NS_PER_S:g} s")
    if resume_ns < stop.end_ns:
        raise InputError(f"lift {motion.number} is not at rest before {stop.end_ns / NS_PER_S:g} s")
    later = sampled(onward, clearance_height_m, sample_period_s, voxel_size_m, pendulum)
    whole = spliced(loaded, stop, later, told_ns, resume_ns - motion.start_ns)
    phases = [
        replace(phase, end_ns=min(phase.end_ns, stop.start_ns))
        for phase in motion.phases
        if phase.start_ns < stop.start_ns
    ]
    spans = [(PhaseName.STOP, resume_ns - stop.start_ns), *carrying_phases(onward, int(later.time_ns[-1]))]
    carried = max(i for i, phase in enumerate(motion.phases) if phase.name in _CARRYING)
    spans += [(phase.name, phase.end_ns - phase.start_ns) for phase in motion.phases[carried + 1 :]]
    at_ns = stop.start_ns
    for name, length_ns in spans:
        if length_ns > 0:
            phases.append(Phase(name, at_ns, at_ns + length_ns))
            at_ns += length_ns
    return replace(motion, loaded=whole, phases=tuple(phases), end_ns=at_ns)


def cut_short(motion: LiftMotion, stop: EmergencyStop | None) -> LiftMotion:
    """Return a lift up to the end of its stop; what follows is unknown.

    Args:
        motion: The lift as planned.
        stop: Its stop, begun while the load was carried; None if it was not carried yet: until its part is raised.
    """
    if stop is None:
        raised_ns = motion.start_ns + int(motion.loaded.time_ns[0])
        return replace(motion, phases=tuple(p for p in motion.phases if p.end_ns <= raised_ns), end_ns=raised_ns)
    loaded, told_ns = motion.loaded, stop.start_ns - motion.start_ns
    driven = loaded.time_ns < told_ns
    slew, radius, height = (
        frozen(np.concatenate([one[driven], other]))
        for one, other in zip(_axes(loaded), _axes(stop.trajectory), strict=True)
    )
    time_ns = frozen(np.concatenate([loaded.time_ns[driven], stop.trajectory.time_ns + told_ns]))
    corner = frozen(loaded.corner[loaded.corner < int(driven.sum())])
    phases = [replace(p, end_ns=min(p.end_ns, stop.start_ns)) for p in motion.phases if p.start_ns < stop.start_ns]
    return replace(
        motion,
        loaded=Trajectory(time_ns, slew, radius, height, corner, loaded.bound_s),
        phases=(*phases, Phase(PhaseName.STOP, stop.start_ns, stop.end_ns)),
        end_ns=stop.end_ns,
        departure=None,
    )


def spliced(part: Trajectory, stop: EmergencyStop, later: Trajectory, told_ns: int, again_ns: int) -> Trajectory:
    """Return a trajectory that is stopped on its way: the part before, stop, hold, and the part after.

    Args:
        part: The trajectory as planned; times from the start of its lift, as are the two times below.
        stop: Its stop.
        later: The part after, times from its own start.
        told_ns: When braking begins.
        again_ns: When the crane resumes.
    """
    driven = part.time_ns < told_ns
    skip = 1 if again_ns == told_ns + int(stop.trajectory.time_ns[-1]) else 0
    pieces = [
        (part.time_ns[driven], [axis[driven] for axis in _axes(part)]),
        (stop.trajectory.time_ns + told_ns, _axes(stop.trajectory)),
        (later.time_ns[skip:] + again_ns, [axis[skip:] for axis in _axes(later)]),
    ]
    first, before = int(driven.sum()), int(driven.sum()) + len(stop.trajectory.time_ns)
    rests = {before - 1, before - skip}
    corner = sorted({int(n) for n in part.corner if n < first} | rests | {int(n) + before - skip for n in later.corner})
    slew, radius, height = (np.concatenate([axes[i] for _, axes in pieces]) for i in range(3))
    return Trajectory(
        time_ns=frozen(np.concatenate([time_ns for time_ns, _ in pieces])),
        slew_rad=frozen(slew),
        radius_m=frozen(radius),
        height_m=frozen(height),
        corner=frozen(np.array(corner, np.int64)),
        bound_s=part.bound_s,
    )


def _axes(trajectory: Trajectory) -> list[NDArray[np.float64]]:
    return [trajectory.slew_rad, trajectory.radius_m, trajectory.height_m]
