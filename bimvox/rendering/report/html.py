"""Elements of HTML. Every text is escaped, and every number carries its exact value.

``<data value="...">`` is HTML's element for a number with its machine-readable value, so that a program reads the
numbers of the log, not rounded ones.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

from bimvox.rendering.report.words import fixed
from bimvox.rendering.words import escape


def number(value: float | int | None, words: str, key: str = "") -> str:
    """Return a number as people read it, with its exact value and a key for programs; a dash if it is None."""
    if value is None:
        return '<span class="none">–</span>'
    marked = f' data-key="{escape(key)}"' if key else ""
    return f'<data value="{value!r}"{marked}>{escape(words)}</data>'


def value(record: Mapping[str, Any], key: str, words: Callable[[Any], str] | int, unit: str = "") -> str:
    """Return a number of a record with its unit, by a function or with this many decimals; see ``number``."""
    known = record[key]
    if known is None:
        return number(None, "")
    return number(known, (fixed(known, words) if isinstance(words, int) else words(known)) + unit, key)


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


# Elements of SVG, with escaped text, so that names from files stay text.


def element(name: str, *children: str, **attributes: object) -> str:
    """Return an element; ``class_`` is ``class``, underscores are hyphens, numbers are short, None is left out."""
    written = "".join(
        f' {key.rstrip("_").replace("_", "-")}="{escape(_value(value))}"'
        for key, value in attributes.items()
        if value is not None
    )
    inside = "".join(children)
    return f"<{name}{written}>{inside}</{name}>" if inside else f"<{name}{written}/>"


def text(words: str, x: float, y: float, **attributes: object) -> str:
    """Return text at a point."""
    return element("text", escape(words), x=x, y=y, **attributes)


def picture(width: float, height: float, title: str, parts: Iterable[str], class_: str) -> str:
    """Return a drawing of this size in user units, scaled to its container, with a title for screen readers."""
    return element(
        "svg",
        element("title", escape(title)),
        *parts,
        viewBox=f"0 0 {_value(width)} {_value(height)}",
        role="img",
        class_=class_,
    )


def ticks(low: float, high: float, most: int, steps: tuple[float, ...]) -> list[float]:
    """Return round values from low to high: multiples of the smallest step that gives at most ``most`` values."""
    step = next((step for step in steps if (high - low) / step <= most), steps[-1])
    first = -(-low // step)
    values = []
    while first * step <= high + 1e-9 * step:
        values.append(first * step + 0.0)  # never -0
        first += 1
    return values


def _value(value: object) -> str:
    return f"{value:.2f}".rstrip("0").rstrip(".") if isinstance(value, float) else str(value)
