from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from reference import box_mesh, cell_set, moved, rotation

from bimvox.bim.building import Building, Element, Role, Source, TriangleMesh
from bimvox.errors import GridTooLargeError, InputError, SelectionError
from bimvox.grid.bricks import NO_OWNER, Bricks
from bimvox.grid.frame import Label
from bimvox.grid.voxel_grid import VoxelGrid, all_part_cells
from bimvox.voxelization.building import voxelize_building
from bimvox.voxelization.part import voxelize_mesh

H = 0.25


def building(*meshes: TriangleMesh, roles: tuple[Role, ...] = ()) -> Building:
    elements = tuple(
        Element(
            id=f"e{n}",
            global_id=f"e{n}",
            ifc_class="IfcBeam",
            name=f"part {n}",
            mesh=mesh,
            role=roles[n] if roles else Role.COMPONENT,
            mass_kg=10.0 * n,
            mass_source="default",
            storey="L1",
        )
        for n, mesh in enumerate(meshes)
    )
    return Building(elements, (), Source("test.ifc", "ab" * 32, "IFC4", "mm"), np.array([7.0, 0.0, -1.0]))


def random_building(seed: int, count: int = 8) -> Building:
    rng = np.random.default_rng(seed)
    meshes = []
    for _ in range(count):
        half = rng.uniform(0.05, 0.8, size=3)
        meshes.append(moved(box_mesh(-half, half), turn=rotation(rng), by=rng.uniform(-1, 1, size=3)))
    return building(*meshes)


def arrays(grid: VoxelGrid) -> list[np.ndarray]:
    return [
        grid.owners.index,
        grid.owners.cells,
        grid.boxes,
        grid.box_parts,
        grid.shared_cells,
        grid.shared_parts,
        grid.shared_fractions,
    ]


def labels_of(grid: VoxelGrid) -> np.ndarray:
    return grid.owners.mapped(grid.label_table)


def test_a_box_of_whole_cells_is_the_grid() -> None:
    grid = voxelize_building(building(box_mesh((0.25, 0.5, -0.75), (1.25, 2.5, 2.25))), H)
    assert grid.shape == (4, 8, 12)
    assert grid.frame.origin_m == (0.25, 0.5, -0.75)
    assert grid.frame.voxel_size_m == H
    assert np.all(labels_of(grid) == Label.COMPONENT)
    assert np.all(grid.owners.dense() == 0)
    assert grid.origin_m == (7.0, 0.0, -1.0)
    assert grid.source["name"] == "test.ifc"
    part = grid.parts[0]
    assert (part.id, part.role, part.label, part.cells, part.fill, part.storey) == (
        "e0", "component", Label.COMPONENT, 384, "winding", "L1",
    )  # fmt: skip
    assert part.solid_volume_m3 == pytest.approx(6.0)


def test_roles_become_labels() -> None:
    boxes = [box_mesh((n, 0, 0), (n + 1, 1, 1)) for n in range(4)]
    roles = (Role.COMPONENT, Role.STRUCTURE, Role.FITTING, Role.GROUND)
    grid = voxelize_building(building(*boxes, roles=roles), 1.0)
    assert labels_of(grid)[:, 0, 0].tolist() == [Label.COMPONENT, Label.STRUCTURE, Label.STRUCTURE, Label.GROUND]
    assert [part.role for part in grid.parts] == ["component", "structure", "fitting", "ground"]
    assert grid.counts() == {"air": 0, "ground": 1, "structure": 2, "component": 1}


def test_a_shared_cell_belongs_to_the_part_that_fills_most_of_it() -> None:
    small = box_mesh((0, 0, 0), (1.3, 1, 1))
    large = box_mesh((1.3, 0, 0), (3, 1, 1))
    grid = voxelize_building(building(small, large), 1.0)
    assert grid.owners.dense()[:, 0, 0].tolist() == [0, 1, 1]
    assert grid.shared_cells.tolist() == [[1, 0, 0], [1, 0, 0]]
    assert grid.shared_parts.tolist() == [0, 1]
    assert grid.shared_fractions.tolist() == pytest.approx([0.3, 0.7], abs=1 / 32)


def test_equal_shares_go_to_the_lower_index() -> None:
    low, high = box_mesh((0, 0, 0), (1, 1, 0.5)), box_mesh((0, 0, 0.5), (1, 1, 1))
    for first, second in ((low, high), (high, low)):
        grid = voxelize_building(building(first, second), 1.0)
        assert grid.owners.dense().tolist() == [[[0]]]
        assert grid.shared_fractions.tolist() == pytest.approx([0.5, 0.5])


@settings(max_examples=10, deadline=None)
@given(st.integers(0, 10_000))
def test_owners_and_shared_rows_follow_from_the_parts(seed: int) -> None:
    whole = random_building(seed)
    grid = voxelize_building(whole, 0.2)
    low = np.rint(np.array(grid.frame.origin_m) / 0.2).astype(int)
    share: dict[tuple[int, int, int], dict[int, float]] = {}
    for index, element in enumerate(whole.elements):
        voxels = voxelize_mesh(element.mesh, 0.2)
        cells, fractions = voxels.cells, voxels.fractions
        for cell in np.argwhere(cells):
            share.setdefault(tuple(cell + voxels.low - low), {})[index] = float(fractions[tuple(cell)])
        assert grid.parts[index].cells == cells.sum()
    owners = np.full(grid.shape, NO_OWNER)
    rows = []
    for cell, shares in sorted(share.items()):
        owners[cell] = max(shares, key=lambda part: (shares[part], -part))
        if len(shares) > 1:
            rows += [(cell, part, shares[part]) for part in sorted(shares)]
    np.testing.assert_array_equal(grid.owners.dense(), owners)
    assert grid.shared_cells.tolist() == [list(map(int, row[0])) for row in rows]
    assert grid.shared_parts.tolist() == [row[1] for row in rows]
    assert grid.shared_fractions.tolist() == [row[2] for row in rows]
    np.testing.assert_array_equal(labels_of(grid) == Label.AIR, owners == NO_OWNER)
    for index, cells in enumerate(all_part_cells(grid)):
        assert set(map(tuple, cells.tolist())) == {cell for cell, parts in share.items() if index in parts}


def test_a_cell_shared_by_three_parts_lists_all_and_goes_to_the_fullest() -> None:
    thirds = [
        box_mesh((0, 0, 0), (1, 1, 0.25)),
        box_mesh((0, 0, 0.25), (1, 1, 0.75)),
        box_mesh((0, 0, 0.75), (1, 1, 1)),
    ]
    for order in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        grid = voxelize_building(building(*(thirds[n] for n in order)), 1.0)
        assert grid.owners.dense().tolist() == [[[order.index(1)]]]
        assert grid.shared_parts.tolist() == [0, 1, 2]
        assert grid.shared_fractions.tolist() == [[0.25, 0.5, 0.25][n] for n in order]
        assert grid.shared_fractions.sum() == 1.0


def test_shared_rows_are_sorted_and_parts_side_by_side_fill_no_more_than_a_cell() -> None:
    rng = np.random.default_rng(4)
    turn = rotation(rng)
    cuts = np.sort(rng.uniform(-1.5, 1.5, size=9))
    slices = [moved(box_mesh((-1, -1, low), (1, 1, high)), turn=turn) for low, high in itertools.pairwise(cuts)]
    grid = voxelize_building(building(*slices), 0.3)
    rows = [(*cell, part) for cell, part in zip(grid.shared_cells.tolist(), grid.shared_parts.tolist(), strict=True)]
    assert rows == sorted(set(rows))
    cells, inverse = np.unique(grid.shared_cells, axis=0, return_inverse=True)
    sums = np.bincount(inverse.ravel(), grid.shared_fractions, len(cells))
    assert np.bincount(inverse.ravel()).min() >= 2
    assert sums.max() <= 1.0 + 1e-3
    assert grid.shared_fractions.dtype == np.float32


@settings(max_examples=10, deadline=None)
@given(st.integers(0, 10_000))
def test_bricks_and_boxes_are_those_of_the_cells(seed: int) -> None:
    whole = random_building(seed)
    grid = voxelize_building(whole, 0.1)
    bricks = Bricks.of(grid.owners.dense())
    np.testing.assert_array_equal(grid.owners.index, bricks.index)
    np.testing.assert_array_equal(grid.owners.cells, bricks.cells)
    assert grid.boxes.dtype == np.int32
    assert np.all(np.diff(grid.box_parts) >= 0)
    for index, cells in enumerate(all_part_cells(grid)):
        filled = np.zeros(grid.shape, np.int64)
        for x0, y0, z0, x1, y1, z1 in grid.boxes[grid.box_parts == index]:
            filled[x0:x1, y0:y1, z0:z1] += 1
        assert filled.max() == 1
        np.testing.assert_array_equal(np.argwhere(filled), cells)


def test_the_inside_of_a_part_takes_no_memory() -> None:
    grid = voxelize_building(building(box_mesh((0, 0, 0), (80, 80, 76)), box_mesh((0, 0, 76), (80, 80, 83))), 1.0)
    assert len(grid.owners.cells) == 100
    assert grid.owners.index[5, 5, 5] == -2
    assert grid.counts() == {"air": 0, "component": 80 * 80 * 83}


@settings(max_examples=10, deadline=None)
@example(38, (0, 0, -4095))
@given(st.integers(0, 10_000), st.tuples(*[st.integers(-5000, 5000)] * 3))
def test_moving_the_building_by_whole_cells_changes_nothing(seed: int, cells: tuple[int, int, int]) -> None:
    whole = random_building(seed)
    away = building(*(moved(element.mesh, by=np.array(cells) * 0.25) for element in whole.elements))
    start, end = voxelize_building(whole, 0.25), voxelize_building(away, 0.25)
    assert all(np.array_equal(a, b) for a, b in zip(arrays(start), arrays(end), strict=True))
    # Far away, vertices have fewer decimals; now and then one is rounded to another step.
    volumes = ([part.solid_volume_m3 for part in one.parts] for one in (end, start))
    assert next(volumes) == pytest.approx(next(volumes), rel=1e-6)
    assert [replace(part, solid_volume_m3=0.0) for part in end.parts] == [
        replace(part, solid_volume_m3=0.0) for part in start.parts
    ]
    assert np.subtract(end.frame.origin_m, start.frame.origin_m).tolist() == [n * 0.25 for n in cells]


def test_threads_change_nothing() -> None:
    whole = random_building(5, count=24)
    one = voxelize_building(whole, 0.1)
    for threads in (2, 3):
        other = voxelize_building(whole, 0.1, threads=threads)
        assert all(np.array_equal(a, b) for a, b in zip(arrays(one), arrays(other), strict=True))
        assert other.parts == one.parts


def test_turning_the_building_by_a_quarter_turns_the_grid() -> None:
    whole = random_building(9)
    turn = np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1]])
    turned = building(*(moved(element.mesh, turn=turn) for element in whole.elements))
    start, end = voxelize_building(whole, 0.1), voxelize_building(turned, 0.1)
    np.testing.assert_array_equal(end.owners.dense(), np.rot90(start.owners.dense(), 1, axes=(0, 1)))
    rows = {
        (y, end.shape[0] - 1 - x, z, part): share
        for (x, y, z), part, share in zip(
            end.shared_cells.tolist(), end.shared_parts.tolist(), end.shared_fractions.tolist(), strict=True
        )
    }
    assert rows == {
        (*cell, part): share
        for cell, part, share in zip(
            start.shared_cells.tolist(), start.shared_parts.tolist(), start.shared_fractions.tolist(), strict=True
        )
    }


def test_an_extent_given_clips_the_parts() -> None:
    whole = random_building(2)
    full = voxelize_building(whole, 0.1)
    start = np.rint(np.array(full.frame.origin_m) / 0.1).astype(int)
    low, high = np.array([-5, -4, -3]), np.array([6, 30, 4])
    cut = voxelize_building(whole, 0.1, low_vox=low, high_vox=high)
    assert cut.shape == (11, 34, 7)
    assert cut.frame.origin_m == pytest.approx((-0.5, -0.4, -0.3))
    inner = tuple(slice(max(a - s, 0), min(b - s, n)) for a, b, s, n in zip(low, high, start, full.shape, strict=True))
    place = tuple(slice(max(s - a, 0), None) for a, s in zip(low, start, strict=True))
    expected = np.full(cut.shape, NO_OWNER, np.int32)
    target = expected[place]
    dense = full.owners.dense()
    shape = tuple(min(a, b) for a, b in zip(target.shape, dense[inner].shape, strict=True))
    target[: shape[0], : shape[1], : shape[2]] = dense[inner][: shape[0], : shape[1], : shape[2]]
    np.testing.assert_array_equal(cut.owners.dense(), expected)


def test_progress_counts_the_parts() -> None:
    calls: list[tuple[str, int, int]] = []
    voxelize_building(random_building(1, 3), H, threads=2, progress=lambda *call: calls.append(call))
    assert calls == [("voxelize", 1, 3), ("voxelize", 2, 3), ("voxelize", 3, 3)]


def test_a_building_too_large_is_refused_before_memory_is_spent() -> None:
    far = building(box_mesh((0, 0, 0), (1, 1, 1)), box_mesh((8600, 8600, 8600), (8601, 8601, 8601)))
    with pytest.raises(GridTooLargeError) as caught:
        voxelize_building(far, 0.05)
    size = caught.value.fitting_voxel_size_m
    assert voxelize_building(far, 100.0 * size).owners.highest == 1


def test_nothing_to_voxelize_is_an_error() -> None:
    with pytest.raises(SelectionError, match="no elements"):
        voxelize_building(replace(building(box_mesh((0, 0, 0), (1, 1, 1))), elements=()), H)
    with pytest.raises(SelectionError, match="empty"):
        voxelize_building(building(box_mesh((0, 0, 0), (1, 1, 1))), H, low_vox=(0, 0, 0), high_vox=(0, 4, 4))


def test_cells_of_a_part_are_the_cells_of_its_mesh() -> None:
    mesh = box_mesh((0.1, 0.1, 0.1), (0.9, 0.6, 0.3))
    grid = voxelize_building(building(mesh), H)
    assert set(map(tuple, np.argwhere(grid.owners.dense() == 0).tolist())) == cell_set(voxelize_mesh(mesh, H))


def test_a_mesh_that_cannot_be_used_is_named() -> None:
    with pytest.raises(InputError, match=r"element part 1 \(e1\): a vertex is not finite"):
        voxelize_building(building(box_mesh((0, 0, 0), (1, 1, 1)), box_mesh((0, 0, 0), (1, 1, np.inf))), H)
