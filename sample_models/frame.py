"""A frame of four columns and four beams, also in other units, in another schema, and far from the origin."""

from __future__ import annotations

from sample_models.ifc_author import IfcAuthor
from sample_models.ifc_entities import ALONG_X, Vector

SPAN_M = 6.0
COLUMN_M = 0.4
COLUMN_HEIGHT_M = 3.0
BEAM_WIDTH_M, BEAM_HEIGHT_M = 0.3, 0.5
JOINT_M = 0.010

RD_NEW_ORIGIN_M: Vector = (155000.0, 463000.0, 0.0)
"""The centre of the Dutch national grid, EPSG:28992."""
CONCRETE_KG_M3 = 2400.0


def frame_ifc(file_name: str = "frame.ifc") -> bytes:
    """Return the frame as IFC4 in metres."""
    return _frame(IfcAuthor("frame")).to_bytes(file_name)


def frame_ifc2x3_mm(file_name: str = "frame_ifc2x3_mm.ifc") -> bytes:
    """Return the same frame, with the same GlobalIds, as IFC2X3 in millimetres."""
    return _frame(IfcAuthor("frame", schema="IFC2X3", units_per_metre=1000)).to_bytes(file_name)


def frame_georeferenced(file_name: str = "frame_georeferenced.ifc") -> bytes:
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
    return _frame(ifc, RD_NEW_ORIGIN_M).to_bytes(file_name)


def _frame(ifc: IfcAuthor, origin_m: Vector = (0, 0, 0)) -> IfcAuthor:
    site = ifc.spatial("IfcSite", "Site", origin_m)
    building = ifc.spatial("IfcBuilding", "Building", within=site)
    storey = ifc.storey("Ground floor", 0.0, within=building)
    columns, beams = _columns(ifc, storey), _beams(ifc, storey)
    ifc.contain(storey, [*columns, *beams])
    ifc.made_of(ifc.material("C40/50", "concrete", CONCRETE_KG_M3), [*columns, *beams])
    weight = BEAM_WIDTH_M * BEAM_HEIGHT_M * (SPAN_M + COLUMN_M) * CONCRETE_KG_M3
    ifc.quantities("Qto_BeamBaseQuantities", "long beams", beams[:2], weight_kg=weight)
    return ifc


def _columns(ifc: IfcAuthor, storey: object) -> list[object]:
    half = COLUMN_M / 2
    return [
        ifc.product(
            "IfcColumn",
            f"Column {name}",
            (half + SPAN_M * i, half + SPAN_M * j, 0),
            within=storey,
            body=ifc.body_of([ifc.box((-half, -half, 0), (half, half, COLUMN_HEIGHT_M))]),
        )
        for name, i, j in (("A1", 0, 0), ("B1", 1, 0), ("A2", 0, 1), ("B2", 1, 1))
    ]


def _beams(ifc: IfcAuthor, storey: object) -> list[object]:
    # The beams along x lie end to end on the outer three quarters of the column heads. Those along y bear on the
    # remaining quarter: 90 mm, the practical minimum.
    outer = SPAN_M + COLUMN_M
    inner = outer - 2 * (BEAM_WIDTH_M + JOINT_M)
    far = outer - BEAM_WIDTH_M
    beams = []
    for name, at, length, turned in (
        ("1", (0.0, 0.0), outer, False),
        ("2", (0.0, far), outer, False),
        ("A", (0.0, BEAM_WIDTH_M + JOINT_M), inner, True),
        ("B", (far, BEAM_WIDTH_M + JOINT_M), inner, True),
    ):
        # As usual for beams: the section extruded along the beam's own axis.
        section = ifc.rectangle((BEAM_WIDTH_M, BEAM_HEIGHT_M), (BEAM_WIDTH_M / 2, BEAM_HEIGHT_M / 2))
        solid = ifc.extrusion(section, length, axes=ALONG_X)
        # If turned to the left, the section would lie on the other side of the axis.
        x = at[0] + (BEAM_WIDTH_M if turned else 0.0)
        axes = ((0.0, 0.0, 1.0), (0.0, 1.0, 0.0) if turned else (1.0, 0.0, 0.0))
        body = ifc.body_of([solid])
        beams.append(
            ifc.product("IfcBeam", f"Beam {name}", (x, at[1], COLUMN_HEIGHT_M), within=storey, body=body, axes=axes)
        )
    return beams
