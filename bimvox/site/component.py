"""A prefabricated component: a rigid voxel shape, where it goes, and how it lies in the yard."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

from bimvox.bim.building import TriangleMesh
from bimvox.site.sparse import SPARSE

IntVec = tuple[int, int, int]


@dataclass(frozen=True, slots=True, eq=False)
class Shape:
    """A rigid set of cells relative to its reference cell, the lowest corner of its bounding box.

    Attributes:
        cells: (N, 3) int32, all >= 0, in ascending order.
        boxes: (B, 6) int32 half-open boxes ``x0 y0 z0 x1 y1 z1``, disjoint, their union is ``cells``.
    """

    cells: NDArray[np.int32]
    boxes: NDArray[np.int32]

    @property
    def size_vox(self) -> IntVec:
        """Edges of the bounding box."""
        x, y, z = (int(n) for n in self.boxes[:, 3:].max(axis=0))
        return (x, y, z)


class StoredPose(StrEnum):
    """How a component lies in the yard, relative to how it is built in."""

    AS_BUILT = "as_built"
    LYING_X = "lying_x"
    """Turned over so that its foot is at the lowest-index end and it lies along +x (the paper's column)."""
    LYING_Y = "lying_y"
    """The same along +y."""


@dataclass(frozen=True, slots=True)
class OrderHints:
    """What the site file and the building's file wish about the order; geometry goes before it.

    Attributes:
        first: Whether the site file wants it first.
        zone: Number of the assembly zone that it lies in, in the order in which the zones are worked on.
        zone_name: What that zone is called.
        task: Name of the task that sets it, where the building's file holds a schedule.
        task_rank: Place of that task.
        storey_rank: Number of its storey from below.
        assembly: GlobalId of the assembly that it was taken out of.
        connected: Ids of what the building's file says it is connected to.
    """

    first: bool = False
    zone: int | None = None
    zone_name: str | None = None
    task: str | None = None
    task_rank: int | None = None
    storey_rank: int | None = None
    assembly: str | None = None
    connected: tuple[str, ...] = ()


NO_HINTS = OrderHints()


@dataclass(frozen=True, slots=True)
class Lifting:
    """How a component hangs.

    Attributes:
        points_m: (x, y, z) where the slings hold it, at its place in the building; metres in the site's frame.
        source: ``anchors`` where the model has them, else ``centre_of_mass``: one point on its top above that.
        sling_rise_vox: By how many cells the hook hangs higher above its top than the crane's usual slings put it, so
            that the legs lean no more than the rules allow.
    """

    points_m: tuple[tuple[float, float, float], ...] = ()
    source: str = "centre_of_mass"
    sling_rise_vox: int = 0


USUAL_LIFTING = Lifting()


@dataclass(frozen=True, slots=True, eq=False, weakref_slot=True)
class Component:
    """One part to be lifted.

    Attributes:
        index: Position in ``Site.components``.
        id: Unique id; GlobalId where there is one.
        global_id: IFC GlobalId, or the body's name.
        ifc_class: For example ``IfcBeam``.
        name: The source's name.
        shape: Its cells as built in.
        target_vox: Reference cell at its place in the building.
        mesh: Its triangles at its place, metres in the site's frame.
        mass_kg: Its mass.
        hook_offset_vox: Cell of the hook line relative to the reference cell: x and y of the column above the centre of
            mass, z one above the shape's top.
        erected: Whether it is stored lying down and erected before transit (columns).
        start_vox: Reference cell in the yard as given by the site file, or None where the yard is to be packed.
        stored_pose: Pose in the yard for an explicit ``start_vox``.
        stored_turn: Quarter turns, counter-clockwise, by which it lies turned in the yard against how it is built in;
            None where the packer may choose.
        lifting: Where the slings hold it, and how high they are.
        sail_area_m2: The largest area that it shows the wind.
        before: Ids of components that must come later than this one (the planner's own constraint).
        after: Ids of components that must come earlier than this one.
        type_name: Name of its IFC type, if any.
        storey: Name of the storey that holds it, if any.
        material: Name of its (main) material, if any.
        mass_source: ``quantity``, ``density`` (of its material) or ``default`` (2400 kg/m3); empty where not known.
        hints: What is wished about its place in the order.
        crane: Which crane lifts it: number in ``Site.cranes``.
    """

    index: int
    id: str
    global_id: str
    ifc_class: str
    name: str
    shape: Shape
    target_vox: IntVec
    mesh: TriangleMesh
    mass_kg: float
    hook_offset_vox: IntVec
    erected: bool = False
    start_vox: IntVec | None = None
    stored_pose: StoredPose | None = None
    before: tuple[str, ...] = ()
    after: tuple[str, ...] = ()
    type_name: str | None = None
    storey: str | None = None
    material: str | None = None
    mass_source: str = ""
    hints: OrderHints = NO_HINTS
    stored_turn: int | None = None
    lifting: Lifting = USUAL_LIFTING
    sail_area_m2: float = 0.0
    crane: int = field(default=0, metadata=SPARSE)
