"""One crane that moves during the job: its set-ups, one after the other, and how long it takes from one to the next.

``Site.cranes`` holds the crane once for each set-up, and ``Component.crane`` is the set-up in which a part is lifted.
At any time the crane is in one of them: the carrier, its outriggers and its counterweight exist nowhere else.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import hypot

from bimvox.crane.tower_crane import TowerCrane


@dataclass(frozen=True, slots=True)
class Moving:
    """The set-ups of a crane that moves, and how it moves.

    Attributes:
        names: Name of each set-up, in the order of ``Site.cranes``, which is the one in which the crane stands there.
        derig_s: Time until it can drive.
        drive_m_s: How fast it drives, along the straight line.
        rig_s: Time from its arrival to the first lift.
    """

    names: tuple[str, ...]
    derig_s: float
    drive_m_s: float
    rig_s: float

    def drive_s(self, one: TowerCrane, other: TowerCrane) -> float:
        """Return how long the crane drives from one set-up to another."""
        return hypot(other.base_m[0] - one.base_m[0], other.base_m[1] - one.base_m[1]) / self.drive_m_s
