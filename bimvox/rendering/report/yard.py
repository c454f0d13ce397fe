"""Drawings of the yard in the report: what lies where when a delivery is unloaded."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from bimvox.rendering.report.html import number, paragraph, section, tag
from bimvox.rendering.report.plan_view import frame_box, stored_box
from bimvox.rendering.report.sheet import Sheet, drawn, sheet_for
from bimvox.rendering.report.svg import text
from bimvox.rendering.report.words import in_ranges

_MOST_PX = (500.0, 420.0)
"""Two drawings stand side by side on a landscape A4 page."""
_MOST = 24
_STACK_M = 0.05  # between the centres of parts that lie on each other
_THIN_PX = 12.0
_APART = 0.3
_DOWN_PX = 3.5  # from the middle of a line of text to its foot


def yard_drawings(record: dict[str, Any]) -> str:
    """Return a drawing of the yard for each of the first deliveries, all to one scale; empty without any."""
    drawing = record["drawing"]
    deliveries = sorted({one["delivery"] for one in drawing["stored"]})
    if not deliveries or "yard" not in drawing["areas"]:
        return ""
    corners = [at for kind in ("yard", "access") for ring in drawing["areas"].get(kind, []) for at in ring]
    corners += [corner for one in (*drawing["stored"], *drawing["frames"]) for corner in one["box_m"]]
    (x0, x1), (y0, y1) = ((min(values), max(values)) for values in zip(*corners, strict=True))
    sheet = sheet_for((x0, y0), (x1, y1), _MOST_PX)
    figures = [
        tag("figure", _yard(sheet, drawing, delivery) + tag("figcaption", f"Delivery {delivery}"), "sheet drawing")
        for delivery in deliveries[:_MOST]
    ]
    left_out = len(deliveries) - len(figures)
    more = f" {left_out:,} more deliveries are not drawn." if left_out > 0 else ""
    return section(
        f"Yard, 1 : {number(sheet.scale, str(sheet.scale), 'scale')}",
        paragraph(f"Numbers: lifts; in a stack the first lies on top. Filled: frames of racks.{more}", "faint"),
        tag("div", "".join(figures), "sheets"),
        id="yard",
    )


def _yard(sheet: Sheet, drawing: dict[str, Any], delivery: int) -> str:
    stored = [one for one in drawing["stored"] if one["delivery"] == delivery]
    areas = drawing["areas"]
    parts = [sheet.path(areas[kind], f"area {kind}") for kind in ("yard", "access") if kind in areas]
    parts += [frame_box(sheet, one) for one in drawing["frames"] if one["delivery"] == delivery]
    parts += [stored_box(sheet, one) for one in stored]
    parts += [_label(sheet, group, n) for n, group in enumerate(_stacks(stored))]
    return drawn(sheet, f"Yard, delivery {delivery}", parts)


def _stacks(stored: Sequence[dict[str, Any]]) -> list[list[dict[str, Any]]]:
    """Return the parts in groups that lie on each other, in the order of their lifts."""
    groups: list[list[dict[str, Any]]] = []
    for one in sorted(stored, key=lambda one: one["number"]):
        x, y = _centre_m(one)
        near = (g for g in groups if max(abs(x - _centre_m(g[0])[0]), abs(y - _centre_m(g[0])[1])) < _STACK_M)
        group = next(near, None)
        if group is None:
            groups.append([one])
        else:
            group.append(one)
    return groups


def _label(sheet: Sheet, group: Sequence[dict[str, Any]], n: int) -> str:
    """Return the numbers of a stack along its longer side; of thin parts next to each other not side by side."""
    (x0, y0), (x1, y1) = group[0]["box_m"]
    stands, (x, y) = y1 - y0 > x1 - x0, _centre_m(group[0])
    if min(x1 - x0, y1 - y0) * sheet.px_per_m < _THIN_PX:
        along = (n % 3 - 1) * _APART
        x, y = (x, y + along * (y1 - y0)) if stands else (x + along * (x1 - x0), y)
    x, y = sheet.at((x, y))
    turned = f"rotate(-90 {x:.2f} {y:.2f})" if stands else None
    return text(
        in_ranges(one["number"] for one in group),
        x,
        y + _DOWN_PX,
        class_="halo",
        text_anchor="middle",
        transform=turned,
    )


def _centre_m(one: dict[str, Any]) -> tuple[float, float]:
    (x0, y0), (x1, y1) = one["box_m"]
    return (x0 + x1) / 2.0, (y0 + y1) / 2.0
