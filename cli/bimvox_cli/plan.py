"""``bimvox plan``."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from bimvox.errors import InputError, listed
from bimvox.records.proof import ASSUMED_KIND
from bimvox.units import clock, elapsed
from bimvox_cli.fleet_options import BackendName, Cluster, Fresh, Jobs, show_fleet
from bimvox_cli.options import FullRate, PolicyId, Programme, Seed, Steps, Train, command, to_file
from bimvox_cli.output import Output, fields, rows, spent
from bimvox_cli.remarks import Remarks, crane_fields, show_remarks, verdict

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
    cranes = ("crane",) if document["figures"].get("cranes") else ()
    planned = [lift for lift in lifts if lift["status"] == "planned"]
    names = {lift["component"]: part_name(lift["component"], lift["name"], lift["ifc_class"]) for lift in lifts}
    others = sum(item["by_other_means"] for item in document["infeasible"])
    console.print(first_line(document, len(planned), others))
    console.print()
    rows(
        console,
        ("lift", *cranes, "part", "component", "found by", "moves", "shortest", "crane s", "bound s"),
        [
            (
                lift["number"],
                *(lift[name] for name in cranes),
                lift.get("name") or lift.get("ifc_class"),
                lift["component"],
                lift["method"] or lift["status"].replace("_", " "),
                lift["moves"],
                lift["shortest_moves"],
                *(None if lift[key] is None else round(lift[key], 1) for key in ("duration_s", "bound_s")),
            )
            for lift in lifts
        ],
    )
    if document["infeasible"]:
        console.print()
    rows(
        console,
        ("lift", "part", "component", "reason", "blocked by", "needed by"),
        [
            (
                item["number"],
                item["name"],
                item["component"],
                with_names(item["reason"] or "", names),
                listed(item["blocked_by_names"]),
                None if item["needed_by_s"] is None else clock(item["needed_by_s"]),
            )
            for item in document["infeasible"]
        ],
        title=f"infeasible: {len(document['infeasible']):,}" + (", to be set by other means" if others else ""),
    )
    rows(
        console,
        ("means", "storey", "kind", "parts", "t", "why", "needed by", "work begins", "carries", "crane min"),
        [
            (
                group["means"].replace("_", " "),
                group["storey"],
                group["kind"],
                group["parts"],
                round(group["mass_kg"] / 1000.0, 2),
                group["reason"],
                None if group["needed_by_s"] is None else clock(group["needed_by_s"]),
                *(None if group[key] is None else elapsed(group[key]) for key in ("begins_s", "carries_s")),
                None if group["material_lift_s"] is None else round(group["material_lift_s"] / 60.0, 1),
            )
            for group in document["not_lifted"]
        ],
        title=f"no lifts of the crane: {sum(group['parts'] for group in document['not_lifted']):,}; work begins and "
        "carries in elapsed time",
    )
    show_remarks(console, document["remarks"], every=every)
    console.print()
    fields(
        console,
        [
            ("log", document["log"]),
            *crane_fields(document["cranes"]),
            *figure_fields(document["figures"]),
            ("elapsed", _elapsed(document)),
            ("dates", _dates(document["calendar"])),
            *(("", note) for note in (document["calendar"] or {}).get("notes", ())),
            ("material lifts", _material_lifts(document)),
            ("policy", _policy(document["policy"])),
            ("retrained", _retrained(document.get("retrained"))),
            ("took", spent(document["seconds"])),
        ],
    )


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
    """Return elapsed time, if other work or curing makes it longer than crane time."""
    hours, pauses = document["figures"]["elapsed_hours"], document["pauses"]
    if hours is None or not (document["steps"] or pauses):
        return None
    paused_s = sum(pause["length_s"] for pause in pauses)
    times = "once" if len(pauses) == 1 else f"{len(pauses):,} times"
    waits = f"; the crane pauses {times}, {elapsed(paused_s)} in all" if pauses else ""
    first_s = min((step["begins_s"] for step in document["steps"]), default=0.0)
    before = f"; work before the first lift begins {elapsed(-first_s)} earlier" if first_s < 0.0 else ""
    return f"{elapsed(3600.0 * hours)}{waits}{before}"


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


def figure_fields(figures: Mapping[str, Any]) -> list[tuple[str, object]]:
    """Return the figures of a plan as names and values; None if one does not apply."""
    shares = figures["shares"].items()
    found = ", ".join(f"{round(share * figures['planned']):,} by {method}" for method, share in shares if share)
    ratio, hours, travel = figures["moves_over_shortest"], figures["crane_hours"], figures["hook_travel_m"]
    critical, swing, wind = figures["critical_lifts"], figures["swing"], figures.get("permitted_wind")
    return [
        ("paths found", found if figures["planned"] else None),
        ("moves", None if ratio is None else f"{figures['moves']:,}, {ratio:.3f} times the fewest possible"),
        (
            "crane time",
            None
            if hours is None
            else f"{elapsed(3600.0 * hours)}, {elapsed(3600.0 * figures['loaded_hours'])} of it loaded",
        ),
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
