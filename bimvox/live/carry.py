"""Carrying a load along a way through traffic, and waiting, tick by tick."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import kernel, leaf_kernel
from bimvox.live.move import pass_tick
from bimvox.live.pace import ahead, gap_m, placed, quicker, resting, slower
from bimvox.live.shield import is_clear
from bimvox.live.traffic import RADIUS, Crowd, Ground, Habits, Sight, X, Y
from bimvox.live.way import Way

_SETTLES = 40
"""Ticks at rest after which tag lines have brought a load to rest."""


@kernel
def idle(
    ground: Ground,
    habits: Habits,
    crowd: Crowd,
    sight: Sight,
    ticks: int,
    load: NDArray[np.float64],
    tape: NDArray[np.float64],
) -> None:
    """Let time pass without a suspended load; ``tape`` as for ``carry``."""
    for tick in range(ticks):
        pass_tick(ground, habits, crowd, sight.delay, sight.noise_m, load, False)
        _note(tape, tick, 0.0, 0.0, crowd)


@kernel
def carry(
    way: Way,
    ground: Ground,
    habits: Habits,
    crowd: Crowd,
    sight: Sight,
    ticks: tuple[int, int],
    plan: NDArray[np.float64],
    tape: NDArray[np.float64],
) -> int:
    """Carry a load along a way, and hold it at its place while a crew fixes it; return the ticks this takes.

    Args:
        way: The way.
        ground: Where others go.
        habits: How they behave.
        crowd: Everyone; changed.
        sight: How they are seen.
        ticks: How long the load is held at its place; after how many ticks to give up.
        plan: Room for the shield's predictions.
        tape: (M, 2 + 4 N) receives after every tick, as far as there is room, place in rows and pace, then of each of
            N others its place and where it is seen; M and N may be 0.
    """
    at, pace, used, left, spent, still = 0.0, 0.0, 0.0, way.delay, 0, 0
    end = float(way.rests.shape[0] - 1)
    load = np.empty(plan.shape[1])
    while at < end and spent < ticks[1]:
        before, after, yields = pace, pace, False
        if resting(way, at) and resting(way, min(at + 1.0, end)):
            before = after = 1.0  # a crew works on a load at rest: nothing to yield for
            left = way.delay
        elif is_clear(way, (at, pace, used), True, crowd, sight.delay, sight.noise_m, plan):
            after, left = quicker(way, at, pace), way.delay
        elif pace > 0.0 and is_clear(way, (at, pace, used), False, crowd, sight.delay, sight.noise_m, plan):
            left = way.delay
        elif resting(way, at):
            before = after = 0.0
            yields, left = True, way.delay
        elif left > 0:
            left -= 1
            yields = True
        else:
            after, yields = slower(way, at, pace), True
        at, pace = ahead(way, at, before, after), after
        if pace == 0.0 or resting(way, at):
            still += 1
            used = 0.0 if still > _SETTLES else used
        else:
            still, used = 0, max(used, pace)
        placed(way, at, used, load)
        pass_tick(ground, habits, crowd, sight.delay, sight.noise_m, load, at > 0.0 and still > 0)
        _count(crowd, load, at > 0.0, yields)
        _note(tape, spent, at, pace, crowd)
        spent += 1
    if at >= end:
        for _ in range(ticks[0]):
            pass_tick(ground, habits, crowd, sight.delay, sight.noise_m, load, True)
            _count(crowd, load, True, False)
            _note(tape, spent, at, 0.0, crowd)
            spent += 1
    return spent


@leaf_kernel
def _note(tape: NDArray[np.float64], row: int, at: float, pace: float, crowd: Crowd) -> None:
    if row < tape.shape[0]:
        tape[row, 0], tape[row, 1] = at, pace
        for n in range((tape.shape[1] - 2) // 4):
            tape[row, 2 + 4 * n], tape[row, 3 + 4 * n] = crowd.state[n, X], crowd.state[n, Y]
            tape[row, 4 + 4 * n], tape[row, 5 + 4 * n] = crowd.seen_m[n, 0], crowd.seen_m[n, 1]


@kernel
def _count(crowd: Crowd, load: NDArray[np.float64], suspended: bool, yields: bool) -> None:
    """Count a tick at which the load, within its swing, is over anyone, and one at which the crane yields."""
    for n in range(crowd.state.shape[0]):
        if suspended and gap_m(load, crowd.state[n, X], crowd.state[n, Y]) <= load[8] + crowd.state[n, RADIUS]:
            crowd.counts[1] += 1.0
    if yields:
        crowd.counts[2] += 1.0
