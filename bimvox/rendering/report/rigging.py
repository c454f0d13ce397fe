"""The rigs of a plan: each kind with its gear, its lifts and a drawing to scale; and the list of gear for the site."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import Any

from bimvox.errors import listed
from bimvox.rendering.report.html import element, number, paragraph, picture, row, section, table, tag, text, value
from bimvox.rendering.report.words import fixed, percent, ranges, tonnes
from bimvox.rendering.words import counted, escape

_LISTED = 30
_WIDTH, _HEIGHT, _MARGIN, _ASIDE = 300.0, 250.0, 34.0, 62.0
ANCHOR_FACTOR = 1.3
"""Factor on the pull at rest for anchors in precast parts lifted by crane (Fixinox, "Lifting calculation method")."""


def rigs_of(lifts: Iterable[dict[str, Any]]) -> list[dict[str, Any]]:
    """Return the different rigs of the planned lifts, in the order of their first lifts.

    Lifts with the same pieces of gear have the same rig. Each has ``name`` (a letter), ``lifts`` (numbers), ``orders``,
    ``crane``, ``heaviest_kg``, ``most_pull_kg`` (at one lifting point), ``used`` (greatest share of a limit),
    ``rig`` (that of the lift with the flattest legs).
    """
    found: dict[tuple[Any, ...], list[dict[str, Any]]] = {}
    for lift in lifts:
        rig = lift["lifting"]["rig"]
        if lift["status"] == "planned" and rig is not None:
            pieces = ((_piece(part), part["count"]) for part in rig["parts"])
            found.setdefault((lift.get("crane", 0), rig["kind"], *pieces), []).append(lift)
    return [_rig(_letters(number), own) for number, own in enumerate(found.values())]


def _piece(part: dict[str, Any]) -> str:
    """Return the name of a piece; a spreader is the same at every span."""
    return str(part["what"]).split(", span ")[0]


def _rig(name: str, lifts: list[dict[str, Any]]) -> dict[str, Any]:
    rigs = [lift["lifting"]["rig"] for lift in lifts]
    return {
        "name": name,
        "lifts": [lift["number"] for lift in lifts],
        "orders": [lift["order"] for lift in lifts],
        "crane": lifts[0].get("crane", 0),
        "heaviest_kg": max(lift["mass_kg"] for lift in lifts),
        "most_pull_kg": max(rig["parts"][-1]["load_kg"] for rig in rigs),
        "used": max(part["load_kg"] / part["wll_kg"] for rig in rigs for part in rig["parts"]),
        "rig": max(rigs, key=lambda rig: (rig["leg_angle_deg"], rig["parts"][0]["load_kg"])),
    }


def gear_list(rigs: Iterable[dict[str, Any]]) -> list[dict[str, Any]]:
    """Return the gear that the site needs: of each piece the most that one lift of a crane needs, over all cranes."""
    most: dict[tuple[str, int], int] = {}
    mass_kg: dict[str, float] = {}
    for one in rigs:
        need: dict[str, int] = {}
        for part in one["rig"]["parts"]:
            what = _piece(part)
            need[what] = need.get(what, 0) + part["count"]
            mass_kg[what] = max(mass_kg.get(what, 0.0), part["mass_kg"])
        for what, count in need.items():
            key = (what, one["crane"])
            most[key] = max(most.get(key, 0), count)
    counts: dict[str, int] = {}
    for (what, _), count in most.items():
        counts[what] = counts.get(what, 0) + count
    return [{"what": what, "count": counts[what], "mass_kg": mass_kg[what]} for what in sorted(counts)]


def rigging(record: dict[str, Any]) -> str:
    """Return the section about rigs; empty if the site file describes the rigging of each crane."""
    rigs = record["rigs"]
    if not rigs:
        return ""
    columns = (
        "Rig",
        "Gear, from the hook down",
        "Lifts",
        "Heaviest\nt",
        "Gear\nt",
        "Hook above\ntop, m",
        "Legs",
        "Pull at a\npoint, t",
        "Used\n%",
    )
    about = (
        "The smallest gear whose working load limits hold at the angle of its legs. Limits and loads are at rest. "
        "Anchors in a part are its designer's: the pull at a lifting point is without the factor for lifting "
        f"by crane ({ANCHOR_FACTOR:g} is usual for precast parts). Assumed lifting points are to be replaced by those "
        "of the part."
    )
    assumed = sum(lift["status"] == "planned" and lift["lifting"]["source"] == "assumed" for lift in record["lifts"])
    said = f"Lifting points of {counted(assumed, 'part')} are assumed." if assumed else ""
    needed = [row([escape(one["what"]), value(one, "count", str), fixed(one["mass_kg"], 1)]) for one in record["gear"]]
    return section(
        f"Rigging: {counted(len(rigs), 'rig')}",
        paragraph(about),
        paragraph(said, "reserved") if said else "",
        tag("div", table(columns, map(_row, rigs), class_="words", id_="rigs"), "wide"),
        "<h3>Gear for the site</h3>",
        paragraph(
            "Of each piece the most that one lift of a crane needs. Check the certificates on the site.", "faint"
        ),
        table(("Piece", "Number", "Mass of one\nkg"), needed, class_="words", id_="gear"),
        id="rigging",
    )


def rig_drawings(record: dict[str, Any]) -> str:
    """Return the drawings of the rigs to scale; empty without rigs."""
    rigs = record["rigs"]
    drawn = tag("div", "".join(map(rig_figure, rigs)), "pictures rigs")
    return section("Rigs, drawn to scale", drawn, id="rig-drawings") if rigs else ""


def _row(one: dict[str, Any]) -> str:
    rig = one["rig"]
    pieces = "<br>".join(f"{part['count']} × {escape(part['what'])}: {_of_limit(part)}" for part in rig["parts"])
    lean = "vertical" if rig["leg_angle_deg"] < 0.1 else f"up to {rig['leg_angle_deg']:.0f}°"
    return row(
        [
            one["name"],
            pieces,
            _numbers(one["lifts"]),
            value(one, "heaviest_kg", tonnes),
            number(rig["mass_kg"], tonnes(rig["mass_kg"]), "rigging_mass_kg"),
            value(rig, "hook_above_top_m", 2),
            f"{rig['legs']} of {value(rig, 'leg_m', 2)} m,<br>{lean}",
            value(one, "most_pull_kg", tonnes),
            number(one["used"], percent(one["used"], 0), "gear_used"),
        ],
        data_rig=one["name"],
    )


def _of_limit(part: dict[str, Any]) -> str:
    load = value(part, "load_kg", tonnes)
    return f"{load} of {value(part, 'wll_kg', tonnes)} t"


def _numbers(numbers: Sequence[int]) -> str:
    """Return how many lifts, and their numbers as ranges."""
    return f"{len(numbers)}: {listed(ranges(sorted(numbers)), _LISTED)}"


def rig_figure(one: dict[str, Any]) -> str:
    """Return the drawing of a rig with its name."""
    words = f"Rig {one['name']}: {one['rig']['parts'][0]['what']}"
    return tag("figure", _drawing(one, words) + tag("figcaption", escape(words)))


def _drawing(one: dict[str, Any], title: str) -> str:
    """Return the rig in elevation, to scale, at its flattest legs: from the hook down to the lifting points."""
    rig = one["rig"]
    lines, labels, points_m = _lines_m(rig)
    high = max(z for _, z in points_m)
    wide = max(1.0, *(abs(x) for x, _ in points_m))
    scale = min((_WIDTH / 2.0 - _ASIDE) / wide, (_HEIGHT - 2.0 * _MARGIN) / max(high, 1.0))

    def at(x: float, z: float) -> tuple[float, float]:
        return _WIDTH / 2.0 + scale * x, _HEIGHT - _MARGIN - scale * z

    parts = []
    for first, last, class_ in lines:
        (x1, y1), (x2, y2) = at(*first), at(*last)
        parts.append(element("line", x1=x1, y1=y1, x2=x2, y2=y2, class_=class_))
    for x, z in points_m[1:]:
        cx, cy = at(x, z)
        parts.append(element("circle", cx=cx, cy=cy, r=2.6, class_="mast"))
    hook_x, hook_y = at(0.0, high)
    parts.append(element("circle", cx=hook_x, cy=hook_y - 5.0, r=5.0, class_="ring"))
    load_y = at(0.0, 0.0)[1]
    half = scale * wide + 14.0
    parts.append(element("rect", x=_WIDTH / 2.0 - half, y=load_y, width=2 * half, height=14.0, class_="area building"))
    words = f"part up to {tonnes(one['heaviest_kg'])} t, gear {tonnes(rig['mass_kg'])} t"
    parts.append(text(words, _WIDTH / 2.0, load_y + 26.0, text_anchor="middle", class_="label"))
    for x, z, label in labels:
        px, py = at(x, z)
        for below, line in enumerate(label):
            parts.append(text(line, px + 7.0, py + 11.0 * below, class_="label halo"))
    parts.append(element("line", x1=10.0, x2=10.0, y1=hook_y, y2=load_y, class_="dimension"))
    parts.append(text(f"{rig['hook_above_top_m']:.2f} m", 14.0, (hook_y + load_y) / 2.0, class_="label halo"))
    return picture(_WIDTH, _HEIGHT, title, parts, "rig")


_Point = tuple[float, float]
_Line = tuple[_Point, _Point, str]
_Label = tuple[float, float, tuple[str, ...]]


def _lines_m(rig: dict[str, Any]) -> tuple[list[_Line], list[_Label], list[_Point]]:
    """Return lines, labels and points (hook first) of a rig in elevation; metres above the lowest lifting point."""
    slings = [part for part in rig["parts"] if "legs" in part]
    spreader = next((part for part in rig["parts"] if "span_m" in part), None)
    upper = slings[0]
    out, down = _out_and_down(upper)
    if spreader is None:
        sides = [0.0] if upper["legs"] == 1 else [-out, out]
        lines: list[_Line] = [((0.0, down), (x, 0.0), "rope") for x in sides]
        labels = [(sides[-1] / 2.0, down / 2.0, _leg_words(upper))]
        return lines, labels, [(0.0, down), *((x, 0.0) for x in sides)]
    _, drop = _out_and_down(slings[1])
    half, eye = spreader["span_m"] / 2.0, drop + rig["spreader_m"]
    high = eye + down
    lines = [((0.0, high), (x, eye), "rope") for x in (-half, half)]
    lines += [((x, eye), (x, 0.0), "rope") for x in (-half, half)]
    lines.append(((-half, drop + rig["spreader_m"] / 2.0), (half, drop + rig["spreader_m"] / 2.0), "spreader"))
    labels = [
        (half / 2.0, eye + down / 2.0, _leg_words(upper)),
        (-half, drop * 0.55, (f"{spreader['span_m']:.1f} m, {_limit(spreader)}",)),
        (half, drop / 2.0, (f"{slings[1]['leg_m']:.2f} m", _limit(slings[1]))),
    ]
    return lines, labels, [(0.0, high), (-half, 0.0), (half, 0.0)]


def _out_and_down(sling: dict[str, Any]) -> tuple[float, float]:
    angle = math.radians(sling["leg_angle_deg"])
    return sling["leg_m"] * math.sin(angle), sling["leg_m"] * math.cos(angle)


def _leg_words(sling: dict[str, Any]) -> tuple[str, ...]:
    lean = f", {sling['leg_angle_deg']:.0f}°" if sling["leg_angle_deg"] >= 0.1 else ""
    return f"{sling['leg_m']:.2f} m{lean}", _limit(sling)


def _limit(part: dict[str, Any]) -> str:
    return f"WLL {tonnes(part['wll_kg'])} t"


def _letters(number: int) -> str:
    """Return A to Z, then AA and so on."""
    word = ""
    number += 1
    while number:
        number, rest = divmod(number - 1, 26)
        word = chr(ord("A") + rest) + word
    return word
