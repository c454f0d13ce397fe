"""``bimvox render``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from cli.options import Json, Quiet
from cli.output import facts, open_output


def render(
    source: Annotated[Path, typer.Argument(metavar="FILE", help="A log, a site file, a grid or a model.")],
    out: Annotated[
        Path | None,
        typer.Option(
            "--output", "-o", metavar="OUT", help="The picture (.png), or of a log a page (.html). Default: a .png."
        ),
    ] = None,
    size: Annotated[
        str, typer.Option("--size", envvar="BIMVOX_SIZE", metavar="WxH", help="Size of the picture in pixels.")
    ] = "1280x800",
    lift: Annotated[
        str | None,
        typer.Option("--lift", metavar="ID", help="Show this lift of a log under way, not the finished building."),
    ] = None,
    azimuth: Annotated[
        float | None,
        typer.Option(
            metavar="DEGREES", help="Where the eye stands, counter-clockwise from +x. Default: the yard in front."
        ),
    ] = None,
    elevation: Annotated[
        float | None, typer.Option(metavar="DEGREES", help="How high the eye stands, 5 to 89. Default: 28.")
    ] = None,
    proof: Annotated[
        bool,
        typer.Option("--proof/--no-proof", help="Prove the log again for its page, or let the page say NOT PROVEN."),
    ] = True,
    json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Draw a plan, site, grid or model, or make a plan's page."""
    from pipeline.render import render as run

    with open_output(as_json=json, quiet=quiet) as output:
        document = run(
            source,
            out,
            size=_pixels(size),
            lift=lift,
            azimuth_deg=azimuth,
            elevation_deg=elevation,
            proven=proof,
            progress=output.progress,
        )
    raise typer.Exit(output.result(document, facts))


def _pixels(size: str) -> tuple[int, int]:
    """Read ``1280x800``."""
    width, _, height = size.lower().partition("x")
    if not (width.isdecimal() and height.isdecimal() and int(width) and int(height)):
        raise typer.BadParameter(f"{size!r} is not a size in pixels such as 1280x800", param_hint="'--size'")
    return int(width), int(height)
