"""The common style of all plots.

Lines differ in dash and marker as well as in colour (Paul Tol's bright palette, whose colours also differ in
lightness), so that they can be told apart in greyscale. Deterministic: no date, version or random ids in the files, and
only the fonts that come with matplotlib.
"""

from __future__ import annotations

import io
import math
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Literal

import numpy as np
from matplotlib import rc_context, rcdefaults, rcParams
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, MaxNLocator, PercentFormatter
from numpy.typing import NDArray

Format = Literal["png", "svg"]


@dataclass(frozen=True, slots=True)
class _LineLook:
    """The look of one series."""

    colour: str
    dash: str
    marker: str


LINES: tuple[_LineLook, ...] = (
    _LineLook("#4477AA", "-", "o"),
    _LineLook("#EE6677", "--", "s"),
    _LineLook("#228833", "-.", "^"),
    _LineLook("#CCBB44", ":", "D"),
    _LineLook("#AA3377", (0, (5, 1, 1, 1, 1, 1)), "v"),  # type: ignore[arg-type]
    _LineLook("#66CCEE", (0, (1, 1)), "x"),  # type: ignore[arg-type]
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


# Groups of bars, to compare a few methods side by side.


@dataclass(frozen=True, slots=True)
class Bar:
    """One bar.

    Attributes:
        group: Its group on the axis.
        series: Its name in the legend; empty for none.
        value: Its height.
        low: Lower end of its error line.
        high: Upper end.
        censored: Whether the true value is larger: the bar is drawn open, with an arrow.
    """

    group: str
    series: str
    value: float
    low: float
    high: float
    censored: bool = False


def draw_bars(bars: Sequence[Bar], *, axis: str, title: str = "", file_format: Format = "png") -> bytes:
    """Return the picture of bars in groups; ``axis`` labels the height, with its unit.

    Groups and series appear in the order of their first bar.
    """
    groups = list(dict.fromkeys(bar.group for bar in bars))
    series = list(dict.fromkeys(bar.series for bar in bars))
    width = 0.8 / max(1, len(series))
    with house_style():
        figure = Figure(figsize=(max(4.6, 0.55 * len(groups) * max(2, len(series))), 3.2), layout="constrained")
        axes = figure.add_subplot()
        for bar in bars:
            n = series.index(bar.series)
            at = groups.index(bar.group) + (n - (len(series) - 1) / 2) * width
            colour = LINES[n % len(LINES)].colour
            axes.bar(
                at,
                bar.value,
                width * 0.92,
                color="none" if bar.censored else colour,
                edgecolor=colour if bar.censored else "#28282C",
                linewidth=0.8,
                hatch=HATCHES[n % len(HATCHES)],
                label=bar.series if bar is next(b for b in bars if b.series == bar.series) else None,
            )
            if bar.censored:
                axes.annotate("↑", (at, bar.value), ha="center", va="bottom")
            elif bar.high > bar.low:
                axes.vlines(at, bar.low, bar.high, color="#28282C", linewidth=1.2)
        axes.set_xticks(np.arange(len(groups)), groups)
        axes.set_ylabel(axis)
        axes.set_title(title)
        axes.grid(False, axis="x")
        axes.margins(y=0.12)
        if any(series):
            axes.legend()
        return bytes_of(figure, file_format)


# Success against training steps, like Figure 5 of Zhu, Pauwels and de Vries (2021).


@dataclass(frozen=True, slots=True, eq=False)
class Curve:
    """One series.

    Attributes:
        label: For the legend.
        steps: (K,) environment steps, ascending.
        mean: (K,) success rate, 0..1.
        low: (K,) lower end of the band around the mean.
        high: (K,) upper end.
    """

    label: str
    steps: NDArray[np.float64]
    mean: NDArray[np.float64]
    low: NDArray[np.float64]
    high: NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Panel:
    """One set of axes.

    Attributes:
        title: Above it.
        curves: Its series; curves with the same label look the same in every panel.
        note: A sentence shown in a panel without curves.
    """

    title: str
    curves: tuple[Curve, ...]
    note: str = ""


def draw_success_curves(panels: Sequence[Panel], *, file_format: Format = "png") -> bytes:
    """Return the picture of success rates against training steps, with the panels in reading order."""
    labels = list(dict.fromkeys(curve.label for panel in panels for curve in panel.curves))
    looks = {label: LINES[n % len(LINES)] for n, label in enumerate(labels)}
    columns = min(2, len(panels))
    rows = math.ceil(len(panels) / columns)
    with house_style():
        figure = Figure(figsize=(4.6 * columns, 2.7 * rows), layout="constrained")
        for n, panel in enumerate(panels):
            axes = figure.add_subplot(rows, columns, n + 1)
            _frame(axes, panel)
            for curve in panel.curves:
                look = looks[curve.label]
                axes.fill_between(curve.steps, curve.low, curve.high, color=look.colour, alpha=0.18, linewidth=0)
                axes.plot(
                    curve.steps,
                    curve.mean,
                    color=look.colour,
                    linestyle=look.dash,
                    marker=look.marker,
                    markevery=max(1, len(curve.steps) // 8),
                    label=curve.label,
                )
            if panel.curves:
                axes.legend(loc="lower right")
            elif panel.note:
                axes.text(0.5, 0.5, panel.note, ha="center", va="center", transform=axes.transAxes, wrap=True)
        return bytes_of(figure, file_format)


def _frame(axes: Axes, panel: Panel) -> None:
    axes.set_title(panel.title)
    axes.set_ylim(-0.03, 1.05)
    axes.set_xlim(0.0, max((float(curve.steps[-1]) for curve in panel.curves), default=1.0) * 1.03 or 1.0)
    axes.set_xlabel("environment steps")
    axes.set_ylabel("success rate")
    axes.yaxis.set_major_formatter(PercentFormatter(1.0))
    axes.xaxis.set_major_locator(MaxNLocator(6))
    axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _at: f"{value:,.0f}"))


# Histograms, with marks such as the median.

_INK = "#28282C"


@dataclass(frozen=True, slots=True, eq=False)
class Series:
    """Values of one kind.

    Attributes:
        label: For the legend; empty for none.
        values: (N,) any order.
    """

    label: str
    values: NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Mark:
    """A value marked by a vertical line.

    Attributes:
        at: The value.
        label: What it is.
    """

    at: float
    label: str


@dataclass(frozen=True, slots=True)
class Axis:
    """The axis of the values.

    Attributes:
        label: What the values are, with their unit.
        low: Lower end; None takes the smallest value.
        high: Upper end; None takes the largest value.
        bins: Number of bars at most.
        percent: Whether 1 is written as 100 %.
        logarithmic: Whether values, all above 0, are on a logarithmic scale.
    """

    label: str
    low: float | None = None
    high: float | None = None
    bins: int = 24
    percent: bool = False
    logarithmic: bool = False


def draw_histogram(
    series: Sequence[Series],
    axis: Axis,
    *,
    counted: str,
    title: str = "",
    marks: Sequence[Mark] = (),
    file_format: Format = "png",
) -> bytes:
    """Return the picture of a distribution; series are stacked, the first is the lowest.

    ``counted`` labels the other axis: what is counted, such as ``lifts``.
    """
    values = np.concatenate([one.values for one in series]) if series else np.zeros(0)
    edges = _edges(values, axis)
    with house_style():
        figure = Figure(figsize=(4.6, 2.9), layout="constrained")
        axes = figure.add_subplot()
        below = np.zeros(len(edges) - 1)
        for n, one in enumerate(series):
            # Values beyond a given end are counted in the last bar at that end.
            counts = np.histogram(np.clip(one.values, edges[0], edges[-1]), edges)[0].astype(np.float64)
            axes.bar(
                edges[:-1],
                counts,
                np.diff(edges),
                bottom=below,
                align="edge",
                color=LINES[n % len(LINES)].colour,
                edgecolor=_INK,
                linewidth=0.6,
                hatch=HATCHES[n % len(HATCHES)],
                label=one.label or None,
            )
            below += counts
        for n, mark in enumerate(marks):
            axes.axvline(mark.at, color=_INK, linestyle=("--", ":", "-.")[n % 3], linewidth=1.3, label=mark.label)
        axes.set_xlabel(axis.label)
        axes.set_ylabel(counted)
        axes.set_title(title)
        axes.grid(False, axis="x")
        axes.yaxis.set_major_locator(MaxNLocator(5, integer=True))
        if axis.logarithmic:
            axes.set_xscale("log")
        if axis.percent:
            axes.xaxis.set_major_formatter(PercentFormatter(1.0))
        axes.margins(y=0.12)
        if marks or any(one.label for one in series):
            # A mark may run behind the text.
            axes.legend(frameon=True, facecolor="#FFFFFF", edgecolor="none", framealpha=0.85)
        return bytes_of(figure, file_format)


def _edges(values: NDArray[np.float64], axis: Axis) -> NDArray[np.float64]:
    low, high, bins = axis.low, axis.high, axis.bins
    first = float(values.min()) if low is None and values.size else (low or 0.0)
    last = float(values.max()) if high is None and values.size else (high if high is not None else first + 1.0)
    if axis.logarithmic:
        first = max(first, 1e-12)
        return np.geomspace(first, max(last, first * 1.01), bins + 1)
    if last <= first:
        return np.linspace(first - 0.5, first + 0.5, 2)
    return np.linspace(first, last, bins + 1)
