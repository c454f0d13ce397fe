"""The proof that the empty hook and the jib meet nothing."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from bimvox.crane.tower_crane import TowerCrane
from bimvox.planning.moment import NO_SOLID, Moment, Thing, near_and_far
from bimvox.planning.proof import Check
from bimvox.planning.triangle_check import TriangleCheck
from bimvox.site.component import Component
from bimvox.site.lifting import crane_for
from bimvox.site.site import CRANE_ID, Site
from bimvox.trajectory.motion import LiftMotion
from bimvox.trajectory.trajectory import Trajectory
from bimvox.trajectory.verify_axes import axes_of_samples
from bimvox.trajectory.verify_jib import check_luffing_jib
from bimvox.trajectory.verify_load import check_zone, things_over
from bimvox.trajectory.verify_space import (
    ALWAYS_NS,
    RawCells,
    placements_around,
    reference_cells,
    way_of,
    within,
)

_SLINGS_END = (0, 0, 0)


class HookProof:
    """Looks at one lift after the other.

    Args:
        site: The site.
        crane: Its crane.
        triangles: The test of real triangles.
        cells: What stands where now; moved on by the caller.
        checks: ``empty_hook``, ``zones`` and ``jib``.
        window_ns: Positions outside this span of the site's clock are not looked at.
    """

    def __init__(
        self,
        site: Site,
        crane: TowerCrane,
        triangles: TriangleCheck,
        cells: RawCells,
        checks: Mapping[str, Check],
        window_ns: tuple[int, int] = ALWAYS_NS,
    ) -> None:
        self.window_ns, self.start_ns = window_ns, 0
        self.site, self.crane, self.triangles, self.cells, self.checks = site, crane, triangles, cells, checks

    def check(self, name: str, moment: Moment, motion: LiftMotion) -> None:
        """Check the approach of a lift, and the jib over all of it."""
        self.start_ns = motion.start_ns
        if motion.approach is not None and moment.before is not None:
            self._check_approach(name, moment, motion.approach, self.site.components[moment.before.component])
        time_ns, axes = motion.samples()
        first, last = np.searchsorted(time_ns, self.window_ns)
        seen = slice(max(int(first) - 1, 0), int(last) + 1)
        jib = self.crane.luffing
        if jib is None:
            self._check_jib(name, moment.present, axes[seen])
            return
        component = self.site.components[moment.lift.component]
        crane = crane_for(self.site, self.crane, component)
        loaded_ns = motion.start_ns + int(motion.loaded.time_ns[0])
        load = (component, axes[seen][time_ns[seen] >= loaded_ns])
        check_luffing_jib(self.checks["jib"], name, self.site, crane, jib, moment.present, axes[seen], load)

    def _check_approach(self, name: str, moment: Moment, approach: Trajectory, left: Component) -> None:
        """A cell at the slings' end and the line above it are free, the next part in the yard included.

        On the way out of a set point the line may run through cells of what touches the part just set, where it misses
        the real triangles.
        """
        check, frame, place = self.checks["empty_hook"], self.site.frame, moment.lift.place
        way = way_of(self.crane, axes_of_samples(approach), frame.voxel_size_m)
        cells = reference_cells(self.crane, frame, way.axes, _SLINGS_END)
        placements = placements_around(cells, way.slack_vox)
        time_s = approach.time_ns[way.sample] / 1e9
        check_zone(self.checks["zones"], f"{name}, approach", self.site, placements, None, cells, time_s)
        if not self.site.rules.rope:
            return
        present = list(moment.present)
        if place is not None:
            own = place.shape.cells + np.array(place.cell_vox, np.int32)
            present.append(Thing(self.site.components[moment.lift.component].id, own, NO_SOLID))
            self.cells.move_to(present)
        hit = placements.at_positions(self.cells.over(placements, _SLINGS_END))
        check.look(True, "", samples=len(cells))
        leaving = np.logical_and.accumulate(hit)
        bad = hit & ~leaving
        if leaving.any():
            near, _ = near_and_far(left, present)
            bad |= leaving & placements.at_positions(self.cells.without(near).over(placements, _SLINGS_END))
            set_at = np.array(left.target_vox) + np.array(left.hook_offset_vox)
            for n in np.flatnonzero(leaving & ~bad).tolist():
                offset_m = (cells[n] - set_at) * frame.voxel_size_m
                bad[n] = not all(self.triangles.rope_is_clear(left, offset_m, thing.solid) for thing in near)
        bad &= within(approach, way, self.start_ns, self.window_ns)
        if bad.any():
            n = int(np.argmax(bad))
            met = ", ".join(things_over(present, placements, n, np.zeros(3, np.int64)))
            if leaving[n]:  # the hook cannot leave where the part before was set: that lift is at fault, not this one
                check.about = left.id
            check.look(False, f"{name}: on its approach, at {time_s[n]:.2f} s, the empty hook or its rope meets {met}")

    def _check_jib(self, name: str, present: Sequence[Thing], axes: NDArray[np.float64]) -> None:
        """The jib, as wide as the mast, turns over nothing that is as high as it is.

        What sticks out of the grid's top is cut off there, and not seen.
        """
        crane, check = self.crane, self.checks["jib"]
        if not len(axes):
            return
        check.look(True, "", samples=len(axes))
        if jib_cell(self.site, crane) >= self.site.shape[2]:
            return
        for thing in present:
            met = thing.name != CRANE_ID and tallest_met(self.site, crane, thing.cells, axes[:, 0])
            check.look(
                not met, f"{name}: the jib at {crane.jib_height_m:g} m turns into {thing.name}, which is as high"
            )


def jib_cell(site: Site, crane: TowerCrane) -> int:
    """Return the lowest height, in cells, at which something is as high as the jib."""
    return int(np.floor((crane.jib_height_m - site.frame.origin_m[2]) / site.frame.voxel_size_m + 1e-6))


def reaches_jib(site: Site, crane: TowerCrane, cells: NDArray[np.int32]) -> bool:
    """Return whether any of the cells ((N, 3)) is as high as the jib."""
    return bool((cells[:, 2] >= jib_cell(site, crane)).any())


def tallest_met(site: Site, crane: TowerCrane, cells: NDArray[np.int32], slew_rad: NDArray[np.float64]) -> bool:
    """Return whether the jib, as wide as the mast, turns into any of the cells that are as high as it is.

    Args:
        site: The site.
        crane: Its crane.
        cells: (N, 3) int32.
        slew_rad: (M,) every slewing angle that the jib takes, unwrapped.
    """
    frame = site.frame
    tall = cells[cells[:, 2] >= jib_cell(site, crane)]
    if not len(tall):
        return False
    from_axis_m = frame.centre_of(tall)[:, :2] - np.array(crane.base_m[:2])
    radius_m = np.hypot(*from_axis_m.T)
    reached = radius_m <= crane.jib_length_m
    half_m = crane.mast_size_m / 2.0 + frame.voxel_size_m * np.sqrt(0.5)
    half_rad = np.arcsin(np.minimum(1.0, half_m / np.maximum(radius_m, 1e-9)))
    at_rad = np.arctan2(from_axis_m[:, 1], from_axis_m[:, 0])
    low, high = float(slew_rad.min()), float(slew_rad.max())
    # The first turn of each angle, less its half width, that is not before the slewing range.
    turned = low + np.remainder(at_rad + half_rad - low, 2.0 * np.pi)
    met: NDArray[np.bool_] = reached & (turned - 2.0 * half_rad <= high)
    return bool(met.any())
