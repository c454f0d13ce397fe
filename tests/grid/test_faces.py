from __future__ import annotations

import numpy as np
from box_grids import grid_of, random_shares
from hypothesis import given, settings
from hypothesis import strategies as st

from bimvox.grid.faces import PartFaces, outer_faces


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
