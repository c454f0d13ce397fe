"""How much of one solid lies inside another one."""

from __future__ import annotations

from math import cos, radians, sin

import numpy as np
import pytest

from bimvox.bim.building import TriangleMesh
from bimvox.bim.ifc.group_mass import share_inside

_FACES = np.array(
    [
        *((0, 2, 3), (0, 3, 1), (4, 5, 7), (4, 7, 6), (0, 1, 5), (0, 5, 4)),
        *((2, 6, 7), (2, 7, 3), (0, 4, 6), (0, 6, 2), (1, 3, 7), (1, 7, 5)),
    ],
    np.int32,
)


def box(low: tuple[float, float, float], high: tuple[float, float, float], turned: float = 0.0) -> TriangleMesh:
    corners = np.array([[(low, high)[i][0], (low, high)[j][1], (low, high)[k][2]] for k, j, i in np.ndindex(2, 2, 2)])
    c, s = cos(radians(turned)), sin(radians(turned))
    return TriangleMesh(corners @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]]), _FACES)


def test_the_box_itself_looks_outward() -> None:
    assert box((0, 0, 0), (1, 2, 3)).signed_volume_m3 == pytest.approx(6.0)


@pytest.mark.parametrize("turned", [0.0, 30.0, 45.0])
def test_shares_of_a_leaf_in_its_wall(turned: float) -> None:
    wall = box((0, 0, 0), (4, 0.3, 3), turned)
    assert share_inside(box((0, 0, 0), (4, 0.08, 3), turned), wall) == pytest.approx(1.0)
    assert share_inside(wall, wall) == pytest.approx(1.0)
    assert share_inside(box((0, 0, 2), (4, 0.3, 4), turned), wall) == pytest.approx(0.5)
    assert share_inside(box((0, 0, 3), (4, 0.3, 4), turned), wall) == 0.0
    assert share_inside(box((9, 0, 0), (10, 0.3, 3), turned), wall) == 0.0
    assert share_inside(box((0, 0.3, 0), (4, 0.5, 3), turned), wall) == pytest.approx(0.0, abs=0.01)


def test_what_fills_a_cavity_is_not_inside() -> None:
    hole = box((1, 1, 1), (2, 2, 2))
    hollow = TriangleMesh.joined([box((0, 0, 0), (3, 3, 3)), TriangleMesh(hole.vertices_m, hole.faces[:, ::-1])])
    assert share_inside(hole, hollow) == 0.0
    assert share_inside(box((0, 0, 0), (1, 3, 3)), hollow) == pytest.approx(1.0)


def test_bodies_that_overlap_in_one_mesh_are_solid() -> None:
    both = TriangleMesh.joined([box((0, 0, 0), (2, 1, 2)), box((0, 0, 1), (2, 1, 3))])
    assert share_inside(box((0, 0, 0), (2, 1, 3)), both) == pytest.approx(1.0)
