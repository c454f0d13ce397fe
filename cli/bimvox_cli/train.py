"""``bimvox train``."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from bimvox_cli.options import Seed, SiteFile, Steps, command
from bimvox_cli.output import Output, fields, rows

if TYPE_CHECKING:
    from rich.console import Console


@command
def train(
    output: Output,
    site: SiteFile,
    steps: Steps = None,
    seed: Seed = None,
    start_from: Annotated[
        str,
        typer.Option(
            "--from",
            envvar="BIMVOX_FROM",
            metavar="POLICY",
            help="Start from `default` (the shipped network), `none` (from scratch), or a stored policy.",
        ),
    ] = "default",
    budget: Annotated[
        float | None,
        typer.Option(
            "--budget",
            envvar="BIMVOX_BUDGET",
            min=0.0,
            metavar="SECONDS",
            help="Stop at the first test after this time.",
        ),
    ] = None,
    curve: Annotated[
        Path | None, typer.Option("--curve", metavar="FILE", help="Write every test of the training as CSV.")
    ] = None,
    tensorboard: Annotated[
        Path | None, typer.Option("--tensorboard", metavar="FOLDER", help="Write the tests for TensorBoard.")
    ] = None,
) -> int:
    """Train the policy of a site and store it."""
    from bimvox_pipeline.train import train as run

    document = run(
        site,
        steps=steps,
        seed=seed,
        start_from=start_from,
        seconds=budget,
        curve=curve,
        tensorboard=tensorboard,
        progress=output.progress,
    )
    code = output.result(document, _show)
    output.next_step(f"next: bimvox plan {site} --policy {document['policy']}")
    return code


def _show(console: Console, document: Mapping[str, Any]) -> None:
    fields(
        console,
        [
            ("policy", document["policy"]),
            ("steps", f"{document['steps']:,}"),
            (
                "success rate",
                f"{document['success_rate']:.1%} of {document['tested']} lifts, "
                f"at least {document['success_at_least']:.1%} with 95 % confidence",
            ),
        ],
    )
    console.print()
    rows(console, ("steps", "success rate"), [(steps, f"{rate:.1%}") for steps, rate in document["curve"]])
