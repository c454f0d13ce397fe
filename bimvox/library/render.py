"""Pictures, animations and pages of what the library returns."""

from __future__ import annotations

import hashlib
import io
import operator
from pathlib import Path
from typing import Any

from bimvox.errors import InputError, shown
from bimvox.files import check_output, write_atomically
from bimvox.grid.voxel_grid import VoxelGrid
from bimvox.library.arguments import insist, path_of, whole
from bimvox.library.plan_value import Plan
from bimvox.library.site import LoadedSite
from bimvox.log.moving import tracks_of
from bimvox.log.plan_log import all_remarks, log_dates
from bimvox.log.recorder import write_log
from bimvox.progress import Listener, Progress, progress_of
from bimvox.rendering.page.page import page_of
from bimvox.rendering.page.source import PageSource, Revision
from bimvox.rendering.pictures.camera import FILM_PX, FILMS, PICTURE_PX, View
from bimvox.rendering.pictures.film import FilmOptions, default_seconds, frame_times_ns, write_film
from bimvox.rendering.pictures.film_scene import Film
from bimvox.rendering.pictures.picture import PictureOptions, png_of
from bimvox.rendering.pictures.plan import Instant, scene_of_plan
from bimvox.rendering.pictures.scene import Scene
from bimvox.rendering.pictures.site import scene_of_grid, scene_of_site, view_of_site


def render(
    what: Plan | LoadedSite | VoxelGrid,
    path: Path | str,
    *,
    lift: int | None = None,
    size_px: tuple[int, int] | None = None,
    progress: Listener = None,
) -> Path:
    """Write a picture, an animation or a page, whole or not at all, and return its path.

    Args:
        what: A plan, a site or a grid.
        path: ``.png``: a picture. Of a plan also ``.gif`` or ``.webp``: an animation; ``.html``: an interactive page
            that needs no other file and makes no network requests.
        lift: Number of the lift of a plan, from 1, that a picture or an animation shows; default: the finished
            building, or all lifts.
        size_px: Width and height; default 1280 x 800, of an animation 640 x 400.
        progress: A ``Progress``, or a function that takes a line of text.

    Raises:
        InputError: If an argument is of another kind, the suffix does not fit, there is no such lift, or values of a
            plan make no sense.
        FileError: If the file cannot be written.
    """
    reporter = progress_of(progress)
    insist("render", what, (Plan, LoadedSite, VoxelGrid), "plan, a site or a grid")
    path, lift, size_px = check_output(path_of("render", path)), whole("lift", lift, 1), _pixels(size_px)
    suffix = path.suffix.lower()
    if lift is not None and not isinstance(what, Plan):
        raise InputError("only a plan has lifts", hint="leave lift out")
    if isinstance(what, Plan):
        what.require_sense("shown")
    if suffix == ".png":
        reporter.stage("draw")
        scene, view = _scene(what, lift)
        write_atomically(path, png_of(scene, PictureOptions(size_px=size_px or PICTURE_PX, view=view)))
    elif isinstance(what, Plan) and suffix in FILMS:
        _write_film(what, path, lift, size_px or FILM_PX, reporter)
    elif isinstance(what, Plan) and suffix in (".html", ".htm"):
        reporter.stage("page")
        write_atomically(path, page_of(PageSource((revision_of_plan(what),))))
    else:
        raise InputError(f"{path}: cannot be drawn", hint="name a .png; of a plan also a .gif, .webp or .html")
    reporter.finish()
    return path


def _scene(what: Plan | LoadedSite | VoxelGrid, number: int | None) -> tuple[Scene, View]:
    if isinstance(what, VoxelGrid):
        return scene_of_grid(what, title=str(what.source.get("name", ""))), View()
    if isinstance(what, LoadedSite):
        return scene_of_site(what.site), view_of_site(what.site)
    moment = None if number is None else Instant(_order(what, number))
    record = what.record
    scene = scene_of_plan(what.site, record.all_lifts, what.motions, moment, record.props_standing)
    return scene, view_of_site(what.site)


def _write_film(plan: Plan, path: Path, number: int | None, size_px: tuple[int, int], progress: Progress) -> None:
    film = Film(plan.site, plan.record.all_lifts, plan.motions, tracks_of(plan.record))
    tracks = film.tracks if number is None else (film.track_of(_order(plan, number)),)
    options = FilmOptions(size_px, view_of_site(plan.site))
    frames = max(2, round(default_seconds(len(tracks)) * options.fps))
    times_ns = frame_times_ns(tracks, plan.motions, frames)
    progress.stage("draw", len(times_ns))
    file_format = FILMS[path.suffix.lower()]
    write_atomically(path, lambda stream: write_film(stream, film, times_ns, options, file_format, progress.report))


def _order(plan: Plan, number: int) -> int:
    numbers = [lift.number for lift in plan.record.plan.lifts]
    if number not in numbers:
        raise InputError(f"the plan has no lift {number}", hint=f"lift numbers go from {numbers[0]} to {numbers[-1]}")
    return number - 1


def revision_of_plan(plan: Plan) -> Revision:
    """Return a plan as a page shows it; its log is the one that would be written now."""
    record, stream = plan.record, io.BytesIO()
    write_log(stream, record)
    return Revision(
        number=record.revision,
        log=f"{plan.site.name}.mcap",
        sha256=hashlib.sha256(stream.getvalue()).hexdigest(),
        plan=record.plan,
        context=record.context,
        motions=record.motions,
        tracks=tracks_of(record),
        proof=plan.verdict,
        remarks=all_remarks(record),
        metadata=record.metadata,
        dates=log_dates(record),
    )


def _pixels(value: Any) -> tuple[int, int] | None:
    """Return the width and height of a picture, or None if there are none.

    Raises InputError: if they are not two positive whole numbers.
    """
    if value is None:
        return None
    try:
        width, height = (operator.index(number) for number in value)
    except (TypeError, ValueError):
        width = height = 0
    if min(width, height) < 1:
        raise InputError(f"size_px is {shown(value)}", hint="give width and height, for example (640, 400)")
    return width, height
