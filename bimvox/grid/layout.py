"""The layout of a grid file: the arrays of its Zarr group, and the ZIP file that holds them.

Zarr v3 with regular chunks, each little-endian and compressed with Zstandard (https://zarr-specs.readthedocs.io).
"""

from __future__ import annotations

import itertools
import json
import math
import os
import struct
import zipfile
import zlib
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, BinaryIO

import numpy as np
import zstandard
from numpy.typing import NDArray

from bimvox.errors import GridFileError, shown
from bimvox.grid.bricks import NO_OWNER
from bimvox.grid.frame import Label

_EPOCH = (1980, 1, 1, 0, 0, 0)
_READABLE = 0o644 << 16
_DIRECTORY_BYTES_LIMIT = 1 << 23
_MEMBERS_LIMIT = 100_000
_END = struct.Struct("<4s4H2LH")
_END_64_LOCATOR = struct.Struct("<4sLQL")
_END_64 = struct.Struct("<4sQ2H2L4Q")
_ZSTD_MAGIC = b"\x28\xb5\x2f\xfd"
_RLE_BLOCK = 1

BROKEN_ZIP = (
    zipfile.BadZipFile,
    zlib.error,
    struct.error,
    EOFError,
    NotImplementedError,
    OSError,
    RuntimeError,
    ValueError,
    MemoryError,
)
"""What the zip reader raises if the bytes are not a ZIP file, or a damaged one."""


def write_archive(stream: BinaryIO, members: Iterable[tuple[str, bytes]]) -> None:
    """Write a ZIP file of these members in their order, stored (chunks are already compressed), with a fixed date."""
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_STORED) as archive:
        for name, data in members:
            info = zipfile.ZipInfo(name, _EPOCH)
            info.create_system = 3
            info.external_attr = _READABLE
            archive.writestr(info, data)


class Archive(Mapping[str, bytes]):
    """The members of a ZIP file, each read on access; check ``size_of`` first.

    ``stream``: the file, which can seek.

    Raises:
        GridFileError: If it is not a ZIP file, is damaged, or its members claim more bytes than the file has.
    """

    def __init__(self, stream: BinaryIO, name: str) -> None:
        self._name = name
        try:
            size = stream.seek(0, os.SEEK_END)
            _check_directory_size(stream, size, name)
            self._zip = zipfile.ZipFile(stream)
        except BROKEN_ZIP as error:
            raise GridFileError(name, f"not a readable ZIP file ({error})") from error
        entries = [info for info in self._zip.infolist() if not info.is_dir()]
        for info in entries:
            if info.compress_type != zipfile.ZIP_STORED or info.compress_size != info.file_size or info.flag_bits & 1:
                raise GridFileError(
                    name, f"{info.filename}: must be stored in the ZIP file, not compressed or encrypted"
                )
            if "\\" in info.orig_filename or any(step in ("", ".", "..") for step in info.filename.split("/")):
                raise GridFileError(name, f"{info.filename!r}: not a valid name in a Zarr store")
        if sum(info.file_size for info in entries) > size:
            raise GridFileError(name, "its members claim more bytes than the file has")
        self._entries = {info.filename: info for info in entries}
        if len(self._entries) < len(entries):
            raise GridFileError(name, "two members of the ZIP file have the same name")

    def __iter__(self) -> Iterator[str]:
        return iter(self._entries)

    def __len__(self) -> int:
        return len(self._entries)

    def __contains__(self, key: object) -> bool:
        return key in self._entries

    def __getitem__(self, key: str) -> bytes:
        info = self._entries[key]
        try:
            return self._zip.read(info)
        except BROKEN_ZIP as error:
            raise GridFileError(self._name, f"{key}: cannot be read from the ZIP ({error})") from error

    def size_of(self, key: str) -> int:
        """Return the size of a member in bytes, without reading it."""
        return self._entries[key].file_size


def _check_directory_size(stream: BinaryIO, size: int, name: str) -> None:
    """Refuse a directory that would take much memory; Python's reader reads it whole."""
    stream.seek(max(0, size - _END.size - _END_64_LOCATOR.size))
    tail = stream.read()
    if len(tail) < _END.size:
        raise ValueError("no end of central directory")
    magic, _, _, _, count, length, _, comment = _END.unpack(tail[-_END.size :])
    if magic != b"PK\5\6" or comment:
        raise ValueError("no end of central directory at the end of the file")
    locator = tail[: -_END.size]
    if len(locator) == _END_64_LOCATOR.size and locator[:4] == b"PK\6\7":
        stream.seek(max(0, size - _END.size - _END_64_LOCATOR.size - _END_64.size))
        record = _END_64.unpack(stream.read(_END_64.size))
        count, length = max(count, record[7]), max(length, record[8])
        if record[0] != b"PK\6\6":
            raise ValueError("no 64-bit end of central directory before its locator")
    if length > _DIRECTORY_BYTES_LIMIT or count > _MEMBERS_LIMIT:
        raise GridFileError(name, f"a ZIP directory of {count:,} members, {length:,} bytes, is too large for a grid")


def zstd_content_size(chunk: bytes) -> int:
    """Return the decompressed size of a Zstandard chunk in bytes, from its header (RFC 8878).

    Raises ValueError: if it is not exactly one complete frame that states its size.
    """
    if len(chunk) < 6 or chunk[:4] != _ZSTD_MAGIC:
        raise ValueError("not a Zstandard frame")
    descriptor = chunk[4]
    single, checksum = descriptor >> 5 & 1, descriptor >> 2 & 1
    field = (single, 2, 4, 8)[descriptor >> 6]
    start = 5 + (1 - single) + (0, 1, 2, 4)[descriptor & 3]
    if field == 0:
        raise ValueError("a Zstandard frame without its size")
    size = int.from_bytes(chunk[start : start + field], "little") + (256 if field == 2 else 0)
    at, last = start + field, False
    while not last:
        header = int.from_bytes(chunk[at : at + 3], "little")
        last = bool(header & 1)
        at += 3 + (1 if header >> 1 & 3 == _RLE_BLOCK else header >> 3)
        if at > len(chunk):
            raise ValueError("a truncated Zstandard frame")
    if at + 4 * checksum != len(chunk):
        raise ValueError("bytes after a Zstandard frame")
    return size


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
class _ArrayRule:
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
ARRAYS: dict[str, _ArrayRule] = {
    "x": _ArrayRule("float64", ("x",), _named(f"x {_AT_CENTRE}", axis="X", units="m")),
    "y": _ArrayRule("float64", ("y",), _named(f"y {_AT_CENTRE}", axis="Y", units="m")),
    "z": _ArrayRule("float64", ("z",), _named(f"height {_AT_CENTRE}", axis="Z", units="m", positive="up")),
    "labels": _ArrayRule("uint8", AXES, _LABELS, int(Label.AIR)),
    "owners": _ArrayRule("int32", AXES, _named(f"index into the group's parts, {NO_OWNER} for none"), NO_OWNER),
    "shared_cells": _ArrayRule(
        "int32", ("shared", "axis"), _named("index of a cell that several parts meet, one row per part")
    ),
    "shared_parts": _ArrayRule("int32", ("shared",), _named("index into the group's parts")),
    "shared_fractions": _ArrayRule("float32", ("shared",), _named("share of the cell that the part fills", units="1")),
    "boxes": _ArrayRule("int32", ("box", "corner"), _named("half-open box x0 y0 z0 x1 y1 z1 of cells of a part")),
    "box_parts": _ArrayRule("int32", ("box",), _named("index into the group's parts")),
}
_FIXED = {"axis": 3, "corner": 6}


def chunk_shape(rule: _ArrayRule, shape: tuple[int, ...]) -> tuple[int, ...]:
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

    Raises GridFileError: if it is damaged, or its declared size, checked before decompression, is not the chunk's.
    """
    rule = ARRAYS[member.split("/", 1)[0]]
    chunk = chunk_shape(rule, shape)
    dtype = np.dtype(_NUMPY[rule.dtype])
    expected = math.prod(chunk) * dtype.itemsize
    # Zstandard makes no more bytes of these (``ZSTD_COMPRESSBOUND``, with room for a checksum).
    if archive.size_of(member) > expected + (expected >> 8) + 1024:
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


def read_json(archive: Archive, key: str, name: str) -> dict[str, Any]:
    """Return one metadata document of the store.

    Raises GridFileError: if it is missing, far too long, or not a JSON object.
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

    Raises GridFileError: if one is wrong; it names the key.
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
