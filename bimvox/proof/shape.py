"""The verifier's test of voxelization: the cells of parts cover their surfaces, and their masses fit their volumes."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bimvox.bim.building import TriangleMesh
from bimvox.compiled import kernel
from bimvox.grid.frame import GridFrame
from bimvox.kept import kept
from bimvox.proof.bodies.filled import unfilled
from bimvox.proof.bodies.solid import are_edges_matched, corner_numbers, pieces_of
from bimvox.records.proof import Check
from bimvox.site.component import Component, IntVec
from bimvox.site.means import Means
from bimvox.site.site import Blocker

_BORDER_M = 2e-4  # a point this close to a cell border may count to either side (the voxelizer's tolerance is 0.1 mm)
_FINEST = 64
_OFF_VOX = 1e-6
_HOOK_M = 1e-3
"""How far from the vertical above the centre of mass a hook may be."""
_NO_VOLUME = 1e-3  # of its box; the volume of an open mesh means nothing


def check_shape(check: Check, component: Component, frame: GridFrame) -> None:
    """Check that a part's cells cover its surface and reach no further, and that it hangs above its centre of mass.

    A part that the crane does not lift has no hook; if its mesh is open, it is undecided whether this fills its cells.
    """
    cells, is_lifted = component.shape.cells + np.array(component.target_vox), component.means is Means.CRANE
    _check_cells(check, component.id, component.mesh, cells, frame, may_be_open=not is_lifted)
    if not is_lifted:
        return
    x, y, z = component.hook_offset_vox
    size = component.shape.cells.max(axis=0) + 1
    aside = np.abs(component.hook_aside_vox)
    good = 0 <= x < size[0] and 0 <= y < size[1] and z == size[2] and bool((aside <= 0.5 + _OFF_VOX).all())
    name = f"{component.label}: its hook, {component.hook_line_vox},"
    check.look(good, f"{name} is not in a column of its cells, above its top")
    if (centre_m := _centre_m(component.mesh)) is None:
        return
    at = (centre_m - np.array(frame.origin_m)) / frame.voxel_size_m - component.target_vox
    off_vox = np.clip(at[:2], 0.0, size[:2]) - np.array(component.hook_line_vox[:2]) - 0.5
    off_m = float(np.hypot(*off_vox)) * frame.voxel_size_m
    check.look(off_m <= _HOOK_M, f"{name} is {off_m:.3f} m away from the vertical above its centre of mass")


def check_structure(check: Check, blocker: Blocker, frame: GridFrame, shape: IntVec) -> None:
    """Check that the cells of an existing structure cover its surface inside the grid and reach no further."""
    if blocker.mesh is not None:
        _check_cells(check, blocker.id, blocker.mesh, blocker.cells, frame, shape)


def _check_cells(
    check: Check,
    name: str,
    mesh: TriangleMesh,
    cells: NDArray[np.int32],
    frame: GridFrame,
    shape: IntVec | None = None,
    *,
    may_be_open: bool = False,
) -> None:
    """Check that points spread over triangles, half a cell apart, lie in the cells, and that their boxes agree.

    ``check``: receives what was looked at; ``cells``: (N, 3) its cells; ``shape``: points outside a grid of this shape
    are ignored; None: there are none; ``may_be_open``: whether it is undecided, not a failure, that an open mesh does
    not fill its cells.
    """
    first, last = cells.min(axis=0), cells.max(axis=0)
    dense = np.zeros(last - first + 3, np.bool_)
    dense[tuple((cells - first + 1).T)] = True
    corners = (mesh.triangles_m - np.array(frame.origin_m)) / frame.voxel_size_m - (first - 1)
    border, touched, ends = _BORDER_M / frame.voxel_size_m, np.zeros_like(dense), np.full((2, 3), np.inf)
    ends[0] = -np.inf
    if shape is not None:
        ends = np.array([np.full(3, border), np.array(shape) - border]) - (first - 1)
    looked, bare, at = _look(dense, touched, corners, ends[0], ends[1], 0.5, border)
    at_m = np.array(frame.origin_m) + frame.voxel_size_m * (at + first - 1)
    where = f" at ({at_m[0]:.3f}, {at_m[1]:.3f}, {at_m[2]:.3f}) m" if bare else ""
    check.look(not bare, f"{name}: its surface{where} lies outside its cells", samples=looked)
    low, high = (mesh.bounds_m - np.array(frame.origin_m)) / frame.voxel_size_m
    if shape is not None:
        low, high = np.clip(low, 0, shape), np.clip(high, 0, shape)
    # A surface at a border of cells may fill the cells on both sides of it, or on one.
    reaches = (first < np.floor(low - border)).any() or (last + 1 > np.floor(high + border) + 1).any()
    check.look(not reaches, f"{name}: its cells reach further than its surface")
    empty = unfilled(dense, touched, mesh, corners, border)
    if len(empty) and may_be_open and not are_edges_matched(corner_numbers(mesh)):
        check.undecided.append(
            f"{name}: its mesh is open and does not fill its cells: {len(empty)} of {len(cells)} count as they are"
        )
        return
    at = frame.corner_of(empty[0] + first - 0.5) if len(empty) else first
    check.look(
        not len(empty),
        f"{name}: its mesh does not fill its cells: {len(empty)} of {len(cells)} are neither on its surface "
        f"nor inside, the first at ({at[0]:.3f}, {at[1]:.3f}, {at[2]:.3f}) m",
        samples=len(cells),
    )


def _centre_m(mesh: TriangleMesh) -> NDArray[np.float64] | None:
    """Return the (3,) centre of the volume that a mesh encloses, from its moments; None if it encloses none."""
    low, high = mesh.bounds_m
    corners = mesh.triangles_m - (low + high) / 2.0
    moments = np.linalg.det(corners)
    if abs(moments.sum()) <= _NO_VOLUME * 6.0 * float(np.prod(np.maximum(high - low, 1e-3))):
        return None
    centre_m: NDArray[np.float64] = (low + high) / 2.0 + moments @ corners.sum(axis=1) / (4.0 * moments.sum())
    return centre_m


@kernel
def _look(
    dense: NDArray[np.bool_],
    touched: NDArray[np.bool_],
    corners: NDArray[np.float64],
    low: NDArray[np.float64],
    high: NDArray[np.float64],
    spacing: float,
    border: float,
) -> tuple[int, int, NDArray[np.float64]]:
    """Look at points over every triangle, its corners included, and mark the cells that they touch.

    Neighbours are at most a spacing apart, but an edge has at most ``_FINEST`` parts.

    ``dense``: (X, Y, Z) the cells of the part; ``touched``: (X, Y, Z) receives those of them around each point, a
    border's width to either side; ``corners``: (F, 3, 3) the triangles, in cells of the array; ``low``: (3,) points
    below it do not count; ``high``: (3,) points above it do not count. How many points count, how many of them no cell
    of the part is around, and the (3,) first of these: of the triangles with the fewest parts.
    """
    looked, bare, fewest, first = 0, 0, _FINEST + 1, np.zeros(3)
    at, begins, ends = np.empty(3), np.empty(3, np.int64), np.empty(3, np.int64)
    for f in range(corners.shape[0]):
        longest = 0.0
        for side in range(3):
            squared = 0.0
            for k in range(3):
                squared += (corners[f, (side + 1) % 3, k] - corners[f, side, k]) ** 2
            longest = max(longest, np.sqrt(squared))
        parts = int(min(max(np.ceil(longest / spacing), 1), _FINEST))
        for i in range(parts + 1):
            for j in range(parts + 1 - i):
                counts, covered = True, False
                for k in range(3):
                    a, b, c = corners[f, 0, k], corners[f, 1, k], corners[f, 2, k]
                    at[k] = (i * a + j * b + (parts - i - j) * c) / parts
                    counts &= low[k] <= at[k] <= high[k]
                    begins[k] = max(int(np.floor(at[k] - border)), 0)
                    ends[k] = min(int(np.floor(at[k] + border)), dense.shape[k] - 1)
                if not counts:
                    continue
                looked += 1
                for x in range(begins[0], ends[0] + 1):
                    for y in range(begins[1], ends[1] + 1):
                        for z in range(begins[2], ends[2] + 1):
                            if dense[x, y, z]:
                                covered = touched[x, y, z] = True
                if covered:
                    continue
                bare += 1
                if parts < fewest:
                    fewest = parts
                    for k in range(3):
                        first[k] = at[k]
    return looked, bare, first


LEAST_KG_M3 = 10.0
"""Foam boards weigh 10 to 40 kg/m3. Hollow parts that are drawn solid (tanks, box girders, ducts) weigh more."""
MOST_KG_M3 = 25_000.0
"""Osmium, the densest metal, weighs 22,600 kg/m3."""
LEAST_KG_M2 = 0.05
"""Of surface. A foil of 0.1 mm weighs 0.09 kg/m2, and has two sides."""
_THINNEST_M = 1e-4
"""A closed mesh that is thinner on average is a sheet, whose volume means nothing."""


class _Volumes(NamedTuple):
    """What a mesh encloses.

    Attributes:
        least_m3: The volume, where bodies that face opposite ways cancel; 0 if the mesh is open or a sheet.
        most_m3: The sum of the volumes of its bodies; infinite if the mesh is open or a sheet.
        area_m2: Its surface.
    """

    least_m3: float
    most_m3: float
    area_m2: float


def check_mass(check: Check, component: Component, voxel_size_m: float) -> None:
    """Check that a material of this density exists, and that an open mesh weighs at least as much as a foil."""
    found, mass_kg = volumes_of(component.mesh), component.mass_kg
    cells_m3 = len(component.shape.cells) * voxel_size_m**3
    least_m3, most_m3 = min(found.least_m3, cells_m3), min(found.most_m3, cells_m3)
    if least_m3:
        check.measure(mass_kg / least_m3)
    check.look(
        mass_kg >= LEAST_KG_M3 * least_m3,
        f"{component.id}: its mass, {mass_kg:g} kg for {least_m3:.3g} m3, is less than {LEAST_KG_M3:g} kg/m3",
    )
    check.look(
        mass_kg >= LEAST_KG_M2 * found.area_m2,
        f"{component.id}: its mass, {mass_kg:g} kg for {found.area_m2:.3g} m2 of surface, is less than that of a foil",
    )
    check.look(
        mass_kg <= MOST_KG_M3 * most_m3,
        f"{component.id}: its mass, {mass_kg:g} kg for {most_m3:.3g} m3, is more than {MOST_KG_M3:,.0f} kg/m3",
    )


@kept
def volumes_of(mesh: TriangleMesh) -> _Volumes:
    """Return what a mesh encloses."""
    triangles = mesh.triangles_m
    sides = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    area_m2 = float(np.linalg.norm(sides, axis=1).sum()) / 2.0
    numbers = corner_numbers(mesh)
    volumes_m3 = np.bincount(pieces_of(numbers), np.linalg.det(triangles - mesh.bounds_m.mean(axis=0)) / 6.0)
    most_m3 = float(np.abs(volumes_m3).sum())
    if not are_edges_matched(numbers) or most_m3 <= _THINNEST_M * area_m2 / 2.0:
        return _Volumes(0.0, np.inf, area_m2)
    return _Volumes(abs(float(volumes_m3.sum())), most_m3, area_m2)
