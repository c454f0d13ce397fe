"""Beams of steel that are drawn to the axes of the columns and beams that they join: taken as cut at their faces.

Models for analysis and of early design are drawn so. Such beams run into each other at every joint, and none of them
could be set; the workshop makes them as much shorter.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bimvox.bim.building import BUILT, Building, Element, TriangleMesh, plain_class
from bimvox.bim.kinds.kind import Kind

_CUT = ("IfcBeam", "IfcMember")
_JOINED = (*_CUT, "IfcColumn")
_GAP_M = 0.005
"""Clearance that is left at each end, for the erection."""
_INSIDE_M = 1e-3
_MOST_SHARE, _MOST_M = 0.25, 1.0
"""A beam that would lose more than this at one end is drawn into something else than a joint."""
_RAYS = 7
"""Points across the face of an end, of which each is moved inward until it is clear."""
_ALONG = 0.7
"""Cosine from which two bars run along each other; these have no joint."""


@dataclass(frozen=True, slots=True, eq=False)
class _Bar:
    """A bar: its box along its own axis.

    Attributes:
        axes: (3, 3) unit vectors: along it, and across it; rows.
        low_m: (3,) lowest corner of its box in these axes.
        high_m: (3,) highest corner.
        section_m2: Mean area of its section.
    """

    element: Element
    axes: NDArray[np.float64]
    low_m: NDArray[np.float64]
    high_m: NDArray[np.float64]
    section_m2: float

    @property
    def length_m(self) -> float:
        return float(self.high_m[0] - self.low_m[0])

    def face_m(self, middle_m: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return points all over the face of an end."""
        half = (self.high_m - self.low_m)[1:] / 2.0 - _INSIDE_M
        shares = np.linspace(-1.0, 1.0, _RAYS)
        across = np.stack(np.meshgrid(shares * half[0], shares * half[1]), axis=-1).reshape(-1, 2)
        return middle_m + across @ self.axes[1:]

    def ends_m(self) -> Iterator[tuple[int, NDArray[np.float64]]]:
        """Yield the side of each end, -1 or 1, and the middle of its face."""
        middle = (self.low_m + self.high_m) / 2.0
        for side, at in ((-1, self.low_m[0]), (1, self.high_m[0])):
            yield side, np.array([at, middle[1], middle[2]]) @ self.axes


def cut_back(building: Building) -> Building:
    """Return a building in which beams of steel end at the faces of what they are drawn into, with a note."""
    numbers = [
        n
        for n, element in enumerate(building.elements)
        if element.role in BUILT and element.judgement.kind is Kind.STEEL and plain_class(element.ifc_class) in _JOINED
    ]
    bars = {n: bar for n in numbers if (bar := _bar(building.elements[n])) is not None}
    joints = _Joints(bars)
    shorter = {n: mesh for n in bars if (mesh := joints.cut(n)) is not None}
    if not shorter:
        return building
    parts, ends = ("beam of steel is", "its ends") if len(shorter) == 1 else ("beams of steel are", "their ends")
    said = f"{len(shorter)} {parts} drawn into what joins {ends}, so taken as cut at the faces:"
    return building.with_meshes(shorter, said)


class _Joints:
    """The bars of a building, to be asked what an end is drawn into."""

    def __init__(self, bars: dict[int, _Bar]) -> None:
        self._bars = bars
        self._numbers = np.array(list(bars), np.int64)
        self._axes = np.array([bar.axes for bar in bars.values()]).reshape(-1, 3, 3)
        self._low_m = np.array([bar.low_m for bar in bars.values()]).reshape(-1, 3)
        self._high_m = np.array([bar.high_m for bar in bars.values()]).reshape(-1, 3)

    def cut(self, n: int) -> TriangleMesh | None:
        """Return the mesh of a beam cut at the faces of what its ends are in; None if they are in nothing."""
        bar = self._bars[n]
        if plain_class(bar.element.ifc_class) not in _CUT:
            return None
        mesh = bar.element.mesh
        for side, end_m in bar.ends_m():
            depth_m = max(
                (depth for other, depth in self._into(n, end_m, -side) if self._gives_way(n, other)), default=0.0
            )
            if 0.0 < depth_m <= min(_MOST_SHARE * bar.length_m, _MOST_M):
                mesh = _shortened(mesh, bar, side, depth_m + _GAP_M) or mesh
        return None if mesh is bar.element.mesh else mesh

    def _into(self, n: int, end_m: NDArray[np.float64], inward: int) -> Iterator[tuple[int, float]]:
        """Yield the bars in which an end is, and how far from it the beam is clear of each of them."""
        along = inward * self._bars[n].axes[0]
        at, way = self._axes @ end_m, self._axes @ along
        is_in = ((at > self._low_m + _INSIDE_M) & (at < self._high_m - _INSIDE_M))[:, 1:].all(axis=1)
        # The axes of two beams at a corner end in the same point, at the end of both.
        is_in &= (at[:, 0] > self._low_m[:, 0] - _INSIDE_M) & (at[:, 0] < self._high_m[:, 0] + _INSIDE_M)
        is_in &= (np.abs(way[:, 0]) < _ALONG) & (self._numbers != n)
        for other in self._numbers[is_in].tolist():
            from_m = self._bars[n].face_m(end_m)
            depth_m = _farthest_m(from_m, along, self._bars[other].element.mesh)
            if depth_m > _INSIDE_M:
                yield other, depth_m

    def _gives_way(self, n: int, other: int) -> bool:
        """Return whether a beam is the one that is cut at a joint: at a corner of two beams, the lighter one."""
        if plain_class(self._bars[other].element.ifc_class) not in _CUT:
            return True
        is_corner = any(
            n == into for side, end in self._bars[other].ends_m() for into, _ in self._into(other, end, -side)
        )
        mine, its = self._bars[n].section_m2, self._bars[other].section_m2
        return not is_corner or (mine, -n) < (its, -other)


def _bar(element: Element) -> _Bar | None:
    """Return a part as a bar; None if it is not longer than it is wide."""
    points_m = element.mesh.vertices_m[np.unique(element.mesh.faces)]
    spread = points_m - points_m.mean(axis=0)
    along = np.linalg.eigh(spread.T @ spread)[1][:, -1]
    up = np.array([0.0, 0.0, 1.0]) if abs(along[2]) < 1.0 - 1e-6 else np.array([0.0, 1.0, 0.0])
    across = np.cross(up, along)
    across /= np.linalg.norm(across)
    axes = np.stack([along, across, np.cross(along, across)])
    own = points_m @ axes.T
    low, high = own.min(axis=0), own.max(axis=0)
    length, *sides = (high - low).tolist()
    if length < 2.0 * max(sides):
        return None
    return _Bar(element, axes, low, high, abs(element.mesh.signed_volume_m3) / length)


def _shortened(mesh: TriangleMesh, bar: _Bar, side: int, by_m: float) -> TriangleMesh | None:
    """Return a mesh whose end face is moved inward; None if something of its shape is in what would be cut off."""
    at = mesh.vertices_m @ bar.axes[0]
    beyond = bar.high_m[0] - at if side > 0 else at - bar.low_m[0]
    is_end = beyond < _INSIDE_M
    if (~is_end & (beyond < by_m + _INSIDE_M)).any():
        return None
    vertices_m = mesh.vertices_m.copy()
    vertices_m[is_end] -= side * by_m * bar.axes[0]
    return TriangleMesh(vertices_m, mesh.faces)


def _farthest_m(from_m: NDArray[np.float64], along: NDArray[np.float64], mesh: TriangleMesh) -> float:
    """Return how far from points the last surface of a mesh is that they meet in one direction; 0 if they meet none."""
    a, b, c = np.moveaxis(mesh.triangles_m, 1, 0)
    one, two = b - a, c - a
    normal = np.cross(along, two)
    size = np.einsum("fi,fi->f", one, normal)
    faces = np.abs(size) > 1e-12
    a, one, two, normal, size = a[faces], one[faces], two[faces], normal[faces], size[faces]
    apart = from_m[:, None] - a
    u = np.einsum("pfi,fi->pf", apart, normal) / size
    turned = np.cross(apart, one)
    v = turned @ along / size
    far = np.einsum("pfi,fi->pf", turned, two) / size
    hit = (u >= 0.0) & (v >= 0.0) & (u + v <= 1.0) & (far > 0.0)
    return float(far[hit].max(initial=0.0))
