from __future__ import annotations

import numpy as np
import pytest
from lift_sites import clearance_of

from bimvox.env.dynamics import StepLimit
from bimvox.env.frame import FRAME_ACTIONS, FRAME_COUNT
from bimvox.env.observation import GOAL_START
from bimvox.env.problem import default_problem, training_problem
from bimvox.policy.train import Evaluation, evaluate, success_at_least


def beeline(observations: np.ndarray) -> np.ndarray:
    dx, dy, dz = observations[:, GOAL_START + 9 : GOAL_START + 12].T
    in_frame = np.stack([dy, -dy, -dx, dx, dz, -dz], axis=1).astype(np.float32)
    frames = np.rint(observations[:, -1] * (FRAME_COUNT - 1)).astype(int)
    return np.take_along_axis(in_frame, FRAME_ACTIONS[frames], axis=1)


def test_every_start_is_tried_where_there_is_room_for_it():
    result = evaluate(beeline, [default_problem()], starts=1_000)
    assert result.arrived.all()
    assert result.arrived.size == 191
    np.testing.assert_array_equal(result.moves, result.shortest)
    assert (result.success_rate, result.length_ratio) == (1.0, 1.0)


def test_starts_are_spread_over_problems():
    occupied = np.zeros((40, 6, 4), np.bool_)
    occupied[20, :, :3] = True
    walled = training_problem(clearance_of(occupied), (0, 0, 0), (30, 3, 0), [(n, 0, 0) for n in range(15)])
    result = evaluate(beeline, [default_problem(), walled] * 20, starts=120)
    assert np.bincount(result.problem).tolist() == [3] * 40
    assert result.arrived[result.problem % 2 == 0].all()
    strict = evaluate(lambda rows: -beeline(rows), [walled], starts=5, limit=StepLimit(1.0, 0))
    assert not strict.arrived.any()
    assert strict.length_ratio == 0.0


def test_rates():
    result = Evaluation(
        np.zeros(4, np.int64), np.array([1, 1, 0, 1], np.bool_), np.array([10, 12, 99, 30]), np.array([10, 10, 9, 20])
    )
    assert result.success_rate == 0.75
    assert result.length_ratio == np.mean([1.0, 1.2, 1.5])


def test_how_sure_a_success_rate_is():
    assert success_at_least(256, 256) == pytest.approx(0.05 ** (1 / 256))
    assert success_at_least(0, 10) == 0.0
    assert success_at_least(95, 100) == pytest.approx(0.8977, abs=1e-3)
    assert success_at_least(3, 3) == pytest.approx(0.05 ** (1 / 3))
