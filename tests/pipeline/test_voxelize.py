import hashlib
from pathlib import Path

import numpy as np
import pytest
from bimvox_pipeline.voxelize import voxelize
from grid_bytes import grid_from_bytes

from bimvox.bim.options import ReadOptions
from bimvox.errors import FileError, InputError, SelectionError
from bimvox.progress import SilentProgress

SAMPLES = Path(__file__).parents[2] / "sample_models"
KEYS = {"grid", "shape", "voxel_size_m", "origin_m", "counts", "components", "skipped", "seconds"}
COMPONENT_KEYS = {"id", "global_id", "ifc_class", "name", "cells", "solid_volume_m3"} | {
    *("type_name", "storey", "material", "mass_kg", "mass_source", "fill_fraction", "fill", "boxes", "shared_cells")
}


@pytest.fixture(autouse=True)
def in_an_empty_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def test_the_document_agrees_with_the_grid_that_was_written() -> None:
    document = voxelize(SAMPLES / "frame.ifc", voxel_size_m=0.2, progress=SilentProgress())
    assert document["grid"] == "frame.zarr.zip"
    assert document.keys() >= KEYS
    grid = grid_from_bytes(Path("frame.zarr.zip").read_bytes(), "frame.zarr.zip")
    assert document["shape"] == list(grid.shape)
    assert document["origin_m"] == list(grid.frame.origin_m)
    assert sum(document["counts"].values()) == np.prod(grid.shape)
    assert document["counts"]["component"] == int((grid.owners.dense() >= 0).sum())
    assert len(document["components"]) == 8
    for index, component in enumerate(document["components"]):
        assert component.keys() >= COMPONENT_KEYS
        owned = int((grid.owners.dense() == index).sum())
        shared = int((grid.shared_parts == index).sum())
        assert owned <= component["cells"] <= owned + shared


def test_units_do_not_matter() -> None:
    metres = voxelize(SAMPLES / "frame.ifc", Path("m.zarr.zip"), voxel_size_m=0.25, progress=SilentProgress())
    millimetres = voxelize(
        SAMPLES / "frame_ifc2x3_mm.ifc", Path("mm.zarr.zip"), voxel_size_m=0.25, progress=SilentProgress()
    )
    assert metres["counts"] == millimetres["counts"]
    one, other = (grid_from_bytes(Path(name).read_bytes(), name) for name in ("m.zarr.zip", "mm.zarr.zip"))
    assert np.array_equal(one.owners.dense(), other.owners.dense())


def test_the_same_input_gives_the_same_bytes_on_any_number_of_threads() -> None:
    digests = set()
    for threads in (1, 2):
        out = Path(f"{threads}.zarr.zip")
        voxelize(SAMPLES / "frame.ifc", out, voxel_size_m=0.1, threads=threads, progress=SilentProgress())
        digests.add(hashlib.sha256(out.read_bytes()).hexdigest())
    assert len(digests) == 1


def test_the_default_cell_size_is_printed_and_below_twenty_million_cells() -> None:
    progress = SilentProgress()
    document = voxelize(SAMPLES / "frame.ifc", progress=progress)
    assert document["voxel_size_m"] == 0.05
    assert any(note.startswith("cell size 0.05 m") for note in progress.notes)
    assert int(np.prod(document["shape"])) <= 20_000_000


def test_a_selection_makes_the_rest_structure() -> None:
    document = voxelize(
        SAMPLES / "frame.ifc", voxel_size_m=0.2, options=ReadOptions(select="IfcBeam"), progress=SilentProgress()
    )
    assert {part["ifc_class"] for part in document["components"]} == {"IfcBeam"}
    assert {part["role"] for part in document["others"]} == {"structure"}


def test_a_mesh_with_y_up() -> None:
    Path("a.obj").write_text("v 0 0 0\nv 4 0 0\nv 0 9 0\nf 1 2 3\n")
    shapes = [
        voxelize(
            Path("a.obj"),
            Path(f"{up}.zarr.zip"),
            voxel_size_m=1.0,
            options=ReadOptions(up=up),
            progress=SilentProgress(),
        )["shape"]
        for up in ("z", "y")
    ]
    assert shapes == [[4, 9, 1], [4, 1, 9]]


def test_sums_are_those_of_the_parts() -> None:
    document = voxelize(SAMPLES / "frame.ifc", voxel_size_m=0.2, progress=SilentProgress())
    assert document["totals"]["component"]["parts"] == 8
    assert document["totals"]["all"]["mass_kg"] == pytest.approx(sum(p["mass_kg"] for p in document["components"]))


def test_stage_times_name_the_stages() -> None:
    document = voxelize(SAMPLES / "frame.ifc", voxel_size_m=0.2, progress=SilentProgress())
    assert {"read", "voxelize", "write"} <= document["seconds"].keys()
    assert all(seconds >= 0.0 for seconds in document["seconds"].values())


def test_nothing_is_written_where_something_is_wrong(tmp_path: Path) -> None:
    model = SAMPLES / "frame.ifc"
    with pytest.raises(InputError, match="is impossible"):
        voxelize(model, voxel_size_m=float("nan"), progress=SilentProgress())
    with pytest.raises(InputError, match="unknown unit"):
        voxelize(model, options=ReadOptions(unit="ell"), progress=SilentProgress())
    with pytest.raises(SelectionError):
        voxelize(model, options=ReadOptions(select="IfcDoor"), progress=SilentProgress())
    with pytest.raises(FileError, match="cannot have this name"):
        voxelize(model, Path("frame.stl"), progress=SilentProgress())
    assert list(tmp_path.iterdir()) == []


def test_the_input_is_left_alone(tmp_path: Path) -> None:
    copy = tmp_path / "house.ifc"
    copy.write_bytes((SAMPLES / "frame.ifc").read_bytes())
    with pytest.raises(FileError, match="overwrite its own input"):
        voxelize(copy, copy, progress=SilentProgress())
    assert copy.read_bytes() == (SAMPLES / "frame.ifc").read_bytes()
