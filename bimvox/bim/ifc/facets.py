"""What the comparisons of a selection mean, in one place for all of them.

The grammar of a query is IfcOpenShell's. Its comparisons are not used: those with ``!=``, ``*=`` and ``NULL`` select
the wrong products where a product has several values, such as the name and the category of a material.

- A comparison holds if it holds for any value of the product.
- ``!=`` and ``!*=`` select exactly the products that ``=`` and ``*=`` do not select.
- ``NULL`` is a product without a value.
"""

from __future__ import annotations

import math
import operator
import re
from collections.abc import Callable, Iterable, Iterator
from typing import Any

import ifcopenshell.util.classification as classifications
import ifcopenshell.util.element as elements
from ifcopenshell.util.selector import FacetTransformer, get_element_value

_ORDER: dict[str, Callable[[float, float], bool]] = {
    ">": operator.gt,
    ">=": operator.ge,
    "<": operator.lt,
    "<=": operator.le,
}


def _facet(values_of: Callable[..., Iterable[Any]]) -> Callable[[Any, Any], None]:
    """Return the method of a facet: it keeps the products whose values compare as the query says.

    Args:
        values_of: Returns the values of a product; also gets what the facet names before its comparison.
    """

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


class Facets(FacetTransformer):  # type: ignore[misc,unused-ignore]
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
