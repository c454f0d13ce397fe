"""STL: binary and text, several solids, files truncated anywhere."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest
from mesh_samples import box, samples
from trimesh.exchange import stl

from bimvox.bim.mesh.stl_obj_off import read_stl
from bimvox.errors import MeshError

PATH = Path("a.stl")


@pytest.mark.parametrize("name", ["binary.stl", "text.stl"])
def test_both_kinds_hold_the_same_triangles(name: str) -> None:
    (body,) = read_stl(PATH, samples()[name]).bodies
    assert body.name == ""
    assert body.faces.shape == (24, 3)
    assert body.vertices.min(axis=0).tolist() == [0, 0, 0]
    assert body.vertices.max(axis=0).tolist() == [11, 2, 3]


def test_a_binary_file_may_begin_with_solid_and_carry_colours() -> None:
    data = bytearray(samples()["binary.stl"])
    data[:5] = b"solid"
    data[84 + 48 : 84 + 50] = b"\xff\x7f"
    assert len(read_stl(PATH, bytes(data)).bodies[0].faces) == 24


def test_bytes_after_the_last_triangle_are_noted() -> None:
    contents = read_stl(PATH, samples()["binary.stl"] + b"made by X")
    assert len(contents.bodies[0].faces) == 24
    assert contents.notes == ("9 bytes after the last triangle were not read",)


def test_text_is_read_whatever_its_case_layout_and_line_ends() -> None:
    text = stl.export_stl_ascii(box())
    for variant in (text.upper(), text.replace("\n", "\r\n"), text.replace("\n", " ").replace("solid ", "solid\n", 1)):
        assert len(read_stl(PATH, variant.encode()).bodies[0].faces) == 12


def test_solids_of_one_name_are_two() -> None:
    text = stl.export_stl_ascii(box()).replace("solid ", "solid Stütze", 1) + "\n"
    contents = read_stl(PATH, (text * 2).encode("latin-1"))
    assert [body.name for body in contents.bodies] == ["Stütze", "Stütze"]


@pytest.mark.parametrize("name", ["binary.stl", "text.stl"])
def test_cut_off_anywhere_it_is_refused(name: str) -> None:
    data = samples()[name]
    for keep in range(1, len(data.rstrip()) - 1, 37):
        with pytest.raises(MeshError):
            read_stl(PATH, data[:keep])


def test_a_huge_count_is_refused_by_the_size_of_the_file() -> None:
    with pytest.raises(MeshError, match=r"declares 4,294,967,295 triangles .* has 1,084 bytes"):
        read_stl(PATH, b"\0" * 80 + struct.pack("<I", 0xFFFFFFFF) + b"\0" * 1000)


def test_words_that_are_not_numbers_are_named() -> None:
    text = stl.export_stl_ascii(box()).replace("vertex 1.0", "vertex l.0", 1)
    with pytest.raises(MeshError, match=r"'l\.0' is not a number"):
        read_stl(PATH, text.encode())


def test_rounding_of_single_precision_far_away() -> None:
    near, far = (read_stl(PATH, stl.export_stl(box(at=(at, 0, 0)))).bodies[0] for at in (0.0, 4e6))
    assert near.rounding < 1e-6
    assert far.rounding == pytest.approx(np.spacing(np.float32(4e6)) / 2, rel=0.5)
