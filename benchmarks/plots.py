"""Plots of measurements: values over a size with the fitted slope, and the distribution of replan latencies."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from bimvox.rendering.pictures.plots import LINES, Axis, Mark, Series, bytes_of, draw_histogram, house_style


@dataclass(frozen=True, slots=True, eq=False)
class Growth:
    """One series.

    Attributes:
        label: For the legend.
        size: (N,) sizes above 0, ascending.
        value: (N,) figures above 0.
    """

    label: str
    size: NDArray[np.float64]
    value: NDArray[np.float64]

    @property
    def exponent(self) -> float:
        """Slope of the line through the logarithms: 1 is linear; NaN if there are fewer than two different sizes."""
        if len(np.unique(self.size)) < 2:
            return float("nan")
        return float(np.polyfit(np.log(self.size), np.log(self.value), 1)[0])


def draw_scaling(series: Sequence[Growth], *, size: str, value: str, title: str = "") -> bytes:
    """Return the plot of values over a size as PNG, both on logarithmic scales; the legend gives the exponents.

    Args:
        series: The series.
        size: Label of the size, with its unit.
        value: Label of the value, with its unit.
        title: Above the axes.
    """
    with house_style():
        figure = Figure(figsize=(4.6, 3.2), layout="constrained")
        axes = figure.add_subplot()
        for n, one in enumerate(series):
            look = LINES[n % len(LINES)]
            slope = "" if np.isnan(one.exponent) else f"  ~ size^{one.exponent:.2f}"
            axes.plot(
                one.size,
                one.value,
                color=look.colour,
                linestyle=look.dash,
                marker=look.marker,
                label=f"{one.label}{slope}",
            )
        axes.set_xscale("log")
        axes.set_yscale("log")
        axes.set_xlabel(size)
        axes.set_ylabel(value)
        axes.set_title(title)
        if series:
            axes.legend()
        return bytes_of(figure, "png")


def draw_latencies(latencies_ms: Sequence[float], bound_ms: float) -> bytes:
    """Return the distribution of replan latencies as PNG, on a logarithmic scale.

    Args:
        latencies_ms: One per change, above 0.
        bound_ms: The bound, marked by a line.
    """
    values = np.array(latencies_ms, np.float64)
    marks = [Mark(bound_ms, f"wanted below {bound_ms:g} ms")]
    if len(values):
        half, most = np.quantile(values, [0.5, 0.95])
        marks = [Mark(float(half), f"median {half:.0f} ms"), Mark(float(most), f"95 % below {most:.0f} ms"), *marks]
    return draw_histogram(
        [Series("", values)],
        Axis("from the change to the written log, ms", logarithmic=len(values) > 0),
        counted="replans",
        title="Replan latency",
        marks=marks,
    )
