"""Unit and axes of a mesh file, and which of them are assumed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bimvox.bim.mesh.contents import MeshContents, RawBody
from bimvox.bim.options import ReadOptions
from bimvox.bim.site_frame import FAR_M
from bimvox.units import METRES_PER_UNIT, metres_per

_METRES = {**METRES_PER_UNIT, "µm": 1e-6}
_TINY_M = 0.1
"""A model smaller than this is not a building."""
_HEAVY_KG = 1e6
"""A heavier part means a wrong unit: this is over five times what a crane lifts."""
_ROUNDED_M = 0.0005
"""Coordinates rounded by more than this give a note."""
_USABLE_M = 1e9
"""A coordinate beyond this is damaged, whatever the unit."""
_Y_UP_TO_Z_UP = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])


@dataclass(frozen=True, slots=True)
class Scale:
    """Conversion from a file's coordinates to metres, z up.

    Attributes:
        unit: Name of the unit.
        metres: The unit in metres.
        assumed: Whether the unit is assumed.
        y_up: Whether y points up in the file.
        notes: What was assumed, or overrides the file.
    """

    unit: str
    metres: float
    assumed: bool
    y_up: bool
    notes: tuple[str, ...]

    def vertices_m(self, body: RawBody) -> NDArray[np.float64]:
        """Return a body's vertices in metres, z up; unusable ones become NaN."""
        with np.errstate(invalid="ignore", over="ignore"):
            scaled = body.vertices * self.metres
            metres = np.where(np.abs(scaled) <= _USABLE_M, scaled, np.nan)
            return metres @ _Y_UP_TO_Z_UP.T + 0.0 if self.y_up else metres + 0.0


def scale_of(contents: MeshContents, options: ReadOptions) -> Scale:
    """Return unit and axes: as requested, otherwise as the file states, otherwise metres and z up, with a note.

    Raises:
        InputError: If the requested unit is unknown.
    """
    notes = []
    if options.unit is not None and contents.unit not in (None, options.unit):
        notes.append(f"read in {options.unit} as requested, although the file is in {contents.unit}")
    if options.up is not None and contents.up not in (None, options.up):
        notes.append(f"read with {options.up} up as requested, although the standard of the format is {contents.up} up")
    unit, up = options.unit or contents.unit, options.up or contents.up
    if unit is None and up is None:
        notes.append("the file states no unit: metres and z up are assumed; set unit and up (--unit, --up) otherwise")
    elif unit is None:
        notes.append("the file states no unit: metres are assumed; set unit (--unit) otherwise")
    elif up is None:
        notes.append("the file does not state which way is up: z is assumed; set up (--up) otherwise")
    metres = metres_per(options.unit) if options.unit is not None else _METRES[unit or "m"]
    return Scale(unit or "m", metres, unit is None, up == "y", tuple(notes))


def doubts(scale: Scale, size_m: float, heaviest_kg: float, rounding: float) -> list[str]:
    """Return notes on implausible sizes, masses and rounding.

    Args:
        scale: The unit and axes that were used.
        size_m: Longest side of the model.
        heaviest_kg: Mass of its heaviest body.
        rounding: Largest rounding of a coordinate, in the file's unit.
    """
    notes = []
    if size_m > FAR_M and scale.assumed:
        notes.append(f"in metres it spans {size_m:,.0f} m: the unit is most likely mm (unit, --unit)")
    elif heaviest_kg > _HEAVY_KG:
        notes.append(f"in {scale.unit} its heaviest body weighs {heaviest_kg / 1000:,.0f} t: check the unit")
    elif size_m > FAR_M or size_m < _TINY_M:
        notes.append(f"in {scale.unit} it spans {size_m:,.4g} m: check the unit")
    if rounding * scale.metres > _ROUNDED_M:
        millimetres = rounding * scale.metres * 1000
        notes.append(
            f"its coordinates are far from the origin in single precision: true to {millimetres:.2g} mm only; "
            "export it near the origin"
        )
    return notes
