"""Draws the times and the missed cells; needs matplotlib."""

from __future__ import annotations

import io
from collections.abc import Sequence

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
from matplotlib.axes import Axes
from matplotlib.patches import Patch
from PIL import Image

from benchmarks.voxelize.report import duration
from benchmarks.voxelize.result import CaseResult, Row

# Okabe and Ito's colours; their lightness differs as well, and a hatch marks what gives no solid.
_OURS, _SOLID, _SURFACE = "#0072B2", "#E69F00", "#DDDDDD"
_LEAST_S = 1e-3


def draw(cases: Sequence[CaseResult]) -> bytes:
    """Return a PNG with one panel per case, one bar per tool on a logarithmic axis, and the missed cells as text."""
    shown = [case for case in cases if len(case.rows) > 1] or list(cases)
    heights = [len(case.rows) + 0.9 for case in shown]
    figure, panels = plt.subplots(
        len(shown), 1, figsize=(8.6, 0.29 * sum(heights) + 0.9), height_ratios=heights, sharex=True, squeeze=False
    )
    most = max((row.median_s or row.timeout_s or _LEAST_S) for case in shown for row in case.rows)
    for axes, case in zip(panels[:, 0], shown, strict=True):
        _panel(axes, case, most)
    panels[-1, 0].set_xlabel("seconds, one core, same triangles (logarithmic)", fontsize=8)
    legend = [
        Patch(facecolor=_OURS, edgecolor="black", label="bimvox: solid, owner and shares of every cell"),
        Patch(facecolor=_SOLID, edgecolor="black", label="others, solid"),
        Patch(facecolor=_SURFACE, edgecolor="black", hatch="////", label="others, surface only"),
    ]
    figure.legend(handles=legend, loc="upper center", ncols=3, fontsize=8, frameon=False)
    figure.tight_layout(rect=(0, 0, 1, 1 - 0.32 / figure.get_figheight()), h_pad=0.4)
    raw = io.BytesIO()
    figure.savefig(raw, dpi=110, format="png")
    plt.close(figure)
    packed = io.BytesIO()
    Image.open(raw).convert("RGB").quantize(48).save(packed, "png", optimize=True)
    return packed.getvalue()


def _panel(axes: Axes, case: CaseResult, most_s: float) -> None:
    names = [row.tool.title for row in case.rows]
    for at, row in enumerate(case.rows):
        seconds = row.median_s or row.timeout_s
        ours = row.tool.key == "bimvox"
        if seconds is not None:
            axes.barh(
                at,
                seconds - _LEAST_S,
                left=_LEAST_S,
                height=0.72,
                color=_OURS if ours else _SOLID if row.tool.solid else _SURFACE,
                edgecolor="black",
                linewidth=0.6,
                hatch="" if row.tool.solid else "////",
            )
        axes.text((seconds or _LEAST_S) * 1.12, at, _words(row), va="center", fontsize=7)
    axes.set_yticks(range(len(names)), names, fontsize=8)
    axes.set_ylim(len(names) - 0.4, -0.6)
    axes.set_xscale("log")
    axes.set_xlim(_LEAST_S, most_s * 25)
    axes.tick_params(axis="x", labelsize=7)
    axes.set_title(f"{case.name} ({case.cells / 1e6:.3g} million cells)", fontsize=8.5, loc="left", pad=2)
    axes.spines[["top", "right"]].set_visible(False)


def _words(row: Row) -> str:
    if row.median_s is None:
        return row.failure
    text = duration(row.median_s)
    if row.score is not None:
        missed, extra = row.score.missed_share, row.score.extra_share
        text += f" · misses {_percent(row.score.missed, missed)}, {_percent(row.score.extra, extra)} too many"
    return text


def _percent(number: int, share: float) -> str:
    if number == 0:
        return "0"
    return f"{100 * share:.2g} %" if share < 0.1 else f"{100 * share:.0f} %"
