"""The grid file: Zarr v3 in one ZIP, which zarr and xarray open without bimvox.

The group's arrays are ``labels`` (x, y, z) uint8, ``owners`` (x, y, z) int32 into the table of parts, the coordinates
``x``, ``y``, ``z`` of the cell centres in metres, the table of cells met by several parts (``shared_cells``,
``shared_parts``, ``shared_fractions``), and the boxes of every part (``boxes``, ``box_parts``). Its attributes hold the
format's name and version, the frame, the source and the table of parts. Chunks are compressed with Zstandard; chunks of
nothing but air are left out. The same grid gives the same bytes, for any number of threads.

Written and read chunk by chunk: the cells are never dense as a whole.
"""

from __future__ import annotations

import dataclasses
import json
import math
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Any, BinaryIO, TypeGuard, TypeVar

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import kernel
from bimvox.errors import GridFileError
from bimvox.grid.bricks import BRICK, NO_OWNER, BrickBuilder, Bricks
from bimvox.grid.frame import CELL_LIMIT, GridFrame, Label
from bimvox.grid.layout import (
    ARRAYS,
    AXES,
    FORMAT,
    VERSION,
    Archive,
    array_document,
    check_arrays,
    chunk_keys,
    chunk_shape,
    decode_chunk,
    encode_chunk,
    read_json,
    write_archive,
)
from bimvox.grid.voxel_grid import Part, VoxelGrid

_AGAIN = "create the grid again with bimvox voxelize MODEL"


def _group_document(grid: VoxelGrid, shapes: Mapping[str, tuple[int, ...]]) -> dict[str, Any]:
    """Return the metadata of the group (``zarr.json``), including those of its arrays with these shapes."""
    attributes = {
        "Conventions": "CF-1.11",
        "format": FORMAT,
        "version": VERSION,
        "unit": "m",
        "voxel_size_m": grid.frame.voxel_size_m,
        "origin_m": list(grid.frame.origin_m),
        "source_origin_m": list(grid.origin_m),
        "source": dict(sorted(grid.source.items())),
        "georeference": dict(sorted(grid.georeference.items())),
        "parts": [dataclasses.asdict(part) | {"label": int(part.label)} for part in grid.parts],
    }
    # Not in the Zarr specification, but zarr and xarray look for it first: one document instead of eleven.
    consolidated = {
        "kind": "inline",
        "must_understand": False,
        "metadata": {key: array_document(key, shape) for key, shape in shapes.items()},
    }
    return {
        "zarr_format": 3,
        "node_type": "group",
        "attributes": attributes,
        "consolidated_metadata": consolidated,
    }


@dataclasses.dataclass(frozen=True, slots=True)
class _Attributes:
    """The checked attributes; see :class:`bimvox.grid.voxel_grid.VoxelGrid` for what they mean."""

    frame: GridFrame
    origin_m: tuple[float, float, float]
    source: Mapping[str, str | float | bool]
    georeference: Mapping[str, str | float]
    parts: tuple[Part, ...]


def _checked_attributes(document: Mapping[str, Any], name: str) -> _Attributes:
    """Return the attributes of a group's metadata.

    Raises GridFileError: if a key is wrong; the error names it.
    """
    attributes = document.get("attributes")
    if document.get("zarr_format") != 3 or document.get("node_type") != "group" or not isinstance(attributes, dict):
        raise GridFileError(name, "zarr.json: must be a Zarr v3 group with attributes")
    if attributes.get("format") != FORMAT:
        raise GridFileError(
            name,
            f"format: must be {FORMAT!r}",
            hint="this Zarr file is not from bimvox; name a grid made by bimvox voxelize",
        )
    version = attributes.get("version")
    if version != VERSION or isinstance(version, bool):
        older = isinstance(version, int) and version < VERSION
        hint = f"it is from an older bimvox: {_AGAIN}" if older else f"update bimvox, or {_AGAIN}"
        raise GridFileError(
            name, f"version: {version!r} cannot be read; this bimvox reads version {VERSION}", hint=hint
        )
    if attributes.get("unit") != "m":
        raise GridFileError(name, "unit: must be 'm'")
    size = attributes.get("voxel_size_m")
    if not _is_number(size) or not size > 0.0:
        raise GridFileError(name, "voxel_size_m: must be a positive number")
    return _Attributes(
        GridFrame(_triple(attributes, "origin_m", name), float(size)),
        _triple(attributes, "source_origin_m", name),
        _plain_values(attributes, "source", name),
        _plain_values(attributes, "georeference", name),
        _parts(attributes, name),
    )


def _triple(attributes: Mapping[str, Any], key: str, name: str) -> tuple[float, float, float]:
    value = attributes.get(key)
    if not isinstance(value, list) or len(value) != 3 or not all(_is_number(n) for n in value):
        raise GridFileError(name, f"{key}: must be three numbers")
    x, y, z = (float(n) for n in value)
    return (x, y, z)


def _plain_values(attributes: Mapping[str, Any], key: str, name: str) -> dict[str, Any]:
    value = attributes.get(key)
    if not isinstance(value, dict) or not all(isinstance(item, str | float | int) for item in value.values()):
        raise GridFileError(name, f"{key}: must be an object of plain values")
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
            raise GridFileError(name, f"parts[{index}].label: {row.get('label')!r} is not a label")
    try:
        # As JSON: strict checking of Python values accepts only instances of the dataclass and the enumeration.
        parts = TypeAdapter(list[Part]).validate_json(json.dumps(rows), strict=True)
    except ValidationError as error:
        first = error.errors()[0]
        place, *fields = (str(step) for step in first["loc"])
        raise GridFileError(name, ".".join([f"parts[{place}]", *fields]) + f": {first['msg']}") from error
    return tuple(parts)


def _is_number(value: Any) -> TypeGuard[float]:
    """Return whether a value is a finite number; whole numbers in JSON may be too large for a float."""
    if not isinstance(value, int | float) or isinstance(value, bool):
        return False
    return abs(value) < 1e300 and not math.isnan(value)


def _contradiction(grid: VoxelGrid) -> str | None:
    """Return what is wrong in the tables of a grid, starting with the table's name; None if all agree.

    The table of shared cells is sorted by cell, then part. The owner of a shared cell is one of its rows, and no row
    has a larger share. The boxes of a part contain exactly the cells that it owns and shares.
    """
    owned = grid.owners.counts(len(grid.parts))[1:]
    return _in_shared(grid) or _in_boxes(grid, owned) or _in_parts(grid)


def _in_shared(grid: VoxelGrid) -> str | None:
    cells, parts, fractions = grid.shared_cells, grid.shared_parts, grid.shared_fractions
    if len(parts) == 0:
        return None
    if cells.min() < 0 or np.any(cells.max(axis=0) >= grid.shape):
        return "shared_cells: outside the grid"
    if parts.min() < 0 or parts.max() >= len(grid.parts):
        return f"shared_parts: out of range of the {len(grid.parts)} parts"
    if not np.all((fractions >= 0.0) & (fractions <= 1.0)):
        return "shared_fractions: must be from 0 to 1"
    places = np.ravel_multi_index(tuple(cells.T), grid.shape)
    same = places[1:] == places[:-1]
    if np.any(places[1:] < places[:-1]) or np.any(parts[1:][same] <= parts[:-1][same]):
        return "shared_cells: must be sorted by cell, then part, without repeats"
    first = np.flatnonzero(np.concatenate([[True], ~same]))
    if np.diff(first, append=len(parts)).min() < 2:
        return "shared_cells: a cell with one row is not shared"
    owns = parts == grid.owners.at(cells)
    if not np.all(np.add.reduceat(owns, first) == 1):
        return "shared_parts: the owner of a shared cell is not one of its parts"
    if np.any(np.maximum.reduceat(fractions, first) > fractions[owns]):
        return "shared_fractions: a part that does not own a cell fills more of it than its owner"
    return None


def _in_boxes(grid: VoxelGrid, owned: NDArray[np.int64]) -> str | None:
    boxes, parts = grid.boxes, grid.box_parts
    if len(parts):
        if boxes.min() < 0 or np.any(boxes[:, 3:].max(axis=0) > grid.shape) or np.any(boxes[:, 3:] <= boxes[:, :3]):
            return "boxes: outside the grid, or empty"
        if parts[0] < 0 or parts[-1] >= len(grid.parts) or np.any(parts[1:] < parts[:-1]):
            return f"box_parts: must ascend, within the {len(grid.parts)} parts"
    # Integers below 2^53 stay exact in the weights of bincount; far larger sums fail the comparison below.
    volumes = np.prod(boxes[:, 3:] - boxes[:, :3], axis=1, dtype=np.float64)
    held = np.bincount(parts, volumes, len(grid.parts))
    lent = grid.shared_parts != grid.owners.at(grid.shared_cells)
    lent_parts, lent_cells = grid.shared_parts[lent], grid.shared_cells[lent]
    met = owned + np.bincount(lent_parts, minlength=len(grid.parts))
    for index in np.flatnonzero(held != met)[:1]:
        return f"boxes: those of part {index} hold {held[index]:,.0f} cells, but it meets {met[index]:,}"
    found = np.zeros(len(grid.parts), np.int64)
    others, places = np.empty_like(lent_parts), np.empty(len(lent_parts), np.int64)
    index, cells = grid.owners.index, grid.owners.cells
    count = _sort_boxed_cells(index, cells, grid.shape, boxes, parts, found, others, places)
    expected = np.ravel_multi_index(tuple(lent_cells.T), grid.shape)
    by_table, by_boxes = np.lexsort((expected, lent_parts)), np.lexsort((places, others))
    if (
        np.any(found != owned)
        or count != len(lent_parts)
        or np.any(others[by_boxes] != lent_parts[by_table])
        or np.any(places[by_boxes] != expected[by_table])
    ):
        return "boxes: they do not hold the cells that the parts own and share"
    for index in np.flatnonzero(met != [part.cells for part in grid.parts])[:1]:
        return f"parts[{index}].cells: {grid.parts[index].cells:,}, but it meets {met[index]:,}"
    return None


def _in_parts(grid: VoxelGrid) -> str | None:
    seen: set[str] = set()
    for index, part in enumerate(grid.parts):
        if part.id in seen:
            return f"parts[{index}].id: {part.id!r} occurs twice"
        if not part.solid_volume_m3 >= 0.0 or not part.mass_kg >= 0.0:
            return f"parts[{index}]: a volume or mass below 0"
        seen.add(part.id)
    return None


T = TypeVar("T")
R = TypeVar("R")


def in_order(function: Callable[[T], R], items: Iterable[T], threads: int) -> Iterator[R]:
    """Yield ``function`` of every item, in order; at most two results per thread wait in memory."""
    if threads <= 1:
        yield from map(function, items)
        return
    with ThreadPoolExecutor(threads) as pool:
        waiting: deque[Future[R]] = deque()
        try:
            for item in items:
                waiting.append(pool.submit(function, item))
                if len(waiting) >= 2 * threads:
                    yield waiting.popleft().result()
            while waiting:
                yield waiting.popleft().result()
        finally:
            for future in waiting:
                future.cancel()


Member = tuple[str, bytes]


def write_grid(grid: VoxelGrid, stream: BinaryIO, *, threads: int = 1) -> None:
    """Write a grid as a ``.zarr.zip`` file; equal grids give equal bytes.

    ``threads``: number of chunks compressed in parallel; the bytes do not depend on it.
    """
    write_archive(stream, _members(grid, threads))


def read_grid(stream: BinaryIO, name: str, *, cell_limit: int = CELL_LIMIT) -> VoxelGrid:
    """Return the grid of a ``.zarr.zip`` file; damaged and malicious files are refused before memory is allocated.

    ``stream``: the file, which can seek; ``cell_limit``: most cells that are accepted.

    Raises:
        GridFileError: If a key is wrong; the error names it.
    """
    archive = Archive(stream, name)
    attributes = _checked_attributes(read_json(archive, "zarr.json", name), name)
    shapes = check_arrays(archive, name, cell_limit)
    _check_coordinates(archive, attributes.frame, shapes, name)
    labels = np.array([Label.AIR, *(part.label for part in attributes.parts)], np.uint8)
    grid = VoxelGrid(
        frame=attributes.frame,
        owners=_read_owners(archive, shapes["owners"], labels, name),
        parts=attributes.parts,
        **{
            key: _read_table(archive, key, shapes[key], name)
            for key in ("shared_cells", "shared_parts", "shared_fractions", "boxes", "box_parts")
        },
        source=attributes.source,
        origin_m=attributes.origin_m,
        georeference=attributes.georeference,
    )
    if wrong := _contradiction(grid):
        raise GridFileError(name, wrong)
    return grid


def _members(grid: VoxelGrid, threads: int) -> Iterator[Member]:
    tables = _tables(grid)
    shapes = {key: tables[key].shape if key in tables else grid.shape for key in ARRAYS}
    yield "zarr.json", _json(_group_document(grid, shapes))
    for key, shape in shapes.items():
        yield f"{key}/zarr.json", _json(array_document(key, shape))
    for key, table in tables.items():
        rows = chunk_shape(ARRAYS[key], table.shape)[0]
        for member, first in chunk_keys(key, table.shape):
            yield member, encode_chunk(key, table.shape, table[first[0] : first[0] + rows])
    places = zip(chunk_keys("labels", grid.shape), chunk_keys("owners", grid.shape), strict=True)
    jobs = ((low, labels, owners) for (labels, low), (owners, _) in places)
    for chunks in in_order(lambda job: _cell_chunks(grid, *job), jobs, threads):
        yield from chunks


def _cell_chunks(grid: VoxelGrid, low: tuple[int, ...], labels: str, owners: str) -> list[Member]:
    """Return the chunks of labels and owners at one place; none if all cells are air."""
    high = np.minimum(np.array(low) + chunk_shape(ARRAYS["owners"], grid.shape), grid.shape)
    values = grid.owners.box(low, high)
    if values.max() == NO_OWNER:
        return []
    kinds = grid.owners.mapped_box(low, high, grid.label_table)
    return [
        (labels, encode_chunk("labels", grid.shape, kinds)),
        (owners, encode_chunk("owners", grid.shape, values)),
    ]


def _read_owners(archive: Archive, shape: tuple[int, ...], labels: NDArray[np.uint8], name: str) -> Bricks:
    """Return the owners, chunk by chunk; the labels, which follow from them, must agree."""
    builder = BrickBuilder(shape, len(labels) - 1)
    sizes = chunk_shape(ARRAYS["owners"], shape)
    for (kinds, low), (owners, _) in zip(chunk_keys("labels", shape), chunk_keys("owners", shape), strict=True):
        inside = tuple(slice(0, min(n, size - start)) for start, n, size in zip(low, sizes, shape, strict=True))
        found = decode_chunk(archive, kinds, shape, name)[inside] if kinds in archive else None
        agree = found is None or not found.any()
        if owners in archive:
            values = np.ascontiguousarray(decode_chunk(archive, owners, shape, name)[inside])
            x, y, z = low
            try:
                builder.enter((x, y, z), values)
            except ValueError as error:
                raise GridFileError(name, f"{owners}: {error}") from error
            found = np.zeros(values.shape, np.uint8) if found is None else np.ascontiguousarray(found)
            agree = _labels_agree(values, found, labels)
        if not agree:
            raise GridFileError(name, f"{kinds}: the labels do not match the owners")
    return builder.bricks()


def _read_table(archive: Archive, key: str, shape: tuple[int, ...], name: str) -> NDArray[Any]:
    chunks = [decode_chunk(archive, member, shape, name) for member, _ in chunk_keys(key, shape)]
    if not chunks:
        return np.empty(shape, np.dtype(ARRAYS[key].dtype))
    return np.concatenate(chunks)[: shape[0]]


def _check_coordinates(archive: Archive, frame: GridFrame, shapes: Mapping[str, tuple[int, ...]], name: str) -> None:
    for n, axis in enumerate(AXES):
        found = _read_table(archive, axis, shapes[axis], name)
        expected = _centres(frame, n, shapes[axis][0])
        if not np.allclose(found, expected, rtol=0.0, atol=1e-3 * frame.voxel_size_m):
            raise GridFileError(name, f"{axis}: does not fit origin_m and voxel_size_m")


def _tables(grid: VoxelGrid) -> dict[str, NDArray[Any]]:
    """Return all arrays except labels and owners."""
    return {
        **{axis: _centres(grid.frame, n, grid.shape[n]) for n, axis in enumerate(AXES)},
        "shared_cells": grid.shared_cells,
        "shared_parts": grid.shared_parts,
        "shared_fractions": grid.shared_fractions,
        "boxes": grid.boxes,
        "box_parts": grid.box_parts,
    }


def _centres(frame: GridFrame, axis: int, size: int) -> NDArray[np.float64]:
    cells = np.zeros((size, 3))
    cells[:, axis] = np.arange(size)
    return frame.centre_of(cells)[:, axis]


def _json(document: Mapping[str, Any]) -> bytes:
    return json.dumps(document, ensure_ascii=False, indent=1, allow_nan=False).encode()


@kernel
def _labels_agree(owners: NDArray[np.int32], labels: NDArray[np.uint8], of_owner: NDArray[np.uint8]) -> bool:
    """Return whether every cell has the label ``of_owner[owner + 1]``."""
    for i in range(owners.shape[0]):
        for j in range(owners.shape[1]):
            for k in range(owners.shape[2]):
                if labels[i, j, k] != of_owner[owners[i, j, k] + 1]:
                    return False
    return True


@kernel
def _sort_boxed_cells(
    index: NDArray[np.int32],
    cells: NDArray[np.unsignedinteger],
    shape: tuple[int, int, int],
    boxes: NDArray[np.int32],
    box_parts: NDArray[np.int32],
    owned: NDArray[np.int64],
    lent_parts: NDArray[np.int32],
    lent_places: NDArray[np.int64],
) -> int:
    """Count the cells in each part's boxes that it owns; list the part and the position of the others.

    Return the number of others, or -1 if the list is too short.
    """
    row = 0
    for n in range(boxes.shape[0]):
        part = box_parts[n]
        for x in range(boxes[n, 0], boxes[n, 3]):
            for y in range(boxes[n, 1], boxes[n, 4]):
                for z in range(boxes[n, 2], boxes[n, 5]):
                    at = index[x // BRICK, y // BRICK, z // BRICK]
                    owner = -at - 2 if at < 0 else np.int64(cells[at, x % BRICK, y % BRICK, z % BRICK]) - 1
                    if owner == part:
                        owned[part] += 1
                    elif row == lent_parts.size:
                        return -1
                    else:
                        lent_parts[row] = part
                        lent_places[row] = (np.int64(x) * shape[1] + y) * shape[2] + z
                        row += 1
    return row
