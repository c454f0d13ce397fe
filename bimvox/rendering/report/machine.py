"""The site and its cranes, each with its load chart."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bimvox.crane.load_chart import LoadChart, capacity_kg
from bimvox.crane.sectors import sectors_of
from bimvox.crane.tower_crane import TowerCrane
from bimvox.rendering.report.distances import base_words, distances, room_words, tail_words
from bimvox.rendering.report.html import element, number, paragraph, picture, section, tag, terms, text, ticks, value
from bimvox.rendering.report.words import SWING, fixed, length, named, percent, span, tonnes
from bimvox.rendering.words import escape


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
        ("Existing structure", fixed(site["structure"], 0)),
        ("Clearance", f"{rules['clearance_m']:g} m from obstructions and mast"),
        ("In transit", "" if first is None else _in_transit(rules, record["lifts"], site["least_height"])),
        ("In the yard, when set", "" if first is None else _near_rest(rules, record["lifts"])),
        ("Contact tolerance", f"{rules['contact_tolerance_m'] * 1000:g} mm"),
        ("Samples", f"every {rules['sample_period_s']:g} s or closer"),
    ]
    if first is None:
        pairs.append(("Crane", "none: paths are proven cell by cell, times are nominal"))
        return section("Site", terms(pairs))
    pairs.append(("Swing", SWING[rules["swing"]]))
    machines = [first, *record.get("other_cranes", [])]
    several, set_ups = len(machines) > 1, record.get("set_ups", ())
    pairs += _set_ups(set_ups, record.get("moves", ()))
    distances, what = {one["crane"]: one for one in record["distances"]}, "Set-up" if set_ups else "Crane"
    shown = []
    for number_, (own, crane) in enumerate(zip(machines, cranes, strict=True)):
        if crane.name not in distances:  # a set-up that serves no lift
            continue
        lifts = [lift for lift in record["lifts"] if not several or lift["crane"] == number_]
        title = f"{what} {number_ + 1} and load chart" if several else "Crane and load chart"
        shown.append(_crane(record, own, crane, lifts, title, distances[crane.name]))
    return section("Site", terms(pairs)) + "".join(shown)


def _set_ups(set_ups: Sequence[dict[str, Any]], moves: Sequence[dict[str, Any]]) -> Iterator[tuple[str, str]]:
    """Yield the set-ups of a crane that moves, with their lifts, and how long each move takes."""
    took_s = {move["to"]: move["ends_s"] - move["begins_s"] for move in moves}
    for one in set_ups:
        words = f"lifts {one['first']} to {one['last']}" if one["lifts"] else "no lift: the crane does not go there"
        if one["name"] in took_s:
            words += f"; the move there takes {span(took_s[one['name']])}: derig, drive, rig"
        yield f"Set-up {escape(one['name'])}", words


def _crane(
    record: dict[str, Any],
    machine: dict[str, Any],
    crane: TowerCrane,
    lifts: Sequence[dict[str, Any]],
    title: str,
    around: dict[str, Any],
) -> str:
    """Return one crane, its load chart with its lifts, and its clear distances."""
    rules = record["site"]["rules"]
    base = ", ".join(fixed(value, 2) for value in machine["base_m"])
    rigging = value(machine, "rigging_mass_kg", tonnes)
    gears = "".join(f"; up to {tonnes(most)} t {fixed(rate * 60, 0)} m/min" for most, rate in machine["gears"])
    jib = f"{machine['jib_length_m']:.4g} m long, {machine['jib_height_m']:.4g} m high"
    own = [
        ("Crane", f"<b>{escape(machine['name'])}</b>, foot at x, y, z {base} m"),
        ("Machine", escape(machine["machine"]) if machine["machine"] != machine["name"] else ""),
        (
            "Override",
            escape("; ".join(f"{o['key']}: {o['site']} instead of {o['catalogue']}" for o in machine["overrides"])),
        ),
        ("Luffing", _luffing_words(machine["luffing"])),
        ("Jib", f"{jib}, hook from {machine['min_radius_m']:.4g} m"),
        (
            "Gear of the empty hook" if record["rigs"] else "Rigging",
            f"{rigging} t, slings {machine['sling_m']:g} m high",
        ),
        ("Reeving", f"{machine['falls']} falls, hook block {tonnes(machine['hook_block_kg'])} t{gears}"),
        ("Highest rates", _rates(machine)),
        ("Driven", _driven(machine)),
        ("Wind", f"works up to {machine['max_wind_m_s']:g} m/s; {_wind(rules, lifts)}"),
        ("Working range", escape(_working_range(machine["working_range"]))),
        ("Stands on", base_words(around)),
        ("Counterweight", tail_words(around)),
        ("Mobile crane", room_words(around)),
        *_carrier_terms(machine["carrier"]),
        ("Slow zones", ", ".join(f"{share * 100:g} % of the rates" for share in machine["slow_zones"])),
    ]
    chart = _chart_table(machine["chart"])
    carrier = machine["carrier"]
    for sector in [] if carrier is None else carrier["sectors"]:
        chart += tag("p", escape(_sector_words(sector)), "faint")
        chart += "" if sector["chart"] is None else _chart_table(sector["chart"])
    drawn = _load_chart(crane, lifts, record["critical_share"], rules["highest_utilisation"])
    most = rules["highest_utilisation"]
    limit = "" if most == 1.0 else f"Dotted: {100.0 * most:g} %, the permitted share. "
    lines = "Full line: gross capacity." if not sectors_of(crane) else "Full lines: gross, around and by sector."
    note = (
        f"{lines} Dashed: {percent(record['critical_share'], 0)} of it. {limit}A dot is a lift at its "
        "governing sample, a triangle a critical one. Between two radii the smaller capacity holds."
    )
    return section(
        title, terms(own), chart, tag("div", drawn, "sheet"),
        paragraph(note, "faint"), distances(around),
    )  # fmt: skip


_COLUMNS = 14
"""Radii of a chart side by side on a page."""


def _chart_table(listed: Sequence[tuple[float, float]]) -> str:
    rows = "".join(_chart_rows(listed[at : at + _COLUMNS]) for at in range(0, len(listed), _COLUMNS))
    return tag("table", tag("tbody", rows), "chartrow")


def _sector_words(sector: dict[str, Any]) -> str:
    """Return the name of a sector with its angles from the carrier's front."""
    first, last = (math.degrees(sector[key]) for key in ("from_rad", "to_rad"))
    held = "" if sector["chart"] is not None else ": no load may hang there"
    return f"Sector {sector['name']}, {first:.0f}° to {last:.0f}° from the carrier's front, counter-clockwise{held}"


def _carrier_terms(carrier: dict[str, Any] | None) -> list[tuple[str, str]]:
    """Return how a mobile crane is set up, and what its charts are."""
    if carrier is None:
        return []
    weight_kg, base = carrier["counterweight_kg"], carrier["outriggers"]
    words = [f"front points to {math.degrees(carrier['heading_rad']):.4g}° from the x axis, counter-clockwise"]
    if weight_kg is not None:
        words.append(f"counterweight {tonnes(weight_kg)} t")
    if base is not None:
        along, across = base["front_m"] + base["rear_m"], base["left_m"] + base["right_m"]
        words.append(f"outriggers {escape(base['name'])}, {along:.2f} m along and {across:.2f} m across")
    less = "; ".join(f"{escape(name)} {tonnes(mass_kg)} t" for name, mass_kg in carrier["deductions"])
    rated = escape(carrier["rating"]) or "not stated by the machine file"
    return [
        ("Set up", "; ".join(words)),
        ("Charts are rated at", rated),
        ("Deducted from the charts", less),
    ]


def _chart_rows(listed: Sequence[tuple[float, float]]) -> str:
    """Return two rows of the chart's table: radii, and the capacity at each."""
    radii = "".join(f"<td>{number(r, f'{r:g}')}</td>" for r, _ in listed)
    capacities = "".join(f"<td>{number(c, tonnes(c))}</td>" for _, c in listed)
    rows = (f"<th scope='row'>Radius m</th>{radii}", f"<th scope='row'>Capacity t</th>{capacities}")
    return "".join(tag("tr", cells) for cells in rows)


def _rates(machine: dict[str, Any]) -> str:
    """Return the highest rates of the machine's axes, lifting speeds by the minute as data sheets give them."""
    slew, hoist = math.degrees(machine["slewing"]["rate"]), machine["hoist"]["rate"]
    second = f"trolley {_by_minute(machine['trolley']['rate'])}"
    if (luffing := machine["luffing"]) is not None:
        second, hoist = f"luffing {math.degrees(luffing['limits']['rate']):.2f} °/s", luffing["winch"]["rate"]
    light = max((rate for _, rate in machine["gears"]), default=hoist)
    words = _by_minute(hoist) + (f", {_by_minute(light)} with light loads" if light > hoist else "")
    return f"slewing {fixed(slew, 1)} °/s, {second}, hoist {words}"


def _driven(machine: dict[str, Any]) -> str:
    """Return the highest rates in this plan; empty without motions."""
    if (driven := machine["driven"]) is None:
        return ""
    across = "trolley" if machine["luffing"] is None else "hook's radius"
    return (
        f"at most slewing {fixed(math.degrees(driven['slewing_rad_s']), 1)} °/s, "
        f"{across} {_by_minute(driven['radius_m_s'])}, hook up and down {_by_minute(driven['loaded_m_s'])} with a load "
        f"and {_by_minute(driven['empty_m_s'])} empty"
    )


def _by_minute(rate_m_s: float) -> str:
    return f"{fixed(rate_m_s * 60.0, 0)} m/min"


def _in_transit(rules: dict[str, Any], lifts: Sequence[dict[str, Any]], lowest: dict[str, Any] | None) -> str:
    """Return the clearances in force, how many lifts keep less, and the least height that was measured."""
    load_m, rope_m = rules["transit_clearance_m"], rules["rope_clearance_m"]
    words = [f"loads {load_m:g} m from everything, hook and rope {rope_m:g} m on plan"]
    for what, key in (("loads", "clearance_m"), ("hooks and ropes", "rope_clearance_m")):
        words += _less(what, [lift[key] for lift in lifts])
    if lowest is not None:
        words.append(
            f"measured: no load is carried lower than {lowest['height_m']:.2f} m, {escape(lowest['part'])} over "
            f"{escape(lowest['over'])}"
        )
    return "; ".join(words)


def _near_rest(rules: dict[str, Any], lifts: Sequence[dict[str, Any]]) -> str:
    """Return the clearances of parts near where they lie and are set, and how many lifts keep less."""
    words = [
        f"parts upended {rules['upending_clearance_m']:g} m and turned {rules['turning_clearance_m']:g} m from "
        f"everything; straight up {rules['departure_clearance_m']:g} m and on the last moves "
        f"{rules['approach_clearance_m']:g} m from what is not next to the part at rest, up to 1 m above it"
    ]
    for what in ("upending", "turning", "departure", "approach"):
        words += _less(f"loads ({what})", [lift[f"{what}_clearance_m"] for lift in lifts])
    return "; ".join(words)


def _less(what: str, kept_m: Sequence[float | None]) -> list[str]:
    """Return how many lifts keep less than a clearance, in words; nothing if none does."""
    less = [one for one in kept_m if one is not None]
    return [f"{len(less):,} {what} keep less, down to {min(less):g} m (see the remarks)"] if less else []


def _wind(rules: dict[str, Any], lifts: Sequence[dict[str, Any]]) -> str:
    """Return the wind that is planned, the smallest in which every lift is permitted, and what needs less."""
    speed = rules["wind_speed_m_s"]
    planned = [lift for lift in lifts if lift["status"] == "planned"]
    words = [f"planned for {speed:g} m/s" if speed else "no wind is planned"]
    if planned:
        governs = min(planned, key=lambda lift: (lift["lifting"]["permitted_wind_m_s"], lift["order"]))
        least = governs["lifting"]["permitted_wind_m_s"]
        whose = f"{escape(named(governs))}, lift {governs['number']}"
        words.append(f"every lift is permitted up to {least:.1f} m/s ({whose})")
        waiting = sum(lift["lifting"]["permitted_wind_m_s"] < speed for lift in planned)
        if waiting:
            words.append(f"{waiting:,} lifts wait for less than is planned")
        below = sum(lift["lifting"]["permitted_wind_m_s"] < rules["least_wind_m_s"] for lift in planned)
        if below and speed:
            words.append(
                f"{below:,} of them for less than {rules['least_wind_m_s']:g} m/s, in which any lift should go"
            )
    return "; ".join(words)


def _working_range(given: dict[str, Any]) -> str:
    """Return the settings of the limiters; empty without any."""
    words = []
    if given["slew_rad"] is not None:
        words.append("slewing {:.1f}° to {:.1f}°".format(*(math.degrees(angle) for angle in given["slew_rad"])))
    if given["radius_m"] is not None:
        words.append("radius {:g} to {}".format(round(given["radius_m"][0], 2), length(given["radius_m"][1])))
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


# The load chart with every lift in it.

_WIDTH, _HEIGHT, _LEFT, _RIGHT, _TOP, _BOTTOM = 1040.0, 360.0, 62.0, 14.0, 12.0, 40.0
_STEPS_M = (1.0, 2.0, 5.0, 10.0, 20.0)
_STEPS_T = (0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0)


def _load_chart(
    crane: TowerCrane, lifts: Sequence[dict[str, Any]], critical_share: float, permitted: float = 1.0
) -> str:
    """Return the capacity over the radius, stepped as listed, and each lift at its governing sample, as SVG.

    Further curves are the critical share of the capacity, and the permitted share if that is below 1. Lifts without a
    governing sample are left out.
    """
    held = [lift for lift in lifts if lift["governs"]]
    radius_m, carries_kg = _steps(crane, crane.chart)
    by_sector = [_steps(crane, one.chart) for one in sectors_of(crane) if one.chart is not None]
    highest_kg = [float(kg.max()) for _, kg in [(radius_m, carries_kg), *by_sector]]
    most_kg: float = max(*highest_kg, *(lift["governs"]["load_kg"] for lift in held), 1.0) * 1.05

    def x(at_m: float) -> float:
        return _LEFT + float(at_m) / crane.jib_length_m * (_WIDTH - _LEFT - _RIGHT)

    def y(mass_kg: float) -> float:
        return _HEIGHT - _BOTTOM - float(mass_kg) / most_kg * (_HEIGHT - _TOP - _BOTTOM)

    def curve(share: float, class_: str, steps: _Steps = (radius_m, carries_kg)) -> str:
        points = " ".join(f"{x(r):.1f},{y(share * c):.1f}" for r, c in zip(*steps, strict=True))
        return element("polyline", points=points, class_=class_)

    parts = []
    for at in ticks(0.0, crane.jib_length_m, 14, _STEPS_M):
        parts.append(element("line", x1=x(at), x2=x(at), y1=_TOP, y2=_HEIGHT - _BOTTOM, class_="grid"))
        parts.append(text(fixed(at, 0), x(at), _HEIGHT - _BOTTOM + 14.0, text_anchor="middle", class_="tick"))
    for at in ticks(0.0, most_kg / 1000.0, 7, _STEPS_T):
        parts.append(element("line", x1=_LEFT, x2=_WIDTH - _RIGHT, y1=y(at * 1000), y2=y(at * 1000), class_="grid"))
        parts.append(text(f"{at:g}", _LEFT - 6.0, y(at * 1000) + 4.0, text_anchor="end", class_="tick"))
    parts.append(text("radius of the hook, m", _WIDTH / 2.0, _HEIGHT - 6.0, text_anchor="middle", class_="axis"))
    middle = (_TOP + _HEIGHT - _BOTTOM) / 2.0
    upwards = f"rotate(-90 14 {middle:g})"
    parts.append(text("load and rigging, t", 14.0, middle, text_anchor="middle", class_="axis", transform=upwards))
    parts += [curve(critical_share, "threshold"), curve(1.0, "capacity")]
    parts += [curve(1.0, "capacity", steps) for steps in by_sector]
    parts += [curve(permitted, "permitted")] if permitted < 1.0 else []
    parts += [_point(lift, x, y) for lift in held]
    return picture(_WIDTH, _HEIGHT, f"Load chart of {crane.name} with {len(held)} lifts", parts, "chart")


_Steps = tuple[NDArray[np.float64], NDArray[np.float64]]


def _steps(crane: TowerCrane, chart: LoadChart) -> _Steps:
    """Return radii and capacities of a chart as a stepped line: the capacity up to a listed radius, then the next."""
    listed_m = [at for at in chart.radius_m if crane.min_radius_m < at < crane.jib_length_m]
    radius_m = np.array([crane.min_radius_m, *np.repeat(listed_m, 2), crane.jib_length_m])
    return radius_m, np.repeat(capacity_kg(chart, radius_m[1::2]), 2)


def _point(lift: dict[str, Any], x: Any, y: Any) -> str:
    governs = lift["governs"]
    at_x, at_y = x(governs["radius_m"]), y(governs["load_kg"])
    if lift["critical"]:
        return element("path", _title(lift), d=f"M{at_x:.1f} {at_y - 5.5:.1f}l5 9h-10z", class_="dot critical")
    return element("circle", _title(lift), cx=at_x, cy=at_y, r=3.0, class_="dot")


def _title(lift: dict[str, Any]) -> str:
    used = lift["governs"]["utilisation"]
    share = "beyond the chart" if used is None else percent(used, 1)
    return element("title", escape(f"Lift {lift['number']}, {named(lift)}: {share}"))
