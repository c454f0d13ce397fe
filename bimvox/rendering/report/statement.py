"""The method statement: by class of work, and what holds for every lift."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from bimvox.rendering.report.html import number, paragraph, row, section, table, tag, terms, value
from bimvox.rendering.report.risks import categories
from bimvox.rendering.report.support import in_words
from bimvox.rendering.report.words import fixed, named, percent, span, tonnes
from bimvox.rendering.words import counted, escape

_WORK = {
    "footing": "Footings",
    "column": "Columns",
    "wall": "Walls",
    "beam": "Beams",
    "slab": "Slabs",
    "stair": "Stairs",
    "steel": "Steel",
    "other": "Other parts",
}
_STEPS = (
    ("hook_on", "Attach slings and tag lines"),
    ("raise", "Raise, hold for the trial lift"),
    ("turn", "Turn"),
    ("hoist", "Hoist"),
    ("traverse", "Slew and trolley"),
    ("lower", "Lower"),
    ("set", "Align, fix, brace on the hook"),
    ("release", "Take off slings and tag lines"),
)
_ON_SITE = {
    "communication": "Communication",
    "emergency": "Emergency plan",
    "emergency_contact": "Emergency contact",
    "rescue_plan": "Rescue from the crane",
    "hospital": "Nearest hospital",
    "assembly_point": "Assembly point",
}
_LISTED = 40


def statement(record: dict[str, Any]) -> str:
    """Return the method statement; empty for a plan without a crane."""
    if record["crane"] is None:
        return ""
    columns = ("Class", "Lifts", "Heaviest\nt", "Lifting\npoints", "Upended\n/ turned", *(_two(w) for _, w in _STEPS))
    rows = [_class(one) for one in record["method"]]
    about = (
        "The crane stands still while slings and tag lines are attached, a part is turned or fixed, and they are taken "
        "off. In between, the part moves on the path in the log and on no other. Slings come off when the part is "
        "fixed and braced. Times are the shortest and the longest of the class in this plan."
    )
    return section(
        "Method statement", paragraph(about),
        tag("div", table(columns, rows, class_="words method", id_="method"), "wide"),
        terms(_limits(record)), id="method-statement",
    )  # fmt: skip


def _two(words: str) -> str:
    """Return a heading on two lines, with its unit."""
    first, _, rest = words.partition(" ")
    return f"{first}\n{rest}" if rest else first


def _class(one: dict[str, Any]) -> str:
    low, high = one["points"]
    cells = [
        _WORK.get(one["work"], one["work"]),
        number(len(one["lifts"]), str(len(one["lifts"])), "lifts"),
        value(one, "heaviest_kg", tonnes),
        f"{low}" if low == high else f"{low} to {high}",
        f"{one['upended']} / {one['turned']}",
    ]
    for name, _ in _STEPS:
        spans = one["phases"].get(name)
        cells.append("–" if spans is None else _range(name, *spans))
    return row(cells, data_work=one["work"])


def _range(name: str, low_s: float, high_s: float) -> str:
    first = number(low_s, span(low_s), f"{name}_from_s")
    return first if low_s == high_s else f"{first} to {number(high_s, span(high_s), f'{name}_to_s')}"


def _limits(record: dict[str, Any]) -> list[tuple[str, str]]:
    """Return what holds for every lift."""
    project, planned = record["project"], [one for one in record["lifts"] if one["status"] == "planned"]
    share = percent(record["critical_share"], 0)
    critical = _numbers([one for one in planned if one["critical"]])
    return [
        ("Lift category", categories(record)),
        ("Upending", _upending(record)),
        ("Wind", _wind(record, planned)),
        ("Blind lifts", _blind(record)),
        ("Exclusion zone", _below(record)),
        ("Oversail", _oversail(record)),
        ("Critical lifts", f"from {share} of the capacity: {critical or 'none'}"),
        ("Permitted use", _permitted(record)),
        ("Chart from", "; ".join(f"{escape(one['name'])}: {_stated(one['about'])}" for one in _cranes(record))),
        ("Out of service", in_words(record["out_of_service"])),
        ("Foundation", _stated(project["foundation"])),
        ("Ground", _stated(project["ground"])),
        *((words, _stated(project[key])) for key, words in _ON_SITE.items()),
        (
            "Slings, shackles",
            ("as in the section Rigging;" if record["rigs"] else "working load limits, leg angles,")
            + f" certificates: {_BLANK}",
        ),
    ]


def _upending(record: dict[str, Any]) -> str:
    """Return how parts that lie are upended and what their time assumes; empty if none is."""
    count, rules = sum(one["upended"] for one in record["method"]), record["site"]["rules"]
    over = [lift["flip"] for lift in record["lifts"] if lift["status"] == "planned" and lift.get("flip") is not None]
    said = ""
    if over:
        used = max(max(one["main_used"], one["auxiliary_used"], one["both_used"]) for one in over)
        clear_m = min(one["clear_m"] for one in over)
        said = (
            f"{counted(len(over), 'part')} turned over in the air by main and auxiliary hook: lifted level, "
            f"{number(clear_m, f'{clear_m:.2f} m', 'clear_m')} or more clear of the ground, head hoisted while the "
            f"other hook holds the foot end, then that hook taken off; a hook uses {percent(used, 0)} at most. "
        )
    if not (count := count - len(over)):
        return said
    seconds = number(rules["upend_s"], span(rules["upend_s"]), "upend_s")
    return said + (
        f"{counted(count, 'part')} with one hook: slung at the head, in the yard or on a frame; the foot is bedded and "
        f"held so that it cannot slip; hook and trolley follow the head, the rope upright. It takes {seconds} besides "
        "the crane's motion ([rules] upend_s), then the trial lift. Two hooks: a line to tick"
    )


def _permitted(record: dict[str, Any]) -> str:
    """Return the share of the capacity that a lift may use, and what the plan uses."""
    most, used = record["site"]["rules"]["highest_utilisation"], record["totals"]["highest_utilisation"]
    limit = f"{number(most, f'{100.0 * most:g} %', 'permitted_utilisation')} of the load chart"
    planned = "" if used is None else f"; the plan uses {percent(used, 1)} at most"
    if most == 1.0:
        return f"{limit}: the site file gives no lower limit ([rules] highest_utilisation){planned}"
    if "highest_utilisation" in record["site"]["rules"]["gives_way"]:
        return f"{limit} where that is possible, more only where a part needs it at its place or in the yard{planned}"
    return f"{limit}, by [rules] highest_utilisation: a part that needs more is refused{planned}"


def _cranes(record: dict[str, Any]) -> list[dict[str, Any]]:
    return [record["crane"], *record.get("other_cranes", [])]


def _wind(record: dict[str, Any], planned: Sequence[dict[str, Any]]) -> str:
    """Return the wind in which every lift is permitted, and what governs it."""
    if not planned:
        return ""
    governs = min(planned, key=lambda lift: (lift["lifting"]["permitted_wind_m_s"], lift["order"]))
    least = governs["lifting"]["permitted_wind_m_s"]
    machine = _cranes(record)[governs.get("crane", 0)]
    speed = number(least, f"{least:.1f} m/s", "least_wind_m_s")
    if least >= machine["max_wind_m_s"]:
        return f"stop at {speed} (gust): the crane's own limit governs every lift"
    return (
        f"stop at {speed} (gust): the sail area of lift {governs['number']}, {escape(named(governs))}, governs; the "
        f"crane works up to {machine['max_wind_m_s']:g} m/s; each lift's own limit is in the table of lifts"
    )


def _blind(record: dict[str, Any]) -> str:
    """Return the lifts that the operator cannot see, and the rule."""
    rule = (
        "seen from the slewing axis at the jib, the middle of the part at its pick or set place is behind an "
        "obstruction, structure or a part that is set"
    )
    blind = record["blind"]
    if not blind:
        return f"none ({rule})"
    by_order = {lift["order"]: lift for lift in record["lifts"]}
    words = _numbers([by_order[one["order"]] for one in blind])
    count = number(len(blind), str(len(blind)), "blind_lifts")
    return f"{count} ({rule}): {words}. A signaller sees the load all the way, with radio contact"


def _numbers(lifts: Sequence[dict[str, Any]]) -> str:
    words = ", ".join(str(lift["number"]) for lift in lifts[:_LISTED])
    return words + (f" and {counted(len(lifts) - _LISTED, 'more lift')}" if len(lifts) > _LISTED else "")


def _below(record: dict[str, Any]) -> str:
    found = record["drawing"]["areas_m2"]
    if not found["below_loads"]:
        return ""
    own = number(found["below_loads"], f"{fixed(found['below_loads'], 0)} m²", "below_loads_m2")
    outside = number(found["below_outside"], f"{fixed(found['below_outside'], 0)} m²", "below_outside_m2")
    reach = number(found["falling"], f"{fixed(found['falling'], 0)} m²", "falling_m2")
    beyond = number(found["falling_outside"], f"{fixed(found['falling_outside'], 0)} m²", "falling_outside_m2")
    return (
        f"nobody below a load: {own} in the plan drawing, {outside} of it outside construction area and yard. A "
        f"falling load may reach {reach}, {beyond} of it outside: only who slings, guides or fixes the load is there"
    )


def _oversail(record: dict[str, Any]) -> str:
    outside = record["drawing"]["areas_m2"]["oversail"]
    words = number(outside, f"{fixed(outside, 0)} m²", "oversail_m2")
    return f"the jib sweeps {words} outside construction area and yard when it slews freely"


# The title block of a lift plan: project, revision, and who prepares, checks, approves and carries it out.

_FIELDS = {"name": "Project", "number": "Number", "address": "Address", "client": "Client", "contractor": "Contractor"}
_PEOPLE = {
    "prepared_by": "Prepared by",
    "checked_by": "Checked by",
    "approved_by": "Approved by",
    "appointed_person": "Appointed person",
    "lifting_supervisor": "Lifting supervisor",
    "crane_operator": "Crane operator",
    "slinger": "Slinger, signaller",
}
NOT_STATED = "not stated: fill in"
_BLANK = f'<span class="blank">{NOT_STATED}</span>'
"""A field that the log cannot fill."""


def title_block(record: dict[str, Any]) -> str:
    """Return the title block; what the site file does not state is left to be filled in by hand."""
    project = record["project"]
    project = {**project, "name": project["name"] or record["site"]["name"]}
    given = [(words, _stated(project[key])) for key, words in _FIELDS.items()]
    given += [("Revision", _stated(project["issue"])), ("Plan", tag("code", escape(record["log"]["sha256"][:16])))]
    people = [row([words, escape(project[key] or ""), "", ""]) for key, words in _PEOPLE.items()]
    issues = [
        row([escape(one["revision"]), escape(one["date"]), escape(one["changes"] or "")])
        for one in project["revisions"]
    ] or [row([escape(project["issue"] or ""), "", ""])]
    return section(
        "Project and approval",
        terms(given),
        tag(
            "div",
            table(("Role", "Name", "Signature", "Date"), people, class_="words signed", id_="signatures")
            + table(("Revision", "Date", "Changes"), issues, class_="words", id_="revisions"),
            "titleblock",
        ),
        id="title-block",
    )


def _stated(words: str | None) -> str:
    """Return words as HTML, or that they are to be filled in."""
    return escape(words) if words else _BLANK
