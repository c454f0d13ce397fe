"""What a cell is: one label per cell."""

from __future__ import annotations

from enum import IntEnum


class Label(IntEnum):
    """The label of a cell; fits uint8.

    ``voxelize`` knows AIR, GROUND, STRUCTURE and COMPONENT; the areas (on the slab's layer) and obstructions are
    painted when the site is built.
    """

    AIR = 0
    GROUND = 1
    CONSTRUCTION_AREA = 2
    YARD = 3
    STRUCTURE = 4
    OBSTRUCTION = 5
    COMPONENT = 6
