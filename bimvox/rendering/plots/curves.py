"""Success against training steps, like Figure 5 of Zhu, Pauwels and de Vries (2021)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, MaxNLocator, PercentFormatter
from numpy.typing import NDArray

from bimvox.rendering.plots.look import LINES, Format, bytes_of, house_style


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


def draw_success_curves(panels: Sequence[Panel], *, columns: int = 2, file_format: Format = "png") -> bytes:
    """Return the picture of success rates against training steps, with the panels in reading order."""
    labels = list(dict.fromkeys(curve.label for panel in panels for curve in panel.curves))
    looks = {label: LINES[n % len(LINES)] for n, label in enumerate(labels)}
    columns = min(columns, len(panels))
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
