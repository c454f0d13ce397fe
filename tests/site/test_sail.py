import numpy as np
import pytest
from box_buildings import box_element

from bimvox.bim.building import TriangleMesh
from bimvox.site.parts import sail_area_m2


def joined(*meshes: TriangleMesh) -> TriangleMesh:
    faces = [mesh.faces + sum(len(m.vertices_m) for m in meshes[:n]) for n, mesh in enumerate(meshes)]
    return TriangleMesh(np.concatenate([m.vertices_m for m in meshes]), np.concatenate(faces).astype(np.int32))


def box(low, high) -> TriangleMesh:
    return box_element("b", low, high).mesh


def test_a_wall_shows_its_face_and_a_slab_its_edge():
    # Every 5 degrees: the outline of a box of 6 x 0.2 x 3 is at most slightly larger than its face.
    assert sail_area_m2(box((0, 0, 0), (6, 0.2, 3))) == pytest.approx(6.0 * 3.0, rel=0.01)
    slab = sail_area_m2(box((0, 0, 0), (6, 2, 0.2)))
    assert 0.2 * 6.0 < slab <= 0.2 * np.hypot(6, 2) + 1e-9


def test_a_column_that_is_tipped_up_shows_its_side_lying_too():
    assert sail_area_m2(box((0, 0, 0), (0.4, 0.4, 5))) == pytest.approx(5 * 0.4 * 2**0.5, rel=0.01)
    assert sail_area_m2(box((0, 0, 0), (3, 0.4, 0.4)), tipped=True) == pytest.approx(3 * 0.4 * 2**0.5, rel=0.02)


def test_inner_faces_do_not_count():
    shells = joined(*(box((0.1 * n, 0.1 * n, 0.1 * n), (4, 1, 2)) for n in range(6)))
    assert sail_area_m2(shells) == pytest.approx(sail_area_m2(box((0, 0, 0), (4, 1, 2))), rel=1e-6)


def test_two_posts_show_no_more_than_their_faces():
    posts = joined(box((0, 0, 0), (0.2, 0.2, 3)), box((5, 0, 0), (5.2, 0.2, 3)))
    assert sail_area_m2(posts) == pytest.approx(2 * 3 * 0.2 * 2**0.5, rel=0.01)
