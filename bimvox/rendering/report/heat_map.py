"""The map of crane hours: how long a machine takes from each place where its mast can stand."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray

from bimvox.rendering.report.drawing_file import style
from bimvox.rendering.report.html import element, text
from bimvox.rendering.words import escape

_WIDE_PX, _LEFT_PX, _TOP_PX, _LINE_PX = 900.0, 24.0, 64.0, 16.0
_SCALE: tuple[tuple[int, int, int], ...] = ((68, 1, 84), (59, 82, 139), (33, 145, 140), (94, 201, 98), (253, 231, 37))
"""Viridis (Smith and van der Walt): even steps of brightness, also for the colour-blind and in grey."""


@dataclass(frozen=True, slots=True, eq=False)
class HeatMap:
    """What the map shows; site metres.

    Attributes:
        title: Its title.
        places_m: (B, 2) places from which most parts are served.
        hours: (B,) crane hours from each.
        others_m: (M, 2) places from which fewer parts are served.
        building: Outlines of the parts.
        yards: Polygons of the yard.
        accesses: Polygons of the access.
        best_m: The place with the fewest hours.
        given_m: The place in the site file.
    """

    title: str
    places_m: NDArray[np.float64]
    hours: NDArray[np.float64]
    others_m: NDArray[np.float64]
    building: Sequence[Any]
    yards: Sequence[Sequence[tuple[float, float]]]
    accesses: Sequence[Sequence[tuple[float, float]]]
    best_m: tuple[float, float]
    given_m: tuple[float, ...]


def heat_map(shown: HeatMap) -> bytes:
    """Return the map as an SVG file, legible on light and on dark ground."""
    every_m = np.concatenate([shown.places_m, shown.others_m, [shown.given_m[:2]], *map(np.array, shown.yards)])
    (x0, y0), (x1, y1) = every_m.min(axis=0) - 3.0, every_m.max(axis=0) + 3.0
    px = (_WIDE_PX - 2.0 * _LEFT_PX) / max(x1 - x0, 1.0)
    high = _TOP_PX + (y1 - y0) * px + 4.0 * _LINE_PX

    def at(x: float, y: float) -> tuple[float, float]:
        return _LEFT_PX + (x - x0) * px, _TOP_PX + (y1 - y) * px

    def polygon(corners: Sequence[tuple[float, float]], **look: object) -> str:
        return element("polygon", points=" ".join(f"{u:.1f},{v:.1f}" for u, v in (at(*c[:2]) for c in corners)), **look)

    low_h, high_h = float(shown.hours.min(initial=np.inf)), float(shown.hours.max(initial=-np.inf))
    side = max(2.0, _pitch_m(every_m[: len(shown.places_m) + len(shown.others_m)]) * px * 0.92)
    parts = [element("style", style()), element("rect", width="100%", height="100%", class_="paper")]
    parts.append(text(shown.title, _LEFT_PX, _LEFT_PX, class_="title"))
    said = f"{len(shown.hours):,} places serve most parts: {low_h:.2f} to {high_h:.2f} h (estimate)"
    parts.append(text(said, _LEFT_PX, _LEFT_PX + _LINE_PX, class_="faint"))
    for x, y in shown.others_m.tolist():
        u, v = at(x, y)
        parts.append(element("circle", cx=u, cy=v, r=1.2, fill="currentColor", opacity=0.35))
    for (x, y), hours in zip(shown.places_m.tolist(), shown.hours.tolist(), strict=True):
        u, v = at(x, y)
        words = element("title", escape(f"({x:g}, {y:g}): {hours:.2f} h"))
        fill = _colour(hours, low_h, high_h)
        parts.append(element("rect", words, x=u - side / 2, y=v - side / 2, width=side, height=side, fill=fill))
    outline = shapely.union_all(list(shown.building))
    rings = [one.exterior.coords for one in getattr(outline, "geoms", [outline]) if one.geom_type == "Polygon"]
    parts += [polygon(ring, fill="#aaa8a4", stroke="#55534f", stroke_width=1) for ring in rings]
    parts += [polygon(one, fill="none", stroke="#b07a00", stroke_width=1.5) for one in shown.yards]
    parts += [
        polygon(one, fill="none", stroke="#6a6a6a", stroke_width=1, stroke_dasharray="4 3") for one in shown.accesses
    ]
    for (x, y), words in ((shown.best_m, "best"), (shown.given_m[:2], "given")):
        u, v = at(x, y)
        parts.append(element("circle", cx=u, cy=v, r=6, fill="none", stroke="#c42418", stroke_width=2.5))
        parts.append(text(f"{words} ({x:g}, {y:g})", u + 9.0, v - 6.0, class_="halo", font_weight="bold"))
    parts += _legend(low_h, high_h, high - 2.0 * _LINE_PX)
    return element(
        "svg",
        element("title", escape(shown.title)),
        *parts,
        xmlns="http://www.w3.org/2000/svg",
        viewBox=f"0 0 {_WIDE_PX:g} {high:.1f}",
        width=_WIDE_PX,
        height=high,
        role="img",
    ).encode()


def _legend(low_h: float, high_h: float, y: float) -> list[str]:
    """Return the scale of colours with its hours, and what the other marks are."""
    if not np.isfinite([low_h, high_h]).all():
        return []
    width = 28.0
    result = [
        element("rect", x=_LEFT_PX + n * width, y=y, width=width, height=12, fill=_colour(n / 8.0, 0.0, 1.0))
        for n in range(9)
    ]
    result.append(text(f"{low_h:.2f} h", _LEFT_PX, y - 4.0, class_="faint"))
    result.append(text(f"{high_h:.2f} h", _LEFT_PX + 9 * width, y - 4.0, class_="faint", text_anchor="end"))
    words = "dots: fewer parts are served; grey: building; ochre: yard; dashed: access of trucks"
    result.append(text(words, _LEFT_PX + 10 * width, y + 10.0, class_="faint"))
    return result


def _colour(value: float, low: float, high: float) -> str:
    """Return the colour of a value: few hours are bright."""
    share = 1.0 - (value - low) / (high - low) if high > low else 1.0
    at = share * (len(_SCALE) - 1)
    n = min(int(at), len(_SCALE) - 2)
    mixed = [a + (b - a) * (at - n) for a, b in zip(_SCALE[n], _SCALE[n + 1], strict=True)]
    return "#" + "".join(f"{round(value):02x}" for value in mixed)


def _pitch_m(places_m: NDArray[np.float64]) -> float:
    """Return the spacing of a lattice."""
    steps = np.diff(np.unique(places_m[:, 0])) if len(places_m) else np.zeros(0)
    return float(steps[steps > 1e-6].min(initial=np.inf)) if (steps > 1e-6).any() else 1.0
