"""Parts far from all others are left out by name."""

import dataclasses

import numpy as np
import pytest
from box_buildings import box_element, building_of

from bimvox.bim.building import Role, TriangleMesh
from bimvox.bim.strays import without_strays


def _row(*places_m, **more):
    return [box_element(f"part-{n}", (x, 0, 0), (x + 1, 1, 1), **more) for n, x in enumerate(places_m)]


@pytest.mark.parametrize("at", [(900.0, 0.0, 0.0), (0.0, -4e5, 0.0), (3.0, 0.0, 5000.0), (-600.0, 600.0, 0.0)])
def test_a_part_far_away_is_neither_lifted_nor_in_the_way(at):
    far = box_element("far", at, [n + 1 for n in at])
    found = without_strays(building_of(far, *_row(0.0, 100.0, 200.0)))
    assert [element.role for element in found.elements] == [Role.FITTING, *[Role.COMPONENT] * 3]
    (note,) = found.notes
    assert "far" in note
    assert "1 part is left out, more than 250 m" in note


@pytest.mark.parametrize("low", [(0.0, 0.0, 0.0), (-2e3, -10.0, 0.0), (5e3, 0.0, 0.0)])
def test_a_part_in_a_wrong_unit_is_left_out(low):
    large = box_element("large", low, (low[0] + 4e3, low[1] + 300.0, low[2] + 300.0))
    found = without_strays(building_of(*_row(0.0, 100.0), large))
    assert [element.role for element in found.elements] == [Role.COMPONENT] * 2 + [Role.FITTING]


def test_a_long_deck_stays():
    deck = box_element("deck", (0.0, 0.0, 5.0), (600.0, 9.0, 6.0))
    building = building_of(*_row(0.0, 200.0, 400.0, 590.0), deck)
    assert without_strays(building) is building
    assert without_strays(building_of(deck)).elements[0].role is Role.COMPONENT


def test_a_long_site_without_a_gap_stays_whole():
    building = building_of(*_row(0.0, 200.0, 400.0, 600.0), *_row(5e3, role=Role.GROUND))
    assert without_strays(building) is building


def test_the_larger_of_two_sites_stays():
    found = without_strays(building_of(*_row(0.0, 10.0), *_row(5e3, 5010.0, 5020.0)))
    assert [element.role for element in found.elements] == [Role.FITTING] * 2 + [Role.COMPONENT] * 3


@pytest.mark.parametrize("high", [(1e15, 1.0, 1.0), (1.0, 1e30, 1.0), (1.0, 1.0, 1e9)])
def test_a_part_beyond_the_numbers_of_cells_is_skipped(high):
    lost = box_element("lost", (0.0, 0.0, 0.0), high)
    found = without_strays(building_of(lost, *_row(0.0, 100.0)))
    assert [element.id for element in found.elements] == ["part-0", "part-1"]
    assert [product.name for product in found.skipped] == ["lost"]
    assert "lost" in found.notes[-1]


def _terrain(step_m=5.0, slope=0.0, count=9):
    """Return a sloping grid of vertices around the origin, as terrain."""
    at = np.arange(count) - count // 2
    x, y = (step_m * one.ravel() for one in np.meshgrid(at, at))
    n = np.arange(count * count).reshape(count, count)
    a, b, c, d = (one.ravel() for one in (n[:-1, :-1], n[:-1, 1:], n[1:, 1:], n[1:, :-1]))
    faces = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    mesh = TriangleMesh(np.stack([x, y, slope * x], axis=1), faces.astype(np.int32))
    return dataclasses.replace(box_element("land", (0, 0, 0), (1, 1, 1), role=Role.GROUND), mesh=mesh)


@pytest.mark.parametrize("wrong", [{40: (1e9, 0, 0)}, {41: (5, 0, -1000)}, {0: (-20, 2e6, 3), 1: (0, 0, 1e9)}])
@pytest.mark.parametrize("slope", [0.0, 0.3])
def test_a_wrong_vertex_of_terrain_is_spanned_by_its_neighbours(wrong, slope):
    land = _terrain(slope=slope)
    vertices = land.mesh.vertices_m.copy()
    for vertex, at in wrong.items():
        vertices[vertex] = at
    bad = dataclasses.replace(land, mesh=TriangleMesh(vertices, land.mesh.faces))
    found = without_strays(building_of(*_row(0.0, 3.0), bad))
    mended = found.elements[-1].mesh
    assert np.abs(mended.vertices_m - land.mesh.vertices_m)[:, 2].max() <= 5.0 * slope + 1e-9
    assert len(mended.faces) == len(land.mesh.faces)
    (note,) = found.notes
    count = "1 vertex of terrain lies" if len(wrong) == 1 else "2 vertices of terrain lie"
    assert note.startswith(f"{count} far from the rest of it, so not used; check the coordinates of land")


@pytest.mark.parametrize("land", [_terrain(), _terrain(500.0, 0.4), _terrain(2e4), _terrain(slope=2.0, count=3)])
def test_wide_and_hilly_terrain_stays(land):
    building = building_of(*_row(0.0, 3.0), land)
    assert without_strays(building) is building


def test_terrain_with_a_flat_underside_stays():
    land = _terrain()
    low = land.mesh.vertices_m - (0.0, 0.0, 200.0)
    faces = np.concatenate([land.mesh.faces, land.mesh.faces[:, ::-1] + len(low)])
    solid = TriangleMesh(np.concatenate([land.mesh.vertices_m, low]), faces.astype(np.int32))
    building = building_of(*_row(0.0, 3.0), dataclasses.replace(land, mesh=solid))
    assert without_strays(building) is building


def test_a_triangle_of_wrong_vertices_alone_is_left_out():
    land = _terrain()
    more = np.array([(1e8, 0, 0), (1e8, 1, 0), (1e8, 0, 1)])
    count = len(land.mesh.vertices_m)
    faces = np.concatenate([land.mesh.faces, [[count, count + 1, count + 2]]]).astype(np.int32)
    mesh = TriangleMesh(np.concatenate([land.mesh.vertices_m, more]), faces)
    found = without_strays(building_of(*_row(0.0, 3.0), dataclasses.replace(land, mesh=mesh)))
    assert found.elements[-1].mesh.bounds_m[1, 0] == 20.0
