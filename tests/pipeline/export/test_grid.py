import io
from pathlib import Path

import numpy as np
import pytest
import trimesh
from bimvox_pipeline.export import export
from box_grids import grid_of, part, random_shares
from full_disk import full_disk
from grid_bytes import grid_to_bytes

from bimvox.errors import FileError, GridFileError, InputError
from bimvox.grid.frame import GridFrame
from bimvox.progress import SilentProgress

KEYS = {"out", "messages", "lifts", "cells", "parts", "seconds"}


@pytest.fixture
def grid_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    shares = random_shares(4, (20, 16, 12), 3)
    parts = [part(f"part {n}", "IfcBeam", storey="L1") for n in range(3)]
    grid = grid_of(shares, parts, frame=GridFrame((2.0, 0.0, -1.0), 0.5), origin_m=(4e5, 5e6, 0.0))
    path = tmp_path / "tower.zarr.zip"
    path.write_bytes(grid_to_bytes(grid))
    return path


def run(source: Path, **options):
    return export(source, progress=SilentProgress(), **options)


@pytest.mark.parametrize(
    ("options", "out", "mark"),
    [
        ({}, "tower.vti", b"<?xml"),
        ({"to": "ply"}, "tower.ply", b"ply\n"),
        ({"to": "glb"}, "tower.glb", b"glTF"),
        ({"out": Path("x.glb")}, "x.glb", b"glTF"),
        ({"out": Path("x.PLY")}, "x.PLY", b"ply\n"),
        ({"out": Path("named.anything")}, "named.anything", b"<?xml"),
        ({"to": "vti", "out": Path("x.glb")}, "x.glb", b"<?xml"),
    ],
)
def test_the_format_is_the_requested_one_otherwise_that_of_the_name(grid_file, options, out, mark) -> None:
    document = run(grid_file, **options)
    assert document.keys() >= KEYS
    assert document["out"] == out
    assert (document["cells"], document["parts"], document["lifts"]) == (20 * 16 * 12, 3, 0)
    data = Path(out).read_bytes()
    assert data.startswith(mark)
    run(grid_file, **options)
    assert Path(out).read_bytes() == data


def test_the_faces_stand_where_the_cells_do(grid_file) -> None:
    run(grid_file, to="glb")
    scene = trimesh.load("tower.glb")
    assert set(scene.geometry) == {"part 0", "part 1", "part 2"}
    document = run(grid_file, to="ply")
    mesh = trimesh.load(io.BytesIO(Path("tower.ply").read_bytes()), file_type="ply", process=False)
    assert len(mesh.faces) == document["triangles"]
    # Whole cells of half a metre from (2, 0, -1).
    steps = (mesh.vertices - [2.0, 0.0, -1.0]) / 0.5
    np.testing.assert_allclose(steps, steps.round(), atol=1e-6)
    assert b"source coordinates: add 400000.0 5000000.0 0.0" in Path("tower.ply").read_bytes()


def test_formats_of_logs_and_unknown_ones_are_refused_with_those_that_fit(grid_file) -> None:
    for to in ("mcap", "csv", "stl"):
        with pytest.raises(InputError, match=r"(?s)the grid .* to .*a grid: vti, ply, glb"):
            run(grid_file, to=to)
    for options in ({"lifts": ("a",)}, {"recover": True}):
        with pytest.raises(InputError, match="for logs"):
            run(grid_file, **options)
    assert [path.name for path in Path().iterdir()] == ["tower.zarr.zip"]


def test_the_grid_is_not_overwritten_and_damage_is_reported(grid_file) -> None:
    before = grid_file.read_bytes()
    with pytest.raises(FileError, match="own input"):
        run(grid_file, out=grid_file)
    assert grid_file.read_bytes() == before
    broken = bytearray(before)
    broken[len(before) // 2] ^= 1
    Path("broken.zarr.zip").write_bytes(broken)
    with pytest.raises(GridFileError):
        run(Path("broken.zarr.zip"))
    assert not Path("broken.vti").exists()


def test_nothing_but_air_has_cells_and_no_faces(tmp_path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "air.zarr.zip"
    path.write_bytes(grid_to_bytes(grid_of([], shape=(3, 3, 3))))
    assert run(path)["parts"] == 0
    with pytest.raises(InputError, match="no faces"):
        run(path, to="glb")


def test_what_is_neither_log_nor_grid_is_refused(tmp_path) -> None:
    path = tmp_path / "a.site.toml"
    path.write_text("[model]\npath = 'a.ifc'\n")
    with pytest.raises(FileError, match=r"(?s)kind 'site'.*grids"):
        run(path)


@pytest.mark.parametrize("to", ["vti", "ply", "glb"])
def test_a_full_disk_is_reported_and_leaves_nothing(grid_file: Path, to: str) -> None:
    with full_disk(100), pytest.raises(FileError, match="file too large; nothing was changed"):
        run(grid_file, to=to, out=Path("out"))
    assert list(grid_file.parent.iterdir()) == [grid_file]
