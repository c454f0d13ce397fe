"""What a grid file holds: the arrays of the Zarr group, and the checks of their metadata before memory is spent."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from bimvox.errors import GridFileError
from bimvox.grid.archive import zstd_content_size

FORMAT = "bimvox-grid"
VERSION = 1
SUFFIX = ".zarr.zip"

CELL_CHUNK = 64
"""Edge of a chunk of the grid, cells."""
ROW_CHUNK = 1 << 16
"""Rows in a chunk of a table."""

_CHUNK_BYTES_LIMIT = 1 << 26
_CHUNKS_LIMIT = 100_000
_ROWS_PER_CELL_LIMIT = 4


@dataclass(frozen=True, slots=True)
class ArrayRule:
    """How one array of the group must look.

    Attributes:
        dtype: Its Zarr data type.
        dimensions: Its named dimensions.
        fill: Value of chunks that are left out, or None where every chunk must be there.
    """

    dtype: str
    dimensions: tuple[str, ...]
    fill: int | None = None


ARRAYS: dict[str, ArrayRule] = {
    "labels": ArrayRule("uint8", ("x", "y", "z"), 0),
    "owners": ArrayRule("int32", ("x", "y", "z"), -1),
    "x": ArrayRule("float64", ("x",)),
    "y": ArrayRule("float64", ("y",)),
    "z": ArrayRule("float64", ("z",)),
    "shared_cells": ArrayRule("int32", ("shared", "axis")),
    "shared_parts": ArrayRule("int32", ("shared",)),
    "shared_fractions": ArrayRule("float32", ("shared",)),
}
_ITEM_BYTES = {"uint8": 1, "int32": 4, "float32": 4, "float64": 8}


def read_json(members: Mapping[str, bytes], key: str, name: str) -> dict[str, Any]:
    """Return one metadata document of the store.

    Raises:
        GridFileError: If it is missing or no JSON object.
    """
    if key not in members:
        raise GridFileError(name, f"{key}: missing", hint="this is no bimvox grid, or it was cut short")
    try:
        document = json.loads(members[key])
    except (ValueError, RecursionError) as error:
        raise GridFileError(name, f"{key}: not JSON ({error})") from error
    if not isinstance(document, dict):
        raise GridFileError(name, f"{key}: must be a JSON object")
    return document


def check_arrays(members: Mapping[str, bytes], name: str, cell_limit: int) -> None:
    """Check every array's declared type, shape, chunks and compressed sizes, before anything is allocated.

    Raises:
        GridFileError: Naming the key that is wrong.
    """
    shapes = {key: _check_array(members, key, rule, name) for key, rule in ARRAYS.items()}
    cells = math.prod(shapes["labels"])
    if not 0 < cells <= cell_limit:
        raise GridFileError(name, f"labels: {cells:,} cells are declared; 1 to {cell_limit:,} are allowed")
    lengths: dict[str, int] = {"axis": 3}
    for key, rule in ARRAYS.items():
        for dimension, length in zip(rule.dimensions, shapes[key], strict=True):
            if lengths.setdefault(dimension, length) != length:
                raise GridFileError(name, f"{key}: {dimension} is {length}, elsewhere {lengths[dimension]}")
    if lengths["shared"] > _ROWS_PER_CELL_LIMIT * cells:
        raise GridFileError(name, f"shared_cells: {lengths['shared']:,} rows are too many for {cells:,} cells")


def _check_array(members: Mapping[str, bytes], key: str, rule: ArrayRule, name: str) -> tuple[int, ...]:
    place = f"{key}/zarr.json"
    meta = read_json(members, place, name)
    expected: dict[str, object] = {
        "zarr_format": 3,
        "node_type": "array",
        "data_type": rule.dtype,
        "dimension_names": list(rule.dimensions),
        "chunk_key_encoding": {"name": "default", "configuration": {"separator": "/"}},
    }
    if rule.fill is not None:
        expected["fill_value"] = rule.fill
    for field, value in expected.items():
        if meta.get(field) != value:
            raise GridFileError(name, f"{place}: {field} is {_short(meta.get(field))}, must be {_short(value)}")
    if meta.get("storage_transformers"):
        raise GridFileError(name, f"{place}: storage_transformers are not allowed")
    _check_codecs(meta.get("codecs"), place, name)
    shape = _sizes(meta.get("shape"), len(rule.dimensions), f"{place}: shape", name, least=0)
    grid = meta.get("chunk_grid")
    if not isinstance(grid, dict) or grid.get("name") != "regular" or not isinstance(grid.get("configuration"), dict):
        raise GridFileError(name, f"{place}: chunk_grid must be regular")
    chunk = _sizes(grid["configuration"].get("chunk_shape"), len(shape), f"{place}: chunk_shape", name, least=1)
    chunk_bytes = math.prod(chunk) * _ITEM_BYTES[rule.dtype]
    counts = [-(-size // step) for size, step in zip(shape, chunk, strict=True)]
    if chunk_bytes > _CHUNK_BYTES_LIMIT or math.prod(counts) > _CHUNKS_LIMIT:
        raise GridFileError(name, f"{place}: chunk_shape {list(chunk)} is not usable for shape {list(shape)}")
    _check_chunks(members, key, counts, chunk_bytes, rule, name)
    return shape


def _check_chunks(
    members: Mapping[str, bytes], key: str, counts: list[int], chunk_bytes: int, rule: ArrayRule, name: str
) -> None:
    prefix = f"{key}/c/"
    present = 0
    for member in members:
        if not member.startswith(prefix):
            continue
        at = member[len(prefix) :].split("/")
        inside = len(at) == len(counts) and all(
            n.isascii() and n.isdigit() and str(int(n[:9])) == n and int(n) < count
            for n, count in zip(at, counts, strict=True)
        )
        if not inside:
            raise GridFileError(name, f"{member}: no such chunk")
        present += 1
        try:
            size = zstd_content_size(members[member])
        except ValueError as error:
            raise GridFileError(name, f"{member}: {error}") from error
        if size != chunk_bytes:
            raise GridFileError(name, f"{member}: holds {size:,} bytes, its chunk has {chunk_bytes:,}")
    if rule.fill is None and present != math.prod(counts):
        raise GridFileError(name, f"{key}: {present} of {math.prod(counts)} chunks are there")


def _check_codecs(codecs: object, place: str, name: str) -> None:
    names = (
        [codec.get("name") if isinstance(codec, dict) else None for codec in codecs] if isinstance(codecs, list) else []
    )
    if names != ["bytes", "zstd"] or not isinstance(codecs, list):
        raise GridFileError(name, f"{place}: codecs are {_short(names)}, must be ['bytes', 'zstd']")
    if (codecs[0].get("configuration") or {}).get("endian", "little") != "little":
        raise GridFileError(name, f"{place}: codecs: bytes must be little-endian")


def _sizes(value: object, length: int, place: str, name: str, *, least: int) -> tuple[int, ...]:
    if (
        not isinstance(value, list)
        or len(value) != length
        or not all(type(n) is int and least <= n < 1 << 31 for n in value)
    ):
        raise GridFileError(name, f"{place} is {_short(value)}, must be {length} whole numbers from {least} to 2^31")
    return tuple(value)


def _short(value: object) -> str:
    text = repr(value)
    return text if len(text) <= 60 else text[:57] + "..."
