"""How parts lie in the yard: the slinger's gap around each, and stacks.

The defaults, with what they rest on:

* the gap, 0.6 m: one person passes with slings in hand. Assumed; Hong Kong's Construction Sites (Safety) Regulations,
  38M, ask for 0.65 m where gangways carry materials and 0.4 m where they only carry people;
* the height of a stack, 1.5 m: slabs are slung from the ground. "To a maximum of chest height" (Stowell Concrete,
  on-site instructions for precast T-beams), read as 1.5 m;
* dunnage, 0.1 m: room for a strop between two parts. Assumed; suppliers ask for bearers straight above each other, near
  the lifting points, but seldom for a thickness;
* the number and the mass of parts in a stack, 10 and 24 t: a truckload. Assumed; the ground decides.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final


@dataclass(frozen=True, slots=True)
class YardRules:
    """How parts lie in the yard.

    Attributes:
        gap_m: Free width on plan around a part that is picked, up to the height of a head.
        stack_parts: Most parts in a stack; 1: no stacks.
        stack_height_m: Largest height of a stack, dunnage included.
        stack_kg: Largest mass of a stack.
        dunnage_m: Thickness of the dunnage between two parts of a stack, rounded up to whole cells.
    """

    gap_m: float = 0.6
    stack_parts: int = 10
    stack_height_m: float = 1.5
    stack_kg: float = 24_000.0
    dunnage_m: float = 0.1


HEADROOM_M: Final = 2.0
"""What is higher above the ground is not in the way of a person; assumed."""
USUAL_YARD: Final = YardRules()
TRUCK_KG: Final = 24_000.0
"""Payload of a truck in a new site file: 40 t (Directive 96/53/EC) less 16 t of tractor and trailer (assumed)."""
