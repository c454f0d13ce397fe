"""Which lifts of a plan with one crane are done at a time, and which one is under way."""

from __future__ import annotations

from bimvox.records.lift import Lift
from bimvox.records.motion import LiftMotion
from bimvox.revision.current_plan import CurrentPlan
from bimvox.stop.redirect import is_set


def last_finished(current: CurrentPlan, now_ns: int | None) -> int:
    """Return the order of the last lift that is done or was skipped; -1 if there is none.

    Later lifts have not begun, or are under way.

    Args:
        current: The plan.
        now_ns: The time on the site's clock; None if the plan is not being carried out.
    """
    if now_ns is None:
        return -1
    last = -1 if current.held is None else current.held.loads[0].lift.order - 1
    for order, motion in current.on_the_clock.items():
        if is_set(motion, now_ns):
            last = max(last, order)
        elif motion.start_ns < now_ns:
            last = max(last, order - 1)
    return last


def motion_under_way(current: CurrentPlan, lift: Lift, now_ns: int | None) -> LiftMotion | None:
    """Return the motion of a lift that is not done, if it is under way; otherwise None.

    Args:
        current: The plan.
        lift: One of its lifts.
        now_ns: The time on the site's clock; None if the plan is not being carried out.
    """
    if current.held is not None:
        held = current.held.loads[0]
        return held.motion if held.lift.order == lift.order else None
    if now_ns is None:
        return None
    motion = current.on_the_clock.get(lift.order)
    return motion if motion is not None and motion.start_ns < now_ns else None
