from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import torch
from lift_sites import building_problems, clearance_of

from bimvox.env.batched import BatchedLiftEnv
from bimvox.env.dynamics import StepLimit
from bimvox.env.lift_env import LiftEnv
from bimvox.env.observation import FRAME_ACTIONS, FRAME_COUNT, GOAL_START
from bimvox.env.problem import default_problem, training_problem
from bimvox.errors import PlanningError
from bimvox.policy.config import DqnConfig
from bimvox.policy.dqn import BatchDqn, dqn_of_lifts, load_network, network_of
from bimvox.policy.manifest import CurvePoint, TrainingStart
from bimvox.policy.train import Evaluation, evaluate, success_at_least, train


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


TINY = DqnConfig(hidden=(16,), lifts=8, batch_size=16, learning_starts=32, gradient_steps=1, test_every=64)


def unsolvable():
    occupied = np.zeros((6, 6, 4), np.bool_)
    occupied[3] = True
    return training_problem(clearance_of(occupied), (0, 0, 0), (5, 0, 0))


@pytest.fixture(scope="module")
def paper_policy():
    return train([default_problem()], DqnConfig(test_every=500), seed=0, steps=6_000)


@pytest.mark.slow
def test_same_seed_same_weights():
    first, second, other = (train([default_problem()], TINY, seed=seed, steps=256) for seed in (1, 1, 2))
    assert first.curve == second.curve
    for name, array in first.network.arrays().items():
        np.testing.assert_array_equal(second.network.arrays()[name], array)
    assert not np.array_equal(first.network.weights[0], other.network.weights[0])


@pytest.mark.slow
def test_training_leaves_no_log_folder_behind(tmp_path, monkeypatch):
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    train([default_problem()], TINY, seed=1, steps=64)
    assert list(tmp_path.glob("SB3*")) == []


@pytest.mark.slow
def test_the_papers_site_is_learned_from_every_yard_start(paper_policy):
    everywhere = evaluate(paper_policy.network, [default_problem()], starts=1_000)
    assert everywhere.arrived.size == 191
    assert everywhere.success_rate >= 0.98
    assert everywhere.length_ratio <= 1.1
    assert paper_policy.steps < 6_000  # it stopped by itself
    assert paper_policy.curve[-1].steps == paper_policy.steps


def test_unseen_obstructions(paper_policy):
    problem = default_problem(obstructions=(((3, 6, 1), (4, 9, 3)), ((10, 11, 1), (13, 12, 3))))
    assert evaluate(paper_policy.network, [problem], starts=1_000).success_rate >= 0.9


def test_a_good_enough_initial_network_is_kept_untrained(paper_policy):
    easy = replace(paper_policy.config, required_success=0.9, required_ratio=1.3)
    again = train([default_problem()], easy, seed=5, steps=6_000, start=TrainingStart(paper_policy.network, "abc"))
    assert again.steps == 0
    assert again.network is paper_policy.network
    assert again.parent == "abc"


@pytest.mark.slow
def test_training_continues_from_a_network(paper_policy):
    strict = replace(paper_policy.config, required_ratio=0.5, exploration_first=0.1)
    more = train([default_problem()], strict, seed=5, steps=600, start=TrainingStart(paper_policy.network))
    assert more.curve[0].steps == 0
    assert len(more.curve) > 1
    assert more.success_rate >= paper_policy.success_rate  # the best tested network is kept


@pytest.mark.slow
def test_several_stages_of_a_building_with_a_rope():
    problems = building_problems(count=6, floors=1, starts=4, shape=(180, 80, 40))
    config = DqnConfig(required_success=0.9, required_ratio=1.5, test_starts=24)
    trained = train([*problems, unsolvable()], config, seed=0, steps=24_000)
    assert trained.tested == 24  # the unsolvable one is left out
    assert trained.success_rate >= 0.9


def test_progress_and_checkpoints_follow_the_tests():
    points: list[CurvePoint] = []
    checkpoints = []
    trained = train([default_problem()], TINY, seed=0, steps=200, progress=points.append, checkpoint=checkpoints.append)
    assert [point.steps for point in points] == [64, 128, 192, 200]
    assert tuple(points) == trained.curve
    assert [checkpoint.steps for checkpoint in checkpoints] == [64, 128, 192, 200]
    assert trained.success_rate == max(point.success_rate for point in points)


def test_nothing_to_learn_is_an_error():
    with pytest.raises(PlanningError, match="none of 2 lifts"):
        train([unsolvable(), unsolvable()], TINY, seed=0, steps=100)


def dqn(**choices) -> BatchDqn:
    return dqn_of_lifts(BatchedLiftEnv([default_problem()], 8), replace(TINY, **choices), 0)


def test_weights_are_returned_and_loaded_unchanged():
    first, second = dqn(), dqn(learning_rate=0.1)
    with torch.no_grad():
        for parameter in first.q_net.parameters():
            parameter.add_(0.01)
    load_network(second, network_of(first))
    observations = first.env.reset()
    expected = first.q_net(torch.from_numpy(observations)).detach().numpy()
    np.testing.assert_allclose(network_of(second)(observations), expected, atol=1e-4)
    for q_net in (second.q_net, second.q_net_target):
        np.testing.assert_array_equal(q_net(torch.from_numpy(observations)).detach().numpy(), expected)
    with pytest.raises(ValueError, match="does not fit"):
        load_network(dqn(hidden=(4,)), network_of(first))


def test_blocked_actions_are_never_chosen():
    learner = dqn()
    batch = learner.env.batch
    learner.env.reset()
    for lift in range(8):
        batch.place(lift, 0, (0, 0, 2))
    observations = batch.step(np.full(8, 4)).observations  # up from the corner: two walls remain
    assert not {1, 2} & set(learner.predict(observations, deterministic=True)[0].tolist())


def test_a_mirrored_site_is_the_same_to_the_network():
    """Values of the mirrored view are the mirrored values, by the frame, whatever the weights."""
    learner = dqn()
    network = network_of(learner)
    occupied = np.random.default_rng(0).random((20, 20, 8)) < 0.1
    occupied[4:7, 4:7, 3:5] = occupied[12:15, 9:12, 3:5] = False
    mirrored = np.ascontiguousarray(occupied[::-1])
    first = training_problem(clearance_of(occupied), (5, 5, 3), (13, 10, 4))
    second = training_problem(clearance_of(mirrored), (14, 5, 3), (6, 10, 4))
    values = []
    for problem in (first, second):
        batch = BatchedLiftEnv([problem], 1)
        batch.reset()
        batch.place(0, 0, problem.start_vox)
        env = LiftEnv([problem])
        values.append(network(env.reset(options={"start": problem.start_vox})[0][None])[0])
    np.testing.assert_allclose(values[1], values[0][[0, 1, 3, 2, 4, 5]], atol=1e-6)


@pytest.mark.slow
def test_an_interrupted_training_resumes(tmp_path):
    checkpoints = []
    whole = train([default_problem()], TINY, seed=0, steps=200, checkpoint=checkpoints.append)
    resumed = train([default_problem()], TINY, seed=0, steps=200, start=TrainingStart(resumed=checkpoints[1]))
    assert resumed.curve[:2] == whole.curve[:2]
    assert [point.steps for point in resumed.curve] == [64, 128, 192, 200]
    assert (
        train([default_problem()], TINY, seed=0, steps=200, start=TrainingStart(resumed=whole)).network is whole.network
    )


@pytest.mark.parametrize("double_q", [True, False])
def test_the_target_network_is_copied_after_so_many_gradient_steps(double_q):
    learner = dqn(double_q=double_q, target_update=3, learning_starts=8)
    target = learner.q_net_target.q_net[0].weight.detach().clone()
    learner.learn(8 * 3)  # two gradient steps
    assert torch.equal(learner.q_net_target.q_net[0].weight, target)
    assert not torch.equal(learner.q_net.q_net[0].weight, target)
    learner.learn(8, reset_num_timesteps=False)
    assert torch.equal(learner.q_net_target.q_net[0].weight, learner.q_net.q_net[0].weight)
