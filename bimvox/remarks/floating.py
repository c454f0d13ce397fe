"""Parts that float or hang: nothing that stands on the ground or the structure touches them, or is under them."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from bimvox.bim.building import TriangleMesh
from bimvox.kept import kept
from bimvox.proof.bodies.solid import Solid
from bimvox.proof.bodies.solid_queries import is_inside, surfaces_cross
from bimvox.proof.bodies.triangle_tree import tree_over
from bimvox.records.remark import Remark, Severity
from bimvox.remarks.subject import Subject, about, metres
from bimvox.site.ground import stand_on_ground

FLOATS = "floats"
HANGS = "hangs"
UNHELD = "unheld"

NEAR_M = 0.05
"""Parts closer than this touch: bearings and grout joints are 10 to 50 mm high (professional judgement). A larger
``support_gap_m`` of the site counts instead."""

_MANY = 10
"""More parts that float together are a building without foundations, which is one remark."""
_NARROWED_M = 0.015
"""A part is narrowed by this much on each side before what is under it is looked for: what is next to it is not."""
_SUNK_M = 0.002


def floating(subject: Subject) -> Iterator[Remark]:
    """Yield a remark about every part that floats, hangs on its sides only, or is set before what holds it."""
    lifted = {component.index for component in subject.lifted}
    neighbours = _Neighbours(subject)
    groups = neighbours.floating_groups()
    for group in groups:
        if len(group) > _MANY:
            foot = metres(min(float(subject.in_place[number].mesh.bounds_m[0, 2]) for number in group))
            said = f"{len(group):,} parts float {foot} above the ground and touch only each other: "
            said += "foundations are missing in the model, or [model] ground_m is too low"
            yield Remark(FLOATS, Severity.SERIOUS, said)
        for number in group if len(group) <= _MANY else ():
            component = subject.in_place[number]
            if component.index not in lifted:
                continue
            foot = metres(float(component.mesh.bounds_m[0, 2]))
            others = len(group) - 1
            if not others:
                said = f"floats {foot} above the ground: nothing is under it or next to it"
            else:
                more = "another part that floats" if others == 1 else f"{others:,} other parts that float"
                said = f"floats {foot} above the ground: it touches only {more}"
            yield about(component, FLOATS, Severity.SERIOUS, said)
    floats = {subject.in_place[number].id for group in groups for number in group}
    for number, component in enumerate(subject.in_place):
        if component.index in lifted and component.id not in floats and not neighbours.rests(number):
            said = "hangs: nothing is under it, it is held only by what it touches at its sides"
            yield about(component, HANGS, Severity.MINOR, said)
    unheld = set(subject.plan.unheld) - floats
    for number, component in enumerate(subject.in_place):
        if component.index in lifted and component.id in unheld and not neighbours.on_ground[number]:
            yield about(component, UNHELD, Severity.SERIOUS, "is set before any part that could hold it")


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
        columns, parts = site.shape[:2], list(subject.in_place)
        self.on_ground = np.array(stand_on_ground(site.frame, columns, site.natural_ground_m, parts, gap_m), np.bool_)
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
