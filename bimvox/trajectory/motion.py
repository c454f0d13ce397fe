"""The motion of a lift on the site's clock: empty hook to the part, hook on, raise, carry, set, release."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

from bimvox.trajectory.trajectory import Trajectory


class PhaseName(StrEnum):
    """The phases of a lift, in the order in which they come."""

    APPROACH = "approach"
    """The empty hook goes from the previous set point to this part."""
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
    """One lift over time. The site's clock starts at 0 with the first lift, and lifts follow each other.

    The times of the three trajectories count from ``start_ns``; between them the hook stands still.

    Attributes:
        order: Position in the assembly order.
        component: Index into ``Site.components``.
        approach: The empty hook from the previous set point to this part; None for the first lift.
        raising: From hook on to above its place in the yard, upright; where it was stored turned it is turned after.
        loaded: From there to its place in the building.
        phases: In order, without gaps, from ``start_ns`` to ``end_ns``; those that take no time are left out.
        start_ns: When the lift starts on the site's clock.
        end_ns: When the slings are off.
    """

    order: int
    component: int
    approach: Trajectory | None
    raising: Trajectory
    loaded: Trajectory
    phases: tuple[Phase, ...]
    start_ns: int
    end_ns: int

    @property
    def trajectories(self) -> tuple[Trajectory, ...]:
        """The trajectories in order."""
        return tuple(part for part in (self.approach, self.raising, self.loaded) if part is not None)

    def samples(self) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
        """Return the whole lift as one series.

        Returns:
            (N,) int64 times on the site's clock, ns, ascending, from ``start_ns`` to ``end_ns``, and (N, 3) float64
            slew (rad), radius (m) and height (m). Where the hook stands still there are only the two ends.
        """
        times = [part.time_ns for part in self.trajectories]
        axes = [np.stack([part.slew_rad, part.radius_m, part.height_m], axis=1) for part in self.trajectories]
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
