"""Parts that are not of the site: too far from all others for any crane, or too large (a wrong coordinate or unit).

And vertices of terrain of which the same holds.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from bimvox.bim.building import BUILT, Building, Role, SkippedProduct, TriangleMesh
from bimvox.bim.duplicates import without_duplicates
from bimvox.bim.pavements import pavements_as_ground
from bimvox.errors import listed

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
    names = listed((building.elements[n].label for n in changed), most=5)
    note = f"{what} far from the rest of it, so not used; check the coordinates of {names}"
    elements = tuple(
        replace(one, mesh=changed[n][0]) if n in changed else one for n, one in enumerate(building.elements)
    )
    return replace(building, elements=elements, notes=(*building.notes, note))


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
    found = np.empty(len(low), np.int64)
    found[order] = np.concatenate([[0], np.cumsum(low[order][1:] - reached[:-1] >= FAR_M)])
    return found
