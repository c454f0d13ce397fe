from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bimvox.errors import GridFileError
from bimvox.grid.archive import pack, unpack
from bimvox.grid.frame import GridFrame
from bimvox.grid.labels import Label
from bimvox.grid.storage import grid_from_bytes, grid_to_bytes
from bimvox.grid.voxel_grid import Part, VoxelGrid

ARRAYS = ("labels", "owners", "shared_cells", "shared_parts", "shared_fractions")


def part(n: int, label: Label = Label.COMPONENT) -> Part:
    return Part(
        f"id{n}", f"guid{n}", "IfcBeam", f"beam {n} äß", "component", label, 3, 0.25, 600.0, "winding", None, "L1"
    )


def sample(seed: int = 0, shape: tuple[int, int, int] = (70, 9, 11), parts: int = 4) -> VoxelGrid:
    rng = np.random.default_rng(seed)
    owners = rng.integers(-1, parts, shape, dtype=np.int32)
    owners[: shape[0] // 2] = -1
    labels = np.where(owners >= 0, Label.COMPONENT, Label.AIR).astype(np.uint8)
    cells = (
        np.argwhere(owners >= 0)[:20].repeat(2, axis=0).astype(np.int32) if parts > 1 else np.empty((0, 3), np.int32)
    )
    return VoxelGrid(
        frame=GridFrame((-1.5, 0.2, 3.0), 0.1),
        labels=labels,
        owners=owners,
        parts=tuple(part(n) for n in range(parts)),
        shared_cells=cells,
        shared_parts=np.tile(np.array([0, 1], np.int32), len(cells) // 2),
        shared_fractions=rng.random(len(cells), dtype=np.float32),
        source={"name": "a.ifc", "sha256": "00", "unit_assumed": False},
        origin_m=(400_000.0, 5_000_000.0, 12.0),
    )


def same(a: VoxelGrid, b: VoxelGrid) -> bool:
    return (
        all(np.array_equal(getattr(a, key), getattr(b, key)) for key in ARRAYS)
        and all(getattr(a, key).dtype == getattr(b, key).dtype for key in ARRAYS)
        and (a.frame, a.parts, a.source, a.origin_m) == (b.frame, b.parts, b.source, b.origin_m)
    )


@settings(max_examples=15, deadline=None)
@given(st.integers(0, 99), st.tuples(*[st.integers(1, 70)] * 3), st.integers(1, 5))
def test_a_grid_comes_back_as_it_was(seed: int, shape: tuple[int, int, int], parts: int) -> None:
    grid = sample(seed, shape, parts)
    data = grid_to_bytes(grid)
    assert grid_to_bytes(sample(seed, shape, parts)) == data
    assert same(grid_from_bytes(data, "f"), grid)


def test_an_empty_grid_comes_back() -> None:
    grid = sample(parts=1)
    empty = replace(grid, labels=np.zeros_like(grid.labels), owners=np.full_like(grid.owners, -1), parts=())
    assert same(grid_from_bytes(grid_to_bytes(empty), "f"), empty)


def test_zarr_opens_it_with_named_axes_and_metres(tmp_path: Path) -> None:
    import zarr
    from zarr.storage import ZipStore

    grid = sample()
    path = tmp_path / "grid.zarr.zip"
    path.write_bytes(grid_to_bytes(grid))
    with ZipStore(path, mode="r") as store:
        group = zarr.open_group(store, mode="r")
        assert group["labels"].metadata.dimension_names == ("x", "y", "z")
        np.testing.assert_array_equal(group["labels"][:], grid.labels)
        np.testing.assert_allclose(group["z"][:], 3.05 + 0.1 * np.arange(11))
        assert group["z"].attrs["units"] == "m"
        assert group.attrs["parts"][2]["global_id"] == "guid2"
        assert group["labels"].attrs["flag_values"][-1] == Label.COMPONENT


def changed(edit: Callable[[dict[str, bytes]], None]) -> bytes:
    members = unpack(grid_to_bytes(sample()), "f")
    edit(members)
    return pack(members)


def edit_json(key: str, *path: str, value: object) -> Callable[[dict[str, bytes]], None]:
    def edit(members: dict[str, bytes]) -> None:
        document = json.loads(members[key])
        place = document
        for step in path[:-1]:
            place = place[int(step) if isinstance(place, list) else step]
        if value is ...:
            del place[path[-1]]
        else:
            place[int(path[-1]) if isinstance(place, list) else path[-1]] = value
        members[key] = json.dumps(document).encode()

    return edit


@pytest.mark.parametrize(
    ("edit", "named"),
    [
        (lambda members: members.pop("zarr.json"), "zarr.json"),
        (lambda members: members.pop("owners/zarr.json"), "owners/zarr.json"),
        (lambda members: members.pop("x/c/0"), "x: 0 of 1 chunks"),
        (lambda members: members.update({"zarr.json": b"[" * 100_000}), "zarr.json"),
        (lambda members: members.update({"zarr.json": b"\xff\xfe"}), "zarr.json"),
        (lambda members: members.update({"labels/c/9/0/0": members["labels/c/0/0/0"]}), "labels/c/9/0/0"),
        (lambda members: members.update({"labels/c/1/0/0": b"junk"}), "labels/c/1/0/0"),
        (lambda members: members.update({"labels/c/1/0/0": members["owners/c/1/0/0"]}), "labels/c/1/0/0"),
        (edit_json("zarr.json", "attributes", "format", value="other"), "format"),
        (edit_json("zarr.json", "attributes", "version", value=99), "version"),
        (edit_json("zarr.json", "attributes", "unit", value="mm"), "unit"),
        (edit_json("zarr.json", "attributes", "voxel_size_m", value=-1), "voxel_size_m"),
        (edit_json("zarr.json", "attributes", "voxel_size_m", value=0.2), "x: does not fit"),
        (edit_json("zarr.json", "attributes", "origin_m", value=[0, 0]), "origin_m"),
        (edit_json("zarr.json", "attributes", "source", value=[1]), "source"),
        (edit_json("zarr.json", "attributes", "parts", value={}), "parts"),
        (edit_json("zarr.json", "attributes", "parts", value=[]), "owners"),
        (edit_json("zarr.json", "attributes", "parts", "1", "label", value=77), r"parts\[1\]\.label"),
        (edit_json("zarr.json", "attributes", "parts", "1", "mass_kg", value="x"), r"parts\[1\]\.mass_kg"),
        (edit_json("zarr.json", "attributes", "parts", "1", "id", value=...), r"parts\[1\]\.id"),
        (edit_json("zarr.json", "attributes", "parts", "1", "more", value=1), r"parts\[1\]\.more"),
        (edit_json("labels/zarr.json", "data_type", value="float64"), "labels/zarr.json: data_type"),
        (edit_json("labels/zarr.json", "shape", value=[10**6, 10**6, 10**6]), "chunk_shape"),
        (edit_json("labels/zarr.json", "shape", value=[64_000, 9, 1100]), "633,600,000 cells are declared"),
        (edit_json("labels/zarr.json", "shape", value=[70, 9, 12]), "z is 11, elsewhere 12"),
        (edit_json("labels/zarr.json", "shape", value=[70, 9]), "shape"),
        (edit_json("labels/zarr.json", "shape", value=[70, -9, 11]), "shape"),
        (edit_json("labels/zarr.json", "shape", value=[0, 9, 11]), "no such chunk"),
        (edit_json("labels/zarr.json", "dimension_names", value=["z", "y", "x"]), "dimension_names"),
        (edit_json("labels/zarr.json", "codecs", value=[{"name": "bytes"}]), "codecs"),
        (edit_json("labels/zarr.json", "fill_value", value=6), "fill_value"),
        (
            edit_json("labels/zarr.json", "chunk_grid", "configuration", "chunk_shape", value=[2**20, 2**10, 2**10]),
            "chunk_shape",
        ),
        (edit_json("shared_parts/zarr.json", "shape", value=[10**9]), "shared_parts"),
    ],
)
def test_damaged_and_hostile_files_are_refused_by_name(edit: Callable[[dict[str, bytes]], None], named: str) -> None:
    with pytest.raises(GridFileError, match=named) as caught:
        grid_from_bytes(changed(edit), "bad.zarr.zip")
    assert str(caught.value).startswith("bad.zarr.zip: ")


@pytest.mark.parametrize(
    ("field", "value", "named"),
    [
        ("labels", np.full((70, 9, 11), 200, np.uint8), "labels"),
        ("owners", np.full((70, 9, 11), 4, np.int32), "owners"),
        ("owners", np.full((70, 9, 11), -2, np.int32), "owners"),
        ("shared_cells", np.full((40, 3), 90, np.int32), "shared_cells"),
        ("shared_cells", np.zeros((40, 3), np.int32), "sorted"),
        ("shared_parts", np.full(40, 4, np.int32), "shared_parts"),
        ("shared_fractions", np.full(40, np.nan, np.float32), "shared_fractions"),
        ("shared_fractions", np.full(40, 1.5, np.float32), "shared_fractions"),
    ],
)
def test_values_out_of_range_are_refused(field: str, value: np.ndarray, named: str) -> None:
    with pytest.raises(GridFileError, match=named):
        grid_from_bytes(grid_to_bytes(replace(sample(), **{field: value})), "f")


def test_a_limit_on_the_cells_is_kept() -> None:
    with pytest.raises(GridFileError, match="6,930 cells are declared"):
        grid_from_bytes(grid_to_bytes(sample()), "f", cell_limit=6_929)


def test_no_damage_gives_anything_but_a_grid_or_a_grid_error() -> None:
    data = grid_to_bytes(sample())
    rng = np.random.default_rng(3)
    refused = 0
    for n in range(150):
        broken = bytearray(data[: rng.integers(len(data))] if n % 3 == 0 else data)
        for at in rng.integers(max(len(broken), 1), size=4 if n % 3 else 0):
            broken[at] ^= int(rng.integers(1, 256))
        try:
            grid_from_bytes(bytes(broken), "f")
        except GridFileError:
            refused += 1
    assert refused >= 140
