"""``bimvox render``: a file as a picture, an animation or a page."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from bimvox.errors import InputError
from bimvox.files import check_output, default_output, write_atomically
from bimvox.progress import Progress
from bimvox.rendering.draw.camera import FILM_PX, FILMS, PICTURE_PX
from bimvox_pipeline.inspect.kinds import Kind, kind_of
from bimvox_pipeline.render.drawing import is_drawing, render_drawing
from bimvox_pipeline.render.scene import FilmPace, SceneOptions, is_experiment, moment_of, picture_scene

_PAGES = frozenset((".html", ".htm"))
_DRAWN = "bimvox render draws logs, site files, grids, IFC and mesh files, and folders of experiments"


def render(
    source: Path,
    out: Path | None = None,
    *,
    shown: SceneOptions | None = None,
    size: tuple[int, int] | None = None,
    pace: FilmPace | None = None,
    proven: bool = True,
    progress: Progress,
) -> dict[str, Any]:
    """Draw a picture, or make an animation or a page.

    Args:
        source: A log, a site file, a grid, an IFC or a mesh; or the folder of an experiment.
        out: The picture, ``.png`` (of an experiment also ``.svg``); of a site the drawing, ``.svg``, or ``.png`` with
            an elevation of 90 degrees; of a log the animation, ``.gif`` or ``.webp``, or
            the page, ``.html``. Default: the input's name with ``.png``, in the current folder.
        shown: What a picture or an animation shows, and from where.
        size: Width and height in pixels; default 1280x800, of an animation 640x400.
        pace: Frame rate and length of an animation.
        proven: Whether the log is proven again for its page; otherwise the page says that it is not proven.
        progress: Receives the stages.

    Returns:
        The document of ``bimvox render --json``.

    Raises:
        InputError: If the file cannot be read or drawn, or holds no such lift or part.
    """
    options = shown or SceneOptions()
    if source.is_dir() and is_experiment(source):
        from bimvox_pipeline.render.experiment import render_experiment

        return render_experiment(source, out, progress)
    kind = kind_of(source)
    target = out or default_output(source, ".png")
    suffix = target.suffix.lower()
    if suffix in _PAGES:
        return _render_page(source, kind, target, proven, progress)
    if suffix not in FILMS and suffix not in (".png", ".svg"):
        raise InputError(
            f"{target}: pictures are written as PNG, drawings of sites as SVG, animations as GIF or WebP, pages of "
            "logs as HTML",
            hint=f"-o {target.with_suffix('.png')}",
        )
    check_output(target, inputs=[source])
    if kind is not Kind.LOG:
        for given, what in ((options.lift, "lift"), (options.time, "time")):
            if given is not None:
                raise InputError(f"{source}: only a log has lifts", hint=f"leave --{what} out, or name a log")
        if suffix in FILMS:
            raise InputError(f"{source}: only a log can be animated", hint="bimvox plan SITE writes a log")
    if is_drawing(kind, suffix, options):
        return render_drawing(source, kind, target, size, options, progress)
    if suffix in FILMS:
        from bimvox_pipeline.render.film import render_film

        return render_film(source, target, FILMS[suffix], size or FILM_PX, options, pace or FilmPace(), progress)
    return _render_picture(source, kind, target, size or PICTURE_PX, options, progress)


def _render_picture(
    source: Path, kind: Kind, target: Path, size: tuple[int, int], wanted: SceneOptions, progress: Progress
) -> dict[str, Any]:
    from bimvox.rendering.draw.picture import PictureOptions
    from bimvox.rendering.draw.png import png_of
    from bimvox.rendering.scene.scene import Layer, layers_named, without

    # Impossible options fail before the work.
    PictureOptions(size_px=size)
    hidden = layers_named(wanted.hide)
    if wanted.time is not None:
        moment_of(wanted.time, 0, 1)
    if kind in (Kind.OBSTRUCTIONS, Kind.POLICY):
        raise InputError(f"{source}: a file of the kind {kind.value!r} has no picture", hint=_DRAWN)
    scene, view = picture_scene(source, kind, wanted, progress)
    progress.stage("draw")
    options = PictureOptions(size_px=size, view=view, annotated=Layer.WORDS not in hidden)
    picture = png_of(without(scene, hidden), options)
    progress.stage("write")
    write_atomically(target, picture, inputs=[source])
    progress.finish()
    return {
        "out": str(target),
        "kind": kind.value,
        "size": list(size),
        "azimuth_deg": round(view.azimuth_deg, 3),
        "elevation_deg": round(view.elevation_deg, 3),
        "hidden": sorted(layer.value for layer in hidden),
        "bytes": len(picture),
        "seconds": progress.seconds,
    }


def _render_page(source: Path, kind: Kind, target: Path, proven: bool, progress: Progress) -> dict[str, Any]:
    from bimvox_pipeline.render.page import page_of_log

    if kind is not Kind.LOG:
        raise InputError(f"{source}: only a log has a page", hint="bimvox plan SITE writes a log")
    check_output(target, inputs=[source])
    page = page_of_log(source, proven=proven, progress=progress)
    progress.stage("write")
    write_atomically(target, page, inputs=[source])
    progress.finish()
    return {"out": str(target), "kind": kind.value, "bytes": len(page), "seconds": progress.seconds}
