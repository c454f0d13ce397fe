"""``bimvox plan``."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from cli.options import Json, PolicyId, Quiet, Seed, SiteFile, Steps
from cli.output import fields, open_output, rows, spent

if TYPE_CHECKING:
    from rich.console import Console


def plan(
    site: SiteFile,
    out: Annotated[
        Path | None, typer.Option("--output", "-o", metavar="LOG.mcap", help="Log; SITE.mcap here if not given.")
    ] = None,
    obstructions: Annotated[
        Path | None,
        typer.Option(
            envvar="BIMVOX_OBSTRUCTIONS", metavar="FILE", help="What is in the way: JSON, TOML, an IFC file or a mesh."
        ),
    ] = None,
    policy: PolicyId = None,
    seed: Seed = None,
    steps: Steps = None,
    retrain: Annotated[
        int,
        typer.Option(
            envvar="BIMVOX_RETRAIN",
            min=0,
            metavar="STEPS",
            help="Where the policy fails lifts, train it further on the site as it is, this many steps at most.",
        ),
    ] = 0,
    json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Plan every lift, prove the plan, time it, and write the log."""
    from pipeline.plan import plan as run

    with open_output(as_json=json, quiet=quiet) as output:
        document = run(
            site,
            out,
            obstructions=obstructions,
            policy=policy,
            seed=seed,
            steps=steps,
            retrain=retrain,
            progress=output.progress,
        )
    code = output.result(document, _show)
    output.next_step(f"next: bimvox render {document['log']}")
    raise typer.Exit(code)


def _show(console: Console, document: Mapping[str, Any]) -> None:
    lifts = document["lifts"]
    planned = [lift for lift in lifts if lift["status"] == "planned"]
    policy = document["policy"]
    rows(
        console,
        ("order", "part", "component", "found by", "moves", "shortest", "crane s", "bound s"),
        [
            (
                lift["order"],
                lift.get("name") or lift.get("ifc_class"),
                lift["component"],
                lift["method"] or lift["status"],
                lift["moves"],
                lift["shortest_moves"],
                lift["duration_s"],
                lift["bound_s"],
            )
            for lift in lifts
        ],
    )
    if document["infeasible"]:
        console.print()
    rows(
        console,
        ("component", "reason", "blocked by"),
        [(item["component"], item["reason"], ", ".join(item["blocked_by"])) for item in document["infeasible"]],
        title=f"not possible: {len(document['infeasible']):,}",
    )
    console.print()
    fields(
        console,
        [
            ("log", document["log"]),
            ("lifts", f"{len(planned):,} of {len(lifts):,} planned{_methods(planned)}"),
            ("proof", "every planned lift is verified" if document["verified"] else "FAILED"),
            ("crane time", _crane_time(planned)),
            ("policy", f"{policy['id']} ({_origin(policy)})"),
            ("retrained", _retrained(document.get("retrained"))),
            ("took", spent(document["seconds"])),
        ],
    )


def _origin(policy: Mapping[str, Any]) -> str:
    """Say where a policy came from, and how good it was in its test."""
    if policy["loaded"]:
        origin = f"from the store, {policy['steps']:,} steps"
    elif policy["steps"]:
        origin = f"trained now, {policy['steps']:,} steps"
    else:
        origin = "as shipped: good enough here without training"
    if not policy["tested"]:
        return f"{origin}, not tested"
    return f"{origin}; {policy['success_rate']:.1%} of {policy['tested']} test lifts"


def _retrained(policy: Mapping[str, Any] | None) -> str | None:
    return None if policy is None else f"{policy['id']}, {policy['steps']:,} steps on the site as it is"


def _methods(planned: list[Mapping[str, Any]]) -> str:
    """Say how many paths were found by which method."""
    numbers: dict[str, int] = {}
    for lift in planned:
        numbers[lift["method"]] = numbers.get(lift["method"], 0) + 1
    return f": {', '.join(f'{count:,} by {method}' for method, count in numbers.items())}" if numbers else ""


def _crane_time(planned: list[Mapping[str, Any]]) -> str | None:
    """Say how long the crane works, and how long of it a load hangs on the hook; None without a crane."""
    timed = [lift for lift in planned if lift["duration_s"] is not None]
    if not timed:
        return None
    whole_s = max(lift["end_s"] for lift in timed) - min(lift["start_s"] for lift in timed)
    return f"{whole_s / 60:.1f} min, of it {sum(lift['duration_s'] for lift in timed) / 60:.1f} min with a load moving"
