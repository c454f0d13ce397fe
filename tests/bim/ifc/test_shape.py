"""Shapes are cleaned and measured in the worker, and placed without loss of precision."""

from __future__ import annotations

import numpy as np

from bimvox.bim.building import TriangleMesh
from bimvox.bim.ifc.shape import PlacedShape, Shape, clean_shape
from bimvox.bim.mesh.repair import Solid

CORNERS = np.array(np.meshgrid([0, 1], [0, 1], [0, 1], indexing="ij"), dtype=float).reshape(3, -1).T
QUADS = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
FACES = np.array([half for a, b, c, d in QUADS for half in ((a, b, c), (a, c, d))], dtype=np.int32)


def test_an_inside_out_box_with_waste_is_cleaned() -> None:
    vertices = np.concatenate([[[9.0, 9.0, 9.0]], CORNERS])
    faces = np.concatenate([FACES[:, ::-1] + 1, [[1, 1, 2]]]).astype(np.int32)
    shape = clean_shape(vertices, faces)
    assert isinstance(shape, Shape)
    assert (shape.solid.volume_m3, shape.solid.exact, shape.dropped, shape.turned) == (1.0, True, 1, True)
    assert shape.mesh.signed_volume_m3 > 0
    assert np.array_equal(shape.mesh.vertices_m, CORNERS)


def test_shapes_that_are_not_a_surface_say_why() -> None:
    assert clean_shape(np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int32)) == "no triangles"
    flat = clean_shape(np.zeros((3, 3)), np.array([[0, 1, 2]], dtype=np.int32))
    assert flat == "its triangles have no area"


def test_far_placements_keep_their_precision() -> None:
    vertices = np.random.default_rng(0).uniform(-5, 5, (50, 3))
    shape = Shape(TriangleMesh(vertices, np.array([[0, 1, 2]], dtype=np.int32)), Solid(0.0, False, 0.0), 0, False)
    near, far = np.eye(4), np.eye(4)
    far[:3, 3] = origin = np.array([5_000_000.0, 450_000.0, 0.0])
    a = PlacedShape(shape, near).mesh(np.zeros(3))
    b = PlacedShape(shape, far).mesh(origin)
    assert np.array_equal(a.vertices_m, b.vertices_m)
