"""``bimvox report``."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from bimvox_cli import complete
from bimvox_cli.options import Log, command, to_file
from bimvox_cli.output import Column, Output, fields, spent, table

if TYPE_CHECKING:
    from rich.console import Console

_MOST_CRITICAL = 8


@command
def report(
    output: Output,
    log: Log,
    out: Annotated[
        Path | None,
        to_file(
            "OUT",
            "Report: .html, or .pdf if Chromium is installed. Default: LOG.report.html, or LOG.cards.html, in the "
            "current folder.",
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
    lift: Annotated[
        list[str] | None,
        typer.Option(
            "--lift",
            metavar="ID",
            autocompletion=complete.lifts,
            help="A card of one page of this lift, instead of the report: number from 1, or the part's name, id or "
            "GlobalId; `critical`: of all critical ones. May be given several times.",
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
        lifts=tuple(lift or ()),
        progress=output.progress,
    )
    return output.result(document, _show)


def _show(console: Console, document: Mapping[str, Any]) -> None:
    record = document["record"]
    totals = record["totals"]
    lifts = {lift["order"]: lift for lift in record["lifts"]}
    critical = [lifts[order] for order in record["critical"]]
    title = f"critical lifts: {len(critical):,}"
    table(console, _CRITICAL, critical, title=title, limit=_MOST_CRITICAL)
    fields(
        console,
        [
            ("cards" if document["cards"] else "report", f"{document['out']} ({document['bytes'] / 1e6:.2f} MB)"),
            ("annexes", document["annexes"]),
            ("lifts", f"{totals['planned']:,} of {totals['lifts']:,} planned, {totals['infeasible']:,} infeasible"),
            ("total", f"{totals['total_s'] / 3600:.2f} h"),
            ("proof", record["verdict"]["proof"]),
            ("remarks", record["verdict"]["remarks"]),
            ("figures", ", ".join(document["figures"])),
            ("took", spent(document["seconds"])),
        ],
    )


def _governing(key: str, digits: int, per: float = 1.0) -> Column:
    """Return a column of the governing sample."""
    return lambda lift: None if lift["governs"][key] is None else round(lift["governs"][key] / per, digits)


_CRITICAL: dict[str, Column] = {
    "lift": "number",
    "part": lambda lift: lift["name"] or lift["id"],
    "use %": lambda lift: None if (share := lift["governs"]["utilisation"]) is None else round(100 * share, 1),
    "radius m": _governing("radius_m", 2),
    "load t": _governing("load_kg", 3, 1000),
    "capacity t": _governing("capacity_kg", 3, 1000),
}
