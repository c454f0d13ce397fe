"""Parts that are not of the site: too far from all others for any crane, or too large (a wrong coordinate or unit).

And vertices of terrain of which the same holds.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterator, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from bimvox.bim.building import BUILT, Building, Element, Role, SkippedProduct, TriangleMesh, plain_class

# Parts that are drawn twice in the same place: a copy of a storey, a part of two files that were joined.
#
# Also a bar, a wall or a slab that is drawn again a little longer, wider or thicker: one of them is left over from an
# earlier draft.

_SAME_M = 1e-3
_SHARED = 0.8
"""Share of the longer of two parts in one line that both take, from which they are drafts of one part."""


def without_duplicates(building: Building) -> Building:
    """Return a building in which of parts in the same place one is built, with a note; the others are fittings.

    Of parts with the same corners, the first in the file stays, of drafts of one part the longest; but a part that is
    already in place before one that is lifted.
    """
    twins = _same_corners(building.elements)
    twins |= _drafts([(n, one) for n, one in enumerate(building.elements) if one.role in BUILT and n not in twins])
    if not twins:
        return building
    what = "parts are duplicates of others" if len(twins) > 1 else "part is a duplicate of another"
    return building.with_role(twins, Role.FITTING, f"{len(twins)} {what} in the same place, so left out")


def _same_corners(elements: Sequence[Element]) -> set[int]:
    boxes: dict[Hashable, list[int]] = {}
    for n, element in enumerate(elements):
        if element.role in BUILT:
            boxes.setdefault(_rounded(element.mesh.bounds_m).tobytes(), []).append(n)
    twins: set[int] = set()
    for alike in boxes.values():
        places: dict[Hashable, int] = {}
        # What is already in place comes before what is lifted.
        for n in sorted(alike, key=lambda n: elements[n].role is Role.COMPONENT) if len(alike) > 1 else ():
            if places.setdefault(_corners(elements[n].mesh), n) != n:
                twins.add(n)
    return twins


def _drafts(built: Sequence[tuple[int, Element]]) -> set[int]:
    """Return the numbers of parts that another of their class takes the place of: alike but for their extent."""
    result: set[int] = set()
    for axis in range(3):
        across: dict[Hashable, list[tuple[int, Element]]] = {}
        for n, element in built:
            bounds_m = np.delete(_rounded(element.mesh.bounds_m), axis, axis=1)
            key = (plain_class(element.ifc_class), element.material, bounds_m.tobytes())
            across.setdefault(key, []).append((n, element))
        for row in across.values():
            if len(row) > 1:
                result |= set(_covered([one for one in row if one[0] not in result], axis))
    return result


def _covered(row: Sequence[tuple[int, Element]], axis: int) -> Iterator[int]:
    """Yield the numbers of parts in one line along an axis of which one that stays takes most of the place."""
    stay: list[tuple[float, float, Hashable]] = []
    for n, element in sorted(row, key=lambda one: (one[1].role is Role.COMPONENT, -_length_m(one[1], axis), one[0])):
        low, high = element.mesh.bounds_m[:, axis].tolist()
        shape = _stretched(element.mesh, axis)
        if any(
            min(high, top) - max(low, bottom) >= _SHARED * max(high - low, top - bottom) and shape == its_shape
            for bottom, top, its_shape in stay
        ):
            yield n
        else:
            stay.append((low, high, shape))


def _length_m(element: Element, axis: int) -> float:
    return float(np.ptp(element.mesh.bounds_m[:, axis]))


def _stretched(mesh: TriangleMesh, axis: int) -> Hashable:
    """Return the corners of a mesh that is made one metre long, from the origin."""
    points_m = mesh.vertices_m.copy()
    low, high = mesh.bounds_m[:, axis]
    points_m[:, axis] = (points_m[:, axis] - low) / max(high - low, _SAME_M)
    return _corners(TriangleMesh(points_m, mesh.faces))


def _corners(mesh: TriangleMesh) -> Hashable:
    """Return the corners of a mesh, whatever their order."""
    return np.unique(_rounded(mesh.vertices_m[np.unique(mesh.faces)]), axis=0).tobytes()


def _rounded(points_m: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.round(points_m / _SAME_M) + 0.0  # no negative zero


_REACH_M = 50.0
"""From the edge of such a slab, few jibs reach the middle of what stands on it."""
_THICKEST_M = 1.0


def pavements_as_ground(building: Building) -> Building:
    """Return a building whose pavements are ground, with a note.

    A pavement is a thin component that extends further than ``_REACH_M`` in each direction from the middle of all that
    is smaller. A mast next to it would not reach the building.
    """
    built = [n for n, one in enumerate(building.elements) if one.role in BUILT]
    bounds_m = np.array([building.elements[n].mesh.bounds_m for n in built]).reshape(-1, 2, 3)
    wide = (np.ptp(bounds_m, axis=1)[:, :2] > 2.0 * _REACH_M).all(axis=1)
    if not wide.any() or wide.all():
        return building
    middle_m = (bounds_m[~wide, 0].min(axis=0) + bounds_m[~wide, 1].max(axis=0))[:2] / 2.0
    around = (np.abs(bounds_m[:, :, :2] - middle_m) > _REACH_M).all(axis=(1, 2))
    thin = np.ptp(bounds_m, axis=1)[:, 2] <= _THICKEST_M
    found = {n for n, is_one in zip(built, wide & around & thin, strict=True) if is_one}
    found = {n for n in found if building.elements[n].role is Role.COMPONENT}
    if not found:
        return building
    verb = "slabs extend" if len(found) > 1 else "slab extends"
    said = f"{len(found)} {verb} more than {_REACH_M:g} m around the building, so the crane stands on it"
    return building.with_role(found, Role.GROUND, said)


FAR_M = 250.0
"""Three times the longest jib: a gap as wide lies between two sites."""
_TOO_LARGE = 3.0
"""A part as long as that many times the rest of the building, and longer than ``FAR_M``, has a wrong unit."""
_NOWHERE_M = 1e6
"""So far from the building, coordinates are too large for cells."""
_TERRAIN_M = np.array([1e4, 1e4, FAR_M])
"""A vertex of terrain is wrong only if it is further than that from the middle of the terrain, on an axis, ..."""
_SPREADS = 20.0
"""... and further than so many times the usual distance: evenly spread vertices are up to twice that distance away."""


def without_strays(building: Building) -> Building:
    """Return a building in which strays and duplicates are not lifted and not in the way, with a note.

    Parts belong together if no empty strip ``FAR_M`` wide lies between them on any axis. The largest group stays.
    """
    building = _without_stray_vertices(pavements_as_ground(without_duplicates(building)))
    built = [n for n, element in enumerate(building.elements) if element.role in BUILT]
    if not built:
        return building
    bounds_m = np.stack([building.elements[n].mesh.bounds_m for n in built])
    if (bounds_m[:, 1].max(axis=0) - bounds_m[:, 0].min(axis=0) <= FAR_M).all():
        return building
    fits = np.ptp(bounds_m, axis=1).max(axis=1) <= FAR_M
    if fits.any() and not fits.all():
        rest_m = np.ptp([bounds_m[fits, 0].min(axis=0), bounds_m[fits, 1].max(axis=0)], axis=0).max()
        fits |= np.ptp(bounds_m, axis=1).max(axis=1) <= _TOO_LARGE * rest_m
    else:
        fits[:] = True
    groups = np.stack([_strips(bounds_m[:, 0, axis], bounds_m[:, 1, axis]) for axis in range(3)], axis=1)
    _, first, group, sizes = np.unique(groups[fits], axis=0, return_index=True, return_inverse=True, return_counts=True)
    stays = min(range(len(sizes)), key=lambda n: (-sizes[n], first[n]))
    fits[fits] = group.reshape(-1) == stays
    if fits.all():
        return building
    strays = {built[n] for n in np.flatnonzero(~fits)}
    center_m = bounds_m[fits].mean(axis=(0, 1))
    nowhere = {built[n] for n in np.flatnonzero(~(np.abs(bounds_m - center_m) < _NOWHERE_M).all(axis=(1, 2)))}
    what = f"{len(strays)} {'parts are' if len(strays) > 1 else 'part is'} left out"
    said = f"{what}, more than {FAR_M:g} m from all others or too large for them; check coordinates and units"
    found = building.with_role(strays, Role.FITTING, said)
    skipped = [
        SkippedProduct(one.global_id, one.ifc_class, one.name, f"lies more than {_NOWHERE_M / 1e3:,.0f} km away")
        for one in (building.elements[n] for n in sorted(nowhere))
    ]
    elements = tuple(element for n, element in enumerate(found.elements) if n not in nowhere)
    return replace(found, elements=elements, skipped=(*building.skipped, *skipped))


def _without_stray_vertices(building: Building) -> Building:
    """Return a building without the vertices of terrain that are far from all others, with a note.

    One wrong coordinate would make the site a kilometre deep. The vertices next to a wrong one span its gap.
    """
    changed = {
        n: found
        for n, one in enumerate(building.elements)
        if one.role is Role.GROUND and (found := _spanned(one.mesh)) is not None
    }
    if not changed:
        return building
    count = sum(found[1] for found in changed.values())
    what = "1 vertex of terrain lies" if count == 1 else f"{count:,} vertices of terrain lie"
    said = f"{what} far from the rest of it, so not used; check the coordinates of"
    return building.with_meshes({n: mesh for n, (mesh, _) in changed.items()}, said)


def _spanned(mesh: TriangleMesh) -> tuple[TriangleMesh, int] | None:
    """Return a mesh whose stray vertices are at the middle of their neighbours, and their number; None without any."""
    used = np.unique(mesh.faces)
    apart_m = np.abs(mesh.vertices_m - np.median(mesh.vertices_m[used], axis=0))
    limit_m = np.maximum(_TERRAIN_M, _SPREADS * np.median(apart_m[used], axis=0))
    is_stray = (apart_m > limit_m).any(axis=1)
    strays = used[is_stray[used]]
    if not len(strays):
        return None
    vertices_m, faces = mesh.vertices_m.copy(), mesh.faces
    for vertex in strays:
        near = np.unique(faces[(faces == vertex).any(axis=1)])
        near = near[~is_stray[near]]
        if len(near):
            vertices_m[vertex] = mesh.vertices_m[near].mean(axis=0)
        else:
            faces = faces[(faces != vertex).all(axis=1)]
    return TriangleMesh(vertices_m, faces), len(strays)


def _strips(low: NDArray[np.float64], high: NDArray[np.float64]) -> NDArray[np.int64]:
    """Return the number of the strip in which each range lies, between gaps that are at least ``FAR_M`` wide."""
    order = np.argsort(low, kind="stable")
    reached = np.maximum.accumulate(high[order])
    result = np.empty(len(low), np.int64)
    result[order] = np.concatenate([[0], np.cumsum(low[order][1:] - reached[:-1] >= FAR_M)])
    return result
