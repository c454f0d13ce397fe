"""``bimvox render``: a file as a picture, an animation or a page."""

from __future__ import annotations

import re
import tempfile
from io import BytesIO
from pathlib import Path
from typing import Any, Literal

from PIL import Image

from bimvox.errors import InputError
from bimvox.extras import require
from bimvox.files import check_output, default_output, write_atomically
from bimvox.progress import Progress
from bimvox.rendering.pictures.camera import FILM_PX, FILMS, PICTURE_PX
from bimvox_pipeline.browser import draw_with, find_browser
from bimvox_pipeline.inspect.kinds import Kind, kind_of
from bimvox_pipeline.render.scene import FilmPace, SceneOptions, film_of, is_experiment, moment_of, picture_scene
from bimvox_pipeline.sensible_log import require_sense

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
        return _render_experiment(source, out, progress)
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
    if _is_drawing(kind, suffix, options):
        return _render_drawing(source, kind, target, size, options, progress)
    if suffix in FILMS:
        return _render_film(source, target, FILMS[suffix], size or FILM_PX, options, pace or FilmPace(), progress)
    return _render_picture(source, kind, target, size or PICTURE_PX, options, progress)


def _render_picture(
    source: Path, kind: Kind, target: Path, size: tuple[int, int], wanted: SceneOptions, progress: Progress
) -> dict[str, Any]:
    from bimvox.rendering.pictures.picture import PictureOptions, png_of
    from bimvox.rendering.pictures.scene import Layer, layers_named, without

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
    from bimvox_pipeline.render.revisions import page_of_log

    if kind is not Kind.LOG:
        raise InputError(f"{source}: only a log has a page", hint="bimvox plan SITE writes a log")
    check_output(target, inputs=[source])
    page = page_of_log(source, proven=proven, progress=progress)
    progress.stage("write")
    write_atomically(target, page, inputs=[source])
    progress.finish()
    return {"out": str(target), "kind": kind.value, "bytes": len(page), "seconds": progress.seconds}


# ``bimvox render LOG -o LOG.gif``: the whole plan, or one lift, as an animation.


def _render_film(
    source: Path,
    target: Path,
    file_format: Literal["gif", "webp"],
    size: tuple[int, int],
    wanted: SceneOptions,
    pace: FilmPace,
    progress: Progress,
) -> dict[str, Any]:
    """Write the animation of a log, whole or not at all, and return the document of ``bimvox render --json``.

    Of ``wanted``, ``lift``, ``hide`` and the angles are used; ``size`` is in pixels.
    """
    from bimvox.log.plan_log import chosen_lift
    from bimvox.log.reader import read_log
    from bimvox.rendering.pictures.film import FilmOptions, default_seconds, frame_times_ns, write_film
    from bimvox.rendering.pictures.scene import layers_named
    from bimvox.rendering.pictures.site import view_of_site

    for given, what in ((wanted.time, "time"), (wanted.focus, "focus")):
        if given is not None:
            raise InputError(f"an animation has no --{what}", hint=f"leave --{what} out, or write a .png")
    fps, seconds = pace.fps, pace.seconds
    hidden = layers_named(wanted.hide)
    FilmOptions(size, fps=fps)  # fails before the work if the options are impossible
    if seconds is not None and not 0.0 < seconds <= 3600.0:
        raise InputError(f"an animation of {seconds:g} seconds cannot be made", hint="give more than 0, at most 3600")
    progress.stage("read")
    log = require_sense(read_log(source), source)
    film = film_of(log)
    tracks = film.tracks if wanted.lift is None else (film.track_of(chosen_lift(log, wanted.lift)),)
    length_s = default_seconds(len(tracks)) if seconds is None else seconds
    times = frame_times_ns(tracks, log.motions, max(2, round(length_s * fps)))
    view = view_of_site(log.plan.site, wanted.azimuth_deg, wanted.elevation_deg)
    options = FilmOptions(size, view, fps, hidden=hidden)
    progress.stage("draw", len(times))
    write_atomically(
        target,
        lambda stream: write_film(stream, film, times, options, file_format, progress.report),
        inputs=[source],
    )
    progress.finish()
    return {
        "out": str(target),
        "kind": "log",
        "size": list(size),
        "frames": len(times),
        "frame_ms": options.frame_ms,
        "lifts": [track.lift.order for track in tracks],
        "from_s": times[0] / 1e9,
        "to_s": times[-1] / 1e9,
        "azimuth_deg": round(view.azimuth_deg, 3),
        "elevation_deg": round(view.elevation_deg, 3),
        "hidden": sorted(layer.value for layer in hidden),
        "bytes": target.stat().st_size,
        "seconds": progress.seconds,
    }


# ``bimvox render FOLDER``: the success curves of an experiment.


def _render_experiment(folder: Path, out: Path | None, progress: Progress) -> dict[str, Any]:
    """Draw the success curves of a folder of ``bimvox experiment paper``; return what ``bimvox render --json`` prints.

    ``out`` is ``.png`` or ``.svg``; default: the folder's name with ``.png``, in the current folder.
    """
    require("plots", "a picture of curves")
    from bimvox.paper.experiment.document import document_of
    from bimvox.paper.experiment.pictures import success_curves
    from bimvox_pipeline.paper import load_results

    target = out or Path(f"{folder.resolve().name}.png")
    suffix = target.suffix.lower()
    if suffix not in (".png", ".svg"):
        raise InputError(f"{target}: curves are written as PNG or SVG", hint=f"-o {target.with_suffix('.png')}")
    check_output(target)
    progress.stage("read")
    try:
        modes = document_of(load_results(folder))["modes"]
    except KeyError as error:
        raise InputError(
            f"{folder}: its results are from another version of bimvox: {error} is missing in them",
            hint="bimvox experiment paper -o DIR runs it again in a new folder",
        ) from error
    progress.stage("draw")
    picture = success_curves(modes, "svg" if suffix == ".svg" else "png")
    progress.stage("write")
    write_atomically(target, picture)
    progress.finish()
    return {"out": str(target), "kind": "experiment", "bytes": len(picture), "seconds": progress.seconds}


# The drawing of a site from above, to scale: as SVG, or as a picture by an installed browser.

_SUFFIX = ".svg"
_FROM_ABOVE_DEG = 90.0
"""The elevation of the camera that asks for the drawing."""
_INSTEAD = "draw it as .svg"
_SHARP = 2.0
"""Pixels of a picture per unit of the drawing, if no size is given."""
_SIZE = re.compile(r'width="([\d.]+)" height="([\d.]+)"')


def _is_drawing(kind: Kind, suffix: str, options: SceneOptions) -> bool:
    """Return whether a drawing from above is asked for."""
    return suffix == _SUFFIX or (kind is Kind.SITE and options.elevation_deg == _FROM_ABOVE_DEG)


def _render_drawing(
    source: Path, kind: Kind, target: Path, size: tuple[int, int] | None, options: SceneOptions, progress: Progress
) -> dict[str, Any]:
    """Write the drawing of a site, and return the document of ``bimvox render --json``.

    Args:
        source: The site file.
        kind: Its kind.
        target: The drawing; ``.png`` needs a browser.
        size: Width and height of a picture in pixels; None: two pixels for each unit of the drawing.
        options: They may ask for the view from above, and for nothing else.
        progress: Receives the stages.

    Raises:
        InputError: If it is not a site file, there is no browser for a picture, or the options ask for another view.
    """
    from bimvox.library.site import read_site
    from bimvox.rendering.report.drawing_file import drawing_file
    from bimvox.rendering.report.site_drawing import drawing_of_site

    if kind is not Kind.SITE:
        raise InputError(f"{source}: only a site file is drawn as SVG", hint=f"-o {target.with_suffix('.png')}")
    _refuse_others(source, options)
    browser = None if target.suffix.lower() == _SUFFIX else find_browser("a picture of the drawing", _INSTEAD)
    read = read_site(source, progress)
    progress.stage("draw")
    data = drawing_file(drawing_of_site(read.config, read.building), read.config.name or source.stem)
    if browser is not None:
        data = _picture(data, browser, size)
    progress.stage("write")
    write_atomically(target, data, inputs=[source])
    progress.finish()
    return {"out": str(target), "kind": kind.value, "bytes": len(data), "seconds": progress.seconds}


def _refuse_others(source: Path, options: SceneOptions) -> None:
    given = {
        "--azimuth": options.azimuth_deg,
        "--focus": options.focus,
        "--hide": options.hide or None,
        "--voxel-size": options.voxel_size_m,
        "--elevation": None if options.elevation_deg == _FROM_ABOVE_DEG else options.elevation_deg,
    }
    named = next((name for name, value in given.items() if value is not None), None)
    if named is not None:
        raise InputError(f"{source}: the drawing from above has no {named}", hint=f"leave {named} out")


def _picture(svg: bytes, browser: Path, size: tuple[int, int] | None) -> bytes:
    """Return a drawing as PNG; in a given size as large as it fits."""
    words = svg.decode()
    found = _SIZE.search(words)
    assert found is not None
    wide, high = (round(float(one)) for one in found.groups())
    sharp = _SHARP if size is None else 1.0
    wide, high = size or (wide, high)
    words = words.replace(found[0], f'width="{wide}" height="{high}"', 1)
    with tempfile.TemporaryDirectory(prefix="bimvox-draw-") as name:
        source, made = Path(name) / "site.svg", Path(name) / "site.png"
        source.write_text(words, "utf-8")
        options = (f"--screenshot={made}", f"--window-size={wide},{high}", f"--force-device-scale-factor={sharp:g}")
        data = draw_with(browser, source, made, "--hide-scrollbars", *options, instead=_INSTEAD)
    with Image.open(BytesIO(data)) as image, BytesIO() as into:
        # A browser's window has a least size; the drawing is at its top left.
        image.convert("RGB").crop((0, 0, round(wide * sharp), round(high * sharp))).save(into, "PNG")
        return into.getvalue()
