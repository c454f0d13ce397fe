"""Options and output of the commands that plan many sites."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from bimvox_cli.output import fields, rows, spent

if TYPE_CHECKING:
    from rich.console import Console

BackendName = Annotated[
    Literal["loky", "ray", "dask"],
    typer.Option(
        "--backend",
        envvar="BIMVOX_BACKEND",
        help="Where runs are executed: processes on this machine, or a Ray or Dask cluster (pip extras).",
    ),
]
Jobs = Annotated[
    int | None,
    typer.Option("--jobs", min=1, metavar="N", envvar="BIMVOX_JOBS", help="Runs at a time. Default: one per core."),
]
Cluster = Annotated[
    str | None,
    typer.Option(
        "--cluster",
        metavar="ADDRESS",
        envvar="BIMVOX_CLUSTER",
        help="A running Ray or Dask cluster with the same file paths. Default: a new one on this machine.",
    ),
]
Fresh = Annotated[
    bool, typer.Option("--fresh", help="Plan all runs again, also those that an earlier call has planned.")
]


def show_fleet(console: Console, document: Mapping[str, Any]) -> None:
    """Print the results of many runs."""
    runs = document["runs"]
    rows(
        console,
        ("run", "status", "lifts", "infeasible", "by policy", "moves/fewest", "crane h", "hook km", "critical"),
        [_row(run) for run in runs],
    )
    failed = [run for run in runs if run["error"]]
    if failed:
        console.print()
    rows(console, ("run", "why"), [(r["run"], r["error"]["message"]) for r in failed], title=f"failed: {len(failed):,}")
    console.print()
    kept = f", {document['kept']:,} of them kept" if document["kept"] else ""
    fields(
        console,
        [
            ("runs", f"{len(runs):,}{kept}"),
            ("proof", "every planned lift is verified" if document["verified"] else "see what failed"),
            ("table", "\n".join(document["tables"])),
            ("took", spent(document["seconds"])),
        ],
    )


def _row(run: Mapping[str, Any]) -> tuple[object, ...]:
    figures = run.get("figures")
    if figures is None:
        return (run["run"], run["status"], *[None] * 7)
    travel = figures["hook_travel_m"]
    return (
        run["run"],
        run["status"],
        run["lifts"],
        run["infeasible"],
        f"{figures['shares']['policy']:.0%}",
        figures["moves_over_shortest"],
        figures["crane_hours"],
        None if travel is None else travel / 1000.0,
        figures["critical_lifts"],
    )
