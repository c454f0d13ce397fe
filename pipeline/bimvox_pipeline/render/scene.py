"""From a file to the scene of its picture."""

from __future__ import annotations

import difflib
import re
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from bimvox.errors import InputError, SelectionError
from bimvox.progress import Progress
from bimvox_pipeline.inspect.kinds import Kind
from bimvox_pipeline.sensible_log import require_sense

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from bimvox.grid.voxel_grid import VoxelGrid
    from bimvox.log.plan_log import PlanLog
    from bimvox.rendering.pictures.camera import View
    from bimvox.rendering.pictures.film_scene import Film
    from bimvox.rendering.pictures.scene import Scene
    from bimvox.site.site import Site

_ROOM = 0.6
"""Margin around a thing in focus, as a share of its longest side."""
_LEAST_ROOM_M = 1.5
_CLOCK = re.compile(r"(?:(\d+):)?(\d{1,2}):(\d{2}(?:\.\d+)?)")
_FIRST_PART = 2
"""Index of a grid's first part among the solids of its scene."""


@dataclass(frozen=True, slots=True)
class SceneOptions:
    """What a picture or an animation shows, and from where.

    Attributes:
        lift: Show this lift of a log under way: its number, or id, GlobalId or name of its part. Of an animation: only
            this lift.
        time: Show a log at this time: ``1:23:45``, seconds, or ``40%`` of the lift if one is given, otherwise of the
            whole plan.
        share: Without a time, how much of the lift's carrying time is over, 0..1.
        azimuth_deg: Direction from the site to the eye, counter-clockwise from +x; None puts the yard in front.
        elevation_deg: Angle of the eye above the horizon; None takes the default.
        focus: Fill the picture with this part or obstruction.
        hide: Layers to leave out.
        voxel_size_m: Edge of a cell of a model that is voxelized for its picture; None as ``bimvox voxelize``.
    """

    lift: str | None = None
    time: str | None = None
    share: float = 0.5
    azimuth_deg: float | None = None
    elevation_deg: float | None = None
    focus: str | None = None
    hide: tuple[str, ...] = ()
    voxel_size_m: float | None = None


@dataclass(frozen=True, slots=True)
class FilmPace:
    """Frame rate and length of an animation.

    Attributes:
        fps: Frames a second.
        seconds: Its length; None takes it from the number of lifts.
    """

    fps: float = 10.0
    seconds: float | None = None


def picture_scene(source: Path, kind: Kind, options: SceneOptions, progress: Progress) -> tuple[Scene, View]:
    """Return the scene of a file, and its view."""
    from bimvox.rendering.pictures.camera import View
    from bimvox.rendering.pictures.site import scene_of_site, view_of_site

    if kind is Kind.LOG:
        return _log_scene(source, options, progress)
    if kind is Kind.SITE:
        from bimvox.library.site import load_site

        site = load_site(source, progress).site
        scene = _focused(scene_of_site(site), site, options.focus)
        return scene, view_of_site(site, options.azimuth_deg, options.elevation_deg)
    default = View()
    view = View(
        default.azimuth_deg if options.azimuth_deg is None else options.azimuth_deg,
        default.elevation_deg if options.elevation_deg is None else options.elevation_deg,
    )
    if kind is Kind.GRID:
        from bimvox.grid.storage import read_grid

        progress.stage("read")
        with source.open("rb") as stream:
            grid = read_grid(stream, source.name)
    else:
        grid = _voxelized(source, options.voxel_size_m, progress)
    return _grid_scene(grid, source.name, options.focus), view


def film_of(log: PlanLog) -> Film:
    """Return the scenes of a log over time."""
    from bimvox.log.moving import tracks_of
    from bimvox.rendering.pictures.film_scene import Film

    return Film(log.plan.site, log.all_lifts, log.motions, tracks_of(log))


def moment_of(words: str, start_ns: int, end_ns: int) -> int:
    """Return a time on the site's clock from ``1:23:45``, ``12:30``, seconds, or a share such as ``40%``.

    ``start_ns`` and ``end_ns`` are the times of 0 % and 100 %.

    Raises:
        InputError: If it is not a time, or out of range.
    """
    text = words.strip()
    found = _CLOCK.fullmatch(text)
    try:
        if found:
            hours, minutes, seconds = (float(part or 0) for part in found.groups())
            at_ns = round((3600.0 * hours + 60.0 * minutes + seconds) * 1e9)
        elif text.endswith("%"):
            share = float(text[:-1]) / 100.0
            if not 0.0 <= share <= 1.0:
                raise InputError(f"{words!r} is not a share of the time", hint="give 0% to 100%")
            return start_ns + round(share * (end_ns - start_ns))
        else:
            at_ns = round(float(text) * 1e9)
    except (ValueError, OverflowError) as error:
        raise InputError(f"{words!r} is not a time", hint="give 1:23:45, seconds, or a share such as 40%") from error
    return at_ns


def is_experiment(folder: Path) -> bool:
    """Return whether a folder was written by ``bimvox experiment``."""
    from bimvox_pipeline.paper import MANIFEST

    return (folder / MANIFEST).is_file()


def _log_scene(source: Path, options: SceneOptions, progress: Progress) -> tuple[Scene, View]:
    from bimvox.log.plan_log import chosen_lift
    from bimvox.log.reader import read_log
    from bimvox.rendering.pictures.plan import Instant, scene_of_plan
    from bimvox.rendering.pictures.site import view_of_site

    progress.stage("read")
    log = require_sense(read_log(source), source)
    site = log.plan.site
    if options.time is None:
        moment = None if options.lift is None else Instant(chosen_lift(log, options.lift), options.share)
        scene = scene_of_plan(site, log.all_lifts, log.motions, moment, log.props_standing)
    else:
        film = film_of(log)
        start_ns, end_ns = film.start_ns, film.end_ns
        if options.lift is not None:
            track = film.track_of(chosen_lift(log, options.lift))
            start_ns, end_ns = track.start_ns, track.end_ns
        at_ns = moment_of(options.time, start_ns, end_ns)
        if not film.start_ns <= at_ns <= film.end_ns:
            ends = " to ".join(f"{ns / 1e9:.0f}" for ns in (film.start_ns, film.end_ns))
            raise InputError(f"the time {options.time} is not in the plan", hint=f"its clock goes from {ends} s")
        scene = film.scene(at_ns)
    return _focused(scene, site, options.focus), view_of_site(site, options.azimuth_deg, options.elevation_deg)


def _focused(scene: Scene, site: Site, name: str | None) -> Scene:
    """Return a scene focused on a part at its target, or on a blocker."""
    if name is None:
        return scene
    from bimvox.rendering.pictures.site import target_cells

    things = {blocker.id: blocker.cells for blocker in site.blockers if len(blocker.cells)}
    parts = [part for part in site.components if name in (part.id, part.global_id, part.name)]
    if len(parts) > 1 and name not in {part.id for part in parts}:
        raise SelectionError(
            f"{len(parts)} parts are called {name!r}", hint=f"name one by its id, such as {parts[0].id}"
        )
    if parts:
        cells = target_cells(next((part for part in parts if part.id == name), parts[0]))
    elif name in things:
        cells = things[name]
    else:
        known = [*things, *(part.id for part in site.components), *(part.name for part in site.components)]
        raise _unknown(name, known)
    return _with_focus(scene, cells)


def _grid_scene(grid: VoxelGrid, title: str, name: str | None) -> Scene:
    import numpy as np

    from bimvox.rendering.pictures.site import scene_of_grid

    scene = scene_of_grid(grid, title=title)
    if name is None:
        return scene
    found = [n for n, part in enumerate(grid.parts) if name in (part.id, part.global_id, part.name)]
    exact = [n for n in found if grid.parts[n].id == name] or found
    if len(exact) != 1:
        if exact:
            one = grid.parts[exact[0]].id
            raise SelectionError(f"{len(exact)} parts are called {name!r}", hint=f"name one by its id, such as {one}")
        raise _unknown(name, [*(part.id for part in grid.parts), *(part.name for part in grid.parts)])
    cells = np.argwhere(scene.solids == exact[0] + _FIRST_PART)
    if not len(cells):
        raise SelectionError(f"{name!r} owns no cell of this grid", hint="voxelize with smaller cells")
    return _with_focus(scene, cells)


def _with_focus(scene: Scene, cells: NDArray[np.integer]) -> Scene:
    """Return a scene focused on some cells with a margin, in a box that is visible through other things."""
    import numpy as np

    from bimvox.rendering.colours import INK
    from bimvox.rendering.pictures.scene import Layer, Strokes, box_edges

    ends = scene.frame.corner_of(np.stack([cells.min(axis=0), cells.max(axis=0) + 1]))
    room = max(_LEAST_ROOM_M, _ROOM * float((ends[1] - ends[0]).max()))
    grow = 0.1 * scene.frame.voxel_size_m
    box = Strokes(box_edges(ends[0] - grow, ends[1] + grow), INK, 2.0, hidden_opacity=0.8, layer=Layer.BOXES)
    around = np.stack([ends[0] - room, ends[1] + room])
    return replace(scene, strokes=(*scene.strokes, box), focus_m=around)


def _unknown(name: str, known: list[str]) -> SelectionError:
    near = difflib.get_close_matches(name, known, n=1)
    hint = f"did you mean {near[0]}?" if near else "bimvox inspect lists what there is"
    return SelectionError(f"there is no part or obstruction {name!r}", hint=hint)


def _voxelized(source: Path, voxel_size_m: float | None, progress: Progress) -> VoxelGrid:
    from bimvox.bim.read import read_building
    from bimvox.library.site import say_notes
    from bimvox.voxelization.building import voxelize_building
    from bimvox.voxelization.lattice import default_voxel_size_m

    progress.stage("read")
    building = read_building(source, None, progress.report)
    say_notes(building, progress)
    if not building.elements:
        raise SelectionError(f"{source}: no element in it has a shape to draw")
    progress.stage("voxelize")
    size_m = default_voxel_size_m(building.bounds_m) if voxel_size_m is None else voxel_size_m
    return voxelize_building(building, size_m, progress=progress.report)
