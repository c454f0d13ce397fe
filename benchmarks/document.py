"""Inserts the output of a benchmark into its page."""

from __future__ import annotations

from pathlib import Path

MEASURED = Path(__file__).parents[1] / "docs" / "data" / "measured.txt"
"""Has the tables of several benchmarks, behind docs/measured.md."""


def put_into(document: Path, name: str, text: str) -> None:
    """Replace the text between a benchmark's two markers in a document.

    Args:
        document: A page with ``<!-- NAME: begin -->`` and ``<!-- NAME: end -->``.
        name: The benchmark, by the name of its Makefile target.
        text: The new text.

    Raises:
        ValueError: If the document lacks a marker.
    """
    begin, end = f"<!-- {name}: begin -->", f"<!-- {name}: end -->"
    before, found_begin, rest = document.read_text(encoding="utf-8").partition(begin)
    _, found_end, after = rest.partition(end)
    if not (found_begin and found_end):
        raise ValueError(f"{document.name} lacks the markers {begin} and {end}")
    document.write_text(f"{before}{begin}\n{text.rstrip()}\n{end}{after}", encoding="utf-8")
