"""Compares the loads that a log calls held with the file that says how they hang."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bimvox.errors import BimvoxError
from bimvox.library.compare import same, same_fields
from bimvox.log.archive import is_same_archive
from bimvox.log.held import HELD_CRANES_FILE, HELD_FILE, held_files, held_in
from bimvox.log.plan_log import PlanLog
from bimvox.records.lift import LOAD_IS_HELD, Lift
from bimvox.records.motion import LiftMotion, Trajectory
from bimvox.records.proof import Check
from bimvox.stop.redirect import Held

_SOURCE = "the file of held loads"
_SAME = 1e-3
"""A stop begins this close to where the motion was, and ends this close to where its axes rest; m or rad."""


def compare_held(check: Check, log: PlanLog) -> None:
    """Check that the loads that the plan calls held are those of the attached file, as it says, and where it says."""
    components = log.plan.site.components
    try:
        held = held_in(log.attachments)
    except BimvoxError as error:
        check.look(False, str(error))
        return
    for name, wanted in ({} if held is None else held_files(held)).items():
        same_bytes = is_same_archive(log.attachments[name], wanted)
        check.look(same_bytes, f"attached {name}: it has bytes that bimvox does not write; other readers may read more")
    both = log.attachments.keys() >= {HELD_FILE, HELD_CRANES_FILE}
    check.look(not both, f"it carries {HELD_FILE} and {HELD_CRANES_FILE}, but the cranes are held in one way only")
    file = HELD_CRANES_FILE if HELD_CRANES_FILE in log.attachments else HELD_FILE
    check.look(held is None or len(held.loads) > 0, f"attached {file}: it holds no load")
    loads = {} if held is None else {load.lift.order: load for load in held.loads}
    for lift in log.all_lifts:
        if (lift.reason or "").startswith(LOAD_IS_HELD):
            name = f"lift {lift.number} ({components[lift.component].label})"
            load = loads.pop(lift.order, None)
            there = load is not None and load.lift.component == lift.component
            check.look(there, f"{name}: its load is called held, but no attached file says where it hangs")
            if load is not None and there:
                same_fields(check, f"{name}: ", lift, load.infeasible, _SOURCE, but=("place", "path_vox", "left"))
                place, own = (
                    one.place and (one.place.cell_vox, one.place.pose, one.place.turn) for one in (lift, load.lift)
                )
                same(check, f"{name}: place", place, own, _SOURCE)
                check.look(load.motion.crane == components[lift.component].crane, f"{name}: another crane holds it")
                check.look(not (fault := _fault(load)), f"{name}: {fault}")
    for order in loads:
        check.look(False, f"the attached {file} holds lift {order + 1}; the plan does not")


def _stored(lift: Lift) -> tuple[object, ...]:
    place = lift.place
    return () if place is None else (place.delivery, place.cell_vox, place.pose.value, place.turn)


def _fault(load: Held) -> str:
    """Return why a load cannot hang so; empty if it can."""
    motion, stop = load.motion, load.stop
    if (motion.order, motion.component) != (load.lift.order, load.lift.component):
        return "it is held with the motion of another lift"
    ways = (*motion.trajectories, *(() if stop is None else (stop.trajectory,)))
    if not all(_is_sound(way) for way in ways):
        return "the times or positions of its motion make no sense"
    if stop is None:
        return ""
    if not motion.start_ns <= stop.start_ns <= motion.end_ns:
        return "it is stopped at a time at which it does not move"
    if np.abs(stop.trajectory.axes[0] - _axes_at(motion, stop.start_ns)).max() > _SAME:
        return "its stop begins where the load was not"
    rests = [axis.end for axis in stop.axes]
    return "" if np.abs(stop.trajectory.axes[-1] - rests).max() <= _SAME else "it hangs where its stop does not end"


def _is_sound(way: Trajectory) -> bool:
    ascending = len(way.time_ns) > 0 and bool((np.diff(way.time_ns) > 0).all())
    return ascending and len(way.axes) == len(way.time_ns) and bool(np.isfinite(way.axes).all())


def _axes_at(motion: LiftMotion, time_ns: int) -> NDArray[np.float64]:
    """Return (3,) the axes of a motion at a time on the site's clock."""
    times_ns, axes = motion.samples()
    return np.array([np.interp(time_ns, times_ns, axis) for axis in axes.T])
