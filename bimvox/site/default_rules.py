"""What the rules of a site with a crane ask for if its site file does not say.

These defaults give way: a lift that cannot keep one is planned with what it can keep, and the plan says so. A value in
the site file is kept by every lift, or the lift is infeasible.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from math import radians
from typing import Final, NamedTuple

from bimvox.sparse import SPARSE

TRANSIT_CLEARANCE_M: Final = 2.0
"""Distance of a load in transit from finished work: 2 to 3 m are usual in lift plans (professional judgement)."""
ROPE_CLEARANCE_M: Final = 0.5
"""Half the width of a hook block of 1 m, so that the block passes where its rope does (professional judgement)."""
DEPARTURE_CLEARANCE_M: Final = 0.5
APPROACH_CLEARANCE_M: Final = 0.5
"""Of a load that goes straight up from the yard, or down to its place: nobody is trapped between it and what stands
beside it, 0.5 m for a body (EN ISO 13854; DGUV Vorschrift 52, section 11)."""
REST_ZONE_M: Final = 1.0
"""What is beside a part at rest, and no more than this higher than it, does not count on its way up or down: neighbours
touch it by design, and a crew guides it by hand so near its rest (professional judgement)."""
WIND_M_S: Final = 9.8
"""35 km/h, upper half of Beaufort 5: from 20 mph (9 m/s) on every lift is looked at again (29 CFR 1926.1431 for people,
professional judgement for panels). The wind limits of cranes, 20 m/s for most, assume a sail area of 1.2 m2 per tonne,
which panels exceed."""

LEAST_WIND_M_S: Final = 7.0
"""A lift that needs less is one for rare days: winds of Beaufort 4 reach 7.9 m/s. Glass and cladding panels are lifted
up to 8 m/s (GGR, "Take care in windy weather", for vacuum lifters); roofers stop handling large sheets in a mean wind
of 17 mph, 7.6 m/s (rules of the NFRC, as terrificexterior.com quotes them). A whole number below both (professional
judgement)."""

HIGHEST_UTILISATION: Final = 0.85
"""Of the load chart, for a pick or a set. A chart holds at rest, for the mass as it is: starting, stopping and a mass
that is a few per cent off take the rest (professional judgement)."""

DEFAULT_RULES: Final = {
    "highest_utilisation": HIGHEST_UTILISATION,
    "transit_clearance_m": TRANSIT_CLEARANCE_M,
    "rope_clearance_m": ROPE_CLEARANCE_M,
    "departure_clearance_m": DEPARTURE_CLEARANCE_M,
    "approach_clearance_m": APPROACH_CLEARANCE_M,
    "upending_clearance_m": TRANSIT_CLEARANCE_M,
    "turning_clearance_m": TRANSIT_CLEARANCE_M,
    "wind_speed_m_s": WIND_M_S,
    "least_wind_m_s": LEAST_WIND_M_S,
}
SMALLER_CLEARANCES_M: Final = (1.5, 1.0, 0.5, 0.25, 0.0)
"""What a lift keeps in transit if it cannot keep a default: the first of these that it can, of load and rope by
themselves. What it keeps otherwise is measured."""


class Kept(NamedTuple):
    """What a lift keeps of the clearances that give way, by the names of the rules; None: all of the rule."""

    transit_clearance_m: float | None = None
    rope_clearance_m: float | None = None
    departure_clearance_m: float | None = None
    approach_clearance_m: float | None = None
    upending_clearance_m: float | None = None
    turning_clearance_m: float | None = None


ALL_KEPT: Final = Kept()
NOTHING_KEPT: Final = Kept(*[0.0] * len(Kept._fields))


MOST_CONTACT_TOLERANCE_M = 0.1
"""More is not a tolerance: parts would be set into each other."""
MOST_SUPPORT_GAP_M = 1.0
MOST_SAMPLE_PERIOD_S = 60.0

MOST_WORK_S = 365 * 86_400.0
"""The longest work at a part that is cast in place; only a mass that makes no sense asks for more."""

ROAD_KG = 70_000.0
"""The heaviest precast girders that go by road as a single load (professional judgement)."""
ROAD_LENGTH_M = 40.0
"""The longest girders on a steered dolly (professional judgement)."""
ROAD_WIDTH_M = 5.5
"""Wider than two lanes of a main road less their margins (professional judgement)."""
ROAD_HEIGHT_M = 4.0
"""4.7 m under most bridges less a low bed's deck of 0.7 m (professional judgement)."""

FEW_HANDS_KG = 75.0
"""What three people or a small hoist handle; a crane lifts such parts by the bundle (professional judgement)."""

ON_GROUND_M = 0.3
"""What begins lower lies on the ground."""
FAR_FROM_GROUND_M = 100.0
"""No model of upper storeys alone begins further above the ground, and none ends further below it."""


# How parts lie in the yard: the slinger's gap around each, and stacks.
#
# The defaults, with what they rest on:
#
# * the gap, 0.6 m: one person passes with slings in hand. Assumed; Hong Kong's Construction Sites (Safety) Regulations,
#   38M, ask for 0.65 m where gangways carry materials and 0.4 m where they only carry people;
# * the height of a stack, 1.5 m: slabs are slung from the ground. "To a maximum of chest height" (Stowell Concrete,
#   on-site instructions for precast T-beams), read as 1.5 m;
# * dunnage, 0.1 m: room for a strop between two parts. Assumed; suppliers ask for bearers straight above each other,
#   near the lifting points, but seldom for a thickness;
# * the number and the mass of parts in a stack, 10 and 24 t: a truckload. Assumed; the ground decides;
# * a rack holds up to 10 walls, and its frame is 0.3 of their height deep. Assumed; suppliers ask for walls to stand,
#   "braced in position by A frames or a racking system", and whoever supplies the frame proves that it is stable;
# * the truck, a flat-bed semi-trailer of 13.6 x 3.0 x 2.8 m: the loading length within the 16.5 m of Directive
#   96/53/EC; 3 m of width instead of its 2.55 m go with a permanent permit and without an escort (German practice); its
#   4.0 m of height less a deck at 1.2 m;
# * the inloader, which carries panels that stand between its wheels, 9.5 x 1.5 x 3.65 m: data sheets.


@dataclass(frozen=True, slots=True)
class YardRules:
    """How parts lie in the yard; ``YardConfig``, the table of the site file, says what its fields mean.

    Attributes:
        truck_m: Length, width and height that parts may take on a truck; None: its load has no size.
        lorries: Most lorries of a delivery; 1: walls and others share one.
    """

    gap_m: float = 0.6
    stack_parts: int = 10
    stack_height_m: float = 1.5
    stack_kg: float = 24_000.0
    dunnage_m: float = 0.1
    rack_parts: int = field(default=0, metadata=SPARSE)
    rack_depth: float = field(default=0.3, metadata=SPARSE)
    truck_m: tuple[float, float, float] | None = field(default=None, metadata=SPARSE)
    lorries: int = field(default=1, metadata=SPARSE)


@dataclass(frozen=True, slots=True)
class FlipRules:
    """How parts are turned over between two hooks; ``TwoHooksConfig``, the table of the site file, says what it means.

    The share of 75 % is professional judgement, as is usual where two ropes carry one load. CICA's guidance on lifts
    with two hooks of one crane (2021) asks for the share of each hook, and for a designed lift where either hook could
    not carry the whole; Queensland's code for two cranes asks for 20 % more than the calculated share.
    """

    clear_m: float = 0.5
    most_share: float = 0.75
    turn_s: float = 120.0
    unhook_s: float = 90.0


@dataclass(frozen=True, slots=True)
class TandemRules:
    """How two cranes carry a part together; ``TandemConfig``, the table of the site file, says what it means.

    The share of 75 % is professional judgement, and usual; Queensland's code asks for 20 % more than the calculated
    share. How the load out of level moves mass from hook to hook follows from its geometry (ICSA N002, annex 1). While
    it is raised, 2 to 5 degrees are typical (H&J Engineering, dual lift calculator).
    """

    most_share: float = 0.75
    off_level_rad: float = radians(3.0)


HEADROOM_M: Final = 2.0
"""What is higher above the ground is not in the way of a person; assumed."""
TRUCK_M: Final = (13.6, 3.0, 2.8)
"""Length, width and height that parts may take on a truck."""
INLOADER_M: Final = (9.5, 1.5, 3.65)
"""Room for panels in an inloader."""
RACKED_THINNESS: Final = 4.0
"""A wall at least this many times as high as thick on plan stands in a rack; assumed."""
LORRIES: Final = 4
"""Lorries of a delivery: what a crane sets in two days (professional judgement)."""
FULL_LORRY: Final = 0.8
"""How full lorries are on average if the parts allow it, by mass or by room (professional judgement)."""
USUAL_YARD: Final = YardRules(rack_parts=10, truck_m=TRUCK_M, lorries=LORRIES)
TRUCK_KG: Final = 24_000.0
"""Payload of a truck in a new site file: 40 t (Directive 96/53/EC) less 16 t of tractor and trailer (assumed)."""
