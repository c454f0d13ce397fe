"""Groups of bars, to compare a few methods side by side."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure

from bimvox.rendering.plots.look import HATCHES, LINES, Format, bytes_of, house_style


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
