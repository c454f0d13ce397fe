"""The load chart with every lift in it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from bimvox.crane.load_chart import capacity_kg
from bimvox.crane.tower_crane import TowerCrane
from bimvox.rendering.plain import escape
from bimvox.rendering.report.svg import element, picture, text, ticks
from bimvox.rendering.report.words import fixed, named, percent

_WIDTH, _HEIGHT, _LEFT, _RIGHT, _TOP, _BOTTOM = 1040.0, 360.0, 62.0, 14.0, 12.0, 40.0
_STEPS_M = (1.0, 2.0, 5.0, 10.0, 20.0)
_STEPS_T = (0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0)
_POINTS = 240


def load_chart(
    crane: TowerCrane, lifts: Sequence[dict[str, Any]], critical_share: float, permitted: float = 1.0
) -> str:
    """Return the capacity over the radius, and each lift at its governing sample, as SVG.

    Further curves are the critical share of the capacity, and the permitted share if that is below 1. Lifts without a
    governing sample are left out.
    """
    held = [lift for lift in lifts if lift["governs"]]
    radius_m = np.linspace(crane.min_radius_m, crane.jib_length_m, _POINTS)
    carries_kg = capacity_kg(crane.chart, radius_m)
    most_kg: float = max(float(carries_kg.max()), *(lift["governs"]["load_kg"] for lift in held), 1.0) * 1.05

    def x(at_m: float) -> float:
        return _LEFT + float(at_m) / crane.jib_length_m * (_WIDTH - _LEFT - _RIGHT)

    def y(mass_kg: float) -> float:
        return _HEIGHT - _BOTTOM - float(mass_kg) / most_kg * (_HEIGHT - _TOP - _BOTTOM)

    def curve(share: float, class_: str) -> str:
        points = " ".join(f"{x(r):.1f},{y(share * c):.1f}" for r, c in zip(radius_m, carries_kg, strict=True))
        return element("polyline", points=points, class_=class_)

    parts = []
    for at in ticks(0.0, crane.jib_length_m, 14, _STEPS_M):
        parts.append(element("line", x1=x(at), x2=x(at), y1=_TOP, y2=_HEIGHT - _BOTTOM, class_="grid"))
        parts.append(text(fixed(at, 0), x(at), _HEIGHT - _BOTTOM + 14.0, text_anchor="middle", class_="tick"))
    for at in ticks(0.0, most_kg / 1000.0, 7, _STEPS_T):
        parts.append(element("line", x1=_LEFT, x2=_WIDTH - _RIGHT, y1=y(at * 1000), y2=y(at * 1000), class_="grid"))
        parts.append(text(f"{at:g}", _LEFT - 6.0, y(at * 1000) + 4.0, text_anchor="end", class_="tick"))
    parts.append(text("radius of the hook, m", _WIDTH / 2.0, _HEIGHT - 6.0, text_anchor="middle", class_="axis"))
    middle = (_TOP + _HEIGHT - _BOTTOM) / 2.0
    upwards = f"rotate(-90 14 {middle:g})"
    parts.append(text("load and rigging, t", 14.0, middle, text_anchor="middle", class_="axis", transform=upwards))
    parts += [curve(critical_share, "threshold"), curve(1.0, "capacity")]
    parts += [curve(permitted, "permitted")] if permitted < 1.0 else []
    parts += [_point(lift, x, y) for lift in held]
    return picture(_WIDTH, _HEIGHT, f"Load chart of {crane.name} with {len(held)} lifts", parts, "chart")


def _point(lift: dict[str, Any], x: Any, y: Any) -> str:
    governs = lift["governs"]
    at_x, at_y = x(governs["radius_m"]), y(governs["load_kg"])
    if lift["critical"]:
        return element("path", _title(lift), d=f"M{at_x:.1f} {at_y - 5.5:.1f}l5 9h-10z", class_="dot critical")
    return element("circle", _title(lift), cx=at_x, cy=at_y, r=3.0, class_="dot")


def _title(lift: dict[str, Any]) -> str:
    used = lift["governs"]["utilisation"]
    share = "beyond the chart" if used is None else percent(used, 1)
    return element("title", escape(f"Lift {lift['number']}, {named(lift)}: {share}"))
