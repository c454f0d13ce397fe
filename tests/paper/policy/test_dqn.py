from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import torch
from paper_lessons import QUICK, SLOW, TINY, network_that_always
from stable_baselines3.common.save_util import load_from_zip_file

from bimvox.paper.env.batched import BatchedPaperSite
from bimvox.paper.policy.dqn import PaperDqn
from bimvox.paper.policy.torch_network import arrays_of
from bimvox.paper.policy.vec_env import PaperVecEnv
from bimvox.policy.learner.priorities import Priorities


def dqn(config=SLOW, *, budget=1_000, initial=None, **changes):
    config = replace(config, **changes)
    observation = "paper_flat" if config.observation == "paper" else config.observation
    batch = BatchedPaperSite(TINY, config.sites, observation=observation, reward=config.reward, threads=1)
    return PaperDqn(PaperVecEnv(batch), config, seed=3, budget=budget, initial=initial)


@pytest.mark.slow
def test_the_plain_network_is_the_torch_network():
    learner = dqn()
    observations = learner.env.reset().repeat(3, axis=0)
    observations += np.random.default_rng(0).random(observations.shape, np.float32)
    expected = learner.q_net(torch.from_numpy(observations)).detach().numpy()
    np.testing.assert_allclose(arrays_of(learner.q_net)(observations), expected, atol=1e-4)
    np.testing.assert_array_equal(learner.network(observations), arrays_of(learner.q_net)(observations))


@pytest.mark.slow
def test_two_streams_without_a_layer_in_common_that_begin_after_glorot():
    network = dqn().network
    assert network.actions.layer_sizes == (5 * 5 * 6, 16, 16, 6)
    assert network.state.layer_sizes == (5 * 5 * 6, 16, 16, 1)
    for stream in (network.actions, network.state):
        assert all((bias == 0).all() for bias in stream.biases)
        limit = np.sqrt(6 / (150 + 16))
        assert 0.9 * limit < np.abs(stream.weights[0]).max() <= limit


def test_one_stream_where_it_is_not_dueling():
    assert dqn(dueling=False).network.state is None


def test_the_share_of_random_actions_falls_over_a_tenth_of_the_budget():
    learner = dqn(budget=1_000)
    rates = []
    for steps in (0, 50, 100, 900):
        learner.num_timesteps = steps
        learner._on_step()
        rates.append(learner.exploration_rate)
    assert rates == pytest.approx([1.0, 0.51, 0.02, 0.02])


def test_a_loaded_network_explores_as_much_as_it_is_told():
    loaded = dqn(exploration_again=0.3).network
    learner = dqn(exploration_again=0.3, initial=loaded)
    assert learner.exploration_rate == 0.3
    np.testing.assert_array_equal(learner.network.actions.weights[0], loaded.actions.weights[0])


def test_no_warm_up_of_random_actions_only():
    always_up = network_that_always(4, 150, SLOW.hidden)
    learner = dqn(dueling=False, initial=always_up, exploration_again=0.0, exploration_last=0.0)
    learner.learn(20)
    assert set(learner.replay_buffer.actions[:20].ravel()) == {4}


def test_each_site_explores_on_its_own():
    learner = dqn(QUICK, initial=None)
    observations = np.repeat(learner.env.reset()[:1], 600, axis=0)
    learner.exploration_rate = 0.5
    actions, _ = learner.predict(observations)
    greedy, _ = learner.predict(observations, deterministic=True)
    assert len(set(greedy.tolist())) == 1
    assert 0.35 < (actions != greedy).mean() < 0.5


def test_some_sites_may_explore_more_than_others():
    learner = dqn(QUICK, exploration_spread=True)
    learner.exploration_rate = 0.2
    observations = learner.env.reset()
    greedy, _ = learner.predict(observations, deterministic=True)
    differing = np.mean([learner.predict(observations)[0] != greedy for _ in range(300)], axis=0)
    assert (differing[:5] == 0.0).all()
    np.testing.assert_allclose(differing[4:], 5 / 6 * np.linspace(0.0, 0.8, 4), atol=0.12)


def test_transitions_that_were_farther_off_are_drawn_more_often():
    learner = dqn(QUICK, priority=1.0, learning_starts=10_000)
    learner.learn(160)
    new = learner._draw(160, 50, 32)
    assert new.shape == (50, 32)
    assert set(new.ravel()) == set(range(160))
    errors = np.zeros(160, np.float32)
    errors[7] = 1.0
    learner._priorities.put(np.arange(160), errors)
    drawn = learner._priorities.draw(np.random.default_rng(0), 100, 100)
    # 1.01 of 159 * 0.01 + 1.01
    assert (drawn == 7).mean() == pytest.approx(1.01 / 2.6, abs=0.02)


def test_what_is_new_has_the_greatest_priority():
    priorities = Priorities(8, 0.5)
    priorities.fill(4, slice(0, 4))
    priorities.put(np.arange(4), np.array([0.0, 0.15, 0.35, 0.0], np.float32))
    priorities.fill(6, slice(4, 6))
    np.testing.assert_allclose(priorities._shares, [0.1, 0.4, 0.6, 0.1, 0.6, 0.6, 0, 0])
    priorities.fill(6, slice(0, 2))  # overwritten
    np.testing.assert_allclose(priorities._shares, [0.6, 0.6, 0.6, 0.1, 0.6, 0.6, 0, 0])


def test_training_by_priority_and_by_images_is_the_same_twice():
    networks = []
    for _ in range(2):
        learner = dqn(QUICK, priority=0.6, symmetry=True, exploration_spread=True)
        learner.learn(300)
        networks.append(learner.network.arrays())
    for name, array in networks[0].items():
        np.testing.assert_array_equal(networks[1][name], array)


@pytest.mark.parametrize("goes_on", [True, False])
def test_whether_the_value_continues_at_the_step_limit(goes_on):
    learner = dqn(bootstrap_at_limit=goes_on, learning_starts=10_000)
    learner.learn(60)
    memory, filled = learner._memory()
    assert filled == 60
    assert memory.ended.any()
    assert memory.truncated.any() == goes_on


def test_the_same_seed_gives_the_same_weights():
    networks = []
    for _ in range(2):
        learner = dqn(QUICK)
        learner.learn(400)
        networks.append(learner.network.arrays())
    for name, array in networks[0].items():
        np.testing.assert_array_equal(networks[1][name], array)


def test_an_average_is_kept_next_to_the_network_in_training():
    learner = dqn(QUICK, averaging=0.01)
    learner.learn(400)
    live, kept = learner._learner.network(), learner.network
    assert not np.array_equal(live.actions.weights[0], kept.actions.weights[0])
    np.testing.assert_allclose(live.actions.weights[0], kept.actions.weights[0], atol=0.2)


def test_nothing_is_left_in_the_temporary_files(tmp_path, monkeypatch):
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    dqn(QUICK).learn(200)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("config", [SLOW, QUICK])
def test_what_is_saved_is_what_was_learned(config, tmp_path):
    learner = dqn(config)
    first = arrays_of(learner.q_net)
    learner.learn(400)
    learner.save(tmp_path / "model.zip")
    _, saved, _ = load_from_zip_file(tmp_path / "model.zip", device="cpu")
    fresh = dqn(config)
    fresh.policy.load_state_dict(saved["policy"])
    observations = learner.env.reset()
    expected = learner._learner.live(observations)
    np.testing.assert_array_equal(fresh.network(observations), expected)
    np.testing.assert_allclose(learner.q_net(torch.from_numpy(observations)).detach(), expected, atol=1e-4)
    assert not np.array_equal(first.actions.weights[0], arrays_of(learner.q_net).actions.weights[0])
    for target, array in zip(
        arrays_of(learner.q_net_target).arrays().values(), learner._learner.target.arrays().values(), strict=True
    ):
        np.testing.assert_array_equal(target, array)


def test_a_network_of_other_layers_is_refused():
    with pytest.raises(ValueError, match="do not fit"):
        dqn(dueling=False, initial=network_that_always(4, 150))
