"""The grid file: Zarr v3 in one ZIP, which zarr and xarray open without bimvox.

The group's arrays are ``labels`` (x, y, z) uint8, ``owners`` (x, y, z) int32 into the table of parts, the coordinates
``x``, ``y``, ``z`` of the cell centres in metres, the table of cells met by several parts (``shared_cells``,
``shared_parts``, ``shared_fractions``), and the boxes of every part (``boxes``, ``box_parts``). Its attributes hold the
format's name and version, the frame, the source and the table of parts. Chunks are compressed with Zstandard; chunks of
nothing but air are left out. The same grid gives the same bytes, for any number of threads.

Written and read chunk by chunk: the cells are never dense as a whole.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from bimvox.errors import GridFileError
from bimvox.grid import brick_kernels as kernels
from bimvox.grid.archive import Archive, write_archive
from bimvox.grid.attributes import checked_attributes, group_document
from bimvox.grid.bricks import NO_OWNER, BrickBuilder, Bricks
from bimvox.grid.consistency import contradiction
from bimvox.grid.frame import GridFrame
from bimvox.grid.in_order import in_order
from bimvox.grid.labels import Label
from bimvox.grid.layout import (
    ARRAYS,
    AXES,
    array_document,
    check_arrays,
    chunk_keys,
    chunk_shape,
    decode_chunk,
    encode_chunk,
    read_json,
)
from bimvox.grid.limits import CELL_LIMIT
from bimvox.grid.voxel_grid import VoxelGrid

Member = tuple[str, bytes]


def write_grid(grid: VoxelGrid, stream: BinaryIO, *, threads: int = 1) -> None:
    """Write a grid as a ``.zarr.zip`` file; equal grids give equal bytes.

    Args:
        grid: The grid.
        stream: Where to write it.
        threads: Number of chunks compressed in parallel; the bytes do not depend on it.
    """
    write_archive(stream, _members(grid, threads))


def read_grid(stream: BinaryIO, name: str, *, cell_limit: int = CELL_LIMIT) -> VoxelGrid:
    """Return the grid of a ``.zarr.zip`` file; damaged and malicious files are refused before memory is allocated.

    Args:
        stream: The file, which can seek.
        name: Its name, for messages.
        cell_limit: Most cells that are accepted.

    Raises:
        GridFileError: If a key is wrong; the error names it.
    """
    archive = Archive(stream, name)
    attributes = checked_attributes(read_json(archive, "zarr.json", name), name)
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
    if wrong := contradiction(grid):
        raise GridFileError(name, wrong)
    return grid


def _members(grid: VoxelGrid, threads: int) -> Iterator[Member]:
    tables = _tables(grid)
    shapes = {key: tables[key].shape if key in tables else grid.shape for key in ARRAYS}
    yield "zarr.json", _json(group_document(grid, shapes))
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
            agree = kernels.labels_agree(values, found, labels)
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
