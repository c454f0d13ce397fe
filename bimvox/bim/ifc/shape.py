"""The shape of products as the geometry processes return it: clean triangles, measured, in their own frame."""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bimvox.bim.building import TriangleMesh
from bimvox.bim.mesh.repair import Solid, drop_bad_faces, solid_of, turn_outward


@dataclass(frozen=True, slots=True, eq=False)
class Shape:
    """Clean triangles in the own frame of the products that share them.

    Attributes:
        mesh: Metres; faces look outward, all vertices are used.
        solid: What it encloses.
        dropped: Triangles without area that were dropped.
        turned: Whether faces had to be turned outward.
    """

    mesh: TriangleMesh
    solid: Solid
    dropped: int
    turned: bool


@dataclass(frozen=True, slots=True, eq=False)
class PlacedShape:
    """The shape of one product, and its placement.

    Attributes:
        shape: Clean triangles in the product's own frame; products may share one.
        placement: (4, 4) float64, product to world, metres.
    """

    shape: Shape
    placement: NDArray[np.float64]

    def mesh(self, origin_m: NDArray[np.float64]) -> TriangleMesh:
        """Return the mesh relative to a world point; subtracted first, so that a far placement costs no precision."""
        shift: NDArray[np.float64] = self.placement[:3, 3] - origin_m
        own = self.shape.mesh
        return TriangleMesh(own.vertices_m @ self.placement[:3, :3].T + shift, own.faces)


def clean_shape(vertices_m: NDArray[np.float64], faces: NDArray[np.int32]) -> Shape | str:
    """Return a kernel's triangles, repaired and measured; or the reason why they are not a shape.

    Args:
        vertices_m: (V, 3).
        faces: (F, 3).
    """
    if not len(faces):
        return "no triangles"
    mesh, dropped = drop_bad_faces(TriangleMesh(vertices_m, faces))
    if not len(mesh.faces):
        return "its triangles have no area"
    mesh, shells, turned = turn_outward(mesh)
    solid = solid_of(shells)
    used, index = np.unique(mesh.faces, return_inverse=True)
    mesh = TriangleMesh(mesh.vertices_m[used], index.reshape(-1, 3).astype(np.int32))
    return Shape(mesh, solid, dropped, turned)


def shape_groups(file: Any, step_ids: Sequence[int]) -> list[tuple[int, ...]]:
    """Return groups of products whose shapes are equal in their own frames: they consist of the same instances.

    Products share a shape if all their representations contain the same items, or map the same representations in the
    same way, and if nothing is cut out of any of them.

    Args:
        file: The ``ifcopenshell.file``.
        step_ids: Products with a representation.

    Returns:
        Tuples of step ids, each in the given order, sorted by the position of their first; together all step ids.
    """
    alike: dict[Hashable, list[int]] = {}
    for step_id in step_ids:
        alike.setdefault(_shape_key(file.by_id(step_id)), []).append(step_id)
    groups: list[tuple[int, ...]] = []
    for members in alike.values():
        if len(members) == 1:
            groups.append((members[0],))
            continue
        cut = {step_id for step_id in members if _is_cut(file.by_id(step_id))}
        groups += [(step_id,) for step_id in cut]
        groups += [tuple(step_id for step_id in members if step_id not in cut)] if len(cut) < len(members) else []
    place = {step_id: index for index, step_id in enumerate(step_ids)}
    return sorted(groups, key=lambda group: place[group[0]])


def _shape_key(product: Any) -> Hashable:
    """Return what determines its shape; the class is included, since it affects which representation a kernel uses."""
    content = []
    for representation in product.Representation.Representations:
        items = tuple(_item_key(item) for item in representation.Items)
        context = representation.ContextOfItems
        content.append((context.id() if context else 0, representation.RepresentationIdentifier, items))
    return product.is_a(), tuple(content)


def _item_key(item: Any) -> Hashable:
    if not item.is_a("IfcMappedItem"):
        return int(item.id())
    return int(item.MappingSource.id()), _values(item.MappingTarget)


def _values(value: Any) -> Hashable:
    """Return an instance as its class and plain values: exporters write equal transformations many times."""
    if hasattr(value, "is_a"):
        return value.is_a(), tuple(_values(attribute) for attribute in value)
    return tuple(_values(part) for part in value) if isinstance(value, tuple) else str(value)


def _is_cut(product: Any) -> bool:
    """Return whether openings are cut out of a product: its own, or those of the wholes that it is a part of."""
    seen: set[int] = set()
    whole: Any | None = product
    while whole is not None and whole.id() not in seen:
        seen.add(whole.id())
        if getattr(whole, "HasOpenings", ()):
            return True
        above = getattr(whole, "Decomposes", ()) or ()
        whole = above[0].RelatingObject if above and hasattr(above[0], "RelatingObject") else None
    return False
