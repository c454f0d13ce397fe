"""``bimvox crane``."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from bimvox.errors import InputError
from bimvox_cli.examples import enlist
from bimvox_cli.options import command, to_file
from bimvox_cli.output import Output, facts

if TYPE_CHECKING:
    from rich.console import Console

crane = typer.Typer(name="crane", help="Machine files.", rich_markup_mode=None, no_args_is_help=False)

_MOST_PASTED = 10_000_000


@command
def import_(
    output: Output,
    source: Annotated[
        Path,
        typer.Argument(metavar="FILE", help="A table as CSV or text, a .kran file, or - for text on standard input."),
    ],
    out: Annotated[Path | None, to_file("MACHINE.toml", "Machine file. Default: by the machine's name.")] = None,
    kind: Annotated[
        Literal["mobile", "luffing", "hammerhead"],
        typer.Option("--kind", metavar="KIND", help="Kind of crane: mobile, luffing or hammerhead."),
    ] = "mobile",
    like: Annotated[
        str | None,
        typer.Option("--like", metavar="NAME", help="Generic machine whose values stand in for keys that are missing."),
    ] = None,
    stated: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="KEY=VALUE", help="A key of the machine file, as TOML; several are allowed."),
    ] = None,
    load_unit: Annotated[
        Literal["t", "kg", "lb", "klb", "kN", "short_ton"] | None,
        typer.Option("--load-unit", metavar="UNIT", help="Unit of loads: t, kg, lb, klb, kN or short_ton."),
    ] = None,
    length_unit: Annotated[
        Literal["m", "ft"] | None, typer.Option("--length-unit", metavar="UNIT", help="Unit of lengths: m or ft.")
    ] = None,
    decimal: Annotated[
        Literal[".", ","] | None,
        typer.Option("--decimal", metavar="MARK", help="Decimal mark. Default: as the numbers look."),
    ] = None,
    keep_footnoted: Annotated[
        bool, typer.Option("--keep-footnoted", help="Use capacities with a footnote, which are left out otherwise.")
    ] = False,
) -> int:
    """Make a machine file from a load chart.

    Lengths of boom or jib stand in the row above the table, radii in its first column. Draws the chart, checks it,
    and says what it cannot know. What is missing is asked for, or named if nobody can answer.
    """
    from bimvox_pipeline.crane_import.act import ImportOptions, import_crane
    from bimvox_pipeline.crane_import.read_text import TextOptions

    pasted = str(source) == "-"
    text = TextOptions(load_unit, length_unit, decimal, keep_footnoted)
    answers = not (pasted or output.as_json or output.quiet) and like is None and sys.stdin.isatty()
    document = import_crane(
        None if pasted else source,
        _pasted() if pasted else None,
        out,
        ImportOptions(kind, like, tuple(stated or ()), text),
        ask=_ask if answers else None,
        progress=output.progress,
    )
    code = output.result(document, _show)
    name = Path(document["out"]).name
    output.next_step(f'next: look at {document["charts"][0]}, then put machine = "{name}" into [crane]')
    return code


def _pasted() -> bytes:
    """Return the bytes of standard input.

    Raises:
        InputError: If it is empty, closed or too long.
    """
    data = b"" if sys.stdin is None else sys.stdin.buffer.read(_MOST_PASTED + 1)
    if not data.strip() or len(data) > _MOST_PASTED:
        raise InputError(
            "standard input is empty" if not data.strip() else "standard input is longer than 10 MB",
            hint="paste the table and end it with Ctrl-D, or name a file",
        )
    return data


def _ask(key: str, what: str, example: str) -> str | None:
    """Ask a person for a key, on stderr."""
    answer: str = typer.prompt(f"{key}: {what}\n  for example {example}\n  (Enter: as a generic machine)", "", err=True)
    return answer.strip() or None


def _show(console: Console, document: Mapping[str, Any]) -> None:
    """Print what was made, what was checked, and what is not known."""
    shown = {
        "machine file": document["out"],
        "charts": ", ".join(document["charts"]),
        "machine": f"{document['machine']}, {document['kind']}",
        "lengths": ", ".join(f"{length:g}" for length in document["lengths_m"]) + " m",
        "tables": len(document["tables"]),
    }
    shown |= {
        f"check {one['name']}": ("passed: " if one["passed"] else "LOOK: ") + one["text"] for one in document["checks"]
    }
    shown |= {f"note {n}": one for n, one in enumerate(document["notes"], 1)}
    shown |= {f"not known {n}": one for n, one in enumerate(document["cannot_know"], 1)}
    facts(console, shown)


enlist(crane, import_, group="crane")
