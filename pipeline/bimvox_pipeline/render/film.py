"""``bimvox render LOG -o LOG.gif``: the whole plan, or one lift, as an animation."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Literal

from bimvox.errors import InputError
from bimvox.files import write_atomically
from bimvox.progress import Progress
from bimvox_pipeline.render.scene import FilmPace, SceneOptions, film_of
from bimvox_pipeline.sensible_log import require_sense


def render_film(
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
    from bimvox.log.lift_choice import chosen_lift
    from bimvox.log.reader import read_log
    from bimvox.rendering.film.film import FilmOptions, default_seconds, frame_times_ns, write_film
    from bimvox.rendering.scene.scene import layers_named
    from bimvox.rendering.scene.site import view_of_site

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
