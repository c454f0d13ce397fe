"""Name the instance of a damaged IFC file that does not fit the schema, if reading the file fails."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import ifcopenshell
import ifcopenshell.validate

from bimvox.errors import IfcError

_MISREAD = (AttributeError, TypeError, ValueError, LookupError, ArithmeticError, RuntimeError)


@contextmanager
def named_misfit(path: Path, file: Any) -> Iterator[None]:
    """Turn what a missing or misplaced value causes into an error that names it; other errors pass unchanged.

    Args:
        path: The file.
        file: The ``ifcopenshell.file`` that is read meanwhile.

    Raises:
        IfcError: If reading fails and an instance does not fit the schema.
    """
    try:
        yield
    except _MISREAD as error:
        misfit = _first_misfit(file)
        if misfit is None:
            raise
        raise IfcError(
            path, f"is damaged: {misfit}", hint="export the model again, or correct it in the authoring program"
        ) from error


def _first_misfit(file: Any) -> str | None:
    """Return the first attribute whose value the schema does not allow; relations before all else."""
    schema = ifcopenshell.ifcopenshell_wrapper.schema_by_name(file.schema_identifier)
    relations = file.by_type("IfcRelationship")
    for instance in (*relations, *(one for one in file if not one.is_a("IfcRelationship"))):
        definition = schema.declaration_by_name(instance.is_a()).as_entity()
        for position, attribute in enumerate(definition.all_attributes()):
            if definition.derived()[position]:
                continue
            named = f"#{instance.id()}={instance.is_a()} has {{}} as its {attribute.name()}"
            value = instance[position]
            if value is None:
                if not attribute.optional():
                    return named.format("nothing")
            elif not ifcopenshell.validate.assert_valid(attribute.type_of_attribute(), value, schema, no_throw=True):
                return named.format("a value that the schema does not allow")
    return None
