"""A prefabricated component: its rigid voxel shape, its place in the building, and its pose in the yard."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any, TypeVar, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bimvox.bim.building import Casting, TriangleMesh, mass_uncertainty, part_name
from bimvox.bim.kinds.kind import UNKNOWN, Judgement
from bimvox.crane.gear import Rig
from bimvox.grid.summed_area import boxes_of
from bimvox.site.means import Means
from bimvox.sparse import SPARSE

IntVec = tuple[int, int, int]


@dataclass(frozen=True, slots=True, eq=False)
class Shape:
    """A rigid set of cells relative to its reference cell, the lowest corner of its bounding box.

    Attributes:
        cells: (N, 3) int32, all >= 0, in ascending order.
        boxes: (B, 6) int32 half-open, disjoint boxes ``x0 y0 z0 x1 y1 z1``; their union is ``cells``.
    """

    cells: NDArray[np.int32]
    boxes: NDArray[np.int32]

    @property
    def size_vox(self) -> IntVec:
        """Edges of the bounding box."""
        x, y, z = (int(n) for n in self.boxes[:, 3:].max(axis=0))
        return (x, y, z)


class StoredPose(StrEnum):
    """How a component lies in the yard, relative to its orientation in the building."""

    AS_BUILT = "as_built"
    LYING_X = "lying_x"
    """Tipped over so that it lies along +x with its foot at the lowest-index end (the paper's column)."""
    LYING_Y = "lying_y"
    """The same along +y."""


@dataclass(frozen=True, slots=True)
class OrderHints:
    """What the site file and the building file ask of the order; geometry takes precedence.

    Attributes:
        first: Whether the site file asks for it first.
        zone: Number of its assembly zone, in working order.
        zone_name: Name of that zone.
        task: Name of the task that sets it, if the building file holds a schedule.
        task_rank: Position of that task in the schedule.
        storey_rank: Number of its storey, counted from the lowest.
        assembly: GlobalId of the assembly that it was part of.
        connected: Ids of the parts to which the building file connects it.
        rank: Rank of its class within a level: the lower ones are set first. None if levels do not matter.
    """

    first: bool = False
    zone: int | None = None
    zone_name: str | None = None
    task: str | None = None
    task_rank: int | None = None
    storey_rank: int | None = None
    assembly: str | None = None
    connected: tuple[str, ...] = ()
    rank: int | None = field(default=None, metadata=SPARSE)


NO_HINTS = OrderHints()


@dataclass(frozen=True, slots=True)
class Lifting:
    """How a component hangs on its slings.

    Attributes:
        points_m: Lifting points (x, y, z) with the component at its place in the building; metres in the site frame.
        source: ``anchors`` if the model has them; ``assumed`` if they were chosen with the gear; ``centre_of_mass``:
            one point on the top above it.
        sling_rise_vox: Cells by which the hook hangs higher than with the crane's usual slings, so that the sling angle
            stays within the rules.
        rig: The gear chosen for it; None: the crane's usual rigging.
        no_gear: Why no gear of the catalogue serves; empty if one does.
    """

    points_m: tuple[tuple[float, float, float], ...] = ()
    source: str = "centre_of_mass"
    sling_rise_vox: int = 0
    rig: Rig | None = field(default=None, metadata=SPARSE)
    no_gear: str = field(default="", metadata=SPARSE)


USUAL_LIFTING = Lifting()


@dataclass(frozen=True, slots=True)
class Tandem:
    """How two cranes hold a part.

    Attributes:
        second: Index in ``Site.cranes`` of the second crane.
        points_m: Where the first one holds it, then where the second one does: (x, y, z) on its top with the part at
            its place, metres in the site frame. Its centre of mass is below the line between them.
    """

    second: int
    points_m: tuple[tuple[float, float, float], tuple[float, float, float]]


@dataclass(frozen=True, slots=True, eq=False, weakref_slot=True)
class Component:
    """One part to be lifted; fields that an ``Element`` has too are those of its element.

    Attributes:
        index: Position in ``Site.components``.
        shape: Its cells in its orientation in the building.
        target_vox: Reference cell at its place in the building.
        mesh: Its triangles at its place, metres in the site frame.
        hook_offset_vox: Cell of the hook line relative to the reference cell: x and y of the column above the centre of
            mass, z one above the shape's top.
        hook_aside_vox: How far the hook hangs from the middle of that cell on plan, cells: its line is exactly above
            the centre of mass.
        erected: Whether it is stored lying down and upended before transit (columns).
        start_vox: Reference cell in the yard from the site file; None if the planner places it.
        stored_pose: Pose in the yard for an explicit ``start_vox``.
        stored_turn: Quarter turns, counter-clockwise, between its orientation in the building and in the yard; None if
            the planner chooses.
        lifting: Its lifting points and sling height.
        sail_area_m2: The largest area that it presents to the wind.
        before: Ids of components that must be set later than this one (a constraint of the site file).
        after: Ids of components that must be set earlier than this one.
        mass_source: ``quantity``, ``density`` (of its material) or ``default`` (of its kind); empty if not known.
        hints: Wishes about its position in the order.
        crane: Index in ``Site.cranes`` of the crane that lifts it.
        means: How it gets to its place: lifted by the crane, cast there, or set by hand.
        means_reason: Why the crane does not lift it; empty if it does.
        spans: Whether it is as low as the ground and yet over other parts, such as the ceiling of a basement.
        doubted_kg: The mass that its source states, and the one by volume and material, if these contradict each other:
            the greater one counts.
        flip_rise_vox: How far it is lifted level before it is turned over between two hooks; 0: if it lies, it is
            upended about its foot.
        tandem: The second crane that carries it together with ``crane``, and where each holds it; None: ``crane`` alone
            carries it.
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
    predefined_type: str | None = field(default=None, metadata=SPARSE)
    means: Means = field(default=Means.CRANE, metadata=SPARSE)
    means_reason: str = field(default="", metadata=SPARSE)
    casting: Casting | None = field(default=None, metadata=SPARSE)
    judgement: Judgement = field(default=UNKNOWN, metadata=SPARSE)
    hook_aside_vox: tuple[float, float] = field(default=(0.0, 0.0), metadata=SPARSE)
    volume_guessed: bool = field(default=False, metadata=SPARSE)
    stated_means: Means | None = field(default=None, metadata=SPARSE)
    spans: bool = field(default=False, metadata=SPARSE)
    doubted_kg: tuple[float, ...] = field(default=(), metadata=SPARSE)
    flip_rise_vox: int = field(default=0, metadata=SPARSE)
    tandem: Tandem | None = field(default=None, metadata=SPARSE)

    def __repr__(self) -> str:
        return f"<Component {self.label}: {self.ifc_class}, {self.mass_kg / 1000:.3g} t>"

    @property
    def mass_uncertainty(self) -> float:
        """Share by which its mass may be wrong."""
        return mass_uncertainty(self.mass_source, self.volume_guessed)

    @property
    def hook_line_vox(self) -> tuple[float, float, float]:
        """``hook_offset_vox`` with the hook's place within its cell: its line is half a cell from there in x and y."""
        (x, y, z), (aside_x, aside_y) = self.hook_offset_vox, self.hook_aside_vox
        return (x + aside_x, y + aside_y, z)

    @property
    def label(self) -> str:
        """The component for people: its name, then its id in brackets; the id alone if there is no other name."""
        return part_name(self.id, self.name)


def shape_of(cells: ArrayLike) -> tuple[Shape, IntVec]:
    """Return the shape of a set of cells and its reference cell.

    Args:
        cells: (N, 3) integer cells, N >= 1, in any order.

    Returns:
        The shape relative to the lowest corner of the bounding box, and that corner.
    """
    absolute = np.unique(np.asarray(cells, dtype=np.int32), axis=0)
    low = absolute.min(axis=0)
    relative = absolute - low
    dense = np.zeros(relative.max(axis=0) + 1, np.bool_)
    dense[tuple(relative.T)] = True
    return Shape(frozen(relative), frozen(boxes_of(dense))), (int(low[0]), int(low[1]), int(low[2]))


def turned_shape(shape: Shape, turn: int) -> Shape:
    """Return a shape turned by quarters about z, counter-clockwise."""
    x, y, z = shape.cells.T
    for _ in range(turn % 4):
        x, y = y.max() - y, x
    return shape if turn % 4 == 0 else shape_of(np.stack([x, y, z], axis=1))[0]


def turned_hook(shape: Shape, hook_offset_vox: IntVec, turn: int) -> IntVec:
    """Return the hook's cell, relative to the reference cell, of a shape turned by quarters about z."""
    x, y, z = hook_offset_vox
    size_x, size_y, _ = shape.size_vox
    for _ in range(turn % 4):
        x, y, size_x, size_y = size_y - 1 - y, x, size_y, size_x
    return (x, y, z)


def turned_aside(aside_vox: tuple[float, float], turn: int) -> tuple[float, float]:
    """Return how far the hook is from the middle of its cell when its part is turned by quarters about z."""
    x, y = aside_vox
    for _ in range(turn % 4):
        x, y = -y, x
    return (x, y)


def turning_columns(shape: Shape, hook_line_vox: tuple[float, float, float], turn: int) -> NDArray[np.int32]:
    """Return the (N, 2) columns, relative to the reference cell, that a part sweeps turning about its hook: a disc.

    Turned by ``turn`` quarters, the part lies on whole cells, and its hook need not be where it is with the part not
    turned: before it turns, it moves by the difference. The disc is wider by as much.
    """
    x, y, _ = hook_line_vox
    column = np.rint([x, y]).astype(np.int32)
    aside = (x - float(column[0]), y - float(column[1]))
    corners = shape.boxes[:, [0, 1, 3, 1, 0, 4, 3, 4]].reshape(-1, 2) - np.array([x + 0.5, y + 0.5])
    moves = float(np.hypot(*np.subtract(turned_aside(aside, turn), aside)))
    radius = float(np.hypot(*corners.T).max()) + moves
    reach = int(np.ceil(radius + 1.0))
    offsets = np.stack(np.meshgrid(*[np.arange(-reach, reach + 1)] * 2, indexing="ij"), axis=-1).reshape(-1, 2)
    nearest = np.maximum(np.abs(offsets - np.array(aside)) - 0.5, 0.0)
    inside: NDArray[np.int32] = offsets[np.hypot(*nearest.T) < radius - 1e-9].astype(np.int32)
    return inside + column


def turned_cells(component: Component, angle_rad: float) -> NDArray[np.int32]:
    """Return (N, 3) the cells, relative to its reference cell, whose middles a part covers when it is turned.

    It turns by an angle about its hook line, counter-clockwise.
    """
    line, shape = np.array(component.hook_line_vox[:2]) + 0.5, component.shape
    reach = int(np.ceil(np.hypot(*shape.size_vox[:2]))) + 1
    at = np.stack(np.meshgrid(*[np.arange(-reach, reach + 1)] * 2, indexing="ij"), axis=-1).reshape(-1, 2)
    at = at + np.floor(line).astype(int)
    (x, y), cos, sin = (at + 0.5 - line).T, np.cos(angle_rad), np.sin(angle_rad)
    before = np.floor(np.stack([cos * x + sin * y, cos * y - sin * x], axis=1) + line + 1e-9).astype(int)
    inside = ((before >= 0) & (before < shape.size_vox[:2])).all(axis=1)
    dense = np.zeros(shape.size_vox, np.bool_)
    dense[tuple(shape.cells.T)] = True
    column, height = np.nonzero(dense[tuple(before[inside].T)])
    cells: NDArray[np.int32] = np.column_stack([at[inside][column], height]).astype(np.int32)
    return cells


def stored_shape(shape: Shape, pose: StoredPose, turn: int = 0) -> Shape:
    """Return the shape in its pose in the yard.

    A lying component has its foot (lowest z in the building) at the lowest-index end of the axis it lies along. Quarter
    turns apply to the upright part, before it is laid down.
    """
    shape = turned_shape(shape, turn)
    if pose is StoredPose.AS_BUILT:
        return shape
    x, y, z = shape.cells.T
    size_x, size_y, _ = shape.size_vox
    turned = (z, y, size_x - 1 - x) if pose is StoredPose.LYING_X else (x, z, size_y - 1 - y)
    return shape_of(np.stack(turned, axis=1))[0]


def erection_size_vox(shape: Shape, pose: StoredPose) -> IntVec:
    """Return the box, from the stored reference cell up, that a component sweeps while it is upended and raised.

    A rectangle of L by w that turns through a quarter about its lowest corner at the foot stays within
    sqrt(L^2 + w^2) in both directions. One more cell in z allows for the raise by one voxel before transit.
    """
    size_x, size_y, size_z = shape.size_vox
    if pose is StoredPose.AS_BUILT:
        return (size_x, size_y, size_z + 1)
    width = size_x if pose is StoredPose.LYING_X else size_y
    reach = int(np.ceil(np.hypot(size_z, width) - 1e-9)) if width > 1 else size_z
    return (reach, size_y, reach + 1) if pose is StoredPose.LYING_X else (size_x, reach, reach + 1)


A = TypeVar("A", bound="NDArray[Any] | None")


def frozen(array: A) -> A:
    """Return an array that nobody can write to, a copy if it is writeable; None if it is None."""
    if array is None or not array.flags.writeable:
        return array
    copy = array.copy()
    copy.flags.writeable = False
    return cast("A", copy)


# Construction states of a component and the colours of everything on a site: one table for log and pictures.
#
# The paper's states are orange, blue, green and pink, its obstructions black, its ground gray (Zhu, Pauwels and de
# Vries 2021). The tones are from the palette of Okabe and Ito, so that colour-blind readers can distinguish them. The
# paper paints the construction area in the same blue as the load in transit; here the area is pale to distinguish the
# two.

Rgb = tuple[int, int, int]
"""sRGB, 0..255."""


class ConstructionState(StrEnum):
    """Construction state of a component."""

    UNBUILT = "unbuilt"
    IN_TRANSIT = "in_transit"
    ARRIVED = "arrived"
    ASSEMBLED = "assembled"


STATE_RGB: dict[ConstructionState, Rgb] = {
    ConstructionState.UNBUILT: (230, 145, 20),
    ConstructionState.IN_TRANSIT: (0, 100, 190),
    ConstructionState.ARRIVED: (0, 158, 115),
    ConstructionState.ASSEMBLED: (228, 150, 186),
}
KIND_RGB: dict[str, Rgb] = {
    "ground": (178, 178, 176),
    "construction_area": (206, 222, 240),
    "yard": (236, 222, 190),
    "access": (104, 116, 138),
    "structure": (150, 150, 152),
    "obstruction": (0, 0, 0),
    "crane": (236, 188, 28),
}
