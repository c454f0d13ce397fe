"""The types of a model as a CSV table, in which a person writes what is wrong."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from bimvox.errors import FileError
from bimvox.exporters.text import table
from bimvox.files import check_output, write_atomically
from bimvox.site.config.kind_file import SELECT, SET_KIND, SET_MEANS

_COLUMNS = ("ifc_class", "type", "material", "kind", "means")
_BYTE_ORDER_MARK = b"\xef\xbb\xbf"
"""Without it, spreadsheets do not see that the text is UTF-8."""


def check_kind_file(path: Path, inputs: Sequence[Path]) -> None:
    """Refuse to write a file of kinds over another one, which may hold corrections.

    Raises:
        FileError: If it exists already, or cannot be written.
    """
    check_output(path, inputs=inputs)
    if path.exists():
        raise FileError(path, "exists already and may hold your corrections", hint="name another file")


def write_kind_file(
    path: Path,
    rows: Sequence[Mapping[str, Any]],
    corrections: Sequence[Mapping[str, Any]],
    inputs: Sequence[Path],
) -> None:
    """Write the rows of a model's types; the columns ``set_kind`` and ``set_means`` are for a person.

    They hold what the site file says already, so that the table can take its place.

    Args:
        path: The file.
        rows: The ``kinds`` of a document.
        corrections: The ``corrections`` of a site's document; those of no row are rows of their own.
        inputs: Files that must not be overwritten.
    """
    said: dict[str, dict[str, Any]] = {}
    for one in corrections:
        own = said.setdefault(one["select"], {SET_KIND: "", SET_MEANS: ""})
        own |= {key: one[name] for key, name in ((SET_KIND, "kind"), (SET_MEANS, "means")) if one[name]}
    columns = (SET_KIND, SET_MEANS, "parts", *_COLUMNS, "from_kg", "to_kg", "confidence", "kind_from", SELECT)
    body = [
        (*_said(said, row["select"]), row["count"], *(row[key] for key in _COLUMNS), *map(round, row["mass_kg"] or ()),
         *("",) * (0 if row["mass_kg"] else 2),
         row["confidence"], row["kind_from"], row["select"])
        for row in rows
    ]  # fmt: skip
    shown = {row["select"] for row in rows}
    empty = ("",) * (len(columns) - 3)
    body += [(*_said(said, select), *empty, select) for select in said if select not in shown]
    write_atomically(path, _BYTE_ORDER_MARK + table(columns, body).encode(), inputs=inputs)


def _said(said: Mapping[str, Mapping[str, Any]], select: str) -> tuple[str, str]:
    own = said.get(select, {})
    return own.get(SET_KIND, ""), own.get(SET_MEANS, "")
