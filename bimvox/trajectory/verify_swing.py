"""The proof that loads hang at rest where they are set, and swing into nothing on the way.

By other means than the motions were made: from the samples alone, a cubic through them between, and a pendulum that is
turned exactly from step to step. A stop is braking in need: its load swings through it and goes on swinging while the
crane stands, and all of that is looked at too. Before the crane goes on the load is brought to rest by its tag lines.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import kernel
from bimvox.crane.kinematics import hook_of
from bimvox.crane.pendulum import GRAVITY_M_S2, half_period_s, pendulum_lengths_m
from bimvox.crane.tower_crane import TowerCrane
from bimvox.planning.lift import Lift
from bimvox.planning.moment import Moment, Thing, near_and_far
from bimvox.site.component import Component
from bimvox.site.lifting import crane_for
from bimvox.site.site import Site
from bimvox.trajectory.motion import LiftMotion
from bimvox.trajectory.swing import RESIDUAL_M, Pendulum, pendulum_of
from bimvox.trajectory.trajectory import Trajectory
from bimvox.trajectory.verify_axes import axes_of_samples
from bimvox.trajectory.verify_between import EmptyWay, one_way
from bimvox.trajectory.verify_lift import LiftProof
from bimvox.trajectory.verify_space import BETWEEN_VOX, placements_around, reference_cells, tail_of

_STEP_NS = 40_000_000
_SLINGS_END = (0, 0, 0)
_SPACING_VOX = 0.5
_MOST_ACROSS = 64


class Swung(NamedTuple):
    """A load that swings.

    Attributes:
        time_s: (N,) float64 since the start of the lift.
        axes: (N, 3) float64 slew (rad), radius (m), height (m).
        offset_m: (N, 2) float64 of the load from where it would hang at rest.
        amplitude_m: (N,) float64 how far it would swing out if the crane stood still from then on.
    """

    time_s: NDArray[np.float64]
    axes: NDArray[np.float64]
    offset_m: NDArray[np.float64]
    amplitude_m: NDArray[np.float64]


class SwingProof(LiftProof):
    """Its checks are ``swing``."""

    def check(self, name: str, moment: Moment, motion: LiftMotion, ways: Sequence[EmptyWay] | None = None) -> None:
        """Check the loaded motion of a lift, and the ways of its empty hook; as ``HookProof.check``."""
        component = self.site.components[moment.lift.component]
        loaded, empty = pendulum_of(self.site, component), pendulum_of(self.site, None)
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
        pendulum: Pendulum,
        lift: Lift | None,
        left: Sequence[Thing] = (),
    ) -> None:
        # A way that ends with a stop ends swinging: tag lines bring what hangs on the hook to rest before it goes on.
        stopped = any(abs(end_ns - motion.start_ns - way.time_ns[-1]) <= 1 for _, end_ns in motion.stops_ns)
        for swung in swung_parts(self.crane, motion, way, pendulum):
            at_end_m = float(swung.amplitude_m[-1])
            if swung.time_s[-1] * 1e9 >= way.time_ns[-1] - 1 and not stopped:
                self.checks["swing"].measure(at_end_m)
                self.checks["swing"].look(
                    at_end_m <= RESIDUAL_M,
                    f"{name}: at its end the load still swings by {at_end_m:.3f} m, allowed are {RESIDUAL_M:g} m",
                )
            self._check_clear(name, component, swung, lift, left, motion.start_ns)

    def _check_clear(
        self,
        name: str,
        component: Component | None,
        swung: Swung,
        lift: Lift | None,
        left: Sequence[Thing],
        start_ns: int,
    ) -> None:
        """A load that swings further than what counts as rest meets nothing, to either side."""
        self.checks["swing"].look(True, "", samples=len(swung.time_s))
        frame = self.site.frame
        offset = _SLINGS_END if component is None else component.hook_offset_vox
        cells = reference_cells(crane_for(self.site, self.crane, component), frame, swung.axes, offset)
        beyond_vox = beyond_rest_m(swung.offset_m) / frame.voxel_size_m
        clock_ns = swung.time_s * 1e9 + float(start_ns)
        now = (clock_ns >= self.window_ns[0] - _STEP_NS) & (clock_ns <= self.window_ns[1] + _STEP_NS)
        swings = (np.abs(beyond_vox).max(axis=1) > 0.0) & now
        tail = tail_of(cells, lift)
        if (swings & tail).any():
            self._check_on_line(name, swung, cells, beyond_vox, swings & tail, lift)
        rows = np.flatnonzero(swings & ~tail)
        if not len(rows):
            return
        at, positions = across(cells, beyond_vox, thinned(cells, beyond_vox, rows))
        placements = placements_around(positions, np.full(len(positions), BETWEEN_VOX))
        bad = np.zeros(len(positions), np.bool_)
        if component is not None:
            own = component.shape.cells
            bad |= placements.at_positions(~self.cells.holds(placements, own))
            bad |= placements.at_positions(self.cells.meets(placements, own))
        if self.site.rules.rope:
            over = placements.at_positions(self.cells.over(placements, offset))
            if over.any() and left:
                # The line leaves the part just set through cells of what touches it.
                over &= placements.at_positions(self.cells.without(left).over(placements, offset))
            bad |= over
        if bad.any():
            n = int(at[np.argmax(bad)])
            swings_m = float(np.linalg.norm(swung.offset_m[n]))
            self.checks["swing"].look(
                False,
                f"{name}: at {swung.time_s[n]:.2f} s the load, or its rope, swings by {swings_m:.2f} m "
                "into what is there",
            )

    def _check_on_line(
        self,
        name: str,
        swung: Swung,
        cells: NDArray[np.float64],
        beyond_vox: NDArray[np.float64],
        rows: NDArray[np.bool_],
        lift: Lift | None,
    ) -> None:
        """In the last moves a load swings along their line only."""
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


def swung_parts(crane: TowerCrane, motion: LiftMotion, way: Trajectory, pendulum: Pendulum) -> Iterator[Swung]:
    """Yield how a load swings on its way, through every stop and while it is held after it; anew when it goes on."""
    stops = [(begin_ns - motion.start_ns, end_ns - motion.start_ns) for begin_ns, end_ns in motion.stops_ns]
    rests = [end for begin, end in stops if begin < way.time_ns[-1] and end > way.time_ns[0]]
    axes = axes_of_samples(way)
    for low_ns, high_ns in pairwise([int(way.time_ns[0]), *rests, int(way.time_ns[-1])]):
        part = (way.time_ns >= low_ns) & (way.time_ns <= high_ns)
        if part.sum() < 2:
            continue
        time_ns = way.time_ns[part]
        if high_ns in rests:
            # How long it is held says nothing more after one period: a load without damping swings the same again.
            length_m = float(pendulum_lengths_m(crane, axes[part][-1:], pendulum.below_hook_m)[0])
            time_ns[-1] = min(time_ns[-1], time_ns[-2] + round(2.0e9 * half_period_s(length_m)))
        yield _swung(crane, time_ns, axes[part], pendulum)


def swung_placements(
    site: Site, crane: TowerCrane, motion: LiftMotion, way: Trajectory, component: Component | None, rest_ns: int
) -> NDArray[np.int64]:
    """Return (N, 3) the placements into which a load swings on its way; none where swing is off.

    Args:
        site: The site.
        crane: Its crane.
        motion: The lift.
        way: One of its trajectories.
        component: The load; None for the empty hook.
        rest_ns: From when on, since the start of the lift.
    """
    pendulum = pendulum_of(site, component)
    found = [np.empty((0, 3), np.int64)]
    for swung in swung_parts(crane, motion, way, pendulum) if pendulum is not None else ():
        offset = _SLINGS_END if component is None else component.hook_offset_vox
        cells = reference_cells(crane_for(site, crane, component), site.frame, swung.axes, offset)
        beyond_vox = beyond_rest_m(swung.offset_m) / site.frame.voxel_size_m
        rows = np.flatnonzero((np.abs(beyond_vox).max(axis=1) > 0.0) & (swung.time_s * 1e9 >= rest_ns - _STEP_NS))
        if len(rows):
            _, positions = across(cells, beyond_vox, thinned(cells, beyond_vox, rows))
            found.append(placements_around(positions, np.full(len(positions), BETWEEN_VOX)).cells)
    return np.concatenate(found)


def beyond_rest_m(offset_m: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return (N, 2) how far loads swing beyond what counts as rest."""
    length = np.hypot(offset_m[:, 0], offset_m[:, 1])
    beyond: NDArray[np.float64] = offset_m * (np.maximum(length - RESIDUAL_M, 0.0) / np.maximum(length, 1e-12))[:, None]
    return beyond


def thinned(cells: NDArray[np.float64], beyond_vox: NDArray[np.float64], rows: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return rows so many that their cells ((N, 3)) are an eighth of a cell apart or less, or as they are.

    So are the cells that the load swings to ((N, 2)): it goes on when the crane stands.
    """
    steps = np.linalg.norm(np.diff(cells, axis=0), axis=1) + np.linalg.norm(np.diff(beyond_vox, axis=0), axis=1)
    way = np.concatenate([[0.0], np.cumsum(steps)])
    step = np.floor(way[rows] / 0.125)
    return rows[np.concatenate([[True], np.diff(step) > 0])] if len(rows) else rows


def across(
    cells: NDArray[np.float64], beyond_vox: NDArray[np.float64], rows: NDArray[np.int64]
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Return positions from as far as a load swings to one side to as far to the other, half a cell apart.

    Args:
        cells: (N, 3) reference cells of the load at rest.
        beyond_vox: (N, 2) how far it swings.
        rows: (M,) which of them.

    Returns:
        (K,) int64 the row of each, and (K, 3) the positions.
    """
    length = np.hypot(*beyond_vox[rows].T)
    parts = np.clip(np.ceil(2.0 * length / _SPACING_VOX), 2, _MOST_ACROSS).astype(np.int64) + 1
    at = np.repeat(rows, parts)
    first = np.cumsum(parts) - parts
    share = 2.0 * (np.arange(len(at)) - np.repeat(first, parts)) / np.repeat(parts - 1, parts) - 1.0
    positions = cells[at].copy()
    positions[:, :2] += share[:, None] * beyond_vox[at]
    return at, positions


def _swung(crane: TowerCrane, time_ns: NDArray[np.int64], samples: NDArray[np.float64], pendulum: Pendulum) -> Swung:
    """The samples, and times between no further apart than a step, with the swing that comes of them."""
    since_s = (time_ns - time_ns[0]) / 1e9
    parts = np.maximum(1, -(-np.diff(time_ns) // _STEP_NS))
    piece = np.repeat(np.arange(len(parts)), parts)
    share = (np.arange(len(piece)) - np.repeat(np.cumsum(parts) - parts, parts)) / parts[piece]
    h = np.diff(since_s)[piece]
    slope = _slopes(since_s, samples)
    a, b = samples[piece], samples[piece + 1]
    u = share[:, None]
    # The cubic between two samples with the slopes there.
    between = (
        (1 + 2 * u) * (1 - u) ** 2 * a
        + u**2 * (3 - 2 * u) * b
        + h[:, None] * (u * (1 - u) ** 2 * slope[piece] - u**2 * (1 - u) * slope[piece + 1])
    )
    axes = np.concatenate([between, samples[-1:]])
    time_s = np.append(since_s[piece] + share * h, since_s[-1])
    length_m = pendulum_lengths_m(crane, axes, pendulum.below_hook_m)
    bend = np.gradient(np.gradient(length_m, time_s), time_s) if len(time_s) > 2 else np.zeros(len(time_s))
    bend = np.clip(bend, -crane.hoist.acceleration, crane.hoist.acceleration)
    stiffness = (GRAVITY_M_S2 - bend) / length_m
    offset, amplitude = _turned(hook_of(crane, *axes.T)[:, :2].copy(), np.sqrt(stiffness), np.diff(time_s))
    return Swung(time_s + time_ns[0] / 1e9, axes, offset, amplitude)


def _slopes(time_s: NDArray[np.float64], values: NDArray[np.float64]) -> NDArray[np.float64]:
    """(N, 3) slopes at the samples: of the parabola through three; none where an axis rests or turns back."""
    slopes = np.zeros_like(values)
    if len(values) > 2:
        h = np.diff(time_s)[:, None]
        rise = np.diff(values, axis=0) / h
        parabola = (h[1:] * rise[:-1] + h[:-1] * rise[1:]) / (h[1:] + h[:-1])
        slopes[1:-1] = np.where(rise[:-1] * rise[1:] > 0.0, parabola, 0.0)
    return slopes


@kernel
def _turned(
    point_m: NDArray[np.float64], pulse: NDArray[np.float64], step_s: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """A load under a point that goes straight from step to step: its offset turns in phase space, exactly."""
    n = point_m.shape[0]
    offset, amplitude = np.zeros((n, 2)), np.zeros(n)
    rate = np.zeros(2)
    for i in range(1, n):
        h, w = step_s[i - 1], 0.5 * (pulse[i - 1] + pulse[i])
        c, s = np.cos(w * h), np.sin(w * h)
        squared = 0.0
        for k in range(2):
            moves = (point_m[i, k] - point_m[i - 1, k]) / h
            e, v = offset[i - 1, k], rate[k] - moves
            offset[i, k] = e * c + v / w * s
            v = v * c - e * w * s
            rate[k] = v + moves
            squared += offset[i, k] ** 2 + (v / w) ** 2
        amplitude[i] = np.sqrt(squared)
    return offset, amplitude


def _from_segment(
    points: NDArray[np.float64], start: NDArray[np.float64], end: NDArray[np.float64]
) -> NDArray[np.float64]:
    """(N,) distance of points from a segment."""
    edge = end - start
    along = np.clip((points - start) @ edge / max(float(edge @ edge), 1e-12), 0.0, 1.0)
    return np.asarray(np.linalg.norm(points - (start + along[:, None] * edge), axis=1), np.float64)
