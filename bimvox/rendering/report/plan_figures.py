"""The plots of a plan: utilisation of the crane, length of the paths, methods, hook travel.

``lifts`` are records of the report; those without the plotted value are left out.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from bimvox.rendering.pictures.plots import Axis, Bar, Format, Mark, Series, draw_bars, draw_histogram
from bimvox.rendering.report.words import METHODS
from bimvox.rendering.words import counted

_LONG = 2.0
_METHODS = ("greedy", "policy", "retrained", "search")


def draw_utilisation(lifts: Sequence[dict[str, Any]], critical_share: float, *, file_format: Format = "png") -> bytes:
    """Return the distribution of the utilisation, with a line at the critical share."""
    used = [lift["governs"]["utilisation"] for lift in lifts if lift["governs"]]
    values = np.array([share for share in used if share is not None], np.float64)
    marks = [Mark(critical_share, f"critical from {critical_share:.0%} on")]
    if len(values):
        marks.append(Mark(float(np.median(values)), f"median {np.median(values):.1%}"))
    most = max(1.0, float(values.max(initial=0.0)))
    return draw_histogram(
        [Series("", values)],
        Axis("capacity used at the governing sample", 0.0, most, bins=25, percent=True),
        counted="lifts",
        title="Utilisation of the crane",
        marks=marks,
        file_format=file_format,
    )


def draw_path_ratios(lifts: Sequence[dict[str, Any]], *, file_format: Format = "png") -> bytes:
    """Return the distribution of path length over the fewest possible moves, by method."""
    paths = [lift for lift in lifts if lift["moves"] and lift["shortest_moves"]]
    found = {
        method: [lift["moves"] / lift["shortest_moves"] for lift in paths if lift["method"] == method]
        for method in _all_methods(lifts)
    }
    series = [Series(_found(method, len(ratios)), np.array(ratios)) for method, ratios in found.items() if ratios]
    longest = max((ratio for ratios in found.values() for ratio in ratios), default=1.0)
    high = min(_LONG, max(1.2, longest))
    beyond = f" ({_LONG:g} and more in the last bar)" if longest > _LONG else ""
    whole = sum(lift["moves"] for lift in paths) / max(1, sum(lift["shortest_moves"] for lift in paths))
    return draw_histogram(
        series,
        Axis(f"moves / fewest possible{beyond}", 1.0, high, bins=20),
        counted="lifts",
        title="Length of the paths",
        marks=[Mark(whole, f"all together {whole:.3f}")] if paths else [],
        file_format=file_format,
    )


def draw_methods(lifts: Sequence[dict[str, Any]], *, file_format: Format = "png") -> bytes:
    """Return the share of the planned lifts by the method that found their path."""
    found = [lift["method"] for lift in lifts if lift["method"]]
    counts = {method: found.count(method) for method in _all_methods(lifts)}
    bars = [Bar(_found(method, count), "", count / max(1, len(found)), 0.0, 0.0) for method, count in counts.items()]
    return draw_bars(bars, axis="share of the planned lifts", title="How the paths were found", file_format=file_format)


def _all_methods(lifts: Sequence[dict[str, Any]]) -> list[str]:
    """Return the engine's methods, then the planners and policies that the caller brought."""
    return [*_METHODS, *sorted({lift["method"] for lift in lifts if lift["method"]}.difference(_METHODS))]


def draw_hook_travel(lifts: Sequence[dict[str, Any]], *, file_format: Format = "png") -> bytes:
    """Return the distribution of the hook travel per lift, empty and loaded."""
    values = np.array([lift["hook_travel_m"] for lift in lifts if lift["hook_travel_m"] is not None], np.float64)
    marks = [Mark(float(np.median(values)), f"median {np.median(values):.0f} m")] if len(values) else []
    return draw_histogram(
        [Series("", values)],
        Axis("hook travel of a lift, m", 0.0, bins=20),
        counted="lifts",
        title=f"Hook travel, {values.sum() / 1000:.2f} km in all",
        marks=marks,
        file_format=file_format,
    )


def _found(method: str, count: int) -> str:
    """Return how paths were found, and how many."""
    return f"{METHODS.get(method, method)}: {counted(count, 'lift')}"
