"""Moves shaped so that the load hangs at rest when they end.

Zero-vibration shaping (Singer & Seering, "Preshaping Command Inputs to Reduce System Vibration", J. Dyn. Sys., Meas.,
Control 112, 1990): a command in two halves, half a period apart, leaves no swing; in three parts (1/4, 1/2, 1/4) little
even if the period differs from the assumed one. The share driven of a move's line is shaped, so the hook keeps to the
line that was found free, and no limit is exceeded because the result is a mean of the profile.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from bimvox.motion.profile import PARTS, TIMES, Profile

TWO = (0.5, 0.5)
THREE = (0.25, 0.5, 0.25)


@dataclass(frozen=True, slots=True, eq=False)
class ShapedProfile:
    """A rest-to-rest profile of the share 0..1, driven in parts.

    Attributes:
        base: The profile that is driven in parts.
        parts: Their sizes, together 1.
        apart_s: Time from one part to the next.
        duration_s: Time at which the share 1 is reached.
        row: ``ROW`` float64 for kernels.
    """

    base: Profile
    parts: tuple[float, ...]
    apart_s: float
    duration_s: float = field(init=False)
    row: NDArray[np.float64] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        count = len(self.parts)
        object.__setattr__(self, "duration_s", self.base.duration_s + (count - 1) * self.apart_s)
        row = self.base.row.copy()
        row[TIMES, 1:] = self.apart_s, self.duration_s, len(self.base.pieces), count
        row[PARTS, :count] = self.parts
        object.__setattr__(self, "row", row)

    @property
    def top_rate(self) -> float:
        """Upper bound of the rate of the share, 1/s."""
        return self.base.top_rate

    def share_at(self, time_s: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the share driven at each time: 0 before the start, 1 after the end."""
        share = np.zeros(len(time_s))
        for n, part in enumerate(self.parts):
            share += part * self.base.share_at(time_s - n * self.apart_s)
        return np.where(time_s >= self.duration_s, 1.0, share)


@dataclass(frozen=True, slots=True)
class Calm:
    """How a move is shaped to keep its load from swinging.

    Attributes:
        parts: Sizes of the parts in which it is driven.
        stretch: Time between the parts, in half periods at the move's height.
        pace: Share of the axes' rates at which it is driven; accelerations scale with its square. Along a line that is
            straight in the site only these and the jerks are scaled.
    """

    parts: tuple[float, ...] = TWO
    stretch: float = 1.0
    pace: float = 1.0


_SHAPED = (
    Calm(),
    Calm(TWO, 1.1),
    Calm(TWO, 1.2),
    Calm(THREE, 1.05),
    Calm(THREE, 0.95),
    Calm(THREE, 1.15),
)
FIRST_SLOW = len(_SHAPED)
"""From here on each rung of the ladder is the rung before it, driven slower."""
_PACES = (0.95, 0.9, 0.8, 0.72, 0.65, 0.57, 0.5, 0.42, 0.35, 0.3, 0.25, 0.21, 0.18, 0.15, 0.12)
LADDER = (*_SHAPED, *(Calm(THREE, 1.05, pace) for pace in _PACES))
"""Shapings of a move, tried in this order until the load hangs at rest where it must. Slewing differs from what shaping
assumes (the jib turns under the swinging load and pulls it inward), and hoisting changes the period."""
