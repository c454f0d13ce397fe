"""Faces with many corners are triangulated exactly, whatever their shape."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bimvox.bim.mesh import contents
from bimvox.bim.mesh.contents import triangulated

L_SHAPE = [(0, 0), (4, 0), (4, 1), (1, 1), (1, 3), (0, 3)]


def cut(corners: list[tuple[float, float]], normal_axis: int = 2) -> tuple[np.ndarray, np.ndarray]:
    flat = np.array(corners, dtype=np.float64)
    vertices = np.insert(flat, normal_axis, 7.0, axis=1)
    faces = triangulated(vertices, np.array([len(corners)]), np.arange(len(corners)))
    a, b, c = np.moveaxis(vertices[faces], 1, 0)
    return faces, np.cross(b - a, c - a)[:, normal_axis] / 2


def shoelace(corners: list[tuple[float, float]]) -> float:
    x, y = np.array(corners, dtype=np.float64).T
    return float(x @ np.roll(y, -1) - y @ np.roll(x, -1)) / 2


@pytest.mark.parametrize("start", range(6))
@pytest.mark.parametrize("step", [1, -1])
def test_a_concave_face_from_every_corner_and_either_side(start: int, step: int) -> None:
    corners = (L_SHAPE[start:] + L_SHAPE[:start])[::step]
    _, areas = cut(corners)
    assert len(areas) == 4
    assert (areas * step > 0).all()
    assert areas.sum() == pytest.approx(6.0 * step)


@given(st.lists(st.floats(0.2, 5.0), min_size=4, max_size=14), st.integers(0, 13))
@settings(max_examples=60)
def test_no_triangle_lies_outside_a_star(radii: list[float], start: int) -> None:
    angles = np.linspace(0, 2 * np.pi, len(radii), endpoint=False)
    star = [(r * np.cos(a), r * np.sin(a)) for r, a in zip(radii, angles, strict=True)]
    start %= len(star)
    faces, areas = cut(star[start:] + star[:start])
    assert len(faces) == len(star) - 2
    # If all triangles face up and their areas add up to that of the face, they cover it and nothing else.
    assert (areas > -1e-12).all()
    assert areas.sum() == pytest.approx(shoelace(star))


def test_a_hole_with_a_bridge() -> None:
    around = [(0, 0), (10, 0), (10, 10), (0, 10), (0, 0)]
    hole = [(3, 3), (3, 6), (6, 6), (6, 3), (3, 3)]
    _, areas = cut(around + hole)
    assert (areas >= 0).all()
    assert areas.sum() == pytest.approx(100 - 9)


def test_corners_on_a_straight_edge_stay_corners() -> None:
    # The neighbours have corners at (1, 0) and (2, 0): a triangle that skips one leaves a gap between the faces.
    faces, areas = cut([(0, 0), (1, 0), (2, 0), (2, 1), (0, 1)])
    assert (areas > 0).all()
    edges = {tuple(sorted(pair)) for face in faces.tolist() for pair in zip(face, face[1:] + face[:1], strict=True)}
    assert {(0, 1), (1, 2)} <= edges


def test_spirals_are_cut_as_fans_once_ear_clipping_has_worked_enough(monkeypatch: pytest.MonkeyPatch) -> None:
    turn = np.linspace(0.0, 20.0 * np.pi, 60)
    arms = [np.stack([(width + turn) * np.cos(turn), (width + turn) * np.sin(turn)], axis=1) for width in (1.0, 0.5)]
    spiral = [tuple(corner) for corner in np.concatenate([arms[0], arms[1][::-1]]).tolist()]
    fan = [[0, n + 1, n + 2] for n in range(len(spiral) - 2)]
    assert cut(spiral)[0].tolist() != fan
    monkeypatch.setattr(contents, "WORK", 0)
    monkeypatch.setattr(contents, "WORK_A_CORNER", 10)
    assert cut(spiral)[0].tolist() == fan
    assert cut(L_SHAPE)[1].sum() == pytest.approx(shoelace(L_SHAPE))


def test_order_and_corner_counts_are_kept() -> None:
    vertices = np.random.default_rng(1).random((20, 3))
    sizes = np.array([3, 4, 2, 0, 1, 3])
    faces = triangulated(vertices, sizes, np.arange(13))
    assert faces[0].tolist() == [0, 1, 2]
    assert sorted(set(faces[1:3].ravel().tolist())) == [3, 4, 5, 6]
    assert faces[3:].tolist() == [[10, 11, 12]]


def test_damaged_corners_do_not_matter() -> None:
    vertices = np.array([[0, 0, 0], [1, 0, 0], [np.nan, 1, 0], [0, 1, 0], [0.1, 0.1, np.inf]])
    assert len(triangulated(vertices, np.array([5]), np.arange(5))) == 3
    assert len(triangulated(np.zeros((6, 3)), np.array([6]), np.arange(6))) == 4
