"""The common style of all plots.

Lines differ in dash and marker as well as in colour (Paul Tol's bright palette, whose colours also differ in
lightness), so that they can be told apart in greyscale. Deterministic: no date, version or random ids in the files, and
only the fonts that come with matplotlib.
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
    """The look of one series."""

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
"""Looks of the series in turn; they repeat after the last."""

HATCHES = ("", "//", "..", "xx", "\\\\", "++")
"""Hatches of the bars in turn."""

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
    """Draw and save in the common style, independent of the caller's matplotlib settings."""
    with rc_context():
        rcdefaults()
        for key, value in _STYLE.items():
            rcParams[key] = value  # type: ignore[index]
        yield


def bytes_of(figure: Figure, file_format: Format) -> bytes:
    """Return a figure as a PNG or SVG file; deterministic."""
    out = io.BytesIO()
    if file_format == "svg":
        FigureCanvasSVG(figure).print_svg(out, metadata={"Date": None, "Creator": "bimvox"})  # type: ignore[no-untyped-call]
    else:
        FigureCanvasAgg(figure).print_png(out, metadata={"Software": None})  # type: ignore[no-untyped-call]
    return out.getvalue()
