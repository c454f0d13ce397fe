"""Bad input through the command line: exit code 2, a message, no traceback, nothing written."""

import json
import zipfile
from collections.abc import Callable
from pathlib import Path

import pytest
from bimvox_cli.main import run

SAMPLES = Path(__file__).parents[2] / "sample_models"
FRAME = (SAMPLES / "frame.ifc").read_bytes()


@pytest.fixture(autouse=True)
def in_an_empty_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("BIMVOX_POLICIES", str(tmp_path / "policies"))


def snapshot(folder: Path) -> dict[str, bytes | None]:
    return {
        str(path.relative_to(folder)): path.read_bytes() if path.is_file() else None
        for path in sorted(folder.rglob("*"))
    }


def zipped(name: str, data: bytes) -> bytes:
    path = Path("temporary.zip")
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr(name, data)
    content = path.read_bytes()
    path.unlink()
    return content


MODELS: dict[str, tuple[str, Callable[[], bytes] | None, str]] = {
    "missing": ("house.ifc", None, "no such file"),
    "empty": ("house.ifc", lambda: b"", "empty"),
    "garbage": ("house.ifc", lambda: bytes(range(256)) * 40, "ISO-10303-21"),
    "text": ("house.ifc", lambda: b"hello\n", "ISO-10303-21"),
    "truncated": ("house.ifc", lambda: FRAME[: len(FRAME) // 3], "truncated"),
    "end missing": ("house.ifc", lambda: FRAME[:-40], "truncated"),
    "no project": ("house.ifc", lambda: FRAME.replace(b"IFCPROJECT(", b"IFCPROXY("), "house.ifc"),
    "unknown schema": ("house.ifc", lambda: FRAME.replace(b"IFC4", b"IFC9"), "IFC9"),
    "zip of garbage": ("house.ifczip", lambda: zipped("house.ifc", b"garbage"), "ISO-10303-21"),
    "broken zip": ("house.ifczip", lambda: b"PK\3\4" + b"\0" * 90, "house.ifczip"),
    "unknown suffix": ("house.dwg", lambda: b"AC1032" + b"\0" * 90, "house.dwg"),
    "no suffix": ("house", lambda: FRAME, "house"),
    "garbage STL": ("house.stl", lambda: b"solid \xff\xfe\n" + bytes(range(200)), "house.stl"),
    "truncated STL": ("house.stl", lambda: (SAMPLES / "yard.stl").read_bytes()[:5000], "house.stl"),
    "garbage GLB": ("house.glb", lambda: b"glTF" + bytes(range(100)), "house.glb"),
    "empty OBJ": ("house.obj", lambda: b"# nothing\n", "house.obj"),
}


@pytest.mark.parametrize("command", ["voxelize", "init", "inspect"])
@pytest.mark.parametrize("case", MODELS)
def test_a_bad_model(command: str, case: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    name, data, message = MODELS[case]
    if command == "inspect" and case == "no suffix":
        message = "rename"
    if data is not None:
        Path(name).write_bytes(data())
    before = snapshot(tmp_path)
    assert run([command, name]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert err.startswith("error: ")
    assert message in err
    assert "Traceback" not in err
    assert snapshot(tmp_path) == before


USAGE = {
    "unknown option": ["--voxelsize", "0.1"],
    "cell of nothing": ["--voxel-size", "0"],
    "negative cell": ["--voxel-size", "-0.1"],
    "cell that is no number": ["--voxel-size", "nan"],
    "endless cell": ["--voxel-size", "inf"],
    "cell in words": ["--voxel-size", "small"],
    "far too many cells": ["--voxel-size", "0.000001"],
    "unknown unit": ["--unit", "furlong"],
    "contradicting unit": ["--unit", "ft"],
    "nothing selected": ["--select", "IfcChimney"],
    "malformed query": ["--select", "IfcBeam[["],
    "unknown assemblies": ["--assemblies", "some"],
    "no threads": ["--threads", "0"],
    "output in no folder": ["-o", "no/such/folder/grid.zarr.zip"],
    "output is a folder": ["-o", "."],
    "output is the input": ["-o", "house.ifc"],
    "output is the input by another name": ["-o", "./link.zarr.zip"],
    "output named as a model": ["-o", "other.ifc"],
    "output is a device": ["-o", "/dev/null"],
    "two models": ["house.ifc"],
}


@pytest.mark.parametrize("case", USAGE)
@pytest.mark.parametrize("as_json", [False, True])
def test_bad_usage_of_voxelize(case: str, as_json: bool, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    Path("house.ifc").write_bytes(FRAME)
    Path("link.zarr.zip").symlink_to("house.ifc")
    before = snapshot(tmp_path)
    assert run(["voxelize", "house.ifc", *USAGE[case], *(["--json"] if as_json else [])]) == 2
    out, err = capsys.readouterr()
    assert "error: " in err
    assert "Traceback" not in err
    assert snapshot(tmp_path) == before
    if as_json:
        assert json.loads(out)["error"]["exit_code"] == 2
    else:
        assert out == ""


SITES = {
    "unknown key": ('[model]\npath = "house.ifc"\nvoxel_size = 0.2\n', "did you mean 'voxel_size_m'?"),
    "unknown table": ('[model]\npath = "house.ifc"\n[cranes]\n', "did you mean 'crane'?"),
    "no model": ("[rules]\nclearance_m = 0.5\n", "model"),
    "no such model": ('[model]\npath = "hut.ifc"\n', "hut.ifc"),
    "impossible value": ('[model]\npath = "house.ifc"\nvoxel_size_m = -1.0\n', "model.voxel_size_m"),
    "not a number": ('[model]\npath = "house.ifc"\nvoxel_size_m = "big"\n', "model.voxel_size_m"),
    "not TOML": ("[model\npath = 3\n", "line 1"),
    "empty": ("", "empty"),
}


@pytest.mark.parametrize("command", ["inspect", "plan", "train"])
@pytest.mark.parametrize("case", SITES)
def test_a_bad_site_file(command: str, case: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text, message = SITES[case]
    Path("house.ifc").write_bytes(FRAME)
    Path("site.toml").write_text(text)
    before = snapshot(tmp_path)
    assert run([command, "site.toml"]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert err.startswith("error: ")
    assert message in err
    assert snapshot(tmp_path) == before


@pytest.mark.parametrize(
    ("name", "data", "message"),
    [
        ("a.json", b'{"version": 1, "obstructions": [{"id": "t", "bx": {}}]}', "did you mean 'box'?"),
        ("a.json", b'{"version": 1, "obstructions": [', "line 1"),
        ("a.toml", b"version = 1\nobstructions = 3\n", "obstructions"),
        ("a.json", b"", "empty"),
        ("a.mcap", b"\x89MCAP0\r\n" + b"\0" * 50, "a.mcap"),
        ("a.zarr.zip", b"PK\3\4garbage", "a.zarr.zip"),
        ("a.bin", bytes(range(256)), "recognised"),
        ("a.stl", FRAME, "rename it to a.ifc"),
    ],
)
def test_inspect_says_what_is_wrong(name: str, data: bytes, message: str, capsys: pytest.CaptureFixture[str]) -> None:
    Path(name).write_bytes(data)
    assert run(["inspect", name]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert message in err


@pytest.mark.parametrize("command", ["verify", "export", "render"])
def test_a_missing_log(command: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run([command, "no.mcap"]) == 2
    assert "no.mcap" in capsys.readouterr().err
    assert snapshot(tmp_path) == {}


@pytest.mark.parametrize("arguments", [["show", "abc"], ["remove", "abc"], ["show", ""], ["shw"]])
def test_a_missing_policy_is_bad_input(arguments: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["policy", *arguments]) == 2
    assert capsys.readouterr().err.startswith("error: ")
