"""The proof that a part's mass fits the volume that its mesh encloses."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from bimvox.bim.building import TriangleMesh
from bimvox.kept import kept
from bimvox.proof.bodies.solid import corner_numbers, is_matched, pieces_of
from bimvox.records.proof import Check
from bimvox.site.component import Component

LEAST_KG_M3 = 10.0
"""Foam boards weigh 10 to 40 kg/m3. Hollow parts that are drawn solid (tanks, box girders, ducts) weigh more."""
MOST_KG_M3 = 25_000.0
"""Osmium, the densest metal, weighs 22,600 kg/m3."""
LEAST_KG_M2 = 0.05
"""Of surface. A foil of 0.1 mm weighs 0.09 kg/m2, and has two sides."""
_THINNEST_M = 1e-4
"""A closed mesh that is thinner on average is a sheet, whose volume means nothing."""


class Volumes(NamedTuple):
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
def volumes_of(mesh: TriangleMesh) -> Volumes:
    """Return what a mesh encloses."""
    triangles = mesh.triangles_m
    sides = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    area_m2 = float(np.linalg.norm(sides, axis=1).sum()) / 2.0
    numbers = corner_numbers(mesh)
    volumes_m3 = np.bincount(pieces_of(numbers), np.linalg.det(triangles - mesh.bounds_m.mean(axis=0)) / 6.0)
    most_m3 = float(np.abs(volumes_m3).sum())
    if not is_matched(numbers) or most_m3 <= _THINNEST_M * area_m2 / 2.0:
        return Volumes(0.0, np.inf, area_m2)
    return Volumes(abs(float(volumes_m3.sum())), most_m3, area_m2)
