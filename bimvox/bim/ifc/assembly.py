"""Group products into lifts, by the aggregation rules of IFC and by which parts are connected in space.

The topmost ``IfcElement`` above a product (through ``IfcRelAggregates``) is the element. The meshes below it are
merged, except for wholes that are not lifted in one piece:

- stairs, ramps and roofs are assembled on site: each of their parts is an element;
- an ``IfcElementAssembly`` is opened if it states that it is assembled on site (``AssemblyPlace`` SITE), if it
  contains a part that is never lifted (a footing, a pile), or if its parts are not connected (a floor, a frame
  modelled as one). The same rules then apply to its parts;
- an ``IfcElementAssembly`` with one part is that part.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import ifcopenshell.util.placement as placement
import numpy as np
from numpy.typing import NDArray

from bimvox.bim.building import TriangleMesh
from bimvox.bim.ifc.class_roles import SPLIT
from bimvox.bim.ifc.text import label
from bimvox.bim.mesh.repair import Solid, connected_labels

GAP_M = 0.05
"""Parts whose boxes are closer than this are connected (grout, bearings and tolerance gaps are not modelled)."""
SUBSTANTIAL = 0.1
"""Share of the volume from which a loose piece counts; an anchor or tube next to its part is smaller."""


@dataclass(frozen=True, slots=True, eq=False)
class Extent:
    """Where a product is and how much of it: ``low_m`` and ``high_m`` (3,) float64, ``volume_m3``."""

    low_m: NDArray[np.float64]
    high_m: NDArray[np.float64]
    volume_m3: float

    @property
    def box_m3(self) -> float:
        """Volume of its box, each side of which is at least 50 mm."""
        return float(np.prod(np.maximum(self.high_m - self.low_m, 0.05)))


@dataclass(frozen=True, slots=True, eq=False)
class MeshedProduct:
    """A product with clean triangles, relative to the building's local origin."""

    mesh: TriangleMesh
    extent: Extent
    solid: Solid


@dataclass(frozen=True, slots=True)
class Group:
    """One lift.

    Attributes:
        owner: Step id of the product that gives it its identity.
        members: Step ids of its products with triangles, ascending.
        ancestors: Step ids of the elements above the owner, from the top down.
    """

    owner: int
    members: tuple[int, ...]
    ancestors: tuple[int, ...]


class Aggregation:
    """Trees of the elements above the products that have triangles.

    Args:
        file: The ``ifcopenshell.file``.
        extents: Extent by step id of the products with triangles.
        never_lifted: Returns whether a product is never lifted.
    """

    def __init__(self, file: Any, extents: Mapping[int, Extent], never_lifted: Callable[[Any], bool]) -> None:
        self._file = file
        self._extents = extents
        self._never_lifted = never_lifted
        self._parts: dict[int, list[int]] = {}
        self._roots: list[int] = []
        seen: set[int] = set()
        for step_id in sorted(extents):
            while step_id not in seen:
                seen.add(step_id)
                parent = _parent_element(file.by_id(step_id))
                if parent is None:
                    self._roots.append(step_id)
                    break
                self._parts.setdefault(parent.id(), []).append(step_id)
                step_id = parent.id()

    def parts_of(self, step_id: int) -> list[int]:
        """Return the step ids of a product's parts that have triangles, or parts that have."""
        return self._parts.get(step_id, [])

    def highest_of(self, group: Group) -> int:
        """Return the step id of the highest element above a group, or its owner, that has no other members."""
        highest = group.owner
        if self._leaves(highest) == group.members:
            for step_id in reversed(group.ancestors):
                if step_id in self._extents or self._parts[step_id] != [highest]:
                    break
                highest = step_id
        return highest

    def parts(self) -> list[Group]:
        """Return every product with triangles as its own group."""
        return [Group(step_id, (step_id,), self._above(step_id)) for step_id in sorted(self._extents)]

    def wholes(self, selected: frozenset[int] | None = None) -> list[Group]:
        """Return the lifts by the rules of this module.

        Args:
            selected: Step ids that a query selected. A curtain wall is opened if parts of it are selected, but not
                the whole.
        """
        groups = [group for root in sorted(self._roots) for group in self._lifts(root, selected or frozenset())]
        return sorted(groups, key=lambda group: group.owner)

    def _above(self, step_id: int) -> tuple[int, ...]:
        above: list[int] = []
        parent = _parent_element(self._file.by_id(step_id))
        while parent is not None and parent.id() not in above:
            above.append(parent.id())
            parent = _parent_element(parent)
        return tuple(reversed(above))

    def _lifts(self, root: int, selected: frozenset[int]) -> list[Group]:
        lifts: list[Group] = []
        inside: list[tuple[int, tuple[int, ...]]] = [(root, ())]
        while inside:
            step_id, above = inside.pop()
            leaves, product = self._leaves(step_id), self._file.by_id(step_id)
            if leaves == (step_id,):
                lifts.append(Group(step_id, leaves, above))
            elif self._is_opened(product, leaves, selected):
                lifts += [Group(step_id, (step_id,), above)] if step_id in self._extents else []
                inside += [(part, (*above, step_id)) for part in self._parts.get(step_id, ())]
            elif len(leaves) == 1 and product.is_a("IfcElementAssembly"):
                lifts.append(Group(leaves[0], leaves, (*above, step_id)))
            else:
                lifts.append(Group(step_id, leaves, above))
        return lifts

    def _leaves(self, step_id: int) -> tuple[int, ...]:
        found, inside = [], [step_id]
        while inside:
            part = inside.pop()
            found += [part] if part in self._extents else []
            inside += self._parts.get(part, ())
        return tuple(sorted(found))

    def _is_opened(self, product: Any, leaves: Sequence[int], selected: frozenset[int]) -> bool:
        if product.is_a() in SPLIT:
            return True
        if product.is_a("IfcCurtainWall"):
            return product.id() not in selected and not selected.isdisjoint(leaves)
        if not product.is_a("IfcElementAssembly"):
            return False
        if getattr(product, "AssemblyPlace", None) == "SITE":
            return True
        if any(self._never_lifted(self._file.by_id(leaf)) for leaf in leaves):
            return True
        return not hang_together([self._extents[leaf] for leaf in leaves])


def _parent_element(product: Any) -> Any | None:
    """Return the ``IfcElement`` that a product is a part of; None if there is none."""
    for relation in getattr(product, "Decomposes", ()) or ():
        if relation.is_a("IfcRelAggregates") and relation.RelatingObject.is_a("IfcElement"):
            return relation.RelatingObject
    return None


def hang_together(extents: Sequence[Extent]) -> bool:
    """Return whether the substantial parts form one connected piece, judged by their boxes."""
    low = np.array([extent.low_m for extent in extents]) - GAP_M / 2
    high = np.array([extent.high_m for extent in extents]) + GAP_M / 2
    touch = ((low[:, None] <= high[None]) & (high[:, None] >= low[None])).all(axis=2)
    label = connected_labels(len(extents), *np.nonzero(touch))
    volume = np.bincount(label, weights=[extent.volume_m3 for extent in extents])
    return int((volume >= SUBSTANTIAL * volume.sum()).sum()) <= 1


# Lifting anchors in a model: where the manufacturer of a part wants it to be slung.
#
# IFC has no class for them. Authoring tools write them as other classes (Tekla: ``IfcBeam``, ``IfcDiscreteAccessory``)
# inside the part's assembly; only the name identifies them. The words below are used in precast practice, in the
# languages of the models examined. A plain "anchor" does not count: it is often a foundation bolt.

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
    result: dict[int, list[Point]] = {}
    for ifc_class in _ACCESSORIES:
        for product in file.by_type(ifc_class):
            if product.id() in known or product.ObjectPlacement is None or not is_lifting_anchor(product):
                continue
            owner = _parent_element(product)
            if owner is None:
                continue
            at = placement.get_local_placement(product.ObjectPlacement)[:3, 3] * metres_per_unit - origin_m
            result.setdefault(owner.id(), []).append(_point(at))
    return result


def _anchor_point(mesh: TriangleMesh) -> Point:
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
    points = [_anchor_point(meshes[step_id]) for step_id in anchors]
    for step_id in dict.fromkeys((*above, *members)):
        points += bare.get(step_id, [])
    return tuple(dict.fromkeys(points))


def _point(at: NDArray[np.float64]) -> Point:
    x, y, z = (round(float(value), 6) + 0.0 for value in at)
    return (x, y, z)
