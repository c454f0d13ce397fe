"""Elements of SVG, with escaped text, so that names from files stay text."""

from __future__ import annotations

from collections.abc import Iterable

from bimvox.rendering.plain import escape


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
