"""How parts lie in the yard: the slinger's gap around each, and stacks.

The defaults, with what they rest on:

* the gap, 0.6 m: one person passes with slings in hand. Assumed; Hong Kong's Construction Sites (Safety) Regulations,
  38M, ask for 0.65 m where gangways carry materials and 0.4 m where they only carry people;
* the height of a stack, 1.5 m: slabs are slung from the ground. "To a maximum of chest height" (Stowell Concrete,
  on-site instructions for precast T-beams), read as 1.5 m;
* dunnage, 0.1 m: room for a strop between two parts. Assumed; suppliers ask for bearers straight above each other, near
  the lifting points, but seldom for a thickness;
* the number and the mass of parts in a stack, 10 and 24 t: a truckload. Assumed; the ground decides;
* a rack holds up to 10 walls, and its frame is 0.3 of their height deep. Assumed; suppliers ask for walls to stand,
  "braced in position by A frames or a racking system", and whoever supplies the frame proves that it is stable;
* the truck, a flat-bed semi-trailer of 13.6 x 3.0 x 2.8 m: the loading length within the 16.5 m of Directive 96/53/EC;
  3 m of width instead of its 2.55 m go with a permanent permit and without an escort (German practice); its 4.0 m of
  height less a deck at 1.2 m;
* the inloader, which carries panels that stand between its wheels, 9.5 x 1.5 x 3.65 m: data sheets.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Final

from bimvox.sparse import SPARSE


@dataclass(frozen=True, slots=True)
class YardRules:
    """How parts lie in the yard.

    Attributes:
        gap_m: Free width on plan around a part that is picked, up to the height of a head.
        stack_parts: Most parts in a stack; 1: no stacks.
        stack_height_m: Largest height of a stack, dunnage included.
        stack_kg: Largest mass of a stack.
        dunnage_m: Thickness of the dunnage between two parts of a stack, rounded up to whole cells.
        rack_parts: Most walls in a rack; 0: no racks.
        rack_depth: Depth of a rack's frame behind the last wall, as a share of the highest wall's height, rounded up to
            whole cells.
        truck_m: Length, width and height that parts may take on a truck; None: its load has no size.
    """

    gap_m: float = 0.6
    stack_parts: int = 10
    stack_height_m: float = 1.5
    stack_kg: float = 24_000.0
    dunnage_m: float = 0.1
    rack_parts: int = field(default=0, metadata=SPARSE)
    rack_depth: float = field(default=0.3, metadata=SPARSE)
    truck_m: tuple[float, float, float] | None = field(default=None, metadata=SPARSE)


HEADROOM_M: Final = 2.0
"""What is higher above the ground is not in the way of a person; assumed."""
TRUCK_M: Final = (13.6, 3.0, 2.8)
"""Length, width and height that parts may take on a truck."""
INLOADER_M: Final = (9.5, 1.5, 3.65)
"""Room for panels in an inloader."""
RACKED_THINNESS: Final = 4.0
"""A wall at least this many times as high as thick on plan stands in a rack; assumed."""
USUAL_YARD: Final = YardRules(rack_parts=10, truck_m=TRUCK_M)
TRUCK_KG: Final = 24_000.0
"""Payload of a truck in a new site file: 40 t (Directive 96/53/EC) less 16 t of tractor and trailer (assumed)."""
