"""The heights between which the body of a part lies."""

from __future__ import annotations

import numpy as np
import pytest
from box_sites import box_mesh

from bimvox.bim.building import TriangleMesh
from bimvox.planning.order.body import body_m


def boxes(*pairs: tuple) -> TriangleMesh:
    return TriangleMesh.joined([box_mesh(*pair) for pair in pairs])


def test_a_solid_is_all_body() -> None:
    assert body_m(box_mesh((0, 0, 1.0), (2, 3, 4.0))) == (1.0, 4.0)


def test_railings_and_bolts_are_not() -> None:
    mesh = boxes(((0, 0, 1.0), (2, 3, 4.0)), ((0, 0, 4.0), (0.1, 3, 5.0)), ((1, 1, 0.5), (1.05, 1.05, 1.0)))
    assert body_m(mesh) == pytest.approx((1.0, 4.0), abs=0.08)


def test_a_slope_loses_its_tip_only() -> None:
    """A roof plane of 0.3 m that rises by 3 m: its ends are wedges."""
    mesh = box_mesh((0, 0, 0), (6, 4, 0.3))
    corners = mesh.vertices_m + np.outer(mesh.vertices_m[:, 0] / 2.0, [0.0, 0.0, 1.0])
    assert body_m(TriangleMesh(corners, mesh.faces)) == pytest.approx((0.0, 3.3), abs=0.15)


def test_of_an_inverted_mesh_it_is_the_same() -> None:
    mesh = boxes(((0, 0, 1.0), (2, 3, 4.0)), ((0, 0, 4.0), (0.1, 3, 5.0)))
    assert body_m(TriangleMesh(mesh.vertices_m, mesh.faces[:, ::-1])) == body_m(mesh)


def test_a_mesh_that_is_open_above_is_all_body() -> None:
    mesh = boxes(((0, 0, 1.0), (2, 3, 4.0)), ((0, 0, 4.0), (0.1, 3, 5.0)))
    open_m = mesh.triangles_m[..., 2].mean(axis=1) != 4.0  # without the faces at 4 m
    assert body_m(TriangleMesh(mesh.vertices_m, mesh.faces[open_m])) == (1.0, 5.0)


def test_a_flat_sheet_has_its_heights() -> None:
    corners = np.array([[0, 0, 1], [1, 0, 1], [0, 1, 1]], float)
    assert body_m(TriangleMesh(corners, np.array([[0, 1, 2]], np.int32))) == (1.0, 1.0)
