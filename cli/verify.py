"""``bimvox verify``."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import typer

from cli.options import Json, Log, Quiet
from cli.output import fields, open_output, rows

if TYPE_CHECKING:
    from rich.console import Console


def verify(log: Log, json: Json = False, quiet: Quiet = False) -> None:
    """Prove a log again, by means independent of the planner."""
    from pipeline.verify import verify as run

    with open_output(as_json=json, quiet=quiet) as output:
        document = run(log, progress=output.progress)
    raise typer.Exit(output.result(document, _show))


def _show(console: Console, document: Mapping[str, Any]) -> None:
    rows(
        console,
        ("check", "passed", "samples", "worst"),
        [
            (name, "yes" if check["passed"] else "NO", check["samples"], check["worst"])
            for name, check in document["checks"].items()
        ],
        limit=None,
    )
    console.print()
    fields(console, [("verified", "yes: every check passed" if document["verified"] else "NO: a check failed")])
