"""``bimvox schema``."""

from __future__ import annotations

from typing import Annotated, Literal

import typer

from bimvox_cli.options import Json
from bimvox_cli.output import print_json


def schema(
    name: Annotated[
        Literal["site", "crane", "gear", "obstructions", "sweep", "grid", "log", "page", "score", "sequence-score"],
        typer.Argument(metavar="FORMAT", help="The format."),
    ],
    json: Json = False,
) -> None:
    """Print a format's schema: JSON Schema, or protobuf for the log."""
    from bimvox_pipeline.schema import schema as run

    document = run(name, plain_values=json)
    if isinstance(document, str):
        print(document, end="")
    else:
        print_json(document)
