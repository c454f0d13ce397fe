"""A motion whose load does not swing into anything and is at rest where it is set."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import kernel
from bimvox.crane.tower_crane import TowerCrane
from bimvox.errors import PlanningError
from bimvox.motion.move import Move
from bimvox.motion.profile import FIRST_SLOW, LADDER, TWO, Calm
from bimvox.motion.swept import LoadFrame, swaying_is_free
from bimvox.motion.swing import (
    PLANNED_OFF_RESIDUAL_M,
    PLANNED_RESIDUAL_M,
    STEP_S,
    Pendulum,
    Swing,
    left_m,
    swing_of,
)
from bimvox.motion.timeline import Pacer, Timeline, overlapping_as
from bimvox.site.collision import CollisionSpace

# Moves shaped together, so that the swing that one leaves is cancelled by the others.
#
# Zero-vibration shaping takes one move at a time and assumes that the hook moves along a straight line. Slewing turns
# the jib under the load, and a trolley that runs at the same time swings it sideways, so some swing is left in both
# directions of the plan. The sizes of the two parts of each move and the time between them are the parameters that
# cancel it. A few Gauss-Newton steps on the simulated swing find them; the crane goes no slower.

_MOVES = 3
"""How many of the last moves are adjusted: enough for both directions of the plan."""
_ROUNDS = 3
_STEP = 0.02
_ENOUGH_M = 0.25 * PLANNED_RESIDUAL_M
_AT_REST_M = 0.75 * PLANNED_RESIDUAL_M
_HOPEFUL_M = 1.5 * PLANNED_RESIDUAL_M
"""No further step is taken if the linear model leaves more than this."""
_DIGITS = 4
"""Decimals of the parameters, so that the last bits of a linear solver do not reach the log."""
_SHARE = (0.1, 0.9)
STRETCH = (0.6, 1.5)
"""Time between the parts of a move, in half periods."""

Residual = Callable[[tuple[Calm, ...]], NDArray[np.float64]]
"""From the shaping of each move to the swing that is left: (N,) float64, m."""

_PLAIN = Calm()


def cancelled(
    swings: Sequence[bool], residual_m: Residual, plain: Calm = _PLAIN, at_rest_m: float = _AT_REST_M
) -> tuple[Calm, ...] | None:
    """Return how to shape moves so that their load hangs at rest in the end.

    Args:
        swings: For every move, whether it makes the load swing.
        residual_m: The swing that a shaping leaves.
        plain: The shaping to begin with, in two parts.
        at_rest_m: What may be left.

    Returns:
        One shaping per move; None if none was found that leaves the load at rest, or if the plainest already does.
    """
    adjusted = [n for n, swings_load in enumerate(swings) if swings_load][-_MOVES:]
    if not adjusted:
        return None

    def calms(parameters: NDArray[np.float64]) -> tuple[Calm, ...]:
        given = [plain] * len(swings)
        for n, (share, stretch) in zip(adjusted, parameters.reshape(-1, 2).tolist(), strict=True):
            given[n] = replace(plain, parts=(share, round(1.0 - share, _DIGITS)), stretch=stretch)
        return tuple(given)

    low, high = (np.tile([_SHARE[side], STRETCH[side]], len(adjusted)) for side in (0, 1))
    parameters = np.tile([0.5, 1.0], len(adjusted))
    left_m = residual_m(calms(parameters))
    if np.linalg.norm(left_m) <= _ENOUGH_M:
        return None if plain == _PLAIN else calms(parameters)
    for _ in range(_ROUNDS):
        steps = _STEP * np.eye(len(parameters))
        slopes = np.array([residual_m(calms(parameters + step)) - left_m for step in steps]).T / _STEP
        step, *_ = np.linalg.lstsq(slopes, -left_m, rcond=1e-3)
        if np.linalg.norm(left_m + slopes @ step) > _HOPEFUL_M:
            return None
        tried = np.round(np.clip(parameters + step, low, high), _DIGITS)
        tried_m = residual_m(calms(tried))
        if np.linalg.norm(tried_m) >= np.linalg.norm(left_m):
            break
        parameters, left_m = tried, tried_m
        if np.linalg.norm(left_m) <= _ENOUGH_M:
            break
    return calms(parameters) if np.linalg.norm(left_m) <= at_rest_m else None


_FITS = 3
"""How often moves are shaped together before they are slowed: rounding the corners again changes the swing."""
_SMOOTH = Calm(smooth=True)
_FIT_OFF = (2, 7)
"""Which pendulums that are off are shaped for as well: rope and slings both shorter, both longer."""
_OFF_WEIGHT = 0.35
"""The swing of one that is off counts by this share."""
_OFF_AT_REST_M = 0.05
"""With them more may be left: whether each swings too far is seen afterwards."""
_SHORTEST = Calm(TWO, STRETCH[0])
"""The quickest shaping of a move."""
_LEFT_SHARE = 0.6
"""A move that leaves more than this share of the permitted residual leaves its load swinging."""
_ROUNDING_S = 1e-6
"""A motion is sure to take too long only if it takes longer by this."""


@dataclass(frozen=True, slots=True, eq=False)
class Swaying:
    """A timeline with the swing of its load, evenly spaced in time.

    Attributes:
        time_s: (N,) float64.
        axes: (N, 3) float64 slew (rad), radius (m), height (m).
        swing: At these times; its amplitude only when a move begins or ends, and in the end.
        pendulum: What hangs on the hook.
    """

    time_s: NDArray[np.float64]
    axes: NDArray[np.float64]
    swing: Swing
    pendulum: Pendulum

    def off(self, crane: TowerCrane) -> Swaying:
        """Return how the load swings if it and its rope are not what is planned: so that most is left in the end."""
        others = self.pendulum.off
        if not others:
            return self
        worst = others[int(np.argmax(self._left_off_m(crane)))]
        wanted = np.isfinite(self.swing.amplitude_m)
        return replace(self, swing=swing_of(crane, self.axes, self._step_s, worst, wanted), pendulum=worst)

    def left_off_m(self, crane: TowerCrane) -> float:
        """Return how far the load swings in the end, at most, if it and its rope are not what is planned."""
        return max(self._left_off_m(crane), default=float(self.swing.amplitude_m[-1]))

    @property
    def _step_s(self) -> float:
        return float(self.time_s[-1] - self.time_s[0]) / (len(self.time_s) - 1)

    def _left_off_m(self, crane: TowerCrane) -> list[float]:
        ways = left_m(crane, self.axes, self._step_s, self.pendulum.off) if self.pendulum.off else ()
        return [float(np.sqrt((way[:4] ** 2).sum()) + np.sqrt((way[4:] ** 2).sum())) for way in ways]

    def left_by(self, timeline: Timeline, move: int) -> float:
        """Return the amplitude when a move ends, or when the next move that makes the load swing begins."""
        swings = timeline.course.swings[move + 1 :]
        later = [start for start, other in zip(timeline.start_s[move + 1 :], swings, strict=True) if other]
        until_s = min([timeline.end_s[move], *later[:1]])
        return float(self.swing.amplitude_m[_at(self.time_s, np.array([until_s]))[0]])


def swaying(timeline: Timeline, pendulum: Pendulum, spacing_m: float) -> Swaying:
    """Return a timeline with the swing of its load; the hook moves at most ``spacing_m`` from one time to the next."""
    time_s, axes = _evenly(timeline, spacing_m)
    wanted = np.zeros(len(time_s), np.bool_)
    wanted[_at(time_s, np.array([*timeline.start_s, *timeline.end_s, np.inf]))] = True
    swing = swing_of(timeline.crane, axes, timeline.duration_s / (len(time_s) - 1), pendulum, wanted)
    return Swaying(time_s, axes, swing, pendulum)


def _at(time_s: NDArray[np.float64], times_s: NDArray[np.float64]) -> NDArray[np.int64]:
    """Return at which of ascending times each of others has come, the last one if none of them."""
    at: NDArray[np.int64] = np.minimum(np.searchsorted(time_s, times_s), len(time_s) - 1)
    return at


def _evenly(timeline: Timeline, spacing_m: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return times close enough for the pendulum, with the hook at most ``spacing_m`` apart, and the axes then."""
    duration_s = timeline.duration_s
    steps = int(np.ceil(max(duration_s / STEP_S, duration_s * timeline.top_speed_m_s / spacing_m))) + 1
    time_s = _evenly_s(0.0, duration_s, steps)
    return time_s, timeline.axes_at(time_s)


@dataclass(frozen=True, slots=True, eq=False)
class SwingRules:
    """The rules that a motion must satisfy.

    Attributes:
        blend: Rounds the corners of a timeline.
        fault_s: When a timeline's load first swings too far; None if it never does.
        spacing_m: Largest travel of the hook between two times at which the load is checked.
        limit_s: A motion that takes this long or longer is discarded.
    """

    blend: Callable[[Timeline], Timeline]
    fault_s: Callable[[Timeline, Swaying], float | None]
    spacing_m: float
    limit_s: float = np.inf


def steadied(crane: TowerCrane, moves: Sequence[Move], pendulum: Pendulum | None, rules: SwingRules) -> Timeline | None:
    """Return moves over time, each shaped as little as the swing of the load allows.

    Args:
        crane: The crane.
        moves: In order; each starts where the one before ends.
        pendulum: What hangs on the hook; None if swing is not checked.
        rules: The rules that the motion must satisfy.

    Returns:
        The timeline; None if it is sure to take too long.

    Raises:
        PlanningError: If the load swings too far however slowly the crane goes.
    """
    pacer = Pacer(crane, moves, pendulum)
    if rules.limit_s < np.inf:
        shortest_s = [pacer.profile(n, _SHORTEST).duration_s for n in range(len(moves))]
        if pacer.least_s(shortest_s) >= rules.limit_s + _ROUNDING_S:
            return None
    plain = rules.blend(pacer.in_sequence())
    if pendulum is None:
        return plain
    sway = swaying(plain, pendulum, rules.spacing_m)
    at_s = rules.fault_s(plain, sway)
    if at_s is None:
        return plain
    for calm in (_PLAIN, _SMOOTH) if pendulum.load_ratio else (_PLAIN,):
        fitted = plain
        for _ in range(_FITS):
            shaped = _fitted(pacer, fitted, pendulum, calm)
            if shaped is None:
                break
            fitted = rules.blend(shaped)
            if rules.fault_s(fitted, swaying(fitted, pendulum, rules.spacing_m)) is None:
                return fitted
    return _slower(pacer, plain, sway, at_s, pendulum, rules)


def _fitted(pacer: Pacer, timeline: Timeline, pendulum: Pendulum, calm: Calm) -> Timeline | None:
    """Return a timeline's moves in sequence, shaped together for its overlaps; None if no such shaping is found."""
    others = [pendulum.off[n] for n in _FIT_OFF if pendulum.off]
    hanging, weights = (pendulum, *others), np.array([1.0] + [_OFF_WEIGHT] * len(others))[:, None]

    def residual_m(calms: tuple[Calm, ...]) -> NDArray[np.float64]:
        shaped = overlapping_as(pacer.in_sequence(calms), timeline)
        time_s, axes = _evenly(shaped, np.inf)
        step_s = shaped.duration_s / (len(time_s) - 1)
        return (weights * left_m(timeline.crane, axes, step_s, hanging)).ravel()

    at_rest_m = _OFF_AT_REST_M if pendulum.off else _AT_REST_M
    calms = cancelled(timeline.course.swings, residual_m, calm, at_rest_m)
    return None if calms is None else pacer.in_sequence(calms)


def _slower(
    pacer: Pacer, timeline: Timeline, sway: Swaying, at_s: float | None, pendulum: Pendulum, rules: SwingRules
) -> Timeline | None:
    """Return the timeline with stronger shaping and slower rates, until the load nowhere swings too far."""
    rungs = [0] * len(timeline.moves)
    while at_s is not None:
        # Rounding corners is expensive: first they stay as they are.
        rough = timeline
        while at_s is not None:
            _climb(rungs, rough, sway, at_s)
            if rules.limit_s < np.inf and _least_s(pacer, rungs) >= rules.limit_s + _ROUNDING_S:
                return None
            in_turn = pacer.in_sequence([LADDER[rung] for rung in rungs])
            rough = overlapping_as(in_turn, timeline)
            sway = swaying(rough, pendulum, np.inf)
            at_s = rules.fault_s(rough, sway)
        timeline = rules.blend(in_turn)
        sway = swaying(timeline, pendulum, rules.spacing_m)
        at_s = rules.fault_s(timeline, sway)
    return timeline


def busiest_s(moves: Sequence[Move], lengths_s: Sequence[float]) -> float:
    """Return the running time of the busiest axis: moves that drive the same axis never overlap."""
    busy = [0.0, 0.0, 0.0]
    for move, length_s in zip(moves, lengths_s, strict=True):
        for axis, is_moving in enumerate(move.moving):
            busy[axis] += length_s if is_moving else 0.0
    return max(busy)


def _least_s(pacer: Pacer, rungs: Sequence[int]) -> float:
    """Return a lower bound of the time of moves at these rungs of the ladder, or higher ones."""
    lengths_s = []
    for n, rung in enumerate(rungs):
        # The first rung is the quickest; from the first slow rung on each takes longer than the one before it.
        calms = LADDER[rung : max(rung, FIRST_SLOW) + 1] if rung else LADDER[:1]
        lengths_s.append(min(pacer.profile(n, calm).duration_s for calm in calms))
    return pacer.least_s(lengths_s)


def _climb(rungs: list[int], timeline: Timeline, sway: Swaying, at_s: float) -> None:
    """Move the move at fault for the swing at a time one rung up; ``rungs`` are changed in place."""
    begun = [
        n
        for n, swings in enumerate(timeline.course.swings)
        if swings and timeline.start_s[n] < at_s and rungs[n] + 1 < len(LADDER)
    ]
    if not begun:
        raise PlanningError(
            "the load swings too far however slowly the crane goes",
            hint='[rules] swing = "off" plans without it, and says so',
        )
    # A move that left the load swinging is at fault for the swing after it.
    most_m = PLANNED_RESIDUAL_M
    if at_s == sway.time_s[-1] and sway.swing.amplitude_m[-1] <= PLANNED_RESIDUAL_M:
        sway, most_m = sway.off(timeline.crane), PLANNED_OFF_RESIDUAL_M
    left = [n for n in begun[:-1] if sway.left_by(timeline, n) > _LEFT_SHARE * most_m]
    fault = (left or begun[-1:])[0]
    if sway.pendulum.load_ratio and rungs[fault] + 1 >= FIRST_SLOW:  # no move is slowed alone
        fault = min(begun, key=lambda n: (min(rungs[n], rungs[fault]), n != fault))
    rungs[fault] += 1


def swing_fault_s(
    timeline: Timeline,
    sway: Swaying,
    load: LoadFrame,
    transit: CollisionSpace,
    last: CollisionSpace,
    tail_moves: int,
    straight_below_m: float,
) -> float | None:
    """Return when a load first swings into something, or is not at rest where it must be; None if it never does.

    In transit the load may be anywhere within its swing, to either side. In last moves straight down it hangs at rest;
    in last moves sideways it stays on their line, between its rest position and its swing.

    Args:
        timeline: The moves over time.
        sway: The same with the swing of its load.
        load: How hook poses and reference cells correspond.
        transit: The rule up to the last moves.
        last: The rule for them.
        tail_moves: Number of last moves.
        straight_below_m: Height of the hook at which they begin.
    """
    beyond_m, time_s = sway.swing.beyond_m(PLANNED_RESIDUAL_M), sway.time_s
    swings = [n for n, swings_load in enumerate(timeline.course.swings) if swings_load]
    first_last = len(timeline.moves) - tail_moves
    is_sideways = bool(swings) and swings[-1] >= first_last
    tail_s = timeline.end_s[swings[-1]] if swings else 0.0
    if is_sideways:
        tail_s, straight_below_m = timeline.start_s[first_last], np.inf
    in_transit, in_tail, first_transit, first_tail = _swinging(beyond_m, time_s, sway.axes, tail_s, straight_below_m)
    faults = [float(time_s[-1])] if sway.swing.amplitude_m[-1] > PLANNED_RESIDUAL_M else []
    if not is_sideways and first_tail >= 0:
        faults.append(float(time_s[first_tail]))
    parts = ((in_transit, first_transit, transit, True), (in_tail, first_tail, last, False))
    for part, first, rule, both in parts:
        if first >= 0:
            hit = swaying_is_free(rule, load, sway.axes, beyond_m / load.voxel_size_m, part, both)
            if hit >= 0:
                faults.append(float(time_s[hit]))
    if not faults and sway.left_off_m(timeline.crane) > PLANNED_OFF_RESIDUAL_M:
        return float(time_s[-1])
    return min(faults, default=None)


@kernel
def _swinging(
    beyond_m: NDArray[np.float64],
    time_s: NDArray[np.float64],
    axes: NDArray[np.float64],
    tail_s: float,
    tail_below_m: float,
) -> tuple[NDArray[np.bool_], NDArray[np.bool_], int, int]:
    """Return at which samples the load swings in transit, at which in its last moves, and the first of each or -1.

    The last moves are the samples from a time on with the hook at or below a height.
    """
    count = time_s.shape[0]
    in_transit, in_tail = np.zeros(count, np.bool_), np.zeros(count, np.bool_)
    first_transit, first_tail = -1, -1
    for i in range(count):
        if beyond_m[i, 0] == 0.0 and beyond_m[i, 1] == 0.0:
            continue
        if time_s[i] >= tail_s and axes[i, 2] <= tail_below_m:
            in_tail[i] = True
            first_tail = i if first_tail < 0 else first_tail
        else:
            in_transit[i] = True
            first_transit = i if first_transit < 0 else first_transit
    return in_transit, in_tail, first_transit, first_tail


def _evenly_s(start_s: float, end_s: float, steps: int) -> NDArray[np.float64]:
    """Return ``steps`` + 1 times from start to end: those of ``np.linspace``, which takes ten times as long for it."""
    times_s = np.arange(steps + 1, dtype=np.float64) * ((end_s - start_s) / steps) + start_s
    times_s[-1] = end_s
    return times_s
