"""Lifting anchors in a model: where the manufacturer of a part wants it to be slung.

IFC has no class for them. Authoring tools write them as other classes (Tekla: ``IfcBeam``, ``IfcDiscreteAccessory``)
inside the part's assembly; only the name identifies them. The words below are used in precast practice, in the
languages of the models examined. A plain "anchor" does not count: it is often a foundation bolt.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from typing import Any

import ifcopenshell.util.placement as placement
import numpy as np
from numpy.typing import NDArray

from bimvox.bim.building import TriangleMesh
from bimvox.bim.ifc.assembly import parent_element
from bimvox.bim.ifc.text import label

Point = tuple[float, float, float]

_WHOLE = re.compile(
    r"lifting|hijs(oog|anker|lus|haak|voorziening)|hebe(anker|schlaufe|öse|oese)|transport(anker|schlaufe)"
    r"|(anneau|ancre|boucle|crochet)s? de levage|nosto(lenkki|ankkuri|elin)|lyft(ögla|oegla|ankare|öra)"
    r"|løfte(anker|ør|bøyle)|loefteanker|(gancio|golfare) di sollevamento|(gancho|ancla)s? de izaje",
    re.IGNORECASE,
)
_ACCESSORIES = ("IfcDiscreteAccessory", "IfcMechanicalFastener", "IfcFastener", "IfcReinforcingElement")


def is_lifting_anchor(product: Any) -> bool:
    """Return whether a product is a lifting anchor, by its name or object type."""
    texts = (product.Name, getattr(product, "ObjectType", None))
    return any(_WHOLE.search(label(text)) for text in texts)


def anchors_without_mesh(
    file: Any, meshed: Iterable[int], metres_per_unit: float, origin_m: NDArray[np.float64]
) -> dict[int, list[Point]]:
    """Return the placement points of lifting anchors without a mesh, by step id of the element that they belong to.

    Args:
        file: The ``ifcopenshell.file``.
        meshed: Step ids of the products with triangles.
        metres_per_unit: Its length unit in metres.
        origin_m: (3,) the building's local origin.
    """
    known = set(meshed)
    found: dict[int, list[Point]] = {}
    for ifc_class in _ACCESSORIES:
        for product in file.by_type(ifc_class):
            if product.id() in known or product.ObjectPlacement is None or not is_lifting_anchor(product):
                continue
            owner = parent_element(product)
            if owner is None:
                continue
            at = placement.get_local_placement(product.ObjectPlacement)[:3, 3] * metres_per_unit - origin_m
            found.setdefault(owner.id(), []).append(_point(at))
    return found


def anchor_point(mesh: TriangleMesh) -> Point:
    """Return the lifting point of an anchor with a mesh: the centre of the top of its box."""
    low, high = mesh.bounds_m
    return _point(np.array([*(low[:2] + high[:2]) / 2.0, high[2]]))


def points_of_group(
    file: Any,
    members: Iterable[int],
    above: Iterable[int],
    meshes: Mapping[int, TriangleMesh],
    bare: Mapping[int, list[Point]],
) -> tuple[Point, ...]:
    """Return the lifting points of one lift, without duplicates.

    Args:
        file: The ``ifcopenshell.file``.
        members: Step ids of its products with triangles.
        above: Step ids of elements whose anchors also belong to the lift: its owner, an assembly with no other part.
        meshes: Triangles by step id.
        bare: From :func:`anchors_without_mesh`.
    """
    members = tuple(members)
    anchors = [step_id for step_id in members if is_lifting_anchor(file.by_id(step_id))]
    if len(anchors) == len(members):  # only anchors: they are the lift
        anchors = []
    points = [anchor_point(meshes[step_id]) for step_id in anchors]
    for step_id in dict.fromkeys((*above, *members)):
        points += bare.get(step_id, [])
    return tuple(dict.fromkeys(points))


def _point(at: NDArray[np.float64]) -> Point:
    x, y, z = (round(float(value), 6) + 0.0 for value in at)
    return (x, y, z)
