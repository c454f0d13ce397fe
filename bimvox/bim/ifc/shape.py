"""The shape of products as the geometry processes return it: clean triangles, measured, in their own frame."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bimvox.bim.building import TriangleMesh
from bimvox.bim.mesh.repair import Solid, drop_bad_faces, solid_of, turn_outward


@dataclass(frozen=True, slots=True, eq=False)
class Shape:
    """Clean triangles in the own frame of the products that share them.

    Attributes:
        mesh: Metres; faces look outward, all vertices are used.
        solid: What it encloses.
        dropped: Triangles without area that were dropped.
        turned: Whether faces had to be turned outward.
    """

    mesh: TriangleMesh
    solid: Solid
    dropped: int
    turned: bool


@dataclass(frozen=True, slots=True, eq=False)
class PlacedShape:
    """The shape of one product, and its placement.

    Attributes:
        shape: Clean triangles in the product's own frame; products may share one.
        placement: (4, 4) float64, product to world, metres.
    """

    shape: Shape
    placement: NDArray[np.float64]

    def mesh(self, origin_m: NDArray[np.float64]) -> TriangleMesh:
        """Return the mesh relative to a world point; subtracted first, so that a far placement costs no precision."""
        shift: NDArray[np.float64] = self.placement[:3, 3] - origin_m
        own = self.shape.mesh
        return TriangleMesh(own.vertices_m @ self.placement[:3, :3].T + shift, own.faces)


def clean_shape(vertices_m: NDArray[np.float64], faces: NDArray[np.int32]) -> Shape | str:
    """Return a kernel's triangles, repaired and measured; or the reason why they are not a shape.

    Args:
        vertices_m: (V, 3).
        faces: (F, 3).
    """
    if not len(faces):
        return "no triangles"
    mesh, dropped = drop_bad_faces(TriangleMesh(vertices_m, faces))
    if not len(mesh.faces):
        return "its triangles have no area"
    mesh, shells, turned = turn_outward(mesh)
    solid = solid_of(shells)
    used, index = np.unique(mesh.faces, return_inverse=True)
    mesh = TriangleMesh(mesh.vertices_m[used], index.reshape(-1, 3).astype(np.int32))
    return Shape(mesh, solid, dropped, turned)
