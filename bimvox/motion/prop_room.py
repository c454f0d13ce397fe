"""What is in the way of a prop while it stands, and what it can stand on: parts, structure, loads, other props."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import pairwise
from math import ceil, pi

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import kernel
from bimvox.motion.prop_times import NEVER_NS, Timeline
from bimvox.planning.contact.pairs import Collider, ball, collide, collision_object, crossings_above, tube
from bimvox.records.lift import Lift
from bimvox.records.props import Prop
from bimvox.site.component import Component
from bimvox.site.means import Means
from bimvox.site.site import Site

_Floats = NDArray[np.float64]

_HALF_M = 0.07
"""Half a prop with its fixings."""
_ENDS_M = 0.3
"""So far from its ends a prop may be near what it is fixed to."""
_APART_M = 0.2
"""Between two props."""
_STEP_M = 0.1
_EDGE_M = 0.15
"""A foot stands where the floor is whole and level this far around it: anchors, and no edge."""
_LEVEL_M = 0.03
_JOINT_M = (0.031, 0.022, 0.0)
"""What is missing only so far aside is a joint, not an opening."""
DOWN = np.array([0.0, 0.0, -1.0])
"""A direction."""


class Room:
    """What is on a site while its parts are set, for the places of props.

    Args:
        site: The site.
        lifts: Its lifts.
        times: When what is where.
    """

    def __init__(self, site: Site, lifts: Iterable[Lift], times: Timeline) -> None:
        self._site = site
        fixed = [blocker.mesh for blocker in site.blockers if blocker.mesh is not None]
        self._meshes = [*(part.mesh for part in site.components), *fixed]
        self.bounds_m = np.array([mesh.bounds_m for mesh in self._meshes]).reshape(-1, 2, 3)
        self._since_ns = np.array([*times.there_ns, *([-NEVER_NS] * len(fixed))], np.int64)
        waits = [part.means in (Means.BUILT, Means.BY_HAND) for part in site.components]
        self._waits = np.array([*waits, *([False] * len(fixed))], np.bool_)
        self._solid = np.zeros(site.shape, np.bool_)
        for blocker in site.blockers:
            if blocker.kind in ("crane", "obstruction"):
                self._solid[tuple(blocker.cells.T)] = True
        self._loads = _Loads(site, lifts, times.in_air_ns)
        self._props: list[_Floats] = []
        self._prop_boxes, self._prop_spans = np.zeros((0, 2, 3)), np.zeros((0, 2), np.int64)
        self._triangles: dict[int, _Floats] = {}
        self._bodies: dict[int, Collider] = {}

    def add(self, props: Sequence[Prop], span_ns: tuple[int, int]) -> None:
        """Add props that stand for a time."""
        points = [_points(np.array(one.head_m), np.array(one.foot_m)) for one in props]
        self._props += points
        boxes = np.array([[one.min(axis=0), one.max(axis=0)] for one in points])
        self._prop_boxes = np.concatenate([self._prop_boxes, boxes])
        self._prop_spans = np.concatenate([self._prop_spans, np.array([span_ns] * len(props), np.int64)])

    def foot_below(self, point_m: _Floats, low_m: float, at_ns: int) -> tuple[float, bool] | None:
        """Return the height of a place for a foot straight below a point at a time, and whether it is on the ground.

        None if there is no level and whole floor above a level, or the place is beside the site, in the yard or on the
        access.
        """
        i, j, _ = self._site.frame.cell_of(point_m)
        x, y, _ = self._site.shape
        access = self._site.access
        if not (0 <= i < x and 0 <= j < y) or self._site.yard[i, j] or (access is not None and access[i, j]):
            return None
        points = point_m + _RING
        heights_m = self._below(points, low_m, at_ns)
        if not np.isfinite(heights_m[0]):
            return None
        missing = ~(np.abs(heights_m - heights_m[0]) <= _LEVEL_M)
        if missing.any():
            heights_m[missing] = self._below(points[missing] + _JOINT_M, low_m, at_ns)
        if not (np.abs(heights_m - heights_m[0]) <= _LEVEL_M).all():
            return None
        return float(heights_m[0]), bool(
            heights_m[0] <= np.nan_to_num(self._ground_m(points[:1]), nan=-np.inf)[0] + 1e-9
        )

    def past_m(self, part: Component, prop: Prop, span_ns: tuple[int, int], most_m: float) -> float:
        """Return how far loads pass from a prop of a part while it stands, up to a distance."""
        return self._loads.clearance_m(
            part.index, _points(np.array(prop.head_m), np.array(prop.foot_m)), span_ns, most_m
        )

    def clearance_m(
        self, part: Component, head_m: _Floats, foot_m: _Floats, span_ns: tuple[int, int], most_m: float
    ) -> float:
        """Return how far loads pass from a prop of a part while it stands, up to a distance; 0 if it has no room."""
        points = _points(head_m, foot_m)
        cells = self._site.frame.cell_of(points)
        if (cells < 0).any() or (cells >= self._site.shape).any() or self._solid[tuple(cells.T)].any():
            return 0.0
        low, high = points.min(axis=0) - _HALF_M, points.max(axis=0) + _HALF_M
        near = (self._prop_boxes[:, 0] <= high + _APART_M).all(axis=1)
        near &= (self._prop_boxes[:, 1] >= low - _APART_M).all(axis=1)
        near &= (self._prop_spans[:, 0] < span_ns[1]) & (self._prop_spans[:, 1] > span_ns[0])
        if any(_least_m(points, self._props[n]) < _APART_M for n in np.flatnonzero(near).tolist()):
            return 0.0
        meets = (self.bounds_m[:, 0] <= high).all(axis=1) & (self.bounds_m[:, 1] >= low).all(axis=1)
        meets &= (self._since_ns < span_ns[1]) & ~(self._waits & (self._since_ns > span_ns[0]))
        if any(self._in_the_way(part, head_m, foot_m, np.flatnonzero(meets))):
            return 0.0
        return self._loads.clearance_m(part.index, points, span_ns, most_m)

    def holding_up(self, part: Component, props: Iterable[Prop], span_ns: tuple[int, int]) -> tuple[int, ...]:
        """Return the components that trades build, or people set, where props of a part stand: they wait for them."""
        later = self._waits & (self._since_ns > span_ns[0]) & (self._since_ns < span_ns[1])
        numbers = np.flatnonzero(later)
        ends = ((np.array(one.head_m), np.array(one.foot_m)) for one in props)
        return tuple(sorted({n for head_m, foot_m in ends for n in self._in_the_way(part, head_m, foot_m, numbers)}))

    def _in_the_way(
        self, part: Component, head_m: _Floats, foot_m: _Floats, numbers: NDArray[np.int64]
    ) -> Iterator[int]:
        """Yield those of some parts and structures that are within half a prop of it."""
        along = (foot_m - head_m) / float(np.linalg.norm(foot_m - head_m))
        whole = tube(_HALF_M, head_m + (0.1 + _HALF_M) * along, foot_m - _ENDS_M * along)
        off_head = tube(_HALF_M, head_m + _ENDS_M * along, foot_m - _ENDS_M * along)
        plate = ball(_HALF_M, foot_m + np.array([0.0, 0.0, _HALF_M + 0.04]))
        for n in numbers.tolist():
            meets = collide(off_head if n == part.index else whole, self._body(n)) or collide(plate, self._body(n))
            if meets or crossings_above(self._of(n), (head_m + foot_m) / 2.0) % 2:  # or all of it is inside
                yield n

    def _below(self, points_m: _Floats, low_m: float, at_ns: int) -> _Floats:
        """Return the height of what is below (N, 3) points at a time, down to a level; NaN where there is nothing."""
        low, high = points_m.min(axis=0), points_m.max(axis=0)
        there = self._since_ns <= at_ns
        there &= (self.bounds_m[:, 0] <= high).all(axis=1) & (self.bounds_m[:, 1, :2] >= low[:2]).all(axis=1)
        there &= self.bounds_m[:, 1, 2] >= low_m
        heights = self._ground_m(points_m)
        for n in np.flatnonzero(there).tolist():
            heights = np.fmax(heights, points_m[:, 2] - first_hit(self._of(n), points_m, DOWN))
        heights[heights < low_m] = np.nan
        return heights

    def _ground_m(self, points_m: _Floats) -> _Floats:
        frame, (x, y, _) = self._site.frame, self._site.shape
        i, j = frame.cell_of(points_m)[:, :2].T
        inside = (i >= 0) & (i < x) & (j >= 0) & (j < y)
        heights = np.full(len(points_m), np.nan)
        tops = self._site.ground_vox[i[inside], j[inside]] + 1.0
        heights[inside] = frame.origin_m[2] + frame.voxel_size_m * tops
        heights[heights > points_m[:, 2]] = np.nan
        return heights

    def _of(self, n: int) -> _Floats:
        if n not in self._triangles:
            self._triangles[n] = self._meshes[n].triangles_m
        return self._triangles[n]

    def _body(self, n: int) -> Collider:
        if n not in self._bodies:
            self._bodies[n] = collision_object(self._of(n))
        return self._bodies[n]


class _Loads:
    """Where loads pass, and when.

    Args:
        site: The site.
        lifts: Its lifts.
        in_air_ns: From when and until when each component hangs above the site, by index.
    """

    def __init__(self, site: Site, lifts: Iterable[Lift], in_air_ns: Mapping[int, tuple[int, int]]) -> None:
        self._site = site
        boxes, owners, exact, spans = list[_Floats](), list[int](), list[bool](), list[tuple[int, int]]()
        for lift in lifts:
            if lift.component in in_air_ns and lift.path_vox is not None:
                for low, high, is_exact in _swept(site.components[lift.component], lift):
                    boxes.append(np.stack([low, high]))
                    owners.append(lift.component)
                    exact.append(is_exact)
                    spans.append(in_air_ns[lift.component])
        self._boxes = site.frame.corner_of(np.array(boxes).reshape(-1, 2, 3))
        self._owner, self._exact = np.array(owners, np.int64), np.array(exact, np.bool_)
        self._spans = np.array(spans, np.int64).reshape(-1, 2)

    def clearance_m(self, own: int, points_m: _Floats, span_ns: tuple[int, int], most_m: float) -> float:
        """Return the least distance of all loads but the part's own from points during a time, up to a distance."""
        low, high = points_m.min(axis=0) - most_m, points_m.max(axis=0) + most_m
        meets = (self._boxes[:, 0] < high).all(axis=1) & (self._boxes[:, 1] > low).all(axis=1)
        meets &= (self._owner != own) & (self._spans[:, 0] < span_ns[1]) & (self._spans[:, 1] > span_ns[0])
        least_m = max(most_m, 1e-6)
        for n in np.flatnonzero(meets).tolist():
            lows, highs = self._boxes[n, :1], self._boxes[n, 1:]
            if self._exact[n]:  # the boxes of its shape, no larger than the part: cells are up to one larger
                part, size_m = self._site.components[self._owner[n]], self._site.frame.voxel_size_m
                box_m = self._site.frame.corner_of([part.target_vox, np.add(part.target_vox, part.shape.size_vox)])
                inset_m = np.maximum(np.abs(part.mesh.bounds_m - box_m), 0.0)
                low_m, high_m = lows + inset_m[0], highs - inset_m[1]
                lows = np.maximum(lows + size_m * part.shape.boxes[:, :3], low_m)
                highs = np.minimum(highs - size_m * (np.array(part.shape.size_vox) - part.shape.boxes[:, 3:]), high_m)
            off = np.maximum(np.maximum(lows - points_m[:, None], points_m[:, None] - highs), 0.0)
            least_m = min(least_m, float(np.sqrt((off**2).sum(axis=2)).min()))
        return least_m


def _swept(part: Component, lift: Lift) -> Iterator[tuple[_Floats, _Floats, bool]]:
    """Yield boxes in cells around what a load sweeps, one a straight run of its path; and whether it does not turn."""
    path, size = np.asarray(lift.path_vox, np.float64), np.array(part.shape.size_vox, np.float64)
    runs = np.diff(path, axis=0)
    ends = np.flatnonzero((np.diff(runs, axis=0) != 0).any(axis=1)) + 1
    corners = [0, *ends.tolist(), len(path) - 1]
    hook = np.array(part.hook_line_vox[:2]) + 0.5
    reach = float(np.hypot(*np.maximum(hook, size[:2] - hook)))
    for first, last in pairwise(corners):
        low, high = np.minimum(path[first], path[last]), np.maximum(path[first], path[last])
        is_last = last == corners[-1] and path[first][2] >= path[last][2] and (path[first] == path[last])[:2].all()
        if lift.with_jib and not is_last:
            yield low + np.array([*(hook - reach), 0.0]), high + np.array([*(hook + reach), size[2]]), False
        elif lift.guide is not None and is_last:
            around = np.array([2.0, 2.0, 0.0]) + 0.2 * reach
            yield low - around, high + size + around, False
        else:
            yield low, high + size, True


def _points(head_m: _Floats, foot_m: _Floats) -> _Floats:
    """Return points along a prop, from its head to its foot."""
    count = max(2, ceil(float(np.linalg.norm(head_m - foot_m)) / _STEP_M) + 1)
    points: _Floats = head_m + np.linspace(0.0, 1.0, count)[:, None] * (foot_m - head_m)
    return points


def _least_m(points_m: _Floats, others_m: _Floats) -> float:
    return float(np.linalg.norm(points_m[:, None] - others_m[None], axis=2).min())


def _ring() -> _Floats:
    """Return (9, 3) offsets: a point and eight around it."""
    turns = np.arange(8) * pi / 4.0
    ring = _EDGE_M * np.column_stack([np.cos(turns), np.sin(turns), np.zeros(8)])
    return np.concatenate([np.zeros((1, 3)), ring])


_RING = _ring()


def first_hit(triangles_m: _Floats, points_m: _Floats, direction: _Floats) -> _Floats:
    """Return how far it is from (N, 3) points to the first of (F, 3, 3) triangles in a direction; inf if none is."""
    far = np.full(len(points_m), np.inf)
    first_hits(triangles_m, points_m, direction, far)
    return far


@kernel
def first_hits(
    triangles: NDArray[np.float64],
    points: NDArray[np.float64],
    direction: NDArray[np.float64],
    far: NDArray[np.float64],
) -> None:
    """Set the distance from each point to the first triangle in a direction (Moeller and Trumbore 1997)."""
    dx, dy, dz = direction
    for f in range(triangles.shape[0]):
        ax, ay, az = triangles[f, 0]
        ux, uy, uz = triangles[f, 1, 0] - ax, triangles[f, 1, 1] - ay, triangles[f, 1, 2] - az
        vx, vy, vz = triangles[f, 2, 0] - ax, triangles[f, 2, 1] - ay, triangles[f, 2, 2] - az
        px, py, pz = dy * vz - dz * vy, dz * vx - dx * vz, dx * vy - dy * vx
        det = ux * px + uy * py + uz * pz
        if abs(det) < 1e-12:
            continue
        for n in range(points.shape[0]):
            tx, ty, tz = points[n, 0] - ax, points[n, 1] - ay, points[n, 2] - az
            a = (tx * px + ty * py + tz * pz) / det
            if a < -1e-9 or a > 1.0 + 1e-9:
                continue
            qx, qy, qz = ty * uz - tz * uy, tz * ux - tx * uz, tx * uy - ty * ux
            b = (dx * qx + dy * qy + dz * qz) / det
            if b < -1e-9 or a + b > 1.0 + 1e-9:
                continue
            t = (vx * qx + vy * qy + vz * qz) / det
            if 0.0 <= t < far[n]:
                far[n] = t
