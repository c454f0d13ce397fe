from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from reference import box_mesh, cell_set, rotation, surface_cells

from bimvox.bim.building import TriangleMesh
from bimvox.voxelization.bits import empty_planes, unpack
from bimvox.voxelization.lattice import TOLERANCE_M, cell_range, lattice_triangles, tolerance_vox
from bimvox.voxelization.part import voxelize_mesh
from bimvox.voxelization.surface import mark_surface

H = 0.25


def met_cells(mesh: TriangleMesh, h: float) -> set[tuple[int, int, int]]:
    triangles, bounds = lattice_triangles(mesh.vertices_m, mesh.faces, h, (0, 0, 0))
    low, high = cell_range(bounds[0], bounds[1], h)
    cells = empty_planes(*(int(n) for n in high - low))
    mark_surface(cells, triangles - low, tolerance_vox(h))
    return set(map(tuple, (np.argwhere(unpack(cells.met, cells.height)) + low).tolist()))


# Coordinates on cell borders, on millimetres, and anywhere: ties, degenerate and ordinary triangles.
coordinates = st.one_of(
    st.integers(-5, 5).map(lambda n: n * H),
    st.integers(-1200, 1200).map(lambda n: n / 1000),
    # Not as far from a border as the tolerance itself: whether such a corner counts is a matter of rounding.
    st.floats(-1.2, 1.2, allow_nan=False)
    .map(lambda x: round(x, 7) + 3e-8)
    .filter(lambda x: abs(abs(x - round(x / H) * H) - TOLERANCE_M) > 1e-6),
)
triangles = st.lists(st.tuples(*[coordinates] * 9), min_size=1, max_size=4)


@settings(max_examples=300, deadline=None)
@given(triangles)
def test_surface_equals_the_brute_force_reference(soup: list[tuple[float, ...]]) -> None:
    vertices = np.array(soup).reshape(-1, 3)
    mesh = TriangleMesh(vertices, np.arange(len(vertices), dtype=np.int32).reshape(-1, 3))
    assert met_cells(mesh, H) == surface_cells(mesh, H, TOLERANCE_M)


@pytest.mark.slow
def test_surface_equals_the_reference_on_many_generic_triangles() -> None:
    rng = np.random.default_rng(1)
    vertices = rng.normal(size=(150, 3))
    vertices[::3] *= 3.0
    mesh = TriangleMesh(vertices, np.arange(150, dtype=np.int32).reshape(-1, 3))
    assert met_cells(mesh, 0.1) == surface_cells(mesh, 0.1, TOLERANCE_M)


def test_slivers_and_points_meet_the_cells_that_their_edges_meet() -> None:
    vertices = np.array([[0.05, 0.06, 0.07], [2.05, 1.06, 0.57], [1.05, 0.56, 0.32], [0.6, 0.6, 0.6]])
    mesh = TriangleMesh(vertices, np.array([[0, 1, 2], [3, 3, 3]], np.int32))
    assert met_cells(mesh, H) == surface_cells(mesh, H, TOLERANCE_M)
    assert (2, 2, 2) in met_cells(mesh, H)


def test_faces_on_cell_borders_do_not_spill() -> None:
    voxels = voxelize_mesh(box_mesh((0.25, 0.5, -0.25), (1.0, 1.0, 0.5)), H)
    assert voxels.low.tolist() == [1, 2, -1]
    assert voxels.cells.shape == (3, 2, 3)
    assert voxels.cells.all()
    assert np.all(voxels.fractions == 1.0)


@pytest.mark.parametrize("reach", [0.5, 0.99, 1.01, 2.0])
def test_a_cell_is_met_when_the_part_reaches_more_than_the_tolerance_into_it(reach: float) -> None:
    voxels = voxelize_mesh(box_mesh((0.0, 0.0, 0.0), (0.5 + reach * TOLERANCE_M, 0.25, 0.25)), H)
    assert voxels.cells.shape == ((3 if reach > 1.0 else 2), 1, 1)
    assert voxels.cells.all()


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("thickness_m", [0.0, 0.5 * TOLERANCE_M, 1.9 * TOLERANCE_M])
def test_a_plate_on_a_border_belongs_to_the_cell_above(axis: int, thickness_m: float) -> None:
    low, high = np.array([0.0, 0.0, 0.0]), np.array([1.0, 1.0, 1.0])
    low[axis] = 0.5 - thickness_m / 2.0
    high[axis] = 0.5 + thickness_m / 2.0
    voxels = voxelize_mesh(box_mesh(low, high), H)
    assert voxels.low[axis] == 2
    assert voxels.cells.shape == tuple(1 if n == axis else 4 for n in range(3))
    assert voxels.cells.all()


def test_a_thin_flange_on_a_border_is_kept_although_its_part_has_other_cells() -> None:
    block = box_mesh((0.0, 0.0, 0.0), (0.5, 0.5, 1.0))
    flange = box_mesh((0.5, 0.0, 0.5), (1.25, 0.5, 0.50005))
    faces = np.concatenate([block.faces, flange.faces + 8])
    voxels = voxelize_mesh(TriangleMesh(np.concatenate([block.vertices_m, flange.vertices_m]), faces), H)
    expected = np.zeros((5, 2, 4), bool)
    expected[:2] = True
    expected[2:, :, 2] = True
    np.testing.assert_array_equal(voxels.cells, expected)


def test_a_thin_flange_on_the_top_of_its_part_belongs_to_the_cell_below() -> None:
    block = box_mesh((0.0, 0.0, 0.0), (0.5, 0.5, 1.0))
    flange = box_mesh((0.5, 0.0, 1.0), (1.25, 0.5, 1.00005))
    faces = np.concatenate([block.faces, flange.faces + 8])
    voxels = voxelize_mesh(TriangleMesh(np.concatenate([block.vertices_m, flange.vertices_m]), faces), H)
    assert voxels.cells.shape == (5, 2, 4)
    assert voxels.cells[2:, :, 3].all()
    assert not voxels.cells[2:, :, :3].any()


@pytest.mark.parametrize("size_m", [1e-6, 1e-3])
@pytest.mark.parametrize("at", [0.0, 0.25, 0.1])
def test_nothing_vanishes_however_small(size_m: float, at: float) -> None:
    low = np.full(3, at - size_m / 2.0)
    assert voxelize_mesh(box_mesh(low, low + size_m), 10.0).cells.any()
    assert voxelize_mesh(box_mesh(low, low + size_m), H).cells.any()


def test_thin_tilted_plate_at_a_coarse_cell_is_connected() -> None:
    turn = rotation(np.random.default_rng(7))
    plate = box_mesh((-2.0, -2.0, -0.001), (2.0, 2.0, 0.001))
    mesh = TriangleMesh(plate.vertices_m @ turn.T, plate.faces)
    voxels = voxelize_mesh(mesh, 0.5)
    assert cell_set(voxels) == surface_cells(mesh, 0.5, TOLERANCE_M)
    assert voxels.solid_volume_m3 == pytest.approx(4 * 4 * 0.002, rel=1e-5)
