from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from reference import box_mesh, joined, moved, rotation

from bimvox.bim.building import TriangleMesh
from bimvox.voxelization.lattice import cell_range
from bimvox.voxelization.meshes import Meshes, batches_of
from bimvox.voxelization.part import voxelize_mesh, wind_batch
from bimvox.voxelization.runs import dense_cells, dense_fractions

H = 0.1
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
    return wind_batch(together, together.bounds(H, ZERO), H, ZERO, clip=clip, cell_limit=cell_limit)


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**32 - 1), st.booleans())
def test_a_part_is_the_same_alone_and_in_a_batch(seed: int, clipped: bool) -> None:
    rng = np.random.default_rng(seed)
    meshes = [random_mesh(rng) for _ in range(8)]
    clip = (np.array([-4, -3, -2]), np.array([5, 3, 4])) if clipped else EVERYWHERE
    batch = batch_of(meshes, clip)
    assert batch.done.any()
    for part, mesh in enumerate(meshes):
        alone = voxelize_mesh(mesh, H, clip=clip)
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
        assert batch.volumes[part] * H**3 == alone.solid_volume_m3


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
    whole = voxelize_mesh(beam, H)
    other = voxelize_mesh(TriangleMesh(beam.vertices_m, faces), H)
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
    bounds = Meshes.of([mesh, stray, TriangleMesh(np.zeros((0, 3)), np.zeros((0, 3), np.int32))]).bounds(H, ZERO)
    np.testing.assert_array_equal(bounds[0], bounds[1])
    assert np.isnan(bounds[2]).all()
    low, high = cell_range(bounds[0, 0], bounds[0, 1], H)
    assert low.tolist() == [0, 0, -10]
    assert high.tolist() == [11, 20, 20]
