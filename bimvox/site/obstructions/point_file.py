"""Reader of point clouds: PLY (text and binary), plain text tables (XYZ, CSV, PTS), LAS and LAZ."""

from __future__ import annotations

import io
import re
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bimvox.bim.mesh.ply import ply_header
from bimvox.errors import FileError
from bimvox.files import read_input, require_input
from bimvox.site.obstructions.esri_grid import is_esri_grid, read_esri_grid
from bimvox.site.obstructions.las_file import crs_of_las, read_las

_HINT = "write x, y and z in this order, separated by spaces or semicolons, with decimal points or commas"
_AMBIGUOUS_HINT = "separate the columns by semicolons, and write one decimal mark and no thousands separators"
_WORD = re.compile(rb"(?i)(?!nan|inf)[a-z_/]{2,}|[xyzXYZ/]")
_BY_COMMA = re.compile(rb"[+-]?\d{1,3}(,\d{3})+(\.\d*)?")
"""A number whose thousands are grouped by commas."""
_BY_POINT = re.compile(rb"[+-]?\d{1,3}(\.\d{3})+(,\d*)?")
"""A number whose thousands are grouped by points."""
_COMMA_DECIMAL = re.compile(rb"[+-]?\d*(,\d*)?([eE][+-]?\d+)?")
_POINT_DECIMAL = re.compile(rb"[+-]?\d*(\.\d*)?([eE][+-]?\d+)?")
_GAP = re.compile("(?<=\\d)(?: |'|\u2019|\u00a0|\u202f)(?=\\d{3}(?!\\d))".encode())
"""Between thousands: a space or an apostrophe."""


def read_table(path: Path, data: bytes) -> NDArray[np.float64]:
    """Return the points of a text table whose first three columns are x, y, z.

    Spaces, tabs, semicolons or commas separate the columns. Decimals have a point or, if something else separates, a
    comma. Thousands may be grouped if every number of the file can be read in one way only. Lines that start with ``#``
    and one heading line are ignored.

    Returns:
        (N, 3) float64.

    Raises:
        FileError: If a line is not a row of numbers, or can be read in two ways; names the line.
    """
    heading, text, row, lines_before = _opened(data)
    if not row:
        return np.zeros((0, 3))
    mark = _separator(path, row, lines_before + 1)
    if mark == b",":
        _insist_on_columns(path, heading, text, lines_before)
        return numbers_in(path, text.replace(b",", b" "), [0, 1, 2], lines_before)
    if mark == b" ":
        text = re.sub(rb",(?=\s)", b" ", text)
    grouped = mark == b";" and _GAP.search(text)
    if grouped or (b"," in text and (b"." in text or re.search(rb",[^\s;,]*,", text))):
        text = _with_points(path, text, mark, lines_before)
    return numbers_in(path, text.replace(b",", b".").replace(b";", b" "), [0, 1, 2], lines_before)


def _table_in_words(path: Path, data: bytes) -> str:
    """Return how a table is read: what separates its columns, and its decimal mark."""
    _, text, row, lines_before = _opened(data)
    mark = _separator(path, row, lines_before + 1)
    words = {b";": "semicolons", b",": "commas", b" ": "spaces or tabs"}[mark]
    body = re.sub(rb",(?=\s)", b" ", text) if mark == b" " else text
    if mark == b"," or b"," not in body:
        return f"columns separated by {words}, decimal points"
    if b"." not in body:
        return f"columns separated by {words}, decimal commas"
    return f"columns separated by {words}, grouped thousands"


def numbers_in(path: Path, text: bytes, columns: list[int], lines_before: int = 0) -> NDArray[np.float64]:
    """Return columns of a table of numbers with decimal points, separated by whitespace.

    ``columns``: indices of the columns; ``lines_before``: lines of the file before the table.

    Raises:
        FileError: If a line lacks a number in one of the columns; names the line.
    """
    if not text.strip():
        return np.zeros((0, len(columns)))
    try:
        return np.loadtxt(io.BytesIO(text), dtype=np.float64, usecols=columns, ndmin=2)
    except (ValueError, IndexError):
        wrong = _first_wrong(text, columns)
        if wrong is None:
            raise FileError(path, "not a table of numbers") from None
        number, line = wrong
        said = f"not a table of numbers: line {number + lines_before} is {_shown(line)}"
        raise FileError(path, said, hint=_HINT) from None


def _first_wrong(text: bytes, columns: list[int]) -> tuple[int, bytes] | None:
    """Return number and content of the first line that lacks a number in one of the columns."""
    for number, line in enumerate(io.BytesIO(text), start=1):
        fields = line.partition(b"#")[0].split()
        try:
            _ = [float(fields[column]) for column in columns if fields]
        except (ValueError, IndexError):
            return number, line.strip()
    return None


def _opened(data: bytes) -> tuple[bytes, bytes, bytes, int]:
    """Return heading, text after it without quotes, first row, and how many lines are before the text."""
    heading, text, lines_before = _without_heading(data.removeprefix(b"\xef\xbb\xbf"))
    if b'"' in _first_row(text):
        text = text.replace(b'","', b";").replace(b'"', b"")
    return heading, text, _first_row(text), lines_before


def _without_heading(text: bytes) -> tuple[bytes, bytes, int]:
    """Return the heading (empty if there is none), the text after it, and how many lines are before that."""
    start, lines = 0, 0
    while start < len(text):
        end = text.find(b"\n", start)
        end = len(text) if end < 0 else end
        line = text[start:end].strip()
        start, lines = end + 1, lines + 1
        if line and not line.startswith(b"#"):
            # Names of the columns, or the number of points (PTS).
            if _WORD.search(line) or len(re.split(rb"[\s,;]+", line)) == 1:
                return line, text[start:], lines
            break
    return b"", text, 0


def _first_row(text: bytes) -> bytes:
    lines = (line.strip() for line in io.BytesIO(text))
    return next((line for line in lines if line and not line.startswith(b"#")), b"")


def _separator(path: Path, row: bytes, number: int) -> bytes:
    """Return what separates the columns of a table with this first row: ``;``, a space (any whitespace) or a comma."""
    if b";" in row:
        return b";"
    fields = row.split()
    given = [field.rstrip(b",") for field in fields[:3]]
    if len(given) < 3:
        return b","
    if not any(b"," in field for field in given):
        return b"," if any(b"," in field for field in fields[:3]) else b" "
    if all(_BY_COMMA.fullmatch(one) or _POINT_DECIMAL.fullmatch(one) for one in given):
        if given[0].count(b",") > 1 and not any(b"." in field for field in given):
            raise _ambiguous(path, number, row, "its commas separate columns or thousands")
        return b" "
    if all(_BY_POINT.fullmatch(one) or _COMMA_DECIMAL.fullmatch(one) for one in given):
        return b" "
    both = [one for one in given if b"," in one and b"." in one]
    return b" " if any(_BY_COMMA.fullmatch(one) or _BY_POINT.fullmatch(one) for one in both) else b","


def _insist_on_columns(path: Path, heading: bytes, text: bytes, lines_before: int) -> None:
    """Refuse a table in which only commas stand between digits, if they may be decimal commas too."""
    if b"." in text:
        return
    names = heading.count(b",") + 1 if b"," in heading else 0
    first = 0
    for number, line in enumerate(io.BytesIO(text), start=lines_before + 1):
        row = line.partition(b"#")[0].strip().rstrip(b",")
        if not row:
            continue
        count = row.count(b",") + 1
        first = first or count
        if count != first or (names and count > names) or (not names and count > 5 and row.count(b" ") == 0):
            raise _ambiguous(path, number, row, "its commas separate columns or decimals")


def _with_points(path: Path, text: bytes, mark: bytes, lines_before: int) -> bytes:
    """Return the first three columns of a table with decimal points; raise if a number can be read in two ways."""
    rows = [_columns(line, mark) for line in io.BytesIO(text)]
    given = [(number, one) for number, row in enumerate(rows, start=lines_before + 1) for one in row]
    commas = [(number, one) for number, one in given if _proves(one, b",", b".", _BY_POINT)]
    points = [(number, one) for number, one in given if _proves(one, b".", b",", _BY_COMMA)]
    if commas and points:
        number, one = max(commas[0], points[0])
        other = min(commas[0], points[0])[1]
        said = f"{_shown(one)} and {_shown(other)} have different decimal marks"
        raise _ambiguous(path, number, b" ".join(rows[number - lines_before - 1]), said)
    has_commas = bool(commas) or not points
    grouping, decimal = (b".", b",") if has_commas else (b",", b".")
    grouped, plain = (_BY_POINT, _COMMA_DECIMAL) if has_commas else (_BY_COMMA, _POINT_DECIMAL)
    # Without a number such as 405.123,45 or 5.812.000, a group of three may as well be three decimals.
    proven = any(grouping in one and (decimal in one or one.count(grouping) > 1) for _, one in given)
    for number, one in given:
        if grouping in one and not (proven and grouped.fullmatch(one)):
            said = f"{_shown(one)} has a thousands separator or another decimal mark"
            raise _ambiguous(path, number, b" ".join(rows[number - lines_before - 1]), said)
        if not (grouped.fullmatch(one) or plain.fullmatch(one)):
            said = f"not a table of numbers: line {number} is {_shown(b' '.join(rows[number - lines_before - 1]))}"
            raise FileError(path, said, hint=_HINT)
    return b"\n".join(b" ".join(row).replace(grouping, b"").replace(decimal, b".") for row in rows)


def _columns(line: bytes, mark: bytes) -> list[bytes]:
    """Return the first three columns of a line, without gaps between thousands."""
    row = line.partition(b"#")[0].strip()
    if mark != b";":
        return row.split()[:3]
    return [_GAP.sub(b"", one.strip()) for one in row.split(b";")[:3]] if row else []


def _proves(one: bytes, decimal: bytes, other: bytes, grouped: re.Pattern[bytes]) -> bool:
    """Return whether a number shows that a mark separates the decimals: only then it can be read."""
    if decimal in one and other in one:
        return one.rfind(decimal) > one.rfind(other)
    if other in one:
        return one.count(other) > 1 and bool(grouped.fullmatch(one))
    by_this = _BY_COMMA if decimal == b"," else _BY_POINT
    return one.count(decimal) == 1 and not by_this.fullmatch(one)


def _ambiguous(path: Path, number: int, row: bytes, said: str) -> FileError:
    return FileError(path, f"line {number} can be read in two ways, {_shown(row)}: {said}", hint=_AMBIGUOUS_HINT)


def _shown(row: bytes) -> str:
    return repr(row.decode(errors="replace")[:60])


_LAS = (".las", ".laz")
SCAN_SUFFIXES = (".xyz", ".pts", ".asc", ".csv", ".txt", *_LAS)
"""Suffixes of files that hold only a point cloud or an ESRI grid; a PLY file may also hold one."""
_KNOWN = (".ply", *SCAN_SUFFIXES)


def read_points(path: Path, metres_per_unit: float = 1.0) -> NDArray[np.float64]:
    """Return the points of a file.

    Args:
        path: A PLY file with x, y, z vertices, a LAS or LAZ file (LAZ needs the extra ``scan``), or a text table whose
            first three columns are x, y, z, as :func:`read_table` reads it.
        metres_per_unit: Its unit, if the file does not state one; only LAS and LAZ files may.

    Returns:
        (N, 3) float64, N >= 1, metres.

    Raises:
        FileError: If the file cannot be read, is truncated, or holds no points.
    """
    if path.suffix.lower() in _LAS:
        return _checked(path, read_las(path, metres_per_unit))
    if path.suffix.lower() not in _KNOWN:
        raise FileError(path, "unknown type of point file", hint=f"known: {', '.join(_KNOWN)}")
    data = read_input(path, may_be_empty=True)
    points = _ply(path, data) if path.suffix.lower() == ".ply" else read_table(path, data)
    return _checked(path, points if metres_per_unit == 1.0 else points * metres_per_unit)


def scan_in_words(path: Path) -> str:
    """Return how a scan is read, or an ESRI grid: its unit, what separates its columns, its cells."""
    if is_esri_grid(path):
        return str(read_esri_grid(path))
    kind = path.suffix.lower()
    if kind in _LAS:
        return f"{kind[1:].upper()}, {crs_of_las(path)}"
    return "PLY" if kind == ".ply" else f"table, {_table_in_words(path, read_input(path))}"


def is_scan(path: Path) -> bool:
    """Return whether a file holds points and no faces: by its suffix, or by the header of a PLY file."""
    if path.suffix.lower() != ".ply":
        return path.suffix.lower() in SCAN_SUFFIXES
    try:
        with require_input(path).open("rb") as stream:
            head = stream.read(1 << 16).partition(b"end_header")[0]
    except (FileError, OSError):
        return False
    faces = [line.split() for line in head.splitlines() if line.startswith(b"element face")]
    return head.startswith(b"ply") and all(words[-1] == b"0" for words in faces)


def _checked(path: Path, points: NDArray[np.float64]) -> NDArray[np.float64]:
    if len(points) == 0:
        raise FileError(path, "holds no points")
    if not np.isfinite(points).all():
        raise FileError(path, f"point {int(np.argmin(np.isfinite(points).all(axis=1)))} is not finite")
    return points


def _ply(path: Path, data: bytes) -> NDArray[np.float64]:
    is_text, elements, start = ply_header(path, data)
    if not elements or elements[0].name != "vertex":
        raise FileError(path, "not a PLY file of points (its first element must be vertex)")
    vertex, count = elements[0], elements[0].count
    names = [item.name for item in vertex.properties]
    if not {"x", "y", "z"} <= set(names) or len(set(names)) < len(names) or vertex.lists:
        raise FileError(path, "its vertices lack x, y, z, or have a list or two properties of one name")
    if is_text:
        text = data[start:].splitlines()[:count]
        if len(text) < count:
            raise FileError(path, f"truncated: {len(text)} of {count} points")
        return numbers_in(path, b"\n".join(text), [names.index(axis) for axis in "xyz"])
    dtype = np.dtype([(item.name, item.type) for item in vertex.properties])
    if len(data) - start < count * dtype.itemsize:
        raise FileError(path, f"truncated: {(len(data) - start) // dtype.itemsize} of {count} points")
    rows = np.frombuffer(data, dtype, count, start)
    return np.stack([rows[axis].astype(np.float64) for axis in "xyz"], axis=1)
