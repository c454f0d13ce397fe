"""``bimvox experiment``."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from bimvox_cli.examples import enlist
from bimvox_cli.options import command, to_file
from bimvox_cli.output import Output, fields, rows

if TYPE_CHECKING:
    from rich.console import Console

experiment = typer.Typer(help="Repeat published experiments; score erection sequences.", no_args_is_help=True)


@command
def paper(
    output: Output,
    out: Annotated[Path, to_file("DIR", "Folder of the results; an earlier run resumes there.")] = Path(
        "paper-experiment"
    ),
    seeds: Annotated[int, typer.Option(min=1, metavar="N", help="Runs of every experiment, one per seed.")] = 10,
    mode: Annotated[
        Literal["paper", "ours", "authors"] | None,
        typer.Option(
            help="Only one: as the paper says, ours, or with the learner of the authors' script. Default: all."
        ),
    ] = None,
    jobs: Annotated[
        int, typer.Option(min=1, metavar="N", envvar="BIMVOX_JOBS", help="Processes; the results do not depend on it.")
    ] = 2,
    quick: Annotated[
        bool, typer.Option("--quick", help="Tiny budgets, only to see that it runs; the results are meaningless.")
    ] = (False),
) -> int:
    """Run the four experiments of Zhu, Pauwels and de Vries (2021), and report what reproduces."""
    from bimvox_pipeline.paper import run_paper

    from bimvox.paper.experiment.jobs import ALL_MODES

    document = run_paper(
        out,
        seeds=seeds,
        modes=ALL_MODES if mode is None else (mode,),
        processes=jobs,
        quick=quick,
        progress=output.progress,
    )
    code = output.result(document, _show)
    output.next_step(f"next: read {document['report']}")
    return code


def _show(console: Console, document: Mapping[str, Any]) -> None:
    for mode, content in document["modes"].items():
        rows(
            console,
            ("scenario", "steps to success", "learned", "without retraining"),
            [
                (
                    f"({scenario})",
                    d["steps_to_success_text"],
                    f"{d['learned']} of {len(d['seeds'])}",
                    f"{d['solved_by_the_loaded_policy']} of {len(d['seeds'])}",
                )
                for scenario, d in content["scenarios"].items()
                if d["seeds"]
            ],
            title=f"{mode} mode",
        )
        rows(
            console,
            ("finding of the paper", "verdict"),
            [(finding["claim"], finding["verdict"]) for finding in content["findings"]],
        )
        console.print()
    judged = [
        (f"finding 2, all else equal, random actions from {d['exploration']:.0%}", d["finding"]["verdict"])
        for d in document["matched"]
    ]
    fields(console, judged)
    fields(console, [("report", document["report"]), ("pictures", ", ".join(document["pictures"]))])


@command
def sequence(
    output: Output,
    order: Annotated[
        str,
        typer.Argument(
            metavar="ORDER",
            help="`trade`, `greedy`, `search`, `exact`, or module:function or file.py:function (its code runs).",
        ),
    ],
    sets: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="SET", help="small, storeys, halls or samples, repeatable. Default: all."),
    ] = None,
) -> int:
    """Score an erection sequence on the frozen buildings of Sequence-v0: planned, timed and proven."""
    from bimvox_pipeline.sequence import score_sequence

    document = score_sequence(order, sets=sets or (), progress=output.progress)
    return output.answer(document, _show_sequence)


def _show_sequence(console: Console, document: Mapping[str, Any]) -> None:
    columns = ("building", "proven", "crane hours", "least hours", "ratio", "s", "why not")
    hours = ["-" if one["makespan_s"] is None else f"{one['makespan_s'] / 3600.0:.3f}" for one in document["buildings"]]
    lines = [
        (
            one["problem"],
            f"{one['proven']} of {one['lifts']}",
            taken,
            f"{one['least_s'] / 3600.0:.3f}",
            "-" if one["ratio"] is None else f"{one['ratio']:.4f}",
            f"{one['seconds']:.1f}",
            one["reason"] or "",
        )
        for one, taken in zip(document["buildings"], hours, strict=True)
    ]
    ratio = "none" if document["ratio"] is None else f"{document['ratio']:.4f} of the least time in the mean"
    console.print(f"order {document['order']}: {document['solved']} of {len(lines)} buildings solved, {ratio}")
    rows(console, columns, lines, limit=None)


enlist(experiment, paper, sequence, group="experiment")
