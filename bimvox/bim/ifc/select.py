"""Select IFC products with an IfcOpenShell selector query, with errors that explain what is wrong."""

from __future__ import annotations

import difflib
import math
import operator
import re
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from typing import Any

import ifcopenshell
import ifcopenshell.util.classification as classifications
import ifcopenshell.util.element as elements
from ifcopenshell.util.selector import FacetTransformer, filter_elements_grammar, get_element_value
from lark.exceptions import LarkError, UnexpectedInput

from bimvox.errors import NothingSelectedError, SelectionError, cut, shown

# What the comparisons of a selection mean, in one place for all of them.
#
# The grammar of a query is IfcOpenShell's. Its comparisons are not used: those with ``!=``, ``*=`` and ``NULL`` select
# the wrong products where a product has several values, such as the name and the category of a material.
#
# - A comparison holds if it holds for any value of the product.
# - ``!=`` and ``!*=`` select exactly the products that ``=`` and ``*=`` do not select.
# - ``NULL`` is a product without a value.

_ORDER: dict[str, Callable[[float, float], bool]] = {
    ">": operator.gt,
    ">=": operator.ge,
    "<": operator.lt,
    "<=": operator.le,
}


def _facet(values_of: Callable[..., Iterable[Any]]) -> Callable[[Any, Any], None]:
    """Return the method of a facet: it keeps the products whose values compare as the query says."""

    def keep(facets: Any, args: Any) -> None:
        *named, comparison, wanted = args
        how = comparison.removeprefix("!")
        if not isinstance(wanted, str) and how != "=":
            raise ValueError("NULL, TRUE, FALSE and patterns are compared with = or !=")
        facets.add_default_elements()
        is_negated = how != comparison
        facets.elements = {one for one in facets.elements if _holds(values_of(one, *named), how, wanted) != is_negated}

    return keep


def _holds(values: Iterable[Any], how: str, wanted: Any) -> bool:
    """Return whether any value compares as wanted; for None, whether there is no value."""
    present = _flat(values)
    if wanted is None:
        return next(present, None) is None
    return any(_compares(value, how, wanted) for value in present)


def _flat(values: Iterable[Any]) -> Iterator[Any]:
    """Yield the values, and those in lists; None is not a value."""
    for value in values:
        if isinstance(value, list | tuple | set | frozenset):
            yield from _flat(value)
        elif value is not None:
            yield value


def _compares(value: Any, how: str, wanted: Any) -> bool:
    """Return whether one value compares as wanted."""
    if isinstance(wanted, re.Pattern):
        return wanted.match(str(value)) is not None
    if isinstance(wanted, bool):
        return value is wanted
    if isinstance(value, bool):
        return str(value).upper() == str(wanted).upper()
    if how in _ORDER or isinstance(value, int | float):
        try:
            number, limit = float(value), float(wanted)
        except (TypeError, ValueError):
            return False
        return _ORDER[how](number, limit) if how in _ORDER else math.isclose(number, limit, rel_tol=1e-9)
    return wanted in str(value) if how == "*=" else str(value) == wanted


def _attribute(product: Any, name: Any) -> list[Any]:
    """Return the value of an attribute."""
    name = str(name.children[0])
    return [elements.get_predefined_type(product) if name == "PredefinedType" else getattr(product, name, None)]


def _named(entity: Any) -> list[Any]:
    """Return the name and the GlobalId of an entity, if there is one."""
    return [] if entity is None else [getattr(entity, "Name", None), getattr(entity, "GlobalId", None)]


def _materials(product: Any) -> list[Any]:
    """Return names and categories of the materials of a product; of its parts if it states none itself."""

    def stated(one: Any) -> list[Any]:
        return [material for material in elements.get_materials(one) if material is not None]

    every = _walk([product], lambda one: [] if stated(one) else elements.get_parts(one))
    return [value for one in every for each in stated(one) for value in (each.Name, getattr(each, "Category", None))]


def _references(product: Any) -> list[Any]:
    """Return names and codes of the classification of a product."""
    found = classifications.get_references(product)
    return [
        value
        for each in found
        for value in (each.Name, getattr(each, "Identification", getattr(each, "ItemReference", None)))
    ]


def _places(product: Any) -> list[Any]:
    """Return names and GlobalIds of the storey, the building and the site that a product is in."""
    container = elements.get_container(product) or elements.get_aggregate(product)
    return [value for each in _walk([container], lambda one: [elements.get_aggregate(one)]) for value in _named(each)]


def _wholes(product: Any) -> list[Any]:
    """Return names and GlobalIds of all that a product is in, and its own if it has parts or openings itself."""

    def above(one: Any) -> list[Any]:
        container = elements.get_container(one, should_get_direct=True)
        whole = elements.get_aggregate(one) or elements.get_nest(one)
        return [container, whole, elements.get_filled_void(one), elements.get_voided_element(one)]

    own = [product] if elements.get_decomposition(product, is_recursive=False) else []
    return [value for each in (*own, *_walk(above(product), above)) for value in _named(each)]


def _walk(begin: Iterable[Any], following: Callable[[Any], Iterable[Any]]) -> Iterator[Any]:
    """Yield entities and what follows each, below the project and each once: relations of a file may form a circle."""
    seen: set[int] = set()
    todo = list(begin)
    while todo:
        one = todo.pop()
        if one is not None and one.id() not in seen and not one.is_a("IfcProject"):
            seen.add(one.id())
            yield one
            todo += following(one)


def _groups(product: Any) -> list[Any]:
    """Return names and GlobalIds of the groups, systems and zones of a product."""
    assigned = getattr(product, "HasAssignments", None) or ()
    groups = [one.RelatingGroup for one in assigned if one.is_a("IfcRelAssignsToGroup")]
    return [value for each in groups for value in _named(each)]


def _properties(product: Any, set_name: Any, name: Any) -> list[Any]:
    """Return the values of all properties whose set and name match a text or a pattern."""
    if isinstance(set_name, str):
        sets = [elements.get_pset(product, set_name) or {}]
    else:
        sets = [values for key, values in elements.get_psets(product).items() if set_name.match(key)]
    return [
        value
        for values in sets
        for key, value in values.items()
        if key != "id" and (name == key if isinstance(name, str) else name.match(key))
    ]


class _Facets(FacetTransformer):  # type: ignore[misc,unused-ignore]
    """Selects the products of a file, facet by facet, as lark walks through a parsed query."""

    attribute = _facet(_attribute)
    type = _facet(lambda product: _named(elements.get_type(product)))
    material = _facet(_materials)
    classification = _facet(_references)
    location = _facet(_places)
    group = _facet(_groups)
    parent = _facet(_wholes)
    property = _facet(_properties)
    query = _facet(lambda product, keys: [get_element_value(product, keys)])

    def entity(self, args: Any) -> None:
        """Add the products of a class, or take them away."""
        self._begin_with_all(args)
        super().entity(args)

    def instance(self, args: Any) -> None:
        """Add the product with a GlobalId, or take it away."""
        self._begin_with_all(args)
        super().instance(args)

    def _begin_with_all(self, args: Any) -> None:
        """Take all products if a group of facets begins with one that takes products away."""
        if args[0].data == "not" and not self.elements:
            self.add_default_elements()


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
    facets = _Facets(file)
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
