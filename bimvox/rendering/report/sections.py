"""The sections of the report, in a lifting supervisor's reading order; site and cranes are in ``machine``."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from bimvox.errors import listed
from bimvox.records.unloading import Unloading
from bimvox.rendering.report.gantt import crane_chart, gantt_chart
from bimvox.rendering.report.html import number, paragraph, row, section, table, tag, terms, value
from bimvox.rendering.report.lifts import critical_first, lift_table, short_lift_table, words_of_lifts
from bimvox.rendering.report.risks import in_short
from bimvox.rendering.report.words import CHECKS, fixed, named, names_of, percent, ranges, span, tonnes
from bimvox.rendering.words import counted, escape
from bimvox.site.means import HOW
from bimvox.site.site import with_names
from bimvox.units import elapsed

_LISTED = 12
_MOST_CRITICAL = 15
"""Critical lifts in the report itself; its annex has all."""
_AMOUNTS = ("total", "crew", "hire", "lorries", "set_up")


def heading(record: dict[str, Any]) -> str:
    """Return title, verdict and totals."""
    site, log, verdict = record["site"], record["log"], record["verdict"]
    chips = "".join(
        tag("p", escape(verdict[what]), f"chip {verdict[f'{what}_light']}") for what in ("proof", "remarks")
    )
    state = " Recovered from a damaged log: some lifts may be missing." if log["recovered"] else ""
    state += " An extract: the other lifts of the plan are listed without their paths." if log["extract"] else ""
    names = f"Model {site['model'] or 'not named'} · log {log['name']} · revision {log['revision']}.{state}"
    title = tag("div", f"<h1>{escape(site['name'])}: lift plan record</h1>{paragraph(names, 'faint')}")
    return tag("header", title + tag("div", chips, "verdict")) + tag("section", terms(_total_terms(record)), "totals")


def _total_terms(record: dict[str, Any]) -> list[tuple[str, str]]:
    """Return terms and their values, escaped."""
    totals = record["totals"]
    highest, travel = totals["highest_utilisation"], totals["hook_travel_m"]

    def count(key: str) -> str:
        return number(totals[key], fixed(totals[key], 0), key)

    nominal = "" if totals["timed_by"] == "crane" else " (nominal: no crane, 1 s per move)"
    wanted = number(
        totals["planned"] + totals["infeasible"], fixed(totals["planned"] + totals["infeasible"], 0), "wanted"
    )
    time, whole = totals["time"], value(totals, "total_s", span)
    critical_words = f"{count('critical')} ({percent(record['critical_share'], 0)} of the capacity or more)"
    heaviest = value(totals, "heaviest_kg", tonnes)
    return [
        (
            "Lifts",
            f"{count('planned')} of {wanted} lifts planned, {count('infeasible')} infeasible; {count('lifts')} parts",
        ),
        ("Time", escape(time["span_in_words"]) if time else f"{whole}{nominal}"),
        ("Work", _work(time) if time else ""),
        ("Lorries", Unloading(**time["unloading"]).in_words if time and time["unloading"] else ""),
        ("Load in transit", number(totals["carrying_s"] or None, span(totals["carrying_s"]), "carrying_s")),
        ("Cranes", _cranes(totals["cranes"], totals["total_s"]) if "cranes" in totals else ""),
        ("Hook travel", number(travel, f"{fixed(travel / 1000, 2)} km", "hook_travel_m") if travel else ""),
        (
            "Mass set",
            f"{number(totals['mass_kg'], tonnes(totals['mass_kg']), 'total_mass_kg')} t, heaviest part {heaviest} t",
        ),
        ("Crane needed", _needed(totals) if record["crane"] else ""),
        ("Costs", _costs(totals["cost"]) if totals["cost"] else ""),
        ("Critical lifts", critical_words if record["crane"] else ""),
        ("Lift category", in_short(record) if record["crane"] else ""),
        ("To tick", f"{len(record['not_covered']):,} lines that this plan does not cover"),
        (
            "Highest use",
            number(highest, f"{percent(highest, 1)} of the capacity", "highest_utilisation") if highest else "",
        ),
    ]


def _work(time: dict[str, Any]) -> str:
    """Return the hours of the crane to lift, and to unload."""
    lift = number(time["crane_hours"], fixed(time["crane_hours"], 1), "crane_hours")
    unload = number(time["unloading_hours"], fixed(time["unloading_hours"], 1), "unloading_hours")
    return f"{lift} crane hours" + (f" to lift and {unload} to unload" if time["unloading_hours"] else "")


def _needed(totals: dict[str, Any]) -> str:
    """Return how long the crane is needed: its hire, without erecting and dismantling; empty without dates."""
    if (dates := totals["calendar"]) is None:
        return ""
    days = number(dates["hire_days"], counted(dates["hire_days"], "day"), "hire_days")
    return f"{days} of the working week, waits and wind included; erecting and dismantling come on top"


def _costs(cost: dict[str, Any]) -> str:
    """Return what crew, hire, lorries and set-up cost, and by which rates."""
    amounts = {key: number(cost[key], fixed(cost[key], 0), f"cost_{key}") for key in _AMOUNTS}
    hire = f"hire {amounts['hire']} for {counted(cost['hire_days'], 'day')} of the working week"
    parts = f"crew {amounts['crew']}, {hire}, lorries {amounts['lorries']}, set-up {amounts['set_up']}"
    return f"{amounts['total']} {escape(cost['currency'])}: {parts}<br>{escape(cost['source'])}"


def _cranes(cranes: Sequence[dict[str, Any]], whole_s: float) -> str:
    """Return lifts and working share of each of several cranes."""
    words = []
    for n, crane in enumerate(cranes, start=1):
        lifts = number(crane["lifts"], fixed(crane["lifts"], 0), f"lifts_crane_{n}")
        share = crane["works_s"] / whole_s if whole_s else 0.0
        works = number(share, percent(share, 0), f"works_crane_{n}")
        words.append(f"{n} {escape(crane['name'])}: {lifts} lifts, working {works} of the time")
    return "<br>".join(words)


def infeasible(record: dict[str, Any], pictures: Sequence[tuple[tuple[int, ...], str]]) -> str:
    """Return the infeasible parts with their reasons and blockers; pictures come with the orders of their lifts."""
    by_order = {lift["order"]: lift for lift in record["lifts"]}
    chosen = [by_order[order] for order in record["infeasible"]]
    if not chosen:
        return ""
    names = record["structures"] | {lift["id"]: named(lift) for lift in record["lifts"]}
    rows = [
        row(
            [
                number(lift["order"], str(lift["number"]), "order"),
                f"<b>{escape(named(lift))}</b><br>{tag('code', escape(lift['global_id']))}",
                escape(lift["reason"] or "no reason is recorded"),
                "<br>".join(_blocker(name, names) for name in lift["blocked_by"]) or "–",
                _or_clock(lift, "needed_by"),
            ],
            "bad",
            data_order=str(lift["order"]),
        )
        for lift in chosen
    ]
    others = sum(lift["by_other_means"] for lift in chosen)
    shown = {order for orders, _ in pictures for order in orders}
    missing = [lift for lift in chosen if lift["order"] not in shown]
    words = f"{counted(len(missing), 'more part')} without a picture: --pictures N draws more." if missing else ""
    return section(
        f"Infeasible: {counted(len(chosen), 'part')} not lifted"
        + (f", {counted(others, 'part')} to be set by other means" if others else ""),
        table(("Lift", "Part", "Why", "Blocked by", "Needed by"), rows, class_="words", id_="infeasible"),
        tag("div", "".join(html for _, html in pictures), "pictures"),
        paragraph(words, "faint") if words else "",
        id="infeasible-parts",
    )


def not_lifted(record: dict[str, Any]) -> str:
    """Return what the crane does not lift, by means, storey and kind; parts that are set by hand come as a bundle."""
    groups = record["not_lifted"]
    if not groups:
        return ""
    rows = [
        row(
            [
                escape(HOW[group["means"]]),
                escape(group["storey"] or "–"),
                escape(group["kind"]),
                str(group["parts"]),
                listed(ranges(group["numbers"]), _LISTED),
                tonnes(group["mass_kg"]),
                escape(group["reason"] or ""),
                *(_or_clock(group, key) for key in ("needed_by", "begins", "ends", "carries")),
                "–" if group["material_lift_s"] is None else span(group["material_lift_s"]),
            ]
        )
        for group in groups
    ]
    times = ("Needed by", "Work begins", "Ends", "Carries", "Material lift\nwithout a path")
    head = ("Means", "Storey", "Kind", "Parts", "Numbers", "Mass, t", "Why", *times)
    parts = sum(group["parts"] for group in groups)
    table_ = table(head, rows, class_="words", id_="not-lifted")
    return section(
        f"Not lifted singly: {counted(parts, 'part')} cast in place or set by hand",
        table_,
        id="not-lifted-parts",
    )


def _or_clock(one: dict[str, Any], key: str) -> str:
    """Return a time in words; of an extract, whose working days are not known, on the clock of the log."""
    if words := one.get(f"{key}_in_words"):
        return escape(words)
    return "–" if one[f"{key}_s"] is None else elapsed(one[f"{key}_s"])


def _blocker(name: str, names: dict[str, str]) -> str:
    part = f"{escape(names[name])} " if names.get(name, name) != name else ""
    return part + tag("code", escape(name))


def critical(record: dict[str, Any]) -> str:
    """Return the definition and number of critical lifts."""
    if record["crane"] is None:
        return ""
    orders, share = record["critical"], percent(record["critical_share"], 0)
    if not orders:
        words = f"No lift uses {share} or more of the crane's capacity (load and rigging, at the governing sample)."
    else:
        words = (
            f"▲ marks {counted(len(orders), 'lift')} using {share} or more of the crane's capacity (load and "
            "rigging together), at the governing sample with the highest utilisation. "
            "Annex A has all lifts, these first."
        )
    by_order = {lift["order"]: lift for lift in record["lifts"]}
    shown, rest = [by_order[order] for order in orders[:_MOST_CRITICAL]], len(orders) - _MOST_CRITICAL
    return section(
        f"Critical lifts: {len(orders)}",
        paragraph(words),
        tag("div", short_lift_table(shown), "wide") if shown else "",
        paragraph(f"... and {rest:,} more", "faint") if rest > 0 else "",
        id="critical-lifts",
    )


def lifts(record: dict[str, Any]) -> str:
    """Return the table of the lifts, critical ones first; work that the crane does not do has a table of its own."""
    every = critical_first(record["lifts"], record["critical"])
    shown = [lift for lift in every if lift["status"] not in HOW]
    return section(
        f"Lifts: {len(shown):,}, critical ones, then in order",
        lift_table(shown, record["remarks"], proof_made=record["proof"] is not None),
        paragraph(words_of_lifts(shown), "faint"),
        class_="wide",
    )


def gantt(record: dict[str, Any]) -> str:
    """Return the Gantt chart and its legend."""
    chart = gantt_chart(record["lifts"])
    if not chart:
        return ""
    cranes = [crane["name"] for crane in record["totals"].get("cranes", ())]
    charts = [crane_chart(record["lifts"], cranes), chart] if cranes else [chart]
    of_lifts = (
        ("empty", "empty hook"),
        ("handling", "hooking on, raising, setting, releasing"),
        ("carrying", "load in transit"),
    )
    of_groups = (("carrying", "lifts"), ("empty", "from the first lift of the row to its last"))
    grouped = "data-lifts" in chart
    legend = "".join(
        tag("li", f'<span class="swatch {name}"></span>{words}') for name, words in (of_groups if grouped else of_lifts)
    )
    key = tag("ul", legend + tag("li", "▲ critical"), "legend")
    rows = "A row is a storey and a class, with its number of lifts; Annex A has every lift." if grouped else ""
    return section(
        "Gantt chart", paragraph(rows, "faint") if rows else "", key, *(tag("div", chart, "sheet") for chart in charts),
        id="gantt",
    )  # fmt: skip


def deliveries(record: dict[str, Any]) -> str:
    """Return the deliveries to the yard."""
    groups = record["deliveries"]
    if not groups:
        return ""
    names = {lift["order"]: named(lift) for lift in record["lifts"]}
    dated = any(group["arrives"] for group in groups)
    stored = [name for name in ("stacks", "racks") if any(group[name] for group in groups)]
    rows = []
    for group in groups:
        orders = group["orders"]
        when = " to ".join(_or_clock(group, key) for key in ("begins", "ends"))
        rows.append(
            row(
                [
                    number(group["delivery"], str(group["delivery"] + 1), "delivery"),
                    f"{orders[0] + 1} to {orders[-1] + 1} ({len(orders)})",
                    value(group, "mass_kg", tonnes),
                    *([escape(group["arrives"] or "–")] if dated else []),
                    when,
                    *(str(group[name] or "–") for name in stored),
                    escape(listed((names[order] for order in orders), _LISTED)),
                ]
            )
        )
    head = (
        "No.",
        "Lifts",
        "Mass t",
        *(["Arrives"] if dated else []),
        "Lifted",
        *(name.capitalize() for name in stored),
    )
    return section(
        "Deliveries to the yard",
        paragraph("A delivery arrives when every lift of the earlier ones is done.", "faint"),
        table((*head, "Parts"), rows, class_="words"),
    )


def not_covered(record: dict[str, Any]) -> str:
    """Return what the plan does not cover, each as a line with a box to tick, a name and a date; empty without any."""
    lines = record["not_covered"]
    if not lines:
        return ""
    rows = [row([escape(one["topic"]), escape(one["text"]), "☐", "", ""], data_code=one["code"]) for one in lines]
    about = "Proof and remarks say nothing about these. A competent person ticks each line before the first lift."
    return section(
        f"Not covered by this plan: {counted(len(lines), 'line')} to tick",
        paragraph(about),
        table(
            ("About", "What a person checks or does", "Tick", "Name", "Date"), rows, class_="words ticks", id_="ticks"
        ),
        id="not-covered",
    )


def _result(check: dict[str, Any]) -> str:
    if not check["passed"]:
        return f"✕ {check['failed']} failed"
    return "✓ passed" if check["samples"] else "– nothing to check"


def proof(record: dict[str, Any]) -> str:
    """Return what was proven, how, with how many samples, and what failed."""
    made = record["proof"]
    if made is None:
        words = "NOT PROVEN. This report was made without a proof; bimvox verify proves the log."
        return section("Proof", paragraph(words, "warn"), id="proof")
    total = sum(check["samples"] for check in made["checks"])
    failed = [check for check in made["checks"] if not check["passed"]]
    if made["verified"]:
        words = (
            f"Every check passed: {fixed(total, 0)} samples. The plan was proven again for this report, "
            "from the log alone and by means independent of the planner. A check without samples had nothing to check."
        )
    else:
        words = f"NOT PROVEN: {counted(len(failed), 'check')} failed. Do not lift by this plan."
    earlier = made["not_current"]
    found = "".join(tag("li", f"<b>{escape(c['name'])}</b>: {escape(text)}") for c in failed for text in c["failures"])
    return section(
        "Proof: what was proven, and how",
        paragraph(words, "" if made["verified"] else "warn"),
        tag("ul", found) if found else "",
        paragraph(_earlier(earlier), "reserved") if earlier else "",
        _claims(made["claims"]) if made["verified"] else "",
        _conditions(record["conditions"]) if made["verified"] else "",
        paragraph(f"{counted(len(made['checks']), 'check')}; an annex lists them.", "faint"),
        id="proof",
    )


def checks(record: dict[str, Any]) -> str:
    """Return what each check of the proof looked at; empty if nothing was proven."""
    made = record["proof"]
    if made is None:
        return ""
    rows = [
        row(
            [
                escape(check["name"].replace("_", " ")),
                _result(check),
                value(check, "samples", 0),
                ""
                if check["worst"] is None
                else number(check["worst"], f"{check['worst']:.4g} {check['unit']}".strip(), "worst"),
                escape(CHECKS.get(check["name"], "")),
            ],
            "" if check["passed"] else "bad",
            data_check=check["name"],
        )
        for check in made["checks"]
    ]
    head = ("Check", "Result", "Samples", "Worst", "What it checks")
    return section("Checks of the proof", table(head, rows, class_="words", id_="checks"), id="proof-checks")


def _claims(claims: Sequence[dict[str, Any]]) -> str:
    """Return what the log states and the proof has taken as true, each with the option that proves it."""
    items = "".join(
        tag(
            "li",
            escape(claim["text"]) + (f" ({tag('code', claim['bind_with'])} proves it)" if claim["bind_with"] else ""),
        )
        for claim in claims
    )
    words = f"It rests on {counted(len(claims), 'claim')} of the log. bimvox verify proves those that name an option:"
    return paragraph(words) + tag("ul", items, "claims") if claims else ""


def _conditions(conditions: Sequence[str]) -> str:
    items = "".join(tag("li", escape(words)) for words in conditions)
    return paragraph("Provided that:") + tag("ul", items, "conditions") if conditions else ""


def _earlier(lifts: Sequence[dict[str, Any]]) -> str:
    words = ", ".join(f"{lift['number']} {lift['name']}" for lift in lifts)
    return (
        f"Proven against earlier obstructions only, not against the current ones: {counted(len(lifts), 'lift')}, "
        f"set before the last change: {words}."
    )


def inputs(record: dict[str, Any]) -> str:
    """Return all inputs of the plan with their hashes."""
    kinds = {"log": "log", "model": "model", "file": "file in the log", "digest": "digest", "value": "setting"}
    rows = [
        row([escape(kinds[item["kind"]]), escape(item["name"]), tag("code", escape(item["value"]))])
        for item in record["inputs"]
    ]
    return section(
        "Inputs",
        paragraph("SHA-256 of files. A digest is the SHA-256 of the values that a plan depends on.", "faint"),
        table(("What", "Name", "SHA-256 or value"), rows, class_="words hashes", id_="inputs"),
    )


def notes(record: dict[str, Any]) -> str:
    """Return notes that are not among the remarks, and pairs of parts that overlap in the model."""
    html, names = "", names_of(record)
    said = {remark["text"] for remark in record["remarks"]}
    left = [words for note in record["notes"] if not {note, words := with_names(note, names)} & said]
    if left:
        items = "".join(tag("li", escape(words)) for words in dict.fromkeys(left))
        html += section("Notes", tag("ul", items))
    if record["clashes"]:
        rows = [
            row(
                [
                    escape(names.get(clash["first"], clash["first"])),
                    escape(names.get(clash["second"], clash["second"])),
                    ("at least " if clash["at_least"] else "")
                    + number(clash["depth_m"], fixed(clash["depth_m"] * 1000, 1), "depth_m"),
                ]
            )
            for clash in record["clashes"]
        ]
        html += section(
            f"Overlaps in the model: {counted(len(rows), 'pair')}",
            paragraph("Each pair may overlap by no more than it does in the model.", "faint"),
            table(("Part", "Part", "Depth mm"), rows, class_="words"),
        )
    return html
