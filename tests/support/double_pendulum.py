"""A load below a hook block in space, as an observer who knows nothing of the planner would compute its swing.

Two points on two inextensible links of any angle, the upper one as long as the rope at that time; the pulls in both
links follow from their lengths at every instant. Runge-Kutta of fourth order on cubic splines through the samples.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from bimvox.crane.tower_crane import TowerCrane

G_M_S2 = 9.80665
_STEP_S = 0.02
_AFTER_S = 40.0


@dataclass(frozen=True)
class Load:
    """What hangs on the rope.

    Attributes:
        slings_m: From the hook to the middle of the load.
        block_kg: Mass at the hook.
        load_kg: Mass below it.
    """

    slings_m: float
    block_kg: float
    load_kg: float


def left_m(
    crane: TowerCrane,
    time_s: NDArray[np.float64],
    axes: NDArray[np.float64],
    loads: list[tuple[Load, float]],
    push_n: float = 0.0,
) -> NDArray[np.float64]:
    """Return how far each load swings out on plan after a motion ((N,) times, (N, 3) slew, radius, height).

    Args:
        crane: The crane.
        time_s: (N,) times.
        axes: (N, 3) slew, radius, height at them.
        loads: Each with the length of its rope as a share of the distance from the jib to the hook.
        push_n: A force on each load along x, from the start on.
    """
    course = CubicSpline(time_s, axes, bc_type="clamped")
    end_s = float(time_s[-1])
    slings_m = np.array([load.slings_m for load, _ in loads])
    block_kg, load_kg = (np.array([getattr(load, key) for load, _ in loads]) for key in ("block_kg", "load_kg"))
    share = np.array([share for _, share in loads])
    down = np.array([0.0, 0.0, -G_M_S2])
    pushed = down + np.array([push_n, 0.0, 0.0]) / load_kg[:, None]

    def exit_at(at_s: float) -> tuple[NDArray[np.float64], ...]:
        """Return place, speed and acceleration of the rope's exit, and those of the rope's length."""
        within = float(time_s[0]) <= at_s <= end_s
        q, v, a = (course(min(at_s, end_s), order) * (within or order == 0) for order in range(3))
        cos, sin = np.cos(q[0]), np.sin(q[0])
        out, along = np.array([cos, sin, 0.0]), np.array([-sin, cos, 0.0])
        place = np.array([*crane.base_m[:2], 0.0]) + q[1] * out + np.array([0.0, 0.0, crane.jib_height_m])
        speed = v[1] * out + q[1] * v[0] * along
        bend = (a[1] - q[1] * v[0] ** 2) * out + (q[1] * a[0] + 2.0 * v[1] * v[0]) * along
        return place, speed, bend, np.array([crane.jib_height_m - q[2], -v[2], -a[2]])

    def rates(at_s: float, state: NDArray[np.float64]) -> NDArray[np.float64]:
        place, speed, bend, rope = exit_at(at_s)
        length, grows, grows_more = (share * value for value in rope)
        block, load, block_v, load_v = state
        upper, lower = (block - place) / length[:, None], (load - block) / slings_m[:, None]
        # u . (a_b - a_p) = (l l'' + l'^2 - |v_b - v_p|^2) / l, and the same for the slings, whose length stays.
        between = (upper * lower).sum(1)
        need_u = (length * grows_more + grows**2 - ((block_v - speed) ** 2).sum(1)) / length
        need_l = -((load_v - block_v) ** 2).sum(1) / slings_m
        r_u, r_l = upper @ down - upper @ bend - need_u, (lower * (pushed - down)).sum(1) - need_l
        m = np.stack([1.0 / block_kg, -between / block_kg, -between / block_kg, 1.0 / load_kg + 1.0 / block_kg], 1)
        pulls = np.linalg.solve(m.reshape(-1, 2, 2), np.stack([r_u, r_l], 1)[..., None])[..., 0]
        block_a = down + (pulls[:, 1:] * lower - pulls[:, :1] * upper) / block_kg[:, None]
        load_a = pushed - pulls[:, 1:] * lower / load_kg[:, None]
        return np.stack([block_v, load_v, block_a, load_a])

    place, _, _, rope = exit_at(float(time_s[0]))
    block = place - np.array([0.0, 0.0, 1.0]) * (share * rope[0])[:, None]
    load = block - np.array([0.0, 0.0, 1.0]) * slings_m[:, None]
    state = np.stack([block, load, np.zeros_like(block), np.zeros_like(block)])
    left = np.zeros(len(loads))
    count = int(np.ceil((end_s - time_s[0] + _AFTER_S) / _STEP_S))
    for n in range(count):
        at_s = float(time_s[0]) + n * _STEP_S
        k1 = rates(at_s, state)
        k2 = rates(at_s + _STEP_S / 2, state + _STEP_S / 2 * k1)
        k3 = rates(at_s + _STEP_S / 2, state + _STEP_S / 2 * k2)
        k4 = rates(at_s + _STEP_S, state + _STEP_S * k3)
        state = state + _STEP_S / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
        if at_s >= end_s:
            left = np.maximum(left, np.hypot(*(state[1] - exit_at(end_s)[0]).T[:2]))
    return left
