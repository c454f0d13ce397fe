"""The ``[yard]`` table of a site file: how parts lie in the yard."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from bimvox.site.config.validation import NotNegative, Positive, Table, Whole
from bimvox.site.yard_rules import TRUCK_M, USUAL_YARD, YardRules


class YardConfig(Table):
    """How parts lie in the yard. Without this table: one cell apart and never on each other.

    In a stack, the part that is lifted first lies on top. Flat parts that fill their box are stacked: slabs and beams
    that are not upended, no higher together than the lowest one is wide. In a rack, thin upright walls stand one behind
    the other, the one that is lifted first outermost.
    """

    gap_m: Annotated[NotNegative, Field(le=10.0)] = USUAL_YARD.gap_m
    """Free width around a part when it is picked, for the slinger; rounded up to whole cells."""
    stack_parts: Annotated[Whole, Field(ge=1, le=100)] = USUAL_YARD.stack_parts
    """Most parts in a stack; 1: no stacks."""
    stack_height_m: Annotated[Positive, Field(le=10.0)] = USUAL_YARD.stack_height_m
    """Largest height of a stack."""
    stack_kg: Positive = USUAL_YARD.stack_kg
    """Largest mass of a stack."""
    dunnage_m: Annotated[NotNegative, Field(le=1.0)] = USUAL_YARD.dunnage_m
    """Between two parts of a stack or rack; at least one cell."""
    rack_parts: Annotated[Whole, Field(ge=0, le=100)] = USUAL_YARD.rack_parts
    """Most walls that stand one behind the other in a rack; 0: no racks."""
    rack_depth: Annotated[NotNegative, Field(le=2.0)] = USUAL_YARD.rack_depth
    """Depth of a rack's frame behind the last wall, as a share of the highest wall's height; at least one cell."""
    truck_length_m: Annotated[Positive, Field(le=100.0)] = TRUCK_M[0]
    """Length on a truck. A larger part comes by a special transport, panels may come in an inloader."""
    truck_width_m: Annotated[Positive, Field(le=100.0)] = TRUCK_M[1]
    """Width that parts may take on a truck."""
    truck_height_m: Annotated[Positive, Field(le=100.0)] = TRUCK_M[2]
    """Height that parts may take above the bed of a truck."""

    def rules(self) -> YardRules:
        """Return the table as a value for the planner."""
        values = self.model_dump()
        truck_m = (values.pop("truck_length_m"), values.pop("truck_width_m"), values.pop("truck_height_m"))
        return YardRules(**values, truck_m=truck_m)
