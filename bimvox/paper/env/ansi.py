"""The site as text: seen from above, in the paper's colours."""

from __future__ import annotations

import numpy as np

from bimvox.paper.env.picture import LOOK_RGB, Look, SitePicture
from bimvox.site.construction import Rgb

_LETTERS: dict[Look, str] = {
    Look.GROUND: ".",
    Look.CONSTRUCTION_AREA: ":",
    Look.OBSTRUCTION: "#",
    Look.UNBUILT: "u",
    Look.IN_TRANSIT: "T",
    Look.ARRIVED: "A",
    Look.ASSEMBLED: "B",
}
_TARGET, _START = "x", "o"


def ansi_picture(picture: SitePicture, *, coloured: bool = True) -> str:
    """Return a caption and a plan with +y upward; the highest object of each column counts.

    ``.`` ground, ``:`` construction area, ``#`` obstruction, ``u`` unbuilt, ``T`` in transit, ``A`` arrived, ``B``
    assembled; on bare ground ``o`` marks an initial position and ``x`` a target.

    Args:
        picture: What to show.
        coloured: Whether escape sequences set colours (24 bit).
    """
    looks = picture.looks
    filled = looks != Look.AIR
    top = looks.shape[2] - 1 - np.argmax(filled[:, :, ::-1], axis=2)
    plan = np.take_along_axis(looks, top[:, :, None], axis=2)[:, :, 0]
    marks = np.full(plan.shape, "", dtype=object)
    for letter, boxes in ((_START, picture.starts), (_TARGET, picture.targets)):
        for (x0, y0, _), (x1, y1, _) in boxes:
            marks[x0:x1, y0:y1] = letter
    rows = [picture.caption]
    for y in range(plan.shape[1] - 1, -1, -1):
        cells = []
        for x in range(plan.shape[0]):
            look = Look(plan[x, y])
            bare = look in (Look.GROUND, Look.CONSTRUCTION_AREA)
            letter = marks[x, y] if bare and marks[x, y] else _LETTERS[look]
            cells.append(_painted(letter, look) if coloured else letter)
        rows.append("".join(cells))
    return "\n".join(rows) + "\n"


def _painted(letter: str, look: Look) -> str:
    ink = LOOK_RGB[Look.ASSEMBLED] if letter == _TARGET else _ink(LOOK_RGB[look])
    ink = LOOK_RGB[Look.UNBUILT] if letter == _START else ink
    r, g, b = LOOK_RGB[look]
    return f"\x1b[48;2;{r};{g};{b}m\x1b[38;2;{ink[0]};{ink[1]};{ink[2]}m{letter}\x1b[0m"


def _ink(paper: Rgb) -> Rgb:
    """Black on light colours, white on dark ones."""
    return (0, 0, 0) if 0.299 * paper[0] + 0.587 * paper[1] + 0.114 * paper[2] > 140.0 else (255, 255, 255)
