"""The colours of pictures: those of ``bimvox.site.component``, and those that only pictures need.

Classes of parts and other groups use Paul Tol's light palette.
"""

from __future__ import annotations

from bimvox.records.proof import Severity
from bimvox.site.component import KIND_RGB, STATE_RGB, ConstructionState, Rgb

UNBUILT: Rgb = STATE_RGB[ConstructionState.UNBUILT]
IN_TRANSIT: Rgb = STATE_RGB[ConstructionState.IN_TRANSIT]
ARRIVED: Rgb = STATE_RGB[ConstructionState.ARRIVED]
ASSEMBLED: Rgb = STATE_RGB[ConstructionState.ASSEMBLED]

GROUND: Rgb = KIND_RGB["ground"]
CONSTRUCTION_AREA: Rgb = KIND_RGB["construction_area"]
YARD: Rgb = KIND_RGB["yard"]
ACCESS: Rgb = KIND_RGB["access"]
STRUCTURE: Rgb = KIND_RGB["structure"]
PROP: Rgb = (168, 20, 8)
OBSTRUCTION: Rgb = (52, 52, 56)  # the paper's black, lighter so that shading and edges are visible on it
CRANE: Rgb = KIND_RGB["crane"]
CRANE_EDGE: Rgb = (92, 74, 22)
CONCRETE: Rgb = (170, 168, 164)
ROPE: Rgb = (60, 60, 64)
FLOOR: Rgb = (234, 234, 230)

PATH: Rgb = IN_TRANSIT
CAST_IN_PLACE: Rgb = (176, 170, 152)
BUILT_IN_PLACE: Rgb = (188, 132, 108)
SET_BY_HAND: Rgb = (206, 184, 112)
OTHER_MEANS: Rgb = (146, 120, 168)
START_BOX: Rgb = (214, 120, 0)
TARGET_BOX: Rgb = (196, 62, 130)
IN_THE_WAY: Rgb = (196, 36, 24)

PAPER: Rgb = (250, 250, 248)
"""The background; flat, to keep the number of colours in a frame low."""
INK: Rgb = (40, 40, 44)
FAINT_INK: Rgb = (104, 104, 110)

CLASSES: tuple[Rgb, ...] = (
    (119, 170, 221),
    (238, 136, 102),
    (238, 221, 136),
    (68, 187, 153),
    (255, 170, 187),
    (187, 204, 51),
    (153, 221, 255),
    (170, 170, 0),
    (190, 170, 205),
)
"""Colours of the classes of parts, the most numerous class first; the last is shared by all further classes."""

SHARES: tuple[Rgb, ...] = ((255, 247, 188), (254, 227, 145), (254, 196, 79), (236, 112, 20), (153, 52, 4))
"""Colours of ranges of utilisation, from low to critical: of the scheme YlOrBr, which darkens step by step."""
REMARKS: dict[Severity, Rgb] = {
    Severity.SERIOUS: (238, 136, 102),
    Severity.MINOR: (238, 221, 136),
    Severity.NOTE: (153, 221, 255),
}
"""Colours of parts by their most severe remark."""
NO_GROUP: Rgb = (206, 206, 204)
"""Colour of parts that belong to no group."""
