"""Local frame to site frame and back."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bimvox.bim.building import Building, Element, Role, Source, TriangleMesh
from bimvox.bim.site_frame import in_site_frame, turn_about_z

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
