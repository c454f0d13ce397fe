"""The plan: a site from above, to scale."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import atan2, cos, pi, sin
from typing import Any

from bimvox.rendering.report.html import element
from bimvox.rendering.report.sheet import (
    MARGIN_PX,
    Label,
    Placed,
    Sheet,
    around,
    circle,
    drawn,
    grid,
    line,
    north_arrow,
    scale_bar,
    sheet_for,
    shortened,
    survey_lines,
    tip,
    width_px,
)
from bimvox.rendering.report.words import fixed, length, tonnes
from bimvox.rendering.words import counted

FIRST = 1
"""The delivery whose parts are drawn in the plans; each has its own drawing of the yard."""
ZONES = {
    "prohibited": "no hook above",
    "no_load": "no load above",
    "limiter": "hook height limited",
    "slow": "reduced rates",
}
_LEAST_PX = 330.0
"""Width that scale bar and north need."""
_MOST_PX = (1030.0, 640.0)
"""What fits a landscape A4 page."""


def plan_view(
    drawing: dict[str, Any], *, detail: bool = False, most_px: tuple[float, float] = _MOST_PX
) -> tuple[str, int]:
    """Return the plan and its scale: with the sweep of the jib and the reach of falling loads, or of the site."""
    sheet, parts = plan_parts(drawing, detail=detail, most_px=most_px)
    return drawn(sheet, title_of(detail=detail), parts), sheet.scale


def title_of(*, detail: bool) -> str:
    """Return the plan's title."""
    return "Plan of building and yard" if detail else "Plan"


def shows_all(drawing: dict[str, Any]) -> bool:
    """Return whether the plan with the whole sweep has the scale of the detail, which is then not needed."""
    return _sheet_of(drawing, detail=False).scale == _sheet_of(drawing, detail=True).scale


def plan_parts(
    drawing: dict[str, Any],
    *,
    detail: bool = False,
    named: bool = False,
    most_px: tuple[float, float] = _MOST_PX,
) -> tuple[Sheet, list[str]]:
    """Return the sheet of the plan and what is drawn on it.

    ``detail``: building and yard only, without the whole sweep of the jib; ``named``: with dimensions and names,
    also if it is not a detail.
    """
    sheet = _sheet_of(drawing, detail=detail, most_px=most_px)
    # At the scale of the whole sweep, names would cover each other.
    whole = detail or named or not drawing["cranes"]
    parts = [circle(sheet, crane["base_m"], crane["jib_m"][0], "area oversail") for crane in drawing["cranes"]]
    parts += [] if detail else grid(sheet, ("x", "y"))
    areas = drawing["areas"]
    parts += [
        sheet.path(areas[kind], f"area {kind}")
        for kind in ("construction", "excavation", "yard", "access")
        if kind in areas
    ]
    parts.append(sheet.path(drawing["falling_loads"], "area falling"))
    parts.append(sheet.path(drawing["below_loads"], "area below"))
    parts += [sheet.path(areas[kind], f"area {kind}", tip(words)) for kind, words in ZONES.items() if kind in areas]
    parts.append(sheet.path(drawing["structure"]["plan"], "area structure"))
    parts += [sheet.path(one["plan"], "area building", tip(storey_words(one))) for one in drawing["storeys"]]
    parts += [sheet.path(one["plan"], "area heavy", tip(heavy_words(one))) for one in drawing.get("heavy", ())]
    parts += [sheet.path(ring, "area part") for ring in drawing.get("parts", ()) if whole]
    parts += [frame_box(sheet, one) for one in drawing["frames"] if one["delivery"] == FIRST]
    parts += [stored_box(sheet, one) for one in drawing["stored"] if one["delivery"] == FIRST]
    parts += [sheet.path(one["outline"], "area obstruction", tip(one["id"])) for one in drawing["obstructions"]]
    parts += (
        [element("polyline", points=_points(sheet, drawing["path_m"]), class_="way")] if "path_m" in drawing else []
    )
    survey, values = survey_lines(sheet, drawing["survey"])
    parts += survey
    width, height = sheet.size_px
    placed = Placed((MARGIN_PX, MARGIN_PX, width - MARGIN_PX, height - MARGIN_PX))
    for value in values:
        placed.keep_clear(value.box)
    for crane in drawing["cranes"]:
        towards_rad = _free_direction(drawing, crane)
        parts += _crane_on_plan(sheet, crane, towards_rad)
        # The name with its coordinates, and the capacities at the radii; a detail does not show every one.
        placed.put(_crane_names(sheet, crane, towards_rad), needed=not detail)
        for radius_m, mass_kg in crane["rings"]:
            placed.put(_ring_labels(sheet, crane, towards_rad, radius_m, mass_kg), needed=not detail)
    for one in drawing["distances_m"] if whole else ():
        parts.append(_dimension(sheet, one))
        placed.put(_dimension_labels(sheet, one), needed=True)
    if whole:
        for one in drawing.get("zones", ()):
            placed.put(around(shortened(one["name"]), sheet.at(one["at_m"])))
        for one in drawing.get("heavy", ()):
            placed.put(around(f"{one['number']}: {tonnes(one['mass_kg'])} t", sheet.at(one["at_m"])))
    for one in drawing["obstructions"]:
        x, y = sheet.at(one["box_m"][0][:2])
        placed.put([Label(shortened(one["id"], 24), (x, y + 10.0)), *around(shortened(one["id"], 24), (x, y))])
    parts += [one.svg for one in placed.labels]  # last, so that no line covers them
    if detail:
        parts = [*grid(sheet, ("x", "y")), *_clipped(sheet, parts)]
    return sheet, [*parts, *(one.svg for one in values), *scale_bar(sheet), north_arrow(sheet, drawing["north"])]


def _points(sheet: Sheet, path_m: Sequence[Sequence[float]]) -> str:
    return " ".join(f"{x:.1f},{y:.1f}" for x, y in map(sheet.at, path_m))


def heavy_words(one: dict[str, Any]) -> str:
    """Return the name and the mass of a part."""
    return f"{shortened(one['name'], 80)}, {tonnes(one['mass_kg'])} t"


def _sheet_of(drawing: dict[str, Any], *, detail: bool, most_px: tuple[float, float] = _MOST_PX) -> Sheet:
    (x0, y0, _), (x1, y1, _) = drawing["extent_m"]
    for crane in () if detail else drawing["cranes"]:
        (x, y, _), reach = crane["base_m"], crane["jib_m"][0]
        x0, y0, x1, y1 = min(x0, x - reach), min(y0, y - reach), max(x1, x + reach), max(y1, y + reach)
    for x, y in () if detail else (at for ring in drawing["falling_loads"] for at in ring):
        x0, y0, x1, y1 = min(x0, x), min(y0, y), max(x1, x), max(y1, y)
    sheet = sheet_for((x0, y0), (x1, y1), most_px)
    more_m = max(0.0, _LEAST_PX - sheet.size_px[0]) / sheet.px_per_m / 2.0
    return replace(sheet, low_m=(x0 - more_m, y0), high_m=(x1 + more_m, y1))


def _clipped(sheet: Sheet, parts: Sequence[str]) -> list[str]:
    """Return what lies inside the sheet's margins."""
    width, height = sheet.size_px
    inside = element("rect", x=MARGIN_PX, y=MARGIN_PX, width=width - 2 * MARGIN_PX, height=height - 2 * MARGIN_PX)
    return [element("clipPath", inside, id="detail"), element("g", *parts, clip_path="url(#detail)")]


def _crane_on_plan(sheet: Sheet, crane: dict[str, Any], towards_rad: float) -> list[str]:
    """Return mast, jib, sweep of the counter-jib, and the radii."""
    (x, y, _), half = crane["base_m"], crane["mast_m"] / 2.0
    parts = [sheet.path(crane["base"]["plan"], "area foundation", tip(f"{crane['name']}: {crane['base']['words']}"))]
    parts.append(circle(sheet, crane["base_m"], crane["tail_m"], "tail", tip("sweep of the counter-jib")))
    for radius_m, mass_kg in crane["rings"]:
        parts.append(circle(sheet, crane["base_m"], radius_m, "ring", tip(f"{length(radius_m)}: {tonnes(mass_kg)} t")))
    ends = [(x - crane["tail_m"] * cos(towards_rad), y - crane["tail_m"] * sin(towards_rad))]
    ends.append((x + crane["jib_m"][0] * cos(towards_rad), y + crane["jib_m"][0] * sin(towards_rad)))
    parts.append(line(sheet.at(ends[0]), sheet.at(ends[1]), "jib"))
    for angle in crane["slew_rad"] or ():
        end = (x + crane["jib_m"][0] * cos(angle), y + crane["jib_m"][0] * sin(angle))
        parts.append(line(sheet.at((x, y)), sheet.at(end), "range"))
    mast = [(x - half, y - half), (x + half, y - half), (x + half, y + half), (x - half, y + half)]
    return [*parts, sheet.path([mast], "mast", tip(crane["name"]))]


def _ring_labels(
    sheet: Sheet, crane: dict[str, Any], towards_rad: float, radius_m: float, mass_kg: float
) -> list[Label]:
    """Return places for the capacity at a radius: next to the jib, then along the ring."""
    words = f"{length(radius_m)}: {fixed(mass_kg / 1000.0, 2)} t"
    result = []
    for turn in (0, *(side * n for n in range(1, 13) for side in (1, -1))):
        angle = towards_rad + turn * pi / 12.0
        x, y = sheet.at((crane["base_m"][0] + radius_m * cos(angle), crane["base_m"][1] + radius_m * sin(angle)))
        result.append(Label(words, (x + 4.0, y - 3.0), "start", "halo ringed"))
    return result


def _crane_names(sheet: Sheet, crane: dict[str, Any], towards_rad: float) -> list[Label]:
    """Return places for the crane's name: on the other side of the mast than the labels along the jib, if possible."""
    (x, y, _), half = crane["base_m"], crane["mast_m"] / 2.0
    words = f"{shortened(crane['name'], 40)} ({fixed(x, 2)}, {fixed(y, 2)})"
    found = []
    for below in (towards_rad <= pi, towards_rad > pi):
        foot_x, foot_y = sheet.at((x, y - half if below else y + half))
        down = 12.0 if below else -5.0
        # A name that would begin outside the sheet begins at the mast.
        wide = width_px(words) / 2.0
        inside = MARGIN_PX + wide < foot_x < sheet.size_px[0] - MARGIN_PX - wide
        anchor = "middle" if inside else "start" if foot_x < sheet.size_px[0] / 2.0 else "end"
        found.append(Label(words, (foot_x, foot_y + down), anchor))
    (left, y), (right, _) = sheet.at((x - half, y)), sheet.at((x + half, y))
    return [*found, Label(words, (right + 4.0, y + 3.0)), Label(words, (left - 4.0, y + 3.0), "end")]


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


def _dimension(sheet: Sheet, one: dict[str, Any]) -> str:
    """Return a distance between two points, with its ends."""
    first, last = (sheet.at(at) for at in one["ends_m"])
    dots = [element("circle", cx=at[0], cy=at[1], r=1.8, class_="end") for at in (first, last)]
    return element("g", tip(f"{one['name']}: {_metres(one)}"), line(first, last, "dimension"), *dots)


def _dimension_labels(sheet: Sheet, one: dict[str, Any]) -> list[Label]:
    """Return places for a distance: along its line, the middle first."""
    (x0, y0), (x1, y1) = (sheet.at(at) for at in one["ends_m"])
    middles = [(x0 + share * (x1 - x0), y0 + share * (y1 - y0)) for share in (0.5, 0.25, 0.75, 0.0, 1.0)]
    places = [(4.0, -3.0, "start"), (4.0, 10.0, "start"), (-4.0, -3.0, "end"), (-4.0, 10.0, "end")]
    return [Label(_metres(one), (x + right, y + down), end) for right, down, end in places for x, y in middles]


def _metres(one: dict[str, Any]) -> str:
    return f"{fixed(one['distance_m'], 2)} m"


def stored_box(sheet: Sheet, one: dict[str, Any]) -> str:
    """Return the outline of a part in the yard."""
    return _box(sheet, one, "stored", f"lift {one['number']}, delivery {one['delivery']}")


def frame_box(sheet: Sheet, one: dict[str, Any]) -> str:
    """Return the outline of a rack's frame."""
    return _box(sheet, one, "frame", f"frame of rack {one['rack']}, delivery {one['delivery']}")


def _box(sheet: Sheet, one: dict[str, Any], kind: str, words: str) -> str:
    (x0, y0), (x1, y1) = one["box_m"]
    return sheet.path([[(x0, y0), (x1, y0), (x1, y1), (x0, y1)]], f"area {kind}", tip(words))


def storey_words(one: dict[str, Any]) -> str:
    """Return a storey's name, its number of parts and its heights."""
    name = one["name"] or "no storey"
    return f"{name}: {counted(one['parts'], 'part')}, z {fixed(one['low_m'], 2)} to {fixed(one['high_m'], 2)} m"
