from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from box_grids import grid_of, part, random_shares
from hypothesis import given, settings
from hypothesis import strategies as st

from bimvox.grid.frame import Label
from bimvox.grid.voxel_grid import PartFaces, all_part_cells, outer_faces, part_boxes, part_cells


def test_counts_cover_every_cell_air_included() -> None:
    beam, ground = np.zeros((2, 2, 3, 4))
    beam[0, 0] = 1.0
    ground[1, 0, 0] = 1.0
    grid = grid_of([beam, ground], [part("beam"), part("ground", label=Label.GROUND)])
    assert grid.shape == (2, 3, 4)
    assert grid.counts() == {"air": 19, "ground": 1, "component": 4}
    assert grid_of([], shape=(3, 3, 3)).counts() == {"air": 27}


def test_labels_follow_from_owners() -> None:
    grid = grid_of([np.ones((1, 1, 2))], [part("wall", label=Label.STRUCTURE)])
    assert grid.label_table.tolist() == [Label.AIR, Label.STRUCTURE]


def test_the_fill_fraction_is_the_solid_in_the_cells_that_a_part_meets() -> None:
    grid = grid_of([np.ones((2, 2, 1))])
    assert grid.fill_fraction(grid.parts[0]) == pytest.approx(0.25)
    assert grid.fill_fraction(replace(grid.parts[0], solid_volume_m3=4.0000001)) == 1.0
    assert grid.fill_fraction(replace(grid.parts[0], cells=0)) == 0.0


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 99), st.tuples(*[st.integers(1, 9)] * 3), st.integers(1, 5))
def test_owned_and_shared_cells_are_both_met(seed: int, shape: tuple[int, int, int], parts: int) -> None:
    shares = random_shares(seed, shape, parts)
    grid = grid_of(shares)
    together = all_part_cells(grid)
    assert len(together) == parts
    for index, share in enumerate(shares):
        assert together[index].dtype == np.int32
        np.testing.assert_array_equal(together[index], np.argwhere(share > 0))
        np.testing.assert_array_equal(part_cells(grid, index), together[index])
        assert len(part_boxes(grid, index)) <= len(together[index])


def test_a_part_that_does_not_exist_is_an_error() -> None:
    with pytest.raises(IndexError, match="part 1"):
        part_cells(grid_of([np.ones((1, 1, 1))]), 1)


def unit_faces(faces: PartFaces) -> set[tuple[int, ...]]:
    """Return the faces of cells in the rectangles: (axis, plane, u, v, 1 if it faces along the axis)."""
    found = set()
    for corners in faces.corners[faces.quads].astype(int):
        axis = int(np.flatnonzero(np.ptp(corners, axis=0) == 0)[0])
        normal = np.cross(corners[1] - corners[0], corners[2] - corners[1])
        u, v = [n for n in range(3) if n != axis]
        low, high = corners.min(axis=0), corners.max(axis=0)
        area = np.prod((high - low)[[u, v]])
        assert abs(normal[axis]) == area > 0
        for a in range(low[u], high[u]):
            for b in range(low[v], high[v]):
                face = (axis, int(corners[0, axis]), a, b, int(normal[axis] > 0))
                assert face not in found
                found.add(face)
    return found


def expected_faces(cells: np.ndarray) -> set[tuple[int, ...]]:
    found = set()
    padded = np.pad(cells, 1)
    for cell in np.argwhere(cells):
        for axis in range(3):
            u, v = [n for n in range(3) if n != axis]
            for step in (-1, 1):
                beside = cell + 1
                beside[axis] += step
                if not padded[tuple(beside)]:
                    found.add((axis, int(cell[axis] + (step > 0)), int(cell[u]), int(cell[v]), int(step > 0)))
    return found


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 999), st.tuples(*[st.integers(1, 11)] * 3), st.integers(1, 4))
def test_the_rectangles_are_the_outer_faces_of_the_owned_cells(
    seed: int, shape: tuple[int, int, int], parts: int
) -> None:
    shares = random_shares(seed, shape, parts)
    grid = grid_of(shares)
    owners = grid.owners.dense()
    drawn = list(outer_faces(grid))
    assert [faces.part for faces in drawn] == list(range(parts))
    for faces, share in zip(drawn, shares, strict=True):
        owned = owners == faces.part
        assert unit_faces(faces) == expected_faces(owned if owned.any() else share > 0)


def test_a_box_is_six_rectangles_which_enclose_its_volume() -> None:
    cells = np.zeros((9, 12, 20), np.float32)
    cells[1:7, 2:11, 3:19] = 1.0
    (faces,) = outer_faces(grid_of([cells]))
    assert faces.corners.shape == (8, 3)
    assert faces.triangles.shape == (12, 3)
    a, b, c = np.moveaxis(faces.corners[faces.triangles].astype(float), 1, 0)
    assert np.einsum("ij,ij->", a, np.cross(b, c)) / 6 == 6 * 9 * 16


def test_a_part_without_cells_of_its_own_is_drawn_by_those_it_meets() -> None:
    thick, thin = np.zeros((2, 5, 5, 5), np.float32)
    thick[1:4], thin[2, 1:3, 1] = 0.9, 0.1
    faces = list(outer_faces(grid_of([thick, thin])))
    assert unit_faces(faces[1]) == expected_faces(thin > 0)


def test_air_has_no_faces() -> None:
    assert list(outer_faces(grid_of([], shape=(3, 3, 3)))) == []
