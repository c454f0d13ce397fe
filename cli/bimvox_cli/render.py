"""``bimvox render``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from bimvox_cli import complete, failure
from bimvox_cli.options import VoxelSize, command, to_file
from bimvox_cli.output import Output, facts


@command
def render(
    output: Output,
    source: Annotated[
        Path,
        typer.Argument(metavar="FILE", help="A log, a site file, a grid, a model, or the folder of an experiment."),
    ],
    out: Annotated[
        Path | None,
        to_file(
            "OUT",
            "A picture (.png); for a log also an animation (.gif, .webp) or a page (.html); for a site file "
            "also the drawing from above (.svg). Default: a .png.",
        ),
    ] = None,
    size: Annotated[
        str | None,
        typer.Option(
            "--size",
            envvar="BIMVOX_SIZE",
            metavar="WxH",
            help="Size in pixels. Default: 1280x800, for an animation 640x400.",
        ),
    ] = None,
    lift: Annotated[
        str | None,
        typer.Option(
            "--lift",
            metavar="ID",
            autocompletion=complete.lifts,
            help="Show this lift in transit (number from 1, or name, id or GlobalId of the part); "
            "for an animation, only this lift.",
        ),
    ] = None,
    time: Annotated[
        str | None,
        typer.Option("--time", metavar="T", help="Show a log at this time: 1:23:45, seconds, or 40% (of --lift)."),
    ] = None,
    azimuth: Annotated[
        float | None,
        typer.Option(
            metavar="DEGREES", help="Direction of the camera, counter-clockwise from +x. Default: the yard in front."
        ),
    ] = None,
    elevation: Annotated[
        float | None,
        typer.Option(
            metavar="DEGREES",
            help="Height angle of the camera, 5 to 89. Default: 28. 90: the drawing of a site file from above; as .png "
            "it needs a browser.",
        ),
    ] = None,
    focus: Annotated[
        str | None, typer.Option("--focus", metavar="ID", help="Zoom to this part or obstruction.")
    ] = None,
    hide: Annotated[
        list[str] | None,
        typer.Option(
            "--hide",
            metavar="LAYER",
            autocompletion=complete.layers,
            help="Leave out: ground, structure, obstructions, unbuilt, assembled, crane, paths, boxes, words.",
        ),
    ] = None,
    voxel_size: VoxelSize = None,
    fps: Annotated[float, typer.Option("--fps", metavar="N", help="Frames a second of an animation.")] = 10,
    seconds: Annotated[
        float | None,
        typer.Option(
            "--seconds", metavar="S", help="Length of an animation. Default: 6 to 24, by the number of lifts."
        ),
    ] = None,
    follow: Annotated[
        bool,
        typer.Option("--follow", help="Write the page again whenever the log changes; open pages reload. Ctrl-C ends."),
    ] = False,
    proof: Annotated[
        bool,
        typer.Option(
            "--proof/--no-proof", help="Prove the log again for its page; otherwise the page says NOT PROVEN."
        ),
    ] = True,
) -> int:
    """Draw the contents of a file: picture, animation or page."""
    from bimvox_pipeline.render.render import render as run
    from bimvox_pipeline.render.scene import FilmPace, SceneOptions

    if follow:
        return _follow(output, source, out, proof)
    document = run(
        source,
        out,
        shown=SceneOptions(
            lift=lift,
            time=time,
            azimuth_deg=azimuth,
            elevation_deg=elevation,
            focus=focus,
            hide=tuple(name for given in hide or [] for name in given.split(",") if name),
            voxel_size_m=voxel_size,
        ),
        size=None if size is None else _pixels(size),
        pace=FilmPace(fps, seconds),
        proven=proof,
        progress=output.progress,
    )
    return output.result(document, facts)


def _follow(output: Output, source: Path, out: Path | None, proof: bool) -> int:
    from bimvox_pipeline.render.follow import follow

    from bimvox.files import default_output

    for change in follow(source, out or default_output(source, ".html"), proven=proof, progress=output.progress):
        words = change.get("message") or f"revision {change['revision']}, {change['bytes'] / 1e6:.1f} MB"
        output.line(change, f"{change['event']}: {words}")
    return failure.DONE


def _pixels(size: str) -> tuple[int, int]:
    """Read ``1280x800``."""
    width, _, height = size.lower().partition("x")
    if not (width.isdecimal() and height.isdecimal() and int(width) and int(height)):
        raise typer.BadParameter(f"{size!r} is not a size in pixels such as 1280x800", param_hint="'--size'")
    return int(width), int(height)
