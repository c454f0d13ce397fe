"""A hall of six bays in a row: long enough for two cranes to work in parallel."""

from __future__ import annotations

from sample_models.frame import BEAM_HEIGHT_M, BEAM_WIDTH_M, COLUMN_HEIGHT_M, COLUMN_M, CONCRETE_KG_M3, JOINT_M, SPAN_M
from sample_models.ifc_author import IfcAuthor
from sample_models.ifc_entities import ALONG_X

BAYS = 6


def hall_ifc(file_name: str = "hall.ifc") -> bytes:
    """Return the hall as IFC4 in metres: 14 columns, 12 beams along it, 7 across."""
    ifc = IfcAuthor("hall")
    site = ifc.spatial("IfcSite", "Site", (0, 0, 0))
    building = ifc.spatial("IfcBuilding", "Building", within=site)
    storey = ifc.storey("Ground floor", 0.0, within=building)
    parts = [*_columns(ifc, storey), *_along(ifc, storey), *_across(ifc, storey)]
    ifc.contain(storey, parts)
    ifc.made_of(ifc.material("C40/50", "concrete", CONCRETE_KG_M3), parts)
    return ifc.to_bytes(file_name)


def _columns(ifc: IfcAuthor, storey: object) -> list[object]:
    half = COLUMN_M / 2
    return [
        ifc.product(
            "IfcColumn",
            f"Column {'AB'[row]}{line + 1}",
            (half + SPAN_M * line, half + SPAN_M * row, 0),
            within=storey,
            body=ifc.body_of([ifc.box((-half, -half, 0), (half, half, COLUMN_HEIGHT_M))]),
        )
        for line in range(BAYS + 1)
        for row in range(2)
    ]


def _along(ifc: IfcAuthor, storey: object) -> list[object]:
    """Add beams along the hall, end to end in the middle of the column heads' outer three quarters."""
    beams = []
    for bay in range(BAYS):
        first, last = bay == 0, bay == BAYS - 1
        low = 0.0 if first else SPAN_M * bay + COLUMN_M / 2 + JOINT_M / 2
        high = SPAN_M * (bay + 1) + (COLUMN_M if last else COLUMN_M / 2 - JOINT_M / 2)
        for row, y in enumerate((0.0, SPAN_M + COLUMN_M - BEAM_WIDTH_M)):
            beams.append(_beam(ifc, storey, f"Beam {'AB'[row]}{bay + 1}", (low, y), high - low, turned=False))
    return beams


def _across(ifc: IfcAuthor, storey: object) -> list[object]:
    """Add beams across it, on the remaining quarter of the column heads, as in the frame."""
    length = SPAN_M + COLUMN_M - 2 * (BEAM_WIDTH_M + JOINT_M)
    middle = (COLUMN_M - BEAM_WIDTH_M) / 2
    return [
        _beam(
            ifc,
            storey,
            f"Beam {line + 1}",
            (SPAN_M * line + middle, BEAM_WIDTH_M + JOINT_M),
            length,
            turned=True,
        )
        for line in range(BAYS + 1)
    ]


def _beam(
    ifc: IfcAuthor, storey: object, name: str, at: tuple[float, float], length_m: float, *, turned: bool
) -> object:
    section = ifc.rectangle((BEAM_WIDTH_M, BEAM_HEIGHT_M), (BEAM_WIDTH_M / 2, BEAM_HEIGHT_M / 2))
    solid = ifc.extrusion(section, length_m, axes=ALONG_X)
    # If turned to the left, the section would lie on the other side of the axis.
    x = at[0] + (BEAM_WIDTH_M if turned else 0.0)
    axes = ((0.0, 0.0, 1.0), (0.0, 1.0, 0.0) if turned else (1.0, 0.0, 0.0))
    place = (x, at[1], COLUMN_HEIGHT_M)
    return ifc.product("IfcBeam", name, place, within=storey, body=ifc.body_of([solid]), axes=axes)
