"""The crane's commands: rates of its three axes, one command a period."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from bimvox.errors import InputError
from bimvox.records.motion import LiftMotion, PhaseName
from bimvox.units import NS_PER_S


@dataclass(frozen=True, slots=True)
class _CraneCommand:
    """Rates to hold from one command to the next, and the pose that they lead to.

    A crane that starts at the motion's first pose and holds each command's rates until the next one is at the motion's
    pose at the time of every command.

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


PHASES = tuple(PhaseName)
"""The phases in the order that ``Commands.phase`` indexes."""

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


@dataclass(frozen=True, slots=True, eq=False)
class Commands:
    """The commands of one lift, column by column; also a sequence of ``_CraneCommand``.

    Attributes:
        order: The lift's position in the assembly order.
        component: Index into ``Site.components``.
        time_ns: (N,) int64 when each is given, on the site's clock, ascending.
        phase: (N,) int64 index into ``PHASES``.
        rates: (N, 3) float64 slewing (rad/s), trolley (m/s) and hoisting rate (m/s), to hold until the next one.
        targets: (N, 3) float64 slew (rad), radius (m) and height (m) at the next one.
        loaded: (N,) bool, whether the part hangs on the hook.
    """

    order: int
    component: int
    time_ns: NDArray[np.int64]
    phase: NDArray[np.int64]
    rates: NDArray[np.float64]
    targets: NDArray[np.float64]
    loaded: NDArray[np.bool_]

    def __len__(self) -> int:
        return len(self.time_ns)

    def __getitem__(self, number: int) -> _CraneCommand:
        slew_rate, trolley_rate, hoist_rate = self.rates[number].tolist()
        slew, radius, height = self.targets[number].tolist()
        return _CraneCommand(
            time_ns=int(self.time_ns[number]),
            order=self.order,
            component=self.component,
            phase=PHASES[self.phase[number]],
            slew_rate_rad_s=slew_rate,
            trolley_rate_m_s=trolley_rate,
            hoist_rate_m_s=hoist_rate,
            target_slew_rad=slew,
            target_radius_m=radius,
            target_height_m=height,
            loaded=bool(self.loaded[number]),
        )

    def __iter__(self) -> Iterator[_CraneCommand]:
        return (self[number] for number in range(len(self)))


def commands(motion: LiftMotion, period_s: float) -> Commands:
    """Return the commands of a motion: one at every multiple of the period and at every start of a phase.

    The last one, at its end, has zero rates.

    Raises InputError: if the period is not positive.
    """
    if not period_s > 0.0:
        raise InputError(f"a command period of {period_s:g} s", hint="give a positive time")
    period_ns = max(1, round(period_s * NS_PER_S))
    first_ns = -(-motion.start_ns // period_ns) * period_ns
    return commands_at(motion, np.arange(first_ns, motion.end_ns, period_ns, dtype=np.int64))


def commands_at(motion: LiftMotion, at_ns: NDArray[np.int64]) -> Commands:
    """Return the commands of a motion at some of its times, at every start of a phase, at its start and its end.

    ``at_ns``: (N,) int64 times from its start to its end.
    """
    time_ns, axes = motion.samples()
    lifted_ns = motion.start_ns + int(motion.raising.time_ns[0])
    starts_ns = [phase.start_ns for phase in motion.phases]
    start_ns, end_ns = int(time_ns[0]), int(time_ns[-1])
    at_ns = np.sort(np.concatenate([at_ns, np.array([start_ns, *starts_ns, end_ns], np.int64)]))
    at_ns = at_ns[np.append(True, at_ns[1:] > at_ns[:-1])]
    since = (at_ns - start_ns).astype(np.float64)
    own = (time_ns - start_ns).astype(np.float64)
    poses = np.stack([np.interp(since, own, axis) for axis in axes.T], axis=1)
    rates = np.zeros_like(poses)
    rates[:-1] = np.diff(poses, axis=0) / (np.diff(at_ns)[:, None] / NS_PER_S)
    targets = np.concatenate([poses[1:], poses[-1:]])
    phases, loaded = np.empty(len(at_ns), np.int64), np.empty(len(at_ns), np.bool_)
    borders = np.searchsorted(at_ns, np.array(sorted({start_ns, *starts_ns}), np.int64)).tolist()
    for begin, end in pairwise([*borders, len(at_ns)]):
        phase = motion.phase_name_at(int(at_ns[begin]))
        phases[begin:end] = PHASES.index(phase)
        # A stop before the part is lifted is a stop of the empty hook.
        loaded[begin:end] = (at_ns[begin:end] >= lifted_ns) & (phase in _LOADED)
    return Commands(motion.order, motion.component, at_ns, phases, rates, targets, loaded)
