"""Which parts touch in the finished building, and how deep each pair may overlap during insertion.

Neighbouring parts touch, and conservatively voxelized neighbours share cells, along the whole descent too. If the broad
phase (boxes against the summed-area table) hits only neighbours, the real triangles decide: one part, its surface moved
inward by the tolerance, against the other's true surface (see :mod:`bimvox.planning.contact.erosion`).

If two parts overlap by more than that in the model, the pair may overlap by no more than the model does. The shortest
straight move along an axis that separates them is their depth. During insertion, the part shifted by that move must be
clear. Such a pair is listed as a modelled clash.
"""

from __future__ import annotations

from collections.abc import Container
from copy import copy
from dataclasses import dataclass
from functools import cached_property
from typing import TypeAlias

import fcl
import numpy as np
from numpy.typing import NDArray

from bimvox.bim.building import TriangleMesh
from bimvox.bim.mesh.repair import connected_labels
from bimvox.planning.contact.erosion import eroded_triangles_m, pair_depths_m
from bimvox.planning.contact.sweep import blocked_steps
from bimvox.planning.guided import KnownGuides
from bimvox.records.lift import ModelledClash
from bimvox.site.collision import grown_cells
from bimvox.site.site import Site

_WITHIN = np.array([0.2, 0.3, 0.5])
"""Where on a triangle the point lies: seldom on a line that triangles above it share."""


def _enclosed(one_m: NDArray[np.float64], other_m: NDArray[np.float64]) -> bool:
    """Return whether a body of one part lies inside the other one, of (F, 3, 3) triangles each.

    For parts whose surfaces do not cross: then a body is inside if one of its points is.
    """
    return _lies_inside(one_m, other_m) or _lies_inside(other_m, one_m)


def _lies_inside(part_m: NDArray[np.float64], around_m: NDArray[np.float64]) -> bool:
    if not len(part_m) or not len(around_m):
        return False
    low, high = around_m.min(axis=(0, 1)), around_m.max(axis=(0, 1))
    # Only what lies in the box of the other part; of these triangles, the first one of each body.
    near_m = part_m[((part_m >= low) & (part_m <= high)).all(axis=(1, 2))]
    if not len(near_m):
        return False
    points_m = np.einsum("k,fkd->fd", _WITHIN, near_m[_first_of_bodies(near_m)])
    return any(crossings_above(around_m, point_m) % 2 for point_m in points_m)


def _first_of_bodies(triangles_m: NDArray[np.float64]) -> NDArray[np.int64]:
    """Return the number of one triangle of every connected piece of (F, 3, 3) triangles."""
    _, corner = np.unique(triangles_m.reshape(-1, 3).round(7), axis=0, return_inverse=True)
    faces = corner.reshape(-1, 3)
    ends, count = np.concatenate([faces[:, :2], faces[:, 1:]]).T, int(faces.max()) + 1
    body = connected_labels(count, *ends)
    _, first = np.unique(body[faces[:, 0]], return_index=True)
    result: NDArray[np.int64] = first.astype(np.int64)
    return result


def collision_object(triangles_m: NDArray[np.float64]) -> fcl.CollisionObject:
    """Return a movable FCL object of (F, 3, 3) float64 triangles, at the origin."""
    shape = fcl.BVHModel()
    shape.beginModel(len(triangles_m), 3 * len(triangles_m))
    shape.addSubModel(triangles_m.reshape(-1, 3), np.arange(3 * len(triangles_m)).reshape(-1, 3))
    shape.endModel()
    return fcl.CollisionObject(shape)


Collider: TypeAlias = fcl.CollisionObject
"""A body of FCL."""


def tube(radius_m: float, start_m: NDArray[np.float64], end_m: NDArray[np.float64]) -> Collider:
    """Return the body of a cylinder around a line between two points."""
    length_m = float(np.linalg.norm(end_m - start_m))
    z = (end_m - start_m) / length_m
    x = np.cross(z, np.eye(3)[int(np.argmin(np.abs(z)))])
    x /= np.linalg.norm(x)
    placed = fcl.Transform(np.column_stack([x, np.cross(z, x), z]), (start_m + end_m) / 2.0)
    return fcl.CollisionObject(fcl.Cylinder(radius_m, length_m), placed)


def ball(radius_m: float, middle_m: NDArray[np.float64]) -> Collider:
    """Return the body of a ball."""
    return fcl.CollisionObject(fcl.Sphere(radius_m), fcl.Transform(middle_m))


def collide(one: Collider, other: Collider) -> bool:
    """Return whether two bodies meet."""
    return bool(fcl.collide(one, other))


LEAST_GAP_M = 0.001
_DEPTH_STEP_M = 0.001
_DEPTH_REACH_M = 2.0
_NOWHERE = np.zeros(3)
_WAYS_TRIED = 8


@dataclass(frozen=True, slots=True, eq=False)
class _Solid:
    """A component at its place, or a fixed structure.

    Attributes:
        id: Component or structure id.
        cells: (N, 3) int32 cells in the grid.
        mesh: Its triangles in the site's frame.
    """

    id: str
    cells: NDArray[np.int32]
    mesh: TriangleMesh


class Contacts:
    """The neighbours of every component, and how deep each pair may overlap.

    Solids are numbered: components by their index, then structures. Everything here depends on the finished building
    alone, not on obstructions, so the replanner keeps it.

    Attributes:
        solids: Components first, in the order of ``site.components``.
        bounds_vox: (N, 2, 3) the lowest and the highest cell of each on every axis; the highest is lower without cells.
        neighbours: Per component, the numbers of the solids that share or touch cells with it in the finished building.
        clashes: Pairs that overlap in the model.
        guides: What searches for guides have found.
        steps: Which steps between cells are blocked.
    """

    def __init__(self, site: Site) -> None:
        self._tolerance_m = site.rules.contact_tolerance_m
        self._shape = site.shape
        components = [
            _Solid(c.id, (c.shape.cells + np.array(c.target_vox, np.int32)).astype(np.int32), c.mesh)
            for c in site.components
        ]
        structure = [_Solid(b.id, b.cells, b.mesh) for b in site.blockers if b.mesh is not None]
        self.solids: tuple[_Solid, ...] = (*components, *structure)
        self.bounds_vox = np.array(
            [
                (solid.cells.min(axis=0), solid.cells.max(axis=0)) if len(solid.cells) else ((0, 0, 0), (-1, -1, -1))
                for solid in self.solids
            ],
            np.int64,
        ).reshape(-1, 2, 3)
        self._component_count = len(components)
        self._triangles = [solid.mesh.triangles_m for solid in self.solids]
        self._thickness_m = [_thickness_m(solid.mesh) for solid in self.solids]
        self._eroded: dict[tuple[int, float], NDArray[np.float64]] = {}
        self.guides = KnownGuides()
        self._bvhs: dict[int, fcl.CollisionObject] = {}
        self.neighbours: tuple[tuple[int, ...], ...] = self._find_neighbours()
        self._ways_out_m: dict[tuple[int, int], NDArray[np.float64] | None] = {}
        self.clashes: tuple[ModelledClash, ...] = self._find_clashes()

    def listing(self, clashes: Container[ModelledClash]) -> Contacts:
        """Return the same contacts, which list none but these of their clashes.

        Only the list changes: the moves are still tested as the pairs are drawn, and the proof decides about each lift.
        """
        result = copy(self)
        result.clashes = tuple(clash for clash in self.clashes if clash in clashes)
        return result

    def triangles_m(self, solid: int) -> NDArray[np.float64]:
        """Return the true triangles of a solid, (F, 3, 3) float64."""
        return self._triangles[solid]

    def way_out_m(self, moving: int, fixed: int) -> NDArray[np.float64] | None:
        """Return the move that separates two solids that overlap in the model.

        Returns (3,) metres, zeros if they do not overlap; None if no move of at most 2 m separates them, so that the
        pair cannot be tested.
        """
        if (moving, fixed) in self._ways_out_m:
            return self._ways_out_m[moving, fixed]
        back = self._ways_out_m.get((fixed, moving), _NOWHERE)
        return None if back is None else -back

    def eroded_m(self, solid: int, depth_m: float) -> NDArray[np.float64]:
        """Return the triangles of a solid with its surface moved inward, (F, 3, 3) float64."""
        if depth_m <= 0.0:
            return self._triangles[solid]
        key = (solid, round(depth_m, 6))
        if key not in self._eroded:
            self._eroded[key] = eroded_triangles_m(self.solids[solid].mesh, depth_m)
        return self._eroded[key]

    def pair_m(self, first: int, second: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the eroded triangles of two solids that test their contact."""
        depths_m = pair_depths_m(first, second, self._thickness_m, self._tolerance_m)
        return self.eroded_m(first, depths_m[0]), self.eroded_m(second, depths_m[1])

    def guided_pair_m(self, first: int, second: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the triangles that test the contact of two solids while one is guided: only the thicker is eroded.

        The proof grants the skin of the thicker part. Eroding both lets tilted sheets slip through each other.
        """
        depths_m = pair_depths_m(first, second, self._thickness_m, self._tolerance_m)
        bears = (self._thickness_m[first], -first) > (self._thickness_m[second], -second)
        return (
            self.eroded_m(first, depths_m[0] if bears else 0.0),
            self.eroded_m(second, 0.0 if bears else depths_m[1]),
        )

    def meets_on_move(
        self,
        moving: int,
        offset_m: NDArray[np.float64],
        fixed: int,
        axis: int,
        direction: int,
        step_m: float,
        count: int,
    ) -> NDArray[np.bool_]:
        """Return the steps of a straight move in which a component overlaps another solid by more than is allowed.

        The component starts at ``offset_m``, (3,), from its place in the building; the other solid is at its place.
        The move and the result, (count,) bool, are as in ``sweep.blocked_steps``.
        """
        way_m = self.way_out_m(moving, fixed)
        if way_m is None:
            return np.zeros(count, np.bool_)
        part, other = self.pair_m(moving, fixed)
        return blocked_steps(part, other, axis, direction, step_m, count, offset_m + way_m)

    def strikes_on_move(
        self,
        moving: int,
        offset_m: NDArray[np.float64],
        fixed: int,
        axis: int,
        direction: int,
        step_m: float,
        count: int,
    ) -> NDArray[np.bool_]:
        """Return the steps of a straight move that bring a component closer to another solid than the tolerance.

        For solids that are not neighbours. Tests the true triangles of both, with the part at its position and shifted
        by the tolerance along every axis: coplanar surfaces do not cross, but shifted they do. The move and the result
        are as in ``meets_on_move``.
        """
        part, other = self._triangles[moving], self._triangles[fixed]
        aside = [np.zeros(3)]
        aside += [sign * max(self._tolerance_m, LEAST_GAP_M) * np.eye(3)[n] for n in range(3) for sign in (1.0, -1.0)]
        blocked = [blocked_steps(part, other, axis, direction, step_m, count, offset_m + by_m) for by_m in aside]
        struck: NDArray[np.bool_] = np.any(blocked, axis=0)
        return struck

    @cached_property
    def bounds_m(self) -> NDArray[np.float64]:
        """Bounding boxes of all solids, (N, 2, 3) float64."""
        return np.stack([np.stack([t.min(axis=(0, 1)), t.max(axis=(0, 1))]) for t in self._triangles])

    def _find_neighbours(self) -> tuple[tuple[int, ...], ...]:
        numbers = np.concatenate([np.full(len(s.cells), n, np.int32) for n, s in enumerate(self.solids)])
        keys = np.concatenate([self._key(solid.cells) for solid in self.solids])
        order = np.argsort(keys, kind="stable")
        keys, numbers = keys[order], numbers[order]
        found = []
        for number in range(self._component_count):
            around = self._key(grown_cells(self.solids[number].cells, 1))
            low, high = np.searchsorted(keys, around, "left"), np.searchsorted(keys, around, "right")
            runs = [numbers[(low + n)[low + n < high]] for n in range(int((high - low).max()))]
            met = np.unique(np.concatenate(runs))
            found.append(tuple(int(n) for n in met if n != number))
        return tuple(found)

    def _key(self, cells: NDArray[np.int32]) -> NDArray[np.int64]:
        """Return one number per cell; a margin of one cell all round keeps grown shapes from wrapping."""
        _, ny, nz = self._shape
        x, y, z = (cells.astype(np.int64) + 1).T
        key: NDArray[np.int64] = (x * (ny + 2) + y) * (nz + 2) + z
        return key

    def _find_clashes(self) -> tuple[ModelledClash, ...]:
        clashes = []
        for first in range(self._component_count):
            for second in self.neighbours[first]:
                if second < first or not self._boxes_overlap(first, second):
                    continue
                part, other = (self._bvh_of(triangles) for triangles in self.pair_m(first, second))
                part.setTranslation(np.zeros(3))
                if not fcl.collide(part, other) and not _enclosed(*self.pair_m(first, second)):
                    continue
                way_m = self._way_out_as_drawn_m(first, second, part, other)
                part.setTranslation(np.zeros(3))
                self._ways_out_m[first, second] = way_m
                if self._overlap(first, second, way_m):
                    clashes.append(_clash(self.solids[first].id, self.solids[second].id, way_m))
        self._bvhs.clear()
        return tuple(clashes)

    def _bvh_of(self, triangles_m: NDArray[np.float64]) -> fcl.CollisionObject:
        """Return the collision object of triangles; cached by their identity, as they live as long as this object."""
        if id(triangles_m) not in self._bvhs:
            self._bvhs[id(triangles_m)] = collision_object(triangles_m)
        return self._bvhs[id(triangles_m)]

    def _boxes_overlap(self, first: int, second: int) -> bool:
        a, b = self.bounds_m[first], self.bounds_m[second]
        return bool((a[0] < b[1]).all() and (b[0] < a[1]).all())

    def _overlap(self, first: int, second: int, way_m: NDArray[np.float64] | None) -> bool:
        """Return whether two solids with a way out, eroded by no more than a millimetre, still meet.

        Where a part has no inside it is not eroded and meets what it touches: the proof takes such a pair off the list.
        """
        depths_m = pair_depths_m(first, second, self._thickness_m, min(self._tolerance_m, LEAST_GAP_M))
        one, other = (self.eroded_m(*solid) for solid in zip((first, second), depths_m, strict=True))
        if fcl.collide(self._bvh_of(one), self._bvh_of(other)):
            return True
        is_short = way_m is not None and np.abs(way_m).sum() <= LEAST_GAP_M
        return not is_short and _enclosed(one, other)

    def _way_out_as_drawn_m(
        self, first: int, second: int, part: fcl.CollisionObject, other: fcl.CollisionObject
    ) -> NDArray[np.float64] | None:
        """Return the shortest straight move along an axis that separates two parts; None beyond the reach."""
        (low, high), (other_low, other_high) = self.bounds_m[first], self.bounds_m[second]
        shortest_m, way_m = _DEPTH_REACH_M, None
        for axis in range(3):
            for direction in (1, -1):
                apart_m = other_high[axis] - low[axis] if direction > 0 else high[axis] - other_low[axis]
                count = (
                    int(np.ceil(min(apart_m, shortest_m) / _DEPTH_STEP_M)) + 2
                )  # they may still touch at the last but one
                blocked = blocked_steps(
                    self._triangles[first], self._triangles[second], axis, direction, _DEPTH_STEP_M, count
                )
                # Parts can be hollow (channels, frames): a separating move may end between two contacts.
                ends = np.flatnonzero(blocked[:-1] & ~blocked[1:]) + 1
                for step in ends[:_WAYS_TRIED]:
                    out_m = float(step) * _DEPTH_STEP_M
                    if out_m >= shortest_m:
                        break
                    moved_m = direction * out_m * np.eye(3)[axis]
                    point_m = self._triangles[first][0].mean(axis=0) + moved_m
                    outside = crossings_above(self._triangles[second], point_m) % 2 == 0
                    part.setTranslation(moved_m)
                    if outside and not fcl.collide(part, other) and not self._still_enclosed(first, second, moved_m):
                        shortest_m, way_m = out_m, moved_m
                        break
        return self._apart_by_boxes_m(first, second) if way_m is None else way_m

    def _still_enclosed(self, first: int, second: int, moved_m: NDArray[np.float64]) -> bool:
        part, other = self.pair_m(first, second)
        return _enclosed(part + moved_m, other)

    def _apart_by_boxes_m(self, first: int, second: int) -> NDArray[np.float64] | None:
        """Return the move that takes the boxes of two parts apart, less what their surfaces do not need.

        For surfaces that no swept triangle shows: faces along the move, and parts that many contacts separate.
        """
        (low, high), (other_low, other_high) = self.bounds_m[first], self.bounds_m[second]
        apart_m = np.stack([high - other_low, other_high - low])
        part, other = (collision_object(self._triangles[number]) for number in (first, second))
        for side, axis in np.argwhere(apart_m < _DEPTH_REACH_M)[np.argsort(apart_m[apart_m < _DEPTH_REACH_M])]:
            toward = (2.0 * side - 1.0) * np.eye(3)[axis]
            for step in range(int(np.ceil(apart_m[side, axis] / _DEPTH_STEP_M)), -1, -1):
                part.setTranslation(step * _DEPTH_STEP_M * toward)
                if fcl.collide(part, other):
                    way_m: NDArray[np.float64] = (step + 1) * _DEPTH_STEP_M * toward
                    return way_m
        return None


def _clash(first: str, second: str, way_m: NDArray[np.float64] | None) -> ModelledClash:
    if way_m is None:
        return ModelledClash(first, second, _DEPTH_REACH_M, None)
    x, y, z = (round(float(n), 6) for n in way_m)
    return ModelledClash(first, second, round(float(np.abs(way_m).sum()), 6), (x, y, z))


def crossings_above(triangles_m: NDArray[np.float64], point_m: NDArray[np.float64]) -> int:
    """Return how many of (F, 3, 3) triangles a line straight up from a point, (3,) metres, crosses."""
    a, b, c = (triangles_m[:, n, :2] - point_m[:2] for n in range(3))
    ab, bc, ca = (p[:, 0] * q[:, 1] - p[:, 1] * q[:, 0] for p, q in ((a, b), (b, c), (c, a)))
    total = ab + bc + ca
    over = (((ab >= 0) & (bc >= 0) & (ca >= 0)) | ((ab <= 0) & (bc <= 0) & (ca <= 0))) & (np.abs(total) > 1e-12)
    if not over.any():
        return 0
    z = triangles_m[over][:, :, 2]
    height = (bc[over] * z[:, 0] + ca[over] * z[:, 1] + ab[over] * z[:, 2]) / total[over]
    return int((height > point_m[2]).sum())


def _thickness_m(mesh: TriangleMesh) -> float:
    """Return the mean thickness of a solid, 2 V / A (exact for a large plate), at most its box's smallest edge."""
    a, b, c = np.moveaxis(mesh.triangles_m, 1, 0)
    area_m2 = float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum()) / 2.0
    low, high = mesh.bounds_m
    smallest = float((high - low).min())
    return min(smallest, 2.0 * abs(mesh.signed_volume_m3) / area_m2) if area_m2 > 0.0 else smallest
