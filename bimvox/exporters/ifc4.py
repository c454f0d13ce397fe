"""A file of IFC2X3 as one of IFC4: IFC2X3 keeps dates apart from tasks, and no current program reads them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from contextlib import redirect_stdout
from io import StringIO
from pathlib import Path
from typing import Any

import ifcopenshell
from ifcopenshell import ifcopenshell_wrapper
from ifcopenshell.util.schema import Migrator

from bimvox.errors import IfcError

_MATERIAL_SETS = {"General": "Common", "MechanicalConcrete": "Concrete", "MechanicalSteel": "Steel"}
"""Property sets of IFC4 for classes of IFC2X3, where their names differ."""


def as_ifc4(path: Path, file: Any, note: Callable[[str], None]) -> tuple[Any, dict[int, int]]:
    """Return a file of IFC2X3 as one of IFC4, and the new step id of each entity.

    Properties of materials become property sets. What has no class in IFC4 is left out and named.

    Args:
        path: The file's path, for messages.
        file: The ``ifcopenshell.file``; it is used up.
        note: Told what has changed.

    Raises:
        IfcError: If an entity cannot be written as IFC4.
    """
    migrator, made = Migrator(), ifcopenshell.file(schema="IFC4")
    note(f"{path.name} is IFC2X3, whose dates no current program reads: written as IFC4")
    migrator.preprocess(file, made)
    made.header.file_schema.schema_identifiers = ("IFC4",)
    known = {one.name() for one in ifcopenshell_wrapper.schema_by_name("IFC4").entities()}
    lost = [one for one in file if one.is_a() not in known and one.is_a() not in migrator.class_2x3_to_4]
    properties = [(one.is_a(), one[0].id(), _values(one)) for one in lost if one.is_a("IfcMaterialProperties")]
    left_out = Counter(one.is_a() for one in lost if not one.is_a("IfcMaterialProperties"))
    for entity in lost:
        file.remove(entity)
    with redirect_stdout(StringIO()):  # it prints each attribute that IFC4 has in addition
        for entity in file:
            try:
                migrator.migrate(entity, made)
            except (NotImplementedError, RuntimeError, TypeError, ValueError) as error:
                raise IfcError(
                    path,
                    f"#{entity.id()} {entity.is_a()} cannot be written as IFC4: {error}",
                    hint="export the schedule as msproject",
                ) from error
    for name, material, values in properties:
        middle = name.removeprefix("Ifc").removesuffix("MaterialProperties")
        made.create_entity(
            "IfcMaterialProperties",
            Name=f"Pset_Material{_MATERIAL_SETS.get(middle, middle)}",
            Properties=[
                made.create_entity("IfcPropertySingleValue", Name=key, NominalValue=made.create_entity(kind, value))
                for key, kind, value in values
            ],
            Material=made.by_id(migrator.migrated_ids[material]),
        )
    for history in made.by_type("IfcOwnerHistory"):  # IFC4 asks when it was changed, if it says how
        if history.ChangeAction not in (None, "NOCHANGE", "NOTDEFINED") and history.LastModifiedDate is None:
            history.LastModifiedDate = history.CreationDate
    if left_out:
        counts = ", ".join(f"{count} {name}" for name, count in sorted(left_out.items()))
        note(f"IFC4 has no such class, left out: {counts}")
    return made, migrator.migrated_ids


def _values(entity: Any) -> list[tuple[str, str, Any]]:
    """Return name, type and value of the attributes of an entity that are plain measures."""
    declaration: Any = ifcopenshell_wrapper.schema_by_name("IFC2X3").declaration_by_name(entity.is_a())
    found = []
    for number, attribute in enumerate(declaration.all_attributes()):
        kind = attribute.type_of_attribute().as_named_type()
        if isinstance(entity[number], (float, str, bool)) and kind is not None:
            found.append((attribute.name(), kind.declared_type().name(), entity[number]))
    return found
