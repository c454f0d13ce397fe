"""Moves shaped together cancel the swing that plain shaping leaves, without taking longer."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from named_cranes import default_crane

from bimvox.crane.tower_crane import CranePose
from bimvox.motion.move import Move
from bimvox.motion.profile import Calm
from bimvox.motion.steady import SwingRules, cancelled, steadied, swaying
from bimvox.motion.swing import PLANNED_RESIDUAL_M, Pendulum
from bimvox.motion.timeline import in_sequence, overlapping_as

PENDULUM = Pendulum(3.0)


def settings_of(calms):
    return np.array([(calm.parts[0], calm.stretch) for calm in calms])


@given(st.integers(0, 10_000))
def test_a_swing_that_shaping_causes_is_cancelled(seed):
    rng = np.random.default_rng(seed)
    wanted = np.array([0.5, 1.0]) + rng.uniform(-0.1, 0.1, (2, 2))
    effect_m = np.linalg.qr(rng.normal(size=(4, 4)))[0]

    def residual_m(calms):
        return effect_m @ (settings_of(calms)[[0, 2]] - wanted).ravel()

    found = cancelled((True, False, True), residual_m)
    if np.linalg.norm(residual_m((Calm(),) * 3)) <= 0.25 * PLANNED_RESIDUAL_M:
        assert found is None  # no swing to cancel
        return
    assert found is not None
    assert np.abs(settings_of(found)[[0, 2]] - wanted).max() < 1e-3
    assert all(sum(calm.parts) == 1.0 and calm.pace == 1.0 for calm in found)
    assert settings_of(found)[1].tolist() == [0.5, 1.0]


def test_what_no_shaping_cancels_is_left_to_slower_motions():
    asked = []

    def residual_m(calms):
        asked.append(calms)
        return np.array([0.5, 0.0, 0.0, 0.0]) + 1e-3 * settings_of(calms).sum()

    assert cancelled((True,), residual_m) is None
    assert len(asked) < 5
    assert cancelled((False,), residual_m) is None


def test_slewing_while_the_trolley_moves_out_ends_at_rest_at_full_speed():
    crane = default_crane("hammerhead-75", jib_height_m=60.0)
    a, b, c = CranePose(0.0, 21.0, 7.0), CranePose(-2.13, 21.0, 7.0), CranePose(-2.13, 39.6, 7.0)
    moves = [Move(a, b), Move(b, c)]

    def both_end_together(timeline):
        first, second = timeline.profiles
        overlapping = (0.0, first.duration_s - min(first.duration_s, second.duration_s))
        return overlapping_as(timeline, replace(timeline, start_s=overlapping))

    def fault_s(timeline, sway):
        return None if sway.swing.amplitude_m[-1] <= PLANNED_RESIDUAL_M else float(sway.time_s[-1])

    plain = both_end_together(in_sequence(crane, moves, PENDULUM))
    assert swaying(plain, PENDULUM, 0.25).swing.amplitude_m[-1] > 2.0 * PLANNED_RESIDUAL_M
    steady = steadied(crane, moves, PENDULUM, SwingRules(both_end_together, fault_s, 0.25))
    assert swaying(steady, PENDULUM, 0.25).swing.amplitude_m[-1] <= PLANNED_RESIDUAL_M
    assert steady.duration_s == pytest.approx(plain.duration_s, rel=0.05)
