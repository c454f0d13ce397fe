"""The grid file: Zarr v3 in one ZIP, which zarr and xarray open without bimvox.

The group's arrays are ``labels`` (x, y, z) uint8, ``owners`` (x, y, z) int32 into the table of parts, the coordinates
``x``, ``y``, ``z`` of the cell centres in metres, and the table of cells met by several parts: ``shared_cells``
(shared, axis) int32, ``shared_parts`` and ``shared_fractions`` (shared). Its attributes hold the format's name and
version, the frame, the source and the table of parts. Chunks are compressed with Zstandard; chunks of nothing but air
are left out. The same grid gives the same bytes.
"""

from __future__ import annotations

import dataclasses
import json
import math
from collections.abc import Mapping
from typing import Any, TypeGuard

import numpy as np
from numpy.typing import NDArray

from bimvox.errors import GridFileError
from bimvox.grid.archive import pack, unpack
from bimvox.grid.frame import GridFrame
from bimvox.grid.labels import Label
from bimvox.grid.layout import ARRAYS, CELL_CHUNK, FORMAT, ROW_CHUNK, VERSION, check_arrays, read_json
from bimvox.grid.limits import CELL_LIMIT
from bimvox.grid.voxel_grid import NO_OWNER, Part, VoxelGrid

_LEVEL = 3
_AXES = ("x", "y", "z")


def grid_to_bytes(grid: VoxelGrid) -> bytes:
    """Return a grid as the bytes of a ``.zarr.zip`` file; equal grids give equal bytes."""
    import zarr
    from zarr.codecs import ZstdCodec
    from zarr.core.buffer import Buffer
    from zarr.storage import MemoryStore

    store: dict[str, Buffer] = {}
    group = zarr.create_group(MemoryStore(store), zarr_format=3, attributes=_attributes(grid))
    for key, array in _arrays(grid).items():
        rule = ARRAYS[key]
        step = CELL_CHUNK if array.ndim == 3 else ROW_CHUNK
        target = group.create_array(
            key,
            shape=array.shape,
            chunks=tuple(min(step, max(size, 1)) for size in array.shape),
            dtype=array.dtype,
            fill_value=0 if rule.fill is None else rule.fill,
            compressors=[ZstdCodec(level=_LEVEL)],
            dimension_names=rule.dimensions,
            attributes=_array_attributes(key),
            config={"write_empty_chunks": rule.fill is None},
        )
        if array.size:
            target[...] = array
    return pack({key: buffer.to_bytes() for key, buffer in store.items()})


def grid_from_bytes(data: bytes, name: str, *, cell_limit: int = CELL_LIMIT) -> VoxelGrid:
    """Return the grid that a ``.zarr.zip`` file holds, refusing damaged and hostile files before memory is spent.

    Args:
        data: The file's bytes.
        name: The file's name, for messages.
        cell_limit: Largest number of cells to accept.

    Raises:
        GridFileError: Naming the key that is wrong.
    """
    import zarr
    from zarr.core.buffer import default_buffer_prototype
    from zarr.storage import MemoryStore

    members = unpack(data, name)
    attributes = _checked_attributes(read_json(members, "zarr.json", name), name)
    check_arrays(members, name, cell_limit)
    from_bytes = default_buffer_prototype().buffer.from_bytes
    known = tuple(f"{key}/" for key in ARRAYS)
    store = {key: from_bytes(value) for key, value in members.items() if key == "zarr.json" or key.startswith(known)}
    arrays: dict[str, NDArray[Any]] = {}
    key = ""
    try:
        group = zarr.open_group(MemoryStore(store), mode="r", zarr_format=3, use_consolidated=False)
        for key in ARRAYS:
            arrays[key] = np.asarray(group[key][...])  # type: ignore[index]
    except (RuntimeError, ValueError, TypeError, KeyError, AttributeError) as error:
        raise GridFileError(name, f"{key}: cannot be decoded ({error})") from error
    grid = VoxelGrid(
        frame=GridFrame(_triple(attributes, "origin_m", name), float(attributes["voxel_size_m"])),
        labels=arrays["labels"],
        owners=arrays["owners"],
        parts=_parts(attributes, name),
        shared_cells=arrays["shared_cells"],
        shared_parts=arrays["shared_parts"],
        shared_fractions=arrays["shared_fractions"],
        source=_source(attributes, name),
        origin_m=_triple(attributes, "source_origin_m", name),
    )
    _check_values(grid, arrays, name)
    return grid


def _arrays(grid: VoxelGrid) -> dict[str, NDArray[Any]]:
    centres = {
        axis: grid.frame.centre_of(np.arange(size)[:, None].repeat(3, axis=1))[:, n]
        for n, (axis, size) in enumerate(zip(_AXES, grid.shape, strict=True))
    }
    return {
        "labels": grid.labels,
        "owners": grid.owners,
        **centres,
        "shared_cells": grid.shared_cells,
        "shared_parts": grid.shared_parts,
        "shared_fractions": grid.shared_fractions,
    }


def _attributes(grid: VoxelGrid) -> dict[str, Any]:
    return {
        "format": FORMAT,
        "version": VERSION,
        "unit": "m",
        "voxel_size_m": grid.frame.voxel_size_m,
        "origin_m": list(grid.frame.origin_m),
        "source_origin_m": list(grid.origin_m),
        "source": dict(sorted(grid.source.items())),
        "parts": [dataclasses.asdict(part) | {"label": int(part.label)} for part in grid.parts],
    }


def _array_attributes(key: str) -> dict[str, Any]:
    """Return attributes by the CF conventions, where they have a word for it."""
    if key in _AXES:
        return {"axis": key.upper(), "long_name": f"{key} of the cell's centre", "units": "m"}
    if key == "labels":
        return {
            "flag_meanings": " ".join(label.name.lower() for label in Label),
            "flag_values": [int(label) for label in Label],
            "long_name": "what the cell is",
        }
    return {
        "owners": {"long_name": f"index into the group's parts, {NO_OWNER} for none"},
        "shared_cells": {"long_name": "index of a cell that several parts meet, one row per part"},
        "shared_parts": {"long_name": "index into the group's parts"},
        "shared_fractions": {"long_name": "share of the cell that the part fills", "units": "1"},
    }[key]


def _checked_attributes(document: Mapping[str, Any], name: str) -> dict[str, Any]:
    attributes = document.get("attributes")
    if document.get("zarr_format") != 3 or document.get("node_type") != "group" or not isinstance(attributes, dict):
        raise GridFileError(name, "zarr.json: must be a Zarr v3 group with attributes")
    if attributes.get("format") != FORMAT:
        raise GridFileError(name, f"format: must be {FORMAT!r}", hint="this Zarr file was not made by bimvox")
    if attributes.get("version") != VERSION:
        hint = "update bimvox, or make the grid again with: bimvox voxelize MODEL"
        raise GridFileError(name, f"version: {attributes.get('version')!r} is unknown, {VERSION} is known", hint=hint)
    if attributes.get("unit") != "m":
        raise GridFileError(name, "unit: must be 'm'")
    size = attributes.get("voxel_size_m")
    if not _is_number(size) or not size > 0.0:
        raise GridFileError(name, "voxel_size_m: must be a positive number")
    return attributes


def _triple(attributes: Mapping[str, Any], key: str, name: str) -> tuple[float, float, float]:
    value = attributes.get(key)
    if not isinstance(value, list) or len(value) != 3 or not all(_is_number(n) for n in value):
        raise GridFileError(name, f"{key}: must be three numbers")
    x, y, z = (float(n) for n in value)
    return (x, y, z)


def _source(attributes: Mapping[str, Any], name: str) -> dict[str, str | float | bool]:
    value = attributes.get("source")
    if not isinstance(value, dict) or not all(isinstance(item, str | float | int) for item in value.values()):
        raise GridFileError(name, "source: must be an object of plain values")
    return value


def _parts(attributes: Mapping[str, Any], name: str) -> tuple[Part, ...]:
    from pydantic import TypeAdapter, ValidationError

    rows = attributes.get("parts")
    known = {field.name for field in dataclasses.fields(Part)}
    if not isinstance(rows, list):
        raise GridFileError(name, "parts: must be a list")
    for index, row in enumerate(rows):
        if not isinstance(row, dict):
            raise GridFileError(name, f"parts[{index}]: must be an object")
        if unknown := sorted(set(row) - known):
            raise GridFileError(name, f"parts[{index}].{unknown[0]}: unknown key")
        if row.get("label") not in list(Label):
            raise GridFileError(name, f"parts[{index}].label: {row.get('label')!r} is no label")
    try:
        # As JSON, because strict checking of Python values wants the dataclass and the enumeration themselves.
        parts = TypeAdapter(list[Part]).validate_json(json.dumps(rows), strict=True)
    except ValidationError as error:
        first = error.errors()[0]
        place, *fields = (str(step) for step in first["loc"])
        raise GridFileError(name, ".".join([f"parts[{place}]", *fields]) + f": {first['msg']}") from error
    return tuple(parts)


def _is_number(value: Any) -> TypeGuard[float]:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)


def _check_values(grid: VoxelGrid, arrays: Mapping[str, NDArray[Any]], name: str) -> None:
    """Check what only the decoded values tell: every index points somewhere, every share is one."""
    count = len(grid.parts)
    if grid.labels.max() > max(Label):
        raise GridFileError(name, f"labels: {int(grid.labels.max())} is no label")
    if grid.owners.min() < NO_OWNER or grid.owners.max() >= count:
        raise GridFileError(name, f"owners: out of range of the {count} parts")
    expected = _arrays(grid)
    for axis in _AXES:
        if not np.allclose(arrays[axis], expected[axis], rtol=0.0, atol=1e-3 * grid.frame.voxel_size_m):
            raise GridFileError(name, f"{axis}: does not fit origin_m and voxel_size_m")
    cells, parts, fractions = grid.shared_cells, grid.shared_parts, grid.shared_fractions
    if len(parts) == 0:
        return
    if cells.min() < 0 or np.any(cells.max(axis=0) >= grid.shape):
        raise GridFileError(name, "shared_cells: outside the grid")
    if parts.min() < 0 or parts.max() >= count:
        raise GridFileError(name, f"shared_parts: out of range of the {count} parts")
    if not np.all((fractions >= 0.0) & (fractions <= 1.0)):
        raise GridFileError(name, "shared_fractions: must be from 0 to 1")
    rank = np.ravel_multi_index(tuple(cells.T), grid.shape).astype(np.int64) * count + parts
    if not np.all(rank[1:] > rank[:-1]):
        raise GridFileError(name, "shared_cells: must be sorted by cell, then part, without repeats")
