"""Local frame to site frame and back."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bimvox.bim.building import Building, Element, Role, Source, TriangleMesh
from bimvox.bim.site_frame import FAR_M, in_site_frame, is_about_place, local_origin, placed_twice, stray, turn_about_z

_SOURCE = Source("a.ifc", "0" * 64, "IFC4", "m")


def element(name: str, role: Role, z: float) -> Element:
    vertices = np.array([[1.0, 2.0, z], [4.0, 2.0, z], [1.0, 6.0, z], [1.0, 2.0, z + 1.5]])
    faces = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]], dtype=np.int32)
    return Element(name, name, "IfcSlab", name, TriangleMesh(vertices, faces), role, 1.0, "default")


BUILDING = Building(
    (
        element("slab", Role.COMPONENT, 0.5),
        element("footing", Role.STRUCTURE, -1.25),
        element("door", Role.FITTING, -9.0),
    ),
    (),
    _SOURCE,
)


@given(st.floats(-10, 10), st.floats(-7, 7))
def test_site_to_local_takes_the_vertices_back(ground_m: float, yaw_rad: float) -> None:
    moved, site_to_local = in_site_frame(BUILDING, ground_m=ground_m, yaw_rad=yaw_rad)
    for before, after in zip(BUILDING.elements, moved.elements, strict=True):
        back = after.mesh.vertices_m @ site_to_local[:3, :3].T + site_to_local[:3, 3]
        assert back == pytest.approx(before.mesh.vertices_m, abs=1e-12)
        assert after.mesh.signed_volume_m3 == pytest.approx(before.mesh.signed_volume_m3)


@pytest.mark.parametrize("quarters", range(-5, 6))
def test_quarter_turns_are_exact(quarters: int) -> None:
    turn = turn_about_z(quarters * math.pi / 2)
    assert set(np.unique(turn)) <= {-1.0, 0.0, 1.0}
    assert turn @ [1, 0, 0] == pytest.approx([math.cos(quarters * math.pi / 2), math.sin(quarters * math.pi / 2), 0])


def test_a_building_drawn_at_an_angle_becomes_square() -> None:
    yaw = 0.3
    askew = BUILDING.elements[0]
    turned = TriangleMesh(askew.mesh.vertices_m @ turn_about_z(yaw).T, askew.mesh.faces)
    moved, _ = in_site_frame(replace(BUILDING, elements=(replace(askew, mesh=turned),)), ground_m=0.5, yaw_rad=yaw)
    assert moved.bounds_m == pytest.approx(np.array([[1, 2, 0], [4, 6, 1.5]]))


def cube(x: float, y: float, z: float) -> np.ndarray:
    return np.array([[x, y, z], [x + 1, y + 1, z + 1]])


@given(st.floats(-6e6, 6e6), st.floats(-6e6, 6e6), st.floats(-500, 500))
def test_the_origin_is_whole_metres_and_near(x: float, y: float, z: float) -> None:
    origin = local_origin([cube(x, y, z)])
    assert np.array_equal(origin, np.floor(origin))
    assert origin[2] == 0.0
    for place, shift in zip((x, y), origin[:2], strict=True):
        assert abs(place - shift) <= FAR_M + 1


def test_no_origin_where_the_model_reaches_near_zero() -> None:
    assert local_origin([cube(0, 0, 0), cube(5e6, 0, 0)]).tolist() == [0, 0, 0]
    assert local_origin([]).tolist() == [0, 0, 0]


def test_strays() -> None:
    assert stray([cube(0, 0, 0), cube(2, 0, 0), cube(5000, 0, 0)]).tolist() == [2]
    assert stray([]).tolist() == []


FAR = {"eastings_m": 155_000.0, "northings_m": 463_000.0, "height_m": 3.0}


@pytest.mark.parametrize(
    ("georeference", "middle_m"),
    [
        (FAR, (155_010.0, 463_005.0, 4.0)),
        ({**FAR, "x_axis_yaw_rad": math.pi}, (155_010.0, 463_005.0, 4.0)),
        ({**FAR, "x_axis_yaw_rad": 0.4, "scale": 0.9996}, (154_000.0, 470_000.0, 0.0)),
        ({"eastings_m": 33_311_988.0, "northings_m": 5_996_148.0, "height_m": 0.0}, (311_988.0, 5_996_148.0, 12.0)),
    ],
)
def test_far_geometry_that_is_moved_far_again_is_noted(georeference, middle_m):
    note = placed_twice(georeference, middle_m)
    assert note is not None
    assert is_about_place(note)
    assert f"({middle_m[0]:,.1f}, {middle_m[1]:,.1f}) m" in note
    assert f"({georeference['eastings_m']:,.1f}, {georeference['northings_m']:,.1f}) m" in note


@pytest.mark.parametrize(
    ("georeference", "middle_m"),
    [
        ({}, (155_010.0, 463_005.0, 4.0)),  # no conversion
        ({"crs": "EPSG:28992"}, (155_010.0, 463_005.0, 4.0)),
        (FAR, (10.0, 5.0, 4.0)),  # local geometry
        (FAR, (-900.0, 8_000.0, 4.0)),
        ({"eastings_m": 0.0, "northings_m": 0.0, "height_m": 3.2}, (155_010.0, 463_005.0, 4.0)),  # only a height
        ({"eastings_m": -155_000.0, "northings_m": -463_000.0, "height_m": 0.0}, (155_010.0, 463_005.0, 4.0)),  # back
    ],
)
def test_a_model_that_is_placed_once_is_not(georeference, middle_m):
    assert placed_twice(georeference, middle_m) is None
