import json
from pathlib import Path

import numpy as np
import pytest
from bimvox_pipeline.inspect.inspect import inspect
from bimvox_pipeline.site import init
from bimvox_pipeline.voxelize import voxelize

from bimvox.errors import FileError
from bimvox.progress import SilentProgress

SAMPLES = Path(__file__).parents[3] / "sample_models"


def test_an_ifc_file() -> None:
    document = inspect(SAMPLES / "frame.ifc", SilentProgress())
    assert (document["kind"], document["format"], document["unit"]) == ("ifc", "IFC4", "m")
    assert {(row["ifc_class"], row["role"], row["elements"]) for row in document["classes"]} == {
        ("IfcColumn", "component", 4),
        ("IfcBeam", "component", 4),
    }
    assert sum(row["elements"] for row in document["storeys"]) == 8
    assert document["size_m"] == [6.4, 6.4, 3.5]
    assert document["ifc_to_map"] is None
    assert np.array(document["site_to_ifc"]).shape == (4, 4)
    assert json.loads(json.dumps(document, allow_nan=False)) == document


def test_a_georeferenced_file_is_described_in_its_own_coordinates() -> None:
    document = inspect(SAMPLES / "frame_georeferenced.ifc", SilentProgress())
    low, _ = np.array(document["bounds_m"])
    assert (low > [1e5, 4e5, -1]).all()
    site_to_ifc, ifc_to_map = np.array(document["site_to_ifc"]), np.array(document["ifc_to_map"])
    # The building is on z = 0 of the site, near its origin.
    foot = np.linalg.inv(site_to_ifc) @ [*low, 1.0]
    assert np.abs(foot[:3]).max() < 10.0
    assert ifc_to_map @ [0.0, 0.0, 0.0, 1.0] == pytest.approx([0.0, 0.0, document["georeference"]["height_m"], 1.0])


def test_units_are_distinguished() -> None:
    assert inspect(SAMPLES / "frame_ifc2x3_mm.ifc", SilentProgress())["unit"] == "mm"


def test_a_mesh() -> None:
    document = inspect(SAMPLES / "yard.glb", SilentProgress())
    assert document["kind"] == "mesh"
    assert document["elements"] == sum(row["elements"] for row in document["classes"])


def test_a_grid(tmp_path: Path) -> None:
    out = tmp_path / "named.anything"
    made = voxelize(SAMPLES / "frame.ifc", out, voxel_size_m=0.2, progress=SilentProgress())
    document = inspect(out, SilentProgress())
    assert document["kind"] == "grid"
    for key in ("shape", "counts", "voxel_size_m", "origin_m"):
        assert document[key] == made[key]
    assert document["parts"] == [*made["components"], *made["others"]]


def test_one_part_of_a_grid(tmp_path: Path) -> None:
    out = tmp_path / "frame.zarr.zip"
    made = voxelize(SAMPLES / "frame.ifc", out, voxel_size_m=0.2, progress=SilentProgress())
    wanted = made["components"][3]
    document = inspect(out, SilentProgress(), part=wanted["id"])
    assert document["kind"] == "grid"
    assert document["part"].items() >= wanted.items()
    assert len(document["part"]["box_cells"]) == wanted["boxes"]
    with pytest.raises(FileError, match="only a grid has parts"):
        inspect(SAMPLES / "frame.ifc", SilentProgress(), part="x")


def test_obstructions(tmp_path: Path) -> None:
    (tmp_path / "a.json").write_text(
        json.dumps(
            {
                "version": 1,
                "unit": "mm",
                "obstructions": [
                    {"id": "truck", "box": {"min": [0, 0, 0], "max": [1000, 2000, 3000]}},
                    {"id": "silo", "cylinder": {"base": [5000, 5000, 0], "radius": 1000, "height": 6000}},
                    {"id": "stack", "voxels": [[3, 4, 1], [3, 5, 1]]},
                ],
            }
        )
    )
    document = inspect(tmp_path / "a.json", SilentProgress())
    assert document["kind"] == "obstructions"
    assert {one["id"]: one for one in document["obstructions"]} == {
        "truck": {"id": "truck", "form": "box", "low_m": [0, 0, 0], "high_m": [1, 2, 3]},
        "silo": {"id": "silo", "form": "cylinder", "low_m": [4, 4, 0], "high_m": [6, 6, 6]},
        "stack": {"id": "stack", "form": "voxels", "cells": 2, "low_vox": [3, 4, 1], "high_vox": [3, 5, 1]},
    }

    assert (document["low_m"], document["high_m"]) == ([0, 0, 0], [6, 6, 6])
    assert document["coordinates"].startswith("not stated")


@pytest.mark.parametrize(
    ("name", "data", "read_as"),
    [
        ("a.xyz", b"1,5;2,0;3,0\n-4,0;5,5;0,25\n", "table, columns separated by semicolons, decimal commas"),
        ("a.txt", b"x y z\n1,5 2,0 3,0\n-4,0 5,5 0,25\n", "table, columns separated by spaces or tabs, decimal commas"),
        ("a.csv", b"x,y,z\n1.5,2,3\n-4,5.5,0.25\n", "table, columns separated by commas, decimal points"),
        (
            "a.ply",
            b"ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\nproperty float z\n"
            b"end_header\n1.5 2 3\n-4 5.5 0.25\n",
            "PLY",
        ),
    ],
)
def test_a_scan_shows_its_extent_and_how_it_was_read(tmp_path: Path, name: str, data: bytes, read_as: str) -> None:
    (tmp_path / name).write_bytes(data)
    document = inspect(tmp_path / name, SilentProgress())
    assert (document["kind"], document["read_as"]) == ("obstructions", read_as)
    assert (document["low_m"], document["high_m"]) == ([-4, 2, 0.25], [1.5, 5.5, 3])
    assert document["obstructions"][0]["points"] == 2


def test_a_grid_of_heights_shows_its_cells(tmp_path: Path) -> None:
    text = "ncols 2\nnrows 1\nxllcorner 10\nyllcorner 5\ncellsize 2\nNODATA_value -1\n3 -1\n"
    (tmp_path / "a.asc").write_text(text)
    document = inspect(tmp_path / "a.asc", SilentProgress())
    assert document["read_as"] == "ESRI grid of 2 x 1 cells, 2 each, 1 empty"
    assert (document["low_m"], document["high_m"]) == ([10, 5, 2], [12, 7, 3])


@pytest.mark.parametrize("coordinates", ["site", "model", "map"])
def test_stated_coordinates_are_shown(tmp_path: Path, coordinates: str) -> None:
    content = {"version": 1, "coordinates": coordinates, "obstructions": []}
    (tmp_path / "a.json").write_text(json.dumps(content))
    assert inspect(tmp_path / "a.json", SilentProgress())["coordinates"] == coordinates


def test_a_site_file(tmp_path: Path) -> None:
    (tmp_path / "frame.ifc").write_bytes((SAMPLES / "frame.ifc").read_bytes())
    (tmp_path / "any.name").write_text('[model]\npath = "frame.ifc"\nvoxel_size_m = 0.2\n')
    document = inspect(tmp_path / "any.name", SilentProgress())
    assert (document["kind"], document["components"], document["voxel_size_m"]) == ("site", 8, 0.2)
    assert document["crane"]["jib_length_m"] > 0
    assert document["areas"]["yard"]


def test_an_ifc_file_with_another_suffix(tmp_path: Path) -> None:
    (tmp_path / "frame.obj").write_bytes((SAMPLES / "frame.ifc").read_bytes())
    with pytest.raises(FileError, match="name says otherwise"):
        inspect(tmp_path / "frame.obj", SilentProgress())


def test_the_types_of_a_model_are_the_same_rows_in_inspect_and_init(tmp_path: Path) -> None:
    rows = inspect(SAMPLES / "frame.ifc", SilentProgress())["kinds"]
    assert sum(row["count"] for row in rows) == inspect(SAMPLES / "frame.ifc", SilentProgress())["elements"]
    assert init(SAMPLES / "frame.ifc", tmp_path / "a.site.toml", progress=SilentProgress())["kinds"] == rows
    assert inspect(tmp_path / "a.site.toml", SilentProgress())["kinds"] == rows
