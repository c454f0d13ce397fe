"""What a command measured, written into the page that speaks of it, between two markers."""

from __future__ import annotations

from pathlib import Path

DOCS = Path(__file__).parents[1] / "docs"


def write_section(page: str, name: str, text: str) -> None:
    """Replace what stands between a page's markers of a name.

    Args:
        page: Name of the page in ``docs``.
        name: Of the markers ``<!-- name: begin -->`` and ``<!-- name: end -->``.
        text: Markdown.
    """
    file = DOCS / page
    begin, end = f"<!-- {name}: begin -->", f"<!-- {name}: end -->"
    before, _, rest = file.read_text().partition(begin)
    _, _, after = rest.partition(end)
    file.write_text(f"{before}{begin}\n\n{text.strip()}\n\n{end}{after}")
