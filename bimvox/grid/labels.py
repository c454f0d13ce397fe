"""The labels of cells."""

from __future__ import annotations

from enum import IntEnum


class Label(IntEnum):
    """The label of a cell; fits uint8.

    ``voxelize`` sets AIR, GROUND, STRUCTURE and COMPONENT; the areas (in the slab's layer) and obstructions are set
    when the site is built.
    """

    AIR = 0
    GROUND = 1
    CONSTRUCTION_AREA = 2
    YARD = 3
    STRUCTURE = 4
    OBSTRUCTION = 5
    COMPONENT = 6
