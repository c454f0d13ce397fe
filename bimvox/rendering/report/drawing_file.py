"""A site's plan as an SVG file of its own: with its heading, legend and styles, legible on light and on dark ground."""

from __future__ import annotations

import re
from importlib.resources import files
from textwrap import wrap
from typing import Any

from bimvox.rendering.report.drawings import legend_names
from bimvox.rendering.report.html import element, picture, text
from bimvox.rendering.report.plan_view import heavy_words, plan_parts, shows_all, title_of
from bimvox.rendering.report.sheet import shortened, width_px
from bimvox.rendering.report.words import fixed, length, tonnes
from bimvox.rendering.words import counted, plain

_LEFT_PX = 24.0
_LINE_PX = 15.0
_TITLE_PX, _TEXT_PX = 16.0, 10.0
_TITLE_Y_PX = _LEFT_PX + _TITLE_PX
_LEAST_PX = 640.0
_MOST_PX = 1500.0
"""Views that are wider together stand one below the other; a landscape A3 page is 1587 wide."""
_KEY_PX = (28.0, 12.0)


def drawing_file(drawing: dict[str, Any], name: str) -> bytes:
    """Return the drawing of a site as SVG; on paper it is as large as its scales say.

    ``drawing``: from ``site_drawing.drawing_of_site``; ``name``: of the site.
    """
    one = shows_all(drawing)
    details = (False,) if one else (False, True)
    views = [(title_of(detail=detail), *plan_parts(drawing, detail=detail, named=one)) for detail in details]
    sizes = [sheet.size_px for _, sheet, _ in views]
    abreast = sum(wide for wide, _ in sizes) + _LEFT_PX * (len(views) - 1) <= _MOST_PX
    room = max(_LEAST_PX, sum(wide for wide, _ in sizes) + _LEFT_PX if abreast else max(wide for wide, _ in sizes))
    heading = text(
        shortened(f"{name}: site", int(room / width_px("m", _TITLE_PX))), _LEFT_PX, _TITLE_Y_PX, class_="title"
    )
    parts, y = (
        [element("style", style()), element("rect", width="100%", height="100%", class_="paper"), heading],
        _TITLE_Y_PX,
    )
    for line in wrap(plain(" · ".join(_facts(drawing))), int(room / width_px("m", _TEXT_PX))):
        y += _LINE_PX
        parts.append(text(line, _LEFT_PX, y, class_="faint"))
    x = _LEFT_PX
    for (words, sheet, inside), (wide, high) in zip(views, sizes, strict=True):
        parts.append(text(f"{words}, 1 : {sheet.scale}", x, y + 2.0 * _LINE_PX, class_="view"))
        place = f"translate({x:.2f} {y + 2.0 * _LINE_PX:.2f})"
        parts.append(element("g", *inside, transform=place, class_="sheet"))
        x, y = (x + wide + _LEFT_PX, y) if abreast else (x, y + 2.0 * _LINE_PX + high)
    y += _LINE_PX + (2.0 * _LINE_PX + max(high for _, high in sizes) if abreast else 0.0)
    legend, y = _legend(drawing, y, _LEFT_PX + room)
    width, height = room + 2.0 * _LEFT_PX, y + _LEFT_PX
    svg = picture(width, height, f"{name}: plan of the site", [*parts, *legend], "drawing")
    sized = f'<svg xmlns="http://www.w3.org/2000/svg" width="{width:.2f}" height="{height:.2f}" '
    return svg.replace("<svg ", sized, 1).encode() + b"\n"


def _legend(drawing: dict[str, Any], y: float, right: float) -> tuple[list[str], float]:
    """Return the legend and the names of the heaviest parts in rows, and where they end."""
    parts, x = list[str](), _LEFT_PX
    for key, words in legend_names(drawing).items():
        wide = _KEY_PX[0] + 8.0 + width_px(words, _TEXT_PX) + 12.0
        if x + wide > right:
            x, y = _LEFT_PX, y + 1.4 * _LINE_PX
        parts.append(element("rect", x=x, y=y, width=_KEY_PX[0], height=_KEY_PX[1], class_=f"area {key}"))
        parts.append(text(words, x + _KEY_PX[0] + 8.0, y + 10.0))
        x += wide
    x, y = _LEFT_PX, y + 2.2 * _LINE_PX
    for one in drawing["heavy"]:
        words = f"{one['number']}: {heavy_words(one)}"
        wide = width_px(words, _TEXT_PX) + 12.0
        if x > _LEFT_PX and x + wide > right:
            x, y = _LEFT_PX, y + _LINE_PX
        parts.append(text(words, x, y, class_="heaviest"))
        x += wide
    return parts, y


def style() -> str:
    """Return the rules of the report's style sheet that its drawings need."""
    rules = files("bimvox.rendering.report").joinpath("report.css").read_text("utf-8")
    light, dark = re.findall(r":root \{([^}]*)\}", rules)[:2]
    own = [line for line in rules.splitlines() if line.startswith("svg .")]
    return "\n".join(
        [
            "",
            f":root {{{light}}}",
            f"@media screen and (prefers-color-scheme: dark) {{ :root {{{dark}}} }}",
            ":root { font-size: 10px; fill: var(--ink); }",
            *own,
            "",
        ]
    )


def _facts(drawing: dict[str, Any]) -> list[str]:
    """Return what the heading says: cranes, parts, frame."""
    result = []
    for crane in drawing["cranes"]:
        x, y, _ = crane["base_m"]
        reach_m = crane["rings"][-1][0]
        result.append(f"{crane['name']} at ({fixed(x, 2)}, {fixed(y, 2)}), radius {length(reach_m)}")
    parts = f"{counted(drawing['lifted'], 'part')} to lift"
    result.append(parts + (f", the heaviest {tonnes(drawing['heavy'][0]['mass_kg'])} t" if drawing["heavy"] else ""))
    if drawing["ground"][0] is not None:
        height_m, why = drawing["ground"]
        result.append(f"the ground is at {fixed(height_m, 2)} m in the model" + (why and f", {why}"))
    result += ["parts by their convex hulls", "site coordinates in metres"]
    survey, north = drawing["survey"], drawing["north"]
    if survey is not None:
        result.append(f"E, N: {survey['crs'] or 'map of the model'}")
    result.append("the model does not state north" if north is None else f"the arrow is {north['kind']}")
    return result
