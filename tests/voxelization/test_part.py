from __future__ import annotations

import types
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from reference import box_mesh, cell_set, inverted, joined, moved, rotation, sphere_mesh, surface_cells, without_faces

from bimvox.bim.building import TriangleMesh
from bimvox.errors import GridTooLargeError, InputError
from bimvox.voxelization import solid
from bimvox.voxelization.lattice import TOLERANCE_M, cell_range
from bimvox.voxelization.meshes import Meshes, batches_of
from bimvox.voxelization.part import PartVoxels, voxelize_mesh, wind_batch
from bimvox.voxelization.runs import dense_cells, dense_fractions

H = 0.25
QUARTER_Z = np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1]])
QUARTER_X = np.array([[1, 0, 0], [0, 0, -1], [0, 1, 0]])


def same(a: PartVoxels, b: PartVoxels) -> bool:
    return bool(
        np.array_equal(a.low, b.low)
        and np.array_equal(a.cells, b.cells)
        and np.array_equal(a.fractions, b.fractions)
        and a.fill == b.fill
    )


def tilted_box(seed: int) -> TriangleMesh:
    rng = np.random.default_rng(seed)
    half = rng.uniform(0.02, 0.9, size=3)
    return moved(box_mesh(-half, half), turn=rotation(rng), by=rng.uniform(-1, 1, size=3))


@pytest.mark.parametrize("seed", range(6))
def test_solid_equals_a_boolean_oracle(seed: int) -> None:
    manifold3d = pytest.importorskip("manifold3d")
    mesh = tilted_box(seed)
    part = manifold3d.Manifold(manifold3d.Mesh64(mesh.vertices_m, mesh.faces.astype(np.uint64)))
    voxels = voxelize_mesh(mesh, H)
    low = voxels.low - 1
    expected = np.zeros(np.array(voxels.cells.shape) + 2, bool)
    shares = np.zeros(expected.shape)
    for cell in np.ndindex(expected.shape):
        corner = (low + cell) * H
        size = H - 2.0 * TOLERANCE_M
        inner = manifold3d.Manifold.cube([size] * 3).translate((corner + TOLERANCE_M).tolist())
        expected[cell] = (part ^ inner).volume() > 0.0
        shares[cell] = (part ^ manifold3d.Manifold.cube([H] * 3).translate(corner.tolist())).volume() / H**3
    np.testing.assert_array_equal(np.pad(voxels.cells, 1), expected)
    error = np.pad(voxels.fractions, 1) - np.where(expected, shares, 0.0)
    assert np.abs(error).max() < 0.2
    assert np.sqrt(np.mean(error[expected] ** 2)) < 0.04
    assert voxels.solid_volume_m3 == pytest.approx(part.volume(), rel=1e-6)


def test_a_sphere_is_filled_to_its_analytic_shape() -> None:
    radius = 1.0
    mesh = sphere_mesh(radius, rings=40)
    voxels = voxelize_mesh(mesh, 0.1)
    corners = (np.argwhere(np.ones_like(voxels.cells)) + voxels.low) * 0.1
    furthest = np.linalg.norm(np.maximum(np.abs(corners), np.abs(corners + 0.1)), axis=1)
    nearest = np.linalg.norm(
        np.where((corners < 0) & (corners + 0.1 > 0), 0.0, np.minimum(np.abs(corners), np.abs(corners + 0.1))), axis=1
    )
    cells, fractions = voxels.cells.ravel(), voxels.fractions.ravel()
    assert np.all(fractions[furthest < 0.99 * radius] == 1.0)
    assert not np.any(cells[nearest > radius])
    assert np.all(cells[nearest < 0.985 * radius])
    assert voxels.fill == "winding"
    assert voxels.solid_volume_m3 == pytest.approx(mesh.signed_volume_m3)
    assert fractions.sum() * 0.1**3 == pytest.approx(voxels.solid_volume_m3, rel=2e-3)


def test_fractions_of_a_box_are_exact_along_z_and_to_a_sixteenth_across() -> None:
    voxels = voxelize_mesh(box_mesh((0.0, 0.0, 0.0), (0.25, 0.3625, 0.45)), H)
    assert voxels.fractions[0, 0].tolist() == pytest.approx([1.0, 0.8], abs=1e-4)
    assert voxels.fractions[0, 1].tolist() == pytest.approx([0.45, 0.36], abs=1 / 32)


solids = st.builds(tilted_box, st.integers(0, 2**32 - 1))


@settings(max_examples=40, deadline=None)
@given(solids, st.tuples(*[st.integers(-40, 40)] * 3))
def test_moving_by_whole_cells_moves_the_cells(mesh: TriangleMesh, cells: tuple[int, int, int]) -> None:
    at_home = voxelize_mesh(mesh, 0.1)
    away = voxelize_mesh(moved(mesh, by=np.array(cells) * 0.1), 0.1)
    assert away.low.tolist() == (at_home.low + cells).tolist()
    np.testing.assert_array_equal(away.cells, at_home.cells)
    np.testing.assert_array_equal(away.fractions, at_home.fractions)


@settings(max_examples=40, deadline=None)
@given(solids)
def test_a_quarter_turn_permutes_the_grid(mesh: TriangleMesh) -> None:
    start = voxelize_mesh(mesh, 0.1)
    about_z = voxelize_mesh(moved(mesh, turn=QUARTER_Z), 0.1)
    turned = np.rot90(start.cells, 1, axes=(0, 1))
    np.testing.assert_array_equal(about_z.cells, turned)
    np.testing.assert_array_equal(about_z.fractions, np.rot90(start.fractions, 1, axes=(0, 1)))
    about_x = voxelize_mesh(moved(mesh, turn=QUARTER_X), 0.1)
    np.testing.assert_array_equal(about_x.cells, np.rot90(start.cells, 1, axes=(1, 2)))


@settings(max_examples=40, deadline=None)
@given(solids)
def test_an_inverted_mesh_gives_the_same(mesh: TriangleMesh) -> None:
    start, other = voxelize_mesh(mesh, 0.1), voxelize_mesh(inverted(mesh), 0.1)
    np.testing.assert_array_equal(other.cells, start.cells)
    np.testing.assert_allclose(other.fractions, start.fractions, atol=1e-6)
    assert other.fill == start.fill == "winding"
    assert other.solid_volume_m3 == pytest.approx(start.solid_volume_m3)


@settings(max_examples=30, deadline=None)
@given(st.lists(st.tuples(*[st.floats(-1, 1, width=32)] * 9), min_size=1, max_size=4))
def test_any_soup_of_triangles_keeps_all_its_surface(soup: list[tuple[float, ...]]) -> None:
    vertices = np.array(soup, np.float64).reshape(-1, 3)
    mesh = TriangleMesh(vertices, np.arange(len(vertices), dtype=np.int32).reshape(-1, 3))
    voxels = voxelize_mesh(mesh, H)
    assert voxels.cells.any()
    assert surface_cells(mesh, H, TOLERANCE_M) <= cell_set(voxels)
    assert np.all((voxels.fractions >= 0.0) & (voxels.fractions <= 1.0))
    assert not np.any(voxels.fractions[~voxels.cells])


def test_the_lattice_is_anchored_at_the_origin_given() -> None:
    mesh = box_mesh((0.1, 0.1, 0.1), (0.35, 0.35, 0.35))
    voxels = voxelize_mesh(mesh, H, (0.1, 0.1, -0.15))
    assert voxels.low.tolist() == [0, 0, 1]
    assert voxels.cells.shape == (1, 1, 1)


def test_far_from_the_origin_nothing_is_lost() -> None:
    mesh = box_mesh((0.0, 0.0, 0.0), (1.0, 0.5, 0.25))
    far = voxelize_mesh(moved(mesh, by=(500_000.0, 5_400_000.0, 0.0)), H)
    assert far.cells.shape == (4, 2, 1)
    assert far.cells.all()


def test_overlapping_shells_count_once_and_a_cavity_stays_empty() -> None:
    first, second = box_mesh((0, 0, 0), (2, 1, 1)), box_mesh((1, 0, 0), (3, 1, 1))
    voxels = voxelize_mesh(joined(first, second), H)
    assert voxels.cells.shape == (12, 4, 4)
    assert np.all(voxels.fractions == 1.0)
    assert voxels.solid_volume_m3 == pytest.approx(3.0)
    shell = voxelize_mesh(
        joined(box_mesh((0, 0, 0), (2, 2, 2)), inverted(box_mesh((0.5, 0.5, 0.5), (1.5, 1.5, 1.5)))), H
    )
    assert not shell.cells[2:6, 2:6, 2:6].any()
    assert shell.cells.sum() == 8**3 - 4**3
    assert shell.solid_volume_m3 == pytest.approx(7.0)
    assert shell.fill == "winding"


def test_an_inverted_shell_overlapping_a_right_one_is_turned() -> None:
    right, wrong = box_mesh((0, 0, 0), (2, 1, 1)), inverted(box_mesh((1, 0, 0), (3, 1, 1)))
    voxels = voxelize_mesh(joined(right, wrong), H)
    assert np.all(voxels.fractions == 1.0)
    assert voxels.cells.shape == (12, 4, 4)


def test_touching_boxes_have_the_exact_volume_of_both() -> None:
    touching = joined(
        box_mesh((0, 0, 0), (1.03, 1, 1)), box_mesh((1.03, 0, 0), (2, 1, 1)), box_mesh((0, 0, 1), (1, 1, 1.3))
    )
    assert voxelize_mesh(touching, H).solid_volume_m3 == pytest.approx(2.3)


def test_a_box_without_a_lid_is_filled_by_vote() -> None:
    closed = box_mesh((0.03, 0.03, 0.03), (2.22, 2.22, 2.22))
    for lid in [(0, 1), (2, 3), (6, 7)]:
        voxels = voxelize_mesh(without_faces(closed, *lid), H)
        assert voxels.fill == "vote"
        np.testing.assert_array_equal(voxels.cells, voxelize_mesh(closed, H).cells)
        assert voxels.solid_volume_m3 == pytest.approx(2.19**3, rel=0.03)


def test_a_small_hole_is_voted_over() -> None:
    mesh = sphere_mesh(1.0)
    whole = voxelize_mesh(mesh, 0.1)
    holed = voxelize_mesh(without_faces(mesh, *range(0, 12)), 0.1)
    assert holed.fill == "vote"
    assert np.all(holed.cells <= whole.cells)
    assert np.count_nonzero(whole.cells & ~holed.cells) < 40
    assert holed.fractions.sum() == pytest.approx(whole.fractions.sum(), rel=0.02)


def test_mixed_up_faces_are_filled_by_what_they_enclose() -> None:
    mesh = box_mesh((0.03, 0.03, 0.03), (2.03, 2.03, 1.03))
    faces = mesh.faces.copy()
    faces[[0, 1, 4, 5, 8, 9]] = faces[[0, 1, 4, 5, 8, 9]][:, ::-1]
    voxels = voxelize_mesh(TriangleMesh(mesh.vertices_m, faces), H)
    assert voxels.fill in ("vote", "flood")
    np.testing.assert_array_equal(voxels.cells, voxelize_mesh(mesh, H).cells)


def test_a_sheet_has_a_surface_and_no_volume() -> None:
    vertices = np.array([[0.1, 0.1, 0.1], [2.1, 0.1, 0.4], [2.1, 2.1, 0.2], [0.1, 2.1, 0.7]])
    mesh = TriangleMesh(vertices, np.array([[0, 1, 2], [0, 2, 3]], np.int32))
    voxels = voxelize_mesh(mesh, H)
    assert voxels.fill == "surface"
    assert voxels.solid_volume_m3 == 0.0
    assert cell_set(voxels) == surface_cells(mesh, H, TOLERANCE_M)


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_a_sheet_on_a_border_is_one_layer(axis: int) -> None:
    plane = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    mesh = TriangleMesh(np.insert(plane, axis, 0.5, axis=1), np.array([[0, 1, 2], [0, 2, 3]], np.int32))
    voxels = voxelize_mesh(mesh, H)
    assert voxels.fill == "surface"
    assert voxels.low[axis] == 2
    assert voxels.cells.shape == tuple(1 if n == axis else 4 for n in range(3))
    assert voxels.cells.all()


def test_clipping_gives_the_cut_of_the_whole() -> None:
    for mesh in (tilted_box(3), sphere_mesh(1.0), box_mesh((-1, -1, -1), (1, 1, 1))):
        whole = voxelize_mesh(mesh, 0.1)
        low, high = np.array([-4, -20, -3]), np.array([7, 2, 30])
        part = voxelize_mesh(mesh, 0.1, clip=(low, high))
        kept = {cell for cell in cell_set(whole) if np.all(cell >= low) and np.all(cell < high)}
        assert cell_set(part) == kept
        start = part.low - whole.low
        box = tuple(slice(a, a + n) for a, n in zip(start, part.cells.shape, strict=True))
        np.testing.assert_array_equal(part.fractions, whole.fractions[box])


def test_clipping_away_everything_leaves_no_cells() -> None:
    part = voxelize_mesh(box_mesh((0, 0, 0), (1, 1, 1)), H, clip=((10, 0, 0), (12, 4, 4)))
    assert part.cells.size == 0
    assert part.solid_volume_m3 == pytest.approx(1.0)


def test_a_part_swept_in_several_slabs_is_the_same_part(monkeypatch: pytest.MonkeyPatch) -> None:
    mesh = without_faces(tilted_box(11), 3)
    whole = voxelize_mesh(mesh, 0.1)
    # The kernel's Python code, with a slab so small that every row of columns is swept separately.
    code = solid.fill_columns.py_func
    names = code.__globals__ | {"_SLAB": 1}
    monkeypatch.setattr(solid, "fill_columns", types.FunctionType(code.__code__, names))
    assert same(voxelize_mesh(mesh, 0.1), whole)


def test_bad_input_is_refused() -> None:
    with pytest.raises(InputError, match="without triangles"):
        voxelize_mesh(TriangleMesh(np.zeros((3, 3)), np.zeros((0, 3), np.int32)), H)
    with pytest.raises(InputError, match="not finite"):
        voxelize_mesh(box_mesh((0, 0, 0), (1, 1, np.nan)), H)
    with pytest.raises(InputError, match="voxel size"):
        voxelize_mesh(box_mesh((0, 0, 0), (1, 1, 1)), 0.0)
    with pytest.raises(GridTooLargeError) as caught:
        voxelize_mesh(box_mesh((0, 0, 0), (8600, 8600, 8600)), 0.05)
    assert caught.value.fitting_voxel_size_m > 1.0


BATCH_H = 0.1
ZERO = np.zeros(3)
EVERYWHERE = (np.full(3, -1000), np.full(3, 1000))


def random_mesh(rng: np.random.Generator) -> TriangleMesh:
    """Return a box on the lattice or off it, one that passes through another, a sheet, or nothing."""
    half = rng.uniform(0.004, 0.8, size=3)
    mesh = box_mesh(-half, half)
    kind = rng.integers(6)
    if kind == 0:
        mesh = moved(mesh, turn=rotation(rng))
    elif kind == 1:
        low = np.round(rng.uniform(-1, 1, size=3), 1)
        mesh = box_mesh(low, low + np.round(rng.uniform(0.1, 1.5, size=3), 1))
    elif kind == 2:
        mesh = joined(mesh, moved(mesh, by=rng.uniform(-0.5, 0.5, size=3)))
    elif kind == 3:
        mesh = TriangleMesh(mesh.vertices_m, mesh.faces[: rng.integers(1, 12)])
    elif kind == 4:
        mesh = TriangleMesh(mesh.vertices_m, mesh.faces[:, ::-1].copy())
    return moved(mesh, by=rng.choice([0.0, 0.05, 0.137], size=3))


def batch_of(meshes: list[TriangleMesh], clip=EVERYWHERE, cell_limit: int = 10**9):
    together = Meshes.of(meshes)
    return wind_batch(together, together.bounds(BATCH_H, ZERO), BATCH_H, ZERO, clip=clip, cell_limit=cell_limit)


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**32 - 1), st.booleans())
def test_a_part_is_the_same_alone_and_in_a_batch(seed: int, clipped: bool) -> None:
    rng = np.random.default_rng(seed)
    meshes = [random_mesh(rng) for _ in range(8)]
    clip = (np.array([-4, -3, -2]), np.array([5, 3, 4])) if clipped else EVERYWHERE
    batch = batch_of(meshes, clip)
    assert batch.done.any()
    for part, mesh in enumerate(meshes):
        alone = voxelize_mesh(mesh, BATCH_H, clip=clip)
        if not batch.done[part]:
            continue
        assert alone.fill == "winding"
        shape = tuple(batch.shapes[part].tolist())
        columns = batch.columns[batch.column_starts[part] : batch.column_starts[part + 1]]
        np.testing.assert_array_equal(batch.lows[part], alone.low)
        assert shape == alone.shape
        np.testing.assert_array_equal(dense_cells(shape, columns, batch.runs), alone.cells)
        np.testing.assert_array_equal(dense_fractions(shape, columns, batch.runs, batch.shares), alone.fractions)
        boxes = batch.boxes[batch.box_starts[part] : batch.box_starts[part + 1]]
        np.testing.assert_array_equal(boxes, alone.boxes())
        assert batch.counts[part] == alone.count
        assert batch.volumes[part] * BATCH_H**3 == alone.solid_volume_m3


def test_what_winding_does_not_fill_is_left() -> None:
    closed = box_mesh((0, 0, 0), (1, 1, 1))
    opened = TriangleMesh(closed.vertices_m, closed.faces[:-1])
    nothing = TriangleMesh(np.zeros((0, 3)), np.zeros((0, 3), np.int32))
    unusable = box_mesh((0, 0, 0), (1, 1, np.nan))
    batch = batch_of([closed, opened, nothing, unusable, box_mesh((0, 0, 0), (5, 5, 5)), closed], cell_limit=1000)
    assert batch.done.tolist() == [True, False, False, False, False, True]
    assert batch.counts[[0, 5]].tolist() == [1000, 1000]
    assert batch.boxes.tolist() == [[0, 0, 0, 10, 10, 10]] * 2


def test_columns_that_are_alike_share_their_runs() -> None:
    batch = batch_of([box_mesh((0, 0, 0), (6, 4, 0.3))])
    assert len(batch.columns) == 60 * 40
    # Corners, sides and the middle are all full here, but each of the nine kinds is stored at most once per row.
    assert len(batch.runs) < 60 * 3


@pytest.mark.parametrize("order", ["in pairs", "apart"])
def test_a_beam_is_the_same_however_its_triangles_follow_each_other(order: str) -> None:
    beam = moved(box_mesh((0.013, 0.021, 0.07), (3.3, 0.19, 0.4)), by=(0.0, 0.0, 0.003))
    faces = beam.faces if order == "in pairs" else np.concatenate([beam.faces[::2], beam.faces[1::2]])
    whole = voxelize_mesh(beam, BATCH_H)
    other = voxelize_mesh(TriangleMesh(beam.vertices_m, faces), BATCH_H)
    np.testing.assert_array_equal(other.fractions, whole.fractions)
    # Along the beam, all columns except the ends are equal.
    assert len(whole.runs) <= 3 * whole.shape[1]


def test_batches_hold_all_parts_in_order_and_are_bounded() -> None:
    triangles = [12, 20_000, 12, 9_000, 9_000, 12, 40_000]
    low = np.zeros((7, 3), np.int64)
    high = low + 10
    batches = batches_of(triangles, low, high)
    assert [n for numbers in batches for n in numbers] == list(range(7))
    assert all(first.stop == second.start for first, second in pairwise(batches))
    for numbers in batches:
        assert len(numbers) == 1 or sum(triangles[n] for n in numbers) <= 1 << 14
    wide = batches_of([12, 12, 12], low[:3], low[:3] + np.array([300, 300, 1]))
    assert [len(numbers) for numbers in wide] == [1, 1, 1]


def test_bounds_are_those_of_the_triangles() -> None:
    mesh = moved(box_mesh((0, 0, 0), (1, 2, 3)), by=(0.05, 0.0, -1.0))
    stray = TriangleMesh(np.concatenate([mesh.vertices_m, [[99.0, 99.0, 99.0]]]), mesh.faces)
    bounds = Meshes.of([mesh, stray, TriangleMesh(np.zeros((0, 3)), np.zeros((0, 3), np.int32))]).bounds(BATCH_H, ZERO)
    np.testing.assert_array_equal(bounds[0], bounds[1])
    assert np.isnan(bounds[2]).all()
    low, high = cell_range(bounds[0, 0], bounds[0, 1], BATCH_H)
    assert low.tolist() == [0, 0, -10]
    assert high.tolist() == [11, 20, 20]
