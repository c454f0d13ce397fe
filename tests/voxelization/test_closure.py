from __future__ import annotations

import numpy as np
import pytest
from reference import box_mesh, inverted, joined, sphere_mesh, without_faces

from bimvox.bim.building import TriangleMesh
from bimvox.voxelization.meshes import corner_keys, edges_match, inverted_faces, openness


def keys_of(mesh: TriangleMesh):
    return corner_keys(mesh.triangles_m)


def closed(mesh: TriangleMesh) -> bool:
    return bool(edges_match(keys_of(mesh)))


def test_closed_meshes_match_whether_welded_or_not() -> None:
    sphere = sphere_mesh(1.0)
    soup = TriangleMesh(
        sphere.triangles_m.reshape(-1, 3), np.arange(3 * len(sphere.faces), dtype=np.int32).reshape(-1, 3)
    )
    assert closed(sphere)
    assert closed(soup)
    assert closed(joined(sphere, box_mesh((0, 0, 0), (1, 1, 1))))


def test_any_missing_or_turned_face_is_noticed() -> None:
    box = box_mesh((0, 0, 0), (1, 1, 1))
    for face in range(12):
        assert not closed(without_faces(box, face))
        faces = box.faces.copy()
        faces[face] = faces[face, ::-1]
        assert not closed(TriangleMesh(box.vertices_m, faces))


def test_openness_distinguishes_sheets_from_shells() -> None:
    box = box_mesh((0, 0, 0), (1, 1, 1))
    assert openness(box.triangles_m) == pytest.approx(0.0, abs=1e-12)
    assert openness(without_faces(box, 2, 3).triangles_m) == pytest.approx(1 / 5)
    assert openness(box.triangles_m[:2]) == pytest.approx(1.0)
    assert openness(np.zeros((1, 3, 3))) == 1.0


def test_inside_out_shells_are_found_and_cavities_are_left() -> None:
    outer, cavity = box_mesh((0, 0, 0), (3, 3, 3)), inverted(box_mesh((1, 1, 1), (2, 2, 2)))
    wrong = inverted(box_mesh((5, 0, 0), (6, 1, 1)))
    mesh = joined(outer, cavity, wrong)
    flips = inverted_faces(mesh.triangles_m, keys_of(mesh))
    assert flips.reshape(3, 12).tolist() == [[False] * 12, [False] * 12, [True] * 12]
