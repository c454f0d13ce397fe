"""Phases of a carried load are called what the crane does in them."""

from __future__ import annotations

import numpy as np
import pytest

from bimvox.proof.clock import check_phase_names
from bimvox.records.motion import LiftMotion, Phase, PhaseName, Trajectory
from bimvox.records.proof import Check

H, T, L, STOP = PhaseName.HOIST, PhaseName.TRAVERSE, PhaseName.LOWER, PhaseName.STOP
WAY = [(0, 0.0, 5.0), (20, 0.0, 15.0), (60, 1.0, 15.0), (80, 1.0, 6.0)]
"""Seconds, slewing angle and height: up for 20 s, aside for 40 s, down for 20 s."""
DOWN_TWICE = [(0, 0.0, 15.0), (10, 0.0, 12.0), (30, 0.5, 12.0), (40, 0.5, 6.0)]


def motion_of(way: list[tuple[float, float, float]], *phases: tuple[PhaseName, float]) -> LiftMotion:
    """The motion along straight pieces, sampled every half second, and phases with their ends in seconds."""
    times, slews, heights = np.array(way, float).T
    time_s = np.arange(0.0, times[-1] + 0.25, 0.5)
    time_ns = (time_s * 1e9).astype(np.int64)
    slew, height = np.interp(time_s, times, slews), np.interp(time_s, times, heights)
    loaded = Trajectory(time_ns, slew, np.full_like(slew, 9.0), height, np.zeros(0, np.int64), 0.0)
    start_ns, named = 7_000_000_000, []
    at_ns = start_ns
    for name, end_s in (*phases, (PhaseName.SET, times[-1] + 60.0)):
        end_ns = start_ns + round(end_s * 1e9)
        named.append(Phase(name, at_ns, end_ns))
        at_ns = end_ns
    return LiftMotion(0, 0, None, loaded, loaded, tuple(named), start_ns, at_ns)


def refused(motion: LiftMotion) -> list[str]:
    check = Check("timeline")
    check_phase_names(check, "lift 1 (beam)", motion)
    assert check.samples
    return check.failures


@pytest.mark.parametrize(
    "motion",
    [
        motion_of(WAY, (H, 20), (T, 60), (L, 80)),
        motion_of(WAY, (H, 19), (T, 59), (L, 80)),
        motion_of(WAY[:3], (H, 20), (T, 60)),
        motion_of([(0, 1.0, 15.0), (20, 1.0, 6.0)], (L, 20)),
        motion_of(
            [*WAY[:2], (40, 0.5, 15.0), (50, 0.5, 15.0), (70, 1.0, 15.0), (90, 1.0, 6.0)],
            (H, 20),
            (T, 40),
            (STOP, 50),
            (T, 70),
            (L, 90),
        ),
        motion_of(DOWN_TWICE, (H, 10), (T, 30), (L, 40)),
    ],
)
def test_true_names_are_proven(motion: LiftMotion):
    assert refused(motion) == []


@pytest.mark.parametrize(
    ("motion", "says"),
    [
        (motion_of(WAY, (H, 60), (L, 80)), "it slews or trolleys in its phase hoist, which begins at 7.000 s"),
        (motion_of(WAY, (T, 60), (L, 80)), "begins at 7.000 s, it slews or trolleys only after 20.0 s"),
        (motion_of(WAY, (H, 20), (L, 80)), "begins at 27.000 s, it is not lowered for 40.0 s"),
        (motion_of(WAY, (L, 80)), "it is hoisted in its phase lower, which begins at 7.000 s"),
        (motion_of(WAY, (H, 20), (T, 80)), "it is lowered for 20.0 s before it is set, in its phase traverse"),
        (motion_of(WAY, (H, 1e-9), (T, 60), (L, 80)), "begins at 7.000 s, it slews or trolleys only after 19.5 s"),
        (motion_of(DOWN_TWICE, (L, 40)), "begins at 7.000 s, it is not lowered for 20.0 s"),
        (motion_of(DOWN_TWICE[:2], (H, 10)), "it is lowered for 10.0 s before it is set, in its phase hoist"),
    ],
)
def test_false_names_are_refused(motion: LiftMotion, says: str):
    failures = refused(motion)
    assert len(failures) == 1
    assert failures[0].startswith("lift 1 (beam): ")
    assert says in failures[0]
