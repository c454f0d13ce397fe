"""Small IFC files made by the tests: boxes of any class, in any unit, at any position."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import ifcopenshell
import ifcopenshell.guid
import numpy as np
import pytest

MM = "mm"
_UNITS: dict[str, float] = {"m": 1.0, "mm": 0.001, "ft": 0.3048}


class IfcMaker:
    """Builds one small IFC file."""

    def __init__(self, schema: str = "IFC4", unit: str = "m", map_at: Sequence[float] | None = None) -> None:
        self.file = ifcopenshell.file(schema=schema)
        self._metres = _UNITS[unit]
        self._units = self.file.create_entity("IfcUnitAssignment", Units=[self._unit(unit)])
        world = self.placement((0.0, 0.0, 0.0))
        self.context = self.file.create_entity(
            "IfcGeometricRepresentationContext",
            ContextType="Model",
            CoordinateSpaceDimension=3,
            Precision=1e-5,
            WorldCoordinateSystem=world,
        )
        self.project = self.rooted(
            "IfcProject", Name="test", UnitsInContext=self._units, RepresentationContexts=[self.context]
        )
        self.storey = self.rooted("IfcBuildingStorey", Name="Level 1")
        self.aggregate(self.project, [self.storey])
        if map_at is not None:
            crs = self.file.create_entity("IfcProjectedCRS", Name="EPSG:28992")
            east, north, height = map_at
            self.file.create_entity(
                "IfcMapConversion",
                SourceCRS=self.context,
                TargetCRS=crs,
                Eastings=east,
                Northings=north,
                OrthogonalHeight=height,
            )

    def _unit(self, unit: str) -> Any:
        si = self.file.create_entity("IfcSIUnit", UnitType="LENGTHUNIT", Name="METRE")
        if unit == MM:
            si.Prefix = "MILLI"
        if unit != "ft":
            return si
        ratio = self.file.create_entity("IfcMeasureWithUnit", self.file.create_entity("IfcLengthMeasure", 0.3048), si)
        none = self.file.create_entity("IfcDimensionalExponents", 1, 0, 0, 0, 0, 0, 0)
        return self.file.create_entity("IfcConversionBasedUnit", none, "LENGTHUNIT", "FOOT", ratio)

    def rooted(self, ifc_class: str, global_id: str | None = None, **attributes: Any) -> Any:
        """Make an entity with a GlobalId."""
        number = len(list(self.file))
        fixed = global_id or ifcopenshell.guid.compress(f"{number:032x}")
        return self.file.create_entity(ifc_class, GlobalId=fixed, **attributes)

    def placement(self, at_m: Sequence[float]) -> Any:
        """Make an axis placement, metres."""
        point = self.file.create_entity("IfcCartesianPoint", [float(value) / self._metres for value in at_m])
        return self.file.create_entity("IfcAxis2Placement3D", Location=point)

    def box(
        self,
        ifc_class: str,
        at_m: Sequence[float] = (0.0, 0.0, 0.0),
        size_m: Sequence[float] = (1.0, 1.0, 1.0),
        *,
        under: Any | None = None,
        inside_out: bool = False,
        **attributes: Any,
    ) -> Any:
        """Make a product whose body is a box: lowest corner and size in metres."""
        placed = self.file.create_entity(
            "IfcLocalPlacement", PlacementRelTo=under, RelativePlacement=self.placement(at_m)
        )
        body = self.brep(size_m, inside_out) if inside_out else self.extrusion(size_m)
        kind = "Brep" if inside_out else "SweptSolid"
        shape = self.file.create_entity("IfcShapeRepresentation", self.context, "Body", kind, [body])
        product = self.rooted(
            ifc_class,
            ObjectPlacement=placed,
            Representation=self.file.create_entity("IfcProductDefinitionShape", Representations=[shape]),
            **attributes,
        )
        if product.is_a("IfcElement"):
            self.rooted("IfcRelContainedInSpatialStructure", RelatedElements=[product], RelatingStructure=self.storey)
        return product

    def extrusion(self, size_m: Sequence[float]) -> Any:
        """Make a box by extrusion."""
        x, y, z = (value / self._metres for value in size_m)
        middle = self.file.create_entity("IfcCartesianPoint", [x / 2, y / 2])
        flat = self.file.create_entity("IfcAxis2Placement2D", Location=middle)
        profile = self.file.create_entity("IfcRectangleProfileDef", "AREA", None, flat, x, y)
        up = self.file.create_entity("IfcDirection", [0.0, 0.0, 1.0])
        return self.file.create_entity("IfcExtrudedAreaSolid", profile, self.placement((0, 0, 0)), up, z)

    def brep(self, size_m: Sequence[float], inside_out: bool) -> Any:
        """Make a box of six faces."""
        corners = np.array(np.meshgrid([0, 1], [0, 1], [0, 1], indexing="ij")).reshape(3, -1).T
        points = [
            self.file.create_entity("IfcCartesianPoint", [float(v) for v in row])
            for row in corners * np.array(size_m) / self._metres
        ]
        quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
        faces = []
        for quad in quads:
            loop = [points[index] for index in (quad[::-1] if inside_out else quad)]
            bound = self.file.create_entity("IfcFaceOuterBound", self.file.create_entity("IfcPolyLoop", loop), True)
            faces.append(self.file.create_entity("IfcFace", [bound]))
        return self.file.create_entity("IfcFacetedBrep", self.file.create_entity("IfcClosedShell", faces))

    def aggregate(self, whole: Any, parts: Sequence[Any]) -> None:
        """Make parts of a whole."""
        self.rooted("IfcRelAggregates", RelatingObject=whole, RelatedObjects=list(parts))

    def material(self, product: Any, name: str) -> None:
        """Give a product a material."""
        made_of = self.file.create_entity("IfcMaterial", Name=name)
        self.rooted("IfcRelAssociatesMaterial", RelatedObjects=[product], RelatingMaterial=made_of)

    def properties(self, product: Any, name: str, **values: Any) -> None:
        """Give a product a property set."""
        singles = []
        for key, value in values.items():
            kind = "IfcReal" if isinstance(value, float) else "IfcLabel"
            singles.append(
                self.file.create_entity(
                    "IfcPropertySingleValue", Name=key, NominalValue=self.file.create_entity(kind, value)
                )
            )
        relating = self.rooted("IfcPropertySet", Name=name, HasProperties=singles)
        self.rooted("IfcRelDefinesByProperties", RelatedObjects=[product], RelatingPropertyDefinition=relating)

    def write(self, path: Path) -> Path:
        """Write the file."""
        self.file.write(str(path))
        return path


@pytest.fixture
def maker() -> type[IfcMaker]:
    return IfcMaker


@pytest.fixture(scope="session")
def frame_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two columns, a beam on top, a slab, a footing, a door, a space, an accessory, a proxy; millimetres."""
    made = IfcMaker(unit=MM)
    for x in (0.0, 5.0):
        column = made.box("IfcColumn", (x, 0, 0), (0.3, 0.3, 3.0), Name=f"C{x:g}")
        made.material(column, "Steel S235")
    beam = made.box("IfcBeam", (0, 0, 3.0), (5.3, 0.3, 0.4), Name="B1")
    made.properties(beam, "Qto_BeamBaseQuantities", GrossWeight=1234.0)
    made.box("IfcSlab", (0, 0, 3.4), (5.3, 4.0, 0.2), Name="S1")
    made.box("IfcFooting", (-0.5, -0.5, -0.5), (1.3, 1.3, 0.5), Name="F1")
    made.box("IfcDoor", (2.0, 0, 0), (0.9, 0.1, 2.1), Name="D1")
    made.box("IfcSpace", (0, 0, 0), (5.0, 4.0, 3.0), Name="room")
    made.box("IfcDiscreteAccessory", (0, 0, 2.9), (0.1, 0.1, 0.01), Name="plate")
    made.box("IfcBuildingElementProxy", (9, 9, 0), (1, 1, 4), Name="tree")
    return made.write(tmp_path_factory.mktemp("ifc") / "frame.ifc")
