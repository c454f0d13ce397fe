"""Lifting anchors in a model: where the maker of a part means it to be held.

IFC has no class for them. Authoring tools write them as what is at hand (Tekla: ``IfcBeam``, ``IfcDiscreteAccessory``)
inside the part's assembly, and only the name says what they are. The words below are those of precast practice in the
languages of the models that were looked at; a plain "anchor" is a bolt in a foundation as often as not, and is none.
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

Point = tuple[float, float, float]

_WHOLE = re.compile(
    r"lifting|hijs(oog|anker|lus|haak|voorziening)|hebe(anker|schlaufe|öse|oese)|transport(anker|schlaufe)"
    r"|(anneau|ancre|boucle|crochet)s? de levage|nosto(lenkki|ankkuri|elin)|lyft(ögla|oegla|ankare|öra)"
    r"|løfte(anker|ør|bøyle)|loefteanker|(gancio|golfare) di sollevamento|(gancho|ancla)s? de izaje",
    re.IGNORECASE,
)
_ACCESSORIES = ("IfcDiscreteAccessory", "IfcMechanicalFastener", "IfcFastener", "IfcReinforcingElement")


def is_lifting_anchor(product: Any) -> bool:
    """Say whether a product is a lifting anchor, by its name or object type."""
    texts = (product.Name, getattr(product, "ObjectType", None))
    return any(_WHOLE.search(str(text)) for text in texts if text)


def anchors_without_mesh(
    file: Any, meshed: Iterable[int], metres_per_unit: float, origin_m: NDArray[np.float64]
) -> dict[int, list[Point]]:
    """Return lifting anchors that were not meshed, as the point of their placement, by the element that they belong to.

    Args:
        file: The ``ifcopenshell.file``.
        meshed: Step ids of the products with triangles.
        metres_per_unit: Of the file's lengths.
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
    """Return where a drawn anchor is held: in the middle of its box, at its top."""
    low, high = mesh.bounds_m
    return _point(np.array([*(low[:2] + high[:2]) / 2.0, high[2]]))


def points_of_group(
    file: Any,
    members: Iterable[int],
    above: Iterable[int],
    meshes: Mapping[int, TriangleMesh],
    bare: Mapping[int, list[Point]],
) -> tuple[Point, ...]:
    """Return the lifting points of one lift, without doubles.

    Args:
        file: The ``ifcopenshell.file``.
        members: Step ids of the products with triangles in it.
        above: Step ids of elements whose anchors are the lift's too: its owner, an assembly that holds nothing else.
        meshes: Triangles by step id.
        bare: From :func:`anchors_without_mesh`.
    """
    members = tuple(members)
    anchors = [step_id for step_id in members if is_lifting_anchor(file.by_id(step_id))]
    if len(anchors) == len(members):  # nothing but anchors: they are what is lifted
        anchors = []
    points = [anchor_point(meshes[step_id]) for step_id in anchors]
    for step_id in dict.fromkeys((*above, *members)):
        points += bare.get(step_id, [])
    return tuple(dict.fromkeys(points))


def _point(at: NDArray[np.float64]) -> Point:
    x, y, z = (round(float(value), 6) + 0.0 for value in at)
    return (x, y, z)
