"""A single mesh is split into bodies that can be lifted."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from bimvox.bim.building import TriangleMesh
from bimvox.bim.mesh.bodies import bodies_of, touching_groups
from bimvox.bim.mesh.repair import connected_labels, weld


def lump(*meshes: trimesh.Trimesh) -> TriangleMesh:
    whole = trimesh.util.concatenate(list(meshes))
    return weld(TriangleMesh(np.array(whole.vertices), np.array(whole.faces, dtype=np.int32)))


def moved(size: float, x: float) -> trimesh.Trimesh:
    made = trimesh.creation.box((size, size, size))
    made.apply_translation((x, 0, 0))
    return made


def test_closed_bodies_come_apart_in_file_order() -> None:
    bodies = bodies_of(lump(moved(1, 5), moved(2, 0), moved(1, -5)))
    assert [body.bounds_m.mean(axis=0)[0] for body in bodies] == [5, 0, -5]
    assert [body.signed_volume_m3 for body in bodies] == pytest.approx([1, 8, 1])


def test_a_cavity_stays_with_its_body_but_a_box_in_a_box_is_another_body() -> None:
    hole = moved(1, 0)
    hole.invert()
    assert [body.signed_volume_m3 for body in bodies_of(lump(moved(3, 0), hole))] == pytest.approx([26])
    assert len(bodies_of(lump(moved(3, 0), moved(1, 0)))) == 2


def test_bodies_that_touch_stay_apart() -> None:
    wall = [moved(1, n) for n in range(4)]
    bodies = bodies_of(lump(*wall))
    assert [body.bounds_m[0, 0] for body in bodies] == [-0.5, 0.5, 1.5, 2.5]
    assert [body.signed_volume_m3 for body in bodies] == pytest.approx([1] * 4)


@given(st.integers(0, 2**32 - 1))
@settings(deadline=None)
def test_blocks_that_touch_anyhow_stay_apart_and_whole(seed: int) -> None:
    rng = np.random.default_rng(seed)
    places = np.unique(rng.integers(0, 3, (8, 3)), axis=0)
    blocks = []
    for place in rng.permutation(places):
        blocks.append(moved(1, 0))
        blocks[-1].apply_translation(place)
    bodies = bodies_of(lump(*blocks))
    assert [body.signed_volume_m3 for body in bodies] == pytest.approx([1] * len(blocks))
    assert [body.bounds_m[0].tolist() for body in bodies] == [block.bounds[0].tolist() for block in blocks]


def test_one_body_in_any_order_of_its_faces_stays_one() -> None:
    sphere = trimesh.creation.icosphere(2)
    order = np.random.default_rng(3).permutation(len(sphere.faces))
    mesh = TriangleMesh(np.array(sphere.vertices), np.array(sphere.faces, dtype=np.int32)[order])
    (body,) = bodies_of(mesh)
    assert len(body.faces) == len(sphere.faces)


def test_cavities_of_many_bodies_stay_with_their_own() -> None:
    holes = [moved(1, 10 * n) for n in range(5)]
    for hole in holes:
        hole.invert()
    bodies = bodies_of(lump(*(moved(3, 10 * n) for n in range(5)), *holes))
    assert [body.signed_volume_m3 for body in bodies] == pytest.approx([26] * 5)


def test_loose_triangles_that_touch_are_one_body() -> None:
    box = moved(1, 0)
    triangles = np.array(box.triangles)
    centres = triangles.mean(axis=1, keepdims=True)
    triangles = centres + (triangles - centres) * np.linspace(1.01, 1.02, 12)[:, None, None]
    far = triangles + 50.0
    vertices = np.concatenate([triangles, far]).reshape(-1, 3)
    bodies = bodies_of(TriangleMesh(vertices, np.arange(72, dtype=np.int32).reshape(-1, 3)))
    assert [len(body.faces) for body in bodies] == [12, 12]


@given(st.integers(0, 2**32 - 1), st.integers(1, 40))
@settings(max_examples=50, deadline=None)
def test_groups_are_those_of_all_pairs_of_boxes(seed: int, count: int) -> None:
    rng = np.random.default_rng(seed)
    low = rng.integers(0, 12, (count, 3)).astype(np.float64)
    high = low + rng.integers(0, 4, (count, 3))
    touch = ((low[:, None] <= high[None]) & (high[:, None] >= low[None])).all(axis=2)
    assert touching_groups(low, high).tolist() == connected_labels(count, *np.nonzero(touch)).tolist()
