"""The proof that a moving load hits nothing, and that the line from its hook up to the jib is free."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bimvox.crane.tower_crane import TowerCrane
from bimvox.proof.bodies.triangles import TriangleCheck
from bimvox.proof.guided import cells_at_any_heading, check_guiding, guided_box_vox, in_the_box, turning_rows
from bimvox.proof.moment import Moment, Thing, near_and_far, passed_by
from bimvox.proof.space import ALWAYS_NS, BETWEEN_VOX, Placements, RawCells, positions_of, tail_of, within
from bimvox.records.lift import Lift
from bimvox.records.motion import LiftMotion
from bimvox.records.proof import Check
from bimvox.site.component import Component, StoredPose
from bimvox.site.lifting import crane_for
from bimvox.site.site import Site


class LiftProof:
    """Checks the lifts of one crane in order.

    Args:
        site: The site as this crane sees it.
        crane: The crane.
        triangles: The triangle test.
        cells: What is where at the current lift; updated by the caller or by parts of the proof.
        checks: Receive the results, by name.
        window_ns: Collisions count only in this span of the site's clock.
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

    def check_zones(
        self,
        name: str,
        placements: Placements,
        component: Component | None,
        cells: NDArray[np.float64],
        time_s: NDArray[np.float64],
        turning: NDArray[np.bool_] | None = None,
    ) -> None:
        """Check that no zone forbids hook or load, and that the hook respects the height limiters.

        ``placements`` are the whole placements around the positions ``cells`` ((N, 3) reference cells) at ``time_s``
        ((N,)). For the empty hook, ``component`` is None. ``turning`` ((N,)): where the load may have any heading.
        """
        site = self.site
        offset = np.array((0, 0, 0) if component is None else component.hook_offset_vox)

        def over(zone: NDArray[np.bool_], offsets: NDArray[np.int64]) -> NDArray[np.bool_]:
            """Return which placements have one of these columns, relative to the reference cell, over a zone."""
            result = np.zeros(len(placements.cells), np.bool_)
            for column in offsets:
                at = placements.cells[:, :2] + column
                inside = ((at >= 0) & (at < zone.shape)).all(axis=1)
                result[inside] |= zone[at[inside, 0], at[inside, 1]]
            return result

        def look(bad: NDArray[np.bool_], what: str) -> None:
            self.checks["zones"].look(
                not bad.any(), f"{name}: {what} at {time_s[int(np.argmax(bad))]:.2f} s", samples=len(bad)
            )

        if site.prohibited is not None:
            look(
                placements.at_positions(over(site.prohibited, offset[None, :2])),
                "the hook is over a prohibited zone",
            )
        if site.no_load is not None and component is not None:
            columns = np.unique(component.shape.cells[:, :2], axis=0).astype(np.int64)
            met = placements.at_positions(over(site.no_load, columns))
            if turning is not None and turning.any():
                wide = np.unique(cells_at_any_heading(component)[:, :2], axis=0).astype(np.int64)
                met |= placements.at_positions(over(site.no_load, wide)) & turning
            look(met, "the load is over a zone that is closed to it")
        if site.hook_heights is not None:
            sling_m = crane_for(site, self.crane, component).sling_m
            hook_m = site.frame.origin_m[2] + (cells[:, 2] + offset[2]) * site.frame.voxel_size_m + sling_m
            columns = placements.cells[:, :2] + offset[:2]
            shape = site.hook_heights.low_m.shape
            inside = ((columns >= 0) & (columns < shape)).all(axis=1)
            low, high = np.full(len(columns), -np.inf), np.full(len(columns), np.inf)
            low[inside] = site.hook_heights.low_m[columns[inside, 0], columns[inside, 1]]
            high[inside] = site.hook_heights.high_m[columns[inside, 0], columns[inside, 1]]
            slack_m = BETWEEN_VOX * site.frame.voxel_size_m
            wrong = hook_m < low[placements.around].max(axis=0) - slack_m
            look(
                wrong | (hook_m > high[placements.around].min(axis=0) + slack_m),
                "the hook is not as high as a limiter wants it",
            )


class _Spots(NamedTuple):
    """Positions of a moving load.

    Attributes:
        cells: (N, 3) float64 reference cells.
        placements: Whole placements around them.
        time_s: (N,) float64 times from the start of the lift.
        tail: (N,) bool whether each is on the last moves.
        now: (N,) bool whether each is within the checked time span.
    """

    cells: NDArray[np.float64]
    placements: Placements
    time_s: NDArray[np.float64]
    tail: NDArray[np.bool_]
    now: NDArray[np.bool_]


class LoadProof(LiftProof):
    """Its checks are ``motion_cells``, ``motion_triangles``, ``motion_rope`` and ``zones``."""

    def check(self, name: str, moment: Moment, motion: LiftMotion) -> None:
        """Check raising and loaded motion of a lift."""
        component, place = self.site.components[moment.lift.component], moment.lift.place
        self.start_ns = motion.start_ns
        upright = place is not None and place.pose is StoredPose.AS_BUILT and not place.turn
        # What a part sweeps while it is upended, or raised turned, is checked with its place in the yard. This checks
        # its hook line.
        self._check_way(f"{name}, raised", component, moment, motion, None, with_load=upright)
        self._check_way(name, component, moment, motion, moment.lift, with_load=True)

    def _check_way(
        self,
        name: str,
        component: Component,
        moment: Moment,
        motion: LiftMotion,
        lift: Lift | None,
        *,
        with_load: bool,
    ) -> None:
        """Check the loaded motion of a lift; without the lift, the raising before it."""
        trajectory = motion.raising if lift is None else motion.loaded
        crane = crane_for(self.site, self.crane, component)
        way, cells, placements = positions_of(crane, self.site.frame, trajectory, component.hook_line_vox)
        own = component.shape.cells
        time_s = trajectory.time_ns[way.sample] / 1e9
        turning = turning_rows(lift, component, motion, time_s, way.axes[:, 0])
        tail, now = tail_of(cells, lift) & ~turning, within(trajectory, way, self.start_ns, self.window_ns)
        if not now.any():
            return
        near, far = near_and_far(component, moment.present) if tail.any() else ([], list(moment.present))
        passed: list[Thing] = []
        check = self.checks["motion_cells"]
        guide = None if lift is None else lift.guide
        if guide is not None and tail.any():
            # The proof of the plan checks the poses of a guided load; they follow from the height of its hook.
            rows = tail & (np.diff(way.sample, prepend=-1) > 0)
            check_guiding(self.checks["timeline"], name, guide, cells[rows], time_s[rows], self.site.frame.voxel_size_m)
            if (tail & now).any():
                low, high = guided_box_vox(self.site, component, guide)
                for met in in_the_box(moment.present, low, high):
                    check.look(False, f"{name}: guided to its place, it comes into cells near {met}")
        if with_load:
            inside = ~self._found(placements, turning, component, lambda cells: ~self.cells.holds(placements, cells))
            if not inside.all():
                n = int(np.argmin(inside))
                check.look(
                    False, f"{name}: leaves the site at {time_s[n]:.2f} s, at {self.site.frame.in_words(cells[n])}"
                )
            hit = self._found(placements, turning, component, lambda cells: self.cells.meets(placements, cells))
            bad = hit & ~tail
            if (hit & tail).any() and lift is not None and guide is None:
                left = self._left(placements, own, near) & tail
                if (left & now).any():
                    passed = self._check_passed(component, lift, cells[tail & now], far)
                    near, far = [*near, *passed], [thing for thing in far if thing not in passed]
                    left = self._left(placements, own, near) & tail
                bad |= left
            check.look(True, "", samples=int(now.sum()))
            bad &= now
            if bad.any():
                n = int(np.argmax(bad))
                own = cells_at_any_heading(component) if turning[n] else own
                met = ", ".join(_met(moment.present if not tail[n] else far, placements, n, own))
                place = self.site.frame.in_words(cells[n])
                check.look(False, f"{name}: at {time_s[n]:.2f} s, at {place}, the load is in cells of {met}")
            if guide is None:
                touched = [thing for thing in near if thing not in passed]
                self._check_contact(component, cells, hit & tail & now, touched)
        if self.site.rules.rope:
            spots = _Spots(cells, placements, time_s, tail, now)
            self._check_rope(name, component, moment, spots, near)
        self.check_zones(name, placements, component, cells, time_s, turning)

    def _found(
        self,
        placements: Placements,
        turning: NDArray[np.bool_],
        component: Component,
        look: Callable[[NDArray[np.int32]], NDArray[np.bool_]],
    ) -> NDArray[np.bool_]:
        """Return (N,) what holds at each position for the load's cells: those at any heading while it is turning."""
        result = placements.at_positions(look(component.shape.cells))
        if turning.any():
            result[turning] = placements.at_positions(look(cells_at_any_heading(component)))[turning]
        return result

    def _left(self, placements: Placements, own: NDArray[np.int32], without: Sequence[Thing]) -> NDArray[np.bool_]:
        """Return (N,) whether the load at each position is in cells of anything else."""
        with self.cells.without(without):
            return placements.at_positions(self.cells.meets(placements, own))

    def _check_passed(
        self, component: Component, lift: Lift, cells: NDArray[np.float64], far: Sequence[Thing]
    ) -> list[Thing]:
        """Return what shares cells with the load on its last moves; the load must not touch it at all."""
        assert lift.path_vox is not None
        passed = passed_by(component, far, lift.path_vox[-lift.contact_moves :])
        offsets_m = (cells - np.array(component.target_vox)) * self.site.frame.voxel_size_m
        for thing in passed:
            self.triangles.check_apart(self.checks["motion_triangles"], component, offsets_m, thing.solid)
        return passed

    def _check_contact(
        self, component: Component, cells: NDArray[np.float64], hit: NDArray[np.bool_], near: Sequence[Thing]
    ) -> None:
        """Decide by triangles, for each neighbour, from the first contact in cells."""
        if not hit.any():
            return
        first = max(0, int(np.argmax(hit)) - 1)
        offsets_m = (cells[first:] - np.array(component.target_vox)) * self.site.frame.voxel_size_m
        for thing in near:
            self.triangles.check_way(self.checks["motion_triangles"], component, offsets_m, thing.solid)

    def _check_rope(
        self, name: str, component: Component, moment: Moment, spots: _Spots, near: Sequence[Thing]
    ) -> None:
        """Check that a hook line one cell wide is free; on the last moves: that the rope misses real triangles."""
        cells, placements, time_s, tail, now = spots
        check = self.checks["motion_rope"]
        check.look(True, "", samples=int(now.sum()))
        hit = placements.at_positions(self.cells.line_meets(placements, component.hook_offset_vox)) & now
        bad = hit & ~tail
        doubtful = hit & tail
        if doubtful.any():
            with self.cells.without(near):
                line = self.cells.line_meets(placements, component.hook_offset_vox)
            bad |= now & placements.at_positions(line)
        for n in np.flatnonzero(doubtful & ~bad).tolist():
            offset_m = (cells[n] - np.array(component.target_vox)) * self.site.frame.voxel_size_m
            bad[n] = not all(self.triangles.rope_is_clear(component, offset_m, thing.solid) for thing in near)
        if bad.any():
            n = int(np.argmax(bad))
            met = ", ".join(things_over(moment.present, placements, n, np.array(component.hook_offset_vox)))
            check.look(
                False,
                f"{name}: at {time_s[n]:.2f} s, at {self.site.frame.in_words(cells[n])}, the hoist rope meets {met}",
            )


def things_over(
    things: Sequence[Thing], placements: Placements, position: int, hook_offset_vox: NDArray[np.int64]
) -> list[str]:
    """Return the names of what is in the hook's column at one position."""
    hook = placements.at(position) + hook_offset_vox
    return [
        thing.name
        for thing in things
        if any(
            ((thing.cells[:, :2] == column[:2]).all(axis=1) & (thing.cells[:, 2] >= column[2])).any() for column in hook
        )
    ]


def _met(things: Sequence[Thing], placements: Placements, position: int, own: NDArray[np.int32]) -> list[str]:
    """Return the names of what is in the load's cells at one position."""
    cells = {tuple(cell) for place in placements.at(position) for cell in (own + place).tolist()}
    return [thing.name for thing in things if any(tuple(cell) in cells for cell in thing.cells.tolist())]
