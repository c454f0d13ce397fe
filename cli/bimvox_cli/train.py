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
            help="Start from `default` (the shipped network), `none` (from scratch), `nearest` (the policy of the most "
            "similar site), or a stored policy.",
        ),
    ] = "default",
    anyway: Annotated[
        bool,
        typer.Option("--anyway", help="Train and store a policy even if the start is good enough for the site."),
    ] = False,
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
    """Train the policy of a site and store it.

    It is tested on lifts of the site first. If the start is good enough, nothing is trained or stored, unless --anyway
    asks for it.
    """
    from bimvox_pipeline.train import train as run

    document = run(
        site,
        steps=steps,
        seed=seed,
        start_from=start_from,
        anyway=anyway,
        seconds=budget,
        curve=curve,
        tensorboard=tensorboard,
        progress=output.progress,
    )
    code = output.result(document, _show)
    again = "" if document["learned"] else "; to train all the same: --anyway, or --from none"
    output.next_step(f"next: bimvox plan {site} --policy {document['policy']}{again}")
    return code


def _show(console: Console, document: Mapping[str, Any]) -> None:
    fields(
        console,
        [
            ("policy", f"{document['policy']}{'' if document['learned'] else ', the start: nothing new was stored'}"),
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
