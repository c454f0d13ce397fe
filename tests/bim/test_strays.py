"""Parts far from all others are left out by name."""

import dataclasses
from dataclasses import replace

import numpy as np
import pytest
from box_buildings import box_element, building_of

from bimvox.bim.building import Role, TriangleMesh
from bimvox.bim.strays import pavements_as_ground, without_duplicates, without_strays


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


ONE = box_element("one", (0, 0, 0), (4, 0.3, 3))
TWO = box_element("two", (0, 0, 0), (4, 0.3, 3), mass_kg=9e3)


def _roles(*elements):
    found = without_duplicates(building_of(*elements))
    return [element.role for element in found.elements], " ".join(found.notes)


def test_the_first_is_built_and_the_others_are_named():
    roles, said = _roles(ONE, TWO, replace(ONE, id="three", name="Third"))
    assert roles == [Role.COMPONENT, Role.FITTING, Role.FITTING]
    assert said == "2 parts are duplicates of others in the same place, so left out: two, Third (three)"


def test_whatever_the_order_of_corners_and_less_than_half_a_millimetre_apart():
    order = np.arange(len(ONE.mesh.vertices_m))[::-1]
    faces = np.argsort(order)[ONE.mesh.faces].astype(np.int32)
    turned = replace(TWO, mesh=TriangleMesh(ONE.mesh.vertices_m[order] + 1e-4, faces))
    assert _roles(ONE, turned)[0] == [Role.COMPONENT, Role.FITTING]


def test_what_is_already_there_stays():
    assert _roles(ONE, replace(TWO, role=Role.STRUCTURE))[0] == [Role.FITTING, Role.STRUCTURE]


@pytest.mark.parametrize(
    "other",
    [
        box_element("two", (0, 0, 0), (4, 0.3, 2.3)),  # a lower wall in it
        box_element("two", (0, 0, 1), (4, 0.3, 4)),
        box_element("two", (0, 0.01, 0.01), (4, 0.31, 3.01)),
        box_element("two", (0, 0, 0), (4, 0.3, 3.1), ifc_class="IfcColumn"),
        box_element("two", (0, 0, 0), (4, 0.3, 3.1), material="Steel"),
        replace(TWO, role=Role.FITTING),
        replace(TWO, role=Role.GROUND),
    ],
)
def test_others_are_none(other):
    building = building_of(ONE, other)
    assert without_duplicates(building) is building


def test_parts_of_other_shapes_in_the_same_box_are_none():
    wedge = ONE.mesh.vertices_m.copy()
    wedge[np.isclose(wedge[:, 2], 3.0) & np.isclose(wedge[:, 0], 4.0), 0] = 3.0
    building = building_of(ONE, replace(TWO, mesh=TriangleMesh(wedge, ONE.mesh.faces)))
    assert without_duplicates(building) is building


@pytest.mark.parametrize(
    ("low", "high"),
    [
        ((0, 0, 0), (4, 0.3, 3.01)),
        ((0, 0, 0.2), (4, 0.3, 3.2)),
        ((0, 0, 0), (4.5, 0.3, 3)),
        ((0, 0, 0), (4, 0.33, 3)),
    ],
)
def test_of_drafts_of_one_part_the_longest_is_built(low, high):
    draft = box_element("draft", low, high)
    found = without_duplicates(building_of(ONE, draft))
    longer = max((ONE, draft), key=lambda one: (one.mass_kg, one is ONE))
    assert [one.id for one in found.elements if one.role is Role.COMPONENT] == [longer.id]
    assert "1 part is a duplicate of another in the same place" in " ".join(found.notes)


def test_columns_drawn_with_two_heights_on_every_storey_are_built_once():
    columns = [
        box_element(f"{height}-{storey}", (0, 0, 3.8 * storey), (0.3, 0.3, 3.8 * storey + height))
        for storey in range(3)
        for height in (3.3, 3.5)
    ]
    found = without_duplicates(building_of(*columns))
    assert [one.id for one in found.elements if one.role is Role.COMPONENT] == ["3.5-0", "3.5-1", "3.5-2"]


def test_panels_that_stand_on_each_other_or_side_by_side_all_stay():
    panels = [
        box_element(f"{x}-{z}", (4 * x, 0, 3 * z), (4 * x + 4, 0.3, 3 * z + 3)) for x in range(3) for z in range(3)
    ]
    building = building_of(*panels)
    assert without_duplicates(building) is building


def test_braces_that_cross_in_one_frame_both_stay():
    def brace(name, foot_m, head_m):
        corners = [(x + wide, y, z) for x, z in ((foot_m, 0), (head_m, 3)) for wide in (0, 0.1) for y in (0, 0.1)]
        return replace(ONE, id=name, mesh=TriangleMesh(np.array(corners, float), ONE.mesh.faces))

    building = building_of(brace("up", 0, 4), brace("down", 4, 0))
    assert without_duplicates(building) is building


def _house(*, role=Role.COMPONENT):
    return [box_element(f"column-{n}", (8.0 * n, 0.0, 0.0), (8.0 * n + 0.3, 0.3, 3.0), role=role) for n in range(3)]


@pytest.mark.parametrize("z_m", [-0.2, 0.0, 3.0])
def test_a_slab_that_no_jib_reaches_across_is_ground(z_m):
    slab = box_element("pavement", (-90.0, -80.0, z_m), (100.0, 80.0, z_m + 0.2), ifc_class="IfcSlab")
    found = pavements_as_ground(building_of(slab, *_house()))
    assert [element.role for element in found.elements] == [Role.GROUND, *[Role.COMPONENT] * 3]
    assert "pavement" in found.notes[-1]


@pytest.mark.parametrize(
    "low, high",
    [
        ((-20.0, -20.0, 0.0), (36.0, 20.0, 0.2)),
        ((0.0, -200.0, 0.0), (20.0, 200.0, 0.2)),
        ((-2.0, -80.0, 0.0), (190.0, 80.0, 0.2)),
        ((-90.0, -80.0, 3.0), (100.0, 80.0, 9.0)),
    ],
    ids=["small", "a road", "the building at its edge", "a storey"],
)
def test_other_slabs_are_parts(low, high):
    building = building_of(box_element("slab", low, high), *_house())
    assert pavements_as_ground(building) is building


def test_what_exists_already_stays():
    slab = box_element("slab", (-90.0, -80.0, 0.0), (100.0, 80.0, 0.2), role=Role.STRUCTURE)
    for building in (building_of(slab, *_house()), building_of(slab), building_of(*_house())):
        assert pavements_as_ground(building) is building
