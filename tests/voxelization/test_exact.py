"""Cell by cell against independent references: separating axes, solid angles, and volumes of a boolean kernel."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st
from reference import (
    border_cells,
    box_mesh,
    cell_set,
    inverted,
    joined,
    moved,
    rotation,
    shuffled,
    solid_cells,
    split,
    surface_cells,
    tetrahedra,
    without_faces,
)
from scipy import ndimage

from bimvox.bim.building import TriangleMesh
from bimvox.bim.read import read_building
from bimvox.voxelization.lattice import TOLERANCE_M
from bimvox.voxelization.part import PartVoxels, voxelize_mesh

H = 0.25
SAMPLES = Path(__file__).parents[2] / "sample_models"


def exact(mesh: TriangleMesh) -> TriangleMesh:
    """Coordinates on even steps of a lattice that are exact in 0.25 m cells and in float64 metres."""
    return TriangleMesh(np.rint(mesh.vertices_m * 2**20) / 2**20, mesh.faces)


def random_tetrahedra(seed: int) -> TriangleMesh:
    rng = np.random.default_rng(seed)
    return exact(tetrahedra(rng.uniform(-1.0, 1.0, size=(rng.integers(1, 5), 4, 3))))


def random_boxes(seed: int) -> TriangleMesh:
    """Return a few rotated, overlapping boxes in one mesh."""
    rng = np.random.default_rng(seed)
    boxes = []
    for _ in range(rng.integers(1, 4)):
        half = rng.uniform(0.01, 0.7, size=3)
        boxes.append(moved(box_mesh(-half, half), turn=rotation(rng), by=rng.uniform(-0.6, 0.6, size=3)))
    return exact(joined(*boxes))


def boolean_body(seed: int) -> TriangleMesh:
    """Return a hull with another one cut out or joined: cavities, notches, through holes, several bodies."""
    manifold3d = pytest.importorskip("manifold3d")
    rng = np.random.default_rng(seed)
    first, second = (
        manifold3d.Manifold.hull_points(rng.uniform(-1.0, 1.0, size=(12, 3)) * scale) for scale in (1.0, 0.6)
    )
    whole = first - second if rng.random() < 0.7 else first + second.translate(rng.uniform(-1, 1, size=3).tolist())
    mesh = whole.to_mesh64()
    return TriangleMesh(np.array(mesh.vert_properties[:, :3], np.float64), np.array(mesh.tri_verts, np.int32))


seeds = st.integers(0, 2**32 - 1)
solids = st.one_of(st.builds(random_tetrahedra, seeds), st.builds(random_boxes, seeds), st.builds(boolean_body, seeds))


def same(a: PartVoxels, b: PartVoxels) -> bool:
    """Return everything about a part, bit for bit, except its volume."""
    arrays = [(getattr(a, name), getattr(b, name)) for name in ("low", "columns", "runs", "shares")]
    return all(np.array_equal(x, y) for x, y in arrays) and a.fill == b.fill and a.shape == b.shape


@pytest.mark.slow
@settings(max_examples=60, deadline=None)
@given(solids, st.booleans())
def test_closed_meshes_equal_the_reference(mesh: TriangleMesh, inside_out: bool) -> None:
    voxels = voxelize_mesh(inverted(mesh) if inside_out else mesh, H)
    assert cell_set(voxels) == solid_cells(mesh, H, TOLERANCE_M)
    assert voxels.fill == "winding"


# Corners on cell borders, on quarters of cells, and slightly off: sheets, plates and blocks with faces on borders.
places = st.one_of(
    st.integers(0, 4).map(lambda n: n * H),
    st.integers(0, 16).map(lambda n: n * H / 4),
    st.tuples(st.integers(0, 4), st.sampled_from([-1e-12, 1e-12, 3e-5, -3e-5, 8e-5])).map(lambda p: p[0] * H + p[1]),
)


@pytest.mark.slow
@settings(max_examples=100, deadline=None)
@given(st.lists(st.tuples(*[places] * 6), min_size=1, max_size=3))
def test_blocks_and_plates_on_borders_equal_the_rule(boxes: list[tuple[float, ...]]) -> None:
    sorted_boxes = [(np.minimum(box[:3], box[3:]), np.maximum(box[:3], box[3:])) for box in boxes]
    mesh = joined(*(box_mesh(low, high) for low, high in sorted_boxes))
    cells = cell_set(voxelize_mesh(mesh, H))
    expected = solid_cells(mesh, H, TOLERANCE_M) | border_cells(mesh, H, TOLERANCE_M)
    assume(expected)
    assert cells == expected


@pytest.mark.slow
@settings(max_examples=60, deadline=None)
@given(st.builds(random_tetrahedra, seeds), st.lists(st.integers(0, 3), min_size=1, max_size=3))
@example(random_tetrahedra(4273), [0, 2])  # a pocket of one cell between surface cells
def test_open_meshes_keep_their_surface_and_gain_nothing_that_outside_reaches(
    mesh: TriangleMesh, drop: list[int]
) -> None:
    opened = without_faces(mesh, *drop)
    surface, cells = surface_cells(opened, H, TOLERANCE_M), cell_set(voxelize_mesh(opened, H))
    assert surface <= cells <= solid_cells(mesh, H, TOLERANCE_M) | enclosed_cells(surface)


def enclosed_cells(surface: set[tuple[int, int, int]]) -> set[tuple[int, int, int]]:
    """Return the cells that no way through faces leads to from outside: an open mesh may fill them."""
    low = np.min(list(surface), axis=0) - 1
    wall = np.zeros(np.max(list(surface), axis=0) - low + 2, np.bool_)
    wall[tuple((np.array(list(surface)) - low).T)] = True
    regions, _ = ndimage.label(~wall)
    inside = np.argwhere(~wall & (regions != regions[0, 0, 0])) + low
    return set(map(tuple, inside.tolist()))


@settings(max_examples=60, deadline=None)
@given(solids, seeds)
def test_the_order_of_triangles_and_corners_does_not_matter(mesh: TriangleMesh, seed: int) -> None:
    start, other = voxelize_mesh(mesh, 0.1), voxelize_mesh(shuffled(mesh, np.random.default_rng(seed)), 0.1)
    assert same(other, start)
    assert other.solid_volume_m3 == pytest.approx(start.solid_volume_m3, rel=1e-9, abs=1e-12)


@settings(max_examples=60, deadline=None)
@given(st.one_of(st.builds(random_tetrahedra, seeds), st.builds(random_boxes, seeds)), seeds)
def test_splitting_triangles_does_not_change_the_cells(mesh: TriangleMesh, seed: int) -> None:
    rng = np.random.default_rng(seed)
    assert cell_set(voxelize_mesh(split(mesh, rng), H)) == cell_set(voxelize_mesh(mesh, H))


AXES = ((0, 1), (1, 2), (2, 0))


@settings(max_examples=60, deadline=None)
@given(solids, st.sampled_from(AXES))
def test_a_quarter_turn_permutes_the_cells(mesh: TriangleMesh, axes: tuple[int, int]) -> None:
    turn = np.eye(3)
    turn[list(axes)] = 0.0
    turn[axes[0], axes[1]], turn[axes[1], axes[0]] = -1.0, 1.0
    start, end = voxelize_mesh(mesh, 0.1), voxelize_mesh(moved(mesh, turn=turn), 0.1)
    np.testing.assert_array_equal(end.cells, np.rot90(start.cells, 1, axes=axes))
    if axes == (0, 1):
        # The 16 lines are along z: a turn about z turns the shares bit for bit.
        np.testing.assert_array_equal(end.fractions, np.rot90(start.fractions, 1, axes=axes))
        assert end.solid_volume_m3 == pytest.approx(start.solid_volume_m3, rel=1e-9)
    else:
        # After a turn about x or y, shares are measured again, and so are the volumes derived from them.
        assert end.fractions.sum() == pytest.approx(start.fractions.sum(), rel=0.1, abs=1.0)
        assert end.solid_volume_m3 == pytest.approx(start.solid_volume_m3, rel=0.1, abs=1e-3)


@settings(max_examples=40, deadline=None)
@given(solids, st.integers(0, 2))
def test_a_mirror_mirrors_the_cells(mesh: TriangleMesh, axis: int) -> None:
    flip = np.eye(3)
    flip[axis, axis] = -1.0
    start, end = voxelize_mesh(mesh, 0.1), voxelize_mesh(moved(mesh, turn=flip), 0.1)
    np.testing.assert_array_equal(end.cells, np.flip(start.cells, axis))
    if axis == 2:
        np.testing.assert_array_equal(end.fractions, np.flip(start.fractions, axis))


@settings(max_examples=60, deadline=None)
@given(
    st.tuples(*[st.floats(0.1, 3.0)] * 2),
    st.one_of(st.just(0.0), st.floats(1e-6, 2e-3)),
    st.tuples(*[st.floats(-0.5, 0.5)] * 3),
    st.one_of(st.just(0.0), st.floats(-2e-3, 2e-3), st.floats(-1.5, 1.5)),
    st.one_of(st.just(0.0), st.floats(-2e-3, 2e-3), st.floats(-1.5, 1.5)),
    st.sampled_from([0.05, 0.25, 1.0, 10.0]),
    st.permutations(range(3)),
)
def test_thin_plates_leave_cells_all_over(size, thickness, place, slope_x, slope_y, h, order) -> None:
    half = np.array([*size, thickness]) / 2.0
    plate = box_mesh(-half, half)
    shear = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [slope_x, slope_y, 1.0]])
    vertices = (plate.vertices_m @ shear.T + place)[:, list(order)]
    mesh = TriangleMesh(vertices, plate.faces)
    cells = np.array(sorted(cell_set(voxelize_mesh(mesh, h))))
    assert len(cells) > 0
    # No point of the plate is further than half a cell from one of its cells.
    rng = np.random.default_rng(0)
    points = (rng.uniform(-1, 1, size=(100, 3)) * half) @ shear.T + place
    points = points[:, list(order)]
    gaps = np.maximum(cells[None] * h - points[:, None], points[:, None] - (cells[None] + 1) * h).max(axis=2)
    assert gaps.min(axis=1).max() <= h / 2 + 2 * TOLERANCE_M


def test_a_needle_leaves_cells_all_along() -> None:
    for at in (0.0, 0.25, 0.1, 0.2499):
        needle = box_mesh((0.0, at, at), (5.0, at + 1e-5, at + 1e-5))
        voxels = voxelize_mesh(needle, H)
        assert voxels.shape == (20, 1, 1)
        assert voxels.count == 20


def parts_of(name: str, count: int) -> list[TriangleMesh]:
    """Return parts spread over a sample model, small enough for the brute-force reference."""
    elements = read_building(SAMPLES / name).elements
    small = [e.mesh for e in elements if len(e.mesh.faces) <= 130 and np.prod(np.ptp(e.mesh.bounds_m, axis=0)) < 1.5]
    return small[:: max(1, len(small) // count)][:count]


@pytest.fixture(scope="module")
def sample_parts() -> list[TriangleMesh]:
    return parts_of("prefab.ifc", 7) + parts_of("frame.ifc", 2)


@pytest.mark.parametrize("h", [0.1, 0.3])
def test_sample_models_equal_the_reference(sample_parts: list[TriangleMesh], h: float) -> None:
    for mesh in sample_parts:
        assert cell_set(voxelize_mesh(mesh, h)) == solid_cells(mesh, h, TOLERANCE_M)


@pytest.mark.parametrize("h", [0.1, 0.3])
def test_sample_models_equal_a_boolean_kernel(sample_parts: list[TriangleMesh], h: float) -> None:
    manifold3d = pytest.importorskip("manifold3d")
    inner = manifold3d.Manifold.cube([h - 2.0 * TOLERANCE_M] * 3).translate([TOLERANCE_M] * 3)
    checked = 0
    for mesh in sample_parts:
        welded, faces = np.unique(mesh.vertices_m.round(9), axis=0, return_inverse=True)
        part = manifold3d.Manifold(manifold3d.Mesh64(welded, faces.reshape(-1)[mesh.faces].astype(np.uint64)))
        if part.status() != manifold3d.Error.NoError:
            continue
        voxels = voxelize_mesh(mesh, h)
        marked = np.pad(voxels.cells, 1)
        for cell in np.argwhere(np.ones_like(marked)):
            corner = (voxels.low - 1 + cell) * h
            common = (part ^ inner.translate(corner.tolist())).volume()
            assert marked[tuple(cell)] == (common > 1e-9 * h**3), (cell, common)
        checked += 1
    assert checked >= 5
