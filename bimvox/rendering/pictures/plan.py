"""The picture of a plan: the finished building with the paths of its parts, or one lift in transit."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from bimvox.crane.tower_crane import CranePose
from bimvox.errors import InputError
from bimvox.motion.swept import cells_of_axes, load_frame
from bimvox.records.lift import NOT_LIFTED, Lift, Status
from bimvox.records.motion import LiftMotion
from bimvox.records.props import Standing
from bimvox.records.track import headings_off_rad
from bimvox.rendering import colours
from bimvox.rendering.pictures.cranes import poses_at, site_cranes
from bimvox.rendering.pictures.scene import Layer, LegendEntry, Scene, Strokes, Swatch, polyline
from bimvox.rendering.pictures.site import (
    boxes_strokes,
    painted_scene,
    site_canvas,
    site_legend,
    stored_cells,
    target_cells,
)
from bimvox.rendering.words import counted, hours
from bimvox.site.component import Component, IntVec, turned_cells
from bimvox.site.lifting import crane_for
from bimvox.site.site import Site
from bimvox.site.tandem import part_on
from bimvox.units import clock

FEW = 12
"""All paths are drawn up to this number; more would be unreadable."""
_ARRIVED = 1.0
LIFT_LEGEND = (
    LegendEntry("start", colours.START_BOX, Swatch.BOX, Layer.BOXES),
    LegendEntry("target", colours.TARGET_BOX, Swatch.BOX, Layer.BOXES),
    LegendEntry("path", colours.PATH, Swatch.LINE, Layer.PATHS),
)
"""Legend of the boxes and the path of a lift under way."""


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
    props: Sequence[Standing] = (),
) -> Scene:
    """Return the picture of a plan.

    Args:
        site: The planned site.
        lifts: Its lifts, in ascending order. Of planned lifts without a path (not carried by an extract), only the part
            is shown.
        motions: The motions of the planned ones; none without a crane.
        moment: The lift to show under way; None for the finished building.
        props: Props of its parts; those that stand then are drawn.

    Raises:
        InputError: If the moment's lift is not planned.
    """
    by_order = {motion.order: motion for motion in motions}
    if moment is None:
        return _with_props(_finished(site, lifts, by_order), [one for one in props if one.until_ns is None])
    lift = next((lift for lift in lifts if lift.order == moment.order), None)
    if lift is None:
        raise InputError(f"there is no lift {moment.order + 1}", hint=f"lifts are numbered 1 to {len(lifts)}")
    if lift.path_vox is None or lift.place is None:
        raise no_path_error(site, moment.order, lift)
    motion = by_order.get(lift.order)
    overlap = site.has_several_cranes and motion is not None
    time_ns = 0 if motion is None else _time_ns(motion, moment.share)
    others = _others_at(site, lifts, lift, by_order if overlap else {}, time_ns)
    now_ns = None if motion is None else _time_ns(motion, moment.share)
    stand = [one for one in props if now_ns is not None and one.stands_at(now_ns)]
    return _with_props(_under_way(site, lifts, lift, motion, moment.share, others), stand)


def _with_props(scene: Scene, props: Sequence[Standing]) -> Scene:
    """Return a scene with props."""
    ends_m = [[prop.head_m, prop.foot_m] for one in props for prop in one.held.props]
    if not ends_m:
        return scene
    strokes = Strokes(np.array(ends_m), colours.PROP, width_px=1.6, width_m=0.08, layer=Layer.ASSEMBLED)
    entry = LegendEntry(f"prop ({len(ends_m)})", colours.PROP, Swatch.LINE, Layer.ASSEMBLED)
    return replace(scene, strokes=(*scene.strokes, strokes), legend=(*scene.legend, entry))


_OTHERWISE = {
    Status.IN_SITU: ("cast in place", colours.CAST_IN_PLACE),
    Status.BUILT: ("built in place", colours.BUILT_IN_PLACE),
    Status.BY_HAND: ("set by hand", colours.SET_BY_HAND),
    Status.INFEASIBLE: ("set by other means", colours.OTHER_MEANS),
}


def no_path_error(site: Site, order: int, lift: Lift | None) -> InputError:
    """Return the error for the lift of an order that has no path; None if the plan has no such lift."""
    component = site.components[lift.component] if lift else None
    part = f"{component.name or component.id}: " if component else ""
    why = f"it is infeasible: {lift.reason}" if lift and lift.reason else "the log does not carry it"
    return InputError(f"{part}lift {order + 1} has no path to show; {why}", hint="choose a lift that has one")


def _finished(site: Site, lifts: Sequence[Lift], motions: Mapping[int, LiftMotion]) -> Scene:
    planned = [lift for lift in lifts if lift.status is Status.PLANNED]
    drawn = [lift for lift in planned if lift.path_vox is not None]
    missing = [site.components[lift.component] for lift in lifts if not lift.is_set]
    canvas = site_canvas(site, len(lifts))
    for lift in planned:
        canvas.paint(target_cells(site.components[lift.component]), colours.ASSEMBLED, layer=Layer.ASSEMBLED)
    legend = [*site_legend(site), LegendEntry(f"assembled ({len(planned)})", colours.ASSEMBLED, layer=Layer.ASSEMBLED)]
    for status, (words, colour) in _OTHERWISE.items():
        otherwise = [lift for lift in lifts if lift.status is status and lift.is_set]
        for lift in otherwise:
            canvas.paint(target_cells(site.components[lift.component]), colour, layer=Layer.ASSEMBLED)
        if otherwise:
            legend.append(LegendEntry(f"{words} ({len(otherwise)})", colour, layer=Layer.ASSEMBLED))
    few = len(drawn) <= FEW
    shown = drawn if few else drawn[-1:]
    starts = [(lift.place.shape, lift.place.cell_vox) for lift in shown if lift.place is not None]
    strokes = [
        boxes_strokes(site, starts, colours.START_BOX, width_px=2.0 if len(starts) < 3 else 1.3),
        boxes_strokes(site, [(part.shape, part.target_vox) for part in missing], colours.TARGET_BOX),
        *(path_strokes(site, lift, motions.get(lift.order), strong=not few) for lift in shown),
    ]
    if starts:
        legend.append(
            LegendEntry("start" if few else "start of the last lift", colours.START_BOX, Swatch.BOX, Layer.BOXES)
        )
    if missing:
        legend.append(LegendEntry(f"target, not placed ({len(missing)})", colours.TARGET_BOX, Swatch.BOX, Layer.BOXES))
    if shown:
        legend.append(LegendEntry("path" if few else "path of the last lift", colours.PATH, Swatch.LINE, Layer.PATHS))
    # Every crane has just set its last part.
    ends = {motions[lift.order].crane: motions[lift.order].loaded for lift in drawn if lift.order in motions}
    if site.moving is not None and drawn:  # it stands where its last lift ends
        ends = {crane: ends[crane] for crane in [site.components[drawn[-1].component].crane] if crane in ends}
    poses = {crane: CranePose(*loaded.axes[-1].tolist()) for crane, loaded in ends.items()}
    crane_time = f", {hours(max(m.end_ns for m in motions.values()))} of crane time" if motions else ""
    wanted = sum(lift.status not in NOT_LIFTED for lift in lifts)
    caption = f"{len(planned):,} of {counted(wanted, 'part')} placed{crane_time}"
    return painted_scene(site, canvas, site_cranes(site, poses), strokes, legend, site.name, caption)


def _under_way(
    site: Site, lifts: Sequence[Lift], lift: Lift, motion: LiftMotion | None, share: float, others: _Others
) -> Scene:
    assert lift.place is not None
    component = site.components[lift.component]
    at, pose = _load_at(site, lift, motion, share)
    canvas = site_canvas(site, len(lifts))
    for other in others.placed:
        canvas.paint(target_cells(site.components[other.component]), colours.ASSEMBLED, layer=Layer.ASSEMBLED)
    for other in others.stored:
        canvas.paint(stored_cells(other), colours.UNBUILT, layer=Layer.UNBUILT)
    for other, cell in others.carried:
        canvas.paint(site.components[other.component].shape.cells + np.array(cell), colours.IN_TRANSIT, over=True)
    state_rgb, state = (colours.ARRIVED, "arrived") if share >= _ARRIVED else (colours.IN_TRANSIT, "in transit")
    canvas.paint(_load_cells(component, lift, motion, share) + np.array(at), state_rgb, over=True)
    strokes = [
        boxes_strokes(site, [(lift.place.shape, lift.place.cell_vox)], colours.START_BOX),
        boxes_strokes(site, [(component.shape, component.target_vox)], colours.TARGET_BOX),
        path_strokes(site, lift, motion, strong=True),
    ]
    stored, placed = len(others.stored), len(others.placed)
    legend = [
        *site_legend(site),
        *([LegendEntry(f"unbuilt ({stored})", colours.UNBUILT, layer=Layer.UNBUILT)] if stored else []),
        LegendEntry(state, state_rgb),
        *([LegendEntry(f"assembled ({placed})", colours.ASSEMBLED, layer=Layer.ASSEMBLED)] if placed else []),
        *LIFT_LEGEND,
    ]
    name = f" {component.name}" if component.name and component.name != component.id else ""
    at_clock = f", at {clock(_time_ns(motion, share) / 1e9)}" if motion else ""
    caption = (
        f"Lift {lift.number:,} of {len(lifts):,}{at_clock}: {component.ifc_class}{name}, {component.id}, "
        f"{component.mass_kg / 1000.0:.2f} t"
    )
    poses, loads_m = dict(others.poses), dict(others.loads_m)
    if pose is not None:
        poses[component.crane] = pose
        loads_m |= held_m(site, component, top_corners_m(site, component, at))
    return painted_scene(site, canvas, site_cranes(site, poses, loads_m), strokes, legend, site.name, caption)


@dataclass(frozen=True, slots=True, eq=False)
class _Others:
    """The other lifts at a moment; with several cranes, lifts overlap.

    Attributes:
        poses: Poses of all cranes, by the crane's index.
        placed: Lifts whose part is in place.
        stored: Lifts whose part lies in the yard.
        carried: Lifts whose part hangs on another crane, and its cell.
        loads_m: Lifting points of the other loads, by the crane's index.
    """

    poses: Mapping[int, CranePose]
    placed: list[Lift] = field(default_factory=list)
    stored: list[Lift] = field(default_factory=list)
    carried: list[tuple[Lift, IntVec]] = field(default_factory=list)
    loads_m: dict[int, NDArray[np.float64]] = field(default_factory=dict)


def _others_at(
    site: Site, lifts: Sequence[Lift], lift: Lift, motions: Mapping[int, LiftMotion], time_ns: int
) -> _Others:
    """Return the other lifts at a time; without its motion, an earlier lift counts as placed."""
    result = _Others(poses_at(site, list(motions.values()), time_ns))
    for other in lifts:
        motion = motions.get(other.order)
        if other is lift:
            continue
        start_ns, set_ns = (0, 0) if motion is None else _transit_ns(motion)
        is_earlier = other.status is Status.PLANNED and other.order < lift.order
        if is_earlier if motion is None else time_ns >= set_ns:
            result.placed.append(other)
        elif motion is not None and time_ns >= start_ns:
            at, _ = _load_at(site, other, motion, (time_ns - start_ns) / max(set_ns - start_ns, 1))
            result.carried.append((other, at))
            part = site.components[other.component]
            result.loads_m.update(held_m(site, part, top_corners_m(site, part, at)))
        # A delivery arrives after all lifts of earlier ones, so the yard holds only this lift's delivery.
        elif other.in_yard and lift.place and other.in_yard.delivery == lift.place.delivery:
            result.stored.append(other)
    return result


def path_m(site: Site, lift: Lift, motion: LiftMotion | None) -> NDArray[np.float64]:
    """Return the path of a part's centre, (N, 3) metres: as the crane drives it, or from cell to cell without one."""
    component = site.components[lift.component]
    middle = np.array(component.shape.size_vox) / 2.0
    if motion is not None and site.cranes:
        loaded, crane = motion.loaded, site.cranes[motion.crane]
        half = part_on(site, lift.component, motion.crane)
        load = load_frame(crane_for(site, crane, half), site.frame, half.hook_line_vox)
        cells = cells_of_axes(load, loaded.axes)
    else:
        assert lift.path_vox is not None
        cells = lift.path_vox.astype(np.float64)
    way: NDArray[np.float64] = site.frame.corner_of(cells + middle)
    return way


def path_strokes(site: Site, lift: Lift, motion: LiftMotion | None, *, strong: bool) -> Strokes:
    """Return the path of a part as a line."""
    return Strokes(
        polyline(path_m(site, lift, motion)),
        colours.PATH,
        width_px=3.2 if strong else 2.0,
        opacity=0.95 if strong else 0.75,
        hidden_opacity=0.55 if strong else 0.35,
        edge=(255, 255, 255) if strong else None,
        layer=Layer.PATHS,
    )


def _load_at(site: Site, lift: Lift, motion: LiftMotion | None, share: float) -> tuple[IntVec, CranePose | None]:
    """Return the load's cell at a share of its carrying time, and the crane's pose."""
    assert lift.path_vox is not None
    share = min(max(share, 0.0), 1.0)
    if motion is None or not site.cranes:
        x, y, z = (int(n) for n in lift.path_vox[round(share * (len(lift.path_vox) - 1))])
        return (x, y, z), None
    loaded = motion.loaded
    time = loaded.time_ns[0] + share * float(loaded.time_ns[-1] - loaded.time_ns[0])
    axes = np.array([np.interp(time, loaded.time_ns, axis) for axis in loaded.axes.T])
    half = part_on(site, lift.component, motion.crane)
    load = load_frame(crane_for(site, site.cranes[motion.crane], half), site.frame, half.hook_line_vox)
    x, y, z = (round(float(n)) for n in cells_of_axes(load, axes))
    return (x, y, z), CranePose(*axes.tolist())


def _load_cells(component: Component, lift: Lift, motion: LiftMotion | None, share: float) -> NDArray[np.int32]:
    """Return the load's cells relative to its reference cell, turned as it hangs at a share of its carrying time."""
    if motion is None or not lift.ever_with_jib:
        return component.shape.cells
    time_ns = np.array([_time_ns(motion, share)])
    slew_rad = np.interp(time_ns - motion.start_ns, motion.loaded.time_ns, motion.loaded.slew_rad)
    return turned_cells(component, float(headings_off_rad(motion, time_ns, slew_rad)[0]))


def _transit_ns(motion: LiftMotion) -> tuple[int, int]:
    """Return when the load leaves the yard, and when it is at its place."""
    return motion.start_ns + int(motion.loaded.time_ns[0]), motion.set_ns


def _time_ns(motion: LiftMotion, share: float) -> int:
    start_ns, set_ns = _transit_ns(motion)
    return start_ns + round(min(max(share, 0.0), 1.0) * (set_ns - start_ns))


def held_m(site: Site, component: Component, corners_m: NDArray[np.float64]) -> dict[int, NDArray[np.float64]]:
    """Return where the slings of each crane that carries a part are attached, by the crane's index.

    ``corners_m``: its top where it hangs, as ``top_corners_m``. Two cranes hold it at one point each.
    """
    if component.tandem is None:
        return {component.crane: corners_m}
    moved = corners_m[0] - top_corners_m(site, component, component.target_vox)[0]
    points_m = (np.array([point]) + moved for point in component.tandem.points_m)
    return dict(zip((component.crane, component.tandem.second), points_m, strict=True))


def top_corners_m(site: Site, component: Component, at: IntVec) -> NDArray[np.float64]:
    """Return where the slings are attached: the corners of the load's top, (4, 3) metres."""
    x, y, z = component.shape.size_vox
    inset_x, inset_y = min(0.5, 0.1 * x), min(0.5, 0.1 * y)
    corners = [(a, b, z) for a in (inset_x, x - inset_x) for b in (inset_y, y - inset_y)]
    tops: NDArray[np.float64] = site.frame.corner_of(np.array(at) + np.array(corners))
    return tops
