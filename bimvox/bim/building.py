"""A building as elements with triangles: what every reader returns."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from datetime import date
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

from bimvox.bim.kinds.kind import UNKNOWN, Judgement
from bimvox.errors import listed
from bimvox.kept import kept

ASSUMED = 0.25
"""From this share on, a mass is an assumption."""
_BY_SOURCE = {"quantity": 0.03, "density": 0.1, "default": ASSUMED}
_GUESSED_VOLUME = 0.4


def mass_uncertainty(source: str, volume_guessed: bool) -> float:
    """Return the share by which a mass may be wrong (professional judgement).

    Args:
        source: Where the mass comes from: ``quantity``, ``density`` or ``default``; empty if that is not known.
        volume_guessed: Whether the volume is guessed, because the mesh is open.
    """
    if volume_guessed and source != "quantity":
        return _GUESSED_VOLUME
    return _BY_SOURCE.get(source, ASSUMED)


class Role(StrEnum):
    """What an element is to the lift planner."""

    COMPONENT = "component"
    """Prefabricated: it is lifted from the yard to its place."""
    STRUCTURE = "structure"
    """In place before the first lift, and never lifted."""
    FITTING = "fitting"
    """Installed after the lifts (doors, windows, finishes, services): not there while the crane works."""
    GROUND = "ground"
    """Terrain."""


BUILT = (Role.COMPONENT, Role.STRUCTURE)
"""What stands on the site when all lifts are done."""


class Casting(StrEnum):
    """Where a concrete part is cast, as its source states it."""

    PRECAST = "precast"
    IN_SITU = "in_situ"


def part_name(id_: str, *names: str) -> str:
    """Return the first name that is not empty, with the id in brackets; the id alone if there is no other name."""
    name = next(filter(None, names), id_)
    return id_ if name == id_ else f"{name} ({id_})"


def plain_class(ifc_class: str) -> str:
    """Return an IFC class without the variants of IFC2X3: ``IfcWall`` for ``IfcWallStandardCase``."""
    return ifc_class.removesuffix("StandardCase").removesuffix("ElementedCase")


@dataclass(frozen=True, slots=True, eq=False, weakref_slot=True)
class TriangleMesh:
    """Triangles in metres, right-handed, z up.

    Attributes:
        vertices_m: (V, 3) float64.
        faces: (F, 3) int32 indices into ``vertices_m``, counter-clockwise seen from outside where the source says so.
    """

    vertices_m: NDArray[np.float64]
    faces: NDArray[np.int32]

    def __repr__(self) -> str:
        return f"<TriangleMesh: {len(self.faces):,} triangles>"

    @classmethod
    def joined(cls, meshes: Sequence[TriangleMesh]) -> TriangleMesh:
        """Return meshes concatenated; each keeps its own vertices."""
        if len(meshes) == 1:
            return meshes[0]
        offsets = np.cumsum([0] + [len(mesh.vertices_m) for mesh in meshes[:-1]])
        faces = [mesh.faces + offset for mesh, offset in zip(meshes, offsets, strict=True)]
        return cls(np.concatenate([mesh.vertices_m for mesh in meshes]), np.concatenate(faces).astype(np.int32))

    @property
    def triangles_m(self) -> NDArray[np.float64]:
        """(F, 3, 3) float64: triangle, corner, coordinate."""
        return self.vertices_m[self.faces]

    @property
    @kept
    def bounds_m(self) -> NDArray[np.float64]:
        """(2, 3) float64: lowest and highest corner of the vertices that a face uses."""
        used = np.zeros(len(self.vertices_m), np.bool_)
        used[self.faces] = True
        vertices_m = self.vertices_m[used]
        return np.stack([vertices_m.min(axis=0), vertices_m.max(axis=0)])

    @property
    def signed_volume_m3(self) -> float:
        """Volume by the divergence theorem; exact for closed meshes, negative for inverted ones."""
        centre = self.vertices_m.mean(axis=0)
        a, b, c = np.moveaxis(self.triangles_m - centre, 1, 0)
        return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6.0)


@dataclass(frozen=True, slots=True, eq=False)
class Element:
    """One element of a building: one lift, or one obstacle.

    Attributes:
        id: Unique within the building. The GlobalId, followed by ``#<step id>`` if it occurs more than once; for
            meshes the body's name.
        global_id: IFC GlobalId; equal to ``id`` for meshes.
        ifc_class: For example ``IfcBeam``; ``Mesh`` for bodies of mesh files.
        name: Its name in the source; may be empty.
        mesh: Triangles in metres in the building's frame.
        role: What it is to the planner.
        mass_kg: Its mass.
        mass_source: ``quantity``, ``density`` (of its material) or ``default`` (of its kind).
        type_name: Name of its IFC type, if any.
        storey: Name of the storey that contains it, if any.
        material: Name of its (main) material, if any.
        members: Ids of the products whose geometry was merged into this element (an assembly's parts).
        storey_height_m: Height of that storey as the file states it, for comparison among elements only.
        assembly: GlobalId of the innermost assembly that it was taken out of, if any.
        task: Name of the task that sets it, if the file contains a schedule.
        task_rank: Rank of that task among all tasks, from 0.
        lifting_points_m: (x, y, z) of its lifting anchors, metres in the building's frame; empty if none are modelled.
        predefined_type: Its IFC predefined type in capitals, for example ``HOLLOWCORE``, if any.
        casting: Whether its source states that it is precast, or cast in place; None if it states neither.
        volume_guessed: Whether its mass is that of a guessed volume: its mesh is open.
        judgement: What kind of part it is, and why.
        stated_means: How the site file says that parts of its type get to their places, if it does.
        doubted_kg: The mass that its source states, and the one by volume and material, if these contradict each other.
    """

    id: str
    global_id: str
    ifc_class: str
    name: str
    mesh: TriangleMesh
    role: Role
    mass_kg: float
    mass_source: str
    type_name: str | None = None
    storey: str | None = None
    material: str | None = None
    members: tuple[str, ...] = ()
    storey_height_m: float | None = None
    assembly: str | None = None
    task: str | None = None
    task_rank: int | None = None
    lifting_points_m: tuple[tuple[float, float, float], ...] = ()
    predefined_type: str | None = None
    casting: Casting | None = None
    volume_guessed: bool = False
    judgement: Judgement = UNKNOWN
    stated_means: str | None = None
    doubted_kg: tuple[float, ...] = ()

    @property
    def mass_uncertainty(self) -> float:
        """Share by which its mass may be wrong."""
        return mass_uncertainty(self.mass_source, self.volume_guessed)

    @property
    def label(self) -> str:
        """The element for people: its name, then its id in brackets; the id alone if there is no other name."""
        return part_name(self.id, self.name)


@dataclass(frozen=True, slots=True)
class SkippedProduct:
    """A product of the source that did not become an element, and why."""

    global_id: str
    ifc_class: str
    name: str
    reason: str


@dataclass(frozen=True, slots=True)
class Source:
    """Where a building came from.

    Attributes:
        name: File name without folder, so that logs do not depend on where the file is.
        sha256: Of the file's bytes. For a glTF with external buffers: of the concatenated hex digests of the file and
            its buffers.
        format: ``IFC2X3``, ``IFC4``, ``IFC4X3_ADD2``, or a mesh format such as ``STL``.
        unit: Length unit of the file (``m``, ``mm``, ``ft`` ...).
        unit_assumed: Whether that unit was assumed because the file does not state one.
    """

    name: str
    sha256: str
    format: str
    unit: str
    unit_assumed: bool = False


@dataclass(frozen=True, slots=True)
class Storey:
    """A storey of the source.

    Attributes:
        name: Its name; may be empty.
        elevation_m: Its elevation as stated, which is 0 for the reference level of most buildings.
        height_m: Its height in the file's world coordinates.
    """

    name: str
    elevation_m: float
    height_m: float


@dataclass(frozen=True, slots=True, eq=False, weakref_slot=True)
class Building:
    """A building read from a file.

    Attributes:
        elements: In the order of the file (step id, or body order).
        skipped: Every product that did not become an element.
        source: Where it came from.
        origin_m: (3,) float64, subtracted from the file's world coordinates to keep numbers small; whole metres, so
            that a lattice anchored at multiples of the cell size does not shift. ``world = local + origin_m``.
        georeference: Map conversion of the file, if any, as plain values (``eastings_m``, ``crs`` ...).
        notes: What the user should know (repairs, doubts), one sentence each.
        connections: Pairs of element ids that the file connects (``IfcRelConnectsElements`` and its subtypes).
        storeys: Its storeys, in the order of the file.
        terrain_m: Height of the terrain in the file's world coordinates, if the file states it as a number.
        starts_on: First day of the schedule in the file, if it has one.
        written_on: Day on which the file was written, if it says so.
    """

    elements: tuple[Element, ...]
    skipped: tuple[SkippedProduct, ...]
    source: Source
    origin_m: NDArray[np.float64] = field(default_factory=lambda: np.zeros(3))
    georeference: Mapping[str, str | float] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    connections: tuple[tuple[str, str], ...] = ()
    storeys: tuple[Storey, ...] = ()
    terrain_m: float | None = None
    starts_on: date | None = None
    written_on: date | None = None

    def __repr__(self) -> str:
        lifted = sum(element.role is Role.COMPONENT for element in self.elements)
        return f"<Building {self.source.name!r}: {len(self.elements):,} elements, {lifted:,} to lift>"

    def with_role(self, numbers: Collection[int], role: Role, said: str) -> Building:
        """Return it with another role of some elements, and a note that names them.

        Args:
            numbers: Their places in ``elements``.
            role: Their role.
            said: The note, up to their names.
        """
        elements = tuple(replace(one, role=role) if n in numbers else one for n, one in enumerate(self.elements))
        names = listed((self.elements[n].label for n in sorted(numbers)), most=5)
        return replace(self, elements=elements, notes=(*self.notes, f"{said}: {names}"))

    def with_meshes(self, meshes: Mapping[int, TriangleMesh], said: str) -> Building:
        """Return it with other triangles of some elements, by their places in ``elements``, and a note."""
        elements = tuple(replace(one, mesh=meshes[n]) if n in meshes else one for n, one in enumerate(self.elements))
        names = listed((self.elements[n].label for n in meshes), most=5)
        return replace(self, elements=elements, notes=(*self.notes, f"{said} {names}"))

    @property
    def bounds_m(self) -> NDArray[np.float64]:
        """(2, 3) float64: the box around all elements."""
        corners = np.stack([element.mesh.bounds_m for element in self.elements])
        return np.stack([corners[:, 0].min(axis=0), corners[:, 1].max(axis=0)])


_NUMBERED = re.compile(r"(?:[-\s:_#.]+[^\W\d_]{0,2}\d+)+$")
_MARK = re.compile(r"[^\W\d]+(?=\d+$)")
"""The letters of a part's mark: ``C`` of ``C101``."""


def type_of(element: Element) -> str | None:
    """Return the name of a part's type, otherwise its own without the number at its end; None if it has neither."""
    return element.type_name or without_number(element.name) or None


def without_number(name: str) -> str:
    """Return a name without the numbers at its end."""
    plain = _NUMBERED.sub("", name)
    mark = _MARK.match(plain)
    return mark[0] if mark else plain
