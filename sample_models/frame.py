"""A frame of four columns and four beams, also in other units, in another schema, and far from the origin."""

from __future__ import annotations

from typing import Any

from sample_models.ifc_author import IfcAuthor
from sample_models.ifc_entities import ALONG_X, Point2, Vector

SPAN_M = 6.0
COLUMN_M = 0.4
COLUMN_HEIGHT_M = 3.0
BEAM_WIDTH_M, BEAM_HEIGHT_M = 0.3, 0.5
JOINT_M = 0.010

RD_NEW_ORIGIN_M: Vector = (155000.0, 463000.0, 0.0)
"""The centre of the Dutch national grid, EPSG:28992."""
CONCRETE_KG_M3 = 2400.0


def frame_ifc() -> bytes:
    """Return the frame as IFC4 in metres."""
    return _frame(IfcAuthor("frame")).to_bytes("frame.ifc")


def frame_ifc2x3_mm() -> bytes:
    """Return the same frame, with the same GlobalIds, as IFC2X3 in millimetres."""
    return _frame(IfcAuthor("frame", schema="IFC2X3", units_per_metre=1000)).to_bytes("frame_ifc2x3_mm.ifc")


def frame_georeferenced() -> bytes:
    """Return the frame as IFC4, drawn in map coordinates: its site lies 488 km from the origin of the file."""
    ifc = IfcAuthor("frame")
    crs = ifc.add(
        "IfcProjectedCRS",
        Name="EPSG:28992",
        Description="Amersfoort / RD New",
        GeodeticDatum="EPSG:6289",
        VerticalDatum="EPSG:5709",
        MapProjection="RD",
        MapUnit=ifc.add("IfcSIUnit", UnitType="LENGTHUNIT", Name="METRE"),
    )
    # The coordinates are already map coordinates, so the conversion only sets the zero height.
    ifc.add(
        "IfcMapConversion",
        SourceCRS=ifc.context,
        TargetCRS=crs,
        Eastings=0.0,
        Northings=0.0,
        OrthogonalHeight=3.2,
        XAxisAbscissa=1.0,
        XAxisOrdinate=0.0,
        Scale=1.0,
    )
    return _frame(ifc, RD_NEW_ORIGIN_M).to_bytes("frame_georeferenced.ifc")


def _frame(ifc: IfcAuthor, origin_m: Vector = (0, 0, 0)) -> IfcAuthor:
    site = ifc.spatial("IfcSite", "Site", origin_m)
    building = ifc.spatial("IfcBuilding", "Building", within=site)
    storey = ifc.storey("Ground floor", 0.0, within=building)
    crossings = (("A1", 0, 0), ("B1", 1, 0), ("A2", 0, 1), ("B2", 1, 1))
    columns, beams = [column(ifc, storey, *crossing) for crossing in crossings], _beams(ifc, storey)
    ifc.contain(storey, [*columns, *beams])
    ifc.made_of(ifc.material("C40/50", "concrete", CONCRETE_KG_M3), [*columns, *beams])
    weight = BEAM_WIDTH_M * BEAM_HEIGHT_M * (SPAN_M + COLUMN_M) * CONCRETE_KG_M3
    ifc.quantities("Qto_BeamBaseQuantities", "long beams", beams[:2], weight_kg=weight)
    return ifc


def column(ifc: IfcAuthor, storey: Any, name: str, bay_x: int, bay_y: int) -> Any:
    """Add a column at a crossing of the grid lines."""
    half = COLUMN_M / 2
    place = (half + SPAN_M * bay_x, half + SPAN_M * bay_y, 0)
    body = ifc.body_of([ifc.box((-half, -half, 0), (half, half, COLUMN_HEIGHT_M))])
    return ifc.product("IfcColumn", f"Column {name}", place, within=storey, body=body)


def beam(ifc: IfcAuthor, storey: Any, name: str, at_m: Point2, length_m: float, *, turned: bool) -> Any:
    """Add a beam on the columns from its lowest corner in plan: along x, or along y if turned.

    As usual for beams, the section is extruded along the beam's own axis.
    """
    section = ifc.rectangle((BEAM_WIDTH_M, BEAM_HEIGHT_M), (BEAM_WIDTH_M / 2, BEAM_HEIGHT_M / 2))
    solid = ifc.extrusion(section, length_m, axes=ALONG_X)
    # If turned to the left, the section would lie on the other side of the axis.
    x = at_m[0] + (BEAM_WIDTH_M if turned else 0.0)
    axes = ((0.0, 0.0, 1.0), (0.0, 1.0, 0.0) if turned else (1.0, 0.0, 0.0))
    place = (x, at_m[1], COLUMN_HEIGHT_M)
    return ifc.product("IfcBeam", f"Beam {name}", place, within=storey, body=ifc.body_of([solid]), axes=axes)


def _beams(ifc: IfcAuthor, storey: Any) -> list[Any]:
    # The beams along x lie end to end on the outer three quarters of the column heads. Those along y bear on the
    # remaining quarter: 90 mm, the practical minimum.
    outer = SPAN_M + COLUMN_M
    inner = outer - 2 * (BEAM_WIDTH_M + JOINT_M)
    far = outer - BEAM_WIDTH_M
    return [
        beam(ifc, storey, "1", (0.0, 0.0), outer, turned=False),
        beam(ifc, storey, "2", (0.0, far), outer, turned=False),
        beam(ifc, storey, "A", (0.0, BEAM_WIDTH_M + JOINT_M), inner, turned=True),
        beam(ifc, storey, "B", (far, BEAM_WIDTH_M + JOINT_M), inner, turned=True),
    ]
