"""``bimvox plan``."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from bimvox.errors import InputError, listed
from bimvox.records.proof import ASSUMED_KIND
from bimvox.units import clock, elapsed
from bimvox_cli.fleet_options import BackendName, Cluster, Fresh, Jobs, show_fleet
from bimvox_cli.options import FullRate, PolicyId, Programme, Seed, Steps, Train, command, to_file
from bimvox_cli.output import Column, Output, fields, rounded, spent, table
from bimvox_cli.remarks import Remarks, crane_fields, not_covered, show_remarks, verdict

if TYPE_CHECKING:
    from rich.console import Console
    from rich.text import Text

_FOLDER = "plans"


@command
def plan(
    output: Output,
    sites: Annotated[
        list[Path], typer.Argument(metavar="SITE...", help="Site files (TOML), as `bimvox init` writes them.")
    ],
    out: Annotated[
        Path | None,
        to_file(
            "LOG.mcap", "Log. Default: SITE.mcap in the current folder. For several sites: a folder. Default: plans."
        ),
    ] = None,
    obstructions: Annotated[
        Path | None,
        typer.Option(
            envvar="BIMVOX_OBSTRUCTIONS", metavar="FILE", help="Obstructions: JSON, TOML, an IFC file or a mesh."
        ),
    ] = None,
    programme: Programme = None,
    policy: PolicyId = None,
    seed: Seed = None,
    steps: Steps = None,
    train: Train = False,
    retrain: Annotated[
        int,
        typer.Option(
            envvar="BIMVOX_RETRAIN",
            min=0,
            metavar="STEPS",
            help="If the policy fails lifts, train it further on the current site, for at most this many steps.",
        ),
    ] = 0,
    full_rate: FullRate = False,
    backend: BackendName = "loky",
    jobs: Jobs = None,
    cluster: Cluster = None,
    fresh: Fresh = False,
    remarks: Remarks = False,
) -> int:
    """Plan every lift, prove the plan, time it, and write the log.

    Several sites are planned in parallel: one log each and one table. --backend, --cluster and --fresh apply to several
    sites, as in `bimvox sweep`. The lifts of one site are planned, timed and proven in --jobs processes.
    """
    if len(sites) > 1:
        alone = {"--retrain": retrain, "--programme": programme is not None, "--full-rate": full_rate}
        if option := next((name for name, given in alone.items() if given), None):
            raise InputError(f"{option} works with one site only", hint="plan the sites one by one, or leave it out")
        from bimvox_pipeline.fleet.command import fleet
        from bimvox_pipeline.fleet.runs import Wish
        from bimvox_pipeline.fleet.schedule import Execution

        wishes = [Wish(site, obstructions, seed, policy, steps, train) for site in sites]
        execution = Execution(backend, jobs, cluster, fresh)
        planned = fleet(wishes, out or Path(_FOLDER), execution=execution, progress=output.progress)
        return output.result(planned, show_fleet)
    from bimvox_pipeline.plan import plan as run
    from bimvox_pipeline.warm_up import helped

    from bimvox.library.arguments import PolicyWish

    site = sites[0]
    with helped("plan"):
        document = run(
            site,
            out,
            obstructions=obstructions,
            programme=programme,
            wish=PolicyWish(policy, seed, steps, train, retrain),
            jobs=jobs,
            full_rate=full_rate,
            progress=output.progress,
        )
    code = output.result(document, partial(_show, every=remarks))
    output.next_step(f"next: bimvox render {document['log']}")
    return code


_SWING = {
    "shaped": "shaped: loads hang at rest when they are set",
    "off": 'NOT CHECKED ([rules] swing = "off"): loads may swing when they are set, and hit something',
}


def _show(console: Console, document: Mapping[str, Any], *, every: bool) -> None:
    from bimvox.site.site import part_name, with_names  # heavy

    lifts = document["lifts"]
    cranes = bool(document["figures"].get("cranes"))
    planned = [lift for lift in lifts if lift["status"] == "planned"]
    names = {lift["component"]: part_name(lift["component"], lift["name"], lift["ifc_class"]) for lift in lifts}
    others = sum(item["by_other_means"] for item in document["infeasible"])
    console.print(first_line(document, len(planned), others))
    console.print()
    table(console, {name: of for name, of in _LIFTS.items() if name != "crane" or cranes}, lifts)
    if document["infeasible"]:
        console.print()
    reason: Column = lambda one: with_names(one["reason"] or "", names)  # noqa: E731
    infeasible, not_lifted = document["infeasible"], document["not_lifted"]
    title = f"infeasible: {len(infeasible):,}" + (", to be set by other means" if others else "")
    table(console, {**_INFEASIBLE, "reason": reason}, infeasible, title=title)
    parts = sum(group["parts"] for group in not_lifted)
    dated = document["calendar"] is not None
    title = f"no lifts of the crane: {parts:,}" + ("" if dated else "; work begins and carries in elapsed time")
    table(console, _NOT_LIFTED, not_lifted, title=title)
    show_remarks(console, document["remarks"], every=every)
    console.print()
    fields(
        console,
        [
            ("log", document["log"]),
            *crane_fields(document["cranes"]),
            *figure_fields(document["figures"]),
            ("elapsed", _elapsed(document)),
            ("props", _props(document)),
            ("dates", _dates(document["calendar"])),
            *(("", note) for note in (document["calendar"] or {}).get("notes", ())),
            ("material lifts", _material_lifts(document)),
            ("not covered", not_covered(document["not_covered"])),
            ("policy", _policy(document["policy"])),
            ("retrained", _retrained(document.get("retrained"))),
            ("took", spent(document["seconds"])),
        ],
    )


def _time(key: str, in_words: Callable[[float], str]) -> Column:
    return lambda one: None if one[key] is None else in_words(one[key])


def _date_or_time(key: str) -> Column:
    """Return the column of a date, otherwise of an elapsed time."""

    def value(one: Mapping[str, Any]) -> str | None:
        if f"{key}_at" in one:
            return str(one[f"{key}_at"]).replace("T", " ")[:16]
        return None if one[f"{key}_s"] is None else elapsed(one[f"{key}_s"])

    return value


_LIFTS: dict[str, Column] = {
    "lift": "number",
    "crane": "crane",
    "part": lambda lift: lift.get("name") or lift.get("ifc_class"),
    "component": "component",
    "found by": lambda lift: lift["method"] or lift["status"].replace("_", " "),
    "moves": "moves",
    "shortest": "shortest_moves",
    "crane s": rounded("duration_s", 1),
    "bound s": rounded("bound_s", 1),
}
_INFEASIBLE: dict[str, Column] = {
    "lift": "number",
    "part": "name",
    "component": "component",
    "reason": "reason",
    "blocked by": lambda one: listed(one["blocked_by_names"]),
    "needed by": _time("needed_by_s", clock),
}
_NOT_LIFTED: dict[str, Column] = {
    "means": lambda group: group["means"].replace("_", " "),
    "storey": "storey",
    "kind": "kind",
    "parts": "parts",
    "t": rounded("mass_kg", 2, per=1000.0),
    "why": "reason",
    "needed by": _time("needed_by_s", clock),
    "work begins": _date_or_time("begins"),
    "carries": _date_or_time("carries"),
    "crane min": rounded("material_lift_s", 1, per=60.0),
}


def first_line(document: Mapping[str, Any], planned: int, others: int) -> Text:
    """Return the verdict with what a reader must know first: what is not planned, and which kinds are assumed.

    It names the parts that the crane carries, so that `init` counts them, and that are refused nevertheless.
    """
    said = f"{planned:,} of {planned + len(document['infeasible']):,} lifts planned, {_verdict(document, others)}"
    line = verdict(said, document, others=others)
    if refused := [one["name"] or one["component"] for one in document["infeasible"] if one["is_carried"]]:
        line.append(
            f"; the crane carries {planned + len(refused):,} by reach, load chart and gear, refused for what is around "
            f"them: {listed(refused, most=5)}"
        )
    assumed = next((one["text"] for one in document["remarks"] if one["kind"] == ASSUMED_KIND), None)
    return line if assumed is None else line.append(f"; {assumed}")


def _verdict(document: Mapping[str, Any], others: int) -> str:
    from bimvox.records.steps import proven_in_words  # heavy

    return f"every planned lift is {proven_in_words(others)}" if document["verified"] else "FAILED"


def _elapsed(document: Mapping[str, Any]) -> str | None:
    """Return elapsed time, if other work or curing makes it longer than crane time; None if dates say when work is."""
    hours, pauses = document["figures"]["elapsed_hours"], document["pauses"]
    if hours is None or document["calendar"] or not (document["steps"] or pauses):
        return None
    paused_s = sum(pause["length_s"] for pause in pauses)
    times = "once" if len(pauses) == 1 else f"{len(pauses):,} times"
    waits = f"; the crane pauses {times}, {elapsed(paused_s)} in all" if pauses else ""
    first_s = min((step["begins_s"] for step in document["steps"]), default=0.0)
    before = f"; work before the first lift begins {elapsed(-first_s)} earlier" if first_s < 0.0 else ""
    return f"{elapsed(3600.0 * hours)}{waits}{before}"


def _props(document: Mapping[str, Any]) -> str | None:
    """Return how many props hold how many parts, and which parts nothing holds."""
    held = [one for one in document["held"] if one["props"]]
    count, without = sum(len(one["props"]) for one in held), sum(one["hold"] == "nothing" for one in document["held"])
    if not count and not without:
        return None
    most = sum(document["props_needed"].values())
    words = f"{count:,} for {len(held):,} parts, {most:,} at the same time at most" if count else "none"
    return words + (f"; nothing holds {without:,} parts" if without else "")


def _dates(calendar: Mapping[str, Any] | None) -> str | None:
    return None if calendar is None else f"begins {calendar['begins_in_words']}, ends {calendar['ends_in_words']}"


def _material_lifts(document: Mapping[str, Any]) -> str | None:
    """Return the bundles that the crane brings in addition to its lifts."""
    bundles = [group for group in document["not_lifted"] if group["material_lift_s"] is not None]
    if not bundles:
        return None
    kg, taken_s = (sum(one[key] for one in bundles) for key in ("mass_kg", "material_lift_s"))
    return (
        f"{len(bundles):,} of bundles set by hand, {kg / 1000.0:.2f} t: {elapsed(taken_s)} of crane time in addition, "
        "without a path and not proven"
    )


def _policy(policy: Mapping[str, Any]) -> str:
    """Return the policy that proposed the paths, its origin, and its test result."""
    if policy["id"] == "none":
        return "none: search only"
    if policy["id"] == "greedy":
        return "greedy: towards the target, no network"
    if policy["shipped"]:
        return f"{policy['id']}, the network that ships with bimvox"
    if policy["loaded"]:
        origin = f"loaded, {policy['steps']:,} steps"
    elif policy["steps"]:
        origin = f"trained, {policy['steps']:,} steps"
    else:
        origin = "good enough without training"
    success = f"{policy['success_rate']:.1%} of {policy['tested']} test lifts" if policy["tested"] else "not tested"
    return f"{policy['id']} ({origin}; {success})"


def _retrained(policy: Mapping[str, Any] | None) -> str | None:
    return None if policy is None else f"{policy['id']}, {policy['steps']:,} steps on the current site"


def _unloading(figures: Mapping[str, Any]) -> str | None:
    """Return what comes on how many lorries, and how long the hook works in all."""
    from bimvox.records.unloading import Unloading

    found = figures.get("unloading")
    if not found or not found["seconds"]:
        return None
    how = "" if found["is_by_crane"] else ", assumed or stated"
    return (
        f"{elapsed(found['seconds'])}{how}: {Unloading(**found).in_words}; "
        f"{elapsed(3600.0 * figures['hook_hours'])} on the hook in all"
    )


def _cost(figures: Mapping[str, Any]) -> str | None:
    """Return what crew, hire, lorries and set-up cost, and by which rates."""
    if (found := figures.get("cost")) is None:
        return None
    parts = ", ".join(f"{key.replace('_', '-')} {found[key]:,.0f}" for key in ("crew", "hire", "lorries", "set_up"))
    return f"{found['total']:,.0f} {found['currency']}: {parts}; {found['source']}"


def figure_fields(figures: Mapping[str, Any]) -> list[tuple[str, object]]:
    """Return the figures of a plan as names and values; None if one does not apply."""
    shares = figures["shares"].items()
    found = ", ".join(f"{round(share * figures['planned']):,} by {method}" for method, share in shares if share)
    ratio, hours, travel = figures["moves_over_shortest"], figures["crane_hours"], figures["hook_travel_m"]
    critical, swing, wind = figures["critical_lifts"], figures["swing"], figures.get("permitted_wind")
    days = figures.get("hire_days")
    return [
        ("paths found", found if figures["planned"] else None),
        ("moves", None if ratio is None else f"{figures['moves']:,}, {ratio:.3f} times the fewest possible"),
        (
            "crane time",
            None
            if hours is None
            else f"{elapsed(3600.0 * hours)}, {elapsed(3600.0 * figures['loaded_hours'])} of it loaded",
        ),
        ("unloading", _unloading(figures)),
        ("cost", _cost(figures)),
        ("hire", days and f"{days:,} day{'' if days == 1 else 's'} of the working week, waits and wind included"),
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
