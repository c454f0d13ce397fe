"""``bimvox studio``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from bimvox_cli.failure import DONE
from bimvox_cli.options import command
from bimvox_cli.output import Output


@command
def studio(
    output: Output,
    path: Annotated[
        Path | None,
        typer.Argument(
            metavar="[SITE|MODEL|FOLDER]",
            help="What to open: a site file, a model, or a folder with both. Default: the current folder.",
        ),
    ] = None,
    port: Annotated[int, typer.Option(min=0, max=65535, metavar="N", help="Port on this machine; 0: a free one.")] = 0,
    browser: Annotated[bool, typer.Option("--browser/--no-browser", help="Whether a browser opens it.")] = True,
) -> int:
    """Set up a site by hand in a browser, and plan it.

    The page shows at once what the crane lifts from where it is dragged.

    Only this machine is answered, and only who has the token of the printed address. The page sees no file outside of
    the folder, and writes none before you save or plan. Ctrl-C ends it.
    """
    from bimvox_pipeline.studio.serve import serve

    serve(path, port=port, browser=browser, ready=lambda address: output.line({"url": address}, f"studio {address}"))
    return DONE
