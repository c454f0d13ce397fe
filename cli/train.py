"""``bimvox train``."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import typer

from cli.options import Json, Quiet, Seed, SiteFile, Steps
from cli.output import fields, open_output, rows

if TYPE_CHECKING:
    from rich.console import Console


def train(
    site: SiteFile,
    steps: Steps = None,
    seed: Seed = None,
    json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Train the site's policy and store it."""
    from pipeline.train import train as run

    with open_output(as_json=json, quiet=quiet) as output:
        document = run(site, steps=steps, seed=seed, progress=output.progress)
    code = output.result(document, _show)
    output.next_step(f"next: bimvox plan {site} --policy {document['policy']}")
    raise typer.Exit(code)


def _show(console: Console, document: Mapping[str, Any]) -> None:
    fields(
        console,
        [
            ("policy", document["policy"]),
            ("steps", f"{document['steps']:,}"),
            ("success rate", f"{document['success_rate']:.1%}"),
        ],
    )
    console.print()
    rows(console, ("steps", "success rate"), [(steps, f"{rate:.1%}") for steps, rate in document["curve"]])
