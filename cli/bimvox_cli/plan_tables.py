"""The tables of a plan, each printed on request: ``bimvox plan --table``."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import TYPE_CHECKING, Any

from bimvox.errors import listed
from bimvox.rendering.words import counted, hours
from bimvox_cli.output import Column, fields, lines_of, rounded, rows, spent, table
from bimvox_cli.remarks import crane_fields, not_covered, show_remarks

if TYPE_CHECKING:
    from rich.console import Console

Document = Mapping[str, Any]
TABLES = ("lifts", "parts", "refused", "remarks", "deliveries", "steps", "props", "figures", "notes")


def show_table(console: Console, name: str, document: Document, *, verbose: bool = False) -> None:
    """Print a table of a plan, every row of it; if verbose, with how paths were found, moves and bounds."""
    if lines_of(console, lambda: _TABLES[name](console, document, verbose)):
        _TABLES[name](console, document, verbose)
    else:
        console.print(f"{name}: none")


def _lifts(console: Console, document: Document, verbose: bool) -> None:
    cranes = bool(document["figures"].get("cranes"))
    columns = {name: of for name, of in LIFT.items() if name != "crane" or cranes}
    lifts = [lift for lift in document["lifts"] if lift["status"] == "planned"]
    table(console, columns, lifts, title=f"lifts: {len(lifts):,}; {GROSS}", limit=None)
    if verbose:  # both would not fit side by side on a usual terminal
        table(console, _HOW, lifts, title="how their paths were found", limit=None)


def _parts(console: Console, document: Document, _: bool) -> None:
    lifts = document["lifts"]
    table(console, _PART, lifts, title=f"parts in the order of the plan: {len(lifts):,}", limit=None)


def _refused(console: Console, document: Document, _: bool) -> None:
    names = names_of(document)
    reason: Column = lambda one: reason_of(one, names)  # noqa: E731
    refused = document["infeasible"]
    others = any(one["by_other_means"] for one in refused)
    title = f"refused: {len(refused):,}" + (", to be set by other means" if others else "")
    table(console, {**_REFUSED, "reason": reason}, refused, title=title, limit=None)


def _remarks(console: Console, document: Document, _: bool) -> None:
    show_remarks(console, document["remarks"], numbers_of(document))


def _deliveries(console: Console, document: Document, _: bool) -> None:
    found = document["deliveries"]
    table(console, _DELIVERY, found, title=f"deliveries: {len(found):,}", limit=None)


def _steps(console: Console, document: Document, _: bool) -> None:
    groups = document["not_lifted"]
    parts = counted(sum(group["parts"] for group in groups), "part")
    table(console, _STEP, groups, title=f"work without a lift of the crane: {parts}", limit=None)


def _props(console: Console, document: Document, _: bool) -> None:
    held = [one for one in document["held"] if one["props"] or one["hold"] == "nothing"]
    table(console, _PROP, held, title=f"props: {props_in_words(document) or 'none'}", limit=None)


def _figures(console: Console, document: Document, _: bool) -> None:
    fields(console, figures_of(document))


def _notes(console: Console, document: Document, _: bool) -> None:
    notes = document["notes"]
    rows(console, ("note",), [(note,) for note in notes], title=f"notes: {len(notes):,}", limit=None)


GROSS = "capacities are gross: gear and hook block count as load"
LIFT: dict[str, Column] = {
    "lift": "number",
    "crane": lambda lift: " + ".join(lift.get("tandem", {}).get("names", [lift.get("crane") or ""])),
    "part": lambda lift: lift["name"] or lift["ifc_class"],
    "t": rounded("mass_kg", 2, per=1000.0),
    "t on hook": lambda lift: _rounded(lift, "load_kg", 2, per=1000.0),
    "t capacity": lambda lift: _rounded(lift, "gross_capacity_kg", 2, per=1000.0),
    "m radius": lambda lift: _rounded(lift, "radius_m", 1),
    "% used": lambda lift: _rounded(lift, "utilisation", 1, per=0.01),
    "wind m/s": lambda lift: _rounded(lift, "permitted_wind_m_s", 1),
    "begins": lambda lift: lift.get("begins_in_words"),
}
"""What a planner wants to know of a lift."""
_HOW: dict[str, Column] = {
    "lift": "number",
    "component": "component",
    "found by": lambda lift: lift.get("planner") or lift["method"],
    "moves": "moves",
    "shortest": "shortest_moves",
    "crane s": rounded("duration_s", 1),
    "bound s": rounded("bound_s", 1),
}
_PART: dict[str, Column] = {
    "number": "number",
    "part": lambda lift: lift["name"] or lift["ifc_class"],
    "component": "component",
    "storey": "storey",
    "way": lambda lift: lift["status"].replace("_", " ").replace("planned", "crane").replace("infeasible", "refused"),
    "kind": "kind",
    "t": rounded("mass_kg", 2, per=1000.0),
    "mass from": "mass_from",
    "known by": "confidence",
    "why": "kind_from",
}
_REFUSED: dict[str, Column] = {
    "lift": "number",
    "part": "name",
    "component": "component",
    "reason": "reason",
    "blocked by": lambda one: listed(one["blocked_by_names"]),
    "needed by": lambda one: one.get("needed_by_in_words"),
}
_DELIVERY: dict[str, Column] = {
    "delivery": "number",
    "arrives": "arrives_in_words",
    "unloaded": "unloaded_in_words",
    "lorries": "lorries",
    "parts": "parts",
    "t": rounded("mass_kg", 1, per=1000.0),
    "lifts": lambda one: listed(map(str, one["lifts"]), most=8),
}
_STEP: dict[str, Column] = {
    "way": lambda group: group["means"].replace("_", " "),
    "storey": "storey",
    "kind": "kind",
    "parts": "parts",
    "t": rounded("mass_kg", 2, per=1000.0),
    "why": "reason",
    "needed by": lambda group: group.get("needed_by_in_words"),
    "work begins": lambda group: group.get("begins_in_words"),
    "carries": lambda group: group.get("carries_in_words"),
    "crane min": rounded("material_lift_s", 1, per=60.0),
}
_PROP: dict[str, Column] = {
    "lift": "number",
    "part": "name",
    "props": lambda one: len(one["props"]),
    "held by": "words",
}


def _rounded(lift: Document, key: str, digits: int, *, per: float = 1.0) -> float | None:
    return None if lift.get(key) is None else round(lift[key] / per, digits)


def names_of(document: Document) -> dict[str, str]:
    """Return the name of every part of a plan by its id."""
    from bimvox.site.site import part_name  # heavy

    return {
        lift["component"]: part_name(lift["component"], lift["name"], lift["ifc_class"]) for lift in document["lifts"]
    }


def numbers_of(document: Document) -> dict[str, int]:
    """Return the number of every part of a plan by its id."""
    return {lift["component"]: lift["number"] for lift in document["lifts"]}


def reason_of(refused: Document, names: Mapping[str, str]) -> str:
    """Return why a lift is refused, with names of parts instead of ids."""
    from bimvox.site.site import with_names  # heavy

    return with_names(refused["reason"] or "", names)


def figures_of(document: Document) -> Iterator[tuple[str, object]]:
    """Yield all figures of a plan as names and values; None if one does not apply."""
    yield "log", document["log"]
    yield from time_fields(document["time"])
    yield from ((name, note) for name, note in _about_dates(document["calendar"]))
    yield from crane_fields(document["cranes"], document.get("set_ups", ()))
    yield from figure_fields(document["figures"])
    yield "moves", _moves(document)
    yield "waits", _waits(document)
    yield "props", props_in_words(document)
    yield "material lifts", _material_lifts(document)
    yield "not covered", not_covered(document["not_covered"])
    yield "planner", planner_in_words(document)
    yield "policy", _policy(document["policy"])
    yield "retrained", _retrained(document.get("retrained"))
    yield "took", spent(document["seconds"])


def time_fields(time: Document | None) -> list[tuple[str, str | None]]:
    """Return when a plan is carried out, and the hours of its crane, as names and values."""
    if time is None:
        return []
    likely = f"; in 80 of 100 cases by {time['ends_p80']} (P80)" if time.get("ends_p80") else ""
    return [("time", f"{time['span_in_words']}{likely}"), ("work", time["hours_in_words"])]


def _about_dates(calendar: Document | None) -> Iterator[tuple[str, str]]:
    yield from (("", note) for note in (calendar or {}).get("notes", ()))


def _moves(document: Document) -> str | None:
    """Return how often and how long the crane moves to another set-up."""
    if not (moves := document.get("moves")):
        return None
    moved_ns = round(1e9 * sum(move["ends_s"] - move["begins_s"] for move in moves))
    return f"the crane moves {counted(len(moves), 'time')}, {hours(moved_ns)} in all"


def _waits(document: Document) -> str | None:
    """Return how often and how long the crane waits for concrete and joints."""
    moved = {move["number"] for move in document.get("moves", ())}
    if not (pauses := [pause for pause in document["pauses"] if pause["number"] not in moved]):
        return None
    paused_ns = round(1e9 * sum(pause["length_s"] for pause in pauses))
    return f"the crane waits {counted(len(pauses), 'time')} for concrete or joints, {hours(paused_ns)} in all"


def props_in_words(document: Document) -> str | None:
    """Return how many props hold how many parts, and which parts nothing holds."""
    held = [one for one in document["held"] if one["props"]]
    count, without = sum(len(one["props"]) for one in held), sum(one["hold"] == "nothing" for one in document["held"])
    if not count and not without:
        return None
    most = sum(document["props_needed"].values())
    words = f"{count:,} for {counted(len(held), 'part')}, {most:,} at the same time at most" if count else "none"
    return words + (f"; nothing holds {counted(without, 'part')}" if without else "")


def _material_lifts(document: Document) -> str | None:
    """Return the bundles that the crane brings in addition to its lifts."""
    bundles = [group for group in document["not_lifted"] if group["material_lift_s"] is not None]
    if not bundles:
        return None
    kg, taken_s = (sum(one[key] for one in bundles) for key in ("mass_kg", "material_lift_s"))
    return (
        f"{len(bundles):,} of bundles set by hand, {kg / 1000.0:.2f} t: {taken_s / 3600.0:.1f} crane hours in "
        "addition, without a path and not proven"
    )


def planner_in_words(document: Document) -> str | None:
    """Return how many paths each planner or policy of the caller found, and why the first lift has another path."""
    lifts = [lift for lift in document["lifts"] if lift["status"] == "planned"]
    names = document["policy"].get("external", ())
    counts = [
        f"{name}: {sum(lift.get('planner') == name for lift in lifts):,} of {len(lifts):,} paths" for name in names
    ]
    notes = [f"lift {lift['number']}, {lift['planner_note']}" for lift in document["lifts"] if "planner_note" in lift]
    return "; ".join([*counts, *notes[:1]]) or None


def _policy(policy: Document) -> str:
    """Return the policy that proposed the paths, its origin, and its test result."""
    if policy["id"] == "none":
        return "none: search only"
    if policy["id"] == "greedy":
        return "greedy: towards the target, no network"
    if policy["id"] in policy.get("external", ()):
        return f"{policy['id']}, brought by the caller"
    if policy["shipped"]:
        return f"{policy['id']}, the network that ships with bimvox"
    origin = f"{'loaded' if policy['loaded'] else 'trained'}, {policy['steps']:,} steps"
    success = f"{policy['success_rate']:.1%} of {policy['tested']} test lifts" if policy["tested"] else "not tested"
    return f"{policy['id']} ({origin}; {success})"


def _retrained(policy: Document | None) -> str | None:
    return None if policy is None else f"{policy['id']}, {policy['steps']:,} steps on the current site"


_SWING = {
    "shaped": "shaped: loads hang at rest when they are set",
    "off": 'NOT CHECKED ([rules] swing = "off"): loads may swing when they are set, and hit something',
}


def cost_in_words(figures: Document) -> str | None:
    """Return what crew, hire, lorries and set-up cost."""
    if (found := figures.get("cost")) is None:
        return None
    parts = ", ".join(f"{key.replace('_', '-')} {found[key]:,.0f}" for key in ("crew", "hire", "lorries", "set_up"))
    return f"{found['total']:,.0f} {found['currency']}: {parts}"


def figure_fields(figures: Document) -> list[tuple[str, object]]:
    """Return the figures of a plan as names and values; None if one does not apply."""
    shares = figures["shares"].items()
    found = ", ".join(f"{round(share * figures['planned']):,} by {method}" for method, share in shares if share)
    ratio, crane_h, travel = figures["moves_over_shortest"], figures["crane_hours"], figures["hook_travel_m"]
    critical, swing, wind = figures["critical_lifts"], figures["swing"], figures.get("permitted_wind")
    days, cost = figures.get("hire_days"), cost_in_words(figures)
    return [
        ("paths found", found if figures["planned"] else None),
        ("path moves", None if ratio is None else f"{figures['moves']:,}, {ratio:.3f} times the fewest possible"),
        ("load moves", None if crane_h is None else f"{figures['loaded_hours']:,.1f} of {crane_h:,.1f} crane hours"),
        ("unloading", _unloading(figures)),
        ("cost", cost and f"{cost}; {figures['cost']['source']}"),
        ("hire", days and f"{counted(days, 'day')} of the working week, waits and wind included"),
        *(
            (f"crane {crane['name']}", f"{crane['lifts']:,} lifts, works {crane['busy_share']:.0%} of the time")
            for crane in figures.get("cranes", ())
        ),
        ("hook travel", None if travel is None else f"{travel / 1000:,.2f} km"),
        (
            "critical lifts",
            None if critical is None else f"{critical:,} at {figures['critical_share']:.0%} of the capacity or more",
        ),
        ("swing", None if swing is None else _SWING[swing]),
        ("wind", wind and f"every lift is permitted up to {wind['speed_m_s']:.1f} m/s ({wind['name']})"),
    ]


def _unloading(figures: Document) -> str | None:
    """Return what comes on how many lorries, and how long the hook works in all."""
    from bimvox.records.unloading import Unloading

    found = figures.get("unloading")
    if not found or not found["seconds"]:
        return None
    how = "" if found["is_by_crane"] else ", assumed or stated"
    return (
        f"{found['seconds'] / 3600.0:,.1f} crane hours{how}: {Unloading(**found).in_words}; "
        f"{figures['hook_hours']:,.1f} crane hours in all"
    )


_TABLES: dict[str, Callable[[Console, Document, bool], None]] = {
    "lifts": _lifts,
    "parts": _parts,
    "refused": _refused,
    "remarks": _remarks,
    "deliveries": _deliveries,
    "steps": _steps,
    "props": _props,
    "figures": _figures,
    "notes": _notes,
}
