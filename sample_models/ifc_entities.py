"""IFC entities whose bytes depend only on the order of the calls.

GlobalIds come from the project and the part's name, step ids from the order of the calls, the header from constants:
the same drawing gives the same bytes. Lengths are given in metres; the file may be in millimetres.
"""

from __future__ import annotations

import uuid
from collections.abc import Sequence
from typing import Any

import ifcopenshell
import ifcopenshell.guid

Point2 = tuple[float, float]
Vector = tuple[float, float, float]
Axes = tuple[Vector, Vector]
"""Directions of a local z axis and a local x axis."""

TIME_STAMP = "2024-01-01T00:00:00"
UNIX_TIME = 1704067200
AUTHOR = "bimvox sample_models"
NAMESPACE = uuid.uuid5(uuid.NAMESPACE_URL, "urn:bimvox:sample_models")

UPRIGHT: Axes = ((0, 0, 1), (1, 0, 0))
ACROSS_Y: Axes = ((0, -1, 0), (1, 0, 0))
"""For outlines drawn in the x-z plane: they are extruded towards -y."""
ALONG_X: Axes = ((1, 0, 0), (0, 1, 0))
"""For outlines drawn in the y-z plane: they are extruded towards +x."""
QUARTER_TURNS: tuple[Vector, ...] = ((1, 0, 0), (0, 1, 0), (-1, 0, 0), (0, -1, 0))
"""Local x axis after 0, 1, 2, 3 quarter turns to the left, seen from above."""


class IfcEntities:
    """One IFC file with its project, units and body context.

    Args:
        project: Name of the project; parts of the same project and name have the same GlobalId in every file.
        schema: ``IFC4`` or ``IFC2X3``.
        units_per_metre: 1 writes metres, 1000 millimetres.
    """

    def __init__(self, project: str, *, schema: str = "IFC4", units_per_metre: int = 1) -> None:
        self.file: Any = ifcopenshell.file(schema=schema)
        self.is_2x3 = schema == "IFC2X3"
        self._project_name = project
        self._scale = units_per_metre
        self._shared: dict[tuple[object, ...], Any] = {}
        # Optional in IFC4, mandatory in IFC2X3.
        self._owner = self._owner_history() if self.is_2x3 else None
        units = [
            self.add(
                "IfcSIUnit", UnitType="LENGTHUNIT", Prefix={1: None, 1000: "MILLI"}[units_per_metre], Name="METRE"
            ),
            self.add("IfcSIUnit", UnitType="AREAUNIT", Name="SQUARE_METRE"),
            self.add("IfcSIUnit", UnitType="VOLUMEUNIT", Name="CUBIC_METRE"),
            self.add("IfcSIUnit", UnitType="MASSUNIT", Prefix="KILO", Name="GRAM"),
            self.add("IfcSIUnit", UnitType="PLANEANGLEUNIT", Name="RADIAN"),
        ]
        self.context = self.add(
            "IfcGeometricRepresentationContext",
            ContextType="Model",
            CoordinateSpaceDimension=3,
            Precision=1e-5 * units_per_metre,
            WorldCoordinateSystem=self.axes((0, 0, 0), UPRIGHT),
        )
        self.body = self.subcontext("Body", "MODEL_VIEW")
        self.project = self.rooted(
            "IfcProject",
            project,
            RepresentationContexts=[self.context],
            UnitsInContext=self.add("IfcUnitAssignment", Units=units),
        )

    def add(self, ifc_class: str, **attributes: Any) -> Any:
        """Add an entity; attributes that are None stay unset."""
        return self.file.create_entity(ifc_class, **{k: v for k, v in attributes.items() if v is not None})

    def rooted(self, ifc_class: str, name: str, *, label: str | None = None, **attributes: Any) -> Any:
        """Add an entity with a GlobalId made of the project, its class and ``name``; ``label`` replaces its Name."""
        key = f"{self._project_name}/{ifc_class}/{name}"
        global_id = ifcopenshell.guid.compress(uuid.uuid5(NAMESPACE, key).hex)
        return self.add(
            ifc_class, GlobalId=global_id, OwnerHistory=self._owner, Name=name if label is None else label, **attributes
        )

    def to_bytes(self, file_name: str) -> bytes:
        """Return the file; its header contains neither a time nor a tool version."""
        header = self.file.header
        header.file_description.description = ("ViewDefinition [CoordinationView]",)
        header.file_name.name = file_name
        header.file_name.time_stamp = TIME_STAMP
        header.file_name.author = (AUTHOR,)
        header.file_name.organization = ("bimvox",)
        header.file_name.preprocessor_version = AUTHOR
        header.file_name.originating_system = AUTHOR
        header.file_name.authorization = "none"
        text: str = self.file.to_string()
        return text.encode("ascii")

    def length(self, metres: float) -> float:
        """Return a length in the file's unit, to a tenth of a micrometre: 0.1 + 0.2 is written as 0.3."""
        return round(float(metres) * self._scale, 7) + 0.0

    def point(self, at_m: Sequence[float]) -> Any:
        """Return the point, the same entity each time."""
        coordinates = tuple(self.length(c) for c in at_m)
        return self._once(("point", *coordinates), "IfcCartesianPoint", Coordinates=coordinates)

    def direction(self, ratios: Sequence[float]) -> Any:
        """Return the direction, the same entity each time."""
        floats = tuple(float(r) for r in ratios)
        return self._once(("direction", *floats), "IfcDirection", DirectionRatios=floats)

    def axes(self, at_m: Vector, axes: Axes) -> Any:
        """Return a 3D placement, the same entity each time."""
        # Z up and x to the right is the default, so it is not written.
        turned = axes != UPRIGHT
        return self._once(
            ("axes", *(self.length(c) for c in at_m), axes),
            "IfcAxis2Placement3D",
            Location=self.point(at_m),
            Axis=self.direction(axes[0]) if turned else None,
            RefDirection=self.direction(axes[1]) if turned else None,
        )

    def subcontext(self, identifier: str, view: str) -> Any:
        """Add a subcontext of the model context."""
        return self.add(
            "IfcGeometricRepresentationSubContext",
            ContextIdentifier=identifier,
            ContextType="Model",
            ParentContext=self.context,
            TargetView=view,
        )

    def _once(self, key: tuple[object, ...], ifc_class: str, **attributes: Any) -> Any:
        if key not in self._shared:
            self._shared[key] = self.add(ifc_class, **attributes)
        return self._shared[key]

    def _owner_history(self) -> Any:
        organisation = self.add("IfcOrganization", Name="bimvox")
        person = self.add("IfcPerson", FamilyName="sample_models")
        application = self.add(
            "IfcApplication",
            ApplicationDeveloper=organisation,
            Version="1",
            ApplicationFullName=AUTHOR,
            ApplicationIdentifier="bimvox",
        )
        user = self.add("IfcPersonAndOrganization", ThePerson=person, TheOrganization=organisation)
        return self.add(
            "IfcOwnerHistory",
            OwningUser=user,
            OwningApplication=application,
            ChangeAction="ADDED",
            CreationDate=UNIX_TIME,
        )
