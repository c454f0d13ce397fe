"""The card of a single lift: one page for those who carry it out, to be ticked and signed."""

from __future__ import annotations

from collections.abc import Sequence
from math import degrees
from typing import Any

import numpy as np
import shapely

from bimvox.bim.own_box import sizes_m
from bimvox.rendering.page.source import Revision
from bimvox.rendering.report.html import number, paragraph, row, table, tag, terms, value
from bimvox.rendering.report.page import footer_of, printable
from bimvox.rendering.report.plan_view import FIRST, plan_view
from bimvox.rendering.report.props import props_of_lift
from bimvox.rendering.report.rigging import rig_figure, rigs_of
from bimvox.rendering.report.site_drawing import storeys_of
from bimvox.rendering.report.site_plan import below_load, fall_zone
from bimvox.rendering.report.words import fixed, named, span, tonnes
from bimvox.rendering.words import escape
from bimvox.site.areas import PLAN, hull, outline, rounded
from bimvox.site.component import Component
from bimvox.site.tandem import cranes_of
from bimvox.site.work import Work, work_of
from bimvox.units import clock

_PLAN_PX = (310.0, 250.0)
"""What an upright A5 page leaves next to the rig."""
_PAPER = "size: A5 portrait; margin: 8mm 8mm 11mm"
_SIMPLE_M = 0.05
_LYING = {"lying_x": "lying along x", "lying_y": "lying along y", "as_built": "as in the building"}
_SIGNED = ("lifting_supervisor", "crane_operator", "slinger")
_ROLES = {
    "lifting_supervisor": "Lifting supervisor",
    "crane_operator": "Crane operator",
    "slinger": "Slinger, signaller",
}
_STANDING = (Work.COLUMN, Work.WALL)


def cards_page(revision: Revision, record: dict[str, Any], orders: Sequence[int]) -> bytes:
    """Return a page with the cards of lifts that the crane carries out, UTF-8, each on one printed page."""
    by_order = {lift["order"]: lift for lift in record["lifts"]}
    body = "".join(_card(revision, record, by_order[order]) for order in orders)
    return printable(f"{record['site']['name']}: cards of lifts", body, record, footer_of(record), _PAPER)


def _card(revision: Revision, record: dict[str, Any], lift: dict[str, Any]) -> str:
    part = revision.plan.site.components[lift["part"]]
    drawing = _drawing(revision, record["drawing"], lift, part)
    svg, scale = plan_view(drawing, detail=True, most_px=_PLAN_PX)
    words = f"Before this lift, 1 : {number(scale, str(scale), 'scale')}. Red: the hook's path; nobody below the load"
    rigs = [one | {"name": lift["rig"]} for one in rigs_of([lift])]  # as it is called in the report
    chip = tag("p", f"{lift['category']} lift", "chip plain")
    verdict = tag("p", escape(record["verdict"]["proof"]), f"chip {record['verdict']['proof_light']}")
    return tag(
        "section",
        tag("header", f"<h1>Lift {lift['number']}: {escape(named(lift))}</h1>" + tag("div", chip + verdict, "verdict"))
        + tag(
            "div",
            tag("figure", svg + tag("figcaption", words), "sheet drawing") + "".join(map(rig_figure, rigs)),
            "sketches",
        )
        + terms(_terms(record, lift, part))
        + _remarks(record, lift)
        + _ticks(record, lift, part)
        + _signatures(record, lift),
        "card",
        data_order=str(lift["order"]),
    )


def _drawing(revision: Revision, drawing: dict[str, Any], lift: dict[str, Any], part: Component) -> dict[str, Any]:
    """Return the drawing of the site when a lift begins: what is set, the part, and where it hangs."""
    site = revision.plan.site
    track = next(track for track in revision.tracks if track.lift.order == lift["order"])
    there = [site.components[one.component] for one in revision.lifts if one.is_set and one.order < lift["order"]]
    motion = next(motion for motion in revision.motions if motion.order == lift["order"])
    crane = drawing["cranes"][part.crane]
    slew_rad, radius_m = motion.loaded.slew_rad, motion.loaded.radius_m
    hook_m = np.stack([radius_m * np.cos(slew_rad), radius_m * np.sin(slew_rad)], axis=1) + crane["base_m"][:2]
    own = {"number": lift["number"], "name": named(lift), "mass_kg": lift["mass_kg"]}
    return drawing | {
        "storeys": storeys_of(there, (PLAN,)),
        "stored": [one | {"delivery": FIRST} for one in drawing["stored"] if one["number"] == lift["number"]],
        "frames": [],
        "below_loads": outline(below_load(site, track)),
        "falling_loads": outline(fall_zone(site, track)),
        "heavy": [own | {"plan": outline(hull(part.mesh, PLAN)), "at_m": rounded(part.mesh.bounds_m.mean(axis=0)[:2])}],
        # Radius and capacity are on the card.
        "cranes": [drawing["cranes"][number] | {"rings": []} for number in cranes_of(part)],
        "path_m": [rounded(at) for at in shapely.get_coordinates(shapely.LineString(hook_m).simplify(_SIMPLE_M))],
        "distances_m": [],
    }


def _clearances(lift: dict[str, Any], rules: dict[str, Any]) -> str:
    """Return what a lift keeps of each clearance that it has, in words."""
    said = [("clearance_m", "transit_clearance_m", "in transit")]
    said += [(key, key, when) for key, when in (("departure_clearance_m", "up"), ("approach_clearance_m", "down"))]
    if lift["stored"] not in (None, "as_built"):
        said.append(("upending_clearance_m", "upending_clearance_m", "upended"))
    if lift["turn"]:
        said.append(("turning_clearance_m", "turning_clearance_m", "turned"))
    return ", ".join(f"{rules[rule] if lift[key] is None else lift[key]:g} m {when}" for key, rule, when in said)


def _terms(record: dict[str, Any], lift: dict[str, Any], part: Component) -> list[tuple[str, str]]:
    governs, lifting = lift["governs"], lift["lifting"]
    machines, shared = [record["crane"], *record.get("other_cranes", [])], lift.get("tandem")
    machine = machines[part.crane]
    size = " x ".join(f"{side:.2f}" for side in sorted(sizes_m(part.mesh), reverse=True))
    used = number(governs["utilisation"], f"{100.0 * (governs['utilisation'] or 0.0):.1f} %", "utilisation")
    wind = number(lifting["permitted_wind_m_s"], f"{lifting['permitted_wind_m_s']:.1f} m/s", "permitted_wind_m_s")
    rules = record["site"]["rules"]
    blind: list[str] = next((one["hidden"] for one in record["blind"] if one["order"] == lift["order"]), [])
    place = _LYING.get(lift["stored"], "")
    place += f", delivery {lift['delivery'] + 1}" if lift["delivery"] is not None else ""
    place += "".join(f", {what} {lift[what]}" for what in ("stack", "rack") if lift[what])
    begins = escape(lift["begins_in_words"] or f"at {clock(lift['begins_s'])} on the clock of the log")
    return [
        (
            "Part",
            f"{escape(part.ifc_class)}, {escape(part.storey or 'no storey')}, {tag('code', escape(lift['global_id']))}",
        ),
        ("Size", f"{size} m"),
        (
            "Mass",
            f"{value(lift, 'mass_kg', tonnes)} t ({escape(_SOURCES.get(lift['mass_source'], 'of unknown origin'))})",
        ),
        (
            "Category",
            escape(f"{lift['category']}" + (f": {', '.join(lift['category_why'])}" if lift["category_why"] else "")),
        ),
        *(
            ("Crane", f"{escape(one['name'])}, jib {one['jib_length_m']:.4g} m, {one['falls']} falls")
            for one in ([machine] if shared is None else [machines[number] for number in shared["cranes"]])
        ),
        (
            "On the hook",
            f"<b>{value(governs, 'load_kg', tonnes)} t</b> with rigging and hook block: uses {used} of the capacity",
        ),
        (
            "Radius",
            f"<b>{value(governs, 'radius_m', 2)} m</b> governs, gross capacity "
            f"<b>{value(governs, 'capacity_kg', tonnes)} t</b>"
            + (f" in sector {escape(governs['sector'])}" if governs["sector"] else ""),
        ),
        *_outrigger(lift),
        ("Rigging", _gear(lifting, machine)),
        ("Stored", f"{place}; hook at {_point(lift['pick'])}"),
        *_flip(lift),
        *_tandem(lift, machines),
        ("Set", f"hook at {_point(lift['set'])}"),
        ("Wind", f"up to {wind} (gust)" + (f"; heading {escape(lift['heading'])}" if lift["heading"] else "")),
        ("Clearance", _clearances(lift, rules)),
        ("Sight", f"hidden at {' and '.join(blind)}: signaller with radio" if blind else "seen at pick and set"),
        ("Held by", props_of_lift(record, lift)),
        ("Begins", f"{begins}; takes {span(lift['ends_s'] - lift['begins_s'])}"),
    ]


def _flip(lift: dict[str, Any]) -> list[tuple[str, str]]:
    """Return the shares of both hooks while a part is turned over between them; nothing if it is not."""
    if (flip := lift.get("flip")) is None:
        return []
    rows = list(zip(flip["angle_deg"], flip["main_kg"], flip["auxiliary_kg"], strict=True))
    shares = "; ".join(
        f"{angle:g}°: main {tonnes(main_kg)} t, auxiliary {tonnes(auxiliary_kg)} t"
        for angle, main_kg, auxiliary_kg in rows[:: max(1, (len(rows) - 1) // 3)]
    )
    hooks = (("main hook", "main_used"), ("auxiliary hook", "auxiliary_used"), ("chart by both", "both_used"))
    used = ", ".join(f"{what} {number(flip[key], f'{100.0 * flip[key]:.0f} %', key)}" for what, key in hooks)
    clear = number(flip["clear_m"], f"{flip['clear_m']:.2f} m", "clear_m")
    lean = f"ropes up to {degrees(flip['lean_rad']):.1f}° off the vertical"
    return [("Two hooks", f"{shares} of its mass; used at most: {used}; {clear} clear of the ground; {lean}")]


def _tandem(lift: dict[str, Any], machines: Sequence[dict[str, Any]]) -> list[tuple[str, str]]:
    """Return the share of each of the two cranes that carry a part; nothing if one does."""
    if (shared := lift.get("tandem")) is None:
        return []
    found = []
    rows = zip(*(shared[key] for key in ("cranes", "load_kg", "most_kg", "used", "radius_m", "points_m")), strict=True)
    for crane, level_kg, most_kg, used, radius_m, (x, y, z) in rows:
        share = number(used, f"{100.0 * used:.0f} %", "used")
        words = (
            f"{tonnes(level_kg)} t of its mass level, {tonnes(most_kg)} t at most; uses {share} of its load chart, "
            f"radius up to {radius_m:.2f} m; holds it at x {fixed(x, 2)}, y {fixed(y, 2)}, z {fixed(z, 2)} m"
        )
        found.append((f"Share of {escape(machines[crane]['name'])}", words))
    apart = number(shared["apart_m"], f"{shared['apart_m']:.2f} m", "apart_m")
    level = f"out of level by up to {degrees(shared['off_level_rad']):.1f}°"
    return [*found, ("Two hooks", f"{apart} apart, ropes upright, in time with each other; {level}; no other lift")]


def _outrigger(lift: dict[str, Any]) -> list[tuple[str, str]]:
    """Return the largest load on an outrigger in a lift; nothing if masses or outriggers are not stated."""
    if "outrigger_kn" not in lift:
        return []
    if lift["outrigger_kn"] is None:
        return [("Outrigger", "<b>✕ the crane would tip</b>")]
    most = number(lift["outrigger_kn"], fixed(lift["outrigger_kn"], 0), "outrigger_kn")
    return [("Outrigger", f"{most} kN at most, {lift['outrigger']}")]


def _gear(lifting: dict[str, Any], machine: dict[str, Any]) -> str:
    """Return what the part hangs on, from the hook down."""
    rig = lifting["rig"]
    if rig is None:
        return f"{tonnes(machine['rigging_mass_kg'])} t, hook {machine['sling_m']:g} m above the top"
    pieces = "; ".join(f"{one['count']} × {one['what']}" for one in rig["parts"])
    pull = tonnes(rig["parts"][-1]["load_kg"])
    return escape(f"{pieces}; hook {rig['hook_above_top_m']:.2f} m above the top, {pull} t at a lifting point")


_SOURCES = {
    "quantity": "stated in the model",
    "density": "volume and material of the model",
    "default": "volume and an assumed density",
}


def _point(at: dict[str, Any]) -> str:
    x, y, z = (fixed(one, 2) for one in at["hook_m"])
    return f"x {x}, y {y}, z {z} m, radius {at['radius_m']:.2f} m, slew {degrees(at['slew_rad']) % 360.0:.1f}°"


def _remarks(record: dict[str, Any], lift: dict[str, Any]) -> str:
    own = [one for one in record["remarks"] if one["component"] == lift["id"]]
    items = "".join(tag("li", f"<b>{escape(one['severity'])}</b>: {escape(one['text'])}") for one in own)
    return paragraph("Remarks about this part:") + tag("ul", items) if own else ""


def _ticks(record: dict[str, Any], lift: dict[str, Any], part: Component) -> str:
    """Return what is ticked just before this lift."""
    lifting = lift["lifting"]
    lines = [
        f"Mass of {tonnes(lift['mass_kg'])} t confirmed by delivery note or weighing",
        "Gear as drawn, inspected; anchors and concrete strength released by the designer",
        f"Wind at the jib below {lifting['permitted_wind_m_s']:.1f} m/s, and not rising",
        "Place ready: levels, bearings, packs, access for those who fix it",
    ]
    lies, over = lift["stored"] not in (None, "as_built"), lift.get("flip") is not None
    lines += ["Foot bedded and held for upending; nobody where the part may fall"] * (lies and not over)
    lines += ["Auxiliary hook fitted; both loads read while it turns; nobody where its foot swings"] * over
    lines += ["One person directs both cranes; both loads read at the trial lift; one command stops both"] * (
        lift.get("tandem") is not None
    )
    lines += ["Braces and fixings at hand; slings come off only when they hold"] * (work_of(part) in _STANDING)
    lines += ["Signaller in place, radio tested: the operator does not see the load"] * any(
        one["order"] == lift["order"] for one in record["blind"]
    )
    lines += ["Exclusion zone closed, nobody below the load", "Held just above the ground: hangs level, brakes hold"]
    items = "".join(tag("li", f"☐ {escape(line)}") for line in lines)
    return tag("ul", items, "ticklist")


def _signatures(record: dict[str, Any], lift: dict[str, Any]) -> str:
    people = [row([_ROLES[key], escape(record["project"][key] or ""), "", ""]) for key in _SIGNED]
    people += [row(["Operator of the second crane", "", "", ""])] * (lift.get("tandem") is not None)
    return table(("Role", "Name", "Signature", "Date, time"), people, class_="words signed")
