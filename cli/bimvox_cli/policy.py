"""``bimvox policy``."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from bimvox_cli.examples import enlist
from bimvox_cli.options import command
from bimvox_cli.output import Output, facts, rows

if TYPE_CHECKING:
    from rich.console import Console

policy = typer.Typer(name="policy", help="The policy store.", rich_markup_mode=None, no_args_is_help=False)

Id = Annotated[str, typer.Argument(metavar="ID", help="A policy's id or the beginning of it.")]


@command
def list_(output: Output) -> int:
    """List the stored policies."""
    from bimvox_pipeline.policy import list_policies

    return output.answer(list_policies(), _show)


@command
def show(output: Output, identity: Id) -> int:
    """Print everything known about a policy."""
    from bimvox_pipeline.policy import show as run

    return output.answer(run(identity), facts)


@command
def remove(output: Output, identity: Id) -> int:
    """Remove a policy from the store."""
    from bimvox_pipeline.policy import remove as run

    return output.result(run(identity), facts)


@command
def export(
    output: Output,
    identity: Id,
    out: Annotated[
        Path | None, typer.Option("-o", "--out", metavar="FILE", help="Default: the id, in the current folder.")
    ] = None,
    to: Annotated[
        str | None,
        typer.Option("--to", metavar="bimvox|onnx|sb3", help="Default: from the suffix of -o, otherwise bimvox."),
    ] = None,
) -> int:
    """Write a policy to one file, to share it or to run it elsewhere."""
    from bimvox_pipeline.policy import export_policy

    return output.result(export_policy(identity, to=to, out=out), facts)


@command
def import_(
    output: Output,
    file: Annotated[Path, typer.Argument(metavar="FILE", help="A file of `policy export`.")],
    trust: Annotated[
        bool, typer.Option("--trust", help="Accept a zip of stable-baselines3, which cannot be checked.")
    ] = False,
) -> int:
    """Import a policy from a file into the store."""
    from bimvox_pipeline.policy import import_policy

    return output.result(import_policy(file, trust=trust), facts)


@command
def score(
    output: Output,
    named: Annotated[
        str,
        typer.Argument(
            metavar="POLICY",
            help="`default` (the shipped network), `greedy`, an id, FILE.onnx, or module:function (its code runs).",
        ),
    ],
    sets: Annotated[
        list[str] | None, typer.Option("--set", metavar="SET", help="A set of problems, repeatable. Default: all.")
    ] = None,
    share: Annotated[float, typer.Option("--share", metavar="SHARE", help="Share of each set.")] = 1.0,
) -> int:
    """Score a policy on the frozen held-out problems."""
    from bimvox_pipeline.policy import score_policy

    return output.answer(score_policy(named, sets=sets or (), share=share, progress=output.progress), _show_score)


def _show_score(console: Console, document: Mapping[str, Any]) -> None:
    ways = ("alone", "guarded")
    columns = (
        "set",
        "problems",
        *(f"{way}: {what}" for way in ways for what in ("success", "95 %", "moves / shortest")),
    )
    lines = [
        (one["set"], one["problems"], *(cell for way in ways for cell in _score_cells(one[way])))
        for one in document["sets"]
    ]
    console.print(f"policy {document['policy']}")
    rows(console, columns, lines, limit=None)


def _score_cells(way: Mapping[str, Any]) -> tuple[str, str, str]:
    low, high = way["interval"]
    ratio = way["moves_per_shortest"]
    return f"{way['success']:.1%}", f"{low:.1%} to {high:.1%}", "-" if ratio is None else f"{ratio:.4f}"


def _show(console: Console, document: Mapping[str, Any]) -> None:
    if not document["policies"]:
        console.print(f"no policies in {document['store']}")
    rows(
        console,
        ("id", "steps", "success rate"),
        [(item["id"], item.get("steps"), _success(item)) for item in document["policies"]],
        limit=None,
    )


def _success(item: Mapping[str, Any]) -> str:
    """Return the result of a policy's last test; an imported policy has none."""
    return f"{item['success_rate']:.1%} of {item['tested']}" if item.get("tested") else "not tested"


enlist(policy, list_, show, remove, export, import_, score, group="policy")
