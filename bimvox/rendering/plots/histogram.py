"""Histograms, with marks such as the median."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator, PercentFormatter
from numpy.typing import NDArray

from bimvox.rendering.plots.look import HATCHES, LINES, Format, bytes_of, house_style

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
