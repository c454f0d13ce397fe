"""The motion of a lift on the site's clock: empty hook to the part, hook on, raise, carry, set, release."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

from bimvox.records.trajectory import Trajectory


class PhaseName(StrEnum):
    """The phases of a lift, in the order in which they come."""

    APPROACH = "approach"
    """The empty hook goes from the previous set point to this part."""
    WAIT = "wait"
    """The empty hook stands still for another crane; only where a site has several."""
    HOOK_ON = "hook_on"
    """Slings are attached; the hook stands still."""
    RAISE = "raise"
    """The part is tipped up where it was stored lying, raised by one voxel, and held for the trial lift."""
    TURN = "turn"
    """A part that was stored turned is turned back; the hook stands still."""
    HOIST = "hoist"
    """Up, before slewing or trolleying begins."""
    TRAVERSE = "traverse"
    """From the start of slewing or trolleying until the part is only lowered; hoisting may overlap."""
    LOWER = "lower"
    """The last moves, from the start of the final descent."""
    SET = "set"
    """The part is aligned and fixed; the hook stands still."""
    RELEASE = "release"
    """Slings are taken off; the hook stands still."""
    LEAVE = "leave"
    """After its last lift the crane turns away, so that another one can work; only where a site has several."""
    STOP = "stop"
    """All axes brake to rest, and the crane waits; in no plan, only where one was interrupted."""


def quarters_of(turn: int) -> int:
    """Return how many quarters a part that lies turned by ``turn`` is turned, the shorter way round."""
    return min(turn % 4, -turn % 4)


@dataclass(frozen=True, slots=True)
class Phase:
    """A span of a lift.

    Attributes:
        name: A ``PhaseName``.
        start_ns: When it starts on the site's clock.
        end_ns: When it ends; the next one starts then.
    """

    name: PhaseName
    start_ns: int
    end_ns: int


@dataclass(frozen=True, slots=True, eq=False)
class LiftMotion:
    """One lift over time. The site's clock starts at 0 with the first lift, and lifts of a crane follow each other.

    The times of the three trajectories count from ``start_ns``; between them the hook stands still.

    Attributes:
        order: Position in the assembly order.
        component: Index into ``Site.components``.
        approach: The empty hook from the crane's previous set point to this part; None for its first lift.
        raising: From hook on to above its place in the yard, upright; where it was stored turned it is turned after.
        loaded: From there to its place in the building.
        phases: In order, without gaps, from ``start_ns`` to ``end_ns``; those that take no time are left out.
        start_ns: When the lift starts on the site's clock.
        end_ns: When the slings are off, and the crane has left where it does.
        crane: The crane that drives it: number in ``Site.cranes``.
        departure: The empty hook from the set point to a parking place, after the last lift of one of several cranes
            where it would be in another one's way; None elsewhere.
    """

    order: int
    component: int
    approach: Trajectory | None
    raising: Trajectory
    loaded: Trajectory
    phases: tuple[Phase, ...]
    start_ns: int
    end_ns: int
    crane: int = 0
    departure: Trajectory | None = None

    @property
    def number(self) -> int:
        """Number of the lift for people, from 1."""
        return self.order + 1

    @property
    def released_ns(self) -> int:
        """When the slings are off: the part stands by itself."""
        if self.departure is None:
            return self.end_ns
        return next(phase.end_ns for phase in self.phases if phase.name is PhaseName.RELEASE)

    @property
    def hooked_ns(self) -> int:
        """When the slings begin to be attached, or the part to be raised."""
        return next(phase.start_ns for phase in self.phases if phase.name in (PhaseName.HOOK_ON, PhaseName.RAISE))

    @property
    def raised_ns(self) -> int:
        """When the part is out of the yard, its trial lift done."""
        return next(phase.end_ns for phase in self.phases if phase.name is PhaseName.RAISE)

    @property
    def set_ns(self) -> int:
        """When the part has come to its place."""
        return self.start_ns + int(self.loaded.time_ns[-1])

    @property
    def trajectories(self) -> tuple[Trajectory, ...]:
        """The trajectories in order."""
        parts = (self.approach, self.raising, self.loaded, self.departure)
        return tuple(part for part in parts if part is not None)

    @property
    def stops_ns(self) -> tuple[tuple[int, int], ...]:
        """When it is stopped in need, and from when on it goes on, on the site's clock.

        While it is held the load is brought to rest: it hangs still when the crane goes on.
        """
        return tuple((phase.start_ns, phase.end_ns) for phase in self.phases if phase.name is PhaseName.STOP)

    def ways_ns(self, name: PhaseName) -> tuple[tuple[int, int, int | None], ...]:
        """Return the ways of the empty hook, by the name of their phase: when each begins and ends.

        Returns:
            For each: start, end (of its stop where it is stopped on the way), and when it is stopped; None where not.
        """
        found = []
        for n, phase in enumerate(self.phases):
            if phase.name is name:
                after = self.phases[n + 1] if n + 1 < len(self.phases) else phase
                stopped = after.name is PhaseName.STOP
                found.append(
                    (phase.start_ns, after.end_ns if stopped else phase.end_ns, after.start_ns if stopped else None)
                )
        return tuple(found)

    def samples(self) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
        """Return the whole lift as one series.

        Returns:
            (N,) int64 times on the site's clock, ns, ascending, from ``start_ns`` to ``end_ns``, and (N, 3) float64
            slew (rad), radius (m) and height (m). Where the hook stands still there are only the two ends.
        """
        times = [part.time_ns for part in self.trajectories]
        axes = [part.axes for part in self.trajectories]
        time_ns = np.concatenate([[0], *times, [self.end_ns - self.start_ns]])
        whole = np.concatenate([axes[0][:1], *axes, axes[-1][-1:]])
        steps = np.diff(time_ns)
        if (steps >= 0).all():
            once = np.concatenate([[True], steps > 0])
            return time_ns[once] + self.start_ns, whole[once]
        time_ns, first = np.unique(time_ns, return_index=True)
        return time_ns + self.start_ns, whole[first]

    def phase_at(self, time_ns: int) -> Phase:
        """Return the phase at a time on the site's clock; at a border the later one."""
        for phase in reversed(self.phases):
            if time_ns >= phase.start_ns:
                return phase
        return self.phases[0]

    def phase_name_at(self, time_ns: int) -> PhaseName:
        """Return the name of the phase at a time on the site's clock."""
        return self.phase_at(time_ns).name
