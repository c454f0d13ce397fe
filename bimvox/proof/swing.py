"""The proof that loads hang at rest when they are set, and that they hit nothing when they swing.

It is independent of how the motions were made: it uses the samples alone, cubics between them, and a pendulum that is
rotated exactly in each step. During an emergency stop the load swings, and it keeps swinging while the crane stands
still; both are checked. Before the crane resumes, tag lines bring the load to rest.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import kernel
from bimvox.crane.tower_crane import TowerCrane
from bimvox.proof.crane.pendulum import STEP_NS, Hung, Swung, blown_m, hung_on, left_off_m, swung_parts
from bimvox.proof.guided import cells_at_any_heading, turning_rows
from bimvox.proof.hook import EmptyWay, one_way
from bimvox.proof.load import LiftProof
from bimvox.proof.moment import Moment, Thing, near_and_far
from bimvox.proof.site_rules import asked_wind_m_s, asks_for_wind, most_wind_m_s
from bimvox.proof.space import BETWEEN_VOX, Placements, cells_below, tail_of
from bimvox.records.lift import Lift
from bimvox.records.motion import LiftMotion, PhaseName, Trajectory
from bimvox.records.proof import Check
from bimvox.site.component import Component
from bimvox.site.lifting import crane_for
from bimvox.site.site import Site

REST_M = 0.05
"""A load that swings no further than this to either side counts as at rest."""
OFF_REST_M = 0.10
"""How far a load may swing when it is set if its rope, slings and mass are off by a tenth."""
_SLINGS_END = (0, 0, 0)
_SPACING_VOX = 0.5
_MOST_ACROSS = 64
_THIN_VOX = 0.125


class SwingProof(LiftProof):
    """Its checks are ``swing``."""

    def check(self, name: str, moment: Moment, motion: LiftMotion, ways: Sequence[EmptyWay] | None = None) -> None:
        """Check the loaded motion of a lift and its empty hook moves; as ``HookProof.check``."""
        component = self.site.components[moment.lift.component]
        loaded, empty = (hung_on(self.site, self.crane, part) for part in (component, None))
        if loaded is None or empty is None:
            return
        self.cells.move_to(moment.present)
        self._check_way(name, component, motion, motion.loaded, loaded, moment.lift)
        for way in one_way(self.site, moment, motion) if ways is None else ways:
            self.cells.move_to(way.present)
            near = near_and_far(way.left, way.present)[0] if way.left is not None else []
            self._check_way(f"{name}, {way.what}", None, motion, way.way, empty, None, near)

    def _check_way(
        self,
        name: str,
        component: Component | None,
        motion: LiftMotion,
        way: Trajectory,
        hung: Hung,
        lift: Lift | None,
        left: Sequence[Thing] = (),
    ) -> None:
        # A move that ends with a stop ends swinging: tag lines bring what hangs on the hook to rest afterwards.
        stopped = any(abs(end_ns - motion.start_ns - way.time_ns[-1]) <= 1 for _, end_ns in motion.stops_ns)
        for swung in swung_parts(self.crane, motion, way, hung):
            at_end_m = float(swung.amplitude_m[-1])
            if swung.time_s[-1] * 1e9 >= way.time_ns[-1] - 1 and not stopped:
                self.checks["swing"].measure(at_end_m)
                self.checks["swing"].look(
                    at_end_m <= REST_M,
                    f"{name}: at its end the load still swings by {at_end_m:.3f} m, allowed are {REST_M:g} m",
                )
                if hung.load_kg:
                    self._check_off(name, motion, way, hung)
            turning = turning_rows(lift, component, motion, swung.time_s, swung.axes[:, 0])
            self._check_clear(name, component, swung, lift, left, motion.start_ns, turning)

    def _check_off(self, name: str, motion: LiftMotion, way: Trajectory, hung: Hung) -> None:
        """Check that a load is set at rest although rope, slings or mass are not exactly as planned."""
        rests = [end_ns - motion.start_ns for _, end_ns in motion.stops_ns]
        last = way.time_ns >= max((at for at in rests if at < way.time_ns[-1]), default=0)
        left_m = left_off_m(self.crane, way.time_ns[last], way.axes[last], hung)
        self.checks["swing"].look(
            left_m <= OFF_REST_M,
            f"{name}: with rope and mass off by 10 % the load swings by {left_m:.3f} m at its end, allowed are "
            f"{OFF_REST_M:g} m",
        )

    def _check_clear(
        self,
        name: str,
        component: Component | None,
        swung: Swung,
        lift: Lift | None,
        left: Sequence[Thing],
        start_ns: int,
        turning: NDArray[np.bool_],
    ) -> None:
        """Check that a load that swings further than what counts as rest hits nothing, to either side."""
        self.checks["swing"].look(True, "", samples=len(swung.time_s))
        frame = self.site.frame
        offset, line = (
            (_SLINGS_END, _SLINGS_END) if component is None else (component.hook_offset_vox, component.hook_line_vox)
        )
        cells = cells_below(crane_for(self.site, self.crane, component), frame, swung.hook_m, line)
        beyond_vox = _beyond_rest_m(swung.offset_m) / frame.voxel_size_m
        clock_ns = swung.time_s * 1e9 + float(start_ns)
        now = (clock_ns >= self.window_ns[0] - STEP_NS) & (clock_ns <= self.window_ns[1] + STEP_NS)
        swings = (beyond_vox[:, 0] != 0.0) | (beyond_vox[:, 1] != 0.0)
        swings &= now
        tail = tail_of(cells, lift) & ~turning
        if (swings & tail).any():
            self._check_on_line(name, swung, cells, beyond_vox, swings & tail, lift)
        rows = np.flatnonzero(swings & ~tail)
        if not len(rows):
            return
        at, positions = _across(cells, beyond_vox, _thinned(cells, beyond_vox, rows))
        placements = Placements(positions, np.full(len(positions), BETWEEN_VOX))
        bad = np.zeros(len(positions), np.bool_)
        if component is not None:
            for own, counts in self._cells_of(component, turning[at]):
                bad |= counts & placements.at_positions(~self.cells.holds(placements, own))
                bad |= counts & placements.at_positions(self.cells.meets(placements, own))
        if self.site.rules.rope:
            over = placements.at_positions(self.cells.line_meets(placements, offset))
            if over.any() and left:
                # The line leaves the part just set through cells of what touches that part.
                with self.cells.without(left):
                    over &= placements.at_positions(self.cells.line_meets(placements, offset))
            bad |= over
        if bad.any():
            n = int(at[np.argmax(bad)])
            swings_m = float(np.linalg.norm(swung.offset_m[n]))
            self.checks["swing"].look(
                False,
                f"{name}: at {swung.time_s[n]:.2f} s the load, or its rope, swings by {swings_m:.2f} m into something",
            )

    def _cells_of(
        self, component: Component, turning: NDArray[np.bool_]
    ) -> Iterator[tuple[NDArray[np.int32], NDArray[np.bool_]]]:
        """Yield the load's cells in its final heading and at any, each with the positions for which they count."""
        if not turning.all():
            yield component.shape.cells, ~turning
        if turning.any():
            yield cells_at_any_heading(component), turning

    def _check_on_line(
        self,
        name: str,
        swung: Swung,
        cells: NDArray[np.float64],
        beyond_vox: NDArray[np.float64],
        rows: NDArray[np.bool_],
        lift: Lift | None,
    ) -> None:
        """Check that in the last moves a load swings only along their line."""
        assert lift is not None
        assert lift.path_vox is not None
        line = lift.path_vox[-1 - lift.contact_moves :].astype(np.float64)
        reached = cells[rows].copy()
        reached[:, :2] += beyond_vox[rows]
        off_vox = np.min([_from_segment(reached, a, b) for a, b in pairwise(line)], axis=0)
        worst = int(np.argmax(off_vox))
        off_m = float(off_vox[worst]) * self.site.frame.voxel_size_m
        self.checks["swing"].look(
            off_m <= 1e-2 + BETWEEN_VOX * self.site.frame.voxel_size_m,
            f"{name}: at {swung.time_s[rows][worst]:.2f} s, in its last moves, the load swings {off_m:.3f} m "
            "off their line",
        )


_AIR_KG_M3 = 1.25
_GUST_M = 1e-3
_SHARE = 1e-6


def check_gust(check: Check, name: str, site: Site, crane: TowerCrane, lift: Lift, motion: LiftMotion) -> None:
    """Check the wind in which a lift says it is permitted, and that the load stays clear in a gust of it in transit.

    Crane and sail area permit that wind; the load swings no further than stated, and than it keeps clear. A load that
    was stopped left its plan: what the site file asks for is no longer checked.
    """
    component, rules = site.components[lift.component], site.rules
    hung = hung_on(site, crane, component)
    if hung is None or not (asks_for_wind(rules) and lift.path_vox is not None):
        return
    if motion.wind is None:
        check.look(False, f"{name}: it does not state the wind in which it is permitted")
        return
    speed_m_s, sail_m2 = motion.wind.speed_m_s, component.sail_area_m2 * rules.drag_coefficient
    most_m_s = most_wind_m_s(crane, component, sail_m2)
    check.look(
        speed_m_s <= most_m_s * (1.0 + _SHARE),
        f"{name}: it is called permitted in wind of {speed_m_s:.2f} m/s, its crane and its sail area permit "
        f"{most_m_s:.2f} m/s",
    )
    asked_m_s = asked_wind_m_s(rules)
    check.look(
        speed_m_s >= asked_m_s * (1.0 - _SHARE) or bool(lift.left),
        f"{name}: it is permitted in wind of {speed_m_s:.2f} m/s, the site file asks for {asked_m_s:g} m/s",
    )
    swing_m = blown_m(
        crane_for(site, crane, component),
        motion.loaded.axes[_carried(site, lift, motion)],
        hung,
        0.5 * _AIR_KG_M3 * speed_m_s**2 * sail_m2,
    )
    check.measure(swing_m)
    check.look(
        swing_m <= motion.wind.swing_m + _GUST_M,
        f"{name}: a gust of {speed_m_s:.2f} m/s swings its load by {swing_m:.3f} m, not by {motion.wind.swing_m:.3f} m",
    )
    kept_m = rules.kept_m("transit_clearance_m", lift.kept)
    check.look(
        swing_m <= kept_m + _GUST_M or rules.transit_clearance_m == 0.0,
        f"{name}: a gust of {speed_m_s:.2f} m/s, in which it is permitted, swings its load by {swing_m:.3f} m; in "
        f"transit it keeps {kept_m:g} m",
    )


def _carried(site: Site, lift: Lift, motion: LiftMotion) -> NDArray[np.bool_]:
    """Return (N,) which samples of the loaded motion are in transit: all before it goes down into its last moves."""
    assert lift.path_vox is not None
    heights_m = motion.loaded.height_m
    down_vox = lift.path_vox[max(0, len(lift.path_vox) - 1 - lift.contact_moves), 2] - lift.path_vox[-1, 2]
    begun = heights_m < heights_m[-1] + float(down_vox) * site.frame.voxel_size_m - _GUST_M
    lowering = np.zeros(len(heights_m), np.bool_)
    clock_ns = motion.loaded.time_ns + motion.start_ns
    for phase in motion.phases:
        if phase.name is PhaseName.LOWER:
            lowering |= (clock_ns > phase.start_ns) & (clock_ns <= phase.end_ns)
    carried: NDArray[np.bool_] = ~(begun & lowering)
    return carried


def swung_placements(
    site: Site, crane: TowerCrane, motion: LiftMotion, way: Trajectory, component: Component | None, rest_ns: int
) -> NDArray[np.int64]:
    """Return (N, 3) the placements into which a load swings during a motion; none if swing is off.

    Only after ``rest_ns`` since the start of the lift. For the empty hook, ``component`` is None.
    """
    hung = hung_on(site, crane, component)
    found = [np.empty((0, 3), np.int64)]
    for swung in swung_parts(crane, motion, way, hung) if hung is not None else ():
        line = _SLINGS_END if component is None else component.hook_line_vox
        cells = cells_below(crane_for(site, crane, component), site.frame, swung.hook_m, line)
        beyond_vox = _beyond_rest_m(swung.offset_m) / site.frame.voxel_size_m
        swings = (beyond_vox[:, 0] != 0.0) | (beyond_vox[:, 1] != 0.0)
        rows = np.flatnonzero(swings & (swung.time_s * 1e9 >= rest_ns - STEP_NS))
        if len(rows):
            _, positions = _across(cells, beyond_vox, _thinned(cells, beyond_vox, rows))
            found.append(Placements(positions, np.full(len(positions), BETWEEN_VOX)).cells)
    return np.concatenate(found)


def _beyond_rest_m(offset_m: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return (N, 2) how far loads swing beyond what counts as rest."""
    length = np.hypot(offset_m[:, 0], offset_m[:, 1])
    share = np.maximum(length - REST_M, 0.0) / np.maximum(length, 1e-12)
    beyond: NDArray[np.float64] = offset_m * share[:, None]
    return beyond


@kernel
def _thinned(cells: NDArray[np.float64], beyond_vox: NDArray[np.float64], rows: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the rows, thinned so that their cells ((N, 3)) stay at most an eighth of a cell apart if they were.

    The same holds for the cells that the load swings to ((N, 2)): it also swings while the crane is at rest.
    """
    thin = np.empty_like(rows)
    count, at, way, last = 0, 0, 0.0, -1.0
    for n in range(rows.shape[0]):
        while at < rows[n]:
            at += 1
            x, y, z = cells[at, 0] - cells[at - 1, 0], cells[at, 1] - cells[at - 1, 1], cells[at, 2] - cells[at - 1, 2]
            u, v = beyond_vox[at, 0] - beyond_vox[at - 1, 0], beyond_vox[at, 1] - beyond_vox[at - 1, 1]
            way += np.sqrt(x * x + y * y + z * z) + np.sqrt(u * u + v * v)
        step = np.floor(way / _THIN_VOX)
        if step > last:
            thin[count] = rows[n]
            count += 1
        last = step
    return thin[:count]


@kernel
def _across(
    cells: NDArray[np.float64], beyond_vox: NDArray[np.float64], rows: NDArray[np.int64]
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Return positions over the whole swing of a load, from side to side, half a cell apart.

    ``cells``: (N, 3) reference cells of the load at rest; ``beyond_vox``: (N, 2) how far it swings to either side;
    ``rows``: (M,) the rows to use. (K,) int64 the row of each, and (K, 3) the positions.
    """
    parts = np.empty_like(rows)
    for n in range(rows.shape[0]):
        length = np.hypot(beyond_vox[rows[n], 0], beyond_vox[rows[n], 1])
        parts[n] = min(max(np.ceil(2.0 * length / _SPACING_VOX), 2), _MOST_ACROSS) + 1
    total = parts.sum()
    of_row, positions = np.empty(total, np.int64), np.empty((total, 3))
    at = 0
    for n in range(rows.shape[0]):
        row = rows[n]
        for part in range(parts[n]):
            share = 2.0 * part / (parts[n] - 1) - 1.0
            positions[at, 0] = cells[row, 0] + share * beyond_vox[row, 0]
            positions[at, 1] = cells[row, 1] + share * beyond_vox[row, 1]
            positions[at, 2] = cells[row, 2]
            of_row[at] = row
            at += 1
    return of_row, positions


def _from_segment(
    points: NDArray[np.float64], start: NDArray[np.float64], end: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return (N,) the distance of points from a segment."""
    edge = end - start
    along = np.clip((points - start) @ edge / max(float(edge @ edge), 1e-12), 0.0, 1.0)
    return np.asarray(np.linalg.norm(points - (start + along[:, None] * edge), axis=1), np.float64)
