"""The triangle test: whether a part overlaps another too deep, on a finely sampled path.

How deep two parts may overlap is decided by ``overlap``: the surface of the thinner part must not reach the core of the
thicker one. If two parts overlap in the model, the plan lists the pair with a way out of the overlap, and the part
moved by that way must respect this rule. Offsets along the path are at most 20 mm apart, or half the thickness of
the thinner part's box. FCL (Pan, Chitta, Manocha 2012) tests whether true surfaces cross: for parts that are not
neighbours, for ropes, and for what carries a part.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise, product

import fcl
import numpy as np
from numpy.typing import NDArray

from bimvox.bim.building import TriangleMesh
from bimvox.compiled import kernel
from bimvox.kept import kept
from bimvox.proof.bodies.overlap import overlaps_m
from bimvox.proof.bodies.solid import FINEST_M, Solid, solid_of
from bimvox.records.lift import Guide, LiftPlan, ModelledClash, swept_box_m
from bimvox.records.proof import Check
from bimvox.site.component import Component

_MOST = 4096


def _poses_along(guide: Guide, mesh: TriangleMesh, spacing_m: float) -> NDArray[np.float64]:
    """Return (N, 3) height, aside and tilt of poses from the first one of a guide to its last."""
    arm_m = float(np.linalg.norm(mesh.vertices_m - np.array(guide.centre_m), axis=1).max())
    found = []
    for start, end in pairwise(guide.poses):
        by = np.abs(np.subtract(end, start))
        count = min(max(1, int(np.ceil((by[0] + by[1] + arm_m * by[2]) / spacing_m))), _MOST)
        share = np.arange(count)[:, None] / count
        found.append(np.array(start) + share * np.subtract(end, start))
    return np.concatenate([*found, np.array(guide.poses[-1:])])


def boxes_along(guide: Guide, mesh: TriangleMesh, poses: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return (N, 2, 3) boxes around a guided part in (N, 3) poses: around its box at its place, moved and turned."""
    corners_m = np.array(list(product(*mesh.bounds_m.T))) - np.array(guide.centre_m)
    turned_m = np.einsum("nij,kj->nki", guide.turns(poses[:, 2]), corners_m)
    at_m = np.array(guide.centre_m) + poses[:, :1] * np.array([0.0, 0.0, 1.0]) + poses[:, 1:2] * guide.ahead
    boxes_m: NDArray[np.float64] = np.stack([turned_m.min(axis=1) + at_m, turned_m.max(axis=1) + at_m], axis=1)
    return boxes_m


def _turned_solid(solid: Solid, turn: NDArray[np.float64]) -> Solid:
    """Return a solid after a rotation ((3, 3)) about the origin of its frame."""
    corners = np.ascontiguousarray(solid.corners_m @ turn.T)
    if not len(corners):
        return solid
    least_m = float(solid.skins_m.min())
    low, high = corners.min(axis=(0, 1)) + least_m, corners.max(axis=(0, 1)) - least_m
    return solid._replace(
        corners_m=corners,
        normals=np.ascontiguousarray(solid.normals @ turn.T),
        boxes_m=_boxes(corners, solid.spans),
        core_m=np.stack([low, high]),
        seed_m=np.ascontiguousarray(solid.seed_m @ turn.T),
        ends_m=np.ascontiguousarray(solid.ends_m @ turn.T),
    )


@kernel
def _boxes(corners: NDArray[np.float64], spans: NDArray[np.int64]) -> NDArray[np.float64]:
    """Return (N, 2, 3) the boxes around the triangles of each node of a tree."""
    boxes = np.empty((spans.shape[0], 2, 3))
    for n in range(spans.shape[0]):
        for k in range(3):
            low, high = np.inf, -np.inf
            for f in range(spans[n, 0], spans[n, 1]):
                for c in range(3):
                    low, high = min(low, corners[f, c, k]), max(high, corners[f, c, k])
            boxes[n, 0, k], boxes[n, 1, k] = low, high
    return boxes


_SPACING_M = 0.02
_ROPE_M = 0.02  # the rope as a thin box: real ropes are 16 to 24 mm
_UNDER_ROPE_M = 1e-6  # the rope starts this far above its foot: it may touch the top of the part that it hangs from
_MEASURED_M = 0.002  # a listed depth may differ from the measured one by this
_INTERLOCKED_M = 2.0  # a shorter move must be listed as the way out
_LEVEL = np.eye(3)
_SHEET_M = 1e-6  # anything thinner is a sheet and has no inside
_SUNK_M = 1e-4  # how far a part sinks into what carries it
_ROUNDING_M = 1e-9  # boxes closer than this do not count as apart
_AT_CELL_VOX = 0.01  # a position this close to a placement counts as at it


class TriangleCheck:
    """Real triangles of everything that can touch: components by their index, then structure.

    Args:
        plan: The plan; its modelled clashes list the pairs that may overlap by no more than the model does.
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
        self._listed = {
            (numbers[c.first], numbers[c.second]): c for c in plan.clashes if c.first in numbers and c.second in numbers
        }
        self._measured: dict[tuple[int, int], bool] = {}
        self._boxes = [_bounds_m(mesh) for mesh in self._meshes]
        self._bounds = np.array(self._boxes, np.float64).reshape(-1, 2, 3)
        self._leaning: tuple[int, dict[bytes, Solid]] = (-1, {})
        self._objects: dict[tuple[bool, int], fcl.CollisionObject] = {}
        self._tops: dict[int, fcl.CollisionObject] = {}
        self._carried: dict[int, tuple[int, ...]] = {}
        self._guided: tuple[Component, Guide, tuple[NDArray[np.float64], NDArray[np.float64]]] | None = None

    def check_moves(self, check: Check, component: Component, path: NDArray[np.int32], other: int) -> None:
        """Check that a part overlaps another solid by no more than allowed along a path ((N, 3)) of unit moves."""
        offsets_m = (path - np.array(component.target_vox)) * self._site.frame.voxel_size_m
        self.check_way(check, component, offsets_m, other)

    def check_way(self, check: Check, component: Component, offsets_m: NDArray[np.float64], other: int) -> None:
        """Check that a part overlaps another solid by no more than allowed along straight pieces between positions.

        The positions ``offsets_m`` ((N, 3) metres) are relative to its place in the building.
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
        boxes, meets = self._too_deep(component.index, other, tolerance_m)
        for offset_m in self._met(check, component, offsets_m, other, boxes, way_m, meets):
            check.look(False, f"{component.id}: meets {self._ids[other]} deeper than it may, at {_metres(offset_m)}")
        check.measure(float(np.abs(way_m).sum()) + tolerance_m)

    def check_apart(self, check: Check, component: Component, offsets_m: NDArray[np.float64], other: int) -> None:
        """Check that a part does not touch another solid at all along straight pieces between positions.

        For solids that it does not touch in the finished building: true surfaces, without tolerance. The part starts
        free, so surfaces cross when it enters another. The positions are as for ``check_way``; the first is free.
        """
        low, high = self._boxes[component.index]
        other_low, other_high = self._boxes[other]
        if (low + offsets_m.min(axis=0) > other_high).any() or (high + offsets_m.max(axis=0) < other_low).any():
            return
        boxes, crosses = (self._boxes[component.index], self._boxes[other]), self._crosses(component.index, other)
        for offset_m in self._met(check, component, offsets_m, other, boxes, np.zeros(3), crosses):
            check.look(False, f"{component.id}: meets {self._ids[other]}, which it passes by, at {_metres(offset_m)}")

    def check_guided(self, check: Check, component: Component, guide: Guide, other: int, *, is_near: bool) -> None:
        """Check that a guided part overlaps a neighbour by no more than allowed, and does not touch anything else.

        Its poses are as finely spaced as the positions of ``check_way``: no point of it moves further between two.
        """
        if self._guided is None or self._guided[0] is not component or self._guided[1] is not guide:
            self._guided = component, guide, swept_box_m(component.mesh.vertices_m, guide)  # for all around it
        (low, high), (other_low, other_high) = self._guided[2], self._boxes[other]
        way_m = self._way_out_m(check, component.index, other) if is_near else np.zeros(3)
        if way_m is None:
            check.look(False, f"{component.id}: is guided to its place, but nothing parts it from {self._ids[other]}")
            return
        if (low + np.minimum(way_m, 0.0) > other_high).any() or (high + np.maximum(way_m, 0.0) < other_low).any():
            check.look(True, "")
            return
        poses = _poses_along(guide, component.mesh, self._spacing_m(component.index, other))
        tolerance_m = self._site.rules.contact_tolerance_m
        part, solid = (solid_of(self._meshes[n], tolerance_m) for n in (component.index, other))
        by_skins = is_near and max(part.thickness_m, solid.thickness_m) >= _SHEET_M
        bears = (part.thickness_m, -component.index) > (solid.thickness_m, -other)
        centre_m, up = np.array(guide.centre_m), np.array([0.0, 0.0, 1.0])
        boxes_m = boxes_along(guide, component.mesh, poses) + way_m
        close = ((boxes_m[:, 0] <= other_high + _ROUNDING_M) & (boxes_m[:, 1] >= other_low - _ROUNDING_M)).all(axis=1)
        check.look(True, "", samples=int((~close).sum()))
        poses = poses[close]
        for tilt_rad in dict.fromkeys(poses[:, 2].tolist()):
            rows, turn = poses[poses[:, 2] == tilt_rad], guide.turns(np.array([tilt_rad]))[0]
            moved_m = centre_m - turn @ centre_m + rows[:, :1] * up + rows[:, 1:2] * guide.ahead + way_m
            if by_skins:
                leaning = self._turned(component, part, turn)
                points_m = overlaps_m(leaning, solid, -moved_m) if bears else overlaps_m(solid, leaning, moved_m)
                met = ~np.isnan(points_m[:, 0])
            else:
                met = self._crosses(component.index, other, turn)(moved_m)
            check.look(True, "", samples=int((~met).sum()))
            for height_m in rows[met, 0].tolist():
                check.look(
                    False, f"{component.id}: guided to its place, meets {self._ids[other]}, {height_m:.2f} m above it"
                )

    def _turned(self, component: Component, part: Solid, turn: NDArray[np.float64]) -> Solid:
        """Return a part turned; the same one for all solids around it."""
        if self._leaning[0] != component.index:
            self._leaning = component.index, {}
        known = self._leaning[1]
        key = turn.tobytes()
        if key not in known:
            known[key] = _turned_solid(part, turn)
        return known[key]

    def _too_deep(
        self, moving: int, fixed: int, tolerance_m: float
    ) -> tuple[tuple[NDArray[np.float64], NDArray[np.float64]], Callable[[NDArray[np.float64]], NDArray[np.bool_]]]:
        """Return boxes around what must not meet of two solids, and a test of whether it does, for positions of one."""
        part, other = (solid_of(self._meshes[n], tolerance_m) for n in (moving, fixed))
        if max(part.thickness_m, other.thickness_m) < _SHEET_M:
            return (self._boxes[moving], self._boxes[fixed]), self._crosses(moving, fixed)
        # If both parts are equally thick, the one with the lower number counts as the thicker one.
        bears = (part.thickness_m, -moving) > (other.thickness_m, -fixed)

        def overlaps(moved_m: NDArray[np.float64]) -> NDArray[np.bool_]:
            points_m = overlaps_m(part, other, -moved_m) if bears else overlaps_m(other, part, moved_m)
            return ~np.isnan(points_m[:, 0])

        return ((part.core_m, self._boxes[fixed]) if bears else (self._boxes[moving], other.core_m)), overlaps

    def _met(
        self,
        check: Check,
        component: Component,
        offsets_m: NDArray[np.float64],
        other: int,
        boxes_m: tuple[NDArray[np.float64], NDArray[np.float64]],
        aside_m: NDArray[np.float64],
        meets: Callable[[NDArray[np.float64]], NDArray[np.bool_]],
    ) -> NDArray[np.float64]:
        """Return the offsets, finely spaced, at which a part hits another; the others count as passed.

        ``check``: receives the count; ``offsets_m``: (N, 3) where it is, relative to its place in the building;
        ``other``: number of the other solid; ``boxes_m``: (2, 3) each, boxes around what may collide: if they are
        apart, nothing collides; ``aside_m``: (3,) additional displacement of the part; ``meets``: which offsets ((N, 3)
        metres) move the part so that it hits the other.
        """
        fine_m = _finely(offsets_m, self._spacing_m(component.index, other))
        low, high = self._boxes[component.index]
        other_low, other_high = self._boxes[other]
        apart = (low + fine_m > other_high) | (high + fine_m < other_low)
        (low, high), (other_low, other_high) = boxes_m
        moved_m = fine_m + aside_m
        apart |= (low + moved_m > other_high + _ROUNDING_M) | (high + moved_m < other_low - _ROUNDING_M)
        close = np.flatnonzero(~apart.any(axis=1))
        met = fine_m[close[meets(moved_m[close])]]
        check.look(True, "", samples=len(fine_m) - len(met))
        return met

    def _crosses(
        self, moving: int, fixed: int, turn: NDArray[np.float64] = _LEVEL
    ) -> Callable[[NDArray[np.float64]], NDArray[np.bool_]]:
        """Return a test of whether the true surfaces of two solids cross or touch, for positions of the first."""

        def crosses(offsets_m: NDArray[np.float64]) -> NDArray[np.bool_]:
            part, result = self._moved(moving), np.zeros(len(offsets_m), np.bool_)
            for n, offset_m in enumerate(offsets_m):
                part.setTransform(fcl.Transform(turn, offset_m))
                result[n] = fcl.collide(part, self._fixed(fixed))
            return result

        return crosses

    def rope_is_clear(self, component: Component, offset_m: NDArray[np.float64], other: int) -> bool:
        """Return whether a rope above the part's hook line misses another solid's triangles."""
        frame = self._site.frame
        foot = np.array(component.target_vox) + np.array(component.hook_line_vox) + np.array([0.5, 0.5, 0.0])
        foot_m = np.array(frame.origin_m) + frame.voxel_size_m * foot + offset_m
        low, high = self._boxes[other]
        if (foot_m[:2] - _ROPE_M > high[:2]).any() or (foot_m[:2] + _ROPE_M < low[:2]).any():
            return True
        foot_m[2] += _UNDER_ROPE_M
        top_m = max(high[2], foot_m[2]) + 1.0
        rope = fcl.CollisionObject(fcl.Box(_ROPE_M, _ROPE_M, top_m - foot_m[2]))
        rope.setTranslation(np.array([foot_m[0], foot_m[1], (foot_m[2] + top_m) / 2]))
        return not fcl.collide(rope, self._fixed(other))

    def carried_by(self, component: Component) -> tuple[int, ...]:
        """Return the components that a part rests on in the finished building: it hits them if it sinks by the gap.

        The part is narrowed in plan, so parts next to it do not count. It sinks by so little that only triangles at its
        bottom and at the top of the other can meet.
        """
        if component.index not in self._carried:
            self._carried[component.index] = self._carriers(component)
        return self._carried[component.index]

    def _carriers(self, component: Component) -> tuple[int, ...]:
        rules = self._site.rules
        low, high = self._boxes[component.index]
        tolerance_m = min(rules.contact_tolerance_m, 0.2 * float((high - low)[:2].min()))
        centre = (low + high) / 2
        scale = np.ones(3)
        scale[:2] = 1.0 - 2.0 * tolerance_m / np.maximum((high - low)[:2], 1e-9)  # a sheet has no thickness
        bottom: fcl.CollisionObject | None = None
        found = []
        lows, highs = self._bounds[: len(self._site.components), 0], self._bounds[: len(self._site.components), 1]
        over = ((lows[:, :2] < high[:2]) & (highs[:, :2] > low[:2])).all(axis=1)
        top = highs[:, 2]
        close = (top <= low[2] + rules.contact_tolerance_m) & (top >= low[2] - rules.support_gap_m)
        for other in np.flatnonzero(over & close).tolist():
            other_high = self._boxes[other][1]
            if other == component.index:
                continue
            if bottom is None:
                narrow = TriangleMesh((component.mesh.vertices_m - centre) * scale + centre, component.mesh.faces)
                bottom = _object_between(narrow, -np.inf, low[2] + _SUNK_M)
            if other not in self._tops:
                self._tops[other] = _object_between(self._meshes[other], other_high[2] - _SUNK_M, np.inf)
            bottom.setTranslation(np.array([0.0, 0.0, other_high[2] - low[2] - _SUNK_M]))
            if fcl.collide(bottom, self._tops[other]):
                found.append(other)
        return tuple(found)

    def _way_out_m(self, check: Check, moving: int, fixed: int) -> NDArray[np.float64] | None:
        """Return the checked way out of a listed clash; zeros for any other pair, None if no way out works."""
        if (moving, fixed) in self._listed:
            pair, sign = (moving, fixed), 1.0
        elif (fixed, moving) in self._listed:
            pair, sign = (fixed, moving), -1.0
        else:
            return np.zeros(3)
        check.look(
            self._is_measured(*pair),
            f"{self._ids[pair[0]]} and {self._ids[pair[1]]}: listed as drawn into each other deeper than they are",
        )
        way_m = self._listed[pair].way_out_m
        return None if way_m is None else np.array(way_m) * sign

    def check_clashes(self, check: Check) -> None:
        """Check that every listed clash is drawn, and as deep as it is listed."""
        for first, second in self._listed:
            check.about = self._ids[first] if first < len(self._site.components) else None
            self._way_out_m(check, first, second)
        check.about = None

    def refuted_clashes(self) -> tuple[ModelledClash, ...]:
        """Return the listed clashes that are not drawn as deep as they are listed."""
        return tuple(clash for pair, clash in self._listed.items() if not self._is_measured(*pair))

    def _is_measured(self, first: int, second: int) -> bool:
        """Return what ``_is_as_deep`` finds of a pair, once."""
        if (first, second) not in self._measured:
            self._measured[first, second] = self._is_as_deep(first, second)
        return self._measured[first, second]

    def _is_as_deep(self, first: int, second: int) -> bool:
        """Return whether two solids overlap as deep as their clash is listed, by the proof's own measure.

        They must overlap, not merely touch, and just short of the listed way out they must still collide. If none is
        listed, there must be none: no short move along an axis takes even their boxes apart.
        """
        clash = self._listed[first, second]
        way_m, depth_m = None if clash.way_out_m is None else np.array(clash.way_out_m), clash.depth_m
        crosses = self._crosses(first, second)
        if way_m is not None:
            length_m = float(np.abs(way_m).sum())
            straight = np.count_nonzero(way_m) == 1 and length_m >= depth_m - _ROUNDING_M
            if not (straight and length_m < np.inf):
                return False
            short_m = length_m + np.array([0.0, -0.5, -1.0, -1.5, -2.0]) * _MEASURED_M
            return bool(crosses(np.maximum(short_m, 0.0)[:, None] * way_m / length_m).any()) and self._overlaps(
                first, second
            )
        (low, high), (other_low, other_high) = self._boxes[first], self._boxes[second]
        apart_m = float(np.minimum(high - other_low, other_high - low).min())
        return 0.0 < depth_m <= apart_m and apart_m >= _INTERLOCKED_M and self._overlaps(first, second)

    def _overlaps(self, first: int, second: int) -> bool:
        """Return whether two solids do not merely touch.

        One reaches deeper into the other than the thinnest skin, or no change as small as that parts their surfaces: a
        move to any side or corner, or the one or the other made smaller.
        """
        moves_m = (np.argwhere(np.ones((3, 3, 3))).astype(np.float64) - 1.0) * FINEST_M
        if self._crosses(first, second)(moves_m).all() and all(
            self._crosses_smaller(one, other) for one, other in ((first, second), (second, first))
        ):
            return True
        return bool(self._too_deep(first, second, FINEST_M)[1](np.zeros((1, 3)))[0])

    def _crosses_smaller(self, smaller: int, other: int) -> bool:
        """Return whether the surfaces of two solids cross or touch, the first one made smaller."""
        near = _near(_smaller(self._meshes[smaller]), *self._boxes[other])
        return near is not None and bool(fcl.collide(fcl.CollisionObject(shape_of(near)), self._fixed(other)))

    def _check_no_fuller(self, check: Check, component: Component, offsets_m: NDArray[np.float64], other: int) -> None:
        """Check, if no depth works, that the pair never shares more cells than in the finished building.

        Between two placements, the part is checked at both.
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

    def _cells(self, number: int) -> NDArray[np.int32]:
        """Return (N, 3) cells of a solid at its place."""
        components = self._site.components
        if number >= len(components):
            return self._structure_cells[number - len(components)]
        component = components[number]
        return component.shape.cells + np.array(component.target_vox, np.int32)

    def _spacing_m(self, first: int, second: int) -> float:
        """Return a spacing so fine that the thinner of the two cannot slip through between two samples."""
        thickness = min(float((b[1] - b[0]).min()) for b in (self._boxes[first], self._boxes[second]))
        return float(np.clip(thickness / 2, 0.002, _SPACING_M))

    def _moved(self, number: int) -> fcl.CollisionObject:
        """Return a movable copy of a solid (``_fixed`` ones stay in place)."""
        return self._object(True, number)

    def _fixed(self, number: int) -> fcl.CollisionObject:
        return self._object(False, number)

    def _object(self, moving: bool, number: int) -> fcl.CollisionObject:
        key = (moving, number)
        if key not in self._objects:
            self._objects[key] = fcl.CollisionObject(shape_of(self._meshes[number]))
        return self._objects[key]


@kept
def shape_of(mesh: TriangleMesh) -> fcl.BVHModel:
    """Return a mesh as a shape of FCL, which any number of its objects share."""
    shape = fcl.BVHModel()
    shape.beginModel(len(mesh.faces), len(mesh.vertices_m))
    shape.addSubModel(mesh.vertices_m, mesh.faces)
    shape.endModel()
    return shape


def _near(mesh: TriangleMesh, low_m: NDArray[np.float64], high_m: NDArray[np.float64]) -> TriangleMesh | None:
    """Return the triangles of a mesh whose boxes are not apart from another box; None if all are."""
    inside = np.ones(len(mesh.faces), np.bool_)
    for at_m, low, high in zip(mesh.vertices_m.T, low_m.tolist(), high_m.tolist(), strict=True):
        inside &= _reach_into(at_m[mesh.faces], low, high)
    return TriangleMesh(mesh.vertices_m, mesh.faces[inside]) if inside.any() else None


def _reach_into(corners_m: NDArray[np.float64], low_m: float, high_m: float) -> NDArray[np.bool_]:
    """Return which triangles, by (F, 3) one coordinate of their corners, reach into a range."""
    one, two, three = corners_m.T
    lowest, highest = np.minimum(np.minimum(one, two), three), np.maximum(np.maximum(one, two), three)
    result: NDArray[np.bool_] = (lowest <= high_m + _ROUNDING_M) & (highest >= low_m - _ROUNDING_M)
    return result


def _object_between(mesh: TriangleMesh, low_m: float, high_m: float) -> fcl.CollisionObject:
    """Return the triangles of a mesh that reach into a range of heights; all if none do, as FCL needs at least one."""
    inside = _reach_into(mesh.vertices_m[:, 2][mesh.faces], low_m, high_m)
    triangles = mesh.vertices_m[mesh.faces[inside] if inside.any() else mesh.faces]
    return fcl.CollisionObject(
        shape_of(TriangleMesh(triangles.reshape(-1, 3), np.arange(triangles.size // 3, dtype=np.int32).reshape(-1, 3)))
    )


@kept
def _smaller(mesh: TriangleMesh) -> TriangleMesh:
    """Return a mesh scaled about the middle of its box, so that each of its sides moves in a little."""
    low, high = mesh.bounds_m
    middle, half = (low + high) / 2.0, (high - low) / 2.0
    scale = 1.0 - FINEST_M / np.maximum(half, 2.0 * FINEST_M)
    return TriangleMesh(middle + (mesh.vertices_m - middle) * scale, mesh.faces)


@kept
def _bounds_m(mesh: TriangleMesh) -> NDArray[np.float64]:
    return mesh.bounds_m


@kernel
def _finely(points_m: NDArray[np.float64], spacing_m: float) -> NDArray[np.float64]:
    """Return (M, 3) the points, and more between them, so that neighbours are at most ``spacing_m`` apart."""
    count = points_m.shape[0]
    parts, total = np.empty(count, np.int64), 0
    for n in range(count):
        squared = 0.0
        for k in range(3 if n + 1 < count else 0):
            squared += (points_m[n + 1, k] - points_m[n, k]) ** 2
        parts[n] = max(1, int(np.ceil(np.sqrt(squared) / spacing_m - 1e-9)))
        total += parts[n]
    fine = np.empty((total, 3))
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
