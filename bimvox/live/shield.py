"""The shield: whether the crane may go on for a tick, whoever moves how; and carrying a load under it.

Rule. A suspended load that moves, hoisting and lowering included, yields: it never comes over anybody or any vehicle.
The zone below a load that is suspended at rest is closed: nobody enters it. So before every tick the shield takes the
crane's state and what was seen, lets the crane go on for one tick, continue for the delay before the brakes act, and
brake to rest. If nobody who moves with the highest speed that is assumed, in any direction, can meanwhile come under
the load within its swing, the crane may go on. Otherwise it does what the last such prediction said: it brakes.
By induction, nobody is ever under the load: the prediction that was clear is the one that is carried out.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import kernel, leaf_kernel
from bimvox.live.traffic import FASTEST, RADIUS, Crowd, Ground, Habits, Sight, X, Y, pass_tick
from bimvox.live.way import TICK_S, Way, ahead, gap_m, placed, quicker, resting, slower

LOAD_COLUMNS = 9
"""Of ``placed``."""
_BULGE_M = 0.05
"""How far the load's way may bulge between two ticks, beyond the chord."""
_LONGEST = 256


@kernel
def _is_clear(
    way: Way,
    state: tuple[float, float, float],
    gains: bool,
    crowd: Crowd,
    delay: int,
    noise_m: float,
    plan: NDArray[np.float64],
) -> bool:
    """Return whether the crane may go on for a tick.

    ``state``: where the load is, in rows, the pace, and the highest pace since the load last hung still; ``gains``:
    whether the crane gains speed in this tick; otherwise it keeps its pace; ``delay``: ticks by which they are seen
    late; ``noise_m``: largest error of a seen place; ``plan``: (M, 9) room for the prediction.
    """
    at, pace, used = state
    placed(way, at, used, plan[0])
    count, low_x, high_x, low_y, high_y, half = 1, plan[0, 0], plan[0, 0], plan[0, 1], plan[0, 1], 0.0
    ticks, ends = 0, False
    while count < plan.shape[0] and not ends:
        if ticks == 0:
            after = quicker(way, at, pace) if gains else pace
        elif ticks <= way.delay:
            after = pace
        else:
            after = slower(way, at, pace)
        was = at
        at, pace = ahead(way, at, pace, after), after
        used = max(used, pace)
        placed(way, at, used, plan[count])
        count += 1
        ticks += 1
        ends = resting(way, at) or pace == 0.0 or at == was
    if not ends:
        return False
    for j in range(count):
        low_x, high_x = min(low_x, plan[j, 0]), max(high_x, plan[j, 0])
        low_y, high_y = min(low_y, plan[j, 1]), max(high_y, plan[j, 1])
        reach = max(max(-plan[j, 4], plan[j, 6]), max(-plan[j, 5], plan[j, 7]))
        half = max(half, 1.4143 * reach + plan[j, 8])
    for n in range(crowd.state.shape[0]):
        x, y, fastest = crowd.seen_m[n, 0], crowd.seen_m[n, 1], crowd.state[n, FASTEST]
        near = crowd.state[n, RADIUS] + noise_m + fastest * (delay + 0.5) * TICK_S + 2.0 * _BULGE_M
        most = near + fastest * count * TICK_S + half + 4.0 * TICK_S
        if x < low_x - most or x > high_x + most or y < low_y - most or y > high_y + most:
            continue
        for j in range(count):
            chord = max(
                _chord_m(plan[j], plan[max(j - 1, 0)], half), _chord_m(plan[j], plan[min(j + 1, count - 1)], half)
            )
            if gap_m(plan[j], x, y) <= near + fastest * j * TICK_S + plan[j, 8] + chord:
                return False
    return True


@leaf_kernel
def _chord_m(load: NDArray[np.float64], other: NDArray[np.float64], half: float) -> float:
    """Return by how much no point of a load moves further between two ticks."""
    turns = abs(load[2] - other[2]) + abs(load[3] - other[3])
    return float(np.hypot(load[0] - other[0], load[1] - other[1]) + half * turns)


def prediction_room() -> NDArray[np.float64]:
    """Return room for a prediction."""
    return np.zeros((_LONGEST, LOAD_COLUMNS))


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
        # The pace after this tick: quicker if it is clear, the same, or slower; at a rest after a delay.
        before, after, yields = pace, pace, False
        if resting(way, at) and resting(way, min(at + 1.0, end)):
            before = after = 1.0  # a crew works on a load at rest: nothing to yield for
            left = way.delay
        elif _is_clear(way, (at, pace, used), True, crowd, sight.delay, sight.noise_m, plan):
            after, left = quicker(way, at, pace), way.delay
        elif pace > 0.0 and _is_clear(way, (at, pace, used), False, crowd, sight.delay, sight.noise_m, plan):
            left = way.delay
        elif resting(way, at):
            before = after = 0.0
            yields, left = True, way.delay
        elif left > 0:
            left -= 1
            yields = True
        else:
            after, yields = slower(way, at, pace), True
        # Move the load and everyone else by a tick, and count what happened.
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
    # A crew fixes the part: the load is held at its place.
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
