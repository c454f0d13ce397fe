"""The proof's own answer to which cells a mesh fills."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from box_sites import box_cells, box_mesh
from numpy.typing import NDArray

from bimvox.bim.building import TriangleMesh
from bimvox.grid.frame import GridFrame
from bimvox.proof.bodies.filled import unfilled

FRAME = GridFrame((0.0, 0.0, 0.0), 0.5)
BLOCK = ((1.1, 1.1, 1.1), (5.9, 4.9, 4.4))
HOLLOW = ((2.1, 2.1, 2.1), (4.9, 3.9, 3.4))


def cells_over(low, high) -> NDArray[np.int32]:
    return box_cells(FRAME, low, high)


def left(mesh: TriangleMesh, cells: NDArray[np.int32]) -> set[tuple[int, ...]]:
    """The cells that the mesh does not fill."""
    first = cells.min(axis=0)
    dense = np.zeros(cells.max(axis=0) - first + 3, np.bool_)
    dense[tuple((cells - first + 1).T)] = True
    corners = mesh.triangles_m / FRAME.voxel_size_m - (first - 1)
    found = unfilled(dense, np.zeros_like(dense), mesh, corners, 4e-4)
    return {tuple(cell) for cell in (found + first - 1).tolist()}


def turned(mesh: TriangleMesh) -> TriangleMesh:
    return TriangleMesh(mesh.vertices_m, np.ascontiguousarray(mesh.faces[:, ::-1]))


def without(mesh: TriangleMesh, *faces: int) -> TriangleMesh:
    return TriangleMesh(mesh.vertices_m, np.delete(mesh.faces, faces, axis=0))


@pytest.mark.parametrize("inside_out", [False, True])
def test_a_closed_body_fills_its_cells_whichever_way_its_faces_look(inside_out: bool):
    mesh = turned(box_mesh(*BLOCK)) if inside_out else box_mesh(*BLOCK)
    assert left(mesh, cells_over(*BLOCK)) == set()


def test_cells_beyond_the_body_are_not_filled():
    more = cells_over((1.1, 1.1, 1.1), (6.9, 4.9, 4.4))
    assert {cell[0] for cell in left(box_mesh(*BLOCK), more)} == {12, 13}


def test_a_hollow_is_not_filled_and_shells_that_overlap_are():
    hollow = TriangleMesh.joined([box_mesh(*BLOCK), turned(box_mesh(*HOLLOW))])
    inner = {(x, y, z) for x in range(5, 9) for y in range(5, 7) for z in range(5, 6)}
    assert left(hollow, cells_over(*BLOCK)) == inner
    assert left(turned(hollow), cells_over(*BLOCK)) == inner
    other = ((2.1, 2.1, 2.1), (7.9, 6.9, 6.4))
    both = np.unique(np.concatenate([cells_over(*BLOCK), cells_over(*other)]), axis=0)
    assert left(TriangleMesh.joined([box_mesh(*BLOCK), turned(box_mesh(*other))]), both) == set()


def test_an_open_body_fills_its_cells_if_most_axes_say_so_or_nothing_leads_out():
    open_top = without(box_mesh(*BLOCK), 2, 3)
    assert left(open_top, cells_over(*BLOCK)) == set()
    cracked = without(box_mesh(*BLOCK), 2)
    assert left(cracked, cells_over(*BLOCK)) == set()


def test_faces_at_random_sides_fill_what_they_enclose():
    mesh = box_mesh(*BLOCK)
    faces = mesh.faces.copy()
    faces[[0, 3, 4, 9]] = faces[[0, 3, 4, 9]][:, ::-1]
    assert left(TriangleMesh(mesh.vertices_m, faces), cells_over(*BLOCK)) == set()


def test_two_sheets_fill_only_the_cells_that_they_touch():
    """Lines upwards say that the cells between them are inside; lines along the other axes say that they are not."""
    sheets = TriangleMesh(box_mesh(*BLOCK).vertices_m, box_mesh(*BLOCK).faces[:4])
    between = {cell for cell in map(tuple, cells_over(*BLOCK).tolist()) if 2 < cell[2] < 8}
    assert left(sheets, cells_over(*BLOCK)) == between


def test_a_frame_of_thin_bars_fills_only_the_cells_that_it_touches():
    low, high = np.array(BLOCK)
    edges = itertools.product((low[0], high[0] - 0.001), (low[1], high[1] - 0.001))
    bars = [box_mesh((x, y, low[2]), (x + 0.001, y + 0.001, high[2])) for x, y in edges]
    cells = cells_over(*BLOCK)
    corners = {cell for cell in map(tuple, cells.tolist()) if cell[0] in (2, 11) and cell[1] in (2, 9)}
    assert left(TriangleMesh.joined(bars), cells) == set(map(tuple, cells.tolist())) - corners


def test_a_slanted_triangle_touches_the_cells_that_it_goes_through():
    corners = np.array([(0.13, 0.21, 0.07), (2.91, 0.34, 2.77), (2.63, 2.88, 1.94)])
    cells = cells_over((0.0, 0.0, 0.0), (3.0, 3.0, 3.0))
    i, j = np.triu_indices(601)
    points = np.stack([i, j - i, 600 - j], axis=1) @ corners / 600.0
    met = {tuple(cell) for cell in np.floor(points / FRAME.voxel_size_m).astype(int).tolist()}
    assert set(map(tuple, cells.tolist())) - left(TriangleMesh(corners, np.array([[0, 1, 2]], np.int32)), cells) == met
