import numpy as np
import pytest
from box_sites import box_mesh
from hostile_bodies import joined, prism, sliver, sliver_in_one_piece, spike, turned_over, without
from hypothesis import given
from hypothesis import strategies as st

from bimvox.bim.building import TriangleMesh
from bimvox.planning.contact.erosion import eroded_triangles_m, thicknesses_m

sizes = st.floats(0.2, 5.0)


@given(sizes, sizes, sizes, st.floats(0.001, 0.05))
def test_a_box_shrinks_by_the_depth_on_every_side(x, y, z, depth):
    eroded = eroded_triangles_m(box_mesh((0, 0, 0), (x, y, z)), depth)
    assert eroded.min(axis=(0, 1)) == pytest.approx([depth] * 3, abs=1e-6)
    assert eroded.max(axis=(0, 1)) == pytest.approx([x - depth, y - depth, z - depth], abs=1e-6)


def test_an_inverted_box_shrinks_too():
    box = box_mesh((0, 0, 0), (1, 1, 1))
    inverted = TriangleMesh(box.vertices_m, box.faces[:, ::-1].copy())
    eroded = eroded_triangles_m(inverted, 0.01)
    assert eroded.min() == pytest.approx(0.01)
    assert eroded.max() == pytest.approx(0.99)


def test_the_inner_corner_of_an_l_moves_into_the_solid():
    outline = np.array([(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)], float)
    caps = np.array([(0, 1, 3), (1, 2, 3), (0, 3, 5), (3, 4, 5)])
    bottom, top = np.c_[outline, np.zeros(6)], np.c_[outline, np.ones(6)]
    sides = [((n, (n + 1) % 6, 6 + n), ((n + 1) % 6, 6 + (n + 1) % 6, 6 + n)) for n in range(6)]
    faces = np.concatenate([caps[:, ::-1], caps + 6, np.array(sides).reshape(-1, 3)]).astype(np.int32)
    mesh = TriangleMesh(np.concatenate([bottom, top]), faces)
    assert mesh.signed_volume_m3 == pytest.approx(3.0)
    eroded = eroded_triangles_m(mesh, 0.1)
    corners = {tuple(round(float(v), 4) for v in corner) for corner in eroded.reshape(-1, 3)}
    plan = [(0.1, 0.1), (1.9, 0.1), (1.9, 0.9), (0.9, 0.9), (0.9, 1.9), (0.1, 1.9)]
    assert corners == {(x, y, z) for x, y in plan for z in (0.1, 0.9)}


def test_no_vertex_moves_farther_than_a_mitre_allows():
    needle = TriangleMesh(
        np.array([(0, 0, 0), (1, 0, 0), (0.5, 0.02, 0), (0.5, 0.01, 3.0)]),
        np.array([(0, 2, 1), (0, 1, 3), (1, 2, 3), (2, 0, 3)], np.int32),
    )
    eroded = eroded_triangles_m(needle, 0.01)
    original = needle.triangles_m
    assert np.linalg.norm(eroded - original, axis=2).max() <= 0.03 + 1e-9


def _with(*meshes):
    """Return one mesh of several bodies."""
    first = np.cumsum([0, *(len(m.vertices_m) for m in meshes[:-1])])
    faces = np.concatenate([m.faces + n for m, n in zip(meshes, first, strict=True)]).astype(np.int32)
    return TriangleMesh(np.concatenate([m.vertices_m for m in meshes]), faces)


def test_a_thin_body_of_a_thick_part_is_not_turned_inside_out():
    column, pad = box_mesh((0, 0, 0), (0.4, 0.3, 3.0)), box_mesh((0.1, 0.1, 3.0), (0.102, 0.102, 3.002))
    eroded = eroded_triangles_m(_with(column, pad), 0.01)
    of_pad = eroded[len(column.faces) :]
    assert eroded[: len(column.faces)].max(axis=(0, 1)) == pytest.approx([0.39, 0.29, 2.99])
    assert (of_pad.min(axis=(0, 1)) > (0.1, 0.1, 3.0)).all()
    assert (of_pad.max(axis=(0, 1)) < (0.102, 0.102, 3.002)).all()


def test_a_cavity_grows_by_the_depth_however_small_it_is():
    block, cavity = box_mesh((0, 0, 0), (1, 1, 1)), box_mesh((0.5, 0.5, 0.5), (0.504, 0.504, 0.504))
    hollow = _with(block, TriangleMesh(cavity.vertices_m, cavity.faces[:, ::-1].copy()))
    inner = eroded_triangles_m(hollow, 0.01)[len(block.faces) :]
    assert inner.min(axis=(0, 1)) == pytest.approx([0.49] * 3)
    assert inner.max(axis=(0, 1)) == pytest.approx([0.514] * 3)


@pytest.mark.parametrize("make", [sliver, sliver_in_one_piece, spike])
@pytest.mark.parametrize("thick_m", [0.00027, 0.0006, 0.002, 0.015])
def test_slivers_and_spikes_are_not_turned_inside_out(make, thick_m):
    mesh = make(thick_m)
    low, high = mesh.bounds_m
    moved = eroded_triangles_m(mesh, 0.01)
    assert (moved.min(axis=(0, 1)) >= low - 1e-9).all()
    assert (moved.max(axis=(0, 1)) <= high + 1e-9).all()
    thin = (mesh.triangles_m[:, :, 1] <= 0.0).all(axis=1) & (mesh.triangles_m[:, :, 0] < 0.3).any(axis=1)
    assert (moved[thin][:, :, 1] <= 1e-9).all(), "it stays where it is thin"


def test_an_open_shell_stays_where_it_is():
    box = box_mesh((0, 0, 0), (1, 1, 1))
    for shell in (without(box, 0, 1), turned_over(without(box, 4, 5)), without(box, 0, 1, 2, 3, 4)):
        assert (eroded_triangles_m(shell, 0.01) == shell.triangles_m).all()


def test_a_shell_with_a_small_hole_shrinks_however_it_faces():
    box = box_mesh((0, 0, 0), (4, 0.2, 0.2))
    for shell in (without(box, 8), turned_over(without(box, 8))):
        eroded = eroded_triangles_m(shell, 0.01)
        assert eroded[:, :, 1:].min(axis=(0, 1)) == pytest.approx([0.01, 0.01])
        assert eroded[:, :, 1:].max(axis=(0, 1)) == pytest.approx([0.19, 0.19])


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
