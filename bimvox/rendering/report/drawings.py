"""Plan and elevations of the lift plan to scale, as SVG: one drawing unit is a CSS pixel, 96 of them are 25.4 mm."""

from __future__ import annotations

from typing import Any

from bimvox.rendering.plain import escape
from bimvox.rendering.report.html import number, paragraph, row, section, table, tag
from bimvox.rendering.report.plan_view import FIRST, ZONES, plan_view, storey_words
from bimvox.rendering.report.sheet import Sheet, drawn, grid, label, line, scale_bar, sheet_for, tip
from bimvox.rendering.report.svg import element
from bimvox.rendering.report.words import fixed

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
    rows = [
        row([escape(one["name"]), number(one["distance_m"], fixed(one["distance_m"], 2), "distance_m")])
        for one in drawing["distances_m"]
    ]
    north = drawing["north"]
    about = (
        "Site coordinates in metres. The stated scale holds on paper printed at 100 %; the scale bar always holds. "
        "Building and structure are drawn by the convex hull of each part. "
        + ("The model does not state north." if north is None else f"The arrow is {north['kind']}.")
    )
    return section(
        "Drawings", _legend(drawing), *sheets, paragraph(about, "faint"),
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
    names |= {"oversail": "swept by the jib"} if drawing["cranes"] else {}
    return names


def _elevation(drawing: dict[str, Any], axis: int) -> tuple[str, int]:
    """Return an elevation along x (axis 0) or y (axis 1), and its scale."""
    name, low, high = ("front", "side")[axis], *(at for at in drawing["extent_m"])
    left, right, top = low[axis], high[axis], max([high[2], *(crane["highest_m"] for crane in drawing["cranes"])])
    for crane in drawing["cranes"]:
        reach = crane["jib_m"][0]
        left, right = min(left, crane["base_m"][axis] - reach), max(right, crane["base_m"][axis] + reach)
    sheet = sheet_for((left, 0.0), (right, top), _MOST_PX)
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
    parts = [sheet.path([jib], "jib", tip(crane["name"])), sheet.path([mast], "mast")]
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
