"""Reader of ESRI ASCII grids: heights of a surface, as an obstruction that is solid below it."""

from __future__ import annotations

import io
import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bimvox.bim.building import TriangleMesh
from bimvox.errors import FileError
from bimvox.files import read_input, require_input

_KEYS = ("ncols", "nrows", "xllcorner", "xllcenter", "yllcorner", "yllcenter", "cellsize", "dx", "dy", "nodata_value")
_ALSO = {"nodata": "nodata_value", "xllcentre": "xllcenter", "yllcentre": "yllcenter"}
_NO_DATA = -9999.0
_MOST_CELLS = 250_000
"""So many cells are a mesh that is put into cells of the site within ten seconds."""
_DEEP_M = 1.0
"""The solid reaches so far below the lowest height."""
_HINT = "export the grid again as ESRI ASCII: keys ncols, nrows, xllcorner, yllcorner, cellsize, then rows of heights"


@dataclass(frozen=True, slots=True, eq=False)
class _EsriGrid:
    """Heights in square or rectangular cells, in the file's unit.

    Attributes:
        x: West border.
        y: South border.
        dx: Size of a cell from west to east.
        dy: Size of a cell from south to north.
        heights: (rows, columns) float64, the northernmost row first; NaN without a height.
    """

    x: float
    y: float
    dx: float
    dy: float
    heights: NDArray[np.float64]

    def __str__(self) -> str:
        """Return it as ``inspect`` shows it."""
        rows, columns = self.heights.shape
        empty = int(np.isnan(self.heights).sum())
        size = f"{self.dx:g}" if self.dx == self.dy else f"{self.dx:g} x {self.dy:g}"
        return f"ESRI grid of {columns:,} x {rows:,} cells, {size} each" + (f", {empty:,} empty" if empty else "")


def is_esri_grid(path: Path) -> bool:
    """Return whether a file begins like an ESRI ASCII grid: with one of its keys."""
    if path.suffix.lower() not in (".asc", ".txt", ".xyz", ".csv"):
        return False
    try:
        with require_input(path).open("rb") as stream:
            words = stream.read(1 << 12).removeprefix(b"\xef\xbb\xbf").replace(b"=", b" ").split(None, 1)
    except (FileError, OSError):
        return False  # the reader says why
    return bool(words) and _key(words[0]) in _KEYS


def surface_of(path: Path, metres_per_unit: float = 1.0) -> TriangleMesh:
    """Return the solid below the heights of an ESRI ASCII grid, metres.

    Each cell is an upright block up to its height; together they reach 1 m below the lowest one.

    Raises:
        FileError: If the file is damaged, or has too many cells.
    """
    grid = read_esri_grid(path)
    there = ~np.isnan(grid.heights)
    if there.sum() > _MOST_CELLS:
        hint = "cut it to the surroundings of the site, or make its cells larger"
        raise FileError(path, f"an ESRI grid of {int(there.sum()):,} heights, at most {_MOST_CELLS:,}", hint=hint)
    rows, columns = grid.heights.shape
    bottom = np.nanmin(grid.heights) - _DEEP_M / metres_per_unit
    # From south to north; around it nothing, which is as high as the bottom.
    level = np.full((rows + 2, columns + 2), bottom)
    level[1:-1, 1:-1] = np.where(there, grid.heights, bottom)[::-1]
    x = grid.x + grid.dx * np.arange(columns + 1)
    y = grid.y + grid.dy * np.arange(rows + 1)
    j, i = np.nonzero(there[::-1])
    z, low = level[j + 1, i + 1], np.full(len(i), bottom)
    quads = [
        _quads((x[i], y[j], z), (x[i + 1], y[j], z), (x[i + 1], y[j + 1], z), (x[i], y[j + 1], z)),
        _quads((x[i], y[j], low), (x[i], y[j + 1], low), (x[i + 1], y[j + 1], low), (x[i + 1], y[j], low)),
    ]
    # Between two cells, the wall from the lower level to the higher one faces the lower cell.
    j, i = np.nonzero(level[1:-1, :-1] != level[1:-1, 1:])
    a, b = level[j + 1, i], level[j + 1, i + 1]
    quads.append(_quads((x[i], y[j], b), (x[i], y[j + 1], b), (x[i], y[j + 1], a), (x[i], y[j], a)))
    j, i = np.nonzero(level[:-1, 1:-1] != level[1:, 1:-1])
    a, b = level[j, i + 1], level[j + 1, i + 1]
    quads.append(_quads((x[i], y[j], a), (x[i + 1], y[j], a), (x[i + 1], y[j], b), (x[i], y[j], b)))
    corners = np.concatenate(quads) * metres_per_unit
    faces = 4 * np.arange(len(corners))[:, None, None] + np.array([[0, 1, 2], [0, 2, 3]])
    return TriangleMesh(corners.reshape(-1, 3), faces.reshape(-1, 3).astype(np.int32))


_Corner = tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]


def _quads(*corners: _Corner) -> NDArray[np.float64]:
    """Return (N, 4, 3) corners of four-sided faces."""
    return np.stack([np.stack(corner, axis=1) for corner in corners], axis=1)


def read_esri_grid(path: Path) -> _EsriGrid:
    """Return the heights of an ESRI ASCII grid.

    Its keys come in any order and case, and decimals may have a comma.

    Raises:
        FileError: If a key is missing or wrong, or a height is; names the line.
    """
    lines = read_input(path).removeprefix(b"\xef\xbb\xbf").splitlines()
    given, start = _head(path, lines)
    columns, rows = (_whole(path, given, key) for key in ("ncols", "nrows"))
    dx, dy = (_size(path, given, key) for key in ("dx", "dy"))
    x, y = (_border(path, given, axis, size) for axis, size in (("x", dx), ("y", dy)))
    heights = _heights(path, lines, start, columns, rows)
    no_data = given.get("nodata_value", (_NO_DATA, 0))[0]
    # The key is often rounded in another way than the heights.
    empty = np.isclose(heights, no_data, rtol=1e-6, atol=0.0) if math.isfinite(no_data) else ~np.isfinite(heights)
    heights[empty] = np.nan
    if np.isinf(heights).any():
        raise FileError(path, "an ESRI grid with an infinite height", hint=_HINT)
    if np.isnan(heights).all():
        raise FileError(path, f"an ESRI grid without a height: all {heights.size:,} cells are NODATA", hint=_HINT)
    return _EsriGrid(x, y, dx, dy, heights.reshape(rows, columns))


def _key(word: bytes) -> str:
    name = word.decode("ascii", "replace").lower().rstrip(":=")
    return _ALSO.get(name, name)


def _head(path: Path, lines: list[bytes]) -> tuple[dict[str, tuple[float, int]], int]:
    """Return the value and the line of each key, and the index of the first line of heights."""
    given: dict[str, tuple[float, int]] = {}
    for number, line in enumerate(lines, start=1):
        words = line.replace(b"=", b" ").split()
        if not words:
            continue
        if _number(words[0]) is not None and words[0].lower() != b"nodata":
            return given, number - 1
        key, value = _key(words[0]), _number(words[1]) if len(words) == 2 else None
        if key not in _KEYS:
            raise _wrong(path, number, line, f"{key[:30]!r} is not a key of an ESRI grid")
        if value is None:
            raise _wrong(path, number, line, f"{key} needs one number")
        if key in given:
            raise _wrong(path, number, line, f"{key} is already in line {given[key][1]}")
        given[key] = (value, number)
    raise FileError(path, "an ESRI grid that ends before its heights", hint=_HINT)


def _whole(path: Path, given: dict[str, tuple[float, int]], key: str) -> int:
    value, number = _given(path, given, key)
    if not (value >= 1 and value == int(value)):
        raise FileError(path, f"an ESRI grid whose {key} is {value:g} (line {number})", hint="give a whole number")
    return int(value)


def _size(path: Path, given: dict[str, tuple[float, int]], key: str) -> float:
    """Return the size of a cell along an axis: ``dx`` or ``dy``, otherwise ``cellsize``."""
    value, number = _given(path, given, key if key in given else "cellsize")
    if not 0.0 < value < math.inf:
        raise FileError(
            path, f"an ESRI grid whose cell size is {value:g} (line {number})", hint="give a length above 0"
        )
    return value


def _border(path: Path, given: dict[str, tuple[float, int]], axis: str, size: float) -> float:
    corner, centre = f"{axis}llcorner", f"{axis}llcenter"
    if corner in given and centre in given:
        said = f"an ESRI grid with {corner} (line {given[corner][1]}) and {centre} (line {given[centre][1]})"
        raise FileError(path, said, hint="give one of the two")
    if centre in given:
        return given[centre][0] - size / 2.0
    return _given(path, given, corner)[0]


def _given(path: Path, given: dict[str, tuple[float, int]], key: str) -> tuple[float, int]:
    if key not in given:
        raise FileError(path, f"an ESRI grid without {key}", hint=_HINT)
    value, number = given[key]
    if not math.isfinite(value):
        raise FileError(path, f"an ESRI grid whose {key} is {value} (line {number})", hint="give a finite number")
    return value, number


def _heights(path: Path, lines: list[bytes], start: int, columns: int, rows: int) -> NDArray[np.float64]:
    """Return all heights in their order; rows may be broken into lines in any way."""
    body = b"\n".join(lines[start:])
    if b"," in body:
        if b"." in body:
            number = next(n for n, line in enumerate(lines[start:], start + 1) if b"," in line)
            raise _wrong(path, number, lines[number - 1], "decimal points and commas in one file")
        body = body.replace(b",", b".")
    words = body.split()
    try:
        found = np.array(words, np.bytes_).astype(np.float64) if len(words) else np.zeros(0)
    except ValueError:
        for number, line in enumerate(lines[start:], start + 1):
            if (word := next((one for one in line.split() if _number(one) is None), None)) is not None:
                said = f"{word.decode(errors='replace')[:30]!r} is not a height"
                raise _wrong(path, number, line, said) from None
        raise FileError(path, "an ESRI grid with something that is not a height", hint=_HINT) from None
    if len(found) != rows * columns:
        said = f"an ESRI grid with {len(found):,} heights instead of {rows:,} x {columns:,}"
        for number, line in enumerate(io.BytesIO(b"\n".join(lines[start:])), start + 1):
            count = len(line.split())
            if count and count != columns:
                raise FileError(path, f"{said}: line {number} has {count:,}", hint=_HINT)
        raise FileError(path, said, hint=_HINT)
    return found


def _number(word: bytes) -> float | None:
    try:
        return float(word.replace(b",", b"."))
    except ValueError:
        return None


def _wrong(path: Path, number: int, line: bytes, said: str) -> FileError:
    text = line.strip().decode(errors="replace")[:60]
    return FileError(path, f"an ESRI grid whose line {number} is {text!r}: {said}", hint=_HINT)
