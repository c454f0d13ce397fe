"""Select IFC products with an IfcOpenShell selector query, with errors that explain what is wrong."""

from __future__ import annotations

import difflib
import re
from collections import Counter
from typing import Any

import ifcopenshell
from ifcopenshell.util.selector import filter_elements_grammar
from lark.exceptions import LarkError, UnexpectedInput

from bimvox.bim.ifc.facets import Facets
from bimvox.errors import NothingSelectedError, SelectionError, cut, shown

_HELP = "a query is written like `IfcColumn, IfcBeam` or `IfcWall, material=Concrete + IfcSlab`"


def select_products(file: Any, query: str) -> frozenset[int]:
    """Return the step ids of the products that a query matches.

    Args:
        file: The ``ifcopenshell.file``.
        query: In the filter syntax of ``ifcopenshell.util.selector``; what it means is in ``facets``.

    Raises:
        SelectionError: If the query is malformed, names a class or an attribute that the schema lacks, or matches no
            product.
    """
    try:
        tree = filter_elements_grammar.parse(query)
    except UnexpectedInput as error:
        raise SelectionError(f"select {shown(query)}: {_what_is_wrong(query, error)}", hint=_HELP) from error
    schema = file.schema_identifier
    for token in tree.scan_values(lambda value: getattr(value, "type", "") != "" and str(value).startswith("Ifc")):
        _check_class(query, schema, str(token))
    for named in tree.find_data("attribute_name"):
        _check_attribute(query, schema, str(named.children[0]))
    for named in tree.find_data("pset"):
        if str(next(named.scan_values(str))).startswith("query:"):
            raise SelectionError(
                f"select {shown(query)}: a path with a full stop needs quotes", hint='as in query:"material.Name"=Steel'
            )
    facets = Facets(file)
    try:
        facets.transform(tree)
    except (LarkError, ValueError, TypeError, AttributeError, RuntimeError) as error:
        why = str(error).strip().splitlines() or [type(error).__name__]
        raise SelectionError(f"select {shown(query)}: {cut(why[-1])}", hint=_HELP) from error
    ids = frozenset(int(entity.id()) for entity in facets.get_results() if entity.is_a("IfcProduct"))
    if not ids:
        raise NothingSelectedError(
            f"select {shown(query)}: matches no product of the file", hint=_classes_present(file)
        )
    return ids


def _what_is_wrong(query: str, error: UnexpectedInput) -> str:
    """Return where a query cannot be read and what is expected there, in terms of its syntax."""
    if not query.strip():
        return "is empty"
    wanted = set(getattr(error, "expected", None) or getattr(error, "allowed", None) or ())
    place = getattr(error, "pos_in_stream", None)
    start = len(query) if place is None or place < 0 else int(place)
    before = query[:start].rstrip()
    if wanted == {"DOT"}:
        word = re.split(r"[,+]", before)[-1].strip()
        return f"{shown(word)} is neither a class nor a GlobalId; a property is written Set.Name=value"
    words = []
    if wanted & {"EQUAL", "__ANON_6"}:
        words.append("a comparison such as =, != or *=")
    if "COMMA" in wanted:
        words.append("a comma")
    if "TRUE" in wanted:
        words.append("a value")
    if "LOCATION" in wanted or wanted == {"__ANON_0", "__ANON_3"}:
        words.append("a class, a GlobalId, an attribute or a property")
    expected = f", expected is {' or '.join(words)}" if words else ""
    if start >= len(query.rstrip()):
        return f"something is missing after {before[-20:]!r}{expected}"
    return f"cannot be read from character {start + 1} on ({query[start : start + 20].strip()!r}){expected}"


def _check_class(query: str, schema: str, name: str) -> None:
    """Raise if the schema lacks a class: the selector ignores it, so that a typing error would select nothing."""
    declared = ifcopenshell.ifcopenshell_wrapper.schema_by_name(schema)
    try:
        declared.declaration_by_name(name)
    except RuntimeError as error:
        known = [entity.name() for entity in declared.entities()]
        close = difflib.get_close_matches(name, known, n=1)
        hint = f"did you mean {close[0]}?" if close else _HELP
        raise SelectionError(f"select {shown(query)}: {schema} has no class {cut(name)}", hint=hint) from error


def _check_attribute(query: str, schema: str, name: str) -> None:
    """Raise if no class of the schema has an attribute: with ``!=``, a typing error would select everything."""
    entities = ifcopenshell.ifcopenshell_wrapper.schema_by_name(schema).entities()
    known = {each.name() for entity in entities for each in (*entity.attributes(), *entity.all_inverse_attributes())}
    if name not in known:
        close = difflib.get_close_matches(name, sorted(known), n=1)
        hint = f"did you mean {close[0]}?" if close else _HELP
        raise SelectionError(f"select {shown(query)}: {schema} has no attribute {cut(name)}", hint=hint)


def _classes_present(file: Any) -> str:
    """Return a sentence with the classes that could be selected."""
    counts = Counter(element.is_a() for element in file.by_type("IfcElement") if element.Representation)
    present = ", ".join(f"{ifc_class} ({count:,})" for ifc_class, count in sorted(counts.items()))
    return f"the file has {present}" if present else "the file has no element with geometry"
