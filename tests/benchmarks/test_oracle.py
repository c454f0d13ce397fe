"""The oracle against known cases, and the scoring of answers."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from benchmarks.voxelize.case import Scene, Window
from benchmarks.voxelize.oracle import Truth, union_truth, window_truth
from benchmarks.voxelize.prisms import box, joined, moved
from benchmarks.voxelize.sample import sample_windows
from benchmarks.voxelize.score import judge, unpacked
from benchmarks.voxelize.solids import of_one
from benchmarks.voxelize.tool import OURS, TOOLS, mask_of
from bimvox.bim.building import TriangleMesh
from bimvox.grid.voxel_grid import part_cells
from bimvox.voxelization.building import voxelize_building

H = 0.25


def window(low, high, parts=(0,)) -> Window:
    return Window(np.array(low, np.int64), np.array(high, np.int64), np.array(parts, np.int64))


def truth_of(mesh: TriangleMesh, low, high):
    return window_truth(Scene.of(of_one("it", mesh), H), window(low, high))[0]


def test_a_cube_on_cell_borders_fills_its_cells_and_no_neighbour():
    truth = truth_of(moved(box((0.75, 0.5, 0.5)), 0.25, 0.25, 0.25), (0, 0, 0), (6, 5, 4))
    expected = np.zeros((6, 5, 4), np.uint8)
    expected[1:4, 1:3, 1:3] = Truth.INSIDE
    np.testing.assert_array_equal(truth, expected)


def test_a_cube_off_the_borders_fills_part_of_its_outer_cells():
    truth = truth_of(moved(box((0.75, 0.75, 0.75)), 0.1, 0.1, 0.1), (-1, -1, -1), (5, 5, 5))
    expected = np.zeros((6, 6, 6), np.uint8)
    expected[1:5, 1:5, 1:5] = Truth.BOUNDARY
    expected[2:4, 2:4, 2:4] = Truth.INSIDE
    np.testing.assert_array_equal(truth, expected)


def test_a_plate_thinner_than_a_cell_fills_one_layer():
    truth = truth_of(moved(box((1.0, 1.0, 0.004)), 0.0, 0.0, 0.6), (0, 0, 0), (4, 4, 4))
    expected = np.zeros((4, 4, 4), np.uint8)
    expected[:, :, 2] = Truth.BOUNDARY
    np.testing.assert_array_equal(truth, expected)


@pytest.mark.parametrize(
    ("over_m", "beyond"), [(0.00005, Truth.EMPTY), (0.0001, Truth.EITHER), (0.0002, Truth.BOUNDARY)]
)
def test_what_reaches_into_a_cell_by_less_than_the_tolerance_does_not_fill_it(over_m, beyond):
    truth = truth_of(box((0.5 + over_m, 0.25, 0.25)), (0, 0, 0), (3, 1, 1))
    assert truth[:, 0, 0].tolist() == [Truth.INSIDE, Truth.INSIDE, beyond]


def test_nothing_is_said_of_a_mesh_that_is_not_closed():
    mesh = box((0.5, 0.5, 0.5))
    truth = truth_of(TriangleMesh(mesh.vertices_m, mesh.faces[1:]), (0, 0, 0), (2, 2, 2))
    assert (truth == Truth.EITHER).all()


def test_vertices_that_are_not_shared_are_welded():
    mesh = moved(box((0.5, 0.5, 0.5)), 0.0, 0.0, 0.0)
    soup = TriangleMesh(mesh.triangles_m.reshape(-1, 3), np.arange(3 * len(mesh.faces), dtype=np.int32).reshape(-1, 3))
    assert (truth_of(soup, (0, 0, 0), (2, 2, 2)) == Truth.INSIDE).all()


def test_parts_together_are_as_full_as_the_fullest():
    states = np.array([[0, 1, 1, 0, 3], [0, 0, 2, 3, 2]], np.uint8).reshape(2, 5, 1, 1)
    assert union_truth(states).ravel().tolist() == [0, 1, 2, 3, 2]


def test_judging_counts_surfaces_on_the_boundary_only():
    truth = np.array([0, 0, 1, 1, 2, 3], np.uint8).reshape(1, 6, 1, 1)
    mask = np.array([0, 1, 1, 0, 0, 1], bool).reshape(1, 6, 1, 1)
    solid = judge(OURS, [truth], [mask])
    assert (solid.filled, solid.missed, solid.extra) == (3, 2, 1)
    surface = judge(TOOLS["open3d"], [truth], [mask[0]])
    assert (surface.filled, surface.missed, surface.extra) == (2, 1, 1)
    assert surface.missed_share == 0.5
    np.testing.assert_array_equal(unpacked(np.packbits(mask), OURS, truth), mask)


def test_our_voxelizer_agrees_with_the_oracle_on_parts_off_the_axes():
    turn = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    body = joined(box((1.3, 0.7, 0.4)), moved(box((0.2, 0.3, 2.0)), 2.0, 1.0, 0.0))
    building = of_one("it", TriangleMesh(body.vertices_m @ turn.T, body.faces))
    scene = Scene.of(building, H)
    windows = sample_windows(scene, dense=False)
    truths = [window_truth(scene, each) for each in windows]
    cells = part_cells(voxelize_building(building, H), 0) + scene.low
    score = judge(OURS, truths, [mask_of(cells, each)[None] for each in windows])
    assert score.filled > 50
    assert (score.missed, score.extra) == (0, 0)


def test_windows_are_the_same_every_time_and_survive_the_file(tmp_path: Path):
    scene = Scene.of(of_one("it", joined(box((2.0, 0.4, 0.4)), moved(box((0.4, 0.4, 30.0)), 4.0, 0.0, 0.0))), H)
    windows = [*sample_windows(scene, dense=False), *sample_windows(scene, dense=True, count=5)]
    assert len(windows) == 6
    scene.save(tmp_path / "scene.npz", windows)
    again, loaded = Scene.load(tmp_path / "scene.npz")
    assert again.shape == scene.shape
    assert again.parts[0].triangles_m.tobytes() == scene.parts[0].triangles_m.tobytes()
    for one, two in zip(windows, loaded, strict=True):
        assert (one.low.tolist(), one.high.tolist()) == (two.low.tolist(), two.high.tolist())
        assert one.parts.tolist() == two.parts.tolist() == [0]
        assert max(one.shape) <= 40
        assert (one.low >= scene.low).all() and (one.high <= scene.high).all()
