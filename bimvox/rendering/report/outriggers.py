"""Loads on the outriggers of a mobile crane: in this plan, over the whole circle, and without a load."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bimvox.crane.ground import G_M_S2, PADS, crane_kg, pad_loads_n, touches
from bimvox.crane.tower_crane import TowerCrane
from bimvox.records.motion import LiftMotion, Trajectory
from bimvox.rendering.report.html import element, number, picture, row, table, text, ticks
from bimvox.rendering.report.words import fixed

_EVERY_DEG = 5


def pads_of(crane: TowerCrane, motions: Sequence[LiftMotion], hung_kg: Mapping[int, float]) -> dict[str, Any] | None:
    """Return the loads on each pad; None if outriggers, counterweight or masses are not stated.

    Args:
        crane: A crane.
        motions: Its lifts.
        hung_kg: What hangs on the rope in each of them, by order.

    Returns:
        ``crane_kg``; ``overturning_knm``, the largest moment about the slewing axis over all samples; by pad
        (``pads``: ``name``, ``most_kn`` in this plan with ``number``, ``slew_rad`` and ``radius_m``, ``circle_kn`` with
        the governing load in any direction, ``empty_kn`` without a load in any direction); ``slew_deg`` and
        ``circle_kn`` (a row for each angle) of the governing lift, ``circle_number``, ``circle_radius_m``;
        ``lifts_off``: how many lifts take all load off a pad; ``lifts``: the largest load on a pad in each (``order``,
        ``outrigger_kn``, ``outrigger``). Null stands for a crane that would tip.
    """
    carrier, jib = crane.carrier, crane.luffing
    if carrier is None or jib is None or not motions:
        return None
    slew_rad, radius_m, kg, order = _samples(crane, motions, hung_kg)
    loads = pad_loads_n(carrier, jib, slew_rad, radius_m, kg)
    if loads is None:
        return None
    slew_deg = np.arange(0, 360, _EVERY_DEG)
    furthest_m = {m.order: float(max(m.raising.radius_m.max(), m.loaded.radius_m.max())) for m in motions}
    governs = max(furthest_m, key=lambda one: (hung_kg[one] * furthest_m[one], -one))
    circle = pad_loads_n(carrier, jib, np.radians(slew_deg), furthest_m[governs], hung_kg[governs])
    empty = [
        pad_loads_n(carrier, jib, np.radians(slew_deg), at_m, crane.tackle_kg)
        for at_m in (crane.min_radius_m, crane.jib_length_m)
    ]
    assert circle is not None
    without = np.concatenate([one for one in empty if one is not None])
    worst = np.argmax(loads, axis=0)
    return {
        "crane_kg": crane_kg(carrier),
        "overturning_knm": _overturning_knm(crane, loads),
        "pads": [
            {
                "name": name,
                "most_kn": _kn(loads[worst[pad], pad]),
                "number": int(order[worst[pad]]) + 1,
                "slew_rad": float(slew_rad[worst[pad]]),
                "radius_m": float(radius_m[worst[pad]]),
                "circle_kn": _kn(circle[:, pad].max()),
                "empty_kn": _kn(without[:, pad].max()),
            }
            for pad, name in enumerate(PADS)
        ],
        "slew_deg": slew_deg.tolist(),
        "circle_kn": [[_kn(one) for one in loads_n] for loads_n in circle.tolist()],
        "circle_number": governs + 1,
        "circle_radius_m": furthest_m[governs],
        "lifts_off": len(set(order[~touches(loads).all(axis=1)].tolist())),
        "lifts": [_most_in_lift(motion.order, loads[order == motion.order]) for motion in motions],
    }


def _most_in_lift(order: int, loads: NDArray[np.float64]) -> dict[str, Any]:
    pad = int(np.argmax(loads.max(axis=0)))
    return {"order": order, "outrigger_kn": _kn(loads[:, pad].max()), "outrigger": PADS[pad]}


def _samples(
    crane: TowerCrane, motions: Sequence[LiftMotion], hung_kg: Mapping[int, float]
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], NDArray[np.int64]]:
    """Return slewing angle, radius, mass on the rope and order at every sample of all lifts."""
    parts: list[tuple[Trajectory, float, int]] = []
    for motion in motions:
        for part in (motion.approach, motion.departure):
            parts += [] if part is None else [(part, crane.tackle_kg, motion.order)]
        parts += [(part, hung_kg[motion.order], motion.order) for part in (motion.raising, motion.loaded)]
    count = [len(part.time_ns) for part, _, _ in parts]
    slew_rad, radius_m = (np.concatenate([getattr(p, key) for p, _, _ in parts]) for key in ("slew_rad", "radius_m"))
    return slew_rad, radius_m, np.repeat([kg for _, kg, _ in parts], count), np.repeat([n for _, _, n in parts], count)


def _overturning_knm(crane: TowerCrane, loads: NDArray[np.float64]) -> float | None:
    """Return the largest moment of all masses about the slewing axis."""
    assert crane.carrier is not None
    base = crane.carrier.outriggers
    assert base is not None
    x = np.array([base.front_m, base.front_m, -base.rear_m, -base.rear_m])
    y = np.array([base.left_m, -base.right_m, base.left_m, -base.right_m])
    if not np.isfinite(loads).all():
        return None
    return float(np.hypot(loads @ x, loads @ y).max()) / 1e3


def _kn(newtons: float) -> float | None:
    return float(newtons) / 1e3 if math.isfinite(newtons) else None


def most_kn(pads: dict[str, Any]) -> float | None:
    """Return the largest load on a pad in this plan; None if the crane would tip."""
    loads = [pad["most_kn"] for pad in pads["pads"]]
    return None if None in loads else max(loads)


def pads_table(pads: dict[str, Any], mat_m2: float | None) -> str:
    """Return the loads on the pads as a table, and a drawing over the whole circle."""
    columns = ["Pad", "In this plan kN", "Lift", "Boom at", "Radius m", "Any direction kN", "Without load kN"]
    columns += [] if mat_m2 is None else ["Mat kPa"]
    rows = []
    for pad in pads["pads"]:
        cells = [
            pad["name"],
            _load(pad["most_kn"], "most_kn"),
            number(pad["number"], str(pad["number"]), "number"),
            f"{math.degrees(pad['slew_rad']) % 360.0:.0f}°",
            number(pad["radius_m"], fixed(pad["radius_m"], 1), "radius_m"),
            _load(pad["circle_kn"], "circle_kn"),
            _load(pad["empty_kn"], "empty_kn"),
        ]
        if mat_m2 is not None:
            pressure = None if pad["most_kn"] is None else pad["most_kn"] / mat_m2
            cells.append(number(pressure, "" if pressure is None else fixed(pressure, 0), "mat_kpa"))
        rows.append(row(cells))
    return table(columns, rows, class_="words narrow") + _drawing(pads)


def _load(value_kn: float | None, key: str) -> str:
    return "<b>✕ tips</b>" if value_kn is None else number(value_kn, fixed(value_kn, 0), key)


_WIDTH, _HEIGHT, _LEFT, _RIGHT, _TOP, _BOTTOM = 720.0, 220.0, 52.0, 96.0, 10.0, 36.0
_DASHES = ("none", "9 4", "2 3", "9 3 2 3")
"""Of the pads, so that their lines are told apart in grey."""
_STEPS_KN = (10.0, 20.0, 50.0, 100.0, 200.0, 500.0, 1000.0)


def _drawing(pads: dict[str, Any]) -> str:
    """Return the load on each pad over the slewing circle, with the governing load at its furthest radius."""
    rows = [*pads["circle_kn"], pads["circle_kn"][0]]
    if any(one is None for loads in rows for one in loads):
        return ""
    most: float = max(max(loads) for loads in rows) * 1.05

    def x(deg: float) -> float:
        return _LEFT + deg / 360.0 * (_WIDTH - _LEFT - _RIGHT)

    def y(kn: float) -> float:
        return _HEIGHT - _BOTTOM - kn / most * (_HEIGHT - _TOP - _BOTTOM)

    parts = []
    for deg in range(0, 361, 45):
        parts.append(element("line", x1=x(deg), x2=x(deg), y1=_TOP, y2=_HEIGHT - _BOTTOM, class_="grid"))
        parts.append(text(f"{deg}°", x(deg), _HEIGHT - _BOTTOM + 14.0, text_anchor="middle", class_="tick"))
    for at in ticks(0.0, most, 5, _STEPS_KN):
        parts.append(element("line", x1=_LEFT, x2=_WIDTH - _RIGHT, y1=y(at), y2=y(at), class_="grid"))
        parts.append(text(f"{at:g}", _LEFT - 6.0, y(at) + 4.0, text_anchor="end", class_="tick"))
    about = "boom from the x axis, counter-clockwise; kN on each pad"
    parts.append(text(about, (_LEFT + _WIDTH - _RIGHT) / 2.0, _HEIGHT - 4.0, text_anchor="middle", class_="axis"))
    degrees = [*pads["slew_deg"], 360]
    label_y = _spread([y(rows[-1][pad]) for pad in range(len(PADS))])
    for pad, name in enumerate(PADS):
        points = " ".join(f"{x(deg):.1f},{y(loads[pad]):.1f}" for deg, loads in zip(degrees, rows, strict=True))
        parts.append(element("polyline", points=points, class_="capacity", stroke_dasharray=_DASHES[pad]))
        parts.append(text(name, _WIDTH - _RIGHT + 6.0, label_y[pad] + 4.0, text_anchor="start", class_="tick"))
    title = f"Pad loads over the circle, lift {pads['circle_number']} at {pads['circle_radius_m']:.1f} m"
    return picture(_WIDTH, _HEIGHT, title, parts, "chart")


def _spread(at: list[float], apart: float = 12.0) -> list[float]:
    """Return heights of labels that are no closer than a line of text."""
    result = list(at)
    order = sorted(range(len(at)), key=at.__getitem__)
    for before, after in pairwise(order):
        result[after] = max(result[after], result[before] + apart)
    return result


def vertical_kn(pads: dict[str, Any], hung_kg: float) -> float:
    """Return the weight of the crane with a load."""
    return float(pads["crane_kg"] + hung_kg) * G_M_S2 / 1e3
