"""Turn products into elements: identity, role, mass, and one mesh for each lift."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bimvox.bim.building import Casting, Element, Role, TriangleMesh
from bimvox.bim.ifc.answer import Selected
from bimvox.bim.ifc.assembly import Aggregation, Group, MeshedProduct, anchors_without_mesh, points_of_group
from bimvox.bim.ifc.class_roles import CURTAIN_TYPES, UNKNOWN, is_never_precast, role_of_class
from bimvox.bim.ifc.group_mass import GroupMasses, Weighed
from bimvox.bim.ifc.mass import DOUBTS, REPEATED_WHOLE, Mass, Masses
from bimvox.bim.ifc.open import OpenedIfc
from bimvox.bim.ifc.properties import Properties, layers_of, stated_casting
from bimvox.bim.ifc.relations import (
    ProductTask,
    connected_products,
    element_pairs,
    storey_height,
    storey_of,
    tasks_of_products,
)
from bimvox.bim.ifc.text import label
from bimvox.bim.kinds.evidence import Facts, casting_of, judge, solid_share
from bimvox.bim.kinds.kind import (
    OUT,
    UNTOUCHED,
    Confidence,
    Corrected,
    Correction,
    Judgement,
    Kind,
    all_of,
    refused,
    unmatched,
)
from bimvox.bim.kinds.words import density_of_kind, is_existing_by_name, meaning_of, of_same_mass, role_by_name
from bimvox.errors import NothingSelectedError, SelectionError


class ProductCorrections:
    """The corrections of one file.

    Args:
        corrections: As the site file has them.
        select_each: Returns the step ids that queries match, or the errors about them.

    Raises:
        SelectionError: If a query is malformed; names its place in the file.
    """

    def __init__(
        self,
        corrections: Sequence[Correction] = (),
        select_each: Callable[[Sequence[str]], Sequence[Selected]] = lambda queries: (),
    ) -> None:
        self._corrections = corrections
        self._matched: set[Correction] = set()
        by_query = [one for one in corrections if not one.one_part]
        self._ids: dict[Correction, frozenset[int]] = {}
        for correction, found in zip(by_query, select_each([one.select for one in by_query]), strict=True):
            if isinstance(found, SelectionError) and not isinstance(found, NothingSelectedError):
                raise refused(correction, found)
            self._ids[correction] = frozenset() if isinstance(found, SelectionError) else found

    @property
    def step_ids(self) -> frozenset[int]:
        """The products that the queries match."""
        return frozenset().union(*self._ids.values())

    def of(self, group: Group, owner: Any) -> Corrected:
        """Return what the corrections say of a group: those that select its owner, an ancestor, or all its members."""
        if not self._corrections:
            return UNTOUCHED
        above, members = {group.owner, *group.ancestors}, frozenset(group.members)
        names = (str(owner.GlobalId), f"{owner.GlobalId}#{group.owner}")
        found = [
            one
            for one in self._corrections
            if (
                one.select in names
                if one.one_part
                else not above.isdisjoint(self._ids[one]) or members <= self._ids[one]
            )
        ]
        self._matched.update(found)
        return all_of(found)

    def notes(self) -> list[str]:
        """Return a note about each correction of types that has selected nothing."""
        return unmatched([one for one in self._corrections if not one.one_part], self._matched.__contains__)


NO_CORRECTIONS = ProductCorrections()


_SHOWN = 5
_STAYS = (Role.STRUCTURE, Role.GROUND)


class ElementBuilder:
    """Turns groups of parts into elements, and collects notes."""

    def __init__(
        self,
        opened: OpenedIfc,
        parts: Mapping[int, MeshedProduct],
        selected: frozenset[int] | None,
        properties: Properties,
        origin_m: NDArray[np.float64],
        corrections: ProductCorrections = NO_CORRECTIONS,
    ) -> None:
        self._file = opened.file
        self._schema = opened.schema
        self._metres_per_unit = opened.metres_per_unit
        self._parts = parts
        self._selected = selected
        self._properties = properties
        self._corrections = corrections
        extents = {step_id: part.extent for step_id, part in parts.items()}
        self._aggregation = Aggregation(opened.file, extents, lambda product: self._role(product) in _STAYS)
        masses = Masses(opened.file, properties, self._default_kg_m3, self._corrected_kg_m3, self._solid_share)
        self._masses = GroupMasses(opened.file, masses, parts, self._aggregation.parts_of)
        self._ids: set[str] = set()
        self._made_unique: list[str] = []
        self._guessed = 0
        self._demolished: list[str] = []
        self._doubts: dict[str, list[str]] = {}
        self._tasks, self._task_notes = tasks_of_products(opened.file)
        self._by_group: dict[tuple[int, tuple[int, ...], TriangleMesh], tuple[Judgement, Casting | None]] = {}
        self._element_of: dict[int, str] = {}
        self._anchors = anchors_without_mesh(opened.file, parts, opened.metres_per_unit, origin_m)

    def groups(self, assemblies: str) -> tuple[list[Group], dict[int, str]]:
        """Return the lifts, in file order, and why other products with triangles are not in any of them."""
        own = self._aggregation
        groups = own.parts() if assemblies == "parts" else own.wholes(self._selected)
        repeated = {
            group.owner: "its parts, which are elements, repeat its body"
            for group in groups
            if group.members == (group.owner,) and self._masses.is_repeated(group.owner)
        }
        self._doubt([REPEATED_WHOLE], *(self._file.by_id(step_id) for step_id in repeated))
        return [group for group in groups if group.owner not in repeated], repeated

    def element(self, group: Group) -> Element:
        """Return the element of a group."""
        owner = self._file.by_id(group.owner)
        weighed = self._weighed(group)
        mesh = TriangleMesh.joined([self._parts[step_id].mesh for step_id in weighed.shown])
        judgement, casting = self._judged(group, mesh)
        corrected = self._corrections.of(group, owner)
        self._guessed += sum(not self._parts[step_id].solid.exact for step_id in group.members)
        mass = weighed.mass if corrected.mass_kg is None else Mass(corrected.mass_kg, "quantity")
        self._doubt(mass.doubts, owner)
        material = self._properties.material(owner)
        if material is None:
            heaviest = max(group.members, key=lambda step_id: weighed.of_product[step_id].kg)
            material = self._properties.material(self._file.by_id(heaviest))
        role = self._planned_role(owner, group, judgement.kind, corrected)
        if role is Role.STRUCTURE and self._properties.is_demolished(owner):
            self._demolished.append(label(owner.Name or owner.GlobalId))
        whole = group.members != (group.owner,)
        element_id = self._unique(owner)
        self._element_of.update(dict.fromkeys((group.owner, *group.members), element_id))
        storey = storey_of(owner)
        task = self._task(group)
        opened = next((a for a in reversed(group.ancestors) if self._file.by_id(a).is_a("IfcElementAssembly")), None)
        return Element(
            id=element_id,
            global_id=str(owner.GlobalId),
            ifc_class=str(owner.is_a()),
            name=label(owner.Name),
            mesh=mesh,
            role=role,
            mass_kg=mass.kg,
            mass_source=mass.source,
            volume_guessed=mass.guessed,
            doubted_kg=mass.doubted_kg,
            type_name=self._properties.type_name(owner),
            storey=None if storey is None else label(storey.Name or storey.GlobalId),
            material=material,
            members=tuple(str(self._file.by_id(step_id).GlobalId) for step_id in group.members) if whole else (),
            storey_height_m=None if storey is None else round(storey_height(storey) * self._metres_per_unit, 6),
            assembly=None if opened is None else str(self._file.by_id(opened).GlobalId),
            task=None if task is None else task.name,
            task_rank=None if task is None else task.rank,
            lifting_points_m=self._lifting_points(group),
            predefined_type=self._properties.predefined_type(owner),
            casting=casting,
            judgement=judgement,
            stated_means=corrected.by_type,
        )

    def _weighed(self, group: Group) -> Weighed:
        """Return the mass of a group: a whole with no other parts may state it, too."""
        top = self._aggregation.highest_of(group)
        weighed = self._masses.weigh(top, group.members)
        assert weighed is not None  # a group has members
        return weighed

    def _doubt(self, doubts: Sequence[str], *owners: Any) -> None:
        for doubt in doubts:
            self._doubts.setdefault(doubt, []).extend(label(owner.Name or owner.GlobalId) for owner in owners)

    def connections(self) -> tuple[tuple[str, str], ...]:
        """Return the pairs of elements made so far that the file connects."""
        return element_pairs(connected_products(self._file), self._element_of)

    def notes(self) -> list[str]:
        """Return notes about the elements made so far."""
        notes = list(self._task_notes)
        if self._made_unique:
            shown = ", ".join(self._made_unique[:_SHOWN])
            more = f" and {len(self._made_unique) - _SHOWN} more" if len(self._made_unique) > _SHOWN else ""
            notes.append(f"GlobalIds that occur more than once were made unique: {shown}{more}")
        if self._guessed:
            notes.append(f"parts that are not closed, so their mass is a guess unless stated: {self._guessed}")
        if self._demolished:
            what = f"{len(self._demolished)} ({_some(self._demolished)})"
            notes.append(
                f"parts to be demolished stand in the way of all lifts; if they go before, leave them out: {what}"
            )
        doubted = [(doubt, self._doubts[doubt]) for doubt in DOUBTS if self._doubts.get(doubt)]
        return [*notes, *(f"{doubt}: {len(names)} ({_some(names)})" for doubt, names in doubted)]

    def _task(self, group: Group) -> ProductTask | None:
        """Return the task of the lift, otherwise of the nearest assembly above, otherwise the last of its members."""
        for step_id in (group.owner, *reversed(group.ancestors)):
            if step_id in self._tasks:
                return self._tasks[step_id]
        inside = [self._tasks[step_id] for step_id in group.members if step_id in self._tasks]
        return max(inside, key=lambda task: task.rank) if inside else None

    def _default_kg_m3(self, product: Any) -> float:
        """Return the density of a product with a mesh whose material is not known: that of its kind."""
        own = Group(product.id(), (product.id(),), ())
        return density_of_kind(self._judged(own, self._parts[product.id()].mesh)[0].kind)

    def _corrected_kg_m3(self, product: Any) -> float | None:
        """Return the density of a product if the site file says that it is of another kind than its materials."""
        kind = self._corrections.of(Group(product.id(), (product.id(),), ()), product).kind
        if kind is None:
            return None
        said = (meaning_of(label(material.Name)) for material, _ in layers_of(product))
        return None if any(one is not None and of_same_mass(one.kind, kind) for one in said) else density_of_kind(kind)

    def _solid_share(self, product: Any, volume_m3: float, kg_m3: float, is_assumed: bool) -> float | None:
        return solid_share(
            str(product.is_a()),
            self._names(product),
            self._properties.predefined_type(product),
            self._parts[product.id()].mesh,
            volume_m3,
            kg_m3,
            is_assumed=is_assumed,
        )

    def _names(self, product: Any) -> tuple[str | None, ...]:
        """Return the names of a product, its type and its object type."""
        type_name = self._properties.type_name(product)
        return label(product.Name), type_name, label(getattr(product, "ObjectType", None))

    def _judged(self, group: Group, mesh: TriangleMesh) -> tuple[Judgement, Casting | None]:
        """Return what a group is and how it is cast: by its owner, and by the largest member that has a material."""
        judgement, casting = self._by_evidence(group, mesh)
        corrected = self._corrections.of(group, self._file.by_id(group.owner)).judgement
        return (judgement, casting) if corrected is None else (corrected, casting_of(corrected.kind, casting))

    def _by_evidence(self, group: Group, mesh: TriangleMesh) -> tuple[Judgement, Casting | None]:
        """Return what a group is by all that the file says: asked once for its density, and once for the part."""
        asked = (group.owner, group.members, mesh)
        if asked not in self._by_group:
            self._by_group[asked] = self._judged_anew(group, mesh)
        return self._by_group[asked]

    def _judged_anew(self, group: Group, mesh: TriangleMesh) -> tuple[Judgement, Casting | None]:
        owner = self._file.by_id(group.owner)
        if self._properties.is_temporary(owner):
            return Judgement(Kind.FORMWORK, Confidence.STATED, "its properties state that it is temporary"), None
        largest = sorted(group.members, key=lambda one: -self._parts[one].extent.volume_m3)
        layered = (layers_of(self._file.by_id(step_id)) for step_id in (group.owner, *largest))
        sets = [self._properties.sets_of(self._file.by_id(step_id)) for step_id in (group.owner, *group.members)]
        return judge(
            Facts(
                ifc_class=str(owner.is_a()),
                names=self._names(owner),
                layers=[(label(one.Name), share) for one, share in next(filter(None, layered), [])],
                mesh=mesh,
                predefined_type=self._properties.predefined_type(owner),
                casting=next(filter(None, map(stated_casting, sets)), None),
                classes=self._properties.classes(owner),
            )
        )

    def _lifting_points(self, group: Group) -> tuple[tuple[float, float, float], ...]:
        """Return the anchors of its members, and those of the assembly above it if that has only one part."""
        above = [group.owner]
        if group.ancestors and len(group.members) == 1 and group.owner == group.members[0]:
            above.append(group.ancestors[-1])
        meshes = {step_id: self._parts[step_id].mesh for step_id in group.members}
        return points_of_group(self._file, group.members, above, meshes, self._anchors)

    def _unique(self, owner: Any) -> str:
        global_id = str(owner.GlobalId)
        unique = global_id if global_id not in self._ids else f"{global_id}#{owner.id()}"
        if unique != global_id:
            self._made_unique.append(unique)
        self._ids.add(unique)
        return unique

    def _role(self, product: Any) -> Role:
        """Return the role of a product by its class, its status, and its name if its class has no meaning."""
        ifc_class = product.is_a()
        role = role_of_class(self._schema, ifc_class) or Role.FITTING
        if ifc_class in UNKNOWN:
            role = role_by_name(label(product.Name)) or role_by_name(label(product.ObjectType)) or role
        if role in (Role.COMPONENT, Role.FITTING) and (
            self._properties.is_existing(product) or is_existing_by_name(label(product.Name))
        ):
            return Role.STRUCTURE
        if role is Role.COMPONENT and self._properties.predefined_type(product) in CURTAIN_TYPES:
            return Role.FITTING
        return role

    def _planned_role(self, owner: Any, group: Group, kind: Kind, corrected: Corrected) -> Role:
        """Return the role of a group, with the corrections and the selection applied."""
        if corrected.means is not None:
            return Role.FITTING if corrected.means == OUT else Role.COMPONENT
        if corrected.kind is Kind.PILE:
            return Role.STRUCTURE
        role = self._role(owner)
        if owner.is_a("IfcElementAssembly"):
            inside = [self._role(self._file.by_id(step_id)) for step_id in group.members]
            role = role if role in inside else inside[0]
        if self._selected is None:
            if kind is Kind.FORMWORK and role is Role.COMPONENT:
                return Role.FITTING
            is_part = role is Role.FITTING and kind is Kind.PRECAST and not is_never_precast(self._schema, owner.is_a())
            return Role.COMPONENT if is_part else role
        if not self._selected.isdisjoint((group.owner, *group.members, *group.ancestors)):
            return Role.COMPONENT
        return Role.STRUCTURE if role is Role.COMPONENT else role


def _some(names: list[str], most: int = 3) -> str:
    """Return the first few distinct names as text."""
    different = list(dict.fromkeys(names))
    return ", ".join(different[:most]) + (", ..." if len(different) > most else "")
