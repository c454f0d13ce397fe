"""Selection of IFC products by an IfcOpenShell selector query, with errors that say what is wrong."""

from __future__ import annotations

import difflib
from typing import Any

import ifcopenshell
import ifcopenshell.util.selector
from lark.exceptions import LarkError, UnexpectedInput

from bimvox.errors import SelectionError

_HELP = "a query is written like `IfcColumn, IfcBeam` or `IfcWall, material=Concrete + IfcSlab`"


def select_products(file: Any, query: str) -> frozenset[int]:
    """Return the step ids of the products that a query matches.

    Args:
        file: The ``ifcopenshell.file``.
        query: In the filter syntax of ``ifcopenshell.util.selector``.

    Raises:
        SelectionError: If the query is malformed, names a class the schema lacks, or matches no product.
    """
    try:
        tree = ifcopenshell.util.selector.filter_elements_grammar.parse(query)
    except UnexpectedInput as error:
        spot = " ".join(error.get_context(query, span=20).split("\n")[0].split())
        raise SelectionError(
            f"select {query!r}: cannot be read at character {error.column} (near {spot!r})", hint=_HELP
        ) from error
    schema = file.schema_identifier
    for token in tree.scan_values(lambda value: getattr(value, "type", "") != "" and str(value).startswith("Ifc")):
        _check_class(query, schema, str(token))
    try:
        found = ifcopenshell.util.selector.filter_elements(file, query)
    except (LarkError, ValueError, TypeError, AttributeError, RuntimeError) as error:
        raise SelectionError(f"select {query!r}: {error}", hint=_HELP) from error
    ids = frozenset(int(entity.id()) for entity in found if entity.is_a("IfcProduct"))
    if not ids:
        raise SelectionError(f"select {query!r}: matches no product of the file", hint=_classes_present(file))
    return ids


def _check_class(query: str, schema: str, name: str) -> None:
    """The selector ignores a class it does not know; a typing error must not pass for an empty selection."""
    declared = ifcopenshell.ifcopenshell_wrapper.schema_by_name(schema)
    try:
        declared.declaration_by_name(name)
    except RuntimeError as error:
        known = [entity.name() for entity in declared.entities()]
        close = difflib.get_close_matches(name, known, n=1)
        hint = f"did you mean {close[0]}?" if close else _HELP
        raise SelectionError(f"select {query!r}: {schema} has no class {name}", hint=hint) from error


def _classes_present(file: Any) -> str:
    """Return a sentence with the classes that could be selected."""
    classes = sorted({element.is_a() for element in file.by_type("IfcElement") if element.Representation})
    return f"the file has {', '.join(classes)}" if classes else "the file has no element with geometry"
