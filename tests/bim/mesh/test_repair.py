"""Repairs preserve the solid: orientation, welding, degenerate faces, volume."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bimvox.bim.building import TriangleMesh
from bimvox.bim.mesh.repair import (
    SHEET_M,
    connected_labels,
    drop_bad_faces,
    shells_of,
    solid_of,
    turn_outward,
    weld,
    wind_consistently,
)

_QUADS = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
_FACES = np.array([tri for a, b, c, d in _QUADS for tri in ((a, b, c), (a, c, d))], dtype=np.int32)


def box(low: tuple[float, float, float] = (0, 0, 0), size: tuple[float, float, float] = (1, 1, 1)) -> TriangleMesh:
    corners = np.array(np.meshgrid([0, 1], [0, 1], [0, 1], indexing="ij")).reshape(3, -1).T
    return TriangleMesh(np.array(low) + corners * np.array(size, dtype=np.float64), _FACES)


def joined(*meshes: TriangleMesh) -> TriangleMesh:
    offsets = np.cumsum([0] + [len(mesh.vertices_m) for mesh in meshes])
    return TriangleMesh(
        np.concatenate([mesh.vertices_m for mesh in meshes]),
        np.concatenate([mesh.faces + offset for mesh, offset in zip(meshes, offsets, strict=False)]).astype(np.int32),
    )


def inverted(mesh: TriangleMesh) -> TriangleMesh:
    return TriangleMesh(mesh.vertices_m, np.ascontiguousarray(mesh.faces[:, ::-1]))


def soup(mesh: TriangleMesh) -> TriangleMesh:
    return TriangleMesh(mesh.triangles_m.reshape(-1, 3), np.arange(3 * len(mesh.faces), dtype=np.int32).reshape(-1, 3))


def volume(mesh: TriangleMesh) -> tuple[float, bool]:
    solid = solid_of(shells_of(mesh))
    return solid.volume_m3, solid.exact


def test_the_box_itself_is_right() -> None:
    assert box(size=(1, 2, 3)).signed_volume_m3 == pytest.approx(6.0)


@given(
    st.lists(st.tuples(st.integers(0, 19), st.integers(0, 19)), max_size=40),
)
def test_labels_are_the_lowest_reachable_node(edges: list[tuple[int, int]]) -> None:
    a, b = (np.array([edge[side] for edge in edges], dtype=np.int64) for side in (0, 1))
    reach = np.eye(20, dtype=bool)
    reach[a, b] = reach[b, a] = True
    for _ in range(5):
        reach = (reach.astype(int) @ reach.astype(int)) > 0
    assert connected_labels(20, a, b).tolist() == reach.argmax(axis=1).tolist()


@given(st.lists(st.booleans(), min_size=12, max_size=12))
def test_any_mix_of_windings_becomes_an_outward_box(turns: list[bool]) -> None:
    mesh = box(size=(2, 3, 4))
    faces = np.where(np.array(turns)[:, None], mesh.faces[:, ::-1], mesh.faces)
    outward, shells, _ = turn_outward(TriangleMesh(mesh.vertices_m, faces))
    assert outward.signed_volume_m3 == pytest.approx(24.0)
    assert shells.closed.all()
    assert shells.volume_m3.tolist() == pytest.approx([24.0])


def test_a_sound_mesh_is_left_alone() -> None:
    mesh = joined(box(), box((3, 0, 0)))
    outward, _, turned = turn_outward(mesh)
    assert not turned
    assert np.array_equal(outward.faces, mesh.faces)


def test_only_the_inverted_shell_is_flipped() -> None:
    outward, shells, turned = turn_outward(joined(box(), inverted(box((3, 0, 0)))))
    assert turned
    assert shells.volume_m3.tolist() == pytest.approx([1.0, 1.0])
    assert volume(outward) == (pytest.approx(2.0), True)


@pytest.mark.parametrize("whole_inverted", [False, True])
def test_a_cavity_stays_a_cavity(whole_inverted: bool) -> None:
    hollow = joined(box(size=(4, 4, 4)), inverted(box((1, 1, 1), (2, 2, 2))))
    outward, _, turned = turn_outward(inverted(hollow) if whole_inverted else hollow)
    assert turned is whole_inverted
    assert volume(outward) == (pytest.approx(64.0 - 8.0), True)


def test_a_moebius_strip_is_left_alone() -> None:
    angle = np.linspace(0, 2 * np.pi, 12, endpoint=False)
    ring = [
        ((2 + w * np.cos(a / 2)) * np.cos(a), (2 + w * np.cos(a / 2)) * np.sin(a), w * np.sin(a / 2))
        for a in angle
        for w in (-0.5, 0.5)
    ]
    faces = []
    for i in range(12):
        a, b = 2 * i, 2 * i + 1
        c, d = (2 * i + 2, 2 * i + 3) if i < 11 else (1, 0)
        faces += [(a, c, b), (b, c, d)]
    mesh = TriangleMesh(np.array(ring), np.array(faces, dtype=np.int32))
    wound, turned = wind_consistently(mesh)
    assert turned == 0
    assert np.array_equal(wound.faces, mesh.faces)


def test_weld_closes_a_soup_with_single_precision_noise() -> None:
    loose = soup(box((100.0, 0.0, 0.0), (10.0, 3.0, 2.0)))
    noisy = loose.vertices_m + np.random.default_rng(1).uniform(-1e-8, 1e-8, loose.vertices_m.shape)
    assert not shells_of(loose).closed.any()
    welded = weld(TriangleMesh(noisy, loose.faces))
    assert len(welded.vertices_m) == 8
    assert volume(welded) == (pytest.approx(60.0), True)


def test_bad_faces_go_and_are_counted() -> None:
    mesh = box()
    vertices = np.vstack([mesh.vertices_m, [[np.nan, 0, 0], [0.5, 0.0, 0.0], [np.inf, 1, 1]]])
    bad = [[0, 1, 8], [0, 0, 1], [0, 4, 9], [1, 2, 10], [0, 1, 99]]
    clean, dropped = drop_bad_faces(TriangleMesh(vertices, np.vstack([mesh.faces, bad]).astype(np.int32)))
    assert dropped == 5
    assert np.array_equal(clean.faces, mesh.faces)


def test_a_box_whose_faces_share_no_vertices_still_has_its_volume() -> None:
    measured, exact = volume(TriangleMesh(box(size=(2, 2, 2)).triangles_m.reshape(-1, 3), soup(box()).faces))
    assert not exact
    assert measured > 0


@pytest.mark.parametrize("size", [(1.0, 1.0, 1.0), (4.0, 3.0, 0.2), (0.3, 0.4, 6.0)])
@pytest.mark.parametrize("face", range(6))
def test_a_box_without_one_face_is_closed(size: tuple[float, float, float], face: int) -> None:
    whole = box(size=size)
    lidless = TriangleMesh(whole.vertices_m, np.delete(whole.faces, [2 * face, 2 * face + 1], axis=0))
    assert volume(lidless) == (pytest.approx(np.prod(size)), False)


def strip(points: list[tuple[float, float]], length: float) -> TriangleMesh:
    """Bend a sheet along lines."""
    low = np.array([(x, 0.0, z) for x, z in points])
    n = np.arange(len(points) - 1)
    faces = [np.stack([n, n + 1, n + 1 + len(low)], axis=1), np.stack([n, n + 1 + len(low), n + len(low)], axis=1)]
    return TriangleMesh(
        np.concatenate([low, low + np.array([0.0, length, 0.0])]), np.concatenate(faces).astype(np.int32)
    )


HALF_CIRCLE = [(2.0 * np.cos(t), 2.0 * np.sin(t)) for t in np.linspace(0.0, np.pi, 25)]
FOLDS = [(0.1 * n, 0.05 * (n % 2)) for n in range(40)]


@pytest.mark.parametrize(
    ("points", "area_m2"),
    [
        ([(0, 0), (1, 0)], 6.0),
        ([(0, 0), (1, 0), (1, 1)], 12.0),
        ([(0, 1), (0, 0), (1, 0), (1, 1)], 18.0),
        (HALF_CIRCLE, 6.0 * 2.0 * np.pi),
        (FOLDS, 6.0 * 39 * np.hypot(0.1, 0.05)),
    ],
)
def test_a_bent_sheet_weighs_as_a_sheet_and_not_as_what_it_encloses(
    points: list[tuple[float, float]], area_m2: float
) -> None:
    solid = solid_of(shells_of(strip(points, 6.0)))
    assert solid.sheet_m2 == pytest.approx(area_m2, rel=0.01)
    assert (solid.volume_m3, solid.exact) == (pytest.approx(SHEET_M * solid.sheet_m2), False)


def test_a_room_without_a_floor_is_a_sheet() -> None:
    whole = box(size=(6.0, 5.0, 3.0))
    normals = np.cross(*np.moveaxis(whole.triangles_m[:, 1:] - whole.triangles_m[:, :1], 1, 0))
    room = TriangleMesh(whole.vertices_m, whole.faces[normals[:, 2] > -1e-9])
    assert volume(room) == (pytest.approx(SHEET_M * 96.0), False)


def test_an_open_sheet_is_a_sheet() -> None:
    sheet = TriangleMesh(np.array([[0, 0, 0], [2, 0, 0], [0, 2, 0.0]]), np.array([[0, 1, 2]], dtype=np.int32))
    assert volume(sheet) == (pytest.approx(0.02), False)


def bent_pipe(radius: float = 0.05, legs: float = 3.0) -> TriangleMesh:
    """Two legs at a right angle, without lids."""
    turn = np.linspace(0, 2 * np.pi, 16, endpoint=False)
    ring = np.stack([np.cos(turn), np.sin(turn)], axis=1) * radius
    rings = [
        np.stack([ring[:, 0], ring[:, 1], np.full(16, -legs)], axis=1),
        np.stack([ring[:, 0], ring[:, 1], ring[:, 0]], axis=1),
        np.stack([np.full(16, -legs), ring[:, 1], ring[:, 0]], axis=1),
    ]
    faces = [
        face
        for low in (0, 16)
        for i in range(16)
        for a, b, c, d in [(low + i, low + (i + 1) % 16, low + 16 + i, low + 16 + (i + 1) % 16)]
        for face in ((a, b, d), (a, d, c))
    ]
    return TriangleMesh(np.concatenate(rings), np.array(faces, dtype=np.int32))


def test_a_bent_pipe_without_lids_is_no_half_box() -> None:
    pipe = bent_pipe()
    measured, exact = volume(pipe)
    assert not exact
    assert measured == pytest.approx(2 * 3.0 * np.pi * 0.05**2, rel=0.35)  # half of its box is thirty times as much


def test_a_sheet_with_two_sides_counts_as_a_sheet() -> None:
    sheet = TriangleMesh(
        np.array([[0, 0, 0], [2, 0, 0], [0, 2, 0.0]]), np.array([[0, 1, 2], [0, 2, 1]], dtype=np.int32)
    )
    measured, exact = volume(sheet)
    assert measured > 0
    assert not exact


def test_vertices_of_a_far_piece_do_not_blunt_the_near_one() -> None:
    near = soup(box(size=(0.02, 0.02, 0.02)))
    far = joined(near, box((1e8, 0, 0)))
    assert len(weld(near).vertices_m) == 8
    assert len(weld(far).vertices_m) == 16


@given(st.integers(0, 2**32 - 1))
def test_welding_keeps_every_triangle_in_place(seed: int) -> None:
    rng = np.random.default_rng(seed)
    vertices = rng.integers(-3, 4, (30, 3)).astype(np.float64) * rng.choice([1.0, 1e-3, 1e6], 3)
    mesh = TriangleMesh(vertices, rng.integers(0, 30, (20, 3)).astype(np.int32))
    welded = weld(mesh)
    assert welded.triangles_m == pytest.approx(mesh.triangles_m)
    assert len(np.unique(welded.vertices_m, axis=0)) == len(welded.vertices_m)
