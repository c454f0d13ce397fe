"""``bimvox render``: a picture of what a file holds."""

from __future__ import annotations

import difflib
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bimvox.errors import InputError, SelectionError
from pipeline.artifacts import check_output, default_output, write_atomically
from pipeline.kinds import Kind, kind_of
from pipeline.progress import Progress

if TYPE_CHECKING:
    from bimvox.log.plan_log import PlanLog
    from bimvox.render.camera import View
    from bimvox.render.scene import Scene

_PICTURE_CELLS = 6_000_000
"""Cells of a model that is voxelized for a picture: finer ones would be smaller than a pixel."""


def render(
    source: Path,
    out: Path | None = None,
    *,
    size: tuple[int, int] = (1280, 800),
    lift: str | None = None,
    share: float = 0.5,
    azimuth_deg: float | None = None,
    elevation_deg: float | None = None,
    proven: bool = True,
    progress: Progress,
) -> dict[str, Any]:
    """Draw a picture, or make a page.

    Args:
        source: A log, a site file, a grid, an IFC or a mesh.
        out: The picture, ``.png``, or of a log the page, ``.html``; default: the input's name with ``.png``, in the
            current folder.
        size: Width and height in pixels.
        lift: Show this lift of a log under way: the id, GlobalId or name of its component.
        share: How much of that lift's carrying time is over, 0..1.
        azimuth_deg: Where the eye stands, counter-clockwise from +x; default: the yard before the building.
        elevation_deg: How high the eye stands.
        proven: Whether the log is proven again for its page; else the page says that it is not.
        progress: Told of the stages.

    Returns:
        The document of ``bimvox render --json``.

    Raises:
        InputError: If the file cannot be read or drawn, or holds no such lift.
    """
    from bimvox.render.picture import PictureOptions
    from bimvox.render.png import png_of

    kind = kind_of(source)
    target = out or default_output(source, ".png")
    if target.suffix.lower() in (".html", ".htm"):
        return _render_page(source, kind, target, proven, progress)
    if target.suffix.lower() != ".png":
        raise InputError(
            f"{target}: pictures are written as PNG, pages of logs as HTML", hint=f"-o {target.with_suffix('.png')}"
        )
    check_output(target, inputs=[source])
    if lift is not None and kind is not Kind.LOG:
        raise InputError(f"{source}: only a log holds lifts", hint="leave --lift out, or name a log")
    PictureOptions(size_px=size)  # a size that cannot be is said before the work
    scene, view = _scene(source, kind, lift, share, azimuth_deg, elevation_deg, progress)
    progress.stage("draw")
    picture = png_of(scene, PictureOptions(size_px=size, view=view))
    progress.stage("write")
    write_atomically(target, picture, inputs=[source])
    progress.finish()
    return {
        "out": str(target),
        "kind": kind.value,
        "size": list(size),
        "azimuth_deg": round(view.azimuth_deg, 3),
        "elevation_deg": round(view.elevation_deg, 3),
        "seconds": progress.seconds,
    }


def _render_page(source: Path, kind: Kind, target: Path, proven: bool, progress: Progress) -> dict[str, Any]:
    from pipeline.render_page import page_of_log

    if kind is not Kind.LOG:
        raise InputError(f"{source}: only a log has a page", hint="bimvox plan SITE writes a log")
    check_output(target, inputs=[source])
    page = page_of_log(source, proven=proven, progress=progress)
    progress.stage("write")
    write_atomically(target, page, inputs=[source])
    progress.finish()
    return {"out": str(target), "kind": kind.value, "bytes": len(page), "seconds": progress.seconds}


def _scene(
    source: Path,
    kind: Kind,
    lift: str | None,
    share: float,
    azimuth_deg: float | None,
    elevation_deg: float | None,
    progress: Progress,
) -> tuple[Scene, View]:
    from bimvox.render.camera import View
    from bimvox.render.plan_scene import Moment, scene_of_plan
    from bimvox.render.site_scene import scene_of_site, view_of_site

    if kind is Kind.LOG:
        from bimvox.log.reader import read_log

        progress.stage("read")
        log = read_log(source)
        site = log.plan.site
        moment = None if lift is None else Moment(_order_of(log, lift), share)
        scene = scene_of_plan(site, log.all_lifts, log.motions, moment)
        return scene, view_of_site(site, azimuth_deg, elevation_deg)
    if kind is Kind.SITE:
        from pipeline.load_site import load_site

        site = load_site(source, progress).site
        return scene_of_site(site), view_of_site(site, azimuth_deg, elevation_deg)
    default = View()
    view = View(
        default.azimuth_deg if azimuth_deg is None else azimuth_deg,
        default.elevation_deg if elevation_deg is None else elevation_deg,
    )
    if kind is Kind.GRID:
        return _grid_scene(source, progress), view
    if kind in (Kind.IFC, Kind.MESH):
        return _model_scene(source, progress), view
    raise InputError(
        f"{source}: a file of the kind {kind.value!r} has no picture",
        hint="bimvox render draws logs, site files, grids, IFC and mesh files",
    )


def _grid_scene(source: Path, progress: Progress) -> Scene:
    from bimvox.grid.storage import read_grid
    from bimvox.render.grid_scene import scene_of_grid

    progress.stage("read")
    with source.open("rb") as stream:
        grid = read_grid(stream, source.name)
    return scene_of_grid(grid, title=source.name)


def _model_scene(source: Path, progress: Progress) -> Scene:
    from bimvox.bim.read import read_building
    from bimvox.render.grid_scene import scene_of_grid
    from bimvox.voxelize.building import voxelize_building
    from bimvox.voxelize.limits import default_voxel_size_m
    from pipeline.load_site import say_notes

    progress.stage("read")
    building = read_building(source, None, progress.report)
    say_notes(building, progress)
    if not building.elements:
        raise SelectionError(f"{source}: nothing in it has a shape to draw")
    progress.stage("voxelize")
    size_m = default_voxel_size_m(building.bounds_m, _PICTURE_CELLS)
    return scene_of_grid(voxelize_building(building, size_m, progress=progress.report), title=source.name)


def _order_of(log: PlanLog, name: str) -> int:
    """Return the order of the lift that has this number, or whose component has this id, GlobalId or name."""
    components = log.plan.site.components
    orders = {str(lift.order): lift.order for lift in log.all_lifts}
    orders |= {components[lift.component].id: lift.order for lift in log.all_lifts}
    if name in orders:
        return orders[name]
    same = [component for component in components if name in (component.global_id, component.name)]
    found = [component.id for component in same if component.id in orders]
    if len(found) == 1:
        return orders[found[0]]
    if found:
        raise SelectionError(
            f"{len(found)} components are called {name!r}", hint=f"name one by its id, for example {found[0]}"
        )
    near = difflib.get_close_matches(name, [*orders, *(component.name for component in components)], n=1)
    raise SelectionError(
        f"the log holds no lift of {name!r}",
        hint=f"did you mean {near[0]}?" if near else "bimvox inspect LOG lists its lifts",
    )
