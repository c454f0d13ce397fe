"""The verifier's test of real triangles: a collision library, finely sampled.

FCL (Pan, Chitta, Manocha 2012) says whether two triangle sets meet. The tolerance is the thicker part's surface moved
inward; before it is trusted, the moved surface is checked to lie within reach of the true one, so that a part that lost
its shape cannot pass for free.
"""

from __future__ import annotations

import fcl
import numpy as np
from numpy.typing import NDArray

from bimvox.bim.building import TriangleMesh
from bimvox.compiled import kernel
from bimvox.planning.contact.erosion import eroded_triangles_m, pair_depths_m, thickness_m
from bimvox.proof.kept import kept
from bimvox.records.lift import LiftPlan
from bimvox.records.proof import Check
from bimvox.site.component import Component

_SPACING_M = 0.02
_ROPE_M = 0.02  # the rope as a thin box: real ropes are 16 to 24 mm
_SHARES_STILL_INSIDE = (0.3, 0.5, 0.7, 0.9)  # shares of its way out at one of which a part must still meet the other
_Key = tuple[bool, int, float]  # whether it is moved about, number of the solid, how far its surface is moved inward
_ROUNDING_M = 1e-9  # boxes this close are not taken to be apart
_AT_CELL_VOX = 0.01  # a position this close to a placement is at it


class TriangleCheck:
    """Real triangles of everything that can touch: components by their index, then structure.

    Args:
        plan: The plan; its modelled clashes say which pairs may overlap as deep as drawn.
    """

    def __init__(self, plan: LiftPlan) -> None:
        site = plan.site
        self._site = site
        structure_cells: list[NDArray[np.int32]] = []
        self._structure_cells = structure_cells
        self._meshes: list[TriangleMesh] = [c.mesh for c in site.components]
        ids = [c.id for c in site.components]
        for blocker in site.blockers:
            if blocker.mesh is not None:
                self._meshes.append(blocker.mesh)
                structure_cells.append(blocker.cells)
                ids.append(blocker.id)
        numbers = {name: n for n, name in enumerate(ids)}
        self._ids = ids
        self._clashes = {
            (numbers[c.first], numbers[c.second]): None if c.way_out_m is None else np.array(c.way_out_m)
            for c in plan.clashes
            if c.first in numbers and c.second in numbers
        }
        self._boxes = [_bounds_m(mesh) for mesh in self._meshes]
        self._bounds = np.array(self._boxes, np.float64).reshape(-1, 2, 3)
        self._objects: dict[_Key, fcl.CollisionObject] = {}
        self._trusted: set[_Key] = set()

    def check_moves(self, check: Check, component: Component, path: NDArray[np.int32], other: int) -> None:
        """Check that a part meets another no deeper than it may along a path of unit moves.

        Args:
            check: Where the result goes.
            component: The part.
            path: (N, 3) placements.
            other: Number of the other solid.
        """
        offsets_m = (path - np.array(component.target_vox)) * self._site.frame.voxel_size_m
        self.check_way(check, component, offsets_m, other)

    def check_way(self, check: Check, component: Component, offsets_m: NDArray[np.float64], other: int) -> None:
        """Check that a part meets another no deeper than it may along straight pieces between positions.

        Args:
            check: Where the result goes.
            component: The part.
            offsets_m: (N, 3) where it is, relative to its place in the building; metres.
            other: Number of the other solid.
        """
        low, high = self._boxes[component.index]
        other_low, other_high = self._boxes[other]
        swept_low, swept_high = low + offsets_m.min(axis=0), high + offsets_m.max(axis=0)
        if (swept_low > other_high).any() or (swept_high < other_low).any():
            return
        way_m = self._way_out_m(check, component.index, other)
        if way_m is None:
            self._check_no_fuller(check, component, offsets_m, other)
            return
        tolerance_m = self._site.rules.contact_tolerance_m
        depths_m = pair_depths_m(component.index, other, self._thickness_m(component.index, other), tolerance_m)
        part_box = self._inner_box(check, component.index, depths_m[0], moving=True)
        fixed_box = self._inner_box(check, other, depths_m[1], moving=False)
        for offset_m in self._met(check, component, offsets_m, other, (part_box, way_m), fixed_box, depths_m):
            check.look(False, f"{component.id}: meets {self._ids[other]} deeper than it may, at {_metres(offset_m)}")
        check.measure(float(np.abs(way_m).sum()) + self._site.rules.contact_tolerance_m)

    def check_apart(self, check: Check, component: Component, offsets_m: NDArray[np.float64], other: int) -> None:
        """Check that a part does not meet another at all along straight pieces between positions.

        For what it does not touch in the finished building: true surfaces, nothing is allowed for. It comes from where
        it is free, so surfaces cross on its way into another.

        Args:
            check: Where the result goes.
            component: The part.
            offsets_m: (N, 3) where it is, relative to its place in the building; metres. The first is known to be free.
            other: Number of the other solid.
        """
        low, high = self._boxes[component.index]
        other_low, other_high = self._boxes[other]
        if (low + offsets_m.min(axis=0) > other_high).any() or (high + offsets_m.max(axis=0) < other_low).any():
            return
        drawn = (self._boxes[component.index], np.zeros(3))
        for offset_m in self._met(check, component, offsets_m, other, drawn, self._boxes[other], (0.0, 0.0)):
            check.look(False, f"{component.id}: meets {self._ids[other]}, which it passes by, at {_metres(offset_m)}")

    def _met(
        self,
        check: Check,
        component: Component,
        offsets_m: NDArray[np.float64],
        other: int,
        part: tuple[NDArray[np.float64], NDArray[np.float64]],
        fixed: NDArray[np.float64],
        depths_m: tuple[float, float],
    ) -> list[NDArray[np.float64]]:
        """Return the offsets, finely, at which triangles meet; the others are counted as looked at and good.

        Solids whose boxes are apart do not meet, neither do triangles: only the rest is for the collision library.

        Args:
            check: Where the count goes.
            component: The part.
            offsets_m: (N, 3) where it is, relative to its place in the building.
            other: Number of the other solid.
            part: (2, 3) the box around the part's triangles, and (3,) what they are moved by beside the offset.
            fixed: (2, 3) the box around the other's.
            depths_m: How far the surfaces of both are moved inward.
        """
        (box, way_m), (fixed_low, fixed_high) = part, fixed
        fine_m = _finely(offsets_m, self._spacing_m(component.index, other))
        low, high = self._boxes[component.index]
        other_low, other_high = self._boxes[other]
        apart = (low + fine_m > other_high) | (high + fine_m < other_low)
        low, high = box + way_m
        apart |= (low + fine_m > fixed_high + _ROUNDING_M) | (high + fine_m < fixed_low - _ROUNDING_M)
        met: list[NDArray[np.float64]] = []
        close_m = fine_m[~apart.any(axis=1)]
        if len(close_m):
            moving = self._moved(component.index, depths_m[0])
            fixed_object = self._fixed(other, depths_m[1])
        for offset_m in close_m:
            moving.setTranslation(offset_m + way_m)
            if fcl.collide(moving, fixed_object):
                met.append(offset_m)
        check.look(True, "", samples=len(fine_m) - len(met))
        return met

    def rope_is_clear(self, component: Component, offset_m: NDArray[np.float64], other: int) -> bool:
        """Return whether a rope above the part's hook line misses another solid's triangles."""
        frame = self._site.frame
        foot = np.array(component.target_vox) + np.array(component.hook_offset_vox) + np.array([0.5, 0.5, 0.0])
        foot_m = np.array(frame.origin_m) + frame.voxel_size_m * foot + offset_m
        low, high = self._boxes[other]
        if (foot_m[:2] - _ROPE_M > high[:2]).any() or (foot_m[:2] + _ROPE_M < low[:2]).any():
            return True
        top_m = max(high[2], foot_m[2]) + 1.0
        rope = fcl.CollisionObject(fcl.Box(_ROPE_M, _ROPE_M, top_m - foot_m[2]))
        rope.setTranslation(np.array([foot_m[0], foot_m[1], (foot_m[2] + top_m) / 2]))
        return not fcl.collide(rope, self._fixed(other))

    def carried_by(self, component: Component) -> tuple[int, ...]:
        """Return the components that a part rests on in the finished building: it meets them when it sinks by the gap.

        Parts beside it are kept out by narrowing it in plan.
        """
        rules = self._site.rules
        low, high = self._boxes[component.index]
        tolerance_m = min(rules.contact_tolerance_m, 0.2 * float((high - low)[:2].min()))
        centre = (low + high) / 2
        scale = np.ones(3)
        scale[:2] = 1.0 - 2.0 * tolerance_m / np.maximum((high - low)[:2], 1e-9)  # a sheet has no thickness
        sunk: fcl.CollisionObject | None = None
        found = []
        lows, highs = self._bounds[: len(self._site.components), 0], self._bounds[: len(self._site.components), 1]
        over = ((lows[:, :2] < high[:2]) & (highs[:, :2] > low[:2])).all(axis=1)
        top = highs[:, 2]
        close = (top <= low[2] + rules.contact_tolerance_m) & (top >= low[2] - rules.support_gap_m)
        for other in np.flatnonzero(over & close).tolist():
            other_high = self._boxes[other][1]
            pair = (component.index, other)
            if other == component.index or pair in self._clashes or pair[::-1] in self._clashes:
                continue
            if sunk is None:
                sunk = _collision_object((component.mesh.triangles_m - centre) * scale + centre)
            sunk.setTranslation(np.array([0.0, 0.0, other_high[2] - low[2] - 1e-4]))
            if fcl.collide(sunk, self._fixed(other)):
                found.append(other)
        return tuple(found)

    def _way_out_m(self, check: Check, moving: int, fixed: int) -> NDArray[np.float64] | None:
        """The way out of a listed clash, doubted first; zeros for any other pair, None where no way serves."""
        if (moving, fixed) in self._clashes:
            pair, sign = (moving, fixed), 1.0
        elif (fixed, moving) in self._clashes:
            pair, sign = (fixed, moving), -1.0
        else:
            return np.zeros(3)
        way_m = self._clashes[pair]
        drawn = self._moved(pair[0])
        inside = False
        for share in (0.0,) if way_m is None else _SHARES_STILL_INSIDE:
            drawn.setTranslation(np.zeros(3) if way_m is None else way_m * share)
            inside = inside or bool(fcl.collide(drawn, self._fixed(pair[1])))
        check.look(
            inside,
            f"{self._ids[pair[0]]} and {self._ids[pair[1]]}: listed as drawn into each other deeper than they are",
        )
        return None if way_m is None else way_m * sign

    def _check_no_fuller(self, check: Check, component: Component, offsets_m: NDArray[np.float64], other: int) -> None:
        """Where no depth serves: the pair never shares more cells than in the finished building, as drawn.

        Between two placements the part is looked at in both.
        """
        moved = offsets_m / self._site.frame.voxel_size_m
        around = np.concatenate([np.floor(moved + _AT_CELL_VOX), np.ceil(moved - _AT_CELL_VOX)]).astype(np.int32)
        path = np.unique(around, axis=0) + np.array(component.target_vox, np.int32)
        there = {tuple(c) for c in self._cells(other).tolist()}
        own = component.shape.cells
        drawn = sum(tuple(c) in there for c in (own + np.array(component.target_vox)).tolist())
        for place in path:
            shared = sum(tuple(c) in there for c in (own + place).tolist())
            check.look(
                shared <= max(drawn, 1),
                f"{component.id}: overlaps {self._ids[other]} in {shared} cells at {tuple(place.tolist())}, "
                f"drawn are {drawn}",
            )

    def _thickness_m(self, *numbers: int) -> dict[int, float]:
        """Thickness of the solids that are asked for; of many only a few ever touch."""
        return {number: _thickness_m(self._meshes[number]) for number in numbers}

    def _cells(self, number: int) -> NDArray[np.int32]:
        """(N, 3) cells of a solid at its place."""
        components = self._site.components
        if number >= len(components):
            return self._structure_cells[number - len(components)]
        component = components[number]
        return component.shape.cells + np.array(component.target_vox, np.int32)

    def _spacing_m(self, first: int, second: int) -> float:
        """Fine enough that the thinner of the two cannot slip through between two samples."""
        thickness = min(float((b[1] - b[0]).min()) for b in (self._boxes[first], self._boxes[second]))
        return float(np.clip(thickness / 2, 0.002, _SPACING_M))

    def _inner_box(self, check: Check, number: int, depth_m: float, *, moving: bool) -> NDArray[np.float64]:
        """(2, 3) the box around a solid with its surface moved inward, checked once to have kept its shape."""
        _, box, is_whole = _inner(self._meshes[number], depth_m)
        key = (moving, number, round(depth_m, 6))
        if depth_m > 0.0 and key not in self._trusted:
            self._trusted.add(key)
            check.look(is_whole, f"{self._ids[number]}: its surface moved inward by {depth_m:.3f} m lost its shape")
        return box

    def _moved(self, number: int, depth_m: float = 0.0) -> fcl.CollisionObject:
        """A solid, its surface moved inward, to be moved about (``_fixed`` ones stay where they are)."""
        return self._object(True, number, depth_m)

    def _fixed(self, number: int, depth_m: float = 0.0) -> fcl.CollisionObject:
        return self._object(False, number, depth_m)

    def _object(self, moving: bool, number: int, depth_m: float) -> fcl.CollisionObject:
        key, mesh = (moving, number, round(depth_m, 6)), self._meshes[number]
        if key not in self._objects:
            self._objects[key] = _collision_object(_inner(mesh, depth_m)[0] if depth_m > 0.0 else mesh.triangles_m)
        return self._objects[key]


def _collision_object(triangles_m: NDArray[np.float64]) -> fcl.CollisionObject:
    """Return an FCL object of (F, 3, 3) float64 triangles, at the origin, that can be moved about."""
    shape = fcl.BVHModel()
    shape.beginModel(len(triangles_m), 3 * len(triangles_m))
    shape.addSubModel(triangles_m.reshape(-1, 3), np.arange(3 * len(triangles_m)).reshape(-1, 3))
    shape.endModel()
    return fcl.CollisionObject(shape)


@kept
def _bounds_m(mesh: TriangleMesh) -> NDArray[np.float64]:
    return mesh.bounds_m


@kept
def _thickness_m(mesh: TriangleMesh) -> float:
    return thickness_m(mesh)


@kept
def _inner(mesh: TriangleMesh, depth_m: float) -> tuple[NDArray[np.float64], NDArray[np.float64], bool]:
    """(F, 3, 3) triangles with the surface moved inward, (2, 3) the box around them, and whether they kept the shape.

    The moved surface lies within reach of the true one, and most of its triangles are left.
    """
    inner = eroded_triangles_m(mesh, depth_m) if depth_m > 0.0 else mesh.triangles_m
    box = np.stack([inner.min(axis=(0, 1)), inner.max(axis=(0, 1))])
    moved = np.abs(box - _bounds_m(mesh)).max()
    return inner, box, bool(moved <= 3.0 * depth_m + 1e-6 and len(inner) >= 0.5 * len(mesh.faces))


@kernel
def _finely(points_m: NDArray[np.float64], spacing_m: float) -> NDArray[np.float64]:
    """(M, 3) the points, and more between them, so that neighbours are at most ``spacing_m`` apart."""
    count = points_m.shape[0]
    parts = np.ones(count, np.int64)
    for n in range(count - 1):
        apart = points_m[n + 1] - points_m[n]
        parts[n] = max(1, int(np.ceil(np.sqrt((apart * apart).sum()) / spacing_m - 1e-9)))
    fine = np.empty((parts.sum(), 3))
    at = 0
    for n in range(count):
        for part in range(parts[n]):
            for k in range(3):
                fine[at, k] = points_m[n, k]
                if part > 0:
                    fine[at, k] += part / parts[n] * (points_m[n + 1, k] - points_m[n, k])
            at += 1
    return fine


def _metres(offset_m: NDArray[np.float64]) -> str:
    return "(" + ", ".join(f"{v:+.2f}" for v in offset_m) + ") m"
