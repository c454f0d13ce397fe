"""Where the load is at every moment of a lift."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bimvox.records.lift import Lift
from bimvox.site.construction import ConstructionState


@dataclass(frozen=True, slots=True, eq=False)
class LiftTimes:
    """When the load of a lift enters each state, on the site's clock.

    Attributes:
        lift: The lift.
        start_ns: When the lift starts.
        lifted_ns: When the load leaves its place in the yard.
        arrived_ns: When it is at its place in the building.
        assembled_ns: When it is fixed there; until then it hangs on the hook.
        end_ns: When the lift ends.
    """

    lift: Lift
    start_ns: int
    lifted_ns: int
    arrived_ns: int
    assembled_ns: int
    end_ns: int

    @property
    def states(self) -> tuple[tuple[int, ConstructionState], ...]:
        """When the load enters each state, ascending."""
        return (
            (self.start_ns, ConstructionState.UNBUILT),
            (self.lifted_ns, ConstructionState.IN_TRANSIT),
            (self.arrived_ns, ConstructionState.ARRIVED),
            (self.assembled_ns, ConstructionState.ASSEMBLED),
        )

    def state_at(self, time_ns: int) -> ConstructionState:
        """Return the state at a time on the site's clock."""
        return next((state for at_ns, state in self.states[::-1] if at_ns <= time_ns), ConstructionState.UNBUILT)


@dataclass(frozen=True, slots=True, eq=False)
class LoadTrack(LiftTimes):
    """The track of a lift's load on the site's clock.

    Attributes:
        time_ns: (N,) int64 samples from ``lifted_ns`` to ``assembled_ns``.
        corner_m: (N, 3) float64 origin of the component's frame: the lowest corner of its reference cell, site metres.
        tilt: (N, 4) float64 quaternion x, y, z, w: its rotation relative to the built-in position; the identity except
            while a part stored lying is tipped up, until a part stored turned is turned back, and while a load turns
            with the jib.
    """

    time_ns: NDArray[np.int64]
    corner_m: NDArray[np.float64]
    tilt: NDArray[np.float64]
