"""Plan and elevations of the lift plan to scale, as SVG: one drawing unit is a CSS pixel, 96 of them are 25.4 mm."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import atan2, cos, degrees, pi, sin
from typing import Any

from bimvox.rendering.plain import escape
from bimvox.rendering.report.html import number, paragraph, row, section, table, tag
from bimvox.rendering.report.svg import element, picture, text, ticks
from bimvox.rendering.report.words import fixed, tonnes
from bimvox.rendering.words import counted

PX_PER_M_AT_1 = 96.0 / 0.0254
"""Drawing units of a metre on paper."""
SCALES = (20, 50, 100, 200, 250, 300, 400, 500, 750, 1000, 1500, 2000, 2500, 5000, 10000)
_MOST_PX = {"plan": (1030.0, 640.0), "front": (1030.0, 300.0), "side": (1030.0, 300.0)}
"""What fits a landscape A4 page."""
_MARGIN_PX = 46.0
_GRID_M = (1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0)
FIRST = 1
"""The delivery whose parts are drawn in the plans; each has its own drawing of the yard."""
_ZONES = {
    "prohibited": "no hook above",
    "no_load": "no load above",
    "limiter": "hook height limited",
    "slow": "reduced rates",
}


@dataclass(frozen=True, slots=True)
class Sheet:
    """A drawing's place on the paper.

    Attributes:
        low_m: Lowest values of its two axes.
        high_m: Highest values.
        scale: Its scale, 1 to this number.
    """

    low_m: tuple[float, float]
    high_m: tuple[float, float]
    scale: int

    @property
    def px_per_m(self) -> float:
        """Drawing units of a metre."""
        return PX_PER_M_AT_1 / self.scale

    @property
    def size_px(self) -> tuple[float, float]:
        """Width and height with margins."""
        return (
            (self.high_m[0] - self.low_m[0]) * self.px_per_m + 2.0 * _MARGIN_PX,
            (self.high_m[1] - self.low_m[1]) * self.px_per_m + 2.0 * _MARGIN_PX,
        )

    def at(self, point: Sequence[float]) -> tuple[float, float]:
        """Return the place of a point on the drawing; its second axis points up."""
        return (
            _MARGIN_PX + (point[0] - self.low_m[0]) * self.px_per_m,
            _MARGIN_PX + (self.high_m[1] - point[1]) * self.px_per_m,
        )

    def path(self, rings: Sequence[Sequence[Sequence[float]]], class_: str, *inside: str) -> str:
        """Return an outline as a path; empty without rings."""
        drawn = "".join(
            "M" + "L".join("{:.2f} {:.2f}".format(*self.at(corner)) for corner in ring) + "Z" for ring in rings
        )
        return element("path", *inside, d=drawn, class_=class_, fill_rule="evenodd") if drawn else ""


def sheet_for(low_m: tuple[float, float], high_m: tuple[float, float], most_px: tuple[float, float]) -> Sheet:
    """Return a sheet with the largest of the usual scales that fits."""
    sheets = [Sheet(low_m, high_m, scale) for scale in SCALES]
    fits = (one for one in sheets if all(own <= most for own, most in zip(one.size_px, most_px, strict=True)))
    return next(fits, sheets[-1])


def drawings(record: dict[str, Any]) -> str:
    """Return plan and elevations with their legend and distances."""
    drawing = record["drawing"]
    shown = [("Plan", *_plan(drawing))]
    if drawing["cranes"]:
        shown.append(("Plan of building and yard", *_plan(drawing, detail=True)))
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
    names = {"building": "building, by storey", "construction": "construction area", "yard": "yard"}
    names |= {"access": "access of trucks"} if "access" in drawing["areas"] else {}
    names |= {kind: words for kind, words in _ZONES.items() if kind in drawing["areas"]}
    deliveries = len({one["delivery"] for one in drawing["stored"]})
    names |= {"stored": f"parts in the yard, delivery {FIRST} of {deliveries}"} if deliveries else {}
    names |= {"frame": "frame of a rack"} if any(one["delivery"] == FIRST for one in drawing["frames"]) else {}
    names |= {"obstruction": "obstruction"} if drawing["obstructions"] else {}
    names |= {"structure": "existing structure"} if drawing["structure"]["plan"] else {}
    names |= {"below": "exclusion zone below the loads (no person)"} if drawing["below_loads"] else {}
    names |= {"falling": "reach of a falling load"} if drawing["falling_loads"] else {}
    names |= {"oversail": "swept by the jib"} if drawing["cranes"] else {}
    items = (
        tag("li", element("svg", element("rect", width=28, height=12, class_=f"area {key}"), viewBox="0 0 28 12",
                          class_="key") + escape(words))
        for key, words in names.items()
    )  # fmt: skip
    return tag("ul", "".join(items), "legend")


def _plan(drawing: dict[str, Any], *, detail: bool = False) -> tuple[str, int]:
    """Return the plan and its scale: with the sweep of the jib and the reach of falling loads, or of the site."""
    (x0, y0, _), (x1, y1, _) = drawing["extent_m"]
    for crane in () if detail else drawing["cranes"]:
        (x, y, _), reach = crane["base_m"], crane["jib_m"][0]
        x0, y0, x1, y1 = min(x0, x - reach), min(y0, y - reach), max(x1, x + reach), max(y1, y + reach)
    for x, y in () if detail else (at for ring in drawing["falling_loads"] for at in ring):
        x0, y0, x1, y1 = min(x0, x), min(y0, y), max(x1, x), max(y1, y)
    sheet = sheet_for((x0, y0), (x1, y1), _MOST_PX["plan"])
    parts = [_circle(sheet, crane["base_m"], crane["jib_m"][0], "area oversail") for crane in drawing["cranes"]]
    parts += [] if detail else _grid(sheet, ("x", "y"))
    areas = drawing["areas"]
    parts += [sheet.path(areas[kind], f"area {kind}") for kind in ("construction", "yard", "access") if kind in areas]
    parts.append(sheet.path(drawing["falling_loads"], "area falling"))
    parts.append(sheet.path(drawing["below_loads"], "area below"))
    parts += [sheet.path(areas[kind], f"area {kind}", _tip(words)) for kind, words in _ZONES.items() if kind in areas]
    parts.append(sheet.path(drawing["structure"]["plan"], "area structure"))
    parts += [sheet.path(one["plan"], "area building", _tip(_storey(one))) for one in drawing["storeys"]]
    parts += [frame_box(sheet, one) for one in drawing["frames"] if one["delivery"] == FIRST]
    parts += [stored_box(sheet, one) for one in drawing["stored"] if one["delivery"] == FIRST]
    for one in drawing["obstructions"]:
        parts += [sheet.path(one["outline"], "area obstruction", _tip(one["id"]))]
        parts.append(_label(sheet.at(one["box_m"][0][:2]), one["id"][:24], 0.0, 10.0))
    labels = []
    for crane in drawing["cranes"]:
        towards_rad = _free_direction(drawing, crane)
        parts += _crane_on_plan(sheet, crane, towards_rad)
        labels += _crane_labels(sheet, crane, towards_rad)
    if detail or not drawing["cranes"]:  # at the scale of the whole sweep they would cover each other
        parts += [_dimension(sheet, one) for one in drawing["distances_m"]]
    parts += labels  # last, so that no line covers them
    if detail:
        parts = _clipped(sheet, parts)
        parts += _grid(sheet, ("x", "y"))
    parts += [*_scale_bar(sheet), _north(sheet, drawing["north"])]
    return drawn(sheet, "Plan of building and yard" if detail else "Plan", parts), sheet.scale


def _clipped(sheet: Sheet, parts: Sequence[str]) -> list[str]:
    """Return what lies inside the sheet's margins."""
    width, height = sheet.size_px
    inside = element("rect", x=_MARGIN_PX, y=_MARGIN_PX, width=width - 2 * _MARGIN_PX, height=height - 2 * _MARGIN_PX)
    return [element("clipPath", inside, id="detail"), element("g", *parts, clip_path="url(#detail)")]


def _elevation(drawing: dict[str, Any], axis: int) -> tuple[str, int]:
    """Return an elevation along x (axis 0) or y (axis 1), and its scale."""
    name, low, high = ("front", "side")[axis], *(at for at in drawing["extent_m"])
    left, right, top = low[axis], high[axis], max([high[2], *(crane["highest_m"] for crane in drawing["cranes"])])
    for crane in drawing["cranes"]:
        reach = crane["jib_m"][0]
        left, right = min(left, crane["base_m"][axis] - reach), max(right, crane["base_m"][axis] + reach)
    sheet = sheet_for((left, 0.0), (right, top), _MOST_PX[name])
    parts = _grid(sheet, ("xy"[axis], "z"))
    parts.append(sheet.path(drawing["structure"][name], "area structure"))
    for one in drawing["storeys"]:
        parts.append(sheet.path(one[name], "area building", _tip(_storey(one))))
        parts.append(_label(sheet.at((right, one["low_m"])), one["name"][:40], -2.0, -2.0, "end"))
    for one in drawing["obstructions"]:
        (a, c), (b, d) = ((at[axis], at[2]) for at in one["box_m"])
        parts.append(sheet.path([[(a, c), (b, c), (b, d), (a, d)]], "area obstruction", _tip(one["id"])))
    for crane in drawing["cranes"]:
        parts += _crane_from_the_side(sheet, crane, axis)
    ground = [sheet.at((left, 0.0)), sheet.at((right, 0.0))]
    parts.append(_line(ground[0], ground[1], "ground"))
    parts += _scale_bar(sheet)
    return drawn(sheet, f"Elevation, {'xy'[axis]} and z", parts), sheet.scale


def _crane_on_plan(sheet: Sheet, crane: dict[str, Any], towards_rad: float) -> list[str]:
    """Return mast, jib, sweep of the counter-jib, and the radii."""
    (x, y, _), half = crane["base_m"], crane["mast_m"] / 2.0
    parts = [_circle(sheet, crane["base_m"], crane["tail_m"], "tail", _tip("sweep of the counter-jib"))]
    for radius_m, mass_kg in crane["rings"]:
        parts.append(_circle(sheet, crane["base_m"], radius_m, "ring", _tip(f"{radius_m:g} m: {tonnes(mass_kg)} t")))
    ends = [(x - crane["tail_m"] * cos(towards_rad), y - crane["tail_m"] * sin(towards_rad))]
    ends.append((x + crane["jib_m"][0] * cos(towards_rad), y + crane["jib_m"][0] * sin(towards_rad)))
    parts.append(_line(sheet.at(ends[0]), sheet.at(ends[1]), "jib"))
    for angle in crane["slew_rad"] or ():
        end = (x + crane["jib_m"][0] * cos(angle), y + crane["jib_m"][0] * sin(angle))
        parts.append(_line(sheet.at((x, y)), sheet.at(end), "range"))
    mast = [(x - half, y - half), (x + half, y - half), (x + half, y + half), (x - half, y + half)]
    return [*parts, sheet.path([mast], "mast", _tip(crane["name"]))]


def _crane_labels(sheet: Sheet, crane: dict[str, Any], towards_rad: float) -> list[str]:
    """Return the capacities at the radii, next to the jib, and the crane's name with its coordinates."""
    (x, y, _), half, parts = crane["base_m"], crane["mast_m"] / 2.0, []
    for radius_m, mass_kg in crane["rings"]:
        at = sheet.at((x + radius_m * cos(towards_rad), y + radius_m * sin(towards_rad)))
        words = f"{radius_m:g} m: {fixed(mass_kg / 1000.0, 2)} t"
        parts.append(_label(at, words, 4.0, -3.0, "start", "halo ringed"))
    words = f"{crane['name'][:28]} ({fixed(x, 2)}, {fixed(y, 2)})"
    # A name that would begin outside the sheet begins at the mast.
    below = towards_rad <= pi  # away from the labels along the jib
    foot, wide = sheet.at((x, y - half if below else y + half)), 6.0 * len(words)
    inside = _MARGIN_PX + wide / 2.0 < foot[0] < sheet.size_px[0] - _MARGIN_PX - wide / 2.0
    anchor = "middle" if inside else "start" if foot[0] < sheet.size_px[0] / 2.0 else "end"
    parts.append(_label(foot, words, 0.0, 12.0 if below else -5.0, anchor))
    return parts


def _crane_from_the_side(sheet: Sheet, crane: dict[str, Any], axis: int) -> list[str]:
    """Return mast and jib, and the heights of jib and hook."""
    at, foot, half = crane["base_m"][axis], crane["base_m"][2], crane["mast_m"] / 2.0
    reach, low, high = crane["jib_m"]
    tail, hook_m = crane["tail_m"], crane["hook_height_m"]
    mast = [(at - half, foot), (at + half, foot), (at + half, low), (at - half, low)]
    jib = [(at - tail, low), (at + reach, low), (at + reach, low + 0.4 * (high - low)), (at, high), (at - tail, high)]
    parts = [sheet.path([jib], "jib", _tip(crane["name"])), sheet.path([mast], "mast")]
    parts.append(_line(sheet.at((at - tail, hook_m)), sheet.at((at + reach, hook_m)), "ring"))
    if crane["below_jib_m"] is not None:
        under = (at + reach / 2.0, low)
        lowest = (under[0], low - crane["below_jib_m"])
        parts.append(_line(sheet.at(under), sheet.at(lowest), "dimension"))
        words = f"{fixed(crane['below_jib_m'], 2)} m, building's top to jib"
        parts.append(_label(sheet.at((under[0], low - 0.4 * crane["below_jib_m"])), words, 4.0, 3.0))
    label = f"highest hook {fixed(hook_m, 2)} m"
    parts.append(_label(sheet.at((at - tail, hook_m)), label, -3.0, 3.0, "end"))
    return parts


def _free_direction(drawing: dict[str, Any], crane: dict[str, Any]) -> float:
    """Return the direction away from building and yard, in which labels of the radii are legible."""
    x, y, _ = crane["base_m"]
    corners = [at for ring in _rings_of(drawing) for at in ring]
    if not corners:
        return pi / 2.0
    busy = [atan2(at[1] - y, at[0] - x) for at in corners]
    # Labels are horizontal: along a steep ray they do not cover each other.
    options = [side * pi + pi * n / 12.0 for side in (0, 1) for n in range(4, 9)]
    apart = [min(abs((angle - one + pi) % (2.0 * pi) - pi) for one in busy) for angle in options]
    return options[max(range(len(options)), key=lambda n: (round(apart[n], 6), -n))]


def _rings_of(drawing: dict[str, Any]) -> list[Any]:
    rings: list[Any] = [ring for one in drawing["storeys"] for ring in one["plan"]]
    return [*rings, *(ring for kind in ("yard", "access") for ring in drawing["areas"].get(kind, []))]


def _grid(sheet: Sheet, names: tuple[str, str]) -> list[str]:
    """Return the grid in metres with its coordinates."""
    (x0, y0), (x1, y1) = sheet.low_m, sheet.high_m
    parts, width, height = [], *sheet.size_px
    for value in ticks(x0, x1, 14, _GRID_M):
        x = sheet.at((value, y0))[0]
        parts.append(_line((x, _MARGIN_PX), (x, height - _MARGIN_PX), "grid"))
        parts.append(_label((x, height - _MARGIN_PX), fixed(value, 0), 0.0, 14.0, "middle", "tick"))
    for value in ticks(y0, y1, 10, _GRID_M):
        y = sheet.at((x0, value))[1]
        parts.append(_line((_MARGIN_PX, y), (width - _MARGIN_PX, y), "grid"))
        parts.append(_label((_MARGIN_PX, y), fixed(value, 0), -6.0, 4.0, "end", "tick"))
    parts.append(_label((width / 2.0, height), f"{names[0]}, m", 0.0, -14.0, "middle", "axis"))
    parts.append(_label((0.0, _MARGIN_PX), f"{names[1]}, m", 4.0, -8.0, "start", "axis"))
    return parts


def _scale_bar(sheet: Sheet) -> list[str]:
    """Return a scale bar at the top left."""
    length_m = max((step for step in _GRID_M if step * sheet.px_per_m <= 200.0), default=_GRID_M[0])
    x, y, length = _MARGIN_PX, 20.0, length_m * sheet.px_per_m
    ends = [_line((at, y - 4.0), (at, y + 4.0), "bar") for at in (x, x + length / 2.0, x + length)]
    words = f"{length_m:g} m · 1 : {sheet.scale}"
    bar = element("line", x1=x, x2=x + length, y1=y, y2=y, class_="bar scale-bar", data_length_m=length_m)
    return [bar, *ends, _label((x + length, y), words, 8.0, 4.0, "start")]


def _north(sheet: Sheet, north: dict[str, Any] | None) -> str:
    """Return the north arrow at the top right; empty if north is not known."""
    if north is None:
        return ""
    turned = 90.0 - degrees(north["angle_rad"])
    arrow = element("path", d="M0 -18L6 12L0 6L-6 12Z", class_="north", transform=f"rotate({turned:.3f})")
    name = text("N" if north["kind"] == "true north" else "N (map)", 14.0, 4.0, class_="label")
    return element("g", arrow, name, transform=f"translate({sheet.size_px[0] - 80.0:.1f} 24)")


def _dimension(sheet: Sheet, one: dict[str, Any]) -> str:
    """Return a distance between two points, with its ends."""
    first, last = (sheet.at(at) for at in one["ends_m"])
    middle = ((first[0] + last[0]) / 2.0, (first[1] + last[1]) / 2.0)
    words = f"{fixed(one['distance_m'], 2)} m"
    dots = [element("circle", cx=at[0], cy=at[1], r=1.8, class_="end") for at in (first, last)]
    line = _line(first, last, "dimension")
    return element("g", _tip(f"{one['name']}: {words}"), line, *dots, _label(middle, words, 4.0, -3.0, "start"))


def stored_box(sheet: Sheet, one: dict[str, Any]) -> str:
    """Return the outline of a part in the yard."""
    return _box(sheet, one, "stored", f"lift {one['number']}, delivery {one['delivery']}")


def frame_box(sheet: Sheet, one: dict[str, Any]) -> str:
    """Return the outline of a rack's frame."""
    return _box(sheet, one, "frame", f"frame of rack {one['rack']}, delivery {one['delivery']}")


def _box(sheet: Sheet, one: dict[str, Any], kind: str, words: str) -> str:
    (x0, y0), (x1, y1) = one["box_m"]
    return sheet.path([[(x0, y0), (x1, y0), (x1, y1), (x0, y1)]], f"area {kind}", _tip(words))


def _storey(one: dict[str, Any]) -> str:
    name = one["name"] or "no storey"
    return f"{name}: {counted(one['parts'], 'part')}, z {fixed(one['low_m'], 2)} to {fixed(one['high_m'], 2)} m"


def _circle(sheet: Sheet, centre: Sequence[float], radius_m: float, class_: str, *inside: str) -> str:
    x, y = sheet.at(centre[:2])
    return element("circle", *inside, cx=x, cy=y, r=radius_m * sheet.px_per_m, class_=class_)


def _line(first: tuple[float, float], last: tuple[float, float], class_: str) -> str:
    return element("line", x1=first[0], y1=first[1], x2=last[0], y2=last[1], class_=class_)


def _label(
    at: tuple[float, float], words: str, right: float, down: float, anchor: str = "start", class_: str = "halo"
) -> str:
    return text(words, at[0] + right, at[1] + down, text_anchor=anchor, class_=f"label {class_}")


def _tip(words: str) -> str:
    return element("title", escape(words))


def drawn(sheet: Sheet, title: str, parts: Sequence[str]) -> str:
    """Return a drawing that is as large on paper as its scale says."""
    width, height = sheet.size_px
    svg = picture(width, height, f"{title}, 1 : {sheet.scale}", parts, "scaled")
    return svg.replace("<svg ", f'<svg width="{width:.2f}" height="{height:.2f}" ', 1)
