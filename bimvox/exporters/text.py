"""Names from a model in other people's formats: no control characters, no formulas in CSV."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Iterable

_NOT_XML = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
_DECIMALS = 6
_FORMULA = ("=", "+", "-", "@", "\t", "\r")


def for_xml(text: str) -> str:
    """Return a text in which what XML 1.0 cannot hold is written as an escape."""
    return _NOT_XML.sub(lambda found: f"\\x{ord(found[0]):02x}", text)


def for_csv(value: object) -> object:
    """Return a value for a CSV cell: control characters escaped, an apostrophe before what would be a formula.

    Numbers have at most six decimals: micrometres, microseconds and microradians.
    """
    if isinstance(value, float):
        return round(value, _DECIMALS) + 0.0  # no negative zero
    if not isinstance(value, str):
        return value
    return for_xml(f"'{value}" if value.startswith(_FORMULA) else value)


def table(columns: Iterable[str], rows: Iterable[Iterable[object]]) -> str:
    """Return a table as CSV: its head, and the rows with values as ``for_csv`` has them."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(columns)
    writer.writerows([for_csv(value) for value in row] for row in rows)
    return text.getvalue()
