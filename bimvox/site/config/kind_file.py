"""The file of kinds: a CSV table of types, in which a person writes what the parts are, in any spreadsheet."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TypeVar

from bimvox.bim.kinds.kind import WAYS, Correction, Kind
from bimvox.errors import ConfigError, shown
from bimvox.site.config.validation import nearest

SELECT, SET_KIND, SET_MEANS = "select", "set_kind", "set_means"
"""The columns that are read; all others are for people."""
_DELIMITERS = ";\t,"
_MOST_SHOWN = 5
_MOST_ROWS = 10_000
_SAID = {"hand": "by_hand", "cast": "in_situ", "built_in_place": "built", "unknown": "other"}
"""Words of the printed table for the values of the site file."""
_COLUMNS_HINT = (
    f"keep the columns {SELECT}, {SET_KIND} and {SET_MEANS}, as `bimvox inspect MODEL --csv FILE` writes them"
)
_T = TypeVar("_T", bound=str)


def corrections_in(data: bytes | None, path: Path) -> tuple[Correction, ...]:
    """Return the rows of a file of kinds in which a person has written something.

    Columns are separated by commas, semicolons or tabs; the text is UTF-8, UTF-16 or Windows-1252, as spreadsheets
    write it.

    ``data``: its bytes; None if it is missing.

    Raises:
        ConfigError: If it is missing or not such a table; names each bad row by line and column.
    """
    if data is None:
        raise ConfigError(path, None, "no such file", hint="put it next to the site file")
    text = _decoded(data)
    lines = text.splitlines()
    if lines and lines[0].lower().startswith("sep="):  # a line for Excel
        text = text.split("\n", 1)[1] if "\n" in text else ""
        skipped = 1
    else:
        skipped = 0
    head = text.split("\n", 1)[0]
    rows = csv.reader(io.StringIO(text, newline=""), delimiter=max(_DELIMITERS, key=head.count))
    try:
        found = _Rows(path, next(rows, []), skipped)
        for row in rows:
            found.add(row, rows.line_num + skipped)
    except csv.Error as error:
        raise ConfigError(
            path, f"line {rows.line_num + skipped}", f"cannot be read: {error}", hint=_COLUMNS_HINT
        ) from None
    return found.corrections()


class _Rows:
    """The rows of a file: corrections, and what is wrong."""

    def __init__(self, path: Path, head: Sequence[str], skipped: int) -> None:
        self._path = path
        self._columns = {name.strip().lower(): index for index, name in enumerate(head)}
        missing = [name for name in (SELECT, SET_KIND, SET_MEANS) if name not in self._columns]
        if missing:
            said = f"has no column {' and no column '.join(missing)}"
            raise ConfigError(path, f"line {1 + skipped}", said, hint=_COLUMNS_HINT)
        self._found: dict[str, tuple[int, Correction]] = {}
        self._wrong: list[tuple[str, str]] = []

    def add(self, row: Sequence[str], line: int) -> None:
        """Take a row, which ends in a line."""
        cells = {name: row[index].strip() if index < len(row) else "" for name, index in self._columns.items()}
        if not (cells[SET_KIND] or cells[SET_MEANS]):
            return
        select = cells[SELECT].removeprefix("'")
        kind = self._value(cells, SET_KIND, list(Kind), line)
        means = self._value(cells, SET_MEANS, WAYS, line)
        if not select:
            self._wrong.append((f"line {line}, column {SELECT}", "it is empty: keep what bimvox wrote there"))
            return
        correction = Correction(select, kind, means, f"{self._path}: line {line}")
        earlier_line, earlier = self._found.get(select, (line, correction))
        if (earlier.kind, earlier.means) != (kind, means):
            said = (
                f"line {earlier_line} says something else of the same type: write the same in both, or leave one empty"
            )
            self._wrong.append((f"line {line}", said))
        self._found[select] = (line, correction)
        if len(self._found) > _MOST_ROWS:
            raise ConfigError(self._path, f"line {line}", f"more than {_MOST_ROWS:,} rows say something")

    def _value(self, cells: Mapping[str, str], column: str, allowed: Sequence[_T], line: int) -> _T | None:
        """Return the value of a cell; None if it is empty or wrong."""
        word = cells[column].lower().replace(" ", "_").replace("-", "_")
        word = _SAID.get(word, word)
        if not word or word in allowed:
            return next((one for one in allowed if one == word), None)
        near = nearest(word, allowed)
        said = f"{shown(cells[column])} is not one of {', '.join(allowed)}"
        self._wrong.append((f"line {line}, column {column}", f"{said}; did you mean {near}?" if near else said))
        return None

    def corrections(self) -> tuple[Correction, ...]:
        """Return the corrections; raise an error about the rows that are wrong."""
        if not self._wrong:
            return tuple(correction for _, correction in self._found.values())
        (where, said), more = self._wrong[0], list(self._more())
        raise ConfigError(
            self._path, where, "\n  ".join([said, *more]), hint="correct the cells and save the file as CSV"
        )

    def _more(self) -> Iterator[str]:
        yield from (f"{where}: {said}" for where, said in self._wrong[1:_MOST_SHOWN])
        if len(self._wrong) > _MOST_SHOWN:
            yield f"and {len(self._wrong) - _MOST_SHOWN:,} more rows"


def _decoded(data: bytes) -> str:
    if data.startswith((b"\xff\xfe", b"\xfe\xff")):
        return data.decode("utf-16", errors="replace")
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return data.decode("cp1252", errors="replace")
