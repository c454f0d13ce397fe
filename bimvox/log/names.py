"""How parts and obstructions are named to people: name or class first, id second."""

from __future__ import annotations

from bimvox.site.component import Component
from bimvox.site.site import Site


def part_name(component: Component) -> str:
    """Return a part's name, or its class, with its id in brackets; the id alone if it is the name."""
    name = component.name or component.ifc_class
    return component.id if name in ("", component.id) else f"{name} ({component.id})"


def names_by_id(site: Site) -> dict[str, str]:
    """Return what people are told of each part, by its id; obstructions have no name but their id."""
    return {component.id: part_name(component) for component in site.components}
