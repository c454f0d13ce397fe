import zipfile
from pathlib import Path

import pytest
from bimvox_pipeline.inspect.kinds import Kind, kind_of

from bimvox.errors import FileError

STEP = b"ISO-10303-21;\nHEADER;\n"


def archive(path: Path, *names: str) -> None:
    with zipfile.ZipFile(path, "w") as file:
        for name in names:
            file.writestr(name, b"content")


@pytest.mark.parametrize(
    ("name", "data", "kind"),
    [
        ("a.ifc", STEP, Kind.IFC),
        ("a.stl", STEP, Kind.IFC),
        ("a.ifc", b"\xef\xbb\xbf\n" + STEP, Kind.IFC),
        ("a.ifc", b"garbage", Kind.IFC),
        ("a.txt", b"solid part\nfacet normal", Kind.MESH),
        ("a.stl", bytes(100), Kind.MESH),
        ("a.obj", b"v 0 0 0\n", Kind.MESH),
        ("a.bin", b"glTF\2\0\0\0", Kind.MESH),
        ("a.ply", b"ply\nformat ascii 1.0\n", Kind.MESH),
        ("a.gltf", b'{"asset": {"version": "2.0"}}', Kind.MESH),
        ("a.log", b"\x89MCAP0\r\nrest", Kind.LOG),
        ("a.toml", b'[model]\npath = "a.ifc"\n', Kind.SITE),
        ("a.conf", b'[model]\npath = "a.ifc"\n', Kind.SITE),
        ("a.toml", b"version = 1\nobstructions = []\n", Kind.OBSTRUCTIONS),
        ("a.txt", b'{"version": 1, "obstructions": []}', Kind.OBSTRUCTIONS),
        ("a.toml", b"[model", Kind.SITE),
        ("a.json", b"{", Kind.OBSTRUCTIONS),
    ],
)
def test_a_file_is_classified_by_content(tmp_path: Path, name: str, data: bytes, kind: Kind) -> None:
    (tmp_path / name).write_bytes(data)
    assert kind_of(tmp_path / name) is kind


@pytest.mark.parametrize(
    ("members", "kind"),
    [
        (("zarr.json", "labels/zarr.json"), Kind.GRID),
        (("House.IFC",), Kind.IFC),
        (("3D/3dmodel.model",), Kind.MESH),
    ],
)
def test_an_archive_is_classified_by_content(tmp_path: Path, members: tuple[str, ...], kind: Kind) -> None:
    archive(tmp_path / "a.zip", *members)
    assert kind_of(tmp_path / "a.zip") is kind


def test_files_that_bimvox_does_not_know(tmp_path: Path) -> None:
    (tmp_path / "a.bin").write_bytes(bytes(range(256)))
    (tmp_path / "a.zip").write_bytes(b"PK\3\4cut")
    archive(tmp_path / "b.zip", "readme.txt")
    with pytest.raises(FileError, match="recognised"):
        kind_of(tmp_path / "a.bin")
    with pytest.raises(FileError, match="damaged archive"):
        kind_of(tmp_path / "a.zip")
    with pytest.raises(FileError, match="recognised"):
        kind_of(tmp_path / "b.zip")
    with pytest.raises(FileError, match="folder"):
        kind_of(tmp_path)
    with pytest.raises(FileError, match="no such file"):
        kind_of(tmp_path / "c.ifc")
