"""A lift that was stopped with its load in the air and resumed, as one motion."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bimvox.errors import InputError
from bimvox.motion.phases import cut_at, phases_from
from bimvox.motion.rigged_crane import RiggedCrane
from bimvox.motion.time_lift import carrying_phases
from bimvox.motion.timeline import Timeline
from bimvox.motion.timing import sampled
from bimvox.motion.trajectories import stopped, trajectory_of
from bimvox.records.motion import LiftMotion, Phase, PhaseName
from bimvox.records.trajectory import Trajectory
from bimvox.stop.brake_axes import EmergencyStop
from bimvox.units import NS_PER_S

_CARRYING = (PhaseName.HOIST, PhaseName.TRAVERSE, PhaseName.LOWER, PhaseName.STOP)


def interrupted(
    motion: LiftMotion,
    stop: EmergencyStop,
    resume_ns: int,
    onward: Timeline,
    clearance_height_m: float,
    rigged: RiggedCrane,
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
        rigged: The crane with its load.

    Raises:
        InputError: If the stop does not begin while the load is carried, or the crane resumes before it is at rest.
    """
    loaded = motion.loaded
    told_ns = stop.start_ns - motion.start_ns
    if not loaded.time_ns[0] < told_ns < loaded.time_ns[-1]:
        raise InputError(f"lift {motion.number} carries nothing at {stop.start_ns / NS_PER_S:g} s")
    if resume_ns < stop.end_ns:
        raise InputError(f"lift {motion.number} is not at rest before {stop.end_ns / NS_PER_S:g} s")
    later = sampled(onward, clearance_height_m, rigged)
    spans = [(PhaseName.STOP, resume_ns - stop.start_ns), *carrying_phases(onward, int(later.time_ns[-1]))]
    carried = max(i for i, phase in enumerate(motion.phases) if phase.name in _CARRYING)
    spans += [(phase.name, phase.end_ns - phase.start_ns) for phase in motion.phases[carried + 1 :]]
    phases = (*cut_at(motion.phases, stop.start_ns), *phases_from(stop.start_ns, spans))
    whole = spliced(loaded, stop, later, told_ns, resume_ns - motion.start_ns)
    return replace(motion, loaded=whole, phases=phases, end_ns=phases[-1].end_ns)


def cut_short(motion: LiftMotion, stop: EmergencyStop | None) -> LiftMotion:
    """Return a lift up to the end of its stop; what follows is unknown.

    Args:
        motion: The lift as planned.
        stop: Its stop, begun while the load was carried; None if it was not carried yet: until its part is raised.
    """
    if stop is None:
        raised_ns = motion.start_ns + int(motion.loaded.time_ns[0])
        return replace(motion, phases=tuple(p for p in motion.phases if p.end_ns <= raised_ns), end_ns=raised_ns)
    return replace(
        motion,
        loaded=stopped(motion.loaded, stop.trajectory, stop.start_ns - motion.start_ns),
        phases=(*cut_at(motion.phases, stop.start_ns), Phase(PhaseName.STOP, stop.start_ns, stop.end_ns)),
        end_ns=stop.end_ns,
        departure=None,
    )


def spliced(part: Trajectory, stop: EmergencyStop, later: Trajectory, told_ns: int, again_ns: int) -> Trajectory:
    """Return a trajectory that is stopped and resumed: the part before, stop, hold, and the part after.

    Args:
        part: The trajectory as planned; times from the start of its lift, as are the two times below.
        stop: Its stop.
        later: The part after, times from its own start.
        told_ns: When braking begins.
        again_ns: When the crane resumes.
    """
    before = stopped(part, stop.trajectory, told_ns)
    count = len(before.time_ns)
    skip = 1 if again_ns == int(before.time_ns[-1]) else 0
    rests = {count - 1, count - skip}
    corner = sorted({*before.corner.tolist(), *rests, *(int(n) + count - skip for n in later.corner)})
    return trajectory_of(
        np.concatenate([before.time_ns, later.time_ns[skip:] + again_ns]),
        np.concatenate([before.axes, later.axes[skip:]]),
        np.array(corner, np.int64),
        part.bound_s,
    )
