"""VTK ImageData (``.vti``) of a grid, for ParaView and other readers of VTK's XML files.

Layout: https://docs.vtk.org/en/latest/vtk_file_formats/vtkxml_file_format.html, with appended raw data in blocks of one
horizontal layer, compressed by zlib. Written layer by layer, so that the grid is never dense in memory.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from bimvox.grid.bricks import NO_OWNER
from bimvox.grid.storage import in_order
from bimvox.grid.voxel_grid import Part, VoxelGrid

_LEVEL = 1
_OFFSET_DIGITS = 20
_MOST_PARTS = 255
_VTK_TYPES = {"|u1": "UInt8", "<i4": "Int32", "<f4": "Float32", "<f8": "Float64"}
_TEXTS: dict[str, Callable[[Part], str]] = {
    "part_id": lambda part: part.id,
    "part_global_id": lambda part: part.global_id,
    "part_class": lambda part: part.ifc_class,
    "part_name": lambda part: part.name,
}


@dataclass(frozen=True, slots=True)
class _Array:
    """One array of the file.

    Attributes:
        element: Its XML element, without the offset of its data.
        nbytes: Its uncompressed size.
        block_bytes: Size of a block; the last may be smaller.
        blocks: Yields the blocks.
    """

    element: str
    nbytes: int
    block_bytes: int
    blocks: Callable[[], Iterable[bytes]]


def write_vti(grid: VoxelGrid, stream: BinaryIO, *, threads: int = 1) -> None:
    """Write a grid as VTK ImageData with the cell arrays ``label``, ``owner``, ``parts`` and ``fill``.

    ``owner`` is the row of the part (-1: air), ``parts`` the number of parts that meet the cell, ``fill`` the share
    of the cell that its owner fills if several parts meet (NaN in the cells of a single part: not recorded). The
    field data hold the table of parts (``part_id``, ``part_global_id``, ``part_class``, ``part_name``), the offset
    to the source's coordinates (``source_origin_m``) and its ``georeference``. The stream must be seekable;
    ``threads`` blocks are compressed in parallel, and the bytes do not depend on it.
    """
    fields, cells = _fields(grid), _cells(grid)
    extent = " ".join(f"0 {n}" for n in grid.shape)
    slots: list[int] = []

    def put(text: str) -> None:
        stream.write(text.encode())

    def declare(arrays: list[_Array]) -> None:
        for array in arrays:
            put(f'<{array.element} format="appended" offset="')
            slots.append(stream.tell())
            put(f'{"0" * _OFFSET_DIGITS}"/>\n')

    put('<?xml version="1.0"?>\n<VTKFile type="ImageData" version="1.0" byte_order="LittleEndian" ')
    put('header_type="UInt64" compressor="vtkZLibDataCompressor">\n')
    put(f'<ImageData WholeExtent="{extent}" Origin="{_numbers(grid.frame.origin_m)}" ')
    put(f'Spacing="{_numbers([grid.frame.voxel_size_m] * 3)}" Direction="1 0 0 0 1 0 0 0 1">\n<FieldData>\n')
    declare(fields)
    put(f'</FieldData>\n<Piece Extent="{extent}">\n<PointData/>\n<CellData Scalars="label">\n')
    declare(cells)
    put('</CellData>\n</Piece>\n</ImageData>\n<AppendedData encoding="raw">\n_')
    first = stream.tell()
    for array, slot in zip([*fields, *cells], slots, strict=True):
        offset = stream.tell() - first
        _append(stream, array, threads)
        end = stream.tell()
        stream.seek(slot)
        put(f"{offset:0{_OFFSET_DIGITS}d}")
        stream.seek(end)
    put("\n</AppendedData>\n</VTKFile>\n")


def _append(stream: BinaryIO, array: _Array, threads: int) -> None:
    """Append the blocks of an array, preceded by their number, their uncompressed size and their compressed sizes."""
    count = -(-array.nbytes // array.block_bytes)
    table = stream.tell()
    stream.write(bytes(8 * (3 + count)))
    sizes = []
    for packed in in_order(lambda block: zlib.compress(block, _LEVEL), array.blocks(), threads):
        stream.write(packed)
        sizes.append(len(packed))
    end = stream.tell()
    stream.seek(table)
    stream.write(struct.pack(f"<{3 + count}Q", count, array.block_bytes, array.nbytes % array.block_bytes, *sizes))
    stream.seek(end)


def _cells(grid: VoxelGrid) -> list[_Array]:
    rows = len(grid.parts) + 1
    parts, fill = np.ones(rows, np.uint8), np.full(rows, np.nan, np.float32)
    parts[0], fill[0] = 0, 0.0
    # The table of shared cells is sorted by cell, and the owner of a cell has one of its rows.
    owns = grid.shared_parts == grid.owners.at(grid.shared_cells)
    cells = grid.shared_cells[owns]
    new = np.any(np.diff(grid.shared_cells, axis=0, prepend=-1) != 0, axis=1)
    several = np.diff(np.flatnonzero(new), append=len(owns)).clip(max=_MOST_PARTS)
    return [
        _layers(grid, "label", grid.label_table),
        _layers(grid, "owner", np.arange(NO_OWNER, len(grid.parts), dtype=np.int32)),
        _layers(grid, "parts", parts, cells, several),
        _layers(grid, "fill", fill, cells, grid.shared_fractions[owns]),
    ]


def _layers(
    grid: VoxelGrid,
    name: str,
    table: NDArray[Any],
    cells: NDArray[np.int32] | None = None,
    values: NDArray[Any] | None = None,
) -> _Array:
    """Return a cell array: ``table[owner + 1]``, with these values in some cells."""
    dtype = table.dtype.newbyteorder("<")
    x, y, z = grid.shape
    block = x * y * dtype.itemsize
    if cells is None or values is None:
        cells, values = np.empty((0, 3), np.int32), np.empty(0, table.dtype)
    by_height = np.argsort(cells[:, 2], kind="stable")
    cells, values = cells[by_height], values[by_height]

    def blocks() -> Iterator[bytes]:
        for low, layers in grid.owners.layers(table):
            first, stop = np.searchsorted(cells[:, 2], (low, low + len(layers)))
            i, j, k = cells[first:stop].T
            layers[k - low, j, i] = values[first:stop]
            for layer in layers:
                yield layer.astype(dtype, copy=False).tobytes()

    return _Array(f'DataArray type="{_VTK_TYPES[dtype.str]}" Name="{name}"', block * z, block, blocks)


def _fields(grid: VoxelGrid) -> list[_Array]:
    origin = np.array(grid.origin_m, "<f8").tobytes()
    element = 'DataArray type="Float64" Name="source_origin_m" NumberOfComponents="3" NumberOfTuples="1"'
    texts = {name: [of(part) for part in grid.parts] for name, of in _TEXTS.items()}
    texts["georeference"] = [f"{key}={value}" for key, value in sorted(grid.georeference.items())]
    return [
        _Array(element, len(origin), len(origin), lambda: [origin]),
        *(_strings(name, lines) for name, lines in texts.items() if lines),
    ]


def _strings(name: str, lines: list[str]) -> _Array:
    data = "".join(line.replace("\0", " ") + "\0" for line in lines).encode()
    return _Array(
        f'Array type="String" Name="{name}" NumberOfTuples="{len(lines)}"', len(data), len(data), lambda: [data]
    )


def _numbers(values: Iterable[float]) -> str:
    return " ".join(repr(float(n)) for n in values)
