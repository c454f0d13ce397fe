"""The set-ups of a site as one page: what was planned, hours against cost, drawings, and why the others lost."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import PurePath
from typing import Any

from bimvox.rendering.report.html import (
    element,
    number,
    paragraph,
    picture,
    row,
    section,
    table,
    tag,
    terms,
    text,
    ticks,
)
from bimvox.rendering.report.page import Figure, printable
from bimvox.rendering.report.words import fixed, percent
from bimvox.rendering.words import counted, escape

_WIDTH, _HEIGHT, _LEFT, _RIGHT, _TOP, _BOTTOM = 1040.0, 400.0, 76.0, 30.0, 18.0, 40.0
_STEPS_H = (0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0)
_STEPS_COST = tuple(step * 10**n for n in range(1, 8) for step in (1.0, 2.0, 5.0))
_DEAR = 1.25
_LEGEND = "Filled: planned, of the front. Triangle: the given set-up. Hollow: planned, beaten. Small: estimates alone."
_COLUMNS = (
    "set-up", "place", "yard,\ntruckload", "parts\nrefused", "crane\nhours", "of them\nmoving", "between\nset-ups",
    "days of\nhire", "critical\nlifts", "highest\nutilisation", "cost", "files", "why not",
)  # fmt: skip


def set_ups_page(
    document: Mapping[str, Any], estimates: Sequence[Mapping[str, str]], drawings: Sequence[Figure], heat: Figure
) -> bytes:
    """Return the page, UTF-8; it makes no network requests and runs no scripts.

    ``document``: of ``bimvox optimise --json``; ``estimates``: rows of its table of all machines; ``drawings``: of
    the given set-up and of each of the front; ``heat``: the map of crane hours.
    """
    name = PurePath(document["site"]).name.removesuffix(".toml").removesuffix(".site")
    front, given, currency = document["front"], document["baseline"], document["currency"]
    tried = (
        f"{document['tried']:,} set-ups of {document['machines']:,} machines with jib and reeving"
        + (f", {counted(document['trials'], 'other yard')}" if document["trials"] else "")
        + f"; {counted(1 + len(front) + len(document['losers']), 'plan')}, each proven"
    )
    verdict = "verified" if document["verified"] else "not every plan is verified"
    chip = tag("span", verdict, f"chip {'clean' if document['verified'] else 'refused'}")
    body = [
        tag("header", tag("div", tag("h1", f"{escape(name)}: set-ups") + paragraph(tried, "faint")) + chip),
        terms(_answers(front, given, currency, document["least_moving_hours"], document["least_cost"])),
        section("Hours and cost", tag("div", _chart(document, estimates), "wide"), paragraph(_LEGEND, "faint")),
        section("Planned set-ups", tag("div", _planned(document), "wide")),
        section("Drawings", tag("div", "".join(one.html() for one in drawings), "pictures")),
        section("Places of the crane", heat.html()),
        section("Why the others lost", tag("div", _losers(estimates), "wide")),
    ]
    return printable(f"{name}: set-ups", "".join(body), dict(document))


def best_of(front: Sequence[Mapping[str, Any]], given: Mapping[str, Any], key: str) -> Mapping[str, Any] | None:
    """Return the planned set-up with the least of a figure, the given one if none of the front is better.

    A set-up that refuses more parts than another is not better. None if nothing has that figure.
    """
    able = [one for one in (given, *front) if one[key] is not None]
    return min(able, key=lambda one: (one["refused"], one[key]), default=None)


def _answers(
    front: Sequence[Mapping[str, Any]], given: Mapping[str, Any], currency: str, least_h: float, least_cost: float
) -> list[tuple[str, str]]:
    """Return the fastest, the cheapest and the least used set-up, against the given one, and the bounds."""
    result = []
    best = {
        words: best_of(front, given, key)
        for words, key in (("cheapest", "cost"), ("fastest", "hours"), ("least used", "highest_utilisation"))
    }
    for words, one in best.items():
        if one is None:
            continue
        if one is given:
            result.append((words, "the given set-up; none of the others is better"))
            continue
        said = f"{escape(_name(one))} at {_at(one)}: {fixed(one['hours'], 2)} h, {one['cost']:,.0f} {escape(currency)}"
        if given["hours"] and given["refused"] != one["refused"]:
            said += f"; infeasible lifts: {one['refused']}, given {given['refused']}"
        elif given["hours"]:
            key, what = ("hours", "time") if one["moving_hours"] is None else ("moving_hours", "moving")
            saved, cost = given[key] - one[key], given["cost"] - one["cost"]
            said += f"; {_less(saved, given[key])} {what}, {_less(cost, given['cost'])} cost than given"
        if one["highest_utilisation"] is not None:
            said += f"; {percent(one['highest_utilisation'], 0)} of the capacity"
        result.append((words, said))
    # The bounds are those of one crane.
    alone = [one for one in front if one["moving_hours"] is not None]
    if least_h and alone:
        left = _left(least_h, min(one["moving_hours"] for one in alone))
        said = f"no hammerhead moves less than {fixed(least_h, 2)} h with the yards looked at and the clearance kept"
        result.append(("bound", f"{said}: at most {left} of the fastest one's moving time there is left to gain"))
    if least_cost:
        said = f"no machine that was tried carries these parts alone for less than {least_cost:,.0f} {escape(currency)}"
        if alone:
            said += f": at most {_left(least_cost, min(one['cost'] for one in alone))} of the cheapest is left to gain"
        result.append(("least cost", said))
    return result


def _left(least: float, found: float) -> str:
    return percent(max(0.0, 1.0 - least / found), 1)


def _less(saved: float, whole: float) -> str:
    share = saved / whole if whole else 0.0
    return f"{percent(abs(share), 0)} {'less' if share >= 0 else 'more'}"


def _name(one: Mapping[str, Any]) -> str:
    set_ups = one.get("set_ups") or ()
    booms = "/".join(dict.fromkeys(f"{each['boom_m']:g}" for each in set_ups))
    how = f"{counted(len(set_ups), 'set-up')}, boom {booms} m" if set_ups else f"jib {one['jib_m']:g} m"
    own = f"{one['machine']}, {how}, {counted(one['falls'], 'fall')}"
    return own if one.get("second") is None else f"{own}; and {_name(one['second'])}"


def _at(one: Mapping[str, Any]) -> str:
    places = [each["base_m"] for each in one.get("set_ups") or (one,)]
    own = ", ".join(f"({x:g},\N{NO-BREAK SPACE}{y:g})" for x, y in places)
    return own if one.get("second") is None else f"{own}, {_at(one['second'])}"


def _planned(document: Mapping[str, Any]) -> str:
    rows = [_row(document["baseline"], "given: ")]
    rows += [_row(one) for one in (*document["front"], *document["losers"])]
    return table(_COLUMNS, rows, caption="Set-ups that were planned and proven", class_="words")


def _row(one: Mapping[str, Any], prefix: str = "") -> str:
    link = tag("a", "site file", href=PurePath(one["site"]).as_posix()) if not prefix else "site file"
    if one["log"]:
        link += ", " + tag("a", "log", href=PurePath(one["log"]).name)
    highest = one["highest_utilisation"]
    corner = "given" if one["yard"] is None else "({:g}, {:g})".format(*one["yard"][0])
    corner = "one each" if any(each["yard"] for each in one.get("set_ups") or ()) else corner
    corner += f", {one['truckload_kg'] / 1000.0:g} t" if one.get("truckload_kg") else ""
    why = one["error"]["message"] if one["error"] else one.get("why_lost", "")
    cells = (
        escape(prefix + _name(one)),
        _at(one),
        corner,
        number(one["refused"], str(one["refused"])),
        number(one["hours"], fixed(one["hours"] or 0.0, 2)),
        number(one["moving_hours"], fixed(one["moving_hours"] or 0.0, 2)),
        number(one.get("move_hours") or None, fixed(one.get("move_hours") or 0.0, 2)),
        number(one["hire_days"], str(one["hire_days"])),
        number(one["critical_lifts"], str(one["critical_lifts"])),
        number(highest, percent(highest or 0.0, 0)),
        number(one["cost"], f"{one['cost'] or 0.0:,.0f}"),
        link,
        escape(why),
    )
    return row(cells)


def _losers(estimates: Sequence[Mapping[str, str]]) -> str:
    columns = (
        "machine", "jib, m", "falls", "yard", "parts\nserved", "hours\n(estimate)", "cost\n(estimate)",
        "utilisation\n(estimate)", "why",
    )  # fmt: skip
    keys = (
        "machine", "jib_m", "falls", "yard", "parts_served", "estimated_hours", "estimated_cost",
        "estimated_utilisation", "why_lost",
    )  # fmt: skip
    rows = [
        row(escape(_machines(one) if key == "machine" else str(one[key])) for key in keys)
        for one in estimates
        if one["why_lost"]
    ]
    return table(columns, rows, caption="Machines that are not of the front", class_="words")


def _machines(one: Mapping[str, str]) -> str:
    if one.get("set_ups"):
        return f"{one['machine']}, {counted(int(one['set_ups']), 'set-up')}"
    return f"{one['machine']} and {one['second']}" if one["second"] else one["machine"]


def _chart(document: Mapping[str, Any], estimates: Sequence[Mapping[str, str]]) -> str:
    """Return cost over crane hours of what was planned, among the estimates of what serves as many parts."""
    planned = [one for one in (*document["front"], *document["losers"]) if one["hours"] is not None]
    given = document["baseline"]
    known = [*planned, *([given] if given["hours"] is not None else [])]
    most = max((int(one["parts_served"]) for one in estimates), default=0)
    guessed = [
        (float(one["estimated_hours"]), float(one["estimated_cost"]), one["machine"])
        for one in estimates
        if int(one["parts_served"]) == most and one["estimated_hours"]
    ]
    # What costs much more than all that was planned would press the others onto one line.
    dearest = _DEAR * max((one["cost"] for one in known), default=float("inf"))
    guessed = [one for one in guessed if one[1] <= dearest]
    hours = [one["hours"] for one in known] + [one[0] for one in guessed]
    costs = [one["cost"] for one in known] + [one[1] for one in guessed]
    low_h, high_h = _range(hours)
    low, high = _range(costs)

    def x(value: float) -> float:
        return _LEFT + (value - low_h) / (high_h - low_h) * (_WIDTH - _LEFT - _RIGHT)

    def y(value: float) -> float:
        return _HEIGHT - _BOTTOM - (value - low) / (high - low) * (_HEIGHT - _TOP - _BOTTOM)

    parts = []
    for at in ticks(low_h, high_h, 12, _STEPS_H):
        parts.append(element("line", x1=x(at), x2=x(at), y1=_TOP, y2=_HEIGHT - _BOTTOM, class_="grid"))
        parts.append(text(f"{at:g}", x(at), _HEIGHT - _BOTTOM + 14.0, text_anchor="middle", class_="tick"))
    for at in ticks(low, high, 8, _STEPS_COST):
        parts.append(element("line", x1=_LEFT, x2=_WIDTH - _RIGHT, y1=y(at), y2=y(at), class_="grid"))
        parts.append(text(f"{at:,.0f}", _LEFT - 6.0, y(at) + 4.0, text_anchor="end", class_="tick"))
    parts.append(text("crane hours", _WIDTH / 2.0, _HEIGHT - 6.0, text_anchor="middle", class_="axis"))
    middle = (_TOP + _HEIGHT - _BOTTOM) / 2.0
    turned = f"rotate(-90 14 {middle:g})"
    words = f"cost, {document['currency']}"
    parts.append(text(words, 14.0, middle, text_anchor="middle", class_="axis", transform=turned))
    for at_h, cost, name in guessed:
        title = element("title", escape(f"{name}: {at_h:.2f} h, {cost:,.0f} (estimate)"))
        parts.append(element("circle", title, cx=x(at_h), cy=y(cost), r=1.8, class_="empty"))
    for one in planned:
        look = {"class_": "dot"} if one in document["front"] else {"fill": "none", "stroke": "currentColor"}
        parts.append(element("circle", _title(one), cx=x(one["hours"]), cy=y(one["cost"]), r=6.0, **look))
    if given["hours"] is not None:
        u, v = x(given["hours"]), y(given["cost"])
        parts.append(element("path", _title(given), d=f"M{u:.1f} {v - 8.0:.1f}l7 13h-14z", class_="dot critical"))
    return picture(_WIDTH, _HEIGHT, f"Cost over crane hours of {len(known)} planned set-ups", parts, "chart")


def _title(one: Mapping[str, Any]) -> str:
    return element("title", escape(f"{_name(one)}: {one['hours']:.2f} h, {one['cost']:,.0f}"))


def _range(values: Sequence[float]) -> tuple[float, float]:
    """Return a range around values, never empty."""
    low, high = min(values, default=0.0), max(values, default=1.0)
    room = max(0.06 * (high - low), 1e-3 * max(abs(high), 1.0))
    return low - room, high + room
