"""Parts to look at: floating, of odd mass, drawn into others, too large for a lorry, tilted by a crew, unracked."""

from __future__ import annotations

from collections.abc import Iterator
from math import degrees

import numpy as np
from numpy.typing import NDArray

from bimvox.bim.building import TriangleMesh, plain_class
from bimvox.bim.kinds.kind import Kind
from bimvox.bim.kinds.words import meaning_of
from bimvox.bim.own_box import laid_flat_m, sizes_m
from bimvox.errors import listed
from bimvox.kept import kept
from bimvox.proof.bodies.solid import Solid, is_inside, surfaces_cross
from bimvox.proof.bodies.triangle_tree import tree_over
from bimvox.proof.shape import volumes_of
from bimvox.records.lift import ModelledClash, Status
from bimvox.records.proof import Remark
from bimvox.records.props import Hold
from bimvox.records.unloading import loads_of
from bimvox.remarks import table
from bimvox.remarks.subject import Subject, metres, name_of, tonnes
from bimvox.site.component import Component, StoredPose
from bimvox.site.default_rules import (
    FEW_HANDS_KG,
    FULL_LORRY,
    INLOADER_M,
    RACKED_THINNESS,
    ROAD_HEIGHT_M,
    ROAD_KG,
    ROAD_LENGTH_M,
    ROAD_WIDTH_M,
    TRUCK_KG,
    TRUCK_M,
)
from bimvox.site.ground import Ground
from bimvox.site.means import Means
from bimvox.site.site import Blocker, names_by_id
from bimvox.site.work import Work, kind_of

NEAR_M = 0.05
"""Parts closer than this touch: bearings and grout joints are 10 to 50 mm high (professional judgement). A larger
``support_gap_m`` of the site counts instead."""

_MANY = 10
"""More parts that float together are a building without foundations, which is one remark."""
_NARROWED_M = 0.015
"""A part is narrowed by this much on each side before what is under it is looked for: what is next to it is not."""
_SUNK_M = 0.002
_UPRIGHT = frozenset((Work.COLUMN, Work.WALL))
_NAMED = 3


def floating(subject: Subject) -> Iterator[Remark]:
    """Yield a remark about every part that floats, hangs on its sides only, or is set before what holds it."""
    lifted = {component.index for component in subject.lifted}
    neighbours = _Neighbours(subject)
    groups = neighbours.floating_groups()
    for group in groups:
        if len(group) > _MANY:
            foot = metres(min(float(subject.in_place[number].mesh.bounds_m[0, 2]) for number in group))
            yield table.MANY_FLOAT(count=len(group), foot=foot)
        for number in group if len(group) <= _MANY else ():
            component = subject.in_place[number]
            if component.index not in lifted:
                continue
            foot = metres(float(component.mesh.bounds_m[0, 2]))
            others, touches = len(group) - 1, "nothing is under it or next to it"
            if others:
                more = "another part that floats" if others == 1 else f"{others:,} other parts that float"
                touches = f"it touches only {more}"
            yield table.FLOATS(component, foot=foot, neighbours=touches)
    floats = {subject.in_place[number].id for group in groups for number in group}
    for number, component in enumerate(subject.in_place):
        if component.index in lifted and component.id not in floats and not neighbours.rests(number):
            yield table.HANGS(component)
    unheld = set(subject.plan.unheld) - floats
    for number, component in enumerate(subject.in_place):
        if component.index in lifted and component.id in unheld and not neighbours.on_ground[number]:
            yield table.UNHELD(component)


def held(subject: Subject) -> Iterator[Remark]:
    """Yield a remark about every part that nothing, or only its neighbours, hold when its slings come off."""
    parts, rules, keep = subject.site.components, subject.site.rules.props, 0
    for one in subject.props.held:
        part = parts[one.component]
        if one.hold is Hold.NOTHING:
            what = "props" if kind_of(part) in _UPRIGHT else "shores"
            lies = kind_of(part) in _UPRIGHT or one.by
            why = f"no place for {what} is free" if lies else "what carries it is not in the model"
            yield table.NOT_HELD(part, why=why)
        elif kind_of(part) in _UPRIGHT and one.by and one.hold in (Hold.NEIGHBOURS, Hold.PROPS):
            yield table.FIXED_TO(part, names=listed((name_of(parts[n]) for n in one.by), _NAMED))
        if one.clear_m is not None and rules is not None and one.clear_m < rules.clearance_m - 1e-3:
            yield table.NEAR_PROPS(part, clear=metres(one.clear_m), asked=metres(rules.clearance_m))
        if one.holds_up:
            others = [n for n in one.waits_for if n != one.component] or one.waits_for
            waits = f"once {listed((name_of(parts[n]) for n in others), _NAMED)} can carry"
            when = "when the designer says so" if one.until_ns is None else waits
            names = listed((name_of(parts[n]) for n in one.holds_up), _NAMED)
            yield table.HOLDS_UP(part, names=names, is_="is" if len(one.holds_up) == 1 else "are", when=when)
        keep += bool(one.props) and one.until_ns is None
    if keep:
        several = keep > 1
        yield table.KEEPS_PROPS(
            count=keep, s="s" * several, v="" if several else "s", heads="their heads" if several else "its head"
        )


class _Neighbours:
    """The parts in place and the structure, and which of them touch.

    Args:
        subject: The plan.

    Attributes:
        on_ground: Which parts stand on the ground, which is as much as a cell below a part.
    """

    def __init__(self, subject: Subject) -> None:
        site = subject.site
        self._near_m = max(NEAR_M, site.rules.support_gap_m)
        gap_m = max(self._near_m, site.frame.voxel_size_m) + 1e-6
        self.on_ground = np.array(Ground.of(site, list(subject.in_place)).carries(gap_m), np.bool_)
        self._meshes: list[TriangleMesh] = [component.mesh for component in subject.in_place]
        self._parts = len(self._meshes)
        self._meshes += [blocker.mesh for blocker in site.blockers if blocker.mesh is not None]
        bounds = np.array([mesh.bounds_m for mesh in self._meshes], np.float64).reshape(-1, 2, 3)
        self._low, self._high = bounds[:, 0], bounds[:, 1]

    def floating_groups(self) -> list[list[int]]:
        """Return the parts without a connection to ground or structure: groups of those that touch each other."""
        held = np.ones(len(self._meshes), np.bool_)
        held[: self._parts] = self.on_ground
        self._spread(held, [int(n) for n in np.flatnonzero(held)])
        groups = []
        for number in range(self._parts):
            if held[number]:
                continue
            before = held.copy()
            held[number] = True
            self._spread(held, [number])
            groups.append([int(n) for n in np.flatnonzero(held & ~before)])
        return groups

    def rests(self, number: int) -> bool:
        """Return whether a part stands on the ground, or anything is less than a joint under it."""
        low, high = self._low[number], self._high[number]
        if self.on_ground[number]:
            return True
        close = (self._low[:, :2] < high[:2]).all(axis=1) & (self._high[:, :2] > low[:2]).all(axis=1)
        close &= (self._low[:, 2] < low[2]) & (self._high[:, 2] >= low[2] - self._near_m)
        part = _narrowed(self._meshes[number])
        down, up = np.array([0.0, 0.0, -self._near_m]), np.array([0.0, 0.0, _SUNK_M])
        return any(surfaces_cross(_surface(self._meshes[other]), part, down, up) for other in np.flatnonzero(close))

    def _spread(self, held: NDArray[np.bool_], waiting: list[int]) -> None:
        """Mark everything that touches what waits, directly or through others."""
        while waiting:
            number = waiting.pop()
            close = ~held
            close &= (self._low <= self._high[number] + self._near_m).all(axis=1)
            close &= (self._high >= self._low[number] - self._near_m).all(axis=1)
            for other in np.flatnonzero(close).tolist():
                if self._touches(number, other):
                    held[other] = True
                    waiting.append(other)

    def _touches(self, one: int, other: int) -> bool:
        first, second = _surface(self._meshes[one]), _surface(self._meshes[other])
        near = np.full(3, self._near_m)
        if surfaces_cross(first, second, -near, near):
            return True
        return _holds(first, second) or _holds(second, first)


@kept
def _surface(mesh: TriangleMesh) -> Solid:
    return _tree(mesh.triangles_m)


@kept
def _narrowed(mesh: TriangleMesh) -> Solid:
    """Return a part narrowed on plan about its middle."""
    low, high = mesh.bounds_m
    size, middle, scale = high - low, (low + high) / 2.0, np.ones(3)
    scale[:2] = 1.0 - 2.0 * np.minimum(_NARROWED_M, 0.2 * size[:2]) / np.maximum(size[:2], 1e-9)
    return _tree((mesh.triangles_m - middle) * scale + middle)


def _tree(triangles: NDArray[np.float64]) -> Solid:
    """Return the tree over triangles, without the thickness that only the proof of overlaps needs."""
    order, boxes, spans = tree_over(triangles.min(axis=1), triangles.max(axis=1))
    corners = np.ascontiguousarray(triangles[order])
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    none, box = np.zeros((0, 3)), np.zeros((2, 3))
    return Solid(corners, normals, np.zeros(0), 0.0, boxes, spans, box, False, 0.0, none, none)


def _holds(outer: Solid, inner: Solid) -> bool:
    """Return whether a solid encloses another one, without touching its surface."""
    return bool(len(inner.corners_m)) and bool(is_inside(outer, inner.corners_m[0].mean(axis=0)))


LIGHT_KG_M3, VERY_LIGHT_KG_M3 = 60.0, 20.0
"""Insulation boards weigh 15 to 60 kg/m3, panels with faces of sheet steel 80 and more (data sheets)."""
DENSE_KG_M3, VERY_DENSE_KG_M3 = 9_000.0, 12_000.0
"""Steel weighs 7,850 kg/m3, copper 8,900 and lead 11,300 (EN 1991-1-1, table A.4)."""


def stated_masses(subject: Subject) -> Iterator[Remark]:
    """Yield a remark about every part of the plan whose stated mass contradicts its volume and material."""
    for lift in subject.plan.lifts:
        component = subject.site.components[lift.component]
        if component.doubted_kg:
            stated, computed, used = (
                f"{kg:,.4g}" if abs(kg) < 10.0 else f"{kg:,.0f}" for kg in (*component.doubted_kg, component.mass_kg)
            )
            yield table.STATED_MASS(component, stated=stated, computed=computed, used=used)


def densities(subject: Subject) -> Iterator[Remark]:
    """Yield a remark about every part of a closed mesh that is lighter than a panel or denser than steel."""
    for component in subject.lifted:
        found, mass_kg = volumes_of(component.mesh), component.mass_kg
        if found.least_m3 and mass_kg < LIGHT_KG_M3 * found.least_m3:
            very, kg_m3 = mass_kg < VERY_LIGHT_KG_M3 * found.least_m3, mass_kg / found.least_m3
            density, than = f"{kg_m3:.0f}", "lighter than a building part, unless it is hollow"
        elif mass_kg > DENSE_KG_M3 * found.most_m3:
            very, kg_m3 = mass_kg > VERY_DENSE_KG_M3 * found.most_m3, mass_kg / found.most_m3
            density, than = f"{kg_m3:,.0f}", "denser than steel"
        else:
            continue
        odd = table.ODD_DENSITY if very else table.UNUSUAL_DENSITY
        yield odd(component, mass=tonnes(mass_kg), density=density, than=than)


DEEP_M = 0.05
"""More than all tolerances of making, setting out and erecting precast parts together: EN 13670 and EN 13369 allow 10
to 25 mm each."""
_FOUNDATIONS = ("IfcFooting", "IfcPile", "IfcDeepFoundation", "IfcCaissonFoundation")
_SOFT = (Kind.TIMBER, Kind.LIGHT, Kind.MASONRY)
"""Kinds that are cut to fit on site."""


def overlaps(subject: Subject) -> Iterator[Remark]:
    """Yield a remark about every part of a pair that overlaps deeper than 50 mm, or by an unknown depth.

    It is serious if both come ready-made and are hard: they cannot be set as drawn. What is cut, cast or built on site
    gives way there: a rafter gets a notch, a slab is cast around a wall, a column stands in the pocket of its footing.
    The depths are those that the plan lists, which the proof measures itself: a pair may overlap no deeper than listed,
    and just short of the listed depth it still collides. Overlaps without a way out are at least as deep as listed.
    """
    names = names_by_id(subject.site)
    hard = {one.id: one.means is Means.CRANE and one.judgement.kind not in _SOFT for one in subject.site.components}
    hard |= {one.id: False for one in subject.site.blockers if one.kind == "structure" and _is_foundation(one)}
    deep = [clash for clash in subject.plan.clashes if clash.depth_m > DEEP_M or clash.at_least]
    pairs: dict[str, list[tuple[ModelledClash, str]]] = {}
    for clash in deep:
        pairs.setdefault(clash.first, []).append((clash, clash.second))
        pairs.setdefault(clash.second, []).append((clash, clash.first))
    for component in subject.lifted:
        found = pairs.get(component.id)
        if not found:
            continue
        ready = {other for _, other in found if hard.get(component.id, True) and hard.get(other, True)}
        found.sort(key=lambda pair: (pair[1] not in ready, -pair[0].depth_m, pair[1]))
        clash, other = found[0]
        least = "at least " if clash.at_least else ""
        more = f", and {len(found) - 1:,} more" if len(found) > 1 else ""
        row = table.OVERLAP if ready else table.OVERLAP_ON_SITE
        yield row(component, least=least, depth=clash.depth_m * 1000.0, other=names.get(other, other), more=more)
    small = [clash.depth_m for clash in subject.plan.clashes if clash not in deep]
    if small:
        yield table.SMALL_OVERLAPS(depth=max(small) * 1000.0, count=len(small), s="" if len(small) == 1 else "s")


def _is_foundation(structure: Blocker) -> bool:
    """Return whether a structure is a footing or a pile, which are cast on site: by its class or its name."""
    meaning = meaning_of(structure.name, "part")
    is_called = meaning is not None and meaning.says in ("footing", Kind.PILE)
    return is_called or plain_class(structure.ifc_class) in _FOUNDATIONS


HAND_KG = 25.0
"""What one person lifts close to the body: HSE, Manual handling at work (INDG143), figure 1."""


def transport(subject: Subject) -> Iterator[Remark]:
    """Yield a remark about every part that needs an escort, or cannot go by road, or needs no crane."""
    rules = subject.site.rules
    truck_kg, truck_m = rules.truckload_kg or TRUCK_KG, (rules.yard and rules.yard.truck_m) or TRUCK_M
    for component in subject.lifted:
        if (found := _by_road(component, truck_kg, truck_m)) is not None:
            yield found
        if component.mass_kg <= HAND_KG:
            yield table.HAND_LOAD(component, mass=component.mass_kg)
        elif component.mass_kg <= FEW_HANDS_KG:
            yield table.BUNDLED(component, mass=component.mass_kg)


def _by_road(component: Component, truck_kg: float, truck_m: tuple[float, float, float]) -> Remark | None:
    """Return a remark about a part that no ordinary lorry carries; it is loaded on the side that suits best."""
    length_m, width_m, height_m = _sizes_m(component.mesh)
    said = []
    panel = length_m <= INLOADER_M[0] and width_m <= INLOADER_M[2] and height_m <= INLOADER_M[1]
    if component.mass_kg > truck_kg:
        said.append(f"weighs {tonnes(component.mass_kg)} (a lorry carries {tonnes(truck_kg)})")
    if length_m > truck_m[0] and not panel:
        said.append(f"is {metres(length_m)} long (a lorry takes {metres(truck_m[0])})")
    if width_m > truck_m[1] and not panel:
        said.append(f"is {metres(width_m)} wide (a lorry takes {metres(truck_m[1])})")
    if height_m > truck_m[2] and not panel:
        said.append(f"is {metres(height_m)} high (a lorry takes {metres(truck_m[2])})")
    if not said:
        return None
    is_beyond = (
        component.mass_kg > ROAD_KG or length_m > ROAD_LENGTH_M or width_m > ROAD_WIDTH_M or height_m > ROAD_HEIGHT_M
    )
    return (table.NOT_BY_ROAD if is_beyond else table.SPECIAL_TRANSPORT)(component, what=", ".join(said))


_sizes_m = kept(laid_flat_m)


def guided(subject: Subject) -> Iterator[Remark]:
    """Yield a remark about every load that reaches its place only if a crew guides it."""
    for lift in subject.lifts:
        if (guide := lift.guide) is not None:
            tilt, part = degrees(guide.steepest_rad), subject.site.components[lift.component]
            yield table.GUIDED(part, tilt=tilt, aside=guide.furthest_m, top=guide.top_m)


def storage(subject: Subject) -> Iterator[Remark]:
    """Yield a remark about every thin wall that stands in the yard, but in no rack."""
    rules = subject.site.rules.yard
    if rules is None or rules.rack_parts < 1:
        return
    for lift in sorted(subject.plan.lifts, key=lambda lift: lift.order):
        component, place = subject.site.components[lift.component], lift.place
        if lift.status is not Status.PLANNED or place is None or place.rack or place.pose is not StoredPose.AS_BUILT:
            continue
        height_m = float(np.ptp(component.mesh.bounds_m[:, 2]))
        if kind_of(component) is Work.WALL and height_m >= RACKED_THINNESS * sizes_m(component.mesh)[2]:
            yield table.NO_RACK(component)


def lorries(subject: Subject) -> Iterator[Remark]:
    """Yield a remark if lorries are not full on average, and why."""
    loads = loads_of(subject.site, (*subject.plan.lifts, *subject.context))
    if loads.share is None or loads.least is None or loads.mass_share is None or loads.share >= FULL_LORRY:
        return
    why = "the yard, the sequence and the beds for panels take more lorries"
    if loads.lorries <= loads.least:
        why = "fewer lorries cannot carry them"
    why = f"all parts weigh {loads.mass_share * loads.lorries:.1f} loads, and {why}"
    yield table.LORRIES_NOT_FULL(loads=loads.in_words, full=100.0 * FULL_LORRY, why=why)
