"""A lift that was stopped, its load in the air or its hook empty: held, and resumed from where it rests."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from bimvox.crane.tower_crane import CranePose
from bimvox.errors import InputError, PlanningError
from bimvox.motion.drive import drive_path
from bimvox.motion.move import Line, Move, axes_of
from bimvox.motion.shortcut import move_is_free
from bimvox.motion.swept import HookEnd, LoadFrame, axes_of_cells, cells_of_axes, pose_next_to
from bimvox.motion.swing import RiggedCrane
from bimvox.motion.time_lift import carrying_phases
from bimvox.motion.timeline import Timeline, followed, in_sequence, sampled
from bimvox.motion.trajectories import cut_at, phases_from, stopped, trajectory_of
from bimvox.records.lift import Guide
from bimvox.records.motion import LiftMotion, Phase, PhaseName, Trajectory
from bimvox.site.collision import CollisionSpace, placement_is_free
from bimvox.stop.brake_axes import EmergencyStop
from bimvox.units import NS_PER_S


def resume_cells(space: CollisionSpace, load: LoadFrame, pose: CranePose) -> list[tuple[int, int, int]]:
    """Return the whole placements around a pose that a load can reach in a straight line, the nearest first.

    A path from one of them can be driven from the pose (:func:`resume`). Empty if the load is stuck.
    """
    at = cells_of_axes(load, axes_of(pose))
    cells = sorted(_around(at), key=lambda cell: (round(float(np.linalg.norm(np.subtract(cell, at))), 9), cell))
    return [
        cell
        for cell in cells
        if placement_is_free(space, *cell) and move_is_free(space, load, move_to_cell(load, pose, cell))
    ]


def resume(
    rigged: RiggedCrane,
    space: CollisionSpace,
    pose: CranePose,
    path_vox: NDArray[np.int32],
    contact_moves: int,
    guide: Guide | None = None,
    end_vox: HookEnd | None = None,
) -> tuple[Timeline, float]:
    """Return the motion of a load from rest at any pose to the end of a voxel path that begins next to it.

    Args:
        rigged: The crane with its load.
        space: The collision rule.
        pose: Where the crane rests.
        path_vox: (N, 3) int32 reference cells, N >= 2, the first one of :func:`resume_cells`.
        contact_moves: How many of the last placements were cleared by the narrow phase.
        guide: How a crew guides the load on its last moves.
        end_vox: Where the hook stops within the path's last cell; None: in the middle.

    Returns:
        The motion, and the height that the hook has to reach.

    Raises:
        PlanningError: If the first cell cannot be reached, the path is not free, or takes the hook above the jib.
    """
    load = rigged.load
    first = move_to_cell(load, pose, (int(path_vox[0, 0]), int(path_vox[0, 1]), int(path_vox[0, 2])))
    if not move_is_free(space, load, first):
        raise PlanningError(
            f"cell {path_vox[0].tolist()} cannot be reached from where the crane rests",
            hint="begin the path at one of the free cells around the load",
        )
    onward, needed_m = drive_path(rigged, space, path_vox, contact_moves, first.end.slew_rad, guide)
    if any(first.moving):
        onward = followed(in_sequence(rigged.crane, [first], rigged.pendulum), onward)
        needed_m = max(needed_m, pose.height_m)
    arrived = onward.moves[-1].end
    end = arrived if end_vox is None else pose_next_to(load, end_vox, arrived)
    if end != arrived:
        onward = followed(onward, in_sequence(rigged.crane, [Move(arrived, end, Line.SITE)], rigged.pendulum))
    return onward, needed_m


def _around(at: NDArray[np.float64]) -> Iterator[tuple[int, int, int]]:
    """Yield the up to eight whole placements around a continuous one."""
    low, high = np.floor(at + 1e-6).astype(int), np.ceil(at - 1e-6).astype(int)
    for x in range(low[0], high[0] + 1):
        for y in range(low[1], high[1] + 1):
            for z in range(low[2], high[2] + 1):
                yield (x, y, z)


def move_to_cell(load: LoadFrame, pose: CranePose, cell: tuple[int, int, int]) -> Move:
    """Return the straight move in the axes from a pose to a whole placement next to it."""
    slew, radius, height = axes_of_cells(load, np.array(cell)).tolist()
    turned = pose.slew_rad + float(np.remainder(slew - pose.slew_rad + np.pi, 2.0 * np.pi)) - np.pi
    return Move(pose, CranePose(turned, radius, height))


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

    ``stop``: its stop, begun while the load was carried; None if it was not carried yet: until its part is raised.
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
