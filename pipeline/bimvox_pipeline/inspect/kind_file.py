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


def write_kind_file(path: Path, rows: Sequence[Mapping[str, Any]], inputs: Sequence[Path]) -> None:
    """Write the rows of a model's types; the columns ``set_kind`` and ``set_means`` are empty, for a person.

    Args:
        path: The file.
        rows: The ``kinds`` of a document.
        inputs: Files that must not be overwritten.
    """
    columns = (SET_KIND, SET_MEANS, "parts", *_COLUMNS, "from_kg", "to_kg", "confidence", "kind_from", SELECT)
    body = (
        ("", "", row["count"], *(row[key] for key in _COLUMNS), *map(round, row["mass_kg"]), row["confidence"],
         row["kind_from"], row["select"])
        for row in rows
    )  # fmt: skip
    write_atomically(path, _BYTE_ORDER_MARK + table(columns, body).encode(), inputs=inputs)
