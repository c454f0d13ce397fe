"""``bimvox report``."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from bimvox_cli.options import Log, command
from bimvox_cli.output import Output, fields, rows, spent

if TYPE_CHECKING:
    from rich.console import Console

_MOST_CRITICAL = 8


@command
def report(
    output: Output,
    log: Log,
    out: Annotated[
        Path | None,
        typer.Option(
            "--output",
            "-o",
            metavar="OUT",
            help="Report: .html, or .pdf if Chromium is installed. Default: LOG.report.html in the current folder.",
        ),
    ] = None,
    critical: Annotated[
        float | None,
        typer.Option(
            "--critical",
            metavar="SHARE",
            help="Share of the capacity from which a lift is critical. Default: the site's (0.75).",
        ),
    ] = None,
    pictures: Annotated[
        int,
        typer.Option("--pictures", min=0, metavar="N", help="At most this many pictures of blocked parts."),
    ] = 12,
    figures: Annotated[
        Path | None,
        typer.Option(
            "--figures", metavar="DIR", help="Also write the plots (PNG, SVG) and all lifts (CSV) to this folder."
        ),
    ] = None,
    proof: Annotated[
        bool, typer.Option("--proof/--no-proof", help="Prove the log again; otherwise the report says NOT PROVEN.")
    ] = True,
) -> int:
    """Write the lift plan record of a log, as a page or PDF."""
    from bimvox_pipeline.report import report as run

    document = run(
        log,
        out,
        proven=proof,
        critical_share=critical,
        pictures=pictures,
        figures=figures,
        progress=output.progress,
    )
    return output.result(document, _show)


def _show(console: Console, document: Mapping[str, Any]) -> None:
    record = document["record"]
    totals = record["totals"]
    lifts = {lift["order"]: lift for lift in record["lifts"]}
    rows(
        console,
        ("lift", "part", "use %", "radius m", "load t", "capacity t"),
        [
            (
                order + 1,
                lifts[order]["name"] or lifts[order]["id"],
                None if g["utilisation"] is None else round(100 * g["utilisation"], 1),
                round(g["radius_m"], 2),
                round(g["load_kg"] / 1000, 3),
                round(g["capacity_kg"] / 1000, 3),
            )
            for order in record["critical"]
            for g in (lifts[order]["governs"],)
        ],
        title=f"critical lifts: {len(record['critical']):,}",
        limit=_MOST_CRITICAL,
    )
    fields(
        console,
        [
            ("report", f"{document['out']} ({document['bytes'] / 1e6:.2f} MB)"),
            ("lifts", f"{totals['planned']:,} of {totals['lifts']:,} planned, {totals['infeasible']:,} infeasible"),
            ("total", f"{totals['total_s'] / 3600:.2f} h"),
            ("proof", record["verdict"]["proof"]),
            ("remarks", record["verdict"]["remarks"]),
            ("figures", ", ".join(document["figures"])),
            ("took", spent(document["seconds"])),
        ],
    )
