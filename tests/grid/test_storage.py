from __future__ import annotations

import io
import json
import threading
import time
import warnings
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import zstandard
from box_grids import grid_of, part, random_shares
from grid_bytes import grid_from_bytes, grid_to_bytes
from hypothesis import given, settings
from hypothesis import strategies as st

from bimvox.errors import GridFileError
from bimvox.grid.bricks import Bricks
from bimvox.grid.frame import GridFrame, Label
from bimvox.grid.layout import Archive, write_archive
from bimvox.grid.storage import in_order, write_grid
from bimvox.grid.voxel_grid import VoxelGrid

TABLES = ("shared_cells", "shared_parts", "shared_fractions", "boxes", "box_parts")
SHAPE = (70, 9, 11)


def sample(seed: int = 0, shape: tuple[int, int, int] = SHAPE, parts: int = 4) -> VoxelGrid:
    shares = random_shares(seed, shape, parts)
    kinds = [Label.GROUND, Label.STRUCTURE, Label.COMPONENT]
    return grid_of(
        shares,
        [part(f"guid{n}", "IfcBeam", kinds[n % 3], storey="L1", material="Stahl äß") for n in range(parts)],
        frame=GridFrame((-1.5, 0.2, 3.0), 0.1),
        source={"name": "a.ifc", "sha256": "00", "unit_assumed": False},
        origin_m=(400_000.0, 5_000_000.0, 12.0),
        georeference={"crs": "EPSG:25832", "eastings_m": 4e5},
    )


def same(a: VoxelGrid, b: VoxelGrid) -> bool:
    return (
        all(np.array_equal(getattr(a, key), getattr(b, key)) for key in TABLES)
        and all(getattr(a, key).dtype == getattr(b, key).dtype for key in TABLES)
        and np.array_equal(a.owners.dense(), b.owners.dense())
        and np.array_equal(np.minimum(a.owners.index, 0), np.minimum(b.owners.index, 0))
        and (a.frame, a.parts, a.source, a.origin_m) == (b.frame, b.parts, b.source, b.origin_m)
        and a.georeference == b.georeference
    )


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 99), st.tuples(*[st.integers(1, 70)] * 3), st.integers(1, 5))
def test_a_grid_comes_back_as_it_was(seed: int, shape: tuple[int, int, int], parts: int) -> None:
    grid = sample(seed, shape, parts)
    data = grid_to_bytes(grid)
    assert grid_to_bytes(sample(seed, shape, parts)) == data
    assert same(grid_from_bytes(data, "f"), grid)


@pytest.mark.parametrize("shape", [(1, 1, 1), (5, 1, 300_000), (1200, 700, 1), (130, 129, 65)])
def test_thin_and_large_grids_come_back_in_few_chunks(shape: tuple[int, int, int]) -> None:
    grid = sample(3, shape, 2)
    data = grid_to_bytes(grid)
    assert same(grid_from_bytes(data, "f"), grid)
    archive = Archive(io.BytesIO(data), "f")
    assert sum(key.startswith("owners/c/") for key in archive) <= 18


def test_the_bytes_do_not_depend_on_the_number_of_threads() -> None:
    grid = sample(5, (130, 129, 65), 5)
    for threads in (2, 5):
        stream = io.BytesIO()
        write_grid(grid, stream, threads=threads)
        assert stream.getvalue() == grid_to_bytes(grid)


def test_an_empty_grid_comes_back_and_its_air_takes_no_chunks() -> None:
    empty = grid_of([], shape=(200, 200, 200))
    data = grid_to_bytes(empty)
    assert same(grid_from_bytes(data, "f"), empty)
    assert not [key for key in Archive(io.BytesIO(data), "f") if key.startswith(("owners/c/", "labels/c/"))]


def test_zarr_opens_it_with_named_axes_and_metres(tmp_path: Path) -> None:
    import zarr
    from zarr.storage import ZipStore

    grid = sample()
    path = tmp_path / "grid.zarr.zip"
    path.write_bytes(grid_to_bytes(grid))
    with ZipStore(path, mode="r") as store:
        group = zarr.open_group(store, mode="r")
        assert group["labels"].metadata.dimension_names == ("x", "y", "z")
        np.testing.assert_array_equal(group["labels"][:], grid.owners.mapped(grid.label_table))
        np.testing.assert_array_equal(group["owners"][:], grid.owners.dense())
        for key in TABLES:
            np.testing.assert_array_equal(group[key][:], getattr(grid, key))
        np.testing.assert_allclose(group["z"][:], 3.05 + 0.1 * np.arange(11))
        assert group["z"].attrs["units"] == "m"
        assert group.attrs["parts"][2]["global_id"] == "guid2"
        assert group["labels"].attrs["flag_values"][-1] == Label.COMPONENT


def test_xarray_opens_it_with_coordinates(tmp_path: Path) -> None:
    import xarray
    from zarr.storage import ZipStore

    grid = sample()
    path = tmp_path / "grid.zarr.zip"
    path.write_bytes(grid_to_bytes(grid))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with ZipStore(path, mode="r") as store, xarray.open_zarr(store) as dataset:
            assert dict(dataset.owners.sizes) == dict(zip("xyz", SHAPE, strict=True))
            assert dataset.owners.dtype == np.int32
            assert set(dataset.coords) == {"x", "y", "z"}
            assert dataset.x.attrs["units"] == "m"
            assert dataset.attrs["Conventions"].startswith("CF-")
            cell = np.argwhere(grid.owners.dense() >= 0)[0]
            x, y, z = grid.frame.centre_of(cell)
            assert dataset.owners.sel(x=x, y=y, z=z, method="nearest") == grid.owners.at(cell[None].astype(np.int32))[0]
            np.testing.assert_array_equal(dataset.labels.values, grid.owners.mapped(grid.label_table))


def changed(edit: Callable[[dict[str, bytes]], object], grid: VoxelGrid | None = None) -> bytes:
    members = dict(Archive(io.BytesIO(grid_to_bytes(grid or sample())), "f"))
    edit(members)
    stream = io.BytesIO()
    write_archive(stream, members.items())
    return stream.getvalue()


def put(key: str, values: np.ndarray) -> Callable[[dict[str, bytes]], object]:
    return lambda members: members.update({key: zstandard.ZstdCompressor().compress(values.tobytes())})


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
        (lambda members: members.pop("zarr.json"), "zarr.json: missing"),
        (lambda members: members.pop("owners/zarr.json"), "owners/zarr.json: missing"),
        (lambda members: members.pop("boxes/zarr.json"), "boxes/zarr.json: missing"),
        (lambda members: members.pop("x/c/0"), "x: 0 of 1 chunks"),
        (lambda members: members.pop("owners/c/0/0/0"), "labels do not match"),
        (lambda members: members.pop("labels/c/0/0/0"), "labels do not match"),
        (lambda members: members.update({"zarr.json": b"[" * 100_000}), "zarr.json"),
        (lambda members: members.update({"zarr.json": b"\xff\xfe"}), "zarr.json"),
        (lambda members: members.update({"zarr.json": b"7"}), "zarr.json: must be a JSON object"),
        (lambda members: members.update({"x/zarr.json": b" " * 70_000}), "x/zarr.json: 70,000 bytes are too many"),
        (lambda members: members.update({"labels/c/9/0/0": members["labels/c/0/0/0"]}), "labels/c/9/0/0"),
        (lambda members: members.update({"labels/c/0/0": members["labels/c/0/0/0"]}), "labels/c/0/0"),
        (lambda members: members.update({"labels/c/0/0/0": b"junk"}), "labels/c/0/0/0: not a Zstandard"),
        (lambda members: members.update({"labels/c/0/0/0": members["owners/c/0/0/0"]}), "labels/c/0/0/0: holds 27,720"),
        (lambda members: members.update({"labels/c/0/0/0": bytes(20_000)}), "labels/c/0/0/0: 20,000 bytes are too"),
        (put("owners/c/0/0/0", np.zeros(1 << 22, np.int32)), "owners/c/0/0/0: holds 16,777,216 bytes"),
        (put("owners/c/0/0/0", np.full(SHAPE, 4, np.int32)), "owners/c/0/0/0: an owner is out of range"),
        (put("owners/c/0/0/0", np.full(SHAPE, -2, np.int32)), "owners/c/0/0/0: an owner is out of range"),
        (put("labels/c/0/0/0", np.full(SHAPE, 200, np.uint8)), "labels do not match"),
        (put("x/c/0", np.arange(70.0)), "x: does not fit"),
        (put("x/c/0", np.full(70, np.nan)), "x: does not fit"),
        (edit_json("zarr.json", "attributes", "format", value="other"), "format"),
        (edit_json("zarr.json", "attributes", "version", value=99), "version: 99 .*\n.*update bimvox"),
        (edit_json("zarr.json", "attributes", "version", value=1), "version: 1 .*\n.*bimvox voxelize"),
        (edit_json("zarr.json", "attributes", "unit", value="mm"), "unit"),
        (edit_json("zarr.json", "attributes", "voxel_size_m", value=-1), "voxel_size_m"),
        (edit_json("zarr.json", "attributes", "voxel_size_m", value=10**400), "voxel_size_m"),
        (edit_json("zarr.json", "attributes", "voxel_size_m", value=float("inf")), "Infinity is not a number"),
        (edit_json("zarr.json", "attributes", "voxel_size_m", value=0.2), "x: does not fit"),
        (edit_json("zarr.json", "attributes", "origin_m", value=[0, 0]), "origin_m"),
        (edit_json("zarr.json", "attributes", "source", value=[1]), "source"),
        (edit_json("zarr.json", "attributes", "georeference", value={"crs": []}), "georeference"),
        (edit_json("zarr.json", "attributes", "parts", value={}), "parts"),
        (edit_json("zarr.json", "attributes", "parts", value=[]), "owners"),
        (edit_json("zarr.json", "attributes", "parts", "1", "label", value=77), r"parts\[1\]\.label"),
        (
            edit_json("zarr.json", "attributes", "parts", "1", "label", value=1),
            "labels do not match",
        ),
        (edit_json("zarr.json", "attributes", "parts", "1", "mass_kg", value="x"), r"parts\[1\]\.mass_kg"),
        (edit_json("zarr.json", "attributes", "parts", "1", "mass_kg", value=-1), r"parts\[1\].*below 0"),
        (edit_json("zarr.json", "attributes", "parts", "1", "cells", value=1), r"parts\[1\]\.cells"),
        (edit_json("zarr.json", "attributes", "parts", "1", "id", value=...), r"parts\[1\]\.id"),
        (edit_json("zarr.json", "attributes", "parts", "1", "id", value="guid0"), r"parts\[1\]\.id.*twice"),
        (edit_json("zarr.json", "attributes", "parts", "1", "more", value=1), r"parts\[1\]\.more"),
        (edit_json("labels/zarr.json", "data_type", value="float64"), "labels/zarr.json: data_type"),
        (edit_json("labels/zarr.json", "shape", value=[10**6, 10**6, 10**6]), "labels/zarr.json: chunk_grid"),
        (edit_json("labels/zarr.json", "shape", value=[2**40, 9, 11]), "labels/zarr.json: shape"),
        (edit_json("labels/zarr.json", "shape", value=[69, 9, 11]), "labels/zarr.json: chunk_grid"),
        (edit_json("labels/zarr.json", "shape", value=[70, -9, 11]), "shape"),
        (edit_json("labels/zarr.json", "shape", value=[0, 9, 11]), "labels/zarr.json: chunk_grid"),
        (edit_json("labels/zarr.json", "dimension_names", value=["z", "y", "x"]), "dimension_names"),
        (edit_json("labels/zarr.json", "codecs", value=[{"name": "bytes"}]), "codecs"),
        (edit_json("labels/zarr.json", "codecs", "0", "configuration", "endian", value="big"), "codecs"),
        (edit_json("labels/zarr.json", "codecs", "1", "name", value="gzip"), "codecs"),
        (edit_json("labels/zarr.json", "fill_value", value=6), "fill_value"),
        (edit_json("labels/zarr.json", "storage_transformers", value=[{"name": "x"}]), "storage_transformers"),
        (edit_json("labels/zarr.json", "unknown", value=1), "labels/zarr.json: unknown"),
        (edit_json("labels/zarr.json", "chunk_grid", "configuration", "chunk_shape", value=[2**20] * 3), "chunk_grid"),
        (edit_json("shared_parts/zarr.json", "shape", value=[10**9]), "shared_parts/zarr.json: chunk_grid"),
        (edit_json("boxes/zarr.json", "shape", value=[3, 5]), "boxes"),
    ],
)
def test_damaged_and_hostile_files_are_refused_by_name(edit: Callable[[dict[str, bytes]], None], named: str) -> None:
    with pytest.raises(GridFileError, match=named) as caught:
        grid_from_bytes(changed(edit), "bad.zarr.zip")
    assert str(caught.value).startswith("bad.zarr.zip: ")
    assert "bimvox voxelize" in (caught.value.hint or ""), "no way to a good file"


def declare(shape: list[int], chunk: list[int], *keys: str) -> Callable[[dict[str, bytes]], None]:
    """Declare another shape with matching chunks, so that only the size itself is wrong."""

    def edit(members: dict[str, bytes]) -> None:
        for key in keys:
            edit_json(f"{key}/zarr.json", "shape", value=shape)(members)
            edit_json(f"{key}/zarr.json", "chunk_grid", "configuration", "chunk_shape", value=chunk)(members)

    return edit


def test_huge_declared_sizes_are_refused_before_memory_is_spent() -> None:
    import tracemalloc

    cells = changed(declare([2**31 - 1] * 3, [64, 64, 64], "labels", "owners"))
    other = changed(declare([69, 9, 11], [69, 9, 11], "labels"))
    rows = changed(declare([2**31 - 1], [65_536], "shared_parts", "shared_fractions"))
    boxes = changed(
        lambda members: (
            declare([2**31 - 1, 6], [65_536, 6], "boxes")(members),
            declare([2**31 - 1], [65_536], "box_parts")(members),
        )
    )
    tracemalloc.start()
    for data, named in (
        (cells, "declares .* cells"),
        (other, "labels: x is 69, elsewhere 70"),
        (rows, "shared is|rows;"),
        (boxes, "boxes: 2,147,483,647 rows"),
    ):
        with pytest.raises(GridFileError, match=named):
            grid_from_bytes(data, "f")
    assert tracemalloc.get_traced_memory()[1] < 20e6
    tracemalloc.stop()


def test_a_table_without_its_chunks_is_refused_before_it_is_listed() -> None:
    def edit(members: dict[str, bytes]) -> None:
        declare([90_000_000, 6], [65_536, 6], "boxes")(members)
        declare([90_000_000], [65_536], "box_parts")(members)

    with pytest.raises(GridFileError, match="boxes: 1 of 1,374 chunks are present"):
        grid_from_bytes(changed(edit), "f")


def two_boxes() -> VoxelGrid:
    """Part 0 has x from 0 to 5, part 1 from 4 to 8: part 1 fills more of the one shared layer."""
    first, second = np.zeros((2, 8, 1, 1), np.float32)
    first[:5], first[4], second[4:] = 1.0, 0.25, 0.5
    return grid_of([first, second])


@pytest.mark.parametrize(
    ("table", "values", "named"),
    [
        ("shared_cells", [[4, 0, 9], [4, 0, 9]], "shared_cells: outside"),
        ("shared_cells", [[-1, 0, 0], [4, 0, 0]], "shared_cells: outside"),
        ("shared_cells", [[4, 0, 0], [3, 0, 0]], "shared_cells: must be sorted"),
        ("shared_cells", [[3, 0, 0], [4, 0, 0]], "shared_cells: a cell with one row"),
        ("shared_cells", [[7, 0, 0], [7, 0, 0]], "boxes: they do not hold"),
        ("shared_parts", [1, 0], "shared_cells: must be sorted"),
        ("shared_parts", [0, 2], "shared_parts: out of range"),
        ("shared_fractions", [0.5, np.nan], "shared_fractions: must be from 0 to 1"),
        ("shared_fractions", [0.5, 1.5], "shared_fractions: must be from 0 to 1"),
        ("shared_fractions", [0.6, 0.5], "shared_fractions: a part that does not own"),
        ("boxes", [[0, 0, 0, 5, 1, 1], [4, 0, 0, 9, 1, 1]], "boxes: outside the grid"),
        ("boxes", [[0, 0, 0, 5, 1, 1], [8, 0, 0, 4, 1, 1]], "boxes: outside the grid, or empty"),
        (
            "boxes",
            [[0, 0, 0, 4, 1, 1], [4, 0, 0, 8, 1, 1]],
            "boxes: those of part 0 hold 4 cells, but it meets 5",
        ),
        ("boxes", [[3, 0, 0, 8, 1, 1], [4, 0, 0, 8, 1, 1]], "boxes: they do not hold"),
        ("box_parts", [1, 0], "box_parts: must ascend"),
        ("box_parts", [0, 2], "box_parts: must ascend"),
    ],
)
def test_tables_that_contradict_the_cells_are_refused(table: str, values: list[object], named: str) -> None:
    grid = two_boxes()
    assert same(grid_from_bytes(grid_to_bytes(grid), "f"), grid)
    wrong = replace(grid, **{table: np.array(values, getattr(grid, table).dtype)})
    with pytest.raises(GridFileError, match=named):
        grid_from_bytes(grid_to_bytes(wrong), "f")


def test_the_owner_of_a_shared_cell_must_be_one_of_its_parts() -> None:
    shares = np.ones((3, 1, 1, 1), np.float32)
    grid = grid_of(list(shares))
    wrong = replace(grid, owners=Bricks.of(np.full((1, 1, 1), -1, np.int32)))
    with pytest.raises(GridFileError, match="the owner of a shared cell is not one of its parts"):
        grid_from_bytes(grid_to_bytes(wrong), "f")


def test_a_limit_on_the_cells_is_kept() -> None:
    with pytest.raises(GridFileError, match="declares 6,930 cells") as caught:
        grid_from_bytes(grid_to_bytes(sample()), "f", cell_limit=6_929)
    assert "larger" in caught.value.hint


def test_a_file_cut_anywhere_is_refused() -> None:
    data = grid_to_bytes(sample())
    for length in [*range(0, len(data), 97), *range(len(data) - 30, len(data))]:
        with pytest.raises(GridFileError):
            grid_from_bytes(data[:length], "f")


def test_no_damage_gives_anything_but_a_grid_or_a_grid_error() -> None:
    data = grid_to_bytes(sample())
    rng = np.random.default_rng(3)
    refused = 0
    for _ in range(200):
        broken = bytearray(data)
        for at in rng.integers(len(broken), size=4):
            broken[at] ^= int(rng.integers(1, 256))
        try:
            grid_from_bytes(bytes(broken), "f")
        except GridFileError:
            refused += 1
    assert refused >= 190


@pytest.mark.parametrize("threads", [1, 2, 7])
def test_results_come_in_order_whoever_is_first(threads: int) -> None:
    def slow_for_even(n: int) -> int:
        time.sleep(0.002 * (n % 2 == 0))
        return n * n

    assert list(in_order(slow_for_even, range(40), threads)) == [n * n for n in range(40)]


@pytest.mark.parametrize("threads", [1, 3])
def test_only_a_few_are_done_ahead(threads: int) -> None:
    started: list[int] = []
    lock = threading.Lock()

    def note(n: int) -> int:
        with lock:
            started.append(n)
        return n

    results = in_order(note, range(1_000), threads)
    assert next(results) == 0
    assert len(started) <= 2 * threads
    results.close()


def test_an_error_is_passed_on() -> None:
    def fail(n: int) -> int:
        raise ValueError(f"no {n}")

    with pytest.raises(ValueError, match="no 0"):
        list(in_order(fail, range(9), 3))
