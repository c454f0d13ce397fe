"""Plan and elevations of the lift plan to scale, as SVG: one drawing unit is a CSS pixel, 96 of them are 25.4 mm."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from bimvox.rendering.report.html import element, number, paragraph, row, section, table, tag, text, value
from bimvox.rendering.report.plan_view import FIRST, ZONES, frame_box, plan_view, stored_box, storey_words
from bimvox.rendering.report.sheet import Sheet, drawn, grid, label, line, scale_bar, sheet_for, tip
from bimvox.rendering.report.words import fixed, ranges
from bimvox.rendering.words import escape

_MOST_PX = (1030.0, 300.0)
"""What half a landscape A4 page takes."""


def drawings(record: dict[str, Any]) -> str:
    """Return plan and elevations with their legend and distances."""
    drawing = record["drawing"]
    shown = [("Plan", *plan_view(drawing))]
    if drawing["cranes"]:
        shown.append(("Plan of building and yard", *plan_view(drawing, detail=True)))
    shown += [
        (words, *_elevation(drawing, axis)) for axis, words in ((0, "Elevation along +y"), (1, "Elevation along -x"))
    ]
    sheets = [
        tag("figure", svg + tag("figcaption", f"{words}, 1 : {number(scale, str(scale), 'scale')}"), "sheet drawing")
        for words, svg, scale in shown
    ]
    rows = [row([escape(one["name"]), value(one, "distance_m", 2)]) for one in drawing["distances_m"]]
    north = drawing["north"]
    about = (
        "Site coordinates in metres. Capacities at radii are gross: gear and hook block count as load. "
        "The stated scale holds on paper printed at 100 %; the scale bar always holds. "
        "Building and structure are drawn by the convex hull of each part. "
        + ("The model does not state north." if north is None else f"The arrow is {north['kind']}.")
    )
    return section(
        "Drawings", _legend(drawing), tag("div", "".join(sheets), "sheets"), paragraph(about, "faint"),
        table(("Shortest distance on plan", "m"), rows, class_="words narrow", id_="distances"),
        id="drawings",
    )  # fmt: skip


def _legend(drawing: dict[str, Any]) -> str:
    items = (
        tag("li", element("svg", element("rect", width=28, height=12, class_=f"area {key}"), viewBox="0 0 28 12",
                          class_="key") + escape(words))
        for key, words in legend_names(drawing).items()
    )  # fmt: skip
    return tag("ul", "".join(items), "legend")


def legend_names(drawing: dict[str, Any]) -> dict[str, str]:
    """Return what the areas on the drawings are, by their class."""
    names = {"building": "building, by storey", "construction": "construction area", "yard": "yard"}
    names |= {"excavation": "excavation"} if "excavation" in drawing["areas"] else {}
    names |= {"access": "access of trucks"} if "access" in drawing["areas"] else {}
    names |= {kind: words for kind, words in ZONES.items() if kind in drawing["areas"]}
    deliveries = len({one["delivery"] for one in drawing["stored"]})
    names |= {"stored": f"parts in the yard, delivery {FIRST} of {deliveries}"} if deliveries else {}
    names |= {"frame": "frame of a rack"} if any(one["delivery"] == FIRST for one in drawing["frames"]) else {}
    names |= {"obstruction": "obstruction"} if drawing["obstructions"] else {}
    names |= {"heavy": "heaviest parts, numbered"} if drawing.get("heavy") else {}
    names |= {"structure": "existing structure"} if drawing["structure"]["plan"] else {}
    names |= {"below": "exclusion zone below the loads (no person)"} if drawing["below_loads"] else {}
    names |= {"falling": "reach of a falling load"} if drawing["falling_loads"] else {}
    stands = list(dict.fromkeys(crane["base"]["words"] for crane in drawing["cranes"]))
    names |= {"foundation": "; ".join(stands)} if stands else {}
    names |= {"oversail": "swept by the jib"} if drawing["cranes"] else {}
    return names


def _elevation(drawing: dict[str, Any], axis: int) -> tuple[str, int]:
    """Return an elevation along x (axis 0) or y (axis 1), and its scale."""
    name, low, high = ("front", "side")[axis], *(at for at in drawing["extent_m"])
    left, right, top = low[axis], high[axis], max([high[2], *(crane["highest_m"] for crane in drawing["cranes"])])
    for crane in drawing["cranes"]:
        reach = crane["jib_m"][0]
        left, right = min(left, crane["base_m"][axis] - reach), max(right, crane["base_m"][axis] + reach)
    deep = min([0.0, *(crane["base_m"][2] - crane["base"]["deep_m"] for crane in drawing["cranes"])])
    sheet = sheet_for((left, deep), (right, top), _MOST_PX)
    parts = grid(sheet, ("xy"[axis], "z"))
    parts.append(sheet.path(drawing["structure"][name], "area structure"))
    for one in drawing["storeys"]:
        parts.append(sheet.path(one[name], "area building", tip(storey_words(one))))
        parts.append(label(sheet.at((right, one["low_m"])), one["name"][:40], -2.0, -2.0, "end"))
    for one in drawing["obstructions"]:
        (a, c), (b, d) = ((at[axis], at[2]) for at in one["box_m"])
        parts.append(sheet.path([[(a, c), (b, c), (b, d), (a, d)]], "area obstruction", tip(one["id"])))
    for crane in drawing["cranes"]:
        parts += _crane_from_the_side(sheet, crane, axis)
    ground = [sheet.at((left, 0.0)), sheet.at((right, 0.0))]
    parts.append(line(ground[0], ground[1], "ground"))
    parts += scale_bar(sheet)
    return drawn(sheet, f"Elevation, {'xy'[axis]} and z", parts), sheet.scale


def _crane_from_the_side(sheet: Sheet, crane: dict[str, Any], axis: int) -> list[str]:
    """Return mast and jib, and the heights of jib and hook."""
    at, foot, half = crane["base_m"][axis], crane["base_m"][2], crane["mast_m"] / 2.0
    reach, low, high = crane["jib_m"]
    tail, hook_m = crane["tail_m"], crane["hook_height_m"]
    mast = [(at - half, foot), (at + half, foot), (at + half, low), (at - half, low)]
    jib = [(at - tail, low), (at + reach, low), (at + reach, low + 0.4 * (high - low)), (at, high), (at - tail, high)]
    edges = [corner[axis] for ring in crane["base"]["plan"] for corner in ring]
    ends, deep = (min(edges), max(edges)), foot - crane["base"]["deep_m"]
    base = [(ends[0], foot), (ends[1], foot), (ends[1], deep), (ends[0], deep)]
    parts = [sheet.path([base], "area foundation", tip(crane["base"]["words"])) if deep < foot else ""]
    parts += [sheet.path([jib], "jib", tip(crane["name"])), sheet.path([mast], "mast")]
    parts.append(line(sheet.at((at - tail, hook_m)), sheet.at((at + reach, hook_m)), "ring"))
    if crane["below_jib_m"] is not None:
        under = (at + reach / 2.0, low)
        lowest = (under[0], low - crane["below_jib_m"])
        parts.append(line(sheet.at(under), sheet.at(lowest), "dimension"))
        words = f"{fixed(crane['below_jib_m'], 2)} m, building's top to jib"
        parts.append(label(sheet.at((under[0], low - 0.4 * crane["below_jib_m"])), words, 4.0, 3.0))
    words = f"highest hook {fixed(hook_m, 2)} m"
    parts.append(label(sheet.at((at - tail, hook_m)), words, -3.0, 3.0, "end"))
    return parts


# Drawings of the yard in the report: what lies where when a delivery is unloaded.

_YARD_MOST_PX = (340.0, 300.0)
"""Six drawings, three side by side, fit a landscape A4 page."""
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
    sheet = sheet_for((x0, y0), (x1, y1), _YARD_MOST_PX)
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
        ", ".join(ranges(one["number"] for one in group)),
        x,
        y + _DOWN_PX,
        class_="halo",
        text_anchor="middle",
        transform=turned,
    )


def _centre_m(one: dict[str, Any]) -> tuple[float, float]:
    (x0, y0), (x1, y1) = one["box_m"]
    return (x0 + x1) / 2.0, (y0 + y1) / 2.0
