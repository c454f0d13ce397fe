"""The section of the report about what holds parts: props with their places, by storey, how many, and when they go."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from datetime import datetime, timedelta
from typing import Any

from bimvox.records.plan_dates import PlanDates
from bimvox.records.props import Held
from bimvox.rendering.page.source import Revision
from bimvox.rendering.report.html import element, number, paragraph, row, section, table, tag
from bimvox.rendering.report.sheet import MARGIN_PX, Placed, Sheet, around, drawn, grid, line, scale_bar, sheet_for, tip
from bimvox.rendering.report.words import fixed, ranges
from bimvox.rendering.words import counted, escape
from bimvox.site.areas import PLAN, hull, outline
from bimvox.site.casting import curing_s, work_and_wait_s
from bimvox.site.work import Work, kind_of
from bimvox.units import elapsed

_MOST_PX = (500.0, 420.0)
"""Two drawings side by side fit a landscape A4 page."""
_FOOT_PX = 2.5
_UPRIGHT = frozenset((Work.COLUMN, Work.WALL))
_HOLDS = {
    "bearing": "lie on what carries them",
    "base": "stand on their bases: steel, or hardly higher than thick",
    "neighbours": "are fixed to what they touch: no place for props",
    "nothing": "have nothing in the model that can hold them: a person must say what does",
}


def propped(revision: Revision) -> dict[str, Any] | None:
    """Return what holds the lifted parts, for the record of the report; None if the plan says nothing of it."""
    site, props = revision.plan.site, revision.props
    if not props.held:
        return None
    held = [one.document(site) | _until(revision, one) for one in props.held]
    storeys: dict[str, list[Held]] = {}
    for one in props.propped:
        storeys.setdefault(site.components[one.component].storey or "", []).append(one)
    drawings = []
    for name, those in storeys.items():
        inside = [part for part in site.components if (part.storey or "") == name]
        uprights = [part.mesh for part in inside if kind_of(part) in _UPRIGHT]
        floors = [part.mesh for part in inside if kind_of(part) is Work.SLAB] if not uprights else []
        drawings.append(
            {
                "storey": name,
                "low_m": min(site.components[one.component].mesh.bounds_m[0, 2] for one in those),
                "uprights": [outline(hull(mesh, PLAN)) for mesh in (*uprights, *floors)],
                "props": [
                    {
                        "number": one.order + 1,
                        "head_m": list(prop.head_m),
                        "foot_m": list(prop.foot_m),
                        "type": prop.type,
                    }
                    for one in those
                    for prop in one.props
                ],
            }
        )
    drawings.sort(key=lambda one: (one["low_m"], one["storey"]))
    total = Counter(prop.type for one in props.held for prop in one.props)
    assert site.rules.props is not None
    wind = {"wind_kn_m2": site.rules.props.wind_kn_m2}
    return {**wind, "held": held, "needed": props.needed(), "total": dict(sorted(total.items())), "storeys": drawings}


def _until(revision: Revision, held: Held) -> dict[str, str | None]:
    """Return when people take props away: date and words; None if they stay, or of an extract."""
    times = revision.times
    if times is None or not held.waits_for:
        return {"until_at": None, "until_in_words": None}
    carries = max(_carries(revision, times, n) for n in held.waits_for)
    shifts = times.hours.stretches(carries)
    at = next((max(begins, carries) for begins, ends in shifts if ends > carries), carries)
    return {"until_at": at.isoformat() if times.is_dated else None, "until_in_words": times.in_words(at)}


def _carries(revision: Revision, dates: PlanDates, component: int) -> datetime:
    """Return from when a part carries."""
    site = revision.plan.site
    order = next(lift.order for lift in revision.lifts if lift.component == component)
    part, rules = site.components[component], site.rules
    if order in dates.steps:
        _, wait_s = work_and_wait_s(rules.casting, rules.building, part, part.mass_kg)
    else:
        wait_s = curing_s(rules.curing, part)
    return dates.spans[order][1] + timedelta(seconds=wait_s)


def props(record: dict[str, Any]) -> str:
    """Return the section; empty if the plan says nothing of it."""
    found = record["props"]
    if found is None:
        return ""
    held = found["held"]
    with_props = [one for one in held if one["props"]]
    count = sum(len(one["props"]) for one in with_props)
    about = (
        "A part is released when what stands here holds it. Places are chosen on the model: heads on whole concrete, "
        "feet on whole floors or on blocks on the ground, nothing in the way. Loads: wind of "
        f"{found['wind_kn_m2']:g} kN/m² and 2 % of the weight; in more wind nobody is near. Anchors, the strength of "
        "floor and ground, loads that lie eccentrically on what is propped, and the props themselves are the "
        "designer's to confirm. Taking them away is not in the crew's hours."
    )
    return section(
        f"Props: {count:,} for {counted(len(with_props), 'part')}",
        paragraph(about),
        _types(found),
        _closed(with_props),
        _others(held),
        id="props",
    )


def props_list(record: dict[str, Any]) -> str:
    """Return where the props are, by storey and by part, and when they may be taken away; empty without props."""
    found = record["props"]
    with_props = [] if found is None else [one for one in found["held"] if one["props"]]
    if found is None or not with_props:
        return ""
    return section(
        "Places of props",
        tag("div", "".join(map(_storey, found["storeys"])), "sheets"),
        _steps(with_props),
        _parts(with_props),
        id="prop-places",
    )


def _types(found: dict[str, Any]) -> str:
    rows = [
        row(
            [
                escape(name),
                number(found["needed"][name], f"{found['needed'][name]:,}", "needed"),
                number(count, f"{count:,}", "places"),
            ]
        )
        for name, count in found["total"].items()
    ]
    return table(("Prop", "At the same\ntime at most", "Places\nin all"), rows, class_="words narrow", id_="prop-types")


def _storey(one: dict[str, Any]) -> str:
    corners = [at for rings in one["uprights"] for ring in rings for at in ring]
    corners += [prop[end][:2] for prop in one["props"] for end in ("head_m", "foot_m")]
    (x0, x1), (y0, y1) = ((min(values), max(values)) for values in zip(*corners, strict=True))
    sheet = sheet_for((x0 - 1.0, y0 - 1.0), (x1 + 1.0, y1 + 1.0), _MOST_PX)
    width, height = sheet.size_px
    ways = [(sheet.at(prop["head_m"]), sheet.at(prop["foot_m"])) for prop in one["props"]]
    placed = Placed((MARGIN_PX, MARGIN_PX, width - MARGIN_PX, height - MARGIN_PX), ways)
    parts = [*grid(sheet, ("x", "y")), *(sheet.path(rings, "area structure") for rings in one["uprights"])]
    for prop, (_, (x, y)) in zip(one["props"], ways, strict=True):
        parts += _prop(sheet, prop)
        placed.keep_clear((x - _FOOT_PX, y - _FOOT_PX, x + _FOOT_PX, y + _FOOT_PX))
    without = sum(not _numbered(placed, prop["number"], way) for prop, way in zip(one["props"], ways, strict=True))
    parts += [*scale_bar(sheet), *(one.svg for one in placed.labels)]
    name = one["storey"] or "no storey"
    svg = drawn(sheet, f"Props, {name}", parts)
    words = f"{name}, 1 : {sheet.scale}"
    if without:
        words += f"; {counted(without, 'number')} without room: the table below has every foot"
    return tag("figure", svg + tag("figcaption", escape(words)), "sheet drawing")


def _numbered(placed: Placed, lift: int, way: tuple[tuple[float, float], tuple[float, float]]) -> bool:
    """Write the number of a prop's lift near its foot, otherwise near its middle; return whether there was room."""
    (head_x, head_y), (x, y) = way
    middle = ((head_x + x) / 2.0, (head_y + y) / 2.0)
    at_foot = around(str(lift), (x, y))
    near = [*at_foot[:4], *around(str(lift), middle)[:4]]
    return placed.put(near, off_lines=True) or placed.put(near) or placed.put(at_foot)


def _prop(sheet: Sheet, prop: dict[str, Any]) -> list[str]:
    """Return a prop from above: a line from head to foot, and a circle where it stands."""
    head, foot = sheet.at(prop["head_m"]), sheet.at(prop["foot_m"])
    words = tip(f"lift {prop['number']}: {prop['type']}")
    return [line(head, foot, "prop"), element("circle", words, cx=foot[0], cy=foot[1], r=_FOOT_PX, class_="prop foot")]


def _closed(held: Iterable[dict[str, Any]]) -> str:
    """Return until when shores close the floor below; empty without any."""
    shored = [one for one in held if one["hold"] == "shores"]
    if not shored:
        return ""
    numbers = ", ".join(ranges(one["number"] for one in shored))
    last = max(shored, key=lambda one: one["until_s"])
    until = escape(_when(last))
    return paragraph(f"Shores close the floor below lifts {numbers} to other work until {until} at the latest.")


def _steps(held: Iterable[dict[str, Any]]) -> str:
    """Return the steps in which props are taken away."""
    groups: dict[str, list[dict[str, Any]]] = {}
    for one in sorted(held, key=lambda one: one["until_s"] or 0.0):
        if one["until_s"] is not None:
            groups.setdefault(_when(one), []).append(one)
    rows = []
    for when, those in groups.items():
        last_s, count = max(one["until_s"] for one in those), sum(len(one["props"]) for one in those)
        of = escape(", ".join(ranges(one["number"] for one in those)))
        rows.append(row([number(last_s, when, "until_s"), number(count, f"{count}", "props"), of]))
    return table(("May go from", "Props", "Of lifts"), rows, class_="words narrow", id_="prop-steps") if rows else ""


def _when(held: dict[str, Any]) -> str:
    """Return when props may go, in words; of an extract, whose working days are not known, on the clock of the log."""
    if held["until_s"] is None:
        return "as its designer says"
    return str(held["until_in_words"] or elapsed(held["until_s"]))


def _parts(held: Sequence[dict[str, Any]]) -> str:
    rows = [
        row(
            [
                number(one["number"], str(one["number"]), "number"),
                f"<b>{escape(one['name'] or one['component'])}</b>",
                escape(one["words"]),
                "<br>".join(_ends(prop) for prop in one["props"]),
                escape(_when(one)) if one["until_s"] is None else number(one["until_s"], _when(one), "until_s"),
            ]
        )
        for one in held
    ]
    head = ("Lift", "Part", "Held by", "Head to foot x, y, z m; load", "May go from")
    return tag("div", table(head, rows, class_="words", id_="held"), "wide")


def _ends(prop: dict[str, Any]) -> str:
    head, foot = (", ".join(fixed(at, 2) for at in prop[end]) for end in ("head_m", "foot_m"))
    block = f", block {prop['ballast_kg'] / 1e3:.1f} t" if prop["ballast_kg"] else ""
    return f"{head} to {foot}; {number(prop['load_kn'], fixed(prop['load_kn'], 1), 'load_kn')} kN{block}"


def props_of_lift(record: dict[str, Any], lift: dict[str, Any]) -> str:
    """Return what holds the part of a lift, for its card; empty if the plan says nothing of it."""
    held = next((one for one in (record["props"] or {"held": ()})["held"] if one["component"] == lift["id"]), None)
    if held is None:
        return ""
    until = escape(_when(held))
    places = "".join(f"<br>{_ends(prop)}" for prop in held["props"])
    return escape(held["words"]) + places + (f"<br>may go from {until}" if held["props"] else "")


def _others(held: Iterable[dict[str, Any]]) -> str:
    groups = {hold: [one for one in held if one["hold"] == hold] for hold in _HOLDS}
    items = (
        tag(
            "li",
            f"<b>{len(those):,}</b> {escape(words)}: lifts {escape(', '.join(ranges(o['number'] for o in those)))}",
        )
        for hold, words in _HOLDS.items()
        if (those := groups[hold])
    )
    return tag("ul", "".join(items))
