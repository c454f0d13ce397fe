"""The answer to a plan in at most 25 lines: the verdict, what a person must do, key figures, the worst lifts."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from bimvox.errors import listed
from bimvox.rendering.words import counted
from bimvox_cli.matters import MOST_LINES, Matter, remark_matters, show_matters
from bimvox_cli.output import in_lines, lines_of, shortened, table, width_of
from bimvox_cli.plan_tables import (
    GROSS,
    LIFT,
    cost_in_words,
    names_of,
    numbers_of,
    planner_in_words,
    props_in_words,
    reason_of,
    time_fields,
)
from bimvox_cli.remarks import verdict

if TYPE_CHECKING:
    from rich.console import Console
    from rich.text import Text

_NEXT_LINES = 1
"""Of them, what is printed after the answer: the next command."""
_WORST = 5
_NAME_WIDTH = 12
_PART_WIDTH = 18
_LEFT_OUT = ("t", "wind m/s", "begins", "t capacity")
"""Columns of the worst lifts that a narrow terminal has no room for, the first first."""
_HOW = {"in_situ": "cast in place", "by_hand": "by hand", "built": "built in place"}
Document = Mapping[str, Any]


def show_answer(console: Console, document: Document) -> None:
    """Print the answer to a plan, serious matters first; the groups of remarks take what is left of the lines."""
    below = lines_of(console, lambda: _below(console, document))
    head = lines_of(console, lambda: console.print(first_line(document)))
    left = MOST_LINES - _NEXT_LINES - head - below
    console.print(first_line(document))
    show_matters(console, matters_of(document), most_lines=left)
    _below(console, document)


def first_line(document: Document) -> Text:
    """Return the verdict: how many lifts are planned, of how many parts, what is proven, and how many remarks."""
    statuses = [lift["status"] for lift in document["lifts"]]
    planned, refused = statuses.count("planned"), statuses.count("infeasible")
    ways = [f"{statuses.count(way):,} {words}" for way, words in _HOW.items() if way in statuses]
    parts = f" ({counted(len(statuses), 'part')}: {', '.join(ways)})" if ways else ""
    others = sum(one["by_other_means"] for one in document["infeasible"])
    proven = f"every planned lift is {_proven(others)}" if document["verified"] else "FAILED"
    said = f"{planned:,} of {counted(planned + refused, 'lift')} planned{parts}, {proven}"
    return verdict(said, document, others=others)


def _proven(others: int) -> str:
    from bimvox.records.steps import proven_in_words  # heavy

    return proven_in_words(others)


# What a person must do or look at, by consequence: refused lifts, serious remarks, what is assumed, minor remarks.


def matters_of(document: Document) -> list[Matter]:
    """Return what a person must do or look at, the gravest first; alike ones are one matter."""
    return [*_refused(document), *remark_matters(document["remarks"], numbers_of(document))]


def _refused(document: Document) -> list[Matter]:
    """Return the refused lifts by their reasons, numbers and names of parts left out of these."""
    names = names_of(document) if document["infeasible"] else {}
    groups: dict[tuple[bool, str], list[Document]] = {}
    for one in document["infeasible"]:
        groups.setdefault((one["by_other_means"], _alike(one["reason"] or "", names)), []).append(one)
    return [
        (
            "by other means" if others else "refused",
            len(own),
            "what is around" if own[0]["is_carried"] else "crane or gear",
            f"{own[0]['number']} {own[0]['name'] or own[0]['component']}: {reason_of(own[0], names)}{_blocked(own[0])}",
        )
        for (others, _), own in sorted(groups.items(), key=lambda item: (item[0][0], -len(item[1])))
    ]


def _alike(reason: str, names: Mapping[str, str]) -> str:
    found = re.sub("|".join(map(re.escape, sorted(names, key=len, reverse=True))), "#", reason)
    return re.sub(r"'[^']*'|\([^)]*\)|\d[\d.,]*", "#", found)


def _blocked(one: Document) -> str:
    return f" ({listed(one['blocked_by_names'], most=2)})" if one["blocked_by_names"] else ""


def _below(console: Console, document: Document) -> None:
    """Print key figures, the worst lifts and the files, a line each."""
    console.print()
    _figures(console, document)
    _worst(console, document)
    _files(console, document)


def _figures(console: Console, document: Document) -> None:
    time = time_fields(document["time"])
    if time and sum(len(words or "") for _, words in time) + _NAME_WIDTH <= console.width:
        time = [("time", "; ".join(words or "" for _, words in time))]
    pairs: list[tuple[str, str | None]] = [
        *time,
        ("crane", _crane(document)),
        ("cost", cost_in_words(document["figures"])),
        ("props", props_in_words(document)),
        ("planner", planner_in_words(document)),
        ("policy", document["policy"].get("note")),
    ]
    in_lines(console, pairs)


def _files(console: Console, document: Document) -> None:
    refused, notes = len(document["infeasible"]), len(document["notes"])
    more = (f", refused ({refused:,})" if refused else "") + (f", notes ({notes:,})" if notes else "")
    tables = f"--table lifts, parts, remarks, deliveries, steps, props, figures{more}; -v: how paths were found"
    ticks = len(document["not_covered"])
    log = document["log"] + (f"; {counted(ticks, 'line')} to tick in bimvox report {document['log']}" if ticks else "")
    in_lines(console, [("log", log), ("tables", tables)])


def _crane(document: Document) -> str | None:
    """Return the cranes in one line, with the wind up to which every lift is permitted and the days of hire."""
    if not document["cranes"]:
        return None
    figures = document["figures"]
    cranes = [f"{one['name']}, jib {one['jib_length_m']:.4g} m, {one['falls']} falls" for one in document["cranes"]]
    if used := [one for one in document.get("set_ups", ()) if one["lifts"]]:
        stays = (f"{one['name']} {one['first']} to {one['last']}" for one in used)
        cranes = [f"{document['cranes'][0]['machine']}, lifts by set-up: {', '.join(stays)}"]
    words, wind, days = "; ".join(cranes), figures.get("permitted_wind"), figures.get("hire_days")
    words += f"; every lift is permitted in wind up to {wind['speed_m_s']:.1f} m/s" if wind else ""
    return words + (f"; on hire for {counted(days, 'working day')}, waits and wind included" if days else "")


def _worst(console: Console, document: Document) -> None:
    """Print the lifts that use most of the crane's capacity."""
    lifts = [lift for lift in document["lifts"] if lift.get("load_kg") is not None]
    if not lifts:
        return
    used = sorted(lifts, key=lambda lift: (-(lift["utilisation"] or 2.0), lift["number"]))[:_WORST]
    cranes, figures = bool(document["figures"].get("cranes")), document["figures"]
    columns = {name: of for name, of in LIFT.items() if name != "crane" or cranes}
    for column in _LEFT_OUT:
        if width_of({name: of for name, of in columns.items() if name != "part"}, used) <= console.width - _PART_WIDTH:
            break
        columns.pop(column)
    critical = f"{figures['critical_lifts'] or 0:,} at {100.0 * figures['critical_share']:.0f} % or more"
    rest = len(document["lifts"]) - len(lifts)
    numbers = f"; numbers are of all {len(document['lifts']):,} parts, in their order" if rest else ""
    title = shortened(f"worst lifts by capacity ({critical}); {GROSS}{numbers}", console.width)
    table(console, columns, used, title=title, limit=None, cut="part")
