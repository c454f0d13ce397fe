"""The site: grid, fixed objects, components, cranes and rules. A change makes a new site."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, is_dataclass
from enum import Enum, StrEnum
from math import pi
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from bimvox.bim.building import TriangleMesh
from bimvox.bim.building import part_name as part_name
from bimvox.crane.tower_crane import TowerCrane
from bimvox.grid.frame import GridFrame
from bimvox.kept import kept
from bimvox.site.casting import (
    FIELD_BUILDING,
    FIELD_CASTING,
    BuildingTimes,
    Casting,
    Curing,
    curing_s,
    waits_for_joints,
)
from bimvox.site.component import Component
from bimvox.site.crew_times import FIELD_TIMES, TimesByWork
from bimvox.site.default_rules import FlipRules, Kept, TandemRules, YardRules
from bimvox.site.means import Means
from bimvox.site.moving import Moving
from bimvox.site.props import PropRules
from bimvox.site.work import Work, kind_of
from bimvox.sparse import SPARSE, names_to_write

GROUND_ID = "ground"
CRANE_ID = "crane"


def mast_id(crane: TowerCrane, *, several: bool) -> str:
    """Return the id of a crane's mast among the site's blockers."""
    return f"{CRANE_ID}:{crane.name}" if several else CRANE_ID


def is_mast_of(crane: TowerCrane, name: str) -> bool:
    """Return whether a blocker is a crane's own mast."""
    return name in (mast_id(crane, several=False), mast_id(crane, several=True))


class SwingRule(StrEnum):
    """Whether the crane's moves are shaped so that loads do not swing when they end."""

    SHAPED = "shaped"
    OFF = "off"


class HeadingRule(StrEnum):
    """What keeps the heading of a load while the jib turns."""

    KEPT = "kept"
    """Tag lines: it is the one in the building, from the yard on."""
    WITH_JIB = "with_jib"
    """Nothing: the load turns with the jib. Above its place, it is turned to its final heading."""


@dataclass(frozen=True, slots=True)
class Rules:
    """The rules of a site; ``RulesConfig``, the table of the site file, says what its fields mean.

    Attributes:
        sling_angle_rad: ``sling_angle_deg`` in radians.
        gives_way: Names of the rules that are defaults: a lift that cannot keep them is planned with what it can keep.
        order_search: Whether a faster erection sequence than the greedy one is searched.
        yard: How parts lie in the yard; None: a cell apart and never on each other.
        two_hooks: How parts are turned over between two hooks; None: none is.
        tandem: How two cranes carry a part together; None: they carry none.
    """

    clearance_m: float = 0.0
    contact_tolerance_m: float = 0.010
    support_gap_m: float = 0.050
    rope: bool = True
    sample_period_s: float = 0.5
    bracing_s: float | None = None
    release_s: float | None = None
    turn_s: float = 30.0
    upend_s: float = field(default=0.0, metadata=SPARSE)
    transit_clearance_m: float = 0.0
    rope_clearance_m: float = 0.0
    departure_clearance_m: float = field(default=0.0, metadata=SPARSE)
    approach_clearance_m: float = field(default=0.0, metadata=SPARSE)
    upending_clearance_m: float = field(default=0.0, metadata=SPARSE)
    turning_clearance_m: float = field(default=0.0, metadata=SPARSE)
    swing: SwingRule = SwingRule.SHAPED
    truckload_kg: float = 0.0
    wind_speed_m_s: float = 0.0
    least_wind_m_s: float = field(default=0.0, metadata=SPARSE)
    drag_coefficient: float = 2.0
    sling_angle_rad: float = pi / 3.0
    critical_share: float = 0.75
    highest_utilisation: float = field(default=1.0, metadata=SPARSE)
    crane_separation_m: float = field(default=2.0, metadata=SPARSE)
    by_other_means: bool = field(default=True, metadata=SPARSE)
    gives_way: tuple[str, ...] = field(default=(), metadata=SPARSE)
    times: TimesByWork = FIELD_TIMES
    casting: Casting = FIELD_CASTING
    building: BuildingTimes = FIELD_BUILDING
    heading: HeadingRule = field(default=HeadingRule.KEPT, metadata=SPARSE)
    yard: YardRules | None = field(default=None, metadata=SPARSE)
    curing: Curing | None = field(default=None, metadata=SPARSE)
    props: PropRules | None = field(default=None, metadata=SPARSE)
    two_hooks: FlipRules | None = field(default=None, metadata=SPARSE)
    tandem: TandemRules | None = field(default=None, metadata=SPARSE)
    order_search: bool = True

    def kept_m(self, rule: str, kept: Kept) -> float:
        """Return a clearance of these rules, called ``rule``, for a lift that keeps less of those that give way."""
        wanted_m: float = getattr(self, rule)
        own_m: float | None = getattr(kept, rule)
        return wanted_m if own_m is None or rule not in self.gives_way else min(wanted_m, own_m)


@dataclass(frozen=True, slots=True, eq=False, weakref_slot=True)
class Blocker:
    """One fixed object that can be in the way.

    Attributes:
        id: ``ground``, ``crane`` (``crane:NAME`` for each of several), or the id of a structure or an obstruction.
        kind: ``ground``, ``crane``, ``structure`` or ``obstruction``.
        cells: (N, 3) int32 cells that it occupies, inside the grid; obstructions and masts include the clearance.
        mesh: Its triangles in the site frame, if neighbours may touch it (structure); otherwise None.
        name: The source's name of a structure; empty if it has none.
        ifc_class: Its class, for example ``IfcFooting``; empty if it has none, and in logs of older versions.
    """

    id: str
    kind: str
    cells: NDArray[np.int32]
    mesh: TriangleMesh | None = None
    name: str = field(default="", metadata=SPARSE)
    ifc_class: str = field(default="", metadata=SPARSE)


def top_layers(cells: Sequence[NDArray[np.int32]], columns: tuple[int, int]) -> NDArray[np.int32]:
    """Return the highest layer that (N, 3) cells fill in every column, (X, Y) int32; 0 where there are none."""
    tops = np.zeros(columns, np.int32)
    for own in cells:
        np.maximum.at(tops, (own[:, 0], own[:, 1]), own[:, 2])
    return tops


@dataclass(frozen=True, slots=True, eq=False)
class HookHeights:
    """Limits of the hook's height over each column (working-range limiters).

    Attributes:
        low_m: (X, Y) float64 lowest hook above the site's z = 0; -inf where there is no limit.
        high_m: (X, Y) float64 highest hook; inf where there is no limit.
    """

    low_m: NDArray[np.float64]
    high_m: NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False, weakref_slot=True)
class Site:
    """Everything that a plan depends on.

    Attributes:
        name: Name of the site.
        frame: Metres to cells; site metres, z = 0 at the top of the ground; layer k = 0 is ground everywhere.
        labels: (X, Y, Z) uint8 ``Label`` of everything but components: ground and areas on the slab, structure,
            obstructions.
        blockers: All fixed objects; ``blockers[0]`` is the ground, dug out for what is set below it.
        components: The parts to be lifted.
        cranes: The cranes; ``Component.crane`` and ``LiftMotion.crane`` are indices into it. Empty on the paper's site.
        rules: The rules.
        yard: (X, Y) bool, columns whose slab cell is yard.
        site_to_ifc: (4, 4) float64 transform from the site frame to model coordinates.
        prohibited: (X, Y) bool, columns above which a zone forbids the hook; None if there is no such zone.
        no_load: (X, Y) bool, columns above which a zone forbids the load; None if there is no such zone.
        hook_heights: Limits of the hook's height over columns; None if there are none.
        natural_ground_m: (X, Y) float64, the height of the ground before anything is dug; None if it is 0 everywhere.
        access: (X, Y) bool, columns on which trucks drive and stand, none of them yard; None if that is not planned.
        moving: How the one crane moves whose set-ups ``cranes`` are; None if the cranes stay where they are.
        source: Plain values about the model (``name``, ``sha256`` ...).
        notes: Remarks on the site, one sentence each.
        obstruction_notes: Remarks on the obstructions (clipped, outside).
        geometry_digest: Hash of grid, component shapes and crane: the policy's key.
        fixed_digest: Hash of everything that a plan depends on, except obstructions.
        digest: Hash of everything that a plan depends on, including obstructions: the plan's key.
    """

    name: str
    frame: GridFrame
    labels: NDArray[np.uint8]
    blockers: tuple[Blocker, ...]
    components: tuple[Component, ...]
    cranes: tuple[TowerCrane, ...]
    rules: Rules
    yard: NDArray[np.bool_]
    site_to_ifc: NDArray[np.float64]
    prohibited: NDArray[np.bool_] | None = None
    no_load: NDArray[np.bool_] | None = None
    hook_heights: HookHeights | None = None
    natural_ground_m: NDArray[np.float64] | None = field(default=None, metadata=SPARSE)
    access: NDArray[np.bool_] | None = field(default=None, metadata=SPARSE)
    moving: Moving | None = field(default=None, metadata=SPARSE)
    source: Mapping[str, str | float | bool] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    obstruction_notes: tuple[str, ...] = ()
    geometry_digest: str = ""
    fixed_digest: str = ""
    digest: str = ""

    def __repr__(self) -> str:
        x, y, z = self.shape
        cells = f"{x} x {y} x {z} cells of {self.frame.voxel_size_m:g} m"
        return f"<Site {self.name!r}: {cells}, {len(self.components):,} components, cranes: {len(self.cranes)}>"

    @property
    def is_obstructed(self) -> bool:
        """Whether there is any obstruction."""
        return any(blocker.kind == "obstruction" for blocker in self.blockers)

    @property
    def all_but_parts(self) -> tuple[object, ...]:
        """All that the site holds except its components and the digests of them."""
        its = {"components", "geometry_digest", "fixed_digest", "digest"}
        return tuple(getattr(self, one.name) for one in fields(self) if one.name not in its)

    @property
    def has_several_cranes(self) -> bool:
        """Whether there is more than one crane at a time: each has its own clock, and they keep apart."""
        return len(self.cranes) > 1 and self.moving is None

    @property
    def names_cranes(self) -> bool:
        """Whether logs and documents name the crane of each lift, of one that moves its set-up."""
        return len(self.cranes) > 1

    def stands_in(self, blocker: Blocker, crane: int) -> bool:
        """Return whether a blocker is there while a crane is at work: of one that moves, no other set-up is."""
        if self.moving is None or blocker.kind != CRANE_ID:
            return True
        return is_mast_of(self.cranes[crane], blocker.id)

    @property
    @kept
    def ground_vox(self) -> NDArray[np.int32]:
        """(X, Y) int32, the highest layer of the ground in each column."""
        tops = top_layers([one.cells for one in self.blockers if one.kind == GROUND_ID], self.shape[:2])
        tops.flags.writeable = False
        return tops

    @property
    def dug_m(self) -> NDArray[np.float64]:
        """(X, Y) float64, how deep the ground is dug out in each column, metres."""
        before_m = 0.0 if self.natural_ground_m is None else self.natural_ground_m
        now_m = self.frame.origin_m[2] + self.frame.voxel_size_m * (self.ground_vox + 1.0)
        return np.maximum(before_m - now_m, 0.0)

    @property
    def yard_floor_vox(self) -> int:
        """The layer in which parts lie in the yard, which is level."""
        return 1 + int(self.ground_vox[self.yard].max(initial=0))

    def crane_of(self, component: Component) -> TowerCrane | None:
        """Return the crane that lifts a component; None on a site without one."""
        return self.cranes[component.crane] if self.cranes else None

    @property
    def shape(self) -> tuple[int, int, int]:
        """(X, Y, Z)."""
        x, y, z = self.labels.shape
        return (x, y, z)


BESIDE_M = 3.0
"""Parts that are no further apart stand next to each other: as far as the props of a braced wall reach."""
_SLACK_M = 0.01
"""More than the boxes lose when a site is written and read."""


@kept
def parts_beside(site: Site) -> NDArray[np.bool_]:
    """Return (N, N) whether two components stand next to each other, are connected, or have a given order.

    Their distance is that of their boxes.
    """
    bounds_m = np.array([part.mesh.bounds_m for part in site.components]).reshape(-1, 2, 3)
    near = np.ones((len(bounds_m), len(bounds_m)), np.bool_)
    for low_m, high_m in zip(bounds_m[:, 0].T, bounds_m[:, 1].T, strict=True):
        near &= low_m[:, None] - high_m <= BESIDE_M + _SLACK_M
    near &= near.T
    numbers = {part.id: part.index for part in site.components}
    for part in site.components:
        named = [numbers[one] for one in (*part.hints.connected, *part.before, *part.after) if one in numbers]
        near[part.index, named] = near[named, part.index] = True
    near.flags.writeable = False
    return near


FLOOR_LEVEL_M = 0.5
"""A floor whose top is no further above or below the foot of a part is the one that it is set from."""


@kept
def floors_at_feet(site: Site) -> NDArray[np.bool_]:
    """Return (N, N) whether a component waits for the joints of another one: a lifted floor at its feet.

    The crew that sets a column or wall stands on that floor, and its props are fixed to it. Their distance is that of
    their boxes.
    """
    parts, curing = site.components, site.rules.curing
    bounds_m = np.array([part.mesh.bounds_m for part in parts]).reshape(-1, 2, 3)
    stands = [waits_for_joints(curing, part) and kind_of(part) in (Work.COLUMN, Work.WALL) for part in parts]
    floors = [
        part.means is Means.CRANE and kind_of(part) is Work.SLAB and curing_s(curing, part) > 0.0 for part in parts
    ]
    near = np.array(stands, np.bool_)[:, None] & np.array(floors, np.bool_)
    for low_m, high_m in zip(bounds_m[:, 0, :2].T, bounds_m[:, 1, :2].T, strict=True):
        apart_m = low_m[:, None] - high_m
        near &= np.maximum(apart_m, apart_m.T) <= BESIDE_M + _SLACK_M
    near &= np.abs(bounds_m[:, None, 0, 2] - bounds_m[:, 1, 2]) <= FLOOR_LEVEL_M + _SLACK_M
    near.flags.writeable = False
    return near


def names_by_id(site: Site) -> dict[str, str]:
    """Return the name of every part and of every structure that has one, by its id."""
    structure = {one.id: part_name(one.id, one.name) for one in site.blockers if one.name}
    return structure | {part.id: part_name(part.id, part.name, part.ifc_class) for part in site.components}


def with_names(text: str, names: Mapping[str, str]) -> str:
    """Return a text in which the ids of parts are replaced by their names; an id in brackets stays."""
    longest_first = sorted(names, key=len, reverse=True)
    if not longest_first:
        return text
    known = "|".join(re.escape(id_) for id_ in longest_first)
    return re.sub(rf"(?<![\w$#(])(?:{known})(?![\w$#])", lambda found: names[found[0]], text)


class _Hash(Protocol):
    def update(self, data: bytes, /) -> None: ...


def digest_of(*values: object) -> str:
    """Return the SHA-256 over plain values, arrays, dataclasses, and tuples, lists and mappings of them.

    Type and length precede every value, so that different contents never give the same bytes.

    Raises:
        TypeError: If a value is of another type.
    """
    hashed = hashlib.sha256()
    _add(hashed, values)
    return hashed.hexdigest()


def _add(hashed: _Hash, value: object) -> None:
    if isinstance(value, np.ndarray):
        little = value.dtype.newbyteorder("<")
        hashed.update(f"array {little.str} {value.shape}\n".encode())
        hashed.update(np.ascontiguousarray(value, dtype=little).tobytes())
    elif isinstance(value, Enum):
        _add(hashed, value.value)
    elif value is None or isinstance(value, bool | int | float | str | bytes | np.number):
        plain = value.item() if isinstance(value, np.number) else value
        text = repr(plain).encode()
        hashed.update(f"{type(plain).__name__} {len(text)}\n".encode() + text)
    elif is_dataclass(value) and not isinstance(value, type):
        names = names_to_write(value)
        hashed.update(f"{type(value).__name__} {len(names)}\n".encode())
        for name in names:
            _add(hashed, name)
            _add(hashed, getattr(value, name))
    elif isinstance(value, Mapping):
        _add(hashed, tuple(sorted(value.items())))
    elif isinstance(value, tuple | list):
        hashed.update(f"list {len(value)}\n".encode())
        for item in value:
            _add(hashed, item)
    else:
        raise TypeError(f"cannot hash a {type(value).__name__}")
