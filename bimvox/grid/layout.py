"""The layout of a grid file: the arrays of the Zarr group, for writing and for checking.

Zarr v3 with regular chunks, each little-endian and compressed with Zstandard (https://zarr-specs.readthedocs.io).
"""

from __future__ import annotations

import itertools
import json
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import zstandard
from numpy.typing import NDArray

from bimvox.errors import GridFileError, shown
from bimvox.grid.archive import Archive, zstd_content_size
from bimvox.grid.bricks import NO_OWNER
from bimvox.grid.labels import Label

FORMAT = "bimvox-grid"
VERSION = 2
SUFFIX = ".zarr.zip"

AXES = ("x", "y", "z")
TABLE_ROWS_LIMIT = 100_000_000
"""Largest number of rows in the tables of shared cells and boxes."""

_CELL_CHUNK = 64
_ROW_CHUNK = 1 << 16
_LEVEL = 1
_GROUP_BYTES_LIMIT = 1 << 26
_ARRAY_BYTES_LIMIT = 1 << 16
_NUMPY = {"uint8": "u1", "int32": "<i4", "float32": "<f4", "float64": "<f8"}


@dataclass(frozen=True, slots=True)
class ArrayRule:
    """The format of one array of the group.

    Attributes:
        dtype: Its Zarr data type.
        dimensions: Its named dimensions.
        attributes: Names and units, by the CF conventions if they define one.
        fill: Value of chunks that are left out; None if every chunk must be present.
    """

    dtype: str
    dimensions: tuple[str, ...]
    attributes: Mapping[str, Any] = field(default_factory=dict)
    fill: int | None = None


def _named(long_name: str, **more: Any) -> dict[str, Any]:
    return {"long_name": long_name, **more}


_LABELS = _named(
    "what the cell is",
    flag_meanings=" ".join(label.name.lower() for label in Label),
    flag_values=[int(label) for label in Label],
)
_AT_CENTRE = "of the cell's centre"
ARRAYS: dict[str, ArrayRule] = {
    "x": ArrayRule("float64", ("x",), _named(f"x {_AT_CENTRE}", axis="X", units="m")),
    "y": ArrayRule("float64", ("y",), _named(f"y {_AT_CENTRE}", axis="Y", units="m")),
    "z": ArrayRule("float64", ("z",), _named(f"height {_AT_CENTRE}", axis="Z", units="m", positive="up")),
    "labels": ArrayRule("uint8", AXES, _LABELS, int(Label.AIR)),
    "owners": ArrayRule("int32", AXES, _named(f"index into the group's parts, {NO_OWNER} for none"), NO_OWNER),
    "shared_cells": ArrayRule(
        "int32", ("shared", "axis"), _named("index of a cell that several parts meet, one row per part")
    ),
    "shared_parts": ArrayRule("int32", ("shared",), _named("index into the group's parts")),
    "shared_fractions": ArrayRule("float32", ("shared",), _named("share of the cell that the part fills", units="1")),
    "boxes": ArrayRule("int32", ("box", "corner"), _named("half-open box x0 y0 z0 x1 y1 z1 of cells of a part")),
    "box_parts": ArrayRule("int32", ("box",), _named("index into the group's parts")),
}
_FIXED = {"axis": 3, "corner": 6}


def chunk_shape(rule: ArrayRule, shape: tuple[int, ...]) -> tuple[int, ...]:
    """Return the shape of an array's chunks: 64 cells along each axis; in a thin grid, more along the other axes."""
    if rule.dimensions != AXES:
        return (min(_ROW_CHUNK, max(shape[0], 1)), *shape[1:])
    edges = [_CELL_CHUNK] * 3
    while True:
        chunk = tuple(min(edge, size) for edge, size in zip(edges, shape, strict=True))
        cut = [n for n in range(3) if chunk[n] < shape[n]]
        if math.prod(chunk) >= _CELL_CHUNK**3 or not cut:
            return chunk
        edges[min(cut, key=lambda n: edges[n])] *= 2


def array_document(key: str, shape: tuple[int, ...]) -> dict[str, Any]:
    """Return the metadata of an array (``KEY/zarr.json``)."""
    rule = ARRAYS[key]
    return {
        "zarr_format": 3,
        "node_type": "array",
        "shape": list(shape),
        "data_type": rule.dtype,
        "chunk_grid": {"name": "regular", "configuration": {"chunk_shape": list(chunk_shape(rule, shape))}},
        "chunk_key_encoding": {"name": "default", "configuration": {"separator": "/"}},
        "fill_value": rule.fill or 0,
        "codecs": [
            {"name": "bytes", "configuration": {"endian": "little"}},
            {"name": "zstd", "configuration": {"level": _LEVEL, "checksum": False}},
        ],
        "attributes": dict(rule.attributes),
        "dimension_names": list(rule.dimensions),
        "storage_transformers": [],
    }


def chunk_keys(key: str, shape: tuple[int, ...]) -> Iterator[tuple[str, tuple[int, ...]]]:
    """Yield, for every chunk of an array, its name and the index of its first value."""
    chunk = chunk_shape(ARRAYS[key], shape)
    counts = [range(-(-size // step)) for size, step in zip(shape, chunk, strict=True)]
    for at in itertools.product(*counts):
        yield f"{key}/c/" + "/".join(map(str, at)), tuple(n * step for n, step in zip(at, chunk, strict=True))


def encode_chunk(key: str, shape: tuple[int, ...], values: NDArray[Any]) -> bytes:
    """Return a chunk in stored form: compressed, and padded to full size if the array ends inside it."""
    rule = ARRAYS[key]
    chunk = chunk_shape(rule, shape)
    if values.shape != chunk:
        full = np.full(chunk, rule.fill or 0, values.dtype)
        full[tuple(slice(0, n) for n in values.shape)] = values
        values = full
    plain = np.ascontiguousarray(values, _NUMPY[rule.dtype])
    return zstandard.ZstdCompressor(level=_LEVEL).compress(plain.data.cast("B"))


def decode_chunk(archive: Archive, member: str, shape: tuple[int, ...], name: str) -> NDArray[Any]:
    """Return a stored chunk in its full size.

    Raises:
        GridFileError: If it is damaged, or its declared size, checked before decompression, is not the chunk's.
    """
    rule = ARRAYS[member.split("/", 1)[0]]
    chunk = chunk_shape(rule, shape)
    dtype = np.dtype(_NUMPY[rule.dtype])
    expected = math.prod(chunk) * dtype.itemsize
    if archive.size_of(member) > zstandard_bound(expected):
        raise GridFileError(name, f"{member}: {archive.size_of(member):,} bytes are too many for its chunk")
    data = archive[member]
    try:
        size = zstd_content_size(data)
        if size != expected:
            raise GridFileError(name, f"{member}: holds {size:,} bytes, its chunk has {expected:,}")
        values = zstandard.ZstdDecompressor().decompress(data, max_output_size=expected)
    except (ValueError, zstandard.ZstdError) as error:
        raise GridFileError(name, f"{member}: {error}") from error
    return np.frombuffer(values, dtype).reshape(chunk).astype(dtype.newbyteorder("="), copy=False)


def zstandard_bound(size: int) -> int:
    """Return the largest compressed size of this many bytes (``ZSTD_COMPRESSBOUND``, with room for a checksum)."""
    return size + (size >> 8) + 1024


def read_json(archive: Archive, key: str, name: str) -> dict[str, Any]:
    """Return one metadata document of the store.

    Raises:
        GridFileError: If it is missing, far too long, or not a JSON object.
    """
    if key not in archive:
        raise GridFileError(name, f"{key}: missing")
    if archive.size_of(key) > (_ARRAY_BYTES_LIMIT if "/" in key else _GROUP_BYTES_LIMIT):
        raise GridFileError(name, f"{key}: {archive.size_of(key):,} bytes are too many")
    try:
        document = json.loads(archive[key], parse_constant=_refuse)
    except (ValueError, RecursionError) as error:
        raise GridFileError(name, f"{key}: not JSON ({error})") from error
    if not isinstance(document, dict):
        raise GridFileError(name, f"{key}: must be a JSON object")
    return document


def check_arrays(archive: Archive, name: str, cell_limit: int) -> dict[str, tuple[int, ...]]:
    """Return the arrays' shapes, after a check of their declared types, shapes and chunks; allocates nothing.

    Raises:
        GridFileError: If one is wrong; it names the key.
    """
    shapes = {key: _check_array(archive, key, name) for key in ARRAYS}
    cells = math.prod(shapes["labels"])
    if not 0 < cells <= cell_limit:
        hint = "create it again with larger cells: bimvox voxelize MODEL --voxel-size METRES" if cells > 0 else None
        raise GridFileError(name, f"labels: declares {cells:,} cells; 1 to {cell_limit:,} are allowed", hint=hint)
    lengths = dict(_FIXED)
    for key, rule in ARRAYS.items():
        for dimension, length in zip(rule.dimensions, shapes[key], strict=True):
            if lengths.setdefault(dimension, length) != length:
                raise GridFileError(name, f"{key}: {dimension} is {length}, elsewhere {lengths[dimension]}")
    for key, rule in ARRAYS.items():
        if rule.dimensions[0] not in AXES and shapes[key][0] > TABLE_ROWS_LIMIT:
            raise GridFileError(name, f"{key}: {shapes[key][0]:,} rows; at most {TABLE_ROWS_LIMIT:,} are allowed")
    for key, shape in shapes.items():
        _check_chunks(archive, key, shape, name)
    return shapes


def _check_array(archive: Archive, key: str, name: str) -> tuple[int, ...]:
    place = f"{key}/zarr.json"
    meta = read_json(archive, place, name)
    shape = _sizes(meta.get("shape"), len(ARRAYS[key].dimensions), f"{place}: shape", name)
    expected = array_document(key, shape)
    for entry in (*expected, *meta):
        found, value = meta.get(entry), expected.get(entry)
        if entry == "codecs":
            found, value = _plain_codecs(found), _plain_codecs(value)
        elif entry == "attributes":
            continue
        elif entry == "storage_transformers":
            found = found or []
        if found != value:
            raise GridFileError(name, f"{place}: {entry} is {shown(found)}, must be {shown(value)}")
    return shape


def _check_chunks(archive: Archive, key: str, shape: tuple[int, ...], name: str) -> None:
    prefix = f"{key}/c/"
    chunk = chunk_shape(ARRAYS[key], shape)
    expected = math.prod(-(-size // step) for size, step in zip(shape, chunk, strict=True))
    present = [member for member in archive if member.startswith(prefix)]
    # The archive limits the number of members; the number of chunks is only declared. Compare before listing chunks.
    if ARRAYS[key].fill is None and len(present) != expected:
        raise GridFileError(name, f"{key}: {len(present):,} of {expected:,} chunks are present")
    known = {member for member, _ in chunk_keys(key, shape)}
    for member in present:
        if member not in known:
            raise GridFileError(name, f"{member}: no such chunk")


def _plain_codecs(codecs: object) -> object:
    """Return the codecs without the settings that do not affect reading."""
    if not isinstance(codecs, list) or not all(isinstance(codec, dict) for codec in codecs):
        return codecs
    plain = []
    for codec in codecs:
        configuration = codec.get("configuration") or {}
        endian = isinstance(configuration, dict) and configuration.get("endian", "little") == "little"
        plain.append(codec.get("name") if endian else codec)
    return plain


def _sizes(value: object, length: int, place: str, name: str) -> tuple[int, ...]:
    if (
        not isinstance(value, list)
        or len(value) != length
        or not all(type(n) is int and 0 <= n < 1 << 31 for n in value)
    ):
        raise GridFileError(name, f"{place} is {shown(value)}, must be {length} whole numbers from 0 to 2^31")
    return tuple(value)


def _refuse(constant: str) -> None:
    raise ValueError(f"{constant} is not a number")
