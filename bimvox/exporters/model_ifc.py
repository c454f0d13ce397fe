"""A small IFC4 model of bodies: parts to be lifted, and what stands already.

The same bodies give the same bytes. Lengths are metres, masses kilograms.
"""

from __future__ import annotations

import uuid
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

import ifcopenshell
import ifcopenshell.guid

from bimvox.bim.building import TriangleMesh

LIFTED: Final = "lifted"
"""The tag of the parts that are to be lifted."""
SELECT_LIFTED: Final = f'IfcElement, Tag="{LIFTED}"'
"""The query that selects them."""
_NAMESPACE = uuid.UUID("2f6a1f0b-7c0e-5b53-8f6e-9d0a4c5e8b21")
_ANY = "IfcBuildingElementProxy"


@dataclass(frozen=True, slots=True, eq=False)
class Body:
    """One product of a model.

    Attributes:
        id: Unique among the bodies; its GlobalId follows from it unless it is one.
        name: Its name.
        ifc_class: Its class; a proxy if IFC4 has no such class of elements, or if it stands already.
        mesh: Its triangles, metres.
        mass_kg: Its mass; None if it stands already.
    """

    id: str
    name: str
    ifc_class: str
    mesh: TriangleMesh
    mass_kg: float | None = None

    @property
    def global_id(self) -> str:
        """The GlobalId in the file."""
        try:
            ifcopenshell.guid.expand(self.id)
        except (ValueError, KeyError, TypeError):
            return _guid(self.id)
        return self.id if len(self.id) == 22 else _guid(self.id)


def model_ifc(name: str, bodies: Sequence[Body]) -> bytes:
    """Return an IFC4 file of bodies.

    Args:
        name: Name of the project.
        bodies: What it holds. Those with a mass are tagged ``LIFTED``; the others are named as existing.
    """
    file: Any = ifcopenshell.file(schema="IFC4")
    file.header.file_name.time_stamp = "2024-01-01T00:00:00"

    def add(ifc_class: str, **attributes: Any) -> Any:
        return file.create_entity(ifc_class, **attributes)

    units = [
        add("IfcSIUnit", UnitType="LENGTHUNIT", Name="METRE"),
        add("IfcSIUnit", UnitType="MASSUNIT", Prefix="KILO", Name="GRAM"),
        add("IfcSIUnit", UnitType="PLANEANGLEUNIT", Name="RADIAN"),
    ]
    origin = add("IfcAxis2Placement3D", Location=add("IfcCartesianPoint", Coordinates=(0.0, 0.0, 0.0)))
    context = add(
        "IfcGeometricRepresentationContext",
        ContextIdentifier="Body",
        ContextType="Model",
        CoordinateSpaceDimension=3,
        WorldCoordinateSystem=origin,
    )
    project = add(
        "IfcProject",
        GlobalId=_guid(f"project {name}"),
        Name=name,
        RepresentationContexts=[context],
        UnitsInContext=add("IfcUnitAssignment", Units=units),
    )
    placement = add("IfcLocalPlacement", RelativePlacement=origin)
    site = add("IfcSite", GlobalId=_guid(f"site {name}"), Name=name, ObjectPlacement=placement)
    add("IfcRelAggregates", GlobalId=_guid("in the project"), RelatingObject=project, RelatedObjects=[site])
    products = []
    for body in bodies:
        corners = body.mesh.vertices_m.tolist()
        faces = add(
            "IfcTriangulatedFaceSet",
            Coordinates=add("IfcCartesianPointList3D", CoordList=corners),
            CoordIndex=(body.mesh.faces + 1).tolist(),
        )
        shape = add(
            "IfcShapeRepresentation",
            ContextOfItems=context,
            RepresentationIdentifier="Body",
            RepresentationType="Tessellation",
            Items=[faces],
        )
        product = add(
            _ANY if body.mass_kg is None else _class_of(body.ifc_class),
            GlobalId=body.global_id,
            Name=f"existing {body.name}" if body.mass_kg is None else body.name,
            ObjectPlacement=placement,
            Representation=add("IfcProductDefinitionShape", Representations=[shape]),
            Tag=None if body.mass_kg is None else LIFTED,
        )
        products.append(product)
        if body.mass_kg is not None:
            weight = add("IfcQuantityWeight", Name="GrossWeight", WeightValue=float(body.mass_kg))
            quantities = add(
                "IfcElementQuantity", GlobalId=_guid(f"mass {body.id}"), Name="BaseQuantities", Quantities=[weight]
            )
            add(
                "IfcRelDefinesByProperties",
                GlobalId=_guid(f"has the mass {body.id}"),
                RelatedObjects=[product],
                RelatingPropertyDefinition=quantities,
            )
    add(
        "IfcRelContainedInSpatialStructure",
        GlobalId=_guid("on the site"),
        RelatedElements=products,
        RelatingStructure=site,
    )
    return bytes(file.to_string().encode("ascii", "backslashreplace"))


def _class_of(ifc_class: str) -> str:
    """Return a class of IFC4 for an element; a proxy if IFC4 has none, or only an abstract one."""
    try:
        found = ifcopenshell.ifcopenshell_wrapper.schema_by_name("IFC4").declaration_by_name(ifc_class).as_entity()
    except RuntimeError:
        return _ANY
    above, is_element = found, False
    while above is not None:
        is_element, above = is_element or above.name() == "IfcElement", above.supertype()
    return _ANY if found is None or found.is_abstract() or not is_element else ifc_class


def _guid(text: str) -> str:
    return str(ifcopenshell.guid.compress(uuid.uuid5(_NAMESPACE, text).hex))
