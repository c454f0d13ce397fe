"""The mass of a lift: of a whole and its parts, none of which counts twice."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bimvox.bim.building import TriangleMesh
from bimvox.bim.ifc.assembly import SUBSTANTIAL, Extent, MeshedProduct
from bimvox.bim.ifc.mass import ASSEMBLY_LOW, REPEATED, Mass, Masses, weakest

_RAYS = 24
"""Vertical rays through the first solid, along x and along y."""
_OFF = 0.4142
"""Place of a ray in its square: in its middle it would run along edges that are drawn on round numbers."""
_AT_ONCE = 2_000_000
"""Pairs of ray and triangle that are looked at together."""


def share_inside(one: TriangleMesh, other: TriangleMesh) -> float:
    """Return the share of a solid's volume that is inside another one, measured along vertical rays.

    Args:
        one: Faces look outward; an open mesh gives a rough value.
        other: The same.
    """
    low, high = one.bounds_m
    if (low >= other.bounds_m[1]).any() or (high <= other.bounds_m[0]).any():
        return 0.0
    steps = (np.arange(_RAYS) + _OFF) / _RAYS
    xy = np.stack(np.meshgrid(*(low[:2] + steps[:, None] * (high - low)[:2]).T, indexing="ij"), axis=-1).reshape(-1, 2)
    total_m, inside_m = 0.0, 0.0
    first, second = _crossings(one, xy), _crossings(other, xy)
    for own, others in zip(first, second, strict=True):
        pieces = _solid(own)
        total_m += sum(top - bottom for bottom, top in pieces)
        inside_m += sum(
            max(0.0, min(top, high_m) - max(bottom, low_m))
            for bottom, top in pieces
            for low_m, high_m in _solid(others)
        )
    return inside_m / total_m if total_m > 0.0 else 0.0


def _crossings(mesh: TriangleMesh, xy: NDArray[np.float64]) -> list[NDArray[np.float64]]:
    """Return for each vertical line (N, 2) where it passes faces: (C, 2) height, and 1 if it enters going up, or -1."""
    triangles = mesh.triangles_m
    rays, heights, signs = [], [], []
    at_once = max(1, _AT_ONCE // len(xy))
    for start in range(0, len(triangles), at_once):
        a, b, c = np.moveaxis(triangles[start : start + at_once], 1, 0)
        doubled = _cross(b - a, c - a)
        weights = [_cross(q[:, :2] - xy[:, None], r[:, :2] - xy[:, None]) for q, r in ((b, c), (c, a), (a, b))]
        hit = np.all([weight * np.sign(doubled) > 0.0 for weight in weights], axis=0)
        ray, face = np.nonzero(hit)
        z = sum(weight[ray, face] * corner[face, 2] for weight, corner in zip(weights, (a, b, c), strict=True))
        rays.append(ray)
        heights.append(z / doubled[face])
        signs.append(-np.sign(doubled[face]))
    ray = np.concatenate(rays)
    found = np.stack([np.concatenate(heights), np.concatenate(signs)], axis=1)
    order = np.lexsort((found[:, 0], ray))
    return np.split(found[order], np.searchsorted(ray[order], np.arange(1, len(xy))))


def _solid(crossings: NDArray[np.float64]) -> list[tuple[float, float]]:
    """Return where a line is inside the solid, from the bottom up."""
    pieces: list[tuple[float, float]] = []
    depth, start = 0.0, 0.0
    for height, sign in crossings.tolist():
        if depth == 0.0:
            start = height
        depth += sign
        if depth == 0.0:
            pieces.append((start, height))
    return pieces


def _cross(p: NDArray[np.float64], q: NDArray[np.float64]) -> NDArray[np.float64]:
    return p[..., 0] * q[..., 1] - p[..., 1] * q[..., 0]


_REPEATS_SHARE = 0.9
"""A part of which this share is inside the body of its whole is drawn there a second time."""
_COVERS_SHARE = 0.8
"""Parts whose volumes inside the body of their whole add up to this share of it are that body."""
_TOUCHES_SHARE = 0.1
"""A smaller share inside comes from tolerances of the drawing."""
_ROUNDED = 0.02
"""Stated weights are rounded: a whole may be stated this much lighter than its parts."""


@dataclass(frozen=True, slots=True, eq=False)
class Weighed:
    """A product with what is below it.

    Attributes:
        mass: Its mass.
        extent: Where it is, and the volume of its solids, each counted once.
        shown: Step ids of the products whose meshes make it up.
        of_product: Mass of each product with a mesh, by step id.
    """

    mass: Mass
    extent: Extent
    shown: tuple[int, ...]
    of_product: Mapping[int, Mass]


class GroupMasses:
    """Masses of the lifts of one file.

    Args:
        file: The ``ifcopenshell.file``.
        masses: Masses of its products.
        meshed: Its products with triangles, by step id.
        parts_of: Returns the step ids of a whole's parts with triangles or with such parts.
    """

    def __init__(
        self,
        file: Any,
        masses: Masses,
        meshed: Mapping[int, MeshedProduct],
        parts_of: Callable[[int], Collection[int]],
    ) -> None:
        self._file = file
        self._masses = masses
        self._meshed = meshed
        self._parts_of = parts_of

    def weigh(self, step_id: int, members: Collection[int]) -> Weighed | None:
        """Return a product with the members of a lift that are it or below it; None if there are none."""
        order = [step_id]
        for whole in order:  # wholes may be nested deeper than Python calls
            order += self._parts_of(whole)
        found: dict[int, Weighed] = {}
        for one in reversed(order):
            below = [found[part] for part in self._parts_of(one) if part in found]
            if below or one in members:
                found[one] = self._weigh(one, below, members)
        return found.get(step_id)

    def _weigh(self, step_id: int, below: list[Weighed], members: Collection[int]) -> Weighed:
        """Return a product with its weighed parts; it is a member itself, or has parts."""
        body = self._body(step_id) if step_id in members else None
        if body is not None and not below:
            return body
        parts = _sum(below)
        if body is not None:
            return self._with_body(step_id, body, below, parts)
        mass = self._masses.stated(self._file.by_id(step_id), parts.mass, parts.extent.volume_m3, parts.extent.box_m3)
        stated_kg = sum(one.mass.kg for one in below if one.mass.source == "quantity")
        if mass.source == "quantity" and mass.kg < stated_kg:
            is_low = mass.kg < (1.0 - _ROUNDED) * stated_kg
            mass = replace(parts.mass, doubts=(*parts.mass.doubts, *(ASSEMBLY_LOW,) * is_low))
        elif mass.source == "quantity":
            mass = replace(mass, doubts=tuple(dict.fromkeys((*parts.mass.doubts, *mass.doubts))))
        return replace(parts, mass=mass)

    def is_repeated(self, step_id: int) -> bool:
        """Return whether the parts of a product are the body that it has itself."""
        if step_id not in self._meshed or not self._parts_of(step_id):
            return False
        whole = self._meshed[step_id]
        inside_m3 = 0.0
        for part in self._parts_of(step_id):
            one = self.weigh(part, self._meshed)
            if one is not None:
                inside_m3 += share_inside(self._mesh(one), whole.mesh) * one.extent.volume_m3
        return inside_m3 >= _COVERS_SHARE * whole.extent.volume_m3

    def _body(self, step_id: int) -> Weighed:
        part = self._meshed[step_id]
        extent, solid = part.extent, part.solid
        mass = self._masses.of(self._file.by_id(step_id), extent.volume_m3, solid.exact, extent.box_m3, solid.sheet_m2)
        return Weighed(mass, extent, (step_id,), {step_id: mass})

    def _with_body(self, step_id: int, body: Weighed, below: list[Weighed], parts: Weighed) -> Weighed:
        """Return a product that has a body and parts: what of these is inside that body replaces it there."""
        whole = self._meshed[step_id]
        shares = [share_inside(self._mesh(one), whole.mesh) for one in below]
        shares = [share if share >= _TOUCHES_SHARE else 0.0 for share in shares]
        inside_m3 = [share * one.extent.volume_m3 for share, one in zip(shares, below, strict=True)]
        product, own = self._file.by_id(step_id), body.extent
        by_volume, own_m3 = self._masses.by_volume(
            product, own.volume_m3, whole.solid.exact, own.box_m3, whole.solid.sheet_m2
        )
        density = by_volume.kg / own_m3 if own_m3 > 0.0 else 0.0
        by_parts = sum(inside_m3) <= (1.0 + _ROUNDED) * own_m3  # otherwise they overlap each other
        outside_kg = instead_kg = 0.0
        for share, one, m3 in zip(shares, below, inside_m3, strict=True):
            outside_kg += (1.0 - share) * one.mass.kg
            if by_parts and one.mass.source != "default":  # of another material than the whole
                instead_kg += share * one.mass.kg - density * m3
        added = [one for share, one in zip(shares, below, strict=True) if share < _REPEATS_SHARE]
        expected = _sum([body, *added])
        mass = replace(expected.mass, kg=by_volume.kg + instead_kg + outside_kg)
        if body.mass.source == "quantity":
            is_of_all = abs(body.mass.kg - mass.kg) < abs(body.mass.kg - by_volume.kg)
            mass = body.mass if is_of_all else replace(expected.mass, kg=body.mass.kg + outside_kg)
        elif by_parts and sum(inside_m3) >= _COVERS_SHARE * own_m3:
            mass = replace(mass, source=parts.mass.source, guessed=parts.mass.guessed)
        stated_kg = sum(one.mass.kg for one in below if one.mass.source == "quantity")
        doubts = (*expected.mass.doubts, *(REPEATED,) * any(shares))
        if mass.source == "quantity" and mass.kg < stated_kg:
            doubts = (*doubts, *(ASSEMBLY_LOW,) * (mass.kg < (1.0 - _ROUNDED) * stated_kg))
            mass = replace(mass, kg=stated_kg)
        volume_m3 = own_m3 + parts.extent.volume_m3 - sum(inside_m3)
        extent = replace(expected.extent, volume_m3=volume_m3)
        of_product = {**body.of_product, **parts.of_product}
        return Weighed(replace(mass, doubts=tuple(dict.fromkeys(doubts))), extent, expected.shown, of_product)

    def _mesh(self, weighed: Weighed) -> TriangleMesh:
        return TriangleMesh.joined([self._meshed[step_id].mesh for step_id in weighed.shown])


def _doubted_kg(masses: Sequence[Mass]) -> tuple[float, ...]:
    """Return what several products are stated to weigh, and by volume and material, if that differs substantially.

    A plate in a panel may be doubtful: it changes nothing.
    """
    stated_kg, expected_kg = zip(*(one.doubted_kg or (one.kg, one.kg) for one in masses), strict=True)
    least_kg, most_kg = sorted((sum(stated_kg), sum(expected_kg)))
    return (sum(stated_kg), sum(expected_kg)) if most_kg - least_kg > SUBSTANTIAL * most_kg else ()


def _sum(parts: list[Weighed]) -> Weighed:
    """Return several products that do not overlap as one."""
    if len(parts) == 1:
        return parts[0]
    kg = sum(part.mass.kg for part in parts)
    guessed_kg = sum(part.mass.kg for part in parts if part.mass.guessed)
    mass = Mass(
        kg,
        weakest([part.mass.source for part in parts]),
        guessed_kg > SUBSTANTIAL * kg,
        tuple(dict.fromkeys(doubt for part in parts for doubt in part.mass.doubts)),
        _doubted_kg([part.mass for part in parts]),
    )
    extent = Extent(
        np.min([part.extent.low_m for part in parts], axis=0),
        np.max([part.extent.high_m for part in parts], axis=0),
        sum(part.extent.volume_m3 for part in parts),
    )
    of_product = {step_id: one for part in parts for step_id, one in part.of_product.items()}
    return Weighed(mass, extent, tuple(sorted(step_id for part in parts for step_id in part.shown)), of_product)
