"""OBJ: objects and groups, polygons, negative indices, elements that are not surfaces."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from bimvox.bim.mesh.stl_obj_off import read_obj
from bimvox.errors import MeshError

PATH = Path("a.obj")
SQUARE = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n"


def names(text: str) -> list[str]:
    return [body.name for body in read_obj(PATH, text.encode()).bodies]


def test_several_objects_are_bodies_and_their_groups_are_not() -> None:
    assert names(SQUARE + "o A\ng A_red\nf 1 2 3\ng A_blue\nf 1 3 4\no B\nf 1 2 4\n") == ["A", "B"]


def test_groups_are_bodies_where_there_is_one_object_or_none() -> None:
    groups = "g beam 1\nf 1 2 3\ng beam 2\nf 1 3 4\ng beam 1\nf 1 2 4\n"
    assert names(SQUARE + groups) == ["beam 1", "beam 2"]
    assert names(SQUARE + "o File\n" + groups) == ["beam 1", "beam 2"]


def test_one_object_is_named_and_nothing_at_all_is_a_lump() -> None:
    assert names(SQUARE + "o Wall\nusemtl red\nf 1 2 3\n") == ["Wall"]
    assert names(SQUARE + "g default\nf 1 2 3\n") == [""]


def test_two_objects_of_one_name_are_two() -> None:
    assert names(SQUARE + "o A\nf 1 2 3\no A\nf 1 3 4\n") == ["A", "A"]


def test_corners_in_every_notation() -> None:
    text = "# by hand\nv 0 0 0 1.0 0 0\nv\t1 0 0\nv 1 1 0 # here\nv 0 1 0\nvt 0 0\nvn 0 0 1\nf 1/1/1 -3//1 3/1 \\\n 4\n"
    (body,) = read_obj(PATH, text.encode()).bodies
    assert body.vertices.tolist() == [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
    assert len(body.faces) == 2


def test_a_concave_face_is_covered_and_nothing_else() -> None:
    text = "v 0 0 0\nv 4 0 0\nv 4 1 0\nv 1 1 0\nv 1 3 0\nv 0 3 0\nf 4 5 6 1 2 3\n"
    (body,) = read_obj(PATH, text.encode()).bodies
    a, b, c = np.moveaxis(body.vertices[body.faces], 1, 0)
    assert np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2 == pytest.approx(6.0)


def test_lines_and_points_are_reported() -> None:
    contents = read_obj(PATH, (SQUARE + "l 1 2\nl 2 3\n").encode())
    assert contents.bodies == ()
    assert contents.left_out == (("", "2 lines"),)
    assert read_obj(PATH, SQUARE.encode()).left_out == (("", "4 points"),)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "has no vertices"),
        ("hello\n", "has no vertices"),
        ("v 0 0\nf 1 1 1\n", "fewer than 3 numbers"),
        ("v 0 0 x\n", "'x' is not a number"),
        (SQUARE + "f 1 two 3\n", "line 5: the face '1 two 3'"),
    ],
)
def test_damage_is_named(text: str, message: str) -> None:
    with pytest.raises(MeshError, match=message):
        read_obj(PATH, text.encode())


def test_missing_corners_make_no_number() -> None:
    (body,) = read_obj(PATH, (SQUARE + f"f 1 2 3\nf 1 2 99\nf 0 1 2\nf 1 2 -9\nf 1 2 {10**30}\n").encode()).bodies
    finite = np.isfinite(body.vertices[body.faces]).all(axis=(1, 2))
    assert finite.tolist() == [True, False, False, False, False]


def test_a_face_of_countless_corners_is_refused_before_it_is_read() -> None:
    line = "f " + "1 2 3 " * 400_000
    with pytest.raises(MeshError, match="more than 1,000,000 corners") as refused:
        read_obj(PATH, (SQUARE + line + "\n").encode())
    assert "line 5" in str(refused.value)
    assert len(str(refused.value)) < 300
