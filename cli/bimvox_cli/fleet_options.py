"""Options and output of the commands that plan many sites."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from bimvox.records.proof import number_in_words
from bimvox_cli.output import Column, fields, spent, table
from bimvox_cli.remarks import coloured

if TYPE_CHECKING:
    from rich.console import Console
    from rich.text import Text

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
    typer.Option(
        "--jobs",
        min=1,
        metavar="N",
        envvar="BIMVOX_JOBS",
        help="Processes: for runs, or for the lifts of one site. Default: one per core.",
    ),
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


def show_fleet(console: Console, document: Mapping[str, Any], *, verbose: bool = False) -> None:
    """Print the results of many runs; if verbose, also how paths were found."""
    runs = document["runs"]
    table(console, _COLUMNS | (_HOW if verbose else {}), runs)
    failed = [run for run in runs if run["error"]]
    if failed:
        console.print()
    why: dict[str, Column] = {"run": "run", "why": lambda run: run["error"]["message"]}
    table(console, why, failed, title=f"failed: {len(failed):,}")
    console.print()
    kept = f", {document['kept']:,} of them kept" if document["kept"] else ""
    fields(
        console,
        [
            ("runs", f"{len(runs):,}{kept}"),
            ("proof", _verdict(document)),
            ("table", "\n".join(document["tables"])),
            ("page", document["page"]),
            ("took", spent(document["seconds"])),
        ],
    )


def _verdict(document: Mapping[str, Any]) -> Text:
    said = "every planned lift is proven" if document["verified"] else "see what failed"
    counts = [(run.get("remarks") or 0, run.get("serious_remarks") or 0) for run in document["runs"]]
    remarks, serious = (sum(column) for column in zip(*counts, strict=True))
    return coloured(said, proven=document["verified"], remarks=remarks, serious=serious)


def _figure(of: Callable[[Mapping[str, Any], Mapping[str, Any]], object]) -> Column:
    """Return a column of runs with figures; it is empty for the others."""
    return lambda run: None if run.get("figures") is None else of(run, run["figures"])


def _remarks(run: Mapping[str, Any]) -> str | None:
    """Return the number of remarks about a run's plan; None for a record of an earlier version."""
    count = run.get("remarks")
    return None if count is None else number_in_words(count, run["serious_remarks"])


_COLUMNS: dict[str, Column] = {
    "run": "run",
    "status": "status",
    "lifts": _figure(lambda run, _: run["lifts"]),
    "infeasible": _figure(lambda run, _: run["infeasible"]),
    "crane hours": _figure(lambda _, figures: figures["crane_hours"]),
    "hook km": _figure(lambda _, figures: figures["hook_travel_m"] and figures["hook_travel_m"] / 1000.0),
    "critical": _figure(lambda _, figures: figures["critical_lifts"]),
    "remarks": _figure(lambda run, _: _remarks(run)),
}
_HOW: dict[str, Column] = {
    "by policy": _figure(lambda _, figures: f"{figures['shares']['policy']:.0%}"),
    "moves/fewest": _figure(lambda _, figures: figures["moves_over_shortest"]),
}
