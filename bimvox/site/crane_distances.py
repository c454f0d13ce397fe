"""Clear distances of a crane as they are measured on site: from its mast, its base or outriggers, and its tail.

They are horizontal, at the heights that a piece of the crane has; below the tail, vertical. Parts and structure count
by their triangles, obstructions by their cells, with their clearance.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from math import hypot, sqrt
from typing import Any, NamedTuple

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely import affinity

from bimvox.bim.building import TriangleMesh
from bimvox.crane.outline import outline_of, tail_low_m
from bimvox.crane.tower_crane import TowerCrane
from bimvox.site.site import Site

_Floats = NDArray[np.float64]

FOUNDATION_MASTS = 4.0
"""Edge of a tower crane's foundation that nobody states, in widths of its mast: pads of 5 to 8 m carry masts of 1.2 to
2.0 m (professional judgement)."""
FOUNDATION_DEEP_M = 1.5
"""Its depth below the foot of the mast (professional judgement)."""
_FOOT_M = 0.5
"""Anchors and ballast stand this much above it (professional judgement)."""
TRAPPED_M = 0.5
"""Least distance of what a crane moves to anything fixed or stored around it, so that nobody is trapped: DGUV
Vorschrift 52, sections 11 and 32; the same of a tower crane to building, scaffold and material in BG BAU, "Aufstellung
von Turmdrehkranen"."""
STANDING_M = 2.0
"""Room that a person needs below what slews (professional judgement)."""
EDGE_M = 2.0
"""Distance of a machine of more than 12 t to the edge of an excavation without calculation (DIN 4124)."""


class Base(NamedTuple):
    """What a crane stands on, on plan.

    Attributes:
        edge_m: Edge of the square around it.
        stated: Whether it is known: outriggers, or a foundation whose area the site file states.
    """

    edge_m: float
    stated: bool


@dataclass(frozen=True, slots=True)
class Distance:
    """A clear distance.

    Attributes:
        piece: ``mast``, ``base`` or ``tail``; ``below tail`` is measured upwards to it.
        kind: What it is measured to: ``building``, ``structure``, ``obstruction``, ``stored``, ``yard``, ``access``,
            ``excavation``, ``boundary`` or ``crane``.
        name: Name of the nearest thing; empty for areas.
        distance_m: How far; 0 if they overlap, below 0 if it reaches beyond the boundary of the plot.
        ends_m: Its two ends on plan.
    """

    piece: str
    kind: str
    name: str
    distance_m: float
    ends_m: tuple[tuple[float, float], tuple[float, float]]

    def to_dict(self) -> dict[str, Any]:
        """Return it for the JSON documents."""
        return {
            "from": self.piece,
            "to": self.kind,
            "name": self.name,
            "distance_m": round(self.distance_m, 3),
            "ends_m": [[round(value, 3) for value in end] for end in self.ends_m],
        }


def base_of(crane: TowerCrane) -> Base:
    """Return what a crane stands on."""
    if crane.kind == "mobile":
        return Base(crane.mast_size_m, stated=True)
    if crane.foundation_m2 is not None:
        return Base(sqrt(crane.foundation_m2), stated=True)
    if crane.stand is not None and crane.stand.edge_m is not None:
        return Base(crane.stand.edge_m, stated=True)
    return Base(FOUNDATION_MASTS * crane.mast_size_m, stated=False)


class _Piece(NamedTuple):
    """A piece of a crane: a square, or a circle, about its slewing axis."""

    name: str
    half_m: float
    radius_m: float
    low_m: float
    high_m: float

    def plan(self, crane: TowerCrane) -> shapely.Geometry:
        """Return what it is measured from on plan: its square, or the axis of its circle."""
        x, y, _ = crane.base_m
        if not self.half_m:
            return shapely.Point(x, y)
        return shapely.box(x - self.half_m, y - self.half_m, x + self.half_m, y + self.half_m)


def _pieces(crane: TowerCrane) -> tuple[_Piece, ...]:
    """Return the pieces of a crane, its tail last; a mobile crane has no mast."""
    own, base, foot_m, low_m = outline_of(crane), base_of(crane), crane.base_m[2], tail_low_m(crane)
    tail = _Piece("tail", 0.0, own.tail_m, low_m, own.tail_height_m[1])
    if crane.kind == "mobile":
        return _Piece("base", base.edge_m / 2.0, 0.0, foot_m, foot_m + STANDING_M), tail
    mast = _Piece("mast", crane.mast_size_m / 2.0, 0.0, foot_m, low_m)
    return mast, _Piece("base", base.edge_m / 2.0, 0.0, foot_m - FOUNDATION_DEEP_M, foot_m + _FOOT_M), tail


class Thing(NamedTuple):
    """Something that a distance is measured to.

    Attributes:
        kind: As in :class:`Distance`.
        name: Its name.
        mesh: Its triangles; None if it is boxes.
        boxes_m: (N, 2, 3) lowest and highest corners; of a mesh, its own.
    """

    kind: str
    name: str
    mesh: TriangleMesh | None
    boxes_m: _Floats

    @classmethod
    def of(cls, kind: str, name: str, mesh: TriangleMesh) -> Thing:
        """Return a thing of triangles."""
        return cls(kind, name, mesh, mesh.bounds_m[None])


def fixed_things(site: Site) -> Iterator[Thing]:
    """Yield what stands on a site besides its parts: structure, obstructions."""
    size_m, origin = site.frame.voxel_size_m, np.array(site.frame.origin_m)
    for blocker in site.blockers:
        if blocker.kind in ("structure", "obstruction") and len(blocker.cells):
            if blocker.mesh is not None:
                yield Thing.of(blocker.kind, blocker.name or blocker.id, blocker.mesh)
                continue
            low = blocker.cells * size_m + origin
            yield Thing(blocker.kind, blocker.name or blocker.id, None, np.stack([low, low + size_m], axis=1))


def of_crane(crane: TowerCrane, things: Iterable[Thing], most_m: float | None = None) -> list[Distance]:
    """Return the nearest thing of each kind to each piece of a crane, by kind, and how far it is below the tail.

    ``most_m``: only what is nearer counts.
    """
    by_kind: dict[str, list[Thing]] = {}
    for thing in things:
        by_kind.setdefault(thing.kind, []).append(thing)
    pieces = _pieces(crane)
    found = [
        nearest
        for kind, own in by_kind.items()
        for piece in pieces
        if (nearest := _nearest(crane, piece, kind, own, most_m)) is not None
    ]
    is_high = pieces[-1].low_m > crane.base_m[2] + STANDING_M
    below = (_below(crane, pieces[-1], kind, own, most_m) for kind, own in by_kind.items() if is_high)
    return found + [one for one in below if one is not None]


def _nearest(
    crane: TowerCrane, piece: _Piece, kind: str, things: Sequence[Thing], most_m: float | None
) -> Distance | None:
    """Return the nearest thing to a piece, at its heights; those with the nearest boxes are looked at first."""
    best_m, best = np.inf if most_m is None else most_m, None
    # Who stands level with the tail, or just below it, is trapped too.
    more_m = TRAPPED_M if piece.name == "tail" else 0.0
    low_m, high_m = piece.low_m - more_m, piece.high_m + more_m
    near = sorted(((_box_distance_m(crane, piece, thing, low_m, high_m), n) for n, thing in enumerate(things)))
    for box_m, number in near:
        if box_m >= best_m:
            break
        thing = things[number]
        shapes = _at_heights(thing, low_m, high_m)
        if not len(shapes):
            continue
        lines = shapely.shortest_line(piece.plan(crane), shapes)
        lengths_m = np.maximum(shapely.length(lines) - piece.radius_m, 0.0)
        at = int(np.argmin(lengths_m))
        if lengths_m[at] < best_m:
            best_m = float(lengths_m[at])
            best = Distance(piece.name, kind, thing.name, best_m, _ends(lines[at], piece.radius_m))
    return best


def _ends(line: shapely.LineString, radius_m: float) -> tuple[tuple[float, float], tuple[float, float]]:
    """Return the ends of a line on plan, the first one moved by a radius along it."""
    (x0, y0), (x1, y1) = shapely.get_coordinates(line)
    share = min(radius_m / max(hypot(x1 - x0, y1 - y0), 1e-9), 1.0)
    return (float(x0 + share * (x1 - x0)), float(y0 + share * (y1 - y0))), (float(x1), float(y1))


def _box_distance_m(crane: TowerCrane, piece: _Piece, thing: Thing, low_m: float, high_m: float) -> float:
    """Return how far the boxes of a thing are from a piece on plan, at most; infinite if none is level with it."""
    boxes = thing.boxes_m[(thing.boxes_m[:, 0, 2] < high_m) & (thing.boxes_m[:, 1, 2] > low_m)]
    if not len(boxes):
        return np.inf
    axis = np.array(crane.base_m[:2])
    apart = np.maximum(np.maximum(boxes[:, 0, :2] - axis, axis - boxes[:, 1, :2]) - piece.half_m, 0.0)
    return max(float(np.hypot(*apart.T).min()) - piece.radius_m, 0.0)


def _at_heights(thing: Thing, low_m: float, high_m: float) -> NDArray[np.object_]:
    """Return what a thing is on plan between two heights: convex shapes, one a triangle or box."""
    if thing.mesh is None:
        boxes = thing.boxes_m[(thing.boxes_m[:, 0, 2] < high_m) & (thing.boxes_m[:, 1, 2] > low_m)]
        shapes: NDArray[np.object_] = shapely.box(*boxes[:, 0, :2].T, *boxes[:, 1, :2].T)
        return shapes
    return _clipped(thing.mesh.triangles_m, low_m, high_m)


def _clipped(triangles_m: _Floats, low_m: float, high_m: float) -> NDArray[np.object_]:
    """Return what lies between two heights of each triangle, on plan."""
    z = triangles_m[:, :, 2]
    own = triangles_m[(z.min(axis=1) < high_m) & (z.max(axis=1) > low_m)]
    if not len(own):
        return np.zeros(0, np.object_)
    ahead = np.roll(own, -1, axis=1)
    points, valid = [own], [(own[:, :, 2] >= low_m) & (own[:, :, 2] <= high_m)]
    for level_m in (low_m, high_m):
        rise = ahead[:, :, 2] - own[:, :, 2]
        with np.errstate(divide="ignore", invalid="ignore"):
            share = np.where(rise != 0.0, (level_m - own[:, :, 2]) / np.where(rise != 0.0, rise, 1.0), -1.0)
        points.append(own + np.clip(share, 0.0, 1.0)[:, :, None] * (ahead - own))
        valid.append((share >= 0.0) & (share <= 1.0))
    corners, there = np.concatenate(points, axis=1)[:, :, :2], np.concatenate(valid, axis=1)
    first = np.take_along_axis(corners, there.argmax(axis=1)[:, None, None], axis=1)
    shapes: NDArray[np.object_] = shapely.convex_hull(shapely.linestrings(np.where(there[:, :, None], corners, first)))
    return shapes


def _below(
    crane: TowerCrane, tail: _Piece, kind: str, things: Sequence[Thing], most_m: float | None
) -> Distance | None:
    """Return the least height between the tail and the highest of what is below its circle."""
    axis, best = np.array(crane.base_m[:2]), None
    for thing in things:
        boxes = thing.boxes_m
        apart = np.hypot(*np.maximum(np.maximum(boxes[:, 0, :2] - axis, axis - boxes[:, 1, :2]), 0.0).T)
        boxes = boxes[apart < tail.radius_m]
        if not len(boxes):
            continue
        top_m, at = float(boxes[:, 1, 2].max()), boxes[int(boxes[:, 1, 2].argmax())][:, :2].mean(axis=0)
        if thing.mesh is not None:
            corners = thing.mesh.vertices_m[np.unique(thing.mesh.faces)]
            under = corners[np.hypot(*(corners[:, :2] - axis).T) < tail.radius_m]
            # A long edge may pass below the circle with both ends outside: then its highest corner counts.
            at = (under if len(under) else corners)[(under if len(under) else corners)[:, 2].argmax()][:2]
        gap_m = tail.low_m - top_m
        if gap_m >= 0.0 and (most_m is None or gap_m < most_m) and (best is None or gap_m < best.distance_m):
            place = (float(at[0]), float(at[1]))
            best = Distance("below tail", kind, thing.name, gap_m, (place, place))
    return best


def to_cranes(site: Site, number: int) -> list[Distance]:
    """Return how far a crane's mast and tail are from the masts and tails of the others, at common heights."""
    crane, own, found = site.cranes[number], outline_of(site.cranes[number]), []
    for n, other_crane in enumerate(site.cranes):
        if n == number:
            continue
        other = outline_of(other_crane)
        axes = shapely.LineString([own.base_m, other.base_m])
        apart_m = float(axes.length)
        ends = _ends(axes, 0.0)
        if crane.kind != "mobile":
            masts_m = apart_m - (crane.mast_size_m + other_crane.mast_size_m) / 2.0
            found.append(Distance("mast", "crane", other_crane.name, max(masts_m, 0.0), ends))
        if tail_low_m(crane) < other.mast_height_m[1]:
            tail_m = apart_m - own.tail_m - other_crane.mast_size_m / 2.0
            found.append(Distance("tail", "crane", other_crane.name, max(tail_m, 0.0), ends))
    return found


def to_areas(crane: TowerCrane, areas: dict[str, shapely.Geometry]) -> list[Distance]:
    """Return how far the pieces of a crane are from areas on the ground, on plan; ``boundary`` is that of the plot."""
    found = []
    for kind, area in areas.items():
        for piece in _pieces(crane):
            plan = piece.plan(crane)
            edge = area.boundary if kind == "boundary" else area
            is_above = piece.name == "tail" and piece.low_m > crane.base_m[2] + STANDING_M
            if edge.is_empty or (is_above and kind != "boundary"):
                continue
            line = shapely.shortest_line(plan, edge)
            distance_m = float(line.length) - piece.radius_m
            if kind == "boundary" and not area.contains(plan):
                distance_m = -piece.radius_m - float(line.length)
            elif kind != "boundary":
                distance_m = max(distance_m, 0.0)
            found.append(Distance(piece.name, kind, "", distance_m, _ends(line, piece.radius_m)))
    return found


class Solid(NamedTuple):
    """A solid of a mobile crane in its set-up: an area on plan between two heights."""

    name: str
    plan: shapely.Geometry
    low_m: float
    high_m: float


_TOUCHES_M = 0.01
"""The crane stands on what reaches no higher above its foot."""


def stand_of(crane: TowerCrane) -> tuple[Solid, ...]:
    """Return where a mobile crane stands: the square up to the pivot, what lies between the outriggers, the tail."""
    x, y, foot_m = crane.base_m
    outline, half_m = outline_of(crane), crane.mast_size_m / 2.0
    top_m = foot_m + STANDING_M if crane.luffing is None else crane.luffing.pivot_height_m
    solids = [Solid("carrier", shapely.box(x - half_m, y - half_m, x + half_m, y + half_m), foot_m, top_m)]
    if crane.carrier is not None and (base := crane.carrier.outriggers) is not None:
        plan = shapely.box(x - base.rear_m, y - base.right_m, x + base.front_m, y + base.left_m)
        turned = affinity.rotate(plan, crane.carrier.heading_rad, origin=(x, y), use_radians=True)
        solids.append(Solid("outriggers", turned, foot_m, foot_m + STANDING_M))
    swept = shapely.Point(x, y).buffer(outline.tail_m)
    return (*solids, Solid("tail", swept, tail_low_m(crane), outline.tail_height_m[1]))


def is_in(solid: Solid, mesh: TriangleMesh, more_m: float = 0.0) -> bool:
    """Return whether a surface reaches into a solid, made wider on plan."""
    plan = solid.plan.buffer(more_m) if more_m else solid.plan
    (low, high), (x0, y0, x1, y1) = mesh.bounds_m, plan.bounds
    if (low > [x1, y1, solid.high_m]).any() or (high < [x0, y0, solid.low_m]).any():
        return False
    shapes = _clipped(mesh.triangles_m, solid.low_m + _TOUCHES_M, solid.high_m)
    return len(shapes) > 0 and bool(shapely.intersects(plan, shapes).any())
