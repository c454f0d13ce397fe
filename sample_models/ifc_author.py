"""Authoring of buildings in IFC: the placement, geometry and properties of products."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from sample_models.ifc_entities import QUARTER_TURNS, UPRIGHT, Axes, IfcEntities, Point2, Vector


class IfcAuthor(IfcEntities):
    """Draws into one IFC file; all lengths in metres."""

    # Placement.

    def placement(self, at_m: Vector, *, within: Any = None, axes: Axes = UPRIGHT) -> Any:
        """Add a local placement; relative to the product ``within``."""
        return self.add(
            "IfcLocalPlacement",
            PlacementRelTo=within.ObjectPlacement if within is not None else None,
            RelativePlacement=self.axes(at_m, axes),
        )

    def spatial(self, ifc_class: str, name: str, at_m: Vector = (0, 0, 0), *, within: Any = None, **more: Any) -> Any:
        """Add a site, building or storey ``within`` another one, or below the project."""
        placement = self.placement(at_m, within=within)
        place = self.rooted(ifc_class, name, ObjectPlacement=placement, CompositionType="ELEMENT", **more)
        self.aggregate(within if within is not None else self.project, [place])
        return place

    def storey(self, name: str, elevation_m: float, *, within: Any) -> Any:
        """Add a storey of a building, at its elevation above the building's datum."""
        elevation = self.length(elevation_m)
        return self.spatial("IfcBuildingStorey", name, (0, 0, elevation_m), within=within, Elevation=elevation)

    def aggregate(self, whole: Any, parts: Sequence[Any]) -> None:
        """Record that ``whole`` consists of ``parts``."""
        name = f"parts of {whole.Name}" + (f": {parts[0].Name}" if whole.is_a("IfcSpatialStructureElement") else "")
        self.rooted("IfcRelAggregates", name, RelatingObject=whole, RelatedObjects=list(parts))

    def contain(self, place: Any, products: Sequence[Any]) -> None:
        """Put products into a storey (or a site)."""
        name = f"contents of {place.Name}"
        self.rooted("IfcRelContainedInSpatialStructure", name, RelatingStructure=place, RelatedElements=list(products))

    # Geometry.

    def polygon(self, outline_m: Sequence[Point2], voids_m: Sequence[Sequence[Point2]] = ()) -> Any:
        """Add a profile: a closed polygon, with or without polygonal voids."""
        outer, *inner = (self.polyline([*points, points[0]]) for points in (outline_m, *voids_m))
        if not inner:
            return self.add("IfcArbitraryClosedProfileDef", ProfileType="AREA", OuterCurve=outer)
        return self.add("IfcArbitraryProfileDefWithVoids", ProfileType="AREA", OuterCurve=outer, InnerCurves=inner)

    def polyline(self, points_m: Sequence[Point2]) -> Any:
        """Add a line through points."""
        return self.add("IfcPolyline", Points=[self.point(p) for p in points_m])

    def rectangle(self, size_m: Point2, centre_m: Point2 = (0, 0)) -> Any:
        """Add a rectangular profile."""
        return self.add(
            "IfcRectangleProfileDef",
            ProfileType="AREA",
            Position=self.add("IfcAxis2Placement2D", Location=self.point(centre_m)),
            XDim=self.length(size_m[0]),
            YDim=self.length(size_m[1]),
        )

    def extrusion(self, profile: Any, depth_m: float, at_m: Vector = (0, 0, 0), axes: Axes = UPRIGHT) -> Any:
        """Add a solid: a profile extruded along the local z axis."""
        return self.add(
            "IfcExtrudedAreaSolid",
            SweptArea=profile,
            Position=self.axes(at_m, axes),
            ExtrudedDirection=self.direction((0, 0, 1)),
            Depth=self.length(depth_m),
        )

    def box(self, low_m: Vector, high_m: Vector) -> Any:
        """Add a solid: an upright box between two corners."""
        (x0, y0, z0), (x1, y1, z1) = low_m, high_m
        return self.extrusion(self.rectangle((x1 - x0, y1 - y0), ((x0 + x1) / 2, (y0 + y1) / 2)), z1 - z0, (0, 0, z0))

    def body_of(self, solids: Sequence[Any]) -> Any:
        """Add a body of extruded solids."""
        return self._body("SweptSolid", list(solids))

    def curves(self, identifier: str, curves: Sequence[Any]) -> Any:
        """Add a representation of curves in plan, without a body."""
        return self.add(
            "IfcShapeRepresentation",
            ContextOfItems=self.subcontext(identifier, "PLAN_VIEW"),
            RepresentationIdentifier=identifier,
            RepresentationType="GeometricCurveSet",
            Items=[self.add("IfcGeometricCurveSet", Elements=list(curves))],
        )

    def body_like(self, kind: Any) -> Any:
        """Add a body that repeats the geometry of a type."""
        target = self._once(("identity",), "IfcCartesianTransformationOperator3D", LocalOrigin=self.point((0, 0, 0)))
        item = self.add("IfcMappedItem", MappingSource=kind.RepresentationMaps[0], MappingTarget=target)
        return self._body("MappedRepresentation", [item])

    def product(
        self,
        ifc_class: str,
        name: str,
        at_m: Vector = (0, 0, 0),
        *,
        within: Any,
        body: Any = None,
        axes: Axes = UPRIGHT,
        **more: Any,
    ) -> Any:
        """Add a product, with its own geometry or without any."""
        return self.rooted(
            ifc_class,
            name,
            ObjectPlacement=self.placement(at_m, within=within, axes=axes),
            Representation=self.add("IfcProductDefinitionShape", Representations=[body]) if body is not None else None,
            **more,
        )

    def product_type(self, ifc_class: str, name: str, solids: Sequence[Any], **more: Any) -> Any:
        """Add a type with geometry, to be repeated by :meth:`occurrence`."""
        origin = self.axes((0, 0, 0), UPRIGHT)
        source = self.add("IfcRepresentationMap", MappingOrigin=origin, MappedRepresentation=self.body_of(solids))
        return self.rooted(ifc_class, name, RepresentationMaps=[source], **more)

    def occurrence(self, kind: Any, name: str, at_m: Vector, *, within: Any, quarter_turns: int = 0) -> Any:
        """Add a product that repeats the geometry of its type; :meth:`define_by_type` relates it to that type."""
        axes = ((0.0, 0.0, 1.0), QUARTER_TURNS[quarter_turns % 4])
        ifc_class = kind.is_a().removesuffix("Type")
        return self.product(ifc_class, name, at_m, within=within, body=self.body_like(kind), axes=axes)

    # Properties.

    def define_by_type(self, kind: Any, products: Sequence[Any]) -> None:
        """Record that ``products`` are of type ``kind``."""
        name = f"type {kind.Name}"
        self.rooted("IfcRelDefinesByType", name, RelatingType=kind, RelatedObjects=list(products))

    def material(self, name: str, category: str, density_kg_m3: float) -> Any:
        """Add a material with its density."""
        if self.is_2x3:
            material = self.add("IfcMaterial", Name=name)
            self.add("IfcGeneralMaterialProperties", Material=material, MassDensity=density_kg_m3)
            return material
        material = self.add("IfcMaterial", Name=name, Category=category)
        density = self._single_value("MassDensity", "IfcMassDensityMeasure", density_kg_m3)
        self.add("IfcMaterialProperties", Name="Pset_MaterialCommon", Properties=[density], Material=material)
        return material

    def made_of(self, material: Any, objects: Sequence[Any]) -> None:
        """Associate a material with products or types."""
        name = f"made of {material.Name}"
        self.rooted("IfcRelAssociatesMaterial", name, RelatingMaterial=material, RelatedObjects=list(objects))

    def style(self, name: str, rgb: Vector, transparency: float | None = None) -> Any:
        """Add a surface style (IFC4 only)."""
        red, green, blue = (float(c) for c in rgb)
        colour = self.add("IfcColourRgb", Red=red, Green=green, Blue=blue)
        shading = self.add("IfcSurfaceStyleShading", SurfaceColour=colour, Transparency=transparency)
        return self.add("IfcSurfaceStyle", Name=name, Side="BOTH", Styles=[shading])

    def paint(self, solids: Sequence[Any], style: Any) -> None:
        """Give solids a style."""
        for solid in solids:
            self.add("IfcStyledItem", Item=solid, Styles=[style])

    def properties(self, name: str, of: str, objects: Sequence[Any], values: Mapping[str, tuple[str, Any]]) -> None:
        """Add properties to objects.

        Args:
            name: Name of the property set, for example ``Pset_BeamCommon``.
            of: What the objects are, to distinguish property sets of the same name.
            objects: The objects with these properties.
            values: Property to its measure type and value.
        """
        known = [self._single_value(key, measure, value) for key, (measure, value) in values.items()]
        self._define(self.rooted("IfcPropertySet", f"{name} of {of}", label=name, HasProperties=known), objects, of)

    def quantities(
        self,
        name: str,
        of: str,
        objects: Sequence[Any],
        *,
        volume_m3: float | None = None,
        weight_kg: float | None = None,
    ) -> None:
        """Add the net volume and the gross weight to objects, if given."""
        known = []
        if volume_m3 is not None:
            known.append(self.add("IfcQuantityVolume", Name="NetVolume", VolumeValue=round(volume_m3, 6)))
        if weight_kg is not None:
            known.append(self.add("IfcQuantityWeight", Name="GrossWeight", WeightValue=round(weight_kg, 3)))
        self._define(self.rooted("IfcElementQuantity", f"{name} of {of}", label=name, Quantities=known), objects, of)

    def _define(self, definition: Any, objects: Sequence[Any], of: str) -> None:
        name = f"{definition.Name} of {of}"
        self.rooted(
            "IfcRelDefinesByProperties", name, RelatingPropertyDefinition=definition, RelatedObjects=list(objects)
        )

    def _single_value(self, name: str, measure: str, value: Any) -> Any:
        return self.add("IfcPropertySingleValue", Name=name, NominalValue=self.file.create_entity(measure, value))

    def _body(self, kind: str, items: list[Any]) -> Any:
        return self.add(
            "IfcShapeRepresentation",
            ContextOfItems=self.body,
            RepresentationIdentifier="Body",
            RepresentationType=kind,
            Items=items,
        )
