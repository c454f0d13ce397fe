from __future__ import annotations

import numpy as np
from box_sites import box_mesh

from bimvox.bim.building import TriangleMesh
from bimvox.rendering.page.geometry import geometry_of, shapes_of


def soup(mesh: TriangleMesh) -> TriangleMesh:
    """Return the same triangles, no two of which share a vertex."""
    corners = mesh.triangles_m.reshape(-1, 3)
    return TriangleMesh(corners, np.arange(len(corners), dtype=np.int32).reshape(-1, 3))


def tube(sides: int) -> TriangleMesh:
    angle = np.linspace(0, 2 * np.pi, sides, endpoint=False)
    ring = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    vertices = np.concatenate([np.c_[ring, np.zeros(sides)], np.c_[ring, np.ones(sides)]])
    n, m = np.arange(sides), (np.arange(sides) + 1) % sides
    faces = np.concatenate([np.c_[n, m, n + sides], np.c_[m, m + sides, n + sides]])
    return TriangleMesh(vertices, faces.astype(np.int32))


def test_a_box_has_eight_points_twelve_triangles_and_twelve_edges():
    for mesh in (box_mesh((1, 2, 3), (4, 4, 3.5)), soup(box_mesh((1, 2, 3), (4, 4, 3.5)))):
        geometry = geometry_of(mesh, 0.001)
        assert (len(geometry.points), len(geometry.faces), len(geometry.edges)) == (8, 12, 12)
        np.testing.assert_allclose(geometry.points.max(axis=0) * geometry.step_m, [3, 2, 0.5])


def test_turned_faces_do_not_make_edges():
    mesh = box_mesh((0, 0, 0), (1, 1, 1))
    faces = mesh.faces.copy()
    faces[::3] = faces[::3, ::-1]
    assert len(geometry_of(TriangleMesh(mesh.vertices_m, faces), 0.001).edges) == 12


def test_a_round_side_has_no_edges_but_its_rims_do():
    geometry = geometry_of(tube(48), 0.001)
    assert len(geometry.edges) == 2 * 48


def test_equal_parts_share_a_shape_wherever_they_stand():
    meshes = [box_mesh((0.1 * n, 7.3, n), (0.1 * n + 2.5, 7.6, n + 0.4)) for n in range(5)]
    shapes = shapes_of([*meshes, box_mesh((0, 0, 0), (1, 1, 1))], 10_000)
    assert len(shapes.geometries) == 2
    assert shapes.of_mesh == (0, 0, 0, 0, 0, 1)
    np.testing.assert_allclose(shapes.low_m[3], [0.3, 7.3, 3.0])


def test_beyond_the_budget_the_lattice_is_coarser():
    rng = np.random.default_rng(0)
    mesh = tube(400)
    rough = TriangleMesh(mesh.vertices_m + rng.normal(0, 0.004, mesh.vertices_m.shape), mesh.faces)
    fine, coarse = shapes_of([rough], 10**6), shapes_of([rough], 1_500)
    assert fine.step_m == 0.001
    assert coarse.step_m > 0.01
    assert len(coarse.geometries[0].faces) < len(fine.geometries[0].faces)


def test_a_huge_mesh_fits_sixteen_bits():
    geometry = geometry_of(box_mesh((0, 0, 0), (500, 10, 3)), 0.001)
    np.testing.assert_allclose(geometry.points.max(axis=0) * geometry.step_m, [500, 10, 3], atol=geometry.step_m)
