"""Elements of HTML. Every text is escaped, and every number carries its exact value.

``<data value="...">`` is HTML's element for a number with its machine-readable value, so that a program reads the
numbers of the log, not rounded ones.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from bimvox.rendering.plain import escape


def number(value: float | int | None, words: str, key: str = "") -> str:
    """Return a number as people read it, with its exact value and a key for programs; a dash if it is None."""
    if value is None:
        return '<span class="none">–</span>'
    marked = f' data-key="{escape(key)}"' if key else ""
    return f'<data value="{value!r}"{marked}>{escape(words)}</data>'


def tag(name: str, inside: str, class_: str = "", **attributes: str) -> str:
    """Return an element around HTML that is already escaped."""
    if class_:
        attributes = {"class": class_, **attributes}
    written = "".join(f' {key.replace("_", "-")}="{escape(value)}"' for key, value in attributes.items())
    return f"<{name}{written}>{inside}</{name}>"


def section(title: str, *inside: str, class_: str = "", **attributes: str) -> str:
    """Return a section with its heading, around HTML that is already escaped."""
    return tag("section", f"<h2>{title}</h2>" + "".join(inside), class_, **attributes)


def paragraph(words: str, class_: str = "") -> str:
    """Return a paragraph of plain text."""
    return tag("p", escape(words), class_)


def terms(pairs: Iterable[tuple[str, str]]) -> str:
    """Return a list of terms with values that are already escaped; empty ones are left out."""
    return tag("dl", "".join(f"<div><dt>{escape(name)}</dt><dd>{value}</dd></div>" for name, value in pairs if value))


def table(columns: Sequence[str], rows: Iterable[str], *, class_: str = "", caption: str = "", id_: str = "") -> str:
    """Return a table; its head is repeated on every printed page.

    Headings are plain text with line breaks, rows are escaped ``<tr>`` elements, the caption is for screen readers.
    """
    head = "".join(f'<th scope="col">{escape(name).replace(chr(10), "<br>")}</th>' for name in columns)
    words = f'<caption class="unseen">{escape(caption)}</caption>' if caption else ""
    attributes = {"id": id_} if id_ else {}
    return tag("table", f"{words}<thead><tr>{head}</tr></thead><tbody>{''.join(rows)}</tbody>", class_, **attributes)


def row(cells: Iterable[str], class_: str = "", **attributes: str) -> str:
    """Return a row of cells that are already escaped; the first is its heading."""
    first, *rest = cells
    inside = f'<th scope="row">{first}</th>' + "".join(f"<td>{cell}</td>" for cell in rest)
    return tag("tr", inside, class_, **attributes)
