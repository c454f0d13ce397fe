"""Labels of a drawing: where their text lies, and places in which none covers another."""

from __future__ import annotations

import unicodedata
from collections.abc import Sequence
from dataclasses import dataclass

from bimvox.rendering.report.html import text
from bimvox.rendering.words import plain

SIZE_PX = 9.0
"""Height of the letters, as in ``report.css``."""
Box = tuple[float, float, float, float]
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
    def box(self) -> Box:
        """The area that it covers, by estimate."""
        wide, (x, y) = width_px(self.words), self.at
        left = x - _STARTS[self.anchor] * wide
        return (left, y - SIZE_PX, left + wide, y + 0.3 * SIZE_PX)

    @property
    def svg(self) -> str:
        """The element."""
        return text(self.words, *self.at, text_anchor=self.anchor, class_=f"label {self.class_}")


def width_px(words: str, size_px: float = SIZE_PX) -> float:
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
    """

    def __init__(self, within: Box) -> None:
        self._within, self._boxes = within, list[Box]()
        self.labels: list[Label] = []

    def put(self, choices: Sequence[Label], *, needed: bool = False) -> bool:
        """Add the first of some places that is free and inside; the first of all if it is needed. Return if added."""
        found = next((one for one in choices if self._is_free(one.box)), choices[0] if needed else None)
        if found is not None:
            self.labels.append(found)
            self._boxes.append(found.box)
        return found is not None

    def keep_clear(self, label: Label) -> None:
        """Keep the place of a label that is drawn already."""
        self._boxes.append(label.box)

    def _is_free(self, box: Box) -> bool:
        return _inside(box, self._within) and not any(_meet(box, other) for other in self._boxes)


def shortened(words: str, most: int = 48) -> str:
    """Return a text of at most this many letters, cut in its middle: names often differ at their ends."""
    end = most // 3
    return words if len(words) <= most else words[: most - end - 1].rstrip() + "…" + words[-end:].lstrip()


def _inside(box: Box, within: Box) -> bool:
    return box[0] >= within[0] and box[1] >= within[1] and box[2] <= within[2] and box[3] <= within[3]


def _meet(one: Box, other: Box) -> bool:
    return one[0] < other[2] and other[0] < one[2] and one[1] < other[3] and other[1] < one[3]
