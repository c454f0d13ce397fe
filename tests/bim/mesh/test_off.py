"""OFF and its variants with colours and normals."""

from __future__ import annotations

from pathlib import Path

import pytest
from mesh_samples import samples

from bimvox.bim.mesh.stl_obj_off import read_off
from bimvox.errors import MeshError

PATH = Path("a.off")
SQUARE = "0 0 0\n1 0 0\n1 1 0\n0 1 0\n"


def test_a_plain_mesh() -> None:
    (body,) = read_off(PATH, samples()["a.off"]).bodies
    assert len(body.faces) == 24
    assert body.vertices.max(axis=0).tolist() == [11, 2, 3]


@pytest.mark.parametrize(
    "keyword", ["OFF\n4 1 0\n", "OFF 4 1 0\n", "off4 1 0 # counts\n", "# by hand\n\n OFF\n\n4 1\n"]
)
def test_keyword_and_counts_in_any_layout(keyword: str) -> None:
    (body,) = read_off(PATH, (keyword + SQUARE + "4 0 1 2 3 0.5 0.5 0.5\n").encode()).bodies
    assert len(body.faces) == 2


def test_colours_and_normals_of_vertices_are_passed_over() -> None:
    rows = SQUARE.replace("\n", " 255 0 0 255\n")
    assert len(read_off(PATH, f"COFF\n4 1 0\n{rows}3 0 1 2\n".encode()).bodies[0].faces) == 1


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("hello", "does not begin with OFF"),
        ("OFF BINARY\n", "OFF BINARY file"),
        ("4OFF\n1 0 0\n", "4OFF file"),
        ("OFF\n", "does not count"),
        ("OFF\n-1 2\n", "does not count"),
        ("OFF\n1000000000 1 0\n0 0 0\n", "declares 1,000,000,000 vertices"),
        ("OFF\n4 1 0\n" + SQUARE + "4 0 1 2\n", "fewer corners"),
        ("OFF\n4 1 0\n" + SQUARE + "x 0 1 2\n", "not a number"),
        ("OFF\n4 1 0\n" + SQUARE + "1200000 " + "0 1 2 " * 400_000, "more than 1,000,000 corners"),
        ("OFF\n4 1 0\n" + SQUARE.replace("1 1 0", "1 1") + "3 0 1 2\n", "fewer than 3 numbers"),
    ],
)
def test_damage_is_named(text: str, message: str) -> None:
    with pytest.raises(MeshError, match=message):
        read_off(PATH, text.encode())


def test_points_are_reported() -> None:
    assert read_off(PATH, ("OFF\n4 0 0\n" + SQUARE).encode()).left_out == (("", "4 points"),)
