"""What the crane is told: rates of the three axes at a set rate."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bimvox.errors import InputError
from bimvox.trajectory.motion import LiftMotion, PhaseName
from bimvox.trajectory.timing import NS_PER_S


@dataclass(frozen=True, slots=True)
class CraneCommand:
    """Rates to hold from one command to the next, and where they lead.

    A crane that starts at the motion's first pose and holds each command's rates until the next one is at every
    command's time exactly where the motion is.

    Attributes:
        time_ns: When it is given, on the site's clock.
        order: The lift's position in the assembly order.
        component: Index into ``Site.components``.
        phase: Phase of the lift.
        slew_rate_rad_s: Slewing rate, counter-clockwise positive.
        trolley_rate_m_s: Trolley rate, outward positive.
        hoist_rate_m_s: Hoisting rate, up positive.
        target_slew_rad: Slewing angle at the next command.
        target_radius_m: Radius at the next command.
        target_height_m: Height of the hook at the next command.
        loaded: Whether the part hangs on the hook.
    """

    time_ns: int
    order: int
    component: int
    phase: PhaseName
    slew_rate_rad_s: float
    trolley_rate_m_s: float
    hoist_rate_m_s: float
    target_slew_rad: float
    target_radius_m: float
    target_height_m: float
    loaded: bool


_LOADED = frozenset(
    (
        PhaseName.RAISE,
        PhaseName.TURN,
        PhaseName.HOIST,
        PhaseName.TRAVERSE,
        PhaseName.LOWER,
        PhaseName.SET,
        PhaseName.STOP,
    )
)


def commands(motions: Sequence[LiftMotion], period_s: float) -> tuple[CraneCommand, ...]:
    """Return the commands of motions: one at every multiple of the period and at every start of a phase.

    The last command of each lift, at its end, has zero rates.

    Args:
        motions: Lifts in order.
        period_s: Time between commands.

    Raises:
        InputError: If the period is not positive.
    """
    result: list[CraneCommand] = []
    for motion in motions:
        time_ns, axes = motion.samples()
        lifted_ns = motion.start_ns + int(motion.raising.time_ns[0])
        result += commands_along(
            time_ns,
            axes,
            period_s,
            order=motion.order,
            component=motion.component,
            phase_at=motion.phase_name_at,
            is_loaded=_is_loaded_from(lifted_ns),
            starts_ns=[phase.start_ns for phase in motion.phases],
        )
    return tuple(result)


def _is_loaded_from(lifted_ns: int) -> Callable[[int, PhaseName], bool]:
    """Whether the part hangs on the hook, when it is lifted at a time: a stop before that is one of the empty hook."""
    return lambda time_ns, phase: phase in _LOADED and time_ns >= lifted_ns


def commands_along(
    time_ns: NDArray[np.int64],
    axes: NDArray[np.float64],
    period_s: float,
    *,
    order: int,
    component: int,
    phase_at: Callable[[int], PhaseName],
    is_loaded: Callable[[int, PhaseName], bool],
    starts_ns: Sequence[int] = (),
) -> tuple[CraneCommand, ...]:
    """Return the commands along one series of samples: one at every multiple of the period, the last with zero rates.

    Args:
        time_ns: (N,) int64 on the site's clock, ascending.
        axes: (N, 3) slew (rad), radius (m), height (m).
        period_s: Time between commands.
        order: The lift's position in the assembly order.
        component: Index into ``Site.components``.
        phase_at: The phase at a time.
        is_loaded: Whether the part hangs on the hook at a time, in a phase.
        starts_ns: Other times of a command.

    Raises:
        InputError: If the period is not positive.
    """
    if not period_s > 0.0:
        raise InputError(f"a command period of {period_s:g} s", hint="give a positive time")
    period_ns = max(1, round(period_s * NS_PER_S))
    start_ns, end_ns = int(time_ns[0]), int(time_ns[-1])
    regular = np.arange(-(-start_ns // period_ns) * period_ns, end_ns, period_ns, dtype=np.int64)
    at_ns = np.unique(np.concatenate([regular, np.array([start_ns, *starts_ns, end_ns], np.int64)]))
    since = (at_ns - start_ns).astype(np.float64)
    own = (time_ns - start_ns).astype(np.float64)
    poses = np.stack([np.interp(since, own, axis) for axis in axes.T], axis=1)
    rates = np.diff(poses, axis=0) / (np.diff(at_ns)[:, None] / NS_PER_S)
    rates = np.concatenate([rates, np.zeros((1, 3))])
    targets = np.concatenate([poses[1:], poses[-1:]])
    result: list[CraneCommand] = []
    phase, until_ns = phase_at(start_ns), -1
    borders_ns = iter([*sorted(starts_ns), end_ns + 1])
    for t, rate, target in zip(at_ns.tolist(), rates.tolist(), targets.tolist(), strict=True):
        if t >= until_ns:  # the phase is asked for only where it may change
            phase, until_ns = phase_at(t), next((border for border in borders_ns if border > t), end_ns + 1)
        rates_and_targets = (rate[0], rate[1], rate[2], target[0], target[1], target[2])
        result.append(CraneCommand(t, order, component, phase, *rates_and_targets, is_loaded(t, phase)))
    return tuple(result)
