"""Reading any building file: dispatch by suffix, and files that are not building files."""

from __future__ import annotations

from pathlib import Path

import pytest

from bimvox.bim.read import ReadOptions, read_building
from bimvox.errors import FileError, IfcError, InputError, MeshError

_STL = (
    "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid\n"
)


def test_an_unknown_suffix_lists_what_is_accepted(tmp_path: Path) -> None:
    path = tmp_path / "model.dwg"
    path.write_text("x")
    with pytest.raises(FileError, match=r"\.dwg") as caught:
        read_building(path)
    assert ".ifczip" in (caught.value.hint or "")
    assert ".3mf" in (caught.value.hint or "")


@pytest.mark.parametrize("name", ["a.ifc", "a.stl", "a.IFCZIP"])
def test_missing_empty_and_folder(tmp_path: Path, name: str) -> None:
    path = tmp_path / name
    with pytest.raises(FileError, match="no such file"):
        read_building(path)
    path.touch()
    with pytest.raises(FileError, match="empty"):
        read_building(path)
    path.unlink()
    path.mkdir()
    with pytest.raises(FileError, match="folder"):
        read_building(path)


@pytest.mark.parametrize("suffix", ["ifc", "ifczip", "stl", "obj", "ply", "off", "glb", "gltf", "3mf"])
@pytest.mark.parametrize("content", [b"hello, this is text\n", bytes(range(256)) * 8], ids=["text", "bytes"])
def test_garbage_is_an_error_of_its_format(tmp_path: Path, suffix: str, content: bytes) -> None:
    path = tmp_path / f"garbage.{suffix}"
    path.write_bytes(content)
    with pytest.raises(IfcError if suffix.startswith("ifc") else MeshError) as caught:
        read_building(path)
    assert caught.value.hint
    assert caught.value.path == path


def test_the_suffix_may_be_upper_case(tmp_path: Path) -> None:
    path = tmp_path / "A.STL"
    path.write_text(_STL)
    building = read_building(path)
    assert building.source.format == "STL"
    assert building.source.name == "A.STL"
    assert len(building.source.sha256) == 64


@pytest.mark.parametrize("bad", [{"assemblies": "some"}, {"timeout_s": 0.0}, {"processes": 0}])
def test_options_out_of_range(bad: dict[str, object]) -> None:
    with pytest.raises(InputError):
        ReadOptions(**bad)  # type: ignore[arg-type]
