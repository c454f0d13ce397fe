"""How thick a part is under each of its triangles."""

import numpy as np
import pytest
from box_sites import box_mesh
from hostile_bodies import joined, prism, sliver_in_one_piece, turned_over

from bimvox.bim.building import TriangleMesh
from bimvox.planning.contact.local_thickness import thicknesses_m


def thick_m(mesh: TriangleMesh, reach_m: float = 10.0) -> np.ndarray:
    _, numbers = np.unique(mesh.vertices_m.round(7), axis=0, return_inverse=True)
    triangles = mesh.triangles_m
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    inward = -normals / np.linalg.norm(normals, axis=1)[:, None]
    return thicknesses_m(triangles, inward, numbers.reshape(-1)[mesh.faces], reach_m)


def test_a_box_is_as_thick_as_it_is_wide_on_every_axis():
    found = thick_m(box_mesh((1, 2, 3), (1.2, 2.5, 6)))
    assert sorted(found) == pytest.approx([0.2] * 4 + [0.5] * 4 + [3.0] * 4)
    assert (thick_m(box_mesh((0, 0, 0), (1, 1, 1)), reach_m=0.5) == np.inf).all()


def test_under_a_face_with_a_veil_the_veil_counts():
    mesh = sliver_in_one_piece(0.00027)
    found, plane = thick_m(mesh), (mesh.triangles_m[:, :, 1] == -0.00027).all(axis=1)
    assert found[plane].min() == pytest.approx(0.00027)
    assert found[(mesh.triangles_m[:, :, 1] == 0.3).all(axis=1)] == pytest.approx(0.30027)


def test_a_wedge_is_not_as_thin_as_its_edge():
    wedge = prism([(0.0, 0.0), (4.0, 0.0), (4.0, 1.0)], 0.0, 2.0)
    bottom = (wedge.triangles_m[:, :, 2] == 0.0).all(axis=1)
    assert (thick_m(wedge)[bottom] >= 0.5).all()
    needle = prism([(0.0, 0.0), (0.0, 0.0006), (-0.7, 0.0003)], 0.0, 0.0006)
    assert (np.sort(thick_m(needle))[:10] <= 0.0006).all(), "all but its base"


def test_between_layers_there_is_no_surface():
    whole = thick_m(joined(box_mesh((0, 0, 0), (0.2, 3, 3)), box_mesh((0.2, 0, 0), (0.205, 3, 3))))
    between = np.isinf(whole)
    assert between.sum() == 4
    assert whole[~between].min() == pytest.approx(0.205)


def test_both_sides_of_a_sheet_are_no_surface():
    sheet = TriangleMesh(np.array([(0.0, 0, 0), (1, 0, 0), (0, 1, 0)]), np.array([(0, 1, 2)], np.int32))
    assert np.isinf(thick_m(joined(sheet, turned_over(sheet)))).all()


def test_of_a_very_fine_mesh_nothing_is_measured():
    box = box_mesh((0, 0, 0), (1, 1, 1))
    fine = TriangleMesh(box.vertices_m, np.tile(box.faces, (2000, 1)))
    assert np.isinf(thick_m(fine)).all()
