from __future__ import annotations

import numpy as np
import pytest
from reference import box_mesh, inverted, joined, moved, rotation, sphere_mesh, without_faces

from bimvox.bim.building import Building, Element, Role, Source, TriangleMesh
from bimvox.grid.voxel_grid import VoxelGrid
from bimvox.voxelization import building as building_module
from bimvox.voxelization.building import voxelize_building
from bimvox.voxelization.lattice import cell_range
from bimvox.voxelization.meshes import (
    Meshes,
    batches_of,
    corner_keys,
    edges_match,
    grouped,
    inverted_faces,
    kinds_of,
    openness,
    part_keys,
)
from bimvox.voxelization.part import voxelize_mesh

H = 0.25
ZERO = np.zeros(3)


def keys_of(*meshes: TriangleMesh) -> np.ndarray:
    together = Meshes.of(meshes)
    bounds = together.bounds(H, ZERO)
    lows = cell_range(bounds[:, 0], bounds[:, 1], H)[0]
    return part_keys(together, H, ZERO, lows)


def repeating_building(seed: int) -> Building:
    """Return closed, open and intersecting shapes, each at several places, some moved by whole cells."""
    rng = np.random.default_rng(seed)
    shapes = []
    for n in range(4):
        half = rng.uniform(0.05, 0.8, size=3)
        mesh = moved(box_mesh(-half, half), turn=rotation(rng))
        if n == 1:
            mesh = without_faces(mesh, 0, 1)
        if n == 2:
            mesh = joined(mesh, moved(mesh, by=(0.1, 0.2, 0.1)))
        shapes.append(mesh)
    meshes = []
    for _ in range(20):
        cells = rng.integers(-8, 8, size=3) * H
        off = rng.choice([0.0, 0.05]) * np.ones(3)
        meshes.append(moved(shapes[rng.integers(4)], by=cells + off))
    elements = tuple(
        Element(f"e{n}", f"e{n}", "IfcBeam", "part", mesh, Role.COMPONENT, 1.0, "default")
        for n, mesh in enumerate(meshes)
    )
    return Building(elements, (), Source("test.ifc", "ab" * 32, "IFC4", "mm"), np.zeros(3))


def everything(grid: VoxelGrid) -> list[object]:
    arrays = [
        grid.owners.index, grid.owners.cells, grid.boxes, grid.box_parts,
        grid.shared_cells, grid.shared_parts, grid.shared_fractions,
    ]  # fmt: skip
    return [(a.dtype, a.shape, a.tobytes()) for a in arrays] + [
        (p.cells, p.fill, p.solid_volume_m3) for p in grid.parts
    ]


@pytest.mark.parametrize("clipped", [False, True])
@pytest.mark.parametrize("seed", range(4))
def test_parts_that_repeat_change_nothing(seed: int, clipped: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    building = repeating_building(seed)
    clip = {"low_vox": (-5, -4, -3), "high_vox": (6, 5, 4)} if clipped else {}
    together = voxelize_building(building, H, **clip)
    threaded = voxelize_building(building, H, threads=3, **clip)
    seen: list[int] = []
    monkeypatch.setattr(building_module, "kinds_of", lambda keys, alone: seen.append(len(keys)) or range(len(keys)))
    apart = voxelize_building(building, H, **clip)
    assert seen == [len(building.elements)]
    assert everything(together) == everything(apart) == everything(threaded)


def test_boxes_of_a_repeat_are_those_of_its_mesh() -> None:
    building = repeating_building(9)
    grid = voxelize_building(building, H)
    corner = np.rint(np.array(grid.frame.origin_m) / H).astype(np.int64)
    for n, element in enumerate(building.elements):
        alone = voxelize_mesh(element.mesh, H)
        boxes = grid.boxes[grid.box_parts == n] - np.tile(alone.low - corner, 2)
        np.testing.assert_array_equal(boxes, alone.boxes())


def test_equal_keys_mean_moved_by_whole_cells() -> None:
    rng = np.random.default_rng(3)
    mesh = moved(box_mesh((0, 0, 0), (1.1, 0.6, 0.3)), turn=rotation(rng))
    other_way = TriangleMesh(mesh.vertices_m, np.ascontiguousarray(mesh.faces[:, ::-1]))
    stirred = TriangleMesh(mesh.vertices_m + np.eye(8, 3) * 1e-6, mesh.faces)
    unused = TriangleMesh(np.concatenate([mesh.vertices_m, [[np.nan] * 3]]), mesh.faces)
    keys = keys_of(
        mesh,
        moved(mesh, by=(H, -17 * H, 400 * H)),
        moved(mesh, by=(H / 2, 0, 0)),
        other_way,
        stirred,
        unused,
    )
    assert keys[0].tolist() == keys[1].tolist()
    assert len({tuple(key) for key in keys.tolist()}) == 5
    assert keys[5].tolist() == [0, 0]


def test_parts_that_are_cut_or_have_no_key_stand_alone() -> None:
    keys = np.array([[1, 2], [1, 2], [3, 2], [0, 0], [1, 2], [0, 0], [1, 2]], np.uint64)
    alone = np.array([False, False, False, False, True, False, False])
    kinds = kinds_of(keys, alone)
    assert kinds == [0, 0, 2, 3, 4, 5, 0]
    stand, places = grouped(kinds[1:])
    assert stand == [0, 1, 2, 3, 4]
    assert places.tolist() == [0, 1, 2, 3, 4, 0]


def test_a_repeat_counts_once_a_batch() -> None:
    low = np.zeros((12, 3), np.int64)
    triangles = [9_000] * 12
    assert len(batches_of(triangles, low, low + 10)) == 12
    kinds = [0, 0, 0, 3, 0, 3, 6, 6, 0, 9, 9, 9]
    batches = batches_of(triangles, low, low + 10, kinds)
    assert batches == [range(3), range(3, 4), range(4, 5), range(5, 6), range(6, 8), range(8, 9), range(9, 12)]
    many = np.zeros((10_000, 3), np.int64)
    assert [len(numbers) for numbers in batches_of([12] * 10_000, many, many + 1, [0] * 10_000)] == [4096, 4096, 1808]


def closure_keys_of(mesh: TriangleMesh):
    return corner_keys(mesh.triangles_m)


def closed(mesh: TriangleMesh) -> bool:
    return bool(edges_match(closure_keys_of(mesh)))


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
    flips = inverted_faces(mesh.triangles_m, closure_keys_of(mesh))
    assert flips.reshape(3, 12).tolist() == [[False] * 12, [False] * 12, [True] * 12]
