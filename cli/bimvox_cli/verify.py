"""``bimvox verify``."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from bimvox_cli.options import Log, command
from bimvox_cli.output import Output, fields, rows, spent, written
from bimvox_cli.remarks import Remarks, crane_fields, not_covered, show_remarks, verdict

if TYPE_CHECKING:
    from rich.console import Console


@command
def verify(
    output: Output,
    log: Log,
    site: Annotated[
        Path | None, typer.Option(metavar="SITE", help="The site file that you hold: prove that the log is of it.")
    ] = None,
    model: Annotated[
        Path | None, typer.Option(metavar="MODEL", help="The model, if it is not where the site file says.")
    ] = None,
    obstructions: Annotated[
        Path | None, typer.Option(metavar="FILE", help="The obstruction file that you hold.")
    ] = None,
    programme: Annotated[
        Path | None, typer.Option(metavar="FILE", help="The programme that was given to plan, if any.")
    ] = None,
    traffic: Annotated[
        str | None,
        typer.Option(metavar="FILE|SEED", help="The tracks or the seed that were given to watch --traffic."),
    ] = None,
    search: Annotated[
        bool,
        typer.Option(
            "--search", help="Search again what is called infeasible, and the fewest moves; as long as planning."
        ),
    ] = False,
    remarks: Remarks = False,
) -> int:
    """Prove a log again, independently of the planner.

    Remarks follow the verdict: what a person should look at although the plan is proven.
    """
    from bimvox_pipeline.verify import verify as run

    document = run(
        log,
        site=site,
        model=model,
        obstructions=obstructions,
        programme=programme,
        traffic=traffic,
        search=search,
        progress=output.progress,
    )
    return output.result(document, partial(_show, every=remarks))


def _show(console: Console, document: Mapping[str, Any], *, every: bool) -> None:
    checks = document["checks"]
    rows(
        console,
        ("check", "passed", "samples", "worst"),
        [
            (
                name,
                "NO" if not check["passed"] else "yes" if check["samples"] else "-",
                check["samples"],
                "" if check["worst"] is None else f"{written(check['worst'])} {check['unit'] or ''}".rstrip(),
            )
            for name, check in checks.items()
        ],
        limit=None,
    )
    failures = [(name, failure) for name, check in checks.items() for failure in check["failures"]]
    if failures:
        console.print()
    rows(console, ("check", "what failed"), failures, title=f"failed: {sum(c['failed'] for c in checks.values()):,}")
    console.print()
    undecided = [(name, sentence) for name, check in checks.items() for sentence in check["undecided"]]
    rows(console, ("check", "what could not be decided"), undecided, title=f"not decided: {len(undecided):,}")
    if undecided:
        console.print()
    earlier = document["not_current"]
    rows(
        console,
        ("lift", "part"),
        [(lift["number"], lift["name"]) for lift in earlier],
        title=f"not proven against the current obstructions, only against those before: {len(earlier):,}",
    )
    if earlier:
        console.print()
    show_remarks(console, document["remarks"], every=every)
    if document["remarks"]:
        console.print()
    carried = f", {document['left_out']:,} not in this extract" if document["left_out"] else ""
    impossible = f", {document['infeasible_lifts']:,} infeasible" if document["infeasible_lifts"] else ""
    fields(
        console,
        [
            ("lifts", f"{document['lifts']:,}{impossible}{carried}"),
            ("verified", verdict(document["verdict"], document, others=document["by_other_means"])),
            *crane_fields(document["cranes"]),
            ("claims", "\n".join(map(_claimed, document["claims"])) if document["verified"] else None),
            ("provided that", "\n".join(document["conditions"]) if document["verified"] else None),
            ("not covered", not_covered(document["not_covered"])),
            ("took", spent(document["seconds"])),
        ],
    )


def _claimed(claim: Mapping[str, Any]) -> str:
    """Return a claim of the log in words: how many things it is about, and the option that proves it."""
    count = f" ({claim['count']:,})" if "count" in claim else ""
    bind = f" [{claim['bind_with']} proves it]" if claim["bind_with"] else ""
    return f"{claim['text']}{count}{bind}"
