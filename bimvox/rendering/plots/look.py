"""How every plot looks.

Lines differ in dash and marker as well as in colour (the bright palette of Paul Tol, whose members also differ in
lightness), so that they are told apart in gray. The same figures give the same bytes: no date, no version, no random
ids, and no fonts but the ones that matplotlib brings along.
"""

from __future__ import annotations

import io
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Literal

from matplotlib import rc_context, rcdefaults, rcParams
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure

Format = Literal["png", "svg"]


@dataclass(frozen=True, slots=True)
class LineLook:
    """How one series is drawn."""

    colour: str
    dash: str
    marker: str


LINES: tuple[LineLook, ...] = (
    LineLook("#4477AA", "-", "o"),
    LineLook("#EE6677", "--", "s"),
    LineLook("#228833", "-.", "^"),
    LineLook("#CCBB44", ":", "D"),
    LineLook("#AA3377", (0, (5, 1, 1, 1, 1, 1)), "v"),  # type: ignore[arg-type]
    LineLook("#66CCEE", (0, (1, 1)), "x"),  # type: ignore[arg-type]
)
"""Series take them in order, and begin anew after the last."""

HATCHES = ("", "//", "..", "xx", "\\\\", "++")
"""Bars take them in order."""

_STYLE = {
    "figure.facecolor": "#FAFAF8",
    "axes.facecolor": "#FFFFFF",
    "axes.edgecolor": "#68686E",
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.titlesize": 10,
    "axes.titlelocation": "left",
    "axes.labelsize": 9,
    "axes.labelcolor": "#28282C",
    "grid.color": "#E4E4E0",
    "font.family": "DejaVu Sans",
    "font.size": 9,
    "legend.frameon": False,
    "legend.fontsize": 8,
    "lines.linewidth": 1.6,
    "lines.markersize": 3.5,
    "savefig.dpi": 120,
    "svg.hashsalt": "bimvox",
    "svg.fonttype": "path",
    "xtick.labelsize": 8,
    "ytick.labelsize": 8,
}


@contextmanager
def house_style() -> Iterator[None]:
    """Draw and save with the one look; the caller's own settings of matplotlib do not matter."""
    with rc_context():
        rcdefaults()
        for key, value in _STYLE.items():
            rcParams[key] = value  # type: ignore[index]
        yield


def bytes_of(figure: Figure, file_format: Format) -> bytes:
    """Return a figure as a PNG or SVG file; equal figures give equal bytes."""
    out = io.BytesIO()
    if file_format == "svg":
        FigureCanvasSVG(figure).print_svg(out, metadata={"Date": None, "Creator": "bimvox"})  # type: ignore[no-untyped-call]
    else:
        FigureCanvasAgg(figure).print_png(out, metadata={"Software": None})  # type: ignore[no-untyped-call]
    return out.getvalue()
