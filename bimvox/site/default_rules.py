"""What the rules of a site with a crane ask for if its site file does not say.

These defaults give way: a lift that cannot keep one is planned with what it can keep, and the plan says so. A value in
the site file is kept by every lift, or the lift is infeasible.
"""

from __future__ import annotations

from typing import Final, NamedTuple

TRANSIT_CLEARANCE_M: Final = 2.0
"""Distance of a load in transit from finished work: 2 to 3 m are usual in lift plans (professional judgement)."""
ROPE_CLEARANCE_M: Final = 0.5
"""Half the width of a hook block of 1 m, so that the block passes where its rope does (professional judgement)."""
WIND_M_S: Final = 9.8
"""35 km/h, upper half of Beaufort 5: from 20 mph (9 m/s) on every lift is looked at again (29 CFR 1926.1431 for people,
professional judgement for panels). The wind limits of cranes, 20 m/s for most, assume a sail area of 1.2 m2 per tonne,
which panels exceed."""

DEFAULT_RULES: Final = {
    "transit_clearance_m": TRANSIT_CLEARANCE_M,
    "rope_clearance_m": ROPE_CLEARANCE_M,
    "wind_speed_m_s": WIND_M_S,
}
SMALLER_CLEARANCES_M: Final = (1.0, 0.5, 0.0)
"""What a lift keeps if it cannot keep a default: the first of these that it can, of each clearance by itself."""


class Kept(NamedTuple):
    """What a lift keeps of the clearances that give way, by the names of the rules; None: all of the rule."""

    transit_clearance_m: float | None = None
    rope_clearance_m: float | None = None


ALL_KEPT: Final = Kept()
NOTHING_KEPT: Final = Kept(0.0, 0.0)
