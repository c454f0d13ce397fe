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

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bimvox.bim.building import TriangleMesh
from bimvox.bim.connected import connected_labels
from bimvox.bim.ifc.class_roles import SPLIT
from bimvox.bim.mesh.repair import Solid

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
                parent = parent_element(file.by_id(step_id))
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
        parent = parent_element(self._file.by_id(step_id))
        while parent is not None and parent.id() not in above:
            above.append(parent.id())
            parent = parent_element(parent)
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


def parent_element(product: Any) -> Any | None:
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
