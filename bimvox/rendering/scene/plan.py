"""The picture of a plan: the finished building with the paths of its parts, or one lift in transit."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bimvox.crane.tower_crane import CranePose
from bimvox.errors import InputError
from bimvox.motion.load_frame import cells_of_axes, load_frame
from bimvox.records.lift import Lift, Status
from bimvox.records.motion import LiftMotion
from bimvox.rendering.colours import (
    ARRIVED,
    ASSEMBLED,
    IN_TRANSIT,
    PATH,
    START_BOX,
    TARGET_BOX,
    UNBUILT,
)
from bimvox.rendering.scene.cranes import poses_at, site_cranes
from bimvox.rendering.scene.layers import Layer
from bimvox.rendering.scene.scene import LegendEntry, Scene, Strokes, Swatch, polyline
from bimvox.rendering.scene.site import boxes_strokes, site_canvas, site_legend, target_cells
from bimvox.rendering.scene.solids import Canvas
from bimvox.rendering.words import clock, counted, hours
from bimvox.site.component import Component, IntVec
from bimvox.site.lifting import crane_for
from bimvox.site.site import Site

FEW = 12
"""All paths are drawn up to this number; more would be unreadable."""
_ARRIVED = 1.0


@dataclass(frozen=True, slots=True)
class Instant:
    """A moment of a plan.

    Attributes:
        order: The lift under way.
        share: Elapsed share of its carrying time, 0..1; at 1 the part has arrived.
    """

    order: int
    share: float = 0.5


def scene_of_plan(
    site: Site,
    lifts: Sequence[Lift],
    motions: Sequence[LiftMotion] = (),
    moment: Instant | None = None,
    *,
    title: str = "",
) -> Scene:
    """Return the picture of a plan.

    Args:
        site: What was planned.
        lifts: Its lifts, in ascending order. Planned lifts without a path (an extract does not carry them) show their
            part only.
        motions: The motions of the planned ones; none without a crane.
        moment: Which lift to show under way; None for the finished building.
        title: The title; by default the site's name.

    Raises:
        InputError: If the moment's lift is not planned.
    """
    by_order = {motion.order: motion for motion in motions}
    if moment is None:
        return _finished(site, lifts, by_order, title or site.name)
    lift = next((lift for lift in lifts if lift.order == moment.order), None)
    if lift is None:
        raise InputError(f"there is no lift {moment.order + 1}", hint=f"lifts are numbered 1 to {len(lifts)}")
    if lift.path_vox is None or lift.place is None:
        component = site.components[lift.component]
        why = f"it is infeasible: {lift.reason}" if lift.status is Status.INFEASIBLE else "the log does not carry it"
        raise InputError(
            f"{component.name or component.id}: lift {lift.number} has no path to show; {why}",
            hint="choose a lift that has one",
        )
    motion = by_order.get(lift.order)
    others = None
    if site.has_several_cranes and motion is not None:
        others = _others_at(site, lifts, lift, by_order, _time_ns(motion, moment.share))
    return _under_way(site, lifts, lift, motion, moment.share, title or site.name, others)


def _finished(site: Site, lifts: Sequence[Lift], motions: Mapping[int, LiftMotion], title: str) -> Scene:
    planned = [lift for lift in lifts if lift.status is Status.PLANNED]
    drawn = [lift for lift in planned if lift.path_vox is not None]
    missing = [site.components[lift.component] for lift in lifts if lift.status is Status.INFEASIBLE]
    canvas = site_canvas(site, len(lifts))
    for lift in planned:
        canvas.paint(target_cells(site.components[lift.component]), ASSEMBLED, layer=Layer.ASSEMBLED)
    legend = [*site_legend(site), LegendEntry(f"assembled ({len(planned)})", ASSEMBLED, layer=Layer.ASSEMBLED)]
    strokes: list[Strokes] = []
    few = len(drawn) <= FEW
    shown = drawn if few else drawn[-1:]
    starts = [(lift.place.shape, lift.place.cell_vox) for lift in shown if lift.place is not None]
    strokes.append(boxes_strokes(site, starts, START_BOX, width_px=2.0 if len(starts) < 3 else 1.3))
    strokes.append(boxes_strokes(site, [(part.shape, part.target_vox) for part in missing], TARGET_BOX))
    strokes += [path_strokes(site, lift, motions.get(lift.order), strong=not few) for lift in shown]
    if starts:
        legend.append(LegendEntry("start" if few else "start of the last lift", START_BOX, Swatch.BOX, Layer.BOXES))
    if missing:
        legend.append(LegendEntry(f"target, not placed ({len(missing)})", TARGET_BOX, Swatch.BOX, Layer.BOXES))
    if shown:
        legend.append(LegendEntry("path" if few else "path of the last lift", PATH, Swatch.LINE, Layer.PATHS))
    poses = _poses_at_end([motions[lift.order] for lift in drawn if lift.order in motions])
    crane_time = f", {hours(max(m.end_ns for m in motions.values()))} of crane time" if motions else ""
    caption = f"{len(planned):,} of {counted(len(lifts), 'part')} placed{crane_time}"
    return _scene(site, canvas, strokes, legend, title, caption, poses)


def _under_way(
    site: Site,
    lifts: Sequence[Lift],
    lift: Lift,
    motion: LiftMotion | None,
    share: float,
    title: str,
    moment: _Others | None,
) -> Scene:
    assert lift.place is not None
    component = site.components[lift.component]
    arrived = share >= _ARRIVED
    placed = [other for other in lifts if other.status is Status.PLANNED and other.order < lift.order]
    # A delivery arrives after all lifts of earlier ones, so the yard holds only this lift's delivery.
    stored = [
        other
        for other in lifts
        if other.place is not None
        and other.place.delivery == lift.place.delivery
        and other is not lift
        and other not in placed
    ]
    if moment is not None:
        placed, stored = list(moment.placed), list(moment.stored)
    at, pose = _load_at(site, lift, motion, share)
    canvas = site_canvas(site, len(lifts))
    for other in placed:
        canvas.paint(target_cells(site.components[other.component]), ASSEMBLED, layer=Layer.ASSEMBLED)
    for other in stored:
        assert other.place is not None
        canvas.paint(other.place.shape.cells + np.array(other.place.cell_vox), UNBUILT, layer=Layer.UNBUILT)
    for other, cell in moment.carried if moment is not None else ():
        canvas.paint(site.components[other.component].shape.cells + np.array(cell), IN_TRANSIT, over=True)
    state_rgb, state = (ARRIVED, "arrived") if arrived else (IN_TRANSIT, "in transit")
    canvas.paint(component.shape.cells + np.array(at), state_rgb, over=True)
    strokes = [
        boxes_strokes(site, [(lift.place.shape, lift.place.cell_vox)], START_BOX),
        boxes_strokes(site, [(component.shape, component.target_vox)], TARGET_BOX),
        path_strokes(site, lift, motion, strong=True),
    ]
    legend = site_legend(site)
    if stored:
        legend.append(LegendEntry(f"unbuilt ({len(stored)})", UNBUILT, layer=Layer.UNBUILT))
    legend.append(LegendEntry(state, state_rgb))
    if placed:
        legend.append(LegendEntry(f"assembled ({len(placed)})", ASSEMBLED, layer=Layer.ASSEMBLED))
    legend += [
        LegendEntry("start", START_BOX, Swatch.BOX, Layer.BOXES),
        LegendEntry("target", TARGET_BOX, Swatch.BOX, Layer.BOXES),
        LegendEntry("path", PATH, Swatch.LINE, Layer.PATHS),
    ]
    name = f" {component.name}" if component.name and component.name != component.id else ""
    at_clock = f", at {clock(_time_ns(motion, share))}" if motion else ""
    caption = (
        f"Lift {lift.number:,} of {len(lifts):,}{at_clock}: {component.ifc_class}{name}, {component.id}, "
        f"{component.mass_kg / 1000.0:.2f} t"
    )
    poses: dict[int, CranePose | None] = {} if moment is None else {**moment.poses}
    loads_m: dict[int, NDArray[np.float64] | None] = {} if moment is None else {**moment.loads_m}
    if pose is not None:
        poses[component.crane], loads_m[component.crane] = pose, top_corners_m(site, component, at)
    return _scene(site, canvas, strokes, legend, title, caption, poses, loads_m)


@dataclass(frozen=True, slots=True, eq=False)
class _Others:
    """The other lifts at a moment, if lifts of several cranes overlap.

    Attributes:
        placed: Lifts whose part is in place.
        stored: Lifts whose part lies in the yard.
        carried: Lifts whose part hangs on another crane, and its cell.
        poses: Poses of all cranes, by the crane's index.
        loads_m: Lifting points of the other loads, by the crane's index.
    """

    placed: tuple[Lift, ...]
    stored: tuple[Lift, ...]
    carried: tuple[tuple[Lift, IntVec], ...]
    poses: Mapping[int, CranePose]
    loads_m: Mapping[int, NDArray[np.float64]]


def _others_at(
    site: Site, lifts: Sequence[Lift], lift: Lift, motions: Mapping[int, LiftMotion], time_ns: int
) -> _Others:
    placed, stored, carried = [], [], []
    loads_m: dict[int, NDArray[np.float64]] = {}
    for other in lifts:
        motion = motions.get(other.order)
        if other is lift or other.place is None:
            continue
        if motion is None:
            there = lift.place is not None and other.place.delivery == lift.place.delivery
            if other.status is Status.PLANNED and other.order < lift.order:
                placed.append(other)
            elif there:
                stored.append(other)
        elif time_ns >= motion.set_ns:
            placed.append(other)
        elif time_ns >= motion.start_ns + int(motion.loaded.time_ns[0]):
            loaded = motion.loaded
            share = (time_ns - motion.start_ns - int(loaded.time_ns[0])) / max(
                int(loaded.time_ns[-1] - loaded.time_ns[0]), 1
            )
            at, _ = _load_at(site, other, motion, share)
            carried.append((other, at))
            loads_m[motion.crane] = top_corners_m(site, site.components[other.component], at)
        elif lift.place is not None and other.place.delivery == lift.place.delivery:
            stored.append(other)
    poses = poses_at(site, list(motions.values()), time_ns)
    return _Others(tuple(placed), tuple(stored), tuple(carried), poses, loads_m)


def path_m(site: Site, lift: Lift, motion: LiftMotion | None) -> NDArray[np.float64]:
    """Return the path of a part's centre, (N, 3) metres: as the crane drives it, or from cell to cell without one."""
    component = site.components[lift.component]
    middle = np.array(component.shape.size_vox) / 2.0
    if motion is not None and site.cranes:
        loaded, crane = motion.loaded, site.cranes[motion.crane]
        axes = np.stack([loaded.slew_rad, loaded.radius_m, loaded.height_m], axis=1)
        cells = cells_of_axes(
            load_frame(crane_for(site, crane, component), site.frame, component.hook_offset_vox), axes
        )
    else:
        assert lift.path_vox is not None
        cells = lift.path_vox.astype(np.float64)
    way: NDArray[np.float64] = site.frame.corner_of(cells + middle)
    return way


def path_strokes(site: Site, lift: Lift, motion: LiftMotion | None, *, strong: bool) -> Strokes:
    """Return the path of a part as a line."""
    return Strokes(
        polyline(path_m(site, lift, motion)),
        PATH,
        width_px=3.2 if strong else 2.0,
        opacity=0.95 if strong else 0.75,
        hidden_opacity=0.55 if strong else 0.35,
        edge=(255, 255, 255) if strong else None,
        layer=Layer.PATHS,
    )


def _load_at(site: Site, lift: Lift, motion: LiftMotion | None, share: float) -> tuple[IntVec, CranePose | None]:
    """Return the load's cell at a share of its carrying time, and the crane's pose."""
    component = site.components[lift.component]
    assert lift.path_vox is not None
    share = min(max(share, 0.0), 1.0)
    if motion is None or not site.cranes:
        x, y, z = (int(n) for n in lift.path_vox[round(share * (len(lift.path_vox) - 1))])
        return (x, y, z), None
    loaded = motion.loaded
    time = loaded.time_ns[0] + share * float(loaded.time_ns[-1] - loaded.time_ns[0])
    slew, radius, height = (
        float(np.interp(time, loaded.time_ns, axis)) for axis in (loaded.slew_rad, loaded.radius_m, loaded.height_m)
    )
    crane = site.cranes[motion.crane]
    load = load_frame(crane_for(site, crane, component), site.frame, component.hook_offset_vox)
    x, y, z = (round(float(n)) for n in cells_of_axes(load, np.array([slew, radius, height])))
    return (x, y, z), CranePose(slew, radius, height)


def _time_ns(motion: LiftMotion, share: float) -> int:
    loaded = motion.loaded
    length_ns = int(loaded.time_ns[-1] - loaded.time_ns[0])
    return motion.start_ns + int(loaded.time_ns[0]) + round(min(max(share, 0.0), 1.0) * length_ns)


def _poses_at_end(motions: Sequence[LiftMotion]) -> dict[int, CranePose | None]:
    """Return the pose in which every crane has set its last part."""
    poses: dict[int, CranePose | None] = {}
    for motion in motions:
        loaded = motion.loaded
        poses[motion.crane] = CranePose(
            float(loaded.slew_rad[-1]), float(loaded.radius_m[-1]), float(loaded.height_m[-1])
        )
    return poses


def top_corners_m(site: Site, component: Component, at: IntVec) -> NDArray[np.float64]:
    """Return where the slings are attached: the corners of the load's top, (4, 3) metres."""
    x, y, z = component.shape.size_vox
    inset_x, inset_y = min(0.5, 0.1 * x), min(0.5, 0.1 * y)
    corners = [(a, b, z) for a in (inset_x, x - inset_x) for b in (inset_y, y - inset_y)]
    tops: NDArray[np.float64] = site.frame.corner_of(np.array(at) + np.array(corners))
    return tops


def _scene(
    site: Site,
    canvas: Canvas,
    strokes: Sequence[Strokes],
    legend: list[LegendEntry],
    title: str,
    caption: str,
    poses: Mapping[int, CranePose | None],
    loads_m: Mapping[int, NDArray[np.float64] | None] | None = None,
) -> Scene:
    parts = site_cranes(site, poses, loads_m)
    return Scene(
        frame=site.frame,
        solids=canvas.solids,
        palette=canvas.palette,
        strokes=(*parts.strokes, *strokes),
        blocks=parts.blocks,
        legend=tuple(legend),
        title=title,
        caption=caption,
        points_m=parts.points_m,
        layers=canvas.layers,
    )
