"""The site at any time of a plan: assembled and stored parts, crane and load."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from bimvox.crane.tower_crane import CranePose
from bimvox.errors import InputError
from bimvox.records.lift import Lift
from bimvox.records.motion import LiftMotion
from bimvox.records.track import LoadTrack
from bimvox.rendering.colours import ARRIVED, ASSEMBLED, IN_TRANSIT, START_BOX, TARGET_BOX, UNBUILT
from bimvox.rendering.pictures.cranes import poses_at, site_cranes
from bimvox.rendering.pictures.plan import LIFT_LEGEND, held_m, no_path_error, path_strokes, top_corners_m
from bimvox.rendering.pictures.scene import Block, Canvas, Layer, LegendEntry, Scene
from bimvox.rendering.pictures.site import (
    boxes_strokes,
    painted_scene,
    site_canvas,
    site_legend,
    stored_cells,
    target_cells,
)
from bimvox.rendering.words import PHASES
from bimvox.site.component import Component
from bimvox.site.site import Site
from bimvox.units import clock

_UPRIGHT = 0.999
"""Cosine of half the rotation from which on a part counts as upright and is drawn on the cells."""


class Film:
    """The scenes of a plan over time; unchanging parts are painted once per lift.

    Args:
        site: The planned site.
        lifts: All its lifts, in ascending order.
        motions: Motions of the planned ones; none without a crane.
        tracks: Tracks of their loads.

    Raises:
        InputError: If no lift has a time.
    """

    def __init__(
        self, site: Site, lifts: Sequence[Lift], motions: Sequence[LiftMotion], tracks: Sequence[LoadTrack]
    ) -> None:
        if not tracks:
            raise InputError("no lift of the plan has a time", hint="leave the time out to see the site as it is")
        self.site, self.lifts = site, tuple(lifts)
        self.tracks = tuple(sorted(tracks, key=lambda track: track.start_ns))
        self.motions = {motion.order: motion for motion in motions}
        self._base: tuple[tuple[int, frozenset[int]], Canvas] | None = None

    @property
    def start_ns(self) -> int:
        """When the first lift begins."""
        return self.tracks[0].start_ns

    @property
    def end_ns(self) -> int:
        """When the last one ends."""
        return max(track.end_ns for track in self.tracks)

    def track_at(self, time_ns: int) -> LoadTrack:
        """Return the lift under way at a time: the last one that has begun, or the first one.

        With several cranes, a lift with its load on the hook takes precedence.
        """
        now = self.tracks_at(time_ns)
        return next((track for track in now if track.lifted_ns <= time_ns < track.assembled_ns), now[-1])

    def tracks_at(self, time_ns: int) -> list[LoadTrack]:
        """Return the lift under way of every crane, ordered by start."""
        latest: dict[int, LoadTrack] = {}
        for track in self.tracks:
            number = self.site.components[track.lift.component].crane if self.site.moving is None else 0
            if track.start_ns <= time_ns or number not in latest:
                latest[number] = track
        return sorted(latest.values(), key=lambda track: track.start_ns)

    def track_of(self, order: int) -> LoadTrack:
        """Return the track of the lift of an order.

        Raises:
            InputError: If it has no time: it is infeasible, or the log does not carry it.
        """
        track = next((track for track in self.tracks if track.lift.order == order), None)
        if track is None:
            raise no_path_error(self.site, order, next((lift for lift in self.lifts if lift.order == order), None))
        return track

    def scene(self, time_ns: int) -> Scene:
        """Return the site at a time on its clock."""
        track = self.track_at(time_ns)
        lift = track.lift
        component = self.site.components[lift.component]
        motion = self.motions.get(lift.order)
        now = self.tracks_at(time_ns)
        canvas = self._before(lift, now, time_ns).copy(more=2 * len(now))
        blocks: list[Block] = []
        loads_m: dict[int, NDArray[np.float64] | None] = {}
        for own in now:
            turned, load_m = self._paint_part(canvas, own, time_ns)
            blocks += turned
            if load_m is not None and own.lifted_ns <= time_ns < own.assembled_ns:
                loads_m |= held_m(self.site, self.site.components[own.lift.component], load_m)
        parts = site_cranes(self.site, self.poses(time_ns), loads_m)
        assert lift.place is not None
        strokes = [
            boxes_strokes(self.site, [(lift.place.shape, lift.place.cell_vox)], START_BOX),
            boxes_strokes(self.site, [(component.shape, component.target_vox)], TARGET_BOX),
            path_strokes(self.site, lift, motion, strong=True),
        ]
        caption = self._caption(track, component, motion, time_ns)
        return painted_scene(self.site, canvas, parts, strokes, self._legend(), self.site.name, caption, blocks)

    def whole(self, times_ns: Sequence[int]) -> Scene:
        """Return a scene with everything visible at any of these times, for a fixed camera."""
        canvas = site_canvas(self.site, 2 * len(self.lifts))
        for track in self.tracks:
            canvas.paint(target_cells(self.site.components[track.lift.component]), ASSEMBLED)
            if track.lift.place is not None:
                canvas.paint(stored_cells(track.lift), UNBUILT)
        posed = [poses for time_ns in times_ns if (poses := self.poses(time_ns))]
        seen = np.concatenate([np.zeros((0, 3)), *(site_cranes(self.site, poses).points_m for poses in posed)])
        scene = self.scene(times_ns[0])
        return replace(scene, solids=canvas.solids, palette=canvas.palette, layers=canvas.layers, points_m=seen)

    def poses(self, time_ns: int) -> dict[int, CranePose]:
        """Return every crane's pose, by its index; empty without motions."""
        now = (self.motions.get(track.lift.order) for track in self.tracks_at(time_ns))
        return poses_at(self.site, [motion for motion in now if motion is not None], time_ns)

    def _before(self, lift: Lift, now: Sequence[LoadTrack], time_ns: int) -> Canvas:
        """Return the assembled and stored parts during a lift, without the parts of the lifts under way."""
        under_way = frozenset(track.lift.order for track in now)
        key = (lift.order, under_way)
        if self._base is not None and self._base[0] == key:
            return self._base[1]
        canvas = site_canvas(self.site, 2 * len(self.lifts))
        # With several cranes, an earlier lift in the order may not have begun.
        to_come = frozenset(track.lift.order for track in self.tracks if track.start_ns > time_ns)
        done = frozenset(track.lift.order for track in self.tracks if track.start_ns <= time_ns) - under_way
        for other in self.lifts:
            if other is not lift and other.order in under_way:
                continue
            if other.order in done or (other.is_set and other.order < lift.order and other.order not in to_come):
                canvas.paint(target_cells(self.site.components[other.component]), ASSEMBLED, layer=Layer.ASSEMBLED)
            # A delivery arrives after all lifts of earlier ones.
            elif other is not lift and other.in_yard and lift.place and other.in_yard.delivery == lift.place.delivery:
                canvas.paint(stored_cells(other), UNBUILT, layer=Layer.UNBUILT)
        self._base = (key, canvas)
        return canvas

    def _paint_part(
        self, canvas: Canvas, track: LoadTrack, time_ns: int
    ) -> tuple[list[Block], NDArray[np.float64] | None]:
        """Paint the part under way, or return rotated boxes while it is tipped up; also return its top corners."""
        site, lift = self.site, track.lift
        component = site.components[lift.component]
        if time_ns >= track.assembled_ns:
            canvas.paint(target_cells(component), ASSEMBLED, over=True, layer=Layer.ASSEMBLED)
            return [], None
        if time_ns < track.lifted_ns:
            canvas.paint(stored_cells(lift), UNBUILT, over=True, layer=Layer.UNBUILT)
            return [], None
        rgb = ARRIVED if time_ns >= track.arrived_ns else IN_TRANSIT
        corner_m = np.array([np.interp(time_ns, track.time_ns, track.corner_m[:, n]) for n in range(3)])
        turn = np.array([np.interp(time_ns, track.time_ns, track.tilt[:, n]) for n in range(4)])
        turn /= np.linalg.norm(turn)
        if abs(turn[3]) >= _UPRIGHT:
            size_m = site.frame.voxel_size_m
            x, y, z = (int(n) for n in np.rint((corner_m - site.frame.corner_of((0, 0, 0))) / size_m))
            canvas.paint(component.shape.cells + np.array((x, y, z)), rgb, over=True)
            return [], top_corners_m(site, component, (x, y, z))
        blocks = _turned_boxes(component, corner_m, turn, site.frame.voxel_size_m, rgb)
        far = top_corners_m(site, component, (0, 0, 0)) - site.frame.corner_of((0, 0, 0))
        return blocks, corner_m + far @ rotation(turn).T

    def _legend(self) -> list[LegendEntry]:
        """Return the legend, which is the same in every frame: all states of the paper."""
        return [
            *site_legend(self.site),
            LegendEntry("unbuilt", UNBUILT, layer=Layer.UNBUILT),
            LegendEntry("in transit", IN_TRANSIT),
            LegendEntry("arrived", ARRIVED),
            LegendEntry("assembled", ASSEMBLED, layer=Layer.ASSEMBLED),
            *LIFT_LEGEND,
        ]

    def _caption(self, track: LoadTrack, component: Component, motion: LiftMotion | None, time_ns: int) -> str:
        lift = track.lift
        phase = ""
        if motion is not None and time_ns < track.end_ns:
            phase = f", {PHASES[motion.phase_at(time_ns).name.value]}"
        name = component.name or component.id
        order = f"lift {lift.number:,} of {len(self.lifts):,}"
        return f"{clock(time_ns / 1e9)}  {order}: {name}, {component.mass_kg / 1000.0:.2f} t{phase}"


def rotation(quaternion: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the (3, 3) rotation of a unit quaternion x, y, z, w."""
    x, y, z, w = quaternion
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )


def _turned_boxes(
    component: Component,
    corner_m: NDArray[np.float64],
    quaternion: NDArray[np.float64],
    voxel_size_m: float,
    rgb: tuple[int, int, int],
) -> list[Block]:
    """Return a part as boxes, rotated by a quaternion x, y, z, w about its lowest corner, (3,) metres."""
    turn = rotation(quaternion)
    boxes = component.shape.boxes.astype(np.float64) * voxel_size_m
    middles, halves = (boxes[:, :3] + boxes[:, 3:]) / 2.0, (boxes[:, 3:] - boxes[:, :3]) / 2.0
    return [Block(corner_m + turn @ middle, (turn * half).T, rgb) for middle, half in zip(middles, halves, strict=True)]
