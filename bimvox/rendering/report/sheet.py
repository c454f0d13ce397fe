"""The sheet of a drawing to scale: its place on paper, grid, scale bar, north, and the lines on it."""

from __future__ import annotations

import unicodedata
from collections.abc import Sequence
from dataclasses import dataclass
from math import degrees, hypot
from typing import Any

import numpy as np
import shapely

from bimvox.rendering.report.html import element, picture, text, ticks
from bimvox.rendering.report.words import fixed
from bimvox.rendering.words import escape, plain

PX_PER_M_AT_1 = 96.0 / 0.0254
"""Drawing units of a metre on paper."""
SCALES = (20, 50, 100, 200, 250, 300, 400, 500, 750, 1000, 1500, 2000, 2500, 5000, 10000)
MARGIN_PX = 46.0
_SURVEY_LINES = 8
_APART_PX = 44.0
"""Least distance of the values of two lines of the survey grid."""
GRID_M = (1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0)


@dataclass(frozen=True, slots=True)
class Sheet:
    """A drawing's place on the paper.

    Attributes:
        low_m: Lowest values of its two axes.
        high_m: Highest values.
        scale: Its scale, 1 to this number.
    """

    low_m: tuple[float, float]
    high_m: tuple[float, float]
    scale: int

    @property
    def px_per_m(self) -> float:
        """Drawing units of a metre."""
        return PX_PER_M_AT_1 / self.scale

    @property
    def size_px(self) -> tuple[float, float]:
        """Width and height with margins."""
        return (
            (self.high_m[0] - self.low_m[0]) * self.px_per_m + 2.0 * MARGIN_PX,
            (self.high_m[1] - self.low_m[1]) * self.px_per_m + 2.0 * MARGIN_PX,
        )

    def at(self, point: Sequence[float]) -> tuple[float, float]:
        """Return the place of a point on the drawing; its second axis points up."""
        return (
            MARGIN_PX + (point[0] - self.low_m[0]) * self.px_per_m,
            MARGIN_PX + (self.high_m[1] - point[1]) * self.px_per_m,
        )

    def path(self, rings: Sequence[Sequence[Sequence[float]]], class_: str, *inside: str) -> str:
        """Return an outline as a path; empty without rings."""
        drawn = "".join(
            "M" + "L".join("{:.2f} {:.2f}".format(*self.at(corner)) for corner in ring) + "Z" for ring in rings
        )
        return element("path", *inside, d=drawn, class_=class_, fill_rule="evenodd") if drawn else ""


def sheet_for(low_m: tuple[float, float], high_m: tuple[float, float], most_px: tuple[float, float]) -> Sheet:
    """Return a sheet with the largest of the usual scales that fits."""
    sheets = [Sheet(low_m, high_m, scale) for scale in SCALES]
    fits = (one for one in sheets if all(own <= most for own, most in zip(one.size_px, most_px, strict=True)))
    return next(fits, sheets[-1])


def drawn(sheet: Sheet, title: str, parts: Sequence[str]) -> str:
    """Return a drawing that is as large on paper as its scale says."""
    width, height = sheet.size_px
    svg = picture(width, height, f"{title}, 1 : {sheet.scale}", parts, "scaled")
    return svg.replace("<svg ", f'<svg width="{width:.2f}" height="{height:.2f}" ', 1)


def grid(sheet: Sheet, names: tuple[str, str]) -> list[str]:
    """Return the grid in metres with its coordinates."""
    (x0, y0), (x1, y1) = sheet.low_m, sheet.high_m
    parts, width, height = [], *sheet.size_px
    for value in ticks(x0, x1, 14, GRID_M):
        x = sheet.at((value, y0))[0]
        parts.append(line((x, MARGIN_PX), (x, height - MARGIN_PX), "grid"))
        parts.append(label((x, height - MARGIN_PX), fixed(value, 0), 0.0, 14.0, "middle", "tick"))
    for value in ticks(y0, y1, 10, GRID_M):
        y = sheet.at((x0, value))[1]
        parts.append(line((MARGIN_PX, y), (width - MARGIN_PX, y), "grid"))
        parts.append(label((MARGIN_PX, y), fixed(value, 0), -6.0, 4.0, "end", "tick"))
    parts.append(label((width / 2.0, height), f"{names[0]}, m", 0.0, -14.0, "middle", "axis"))
    parts.append(label((0.0, MARGIN_PX), f"{names[1]}, m", 4.0, -8.0, "start", "axis"))
    return parts


def survey_lines(sheet: Sheet, survey: dict[str, Any] | None) -> tuple[list[str], list[Label]]:
    """Return the lines of round eastings and northings, and their values; empty without a map."""
    if survey is None:
        return [], []
    matrix = np.array(survey["site_to_map"])[:2][:, [0, 1, 3]]
    corners = np.array(
        [[x, y, 1.0] for x in (sheet.low_m[0], sheet.high_m[0]) for y in (sheet.low_m[1], sheet.high_m[1])]
    )
    on_map = corners @ matrix.T
    frame, parts, labels = shapely.box(*sheet.low_m, *sheet.high_m), [], list[Label]()
    most = max(on_map[:, 0].max() - on_map[:, 0].min(), on_map[:, 1].max() - on_map[:, 1].min())
    step = next((step for step in GRID_M if most / step <= _SURVEY_LINES), GRID_M[-1])
    for axis, letter in ((0, "E"), (1, "N")):
        low, high = float(on_map[:, axis].min()), float(on_map[:, axis].max())
        # The points of the site with one value of an axis: a line across the direction in which it grows.
        grows = matrix[axis, :2] / (matrix[axis, :2] @ matrix[axis, :2])
        across = np.array([-grows[1], grows[0]]) / np.hypot(*grows) * 2.0 * float(np.ptp(corners[:, :2], axis=0).sum())
        middle = corners[:, :2].mean(axis=0)
        for value in ticks(low, high, _SURVEY_LINES, (step,)):
            foot = middle + grows * (value - float(matrix[axis] @ [*middle, 1.0]))
            inside = shapely.get_coordinates(shapely.LineString([foot - across, foot + across]).intersection(frame))
            if len(inside) != 2:
                continue
            first, last = (sheet.at(at) for at in inside.tolist())
            parts.append(line(first, last, "survey"))
            end = min((first, last), key=lambda at: (round(at[1], 3), -at[0]))
            if all(hypot(end[0] - one.at[0], end[1] - one.at[1]) > _APART_PX for one in labels):
                labels.append(_value_at(sheet, end, f"{letter} {value:.0f}"))
    return parts, labels


def _value_at(sheet: Sheet, end: tuple[float, float], words: str) -> Label:
    """Return the value of a line above its upper end, or next to it within the frame."""
    if end[1] < MARGIN_PX + 1.0:
        return Label(words, (end[0], end[1] - 4.0), "middle", "surveyed")
    if end[0] > sheet.size_px[0] / 2.0:
        return Label(words, (end[0] - 4.0, end[1] - 3.0), "end", "halo surveyed")
    return Label(words, (end[0] + 4.0, end[1] - 3.0), "start", "halo surveyed")


def scale_bar(sheet: Sheet) -> list[str]:
    """Return a scale bar at the top left."""
    most_px = min(200.0, 0.45 * (sheet.size_px[0] - 2.0 * MARGIN_PX))  # north is at the top right
    length_m = max((step for step in GRID_M if step * sheet.px_per_m <= most_px), default=GRID_M[0])
    x, y, length = MARGIN_PX, 20.0, length_m * sheet.px_per_m
    ends = [line((at, y - 4.0), (at, y + 4.0), "bar") for at in (x, x + length / 2.0, x + length)]
    words = f"{length_m:g} m · 1 : {sheet.scale}"
    bar = element("line", x1=x, x2=x + length, y1=y, y2=y, class_="bar scale-bar", data_length_m=length_m)
    return [bar, *ends, label((x + length, y), words, 8.0, 4.0, "start")]


def north_arrow(sheet: Sheet, north: dict[str, Any] | None) -> str:
    """Return the north arrow at the top right; empty if north is not known."""
    if north is None:
        return ""
    turned = 90.0 - degrees(north["angle_rad"])
    arrow = element("path", d="M0 -18L6 12L0 6L-6 12Z", class_="north", transform=f"rotate({turned:.3f})")
    name = text("N" if north["kind"] == "true north" else "N (map)", 14.0, 4.0, class_="label")
    return element("g", arrow, name, transform=f"translate({sheet.size_px[0] - 80.0:.1f} 24)")


def circle(sheet: Sheet, centre: Sequence[float], radius_m: float, class_: str, *inside: str) -> str:
    """Return a circle about a point in metres."""
    x, y = sheet.at(centre[:2])
    return element("circle", *inside, cx=x, cy=y, r=radius_m * sheet.px_per_m, class_=class_)


def line(first: tuple[float, float], last: tuple[float, float], class_: str) -> str:
    """Return a line between two points of the sheet."""
    return element("line", x1=first[0], y1=first[1], x2=last[0], y2=last[1], class_=class_)


def label(
    at: tuple[float, float], words: str, right: float, down: float, anchor: str = "start", class_: str = "halo"
) -> str:
    """Return a text next to a point of the sheet."""
    return text(words, at[0] + right, at[1] + down, text_anchor=anchor, class_=f"label {class_}")


def tip(words: str) -> str:
    """Return words for an element that is pointed at."""
    return element("title", escape(words))


# Labels of a drawing: where their text lies, and places in which none covers another.

_SIZE_PX = 9.0
"""Height of the letters, as in ``report.css``."""
_Box = tuple[float, float, float, float]
"""Lowest x and y, highest x and y."""

_LETTER = 0.6
"""Mean width of a letter as a share of its height, rounded up; East Asian ones are as wide as high."""
_ASIDE = ((0.0, "middle"), (6.0, "start"), (-6.0, "end"))
_STARTS = {"start": 0.0, "middle": 0.5, "end": 1.0}


@dataclass(frozen=True, slots=True)
class Label:
    """A text on a drawing.

    Attributes:
        words: Its text.
        at: Its anchor on the base line, in drawing units.
        anchor: Which end of the text is there: ``start``, ``middle`` or ``end``.
        class_: Its classes besides ``label``.
    """

    words: str
    at: tuple[float, float]
    anchor: str = "start"
    class_: str = "halo"

    @property
    def box(self) -> _Box:
        """The area that it covers, by estimate."""
        wide, (x, y) = width_px(self.words), self.at
        left = x - _STARTS[self.anchor] * wide
        return (left, y - _SIZE_PX, left + wide, y + 0.3 * _SIZE_PX)

    @property
    def svg(self) -> str:
        """The element."""
        return text(self.words, *self.at, text_anchor=self.anchor, class_=f"label {self.class_}")


def width_px(words: str, size_px: float = _SIZE_PX) -> float:
    """Return about how wide a text is."""
    wide = sum(1.0 if unicodedata.east_asian_width(letter) in "WF" else _LETTER for letter in plain(words))
    return size_px * wide


def around(words: str, at: tuple[float, float], class_: str = "halo") -> list[Label]:
    """Return a text above, below, right and left of a point, and on it, the best first."""
    x, y = at
    return [
        Label(words, (x, y - 6.0), "middle", class_),
        Label(words, (x, y + 13.0), "middle", class_),
        Label(words, (x + 6.0, y + 3.0), "start", class_),
        Label(words, (x - 6.0, y + 3.0), "end", class_),
        Label(words, (x, y + 3.0), "middle", class_),
        *(Label(words, (x + right, y + down), end, class_) for down in (-18.0, 24.0) for right, end in _ASIDE),
    ]


class Placed:
    """The labels of a drawing; one that finds no room is left out, unless it has to be there.

    Args:
        within: The area in which they lie.
        lines: Lines that some of them keep off, in drawing units.
    """

    def __init__(self, within: _Box, lines: Sequence[tuple[tuple[float, float], tuple[float, float]]] = ()) -> None:
        self._within, self._boxes = within, list[_Box]()
        self._lines = shapely.MultiLineString(list(lines))
        self.labels: list[Label] = []

    def put(self, choices: Sequence[Label], *, needed: bool = False, off_lines: bool = False) -> bool:
        """Add the first of some places that is free and inside; the first of all if it is needed. Return if added.

        ``off_lines``: whether it must keep off the lines.
        """
        free = (one for one in choices if self._is_free(one.box) and not (off_lines and self._is_crossed(one.box)))
        found = next(free, choices[0] if needed else None)
        if found is not None:
            self.labels.append(found)
            self._boxes.append(found.box)
        return found is not None

    def keep_clear(self, box: _Box) -> None:
        """Keep the place of something that is drawn already."""
        self._boxes.append(box)

    def _is_crossed(self, box: _Box) -> bool:
        return bool(self._lines.intersects(shapely.box(*box)))

    def _is_free(self, box: _Box) -> bool:
        return _inside(box, self._within) and not any(_meet(box, other) for other in self._boxes)


def shortened(words: str, most: int = 48) -> str:
    """Return a text of at most this many letters, cut in its middle: names often differ at their ends."""
    end = most // 3
    return words if len(words) <= most else words[: most - end - 1].rstrip() + "…" + words[-end:].lstrip()


def _inside(box: _Box, within: _Box) -> bool:
    return box[0] >= within[0] and box[1] >= within[1] and box[2] <= within[2] and box[3] <= within[3]


def _meet(one: _Box, other: _Box) -> bool:
    return one[0] < other[2] and other[0] < one[2] and one[1] < other[3] and other[1] < one[3]
