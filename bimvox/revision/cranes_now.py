"""What several cranes have done of a plan at a given time, and whether a change meets what they are doing.

Parts are hooked on in the erection sequence (R1), so the lifts that have begun are always the first ones of the
sequence. The empty hooks may be anywhere between two parts.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bimvox.cranes.legs_from import CraneStart
from bimvox.motion.trajectories import between, delayed
from bimvox.proof.footprint import CellMask, hook_footprint, jib_meets, motion_footprint
from bimvox.records.lift import Lift
from bimvox.records.motion import LiftMotion, Phase, PhaseName
from bimvox.records.trajectory import Trajectory
from bimvox.revision.current_plan import CurrentPlan
from bimvox.revision.held_cranes import HeldHook, HookWay
from bimvox.site.site import Site
from bimvox.stop.redirect import is_set


@dataclass(frozen=True, slots=True, eq=False)
class CraneNow:
    """One crane at a given time.

    Attributes:
        number: Its index in ``Site.cranes``.
        stands: Slew (rad), radius (m) and height (m) at the start of the clock.
        motions: Motions of its lifts that have begun, by order, without the departure of the hook.
        ways: Moves of its empty hook that have begun since, in order.
    """

    number: int
    stands: tuple[float, float, float]
    motions: Mapping[int, LiftMotion]
    ways: tuple[HookWay, ...]

    @property
    def resumes_from(self) -> CraneStart:
        """The position from which it continues."""
        if self.ways:
            return CraneStart(self.motions, self.ways[-1].way.axes[-1])
        return CraneStart(self.motions, None if self.motions else np.array(self.stands))

    @property
    def is_safe(self) -> bool:
        """Whether its hook met nothing when it stopped."""
        return all(way.is_free for way in self.ways)

    @property
    def hook(self) -> HeldHook:
        """Where it is, for the record of held cranes."""
        return HeldHook(self.number, self.stands, self.ways)


def cranes_at(site: Site, current: CurrentPlan, now_ns: int) -> tuple[CraneNow, ...]:
    """Return the state of every crane that has lifts, at a given time.

    Args:
        site: The site.
        current: The current plan.
        now_ns: On the site's clock.
    """
    held = {} if current.held is None else {hook.crane: hook for hook in current.held.hooks}
    found = []
    for number in range(len(site.cranes)):
        own = [motion for motion in current.chain if motion.crane == number]
        if number in held:
            hook = held[number]
            found.append(CraneNow(number, hook.stands, {m.order: _without_leaving(m) for m in own}, hook.ways))
            continue
        if not own:
            continue
        hooked = [motion for motion in own if motion.hooked_ns < now_ns]
        ways = [*_ways_of(hooked[-1], PhaseName.LEAVE)] if hooked else []
        if len(hooked) < len(own):
            ways += _ways_of(own[len(hooked)], PhaseName.APPROACH)
        slew, radius, height = own[0].samples()[1][0].tolist()
        motions = {motion.order: _without_leaving(motion) for motion in hooked}
        begun = tuple(way for way in ways if way.start_ns < now_ns)
        found.append(CraneNow(number, (slew, radius, height), motions, begun))
    return tuple(found)


def is_met(site: Site, current: CurrentPlan, crane: CraneNow, added: NDArray[np.int32], now_ns: int) -> bool:
    """Return whether new obstructed cells meet the rest of what a crane is doing.

    Args:
        site: The site.
        current: The current plan.
        crane: The crane.
        added: (N, 3) the cells.
        now_ns: On the site's clock.
    """
    if not len(added):
        return False
    mask = CellMask(site.shape)
    mask.add(added)
    lifts = {lift.order: lift for lift in current.plan.lifts}
    if any(load_is_met(site, lifts[order], motion, added, now_ns) for order, motion in crane.motions.items()):
        return True
    for way in crane.ways:
        if way.end_ns > now_ns:
            motion = alone(way, crane.number)
            if mask.meets(hook_footprint(site, motion, way.way, now_ns)) or jib_meets(site, motion, added):
                return True
    return False


def load_is_met(site: Site, lift: Lift, motion: LiftMotion, added: NDArray[np.int32], now_ns: int) -> bool:
    """Return whether new obstructed cells meet the rest of the motion of a load on a hook.

    Args:
        site: The site.
        lift: The lift.
        motion: Its motion.
        added: (N, 3) the cells.
        now_ns: On the site's clock.
    """
    if not len(added) or is_set(motion, now_ns):
        return False
    mask = CellMask(site.shape)
    mask.add(added)
    return mask.meets(motion_footprint(site, lift, motion, now_ns)) or jib_meets(site, motion, added)


def motion_is_met(site: Site, current: CurrentPlan, motion: LiftMotion, added: NDArray[np.int32]) -> bool:
    """Return whether new obstructed cells meet a motion that has not begun.

    Args:
        site: The site.
        current: The current plan.
        motion: One of its motions.
        added: (N, 3) the cells.
    """
    if not len(added):
        return False
    mask = CellMask(site.shape)
    mask.add(added)
    if mask.meets(current.motion_footprints[motion.order]) or jib_meets(site, motion, added):
        return True
    leaves = motion.departure
    return leaves is not None and mask.meets(hook_footprint(site, motion, leaves, motion.start_ns))


def _without_leaving(motion: LiftMotion) -> LiftMotion:
    """Return the motion until its slings are off."""
    if motion.departure is None:
        return motion
    phases = tuple(phase for phase in motion.phases if phase.end_ns <= motion.released_ns)
    return replace(motion, departure=None, phases=phases, end_ns=motion.released_ns)


def _ways_of(motion: LiftMotion, name: PhaseName) -> Iterator[HookWay]:
    """Yield the moves of the empty hook in the approach or the departure of a motion."""
    whole = motion.approach if name is PhaseName.APPROACH else motion.departure
    if whole is None:
        return
    for start_ns, end_ns, stopped_ns in motion.ways_ns(name):
        # The last sample of a stop may be the one at which the next move starts.
        last_ns = end_ns - motion.start_ns - (0 if stopped_ns is None else 1)
        way = between(whole, start_ns - motion.start_ns, last_ns)
        yield HookWay(start_ns, delayed(way, -int(way.time_ns[0])), stopped_ns)


def alone(way: HookWay, crane: int) -> LiftMotion:
    """Return a move of a crane's empty hook as a separate motion."""
    end_ns = int(way.way.time_ns[-1])
    slew, radius, height = (np.repeat(axis, 2) for axis in way.way.axes[-1])
    still = Trajectory(np.array([end_ns, end_ns + 1]), slew, radius, height, np.zeros(0, np.int64), 0.0)
    ends_ns = way.start_ns + end_ns + 1
    phases = (Phase(PhaseName.APPROACH, way.start_ns, ends_ns),)
    return LiftMotion(-1, -1, way.way, still, still, phases, way.start_ns, ends_ns, crane)
