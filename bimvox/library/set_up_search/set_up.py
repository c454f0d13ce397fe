"""What is tried: a machine with a jib and a reeving on a place, with a yard, alone or with a second crane."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bimvox.crane.machine import Machine
from bimvox.crane.reach import standing
from bimvox.crane.tower_crane import TowerCrane
from bimvox.site.config.site_config import Polygon


@dataclass(frozen=True, slots=True)
class Effort:
    """How much is tried.

    Attributes:
        members: How many set-ups are planned in full.
        yards: How many other yards are tried.
        seconds: No other yard is begun after so many seconds; None: no limit.
        cranes: How many cranes a set-up has at most, 1 or 2.
    """

    members: int = 6
    yards: int = 48
    seconds: float | None = None
    cranes: int = 2


@dataclass(frozen=True, slots=True)
class OtherYard:
    """A yard, or a truckload, that is not the site file's.

    Attributes:
        number: Of its proposal, from 0; None: the site file's yard, with another truckload.
        polygon: The yard.
        truckload_kg: Largest mass of a delivery.
    """

    number: int | None
    polygon: Polygon
    truckload_kg: float


@dataclass(frozen=True, slots=True, eq=False)
class Tried:
    """A machine with one jib and reeving on all places.

    Attributes:
        machine: Its name.
        jib_m: Length of its jib.
        falls: Of its rope.
        load_moment_tm: Size of the machine.
        crane: The crane on the place in question; None if its mast has no place.
        served: Number of parts that it serves from there.
        crane_s: Estimated crane time from there, of those that serve most parts with the swing of loads.
        lifts: So many lifts were laid over time for it; 0: the quick estimate, or that times a factor of its machine.
        bases_m: (B, 2) all places.
        all_served: (B,) number of parts served from each.
        all_crane_s: (B,) crane time from each by the quick estimate, without swing.
        why: Why the first part that it does not serve is not served; empty if it serves all.
        cost: Estimated cost from there, in the currency of the site.
        highest: Estimated highest utilisation from there.
        over: Why its cost is refused; empty if it is within the budget.
        is_least_used: Whether the place is the one of the lowest utilisation, not the fastest.
        yard: The yard if it is not the site file's.
        place: Which of several places of the mast it is, from 2; 0: the best by the estimate.
        second: The other crane of two, on its place; the parts served, the time and the cost are those of both.
    """

    machine: str
    jib_m: float
    falls: int
    load_moment_tm: float
    crane: TowerCrane | None
    served: int
    crane_s: float
    bases_m: NDArray[np.float64]
    all_served: NDArray[np.int64]
    all_crane_s: NDArray[np.float64]
    why: str
    cost: float
    highest: float = 0.0
    over: str = ""
    is_least_used: bool = False
    yard: OtherYard | None = None
    place: int = 0
    second: Tried | None = None
    lifts: int = 0

    @property
    def words(self) -> str:
        """The machine and its jib; of two cranes, both."""
        own = f"{self.machine} with a jib of {self.jib_m:g} m"
        return own if self.second is None else f"{own} and {self.second.words}"

    @property
    def cranes(self) -> int:
        """Number of cranes."""
        return 1 if self.second is None else 2


@dataclass(frozen=True, slots=True, eq=False)
class Rig:
    """A machine with one jib and reeving, on a mast as high as the site needs.

    Attributes:
        machine: The machine.
        jib_m: Length of its jib.
        usual: The crane with its usual rigging.
        crane: The crane as used: the permitted share of its chart, and the gear of the parts.
        hook_m: Height that its hook must reach.
    """

    machine: Machine
    jib_m: float
    usual: TowerCrane
    crane: TowerCrane
    hook_m: float

    @property
    def names(self) -> tuple[str, float, int, float]:
        """Name, jib, falls and load moment."""
        return self.machine.name, self.jib_m, self.usual.falls, self.machine.load_moment_tm

    @property
    def whole_chart(self) -> TowerCrane:
        """The crane as used, with its whole load chart."""
        return replace(self.crane, chart=self.usual.chart)

    def on(self, base_m: NDArray[np.float64], higher_m: float = 0.0) -> TowerCrane:
        """Return the crane on a base (2,), its mast higher by a length."""
        return replace(standing(self.usual, self.hook_m + higher_m), base_m=(*base_m.tolist(), 0.0))
