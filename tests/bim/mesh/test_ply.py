"""PLY: text and binary, both byte orders, mixed polygons, strips, headers that declare more than there is."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest
from mesh_samples import samples

from bimvox.bim.mesh.ply import read_ply
from bimvox.errors import MeshError

PATH = Path("a.ply")
HEADER = """ply
format {format} 1.0
comment made by hand
element vertex 5
property float x
property float y
property float z
property uchar red
element face 2
property list uchar int vertex_indices
property uchar shade
end_header
"""
POINTS = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1)]
FACES = [(0, 1, 2, 3), (0, 1, 4)]


def binary(order: str, name: str) -> bytes:
    body = b"".join(struct.pack(order + "fffB", *point, 9) for point in POINTS)
    body += b"".join(struct.pack(f"{order}B{len(face)}iB", len(face), *face, 5) for face in FACES)
    return HEADER.format(format=name).encode() + body


def text() -> bytes:
    rows = [f"{x} {y} {z} 9" for x, y, z in POINTS] + [" ".join(map(str, (len(face), *face, 5))) for face in FACES]
    return (HEADER.format(format="ascii") + "\n".join(rows) + "\n").encode()


@pytest.mark.parametrize("name", ["binary.ply", "text.ply"])
def test_a_plain_mesh(name: str) -> None:
    (body,) = read_ply(PATH, samples()[name]).bodies
    assert (len(body.faces), body.name) == (24, "")
    assert body.vertices.max(axis=0).tolist() == [11, 2, 3]


@pytest.mark.parametrize(
    "data",
    [binary("<", "binary_little_endian"), binary(">", "binary_big_endian"), text(), text().replace(b"\n", b"\r")],
)
def test_triangles_and_quads_mixed_with_other_values(data: bytes) -> None:
    (body,) = read_ply(PATH, data).bodies
    assert body.vertices.tolist() == [list(point) for point in POINTS]
    assert sorted(body.faces[2].tolist()) == [0, 1, 4]
    assert set(body.faces[:2].ravel().tolist()) == {0, 1, 2, 3}


def test_strips_as_scanners_write_them() -> None:
    head = "ply\nformat ascii 1.0\nelement vertex 5\nproperty double x\nproperty double y\nproperty double z\n"
    data = head + "element tristrips 1\nproperty list int int vertex_indices\nend_header\n"
    data += "".join(f"{x} {y} {z}\n" for x, y, z in POINTS) + "8 0 1 2 3 -1 0 1 4\n"
    (body,) = read_ply(PATH, data.encode()).bodies
    assert body.faces.tolist() == [[0, 1, 2], [2, 1, 3], [0, 1, 4]]


def test_values_that_the_header_does_not_announce_are_passed_over() -> None:
    (body,) = read_ply(PATH, text().replace(b" 9\n", b" 9 9 9\n")).bodies
    assert len(body.faces) == 3


def test_points_are_reported() -> None:
    data = HEADER.format(format="ascii").replace("face 2", "face 0") + "".join(f"{x} {y} {z} 1\n" for x, y, z in POINTS)
    assert read_ply(PATH, data.encode()).left_out == (("", "5 points"),)


@pytest.mark.parametrize("name", ["binary.ply", "text.ply"])
def test_cut_off_anywhere_it_is_refused(name: str) -> None:
    data = samples()[name].rstrip()
    for keep in range(1, len(data) - 2, 29):
        with pytest.raises(MeshError):
            read_ply(PATH, data[:keep])


@pytest.mark.parametrize("format_name", ["ascii", "binary_little_endian"])
@pytest.mark.parametrize("count", [10**6, 10**18, -1])
def test_a_count_that_the_file_cannot_hold(format_name: str, count: int) -> None:
    data = HEADER.format(format=format_name).replace("vertex 5", f"vertex {count}").encode() + b"0 0 0 0\n" * 20
    with pytest.raises(MeshError, match=r"too short|below zero|in row 20"):
        read_ply(PATH, data)


def test_a_count_of_nothing_at_all_ends() -> None:
    data = text().replace(b"element face", b"element ghost 1000000000000000\nelement face").replace(b" 9\n", b" 9 9\n")
    assert len(read_ply(PATH, data).bodies[0].faces) == 3


def test_a_list_length_that_the_file_cannot_hold() -> None:
    head = "ply\nformat binary_little_endian 1.0\nelement face 1\nproperty list uint int vertex_indices\nend_header\n"
    with pytest.raises(MeshError, match="damaged in row 0"):
        read_ply(PATH, head.encode() + struct.pack("<Ii", 0xFFFFFFFF, 1))


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (b"hello", "not a PLY file"),
        (b"ply\nformat ascii 1.0\nelement vertex 3\n", "not a PLY file"),
        (b"ply\nformat ebcdic 1.0\nend_header\n", "format ebcdic"),
        (b"ply\nformat ascii 1.0\nproperty float x\nend_header\n", "property float x"),
        (b"ply\nformat ascii 1.0\nelement vertex 1\nproperty list x\nend_header\n", "property list x"),
        (b"ply\nformat ascii 1.0\nelement face 0\nend_header\n", "no vertices"),
        (text().replace(b"1 1 0", b"1 ! 0"), "'!' is not a number"),
    ],
)
def test_damage_is_named(data: bytes, message: str) -> None:
    with pytest.raises(MeshError, match=message):
        read_ply(PATH, data)


def test_impossible_corners_make_no_number() -> None:
    (body,) = read_ply(PATH, text().replace(b"3 0 1 4", b"3 0 1 44")).bodies
    assert np.isfinite(body.vertices[body.faces]).all(axis=(1, 2)).sum() == 2
