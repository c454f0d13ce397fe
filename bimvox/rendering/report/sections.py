"""The sections of the report, in a lifting supervisor's reading order."""

from __future__ import annotations

import math
from collections.abc import Sequence
from html import escape
from typing import Any

from bimvox.crane.tower_crane import TowerCrane
from bimvox.rendering.report.chart import load_chart
from bimvox.rendering.report.gantt import crane_chart, gantt_charts
from bimvox.rendering.report.html import number, paragraph, row, table, tag, terms
from bimvox.rendering.report.lifts import critical_first, lift_table
from bimvox.rendering.report.words import CHECKS, METHODS, SWING, clock, fixed, named, names_of, span, tonnes
from bimvox.rendering.words import counted
from bimvox.site.part_names import with_names

_LISTED = 12


def heading(record: dict[str, Any]) -> str:
    """Return title, verdict and totals."""
    site, log, proof = record["site"], record["log"], record["proof"]
    good = bool(proof and proof["verified"])
    verdict = "✓ proven" if good else "✕ NOT PROVEN"
    chip = tag("p", verdict, "chip good" if good else "chip bad")
    state = " Recovered from a damaged log: some lifts may be missing." if log["recovered"] else ""
    state += " An extract: the other lifts of the plan are listed without their paths." if log["extract"] else ""
    names = f"Model {site['model'] or 'not named'} · log {log['name']} · revision {log['revision']}.{state}"
    title = tag("div", f"<h1>{escape(site['name'])}: lift plan record</h1>{paragraph(names, 'faint')}")
    return tag("header", title + chip) + tag("section", terms(_total_terms(record)), "totals")


def _total_terms(record: dict[str, Any]) -> list[tuple[str, str]]:
    """Return terms and their values, escaped."""
    totals = record["totals"]
    highest, travel = totals["highest_utilisation"], totals["hook_travel_m"]
    ratio = totals["moves"] / totals["shortest_moves"] if totals["shortest_moves"] else None

    def count(key: str) -> str:
        return number(totals[key], fixed(totals[key], 0), key)

    nominal = "" if totals["timed_by"] == "crane" else " (nominal: no crane, 1 s per move)"
    hours = number(totals["total_s"], f"{fixed(totals['total_s'] / 3600, 2)} h", "total_s")
    critical_words = f"{count('critical')} (capacity used from {fixed(record['critical_share'] * 100, 0)} % on)"
    heaviest = number(totals["heaviest_kg"], tonnes(totals["heaviest_kg"]), "heaviest_kg")
    return [
        ("Lifts", f"{count('planned')} of {count('lifts')} parts planned, {count('infeasible')} infeasible"),
        ("Total time", f"{hours} = {span(totals['total_s'])}{nominal}"),
        ("Load in transit", number(totals["carrying_s"] or None, span(totals["carrying_s"]), "carrying_s")),
        ("Cranes", _cranes(totals["cranes"], totals["total_s"]) if "cranes" in totals else ""),
        ("Hook travel", number(travel, f"{fixed(travel / 1000, 2)} km", "hook_travel_m") if travel else ""),
        (
            "Mass set",
            f"{number(totals['mass_kg'], tonnes(totals['mass_kg']), 'total_mass_kg')} t, heaviest part {heaviest} t",
        ),
        ("Critical lifts", critical_words if record["crane"] else ""),
        (
            "Highest use",
            number(highest, f"{fixed(highest * 100, 1)} % of the capacity", "highest_utilisation") if highest else "",
        ),
        ("Paths found", ", ".join(_method(method) for method in record["methods"])),
        ("Moves / fewest", number(ratio, fixed(ratio, 3), "moves_ratio") if ratio else ""),
    ]


def _cranes(cranes: Sequence[dict[str, Any]], whole_s: float) -> str:
    """Return lifts and working share of each of several cranes."""
    words = []
    for n, crane in enumerate(cranes, start=1):
        lifts = number(crane["lifts"], fixed(crane["lifts"], 0), f"lifts_crane_{n}")
        share = crane["works_s"] / whole_s if whole_s else 0.0
        works = number(share, f"{fixed(share * 100, 0)} %", f"works_crane_{n}")
        words.append(f"{n} {escape(crane['name'])}: {lifts} lifts, working {works} of the time")
    return "<br>".join(words)


def _method(found: dict[str, Any]) -> str:
    name = found["method"]
    lifts = number(found["lifts"], fixed(found["lifts"], 0), f"lifts_{name}")
    share = number(found["share"], f"{fixed(found['share'] * 100, 1)} %", f"share_{name}")
    return f"{lifts} by {escape(METHODS.get(name, name))} ({share})"


def infeasible(record: dict[str, Any], pictures: Sequence[tuple[tuple[int, ...], str]]) -> str:
    """Return the infeasible parts with their reasons and blockers.

    Args:
        record: The record.
        pictures: Orders of the lifts in a picture, and the picture as an element.
    """
    by_order = {lift["order"]: lift for lift in record["lifts"]}
    chosen = [by_order[order] for order in record["infeasible"]]
    if not chosen:
        return ""
    names = {lift["id"]: named(lift) for lift in record["lifts"]}
    rows = [
        row(
            [
                number(lift["order"], str(lift["number"]), "order"),
                f"<b>{escape(named(lift))}</b><br>{tag('code', escape(lift['global_id']))}",
                escape(lift["reason"] or "no reason is recorded"),
                "<br>".join(_blocker(name, names) for name in lift["blocked_by"]) or "–",
            ],
            "bad",
            data_order=str(lift["order"]),
        )
        for lift in chosen
    ]
    shown = {order for orders, _ in pictures for order in orders}
    missing = [lift for lift in chosen if lift["order"] not in shown]
    words = f"{counted(len(missing), 'more part')} without a picture: --pictures N draws more." if missing else ""
    return tag(
        "section",
        f"<h2>Infeasible: {counted(len(chosen), 'part')} not lifted</h2>"
        + table(("Lift", "Part", "Why", "Blocked by"), rows, class_="words", id_="infeasible")
        + tag("div", "".join(html for _, html in pictures), "pictures")
        + (paragraph(words, "faint") if words else ""),
        id="infeasible-parts",
    )


def _blocker(name: str, names: dict[str, str]) -> str:
    part = f"{escape(names[name])} " if names.get(name, name) != name else ""
    return part + tag("code", escape(name))


def critical(record: dict[str, Any]) -> str:
    """Return the definition and number of critical lifts."""
    if record["crane"] is None:
        return ""
    orders, share = record["critical"], fixed(record["critical_share"] * 100, 0)
    if not orders:
        words = f"No lift uses {share} % or more of the crane's capacity (load and rigging, at the governing sample)."
    else:
        words = (
            f"▲ marks {counted(len(orders), 'lift')} using {share} % or more of the crane's capacity (load and "
            "rigging together), at the governing sample with the highest utilisation. "
            "They come first in the table, the highest utilisation first."
        )
    return tag("section", f"<h2>Critical lifts: {len(orders)}</h2>{paragraph(words)}", id="critical-lifts")


def lifts(record: dict[str, Any]) -> str:
    """Return the table of all lifts, critical ones first."""
    shown = critical_first(record["lifts"], record["critical"])
    return tag(
        "section",
        "<h2>Lifts: critical ones, then in order</h2>"
        + lift_table(
            shown,
            proof_made=record["proof"] is not None,
            id_="lifts",
            caption="Every lift, critical ones first, then in order",
        ),
        "wide",
    )


def gantt(record: dict[str, Any]) -> str:
    """Return the Gantt charts and their legend."""
    charts = gantt_charts(record["lifts"])
    if not charts:
        return ""
    if "cranes" in record["totals"]:
        charts = [crane_chart(record["lifts"], [crane["name"] for crane in record["totals"]["cranes"]]), *charts]
    legend = "".join(
        tag("li", f'<span class="swatch {name}"></span>{words}')
        for name, words in (
            ("empty", "empty hook"),
            ("handling", "hooking on, raising, setting, releasing"),
            ("carrying", "load in transit"),
        )
    )
    key = tag("ul", legend + tag("li", "▲ critical"), "legend")
    return tag(
        "section", "<h2>Gantt chart</h2>" + key + "".join(tag("div", chart, "sheet") for chart in charts), id="gantt"
    )


def _working_range(given: dict[str, Any]) -> str:
    """Return the settings of the limiters; empty without any."""
    words = []
    if given["slew_rad"] is not None:
        words.append("slewing {:.1f}° to {:.1f}°".format(*(math.degrees(angle) for angle in given["slew_rad"])))
    if given["radius_m"] is not None:
        words.append("radius {:g} to {:g} m".format(*given["radius_m"]))
    if given["highest_hook_m"] is not None:
        words.append(f"hook up to {given['highest_hook_m']:g} m")
    return ", ".join(words)


def _luffing_words(jib: dict[str, Any] | None) -> str:
    """Return the data of a luffing jib; empty for a jib with a trolley."""
    if jib is None:
        return ""
    low, high = (math.degrees(angle) for angle in jib["luff_rad"])
    return (
        f"{jib['length_m']:g} m, pivot at {jib['pivot_height_m']:g} m, {low:.0f}° to {high:.0f}° at "
        f"{math.degrees(jib['limits']['rate']):.2f} °/s, tail {jib['tail_radius_m']:g} m"
    )


def machine(record: dict[str, Any], cranes: Sequence[TowerCrane]) -> str:
    """Return site and cranes with their load charts."""
    site, rules, first = record["site"], record["site"]["rules"], record["crane"]
    size_m = site["voxel_size_m"]
    extent = " x ".join(f"{value:g}" for value in site["extent_m"])
    cells = " x ".join(str(value) for value in site["shape"])
    pairs = [
        ("Extent", f"{extent} m, {cells} cells of {number(size_m, f'{size_m:g}', 'voxel_size_m')} m"),
        ("Yard", f"{fixed(site['yard_m2'], 0)} m²"),
        ("No load above", f"{fixed(site['no_load_m2'], 0)} m²" if site["no_load_m2"] else ""),
        ("No hook above", f"{fixed(site['prohibited_m2'], 0)} m²" if site["prohibited_m2"] else ""),
        ("Obstructions", escape(", ".join(site["obstructions"])) or "none"),
        ("Standing structure", fixed(site["structure"], 0)),
        ("Clearance", f"{rules['clearance_m']:g} m from obstructions and mast"),
        ("Contact tolerance", f"{rules['contact_tolerance_m'] * 1000:g} mm"),
        ("Samples", f"every {rules['sample_period_s']:g} s or closer"),
    ]
    if first is None:
        pairs.append(("Crane", "none: paths are proven cell by cell, times are nominal"))
        return tag("section", "<h2>Site</h2>" + terms(pairs))
    pairs.append(("Swing", SWING[rules["swing"]]))
    machines = [first, *record.get("other_cranes", [])]
    several = len(machines) > 1
    shown = []
    for number_, (own, crane) in enumerate(zip(machines, cranes, strict=True)):
        lifts = [lift for lift in record["lifts"] if not several or lift["crane"] == number_]
        title = f"Crane {number_ + 1} and load chart" if several else "Crane and load chart"
        shown.append(_crane(record, own, crane, lifts, title))
    return tag("section", "<h2>Site</h2>" + terms(pairs)) + "".join(shown)


def _crane(
    record: dict[str, Any], machine: dict[str, Any], crane: TowerCrane, lifts: Sequence[dict[str, Any]], title: str
) -> str:
    """Return one crane, and its load chart with its lifts."""
    rules = record["site"]["rules"]
    base = ", ".join(fixed(value, 2) for value in machine["base_m"])
    slew = math.degrees(machine["slewing"]["rate"])
    rigging = number(machine["rigging_mass_kg"], tonnes(machine["rigging_mass_kg"]), "rigging_mass_kg")
    trolley, hoist = machine["trolley"]["rate"], machine["hoist"]["rate"]
    second = f"trolley {trolley:g} m/s"
    if (luffing := machine["luffing"]) is not None:
        second, hoist = f"luffing {math.degrees(luffing['limits']['rate']):.2f} °/s", luffing["winch"]["rate"]
    gears = "".join(f"; up to {tonnes(most)} t {fixed(rate * 60, 0)} m/min" for most, rate in machine["gears"])
    jib = f"{machine['jib_length_m']:.4g} m long, {machine['jib_height_m']:.4g} m high"
    own = [
        ("Crane", f"<b>{escape(machine['name'])}</b>, foot at x, y, z {base} m"),
        ("Luffing", _luffing_words(machine["luffing"])),
        ("Jib", f"{jib}, hook from {machine['min_radius_m']:.4g} m on"),
        ("Rigging", f"{rigging} t, slings {machine['sling_m']:g} m high"),
        ("Reeving", f"{machine['falls']} falls, hook block {tonnes(machine['hook_block_kg'])} t{gears}"),
        ("Highest rates", f"slewing {fixed(slew, 2)} °/s, {second}, hoist {hoist:g} m/s"),
        ("Wind", f"works up to {machine['max_wind_m_s']:g} m/s; planned for {rules['wind_speed_m_s']:g} m/s"),
        ("Working range", escape(_working_range(machine["working_range"]))),
        ("Slow zones", ", ".join(f"{share * 100:g} % of the rates" for share in machine["slow_zones"])),
    ]
    chart = tag(
        "tr", "<th scope='row'>Radius m</th>" + "".join(f"<td>{number(r, f'{r:g}')}</td>" for r, _ in machine["chart"])
    ) + tag(
        "tr",
        "<th scope='row'>Capacity t</th>" + "".join(f"<td>{number(c, tonnes(c))}</td>" for _, c in machine["chart"]),
    )
    drawn = load_chart(crane, lifts, record["critical_share"])
    note = (
        f"Full line: capacity. Dashed: {fixed(record['critical_share'] * 100, 0)} % of it. A dot is a lift at its "
        "governing sample, a triangle a critical one. Between two radii the capacity is interpolated by a hyperbola."
    )
    return tag(
        "section",
        f"<h2>{title}</h2>" + terms(own) + tag("table", tag("tbody", chart), "chartrow")
        + tag("div", drawn, "sheet") + paragraph(note, "faint"),
    )  # fmt: skip


def deliveries(record: dict[str, Any]) -> str:
    """Return the deliveries to the yard."""
    groups = record["deliveries"]
    if not groups:
        return ""
    names = {lift["order"]: named(lift) for lift in record["lifts"]}
    rows = []
    for group in groups:
        orders = group["orders"]
        parts = ", ".join(names[order] for order in orders[:_LISTED])
        more = f" and {len(orders) - _LISTED} more" if len(orders) > _LISTED else ""
        when = "–" if group["begins_s"] is None else f"{clock(group['begins_s'])} to {clock(group['ends_s'])}"
        rows.append(
            row(
                [
                    number(group["delivery"], str(group["delivery"] + 1), "delivery"),
                    f"{orders[0] + 1} to {orders[-1] + 1} ({len(orders)})",
                    number(group["mass_kg"], tonnes(group["mass_kg"]), "mass_kg"),
                    when,
                    escape(parts + more),
                ]
            )
        )
    return tag(
        "section",
        "<h2>Deliveries to the yard</h2>"
        + paragraph("A delivery arrives when every lift of the earlier ones is done.", "faint")
        + table(("No.", "Lifts", "Mass t", "Lifted", "Parts"), rows, class_="words"),
    )


def proof(record: dict[str, Any]) -> str:
    """Return what was proven, how, with how many samples, and what failed."""
    made = record["proof"]
    if made is None:
        words = "NOT PROVEN. This report was made without a proof; bimvox verify proves the log."
        return tag("section", "<h2>Proof</h2>" + paragraph(words, "warn"), id="proof")
    total = sum(check["samples"] for check in made["checks"])
    failed = [check for check in made["checks"] if not check["passed"]]
    if made["verified"]:
        words = (
            f"Every check passed: {fixed(total, 0)} samples. The plan was proven again for this report, "
            "from the log alone and by means independent of the planner. A check without samples had nothing to check."
        )
    else:
        words = f"NOT PROVEN: {counted(len(failed), 'check')} failed. Do not lift by this plan."
    rows = [
        row(
            [
                escape(check["name"].replace("_", " ")),
                "–" if not check["samples"] else "✓ passed" if check["passed"] else f"✕ {check['failed']} failed",
                number(check["samples"], fixed(check["samples"], 0), "samples"),
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
    found = "".join(tag("li", f"<b>{escape(c['name'])}</b>: {escape(text)}") for c in failed for text in c["failures"])
    return tag(
        "section",
        "<h2>Proof: what was proven, and how</h2>"
        + paragraph(words, "" if made["verified"] else "warn")
        + (tag("ul", found) if found else "")
        + table(("Check", "Result", "Samples", "Worst", "What it checks"), rows, class_="words", id_="checks"),
        id="proof",
    )


def inputs(record: dict[str, Any]) -> str:
    """Return all inputs of the plan with their hashes."""
    kinds = {"log": "log", "model": "model", "file": "file in the log", "digest": "digest", "value": "setting"}
    rows = [
        row([escape(kinds[item["kind"]]), escape(item["name"]), tag("code", escape(item["value"]))])
        for item in record["inputs"]
    ]
    return tag(
        "section",
        "<h2>Made from</h2>"
        + paragraph("SHA-256 of files. A digest is the SHA-256 of the values that a plan depends on.", "faint")
        + table(("What", "Name", "SHA-256 or value"), rows, class_="words hashes", id_="inputs"),
    )


def remarks(record: dict[str, Any]) -> str:
    """Return notes, and pairs of parts that overlap in the model."""
    html, names = "", names_of(record)
    if record["notes"]:
        notes = "".join(tag("li", escape(with_names(note, names))) for note in record["notes"])
        html += tag("section", "<h2>Notes</h2>" + tag("ul", notes))
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
        html += tag(
            "section",
            f"<h2>Overlaps in the model: {counted(len(rows), 'pair')}</h2>"
            + paragraph("Each pair may overlap by no more than it does in the model.", "faint")
            + table(("Part", "Part", "Depth mm"), rows, class_="words"),
        )
    return html
