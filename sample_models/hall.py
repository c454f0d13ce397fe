"""A hall of six bays in a row: long enough for two cranes to work in parallel."""

from __future__ import annotations

from typing import Any

from sample_models.frame import BEAM_WIDTH_M, COLUMN_M, CONCRETE_KG_M3, JOINT_M, SPAN_M, beam, column
from sample_models.ifc_author import IfcAuthor

BAYS = 6


def hall_ifc() -> bytes:
    """Return the hall as IFC4 in metres: 14 columns, 12 beams along it, 7 across."""
    ifc = IfcAuthor("hall")
    site = ifc.spatial("IfcSite", "Site", (0, 0, 0))
    building = ifc.spatial("IfcBuilding", "Building", within=site)
    storey = ifc.storey("Ground floor", 0.0, within=building)
    columns = [column(ifc, storey, f"{'AB'[row]}{line + 1}", line, row) for line in range(BAYS + 1) for row in range(2)]
    parts = [*columns, *_along(ifc, storey), *_across(ifc, storey)]
    ifc.contain(storey, parts)
    ifc.made_of(ifc.material("C40/50", "concrete", CONCRETE_KG_M3), parts)
    return ifc.to_bytes("hall.ifc")


def _along(ifc: IfcAuthor, storey: Any) -> list[Any]:
    """Add beams along the hall, end to end in the middle of the column heads' outer three quarters."""
    beams = []
    for bay in range(BAYS):
        first, last = bay == 0, bay == BAYS - 1
        low = 0.0 if first else SPAN_M * bay + COLUMN_M / 2 + JOINT_M / 2
        high = SPAN_M * (bay + 1) + (COLUMN_M if last else COLUMN_M / 2 - JOINT_M / 2)
        for row, y in enumerate((0.0, SPAN_M + COLUMN_M - BEAM_WIDTH_M)):
            beams.append(beam(ifc, storey, f"{'AB'[row]}{bay + 1}", (low, y), high - low, turned=False))
    return beams


def _across(ifc: IfcAuthor, storey: Any) -> list[Any]:
    """Add beams across it, on the remaining quarter of the column heads, as in the frame."""
    length = SPAN_M + COLUMN_M - 2 * (BEAM_WIDTH_M + JOINT_M)
    middle, y = (COLUMN_M - BEAM_WIDTH_M) / 2, BEAM_WIDTH_M + JOINT_M
    return [
        beam(ifc, storey, str(line + 1), (SPAN_M * line + middle, y), length, turned=True) for line in range(BAYS + 1)
    ]
