from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import torch
from paper_lessons import QUICK, SLOW, TINY

from bimvox.errors import PolicyError
from bimvox.paper.env.batched import BatchedPaperSite
from bimvox.paper.env.spec import PaperSpec, YardPose, beam
from bimvox.paper.policy.config import AUTHORS_MODE, PAPER_MODE
from bimvox.paper.policy.initialization import IMAGES, Images, dqn_of_sites, learn, network_of
from bimvox.paper.policy.network import network_from_bytes, network_to_bytes
from bimvox.policy.replay import Transitions

SIDE = 9
IMAGE = Images()


def point(g, x, y):
    """Return the cell to which image g moves a cell on plan."""
    swap, mirror_x, mirror_y = g >= 4, g % 4 >= 2, g % 2 == 1
    if swap:
        x, y = y, x
    return (SIDE - 1 - x if mirror_x else x), (SIDE - 1 - y if mirror_y else y)


def box(g, low, high):
    """Return the box to which image g moves a box."""
    ends = [point(g, *low[:2]), point(g, high[0] - 1, high[1] - 1)]
    (x0, x1), (y0, y1) = (sorted(values) for values in zip(*ends, strict=True))
    return (x0, y0, low[2]), (x1 + 1, y1 + 1, high[2])


def site(g):
    """Return image g of an asymmetric site with a hanging beam."""
    low, _ = box(g, (2, 6, 3), (5, 7, 4))
    start_low, start_high = box(g, (0, 1, 1), (3, 2, 2))
    axis = "x" if start_high[0] - start_low[0] > 1 else "y"
    part = beam(3, low, axis)
    part = replace(part, start=YardPose(*start_low[:2], axis), after=())
    obstructions = tuple(box(g, *b) for b in [((4, 0, 1), (5, 4, 5)), ((0, 3, 1), (2, 4, 3)), ((6, 2, 1), (7, 8, 4))])
    area = box(g, (2, 6, 0), (8, 9, 1))
    return PaperSpec((SIDE, SIDE, 7), (*area[0][:2], *area[1][:2]), (part,), obstructions=obstructions)


def walk(g, actions):
    """Return the observations and rewards of image g of a walk."""
    batch = BatchedPaperSite(site(g), 1, observation="egocentric", reward="shaped", threads=1)
    seen, earned = [batch.reset()[0].copy()], []
    for action in actions:
        step = batch.step([IMAGE.action[g, action].item()])
        seen.append(step.observations[0].copy())
        earned.append(float(step.rewards[0]))
    return np.array(seen), np.array(earned, np.float32)


@pytest.mark.parametrize("g", range(IMAGES))
def test_a_walk_on_a_turned_site_is_the_turned_walk(g):
    actions = np.random.default_rng(1).integers(6, size=40)
    seen, earned = walk(0, actions)
    turned, turned_earned = walk(g, actions)
    np.testing.assert_array_equal(turned_earned, earned)
    count = len(actions)
    columns = (torch.from_numpy(column)[:, None] for column in (actions, earned, np.zeros(count, np.float32)))
    before, after = (torch.from_numpy(rows) for rows in (seen[:-1], seen[1:]))
    batch = Transitions(before, *columns, after, torch.zeros(0, 6), torch.arange(count))
    image = IMAGE.of(batch, torch.full((count,), g))
    np.testing.assert_array_equal(image.views, turned[:-1])
    np.testing.assert_array_equal(image.following, turned[1:])
    np.testing.assert_array_equal(image.actions[:, 0], IMAGE.action[g][actions])
    np.testing.assert_array_equal(image.rewards[:, 0], earned)


def test_eight_different_images_the_first_the_original():
    assert len({tuple(row) for row in IMAGE.action.tolist()}) == IMAGES
    np.testing.assert_array_equal(IMAGE.action[0], np.arange(6))
    np.testing.assert_array_equal(IMAGE.entry[0], np.arange(IMAGE.entry.shape[1]))
    assert (IMAGE.action[:, 4:] == torch.tensor([4, 5])).all()


SMALL = {"hidden": (16, 16), "learning_starts": 100}


def dqn(config, **changes):
    config = replace(config, **changes)
    batch = BatchedPaperSite(TINY, config.sites, observation=config.flat_observation, reward=config.reward, threads=1)
    return dqn_of_sites(batch, config, 3)


def learned(config, steps, **more):
    networks = []
    learn(TINY, config, lambda network, _: bool(networks.append(network)), seed=3, budget=steps, **more)
    return networks[-1]


@pytest.mark.parametrize("config", [replace(PAPER_MODE, **SMALL), replace(AUTHORS_MODE, **SMALL), QUICK])
def test_what_is_kept_and_stored_is_what_was_learned(config):
    learner = dqn(config)
    learner.learn(300)
    observations = np.random.default_rng(0).random((5, *learner.observation_space.shape), np.float32)
    with torch.no_grad():
        expected = learner.q_net(torch.from_numpy(observations)).numpy()
    network = network_of(learner)
    np.testing.assert_allclose(network(observations), expected, atol=1e-5)
    again = network_from_bytes(network_to_bytes(network))
    np.testing.assert_array_equal(again(observations), network(observations))


def test_what_is_no_network_is_refused():
    with pytest.raises(PolicyError, match="not a safetensors file"):
        network_from_bytes(b"nothing")


def test_two_streams_without_a_layer_in_common_that_begin_after_glorot():
    tensors = network_of(dqn(SLOW)).tensors
    assert {name: tuple(tensor.shape) for name, tensor in tensors.items() if name.endswith("weight")} == {
        "q_net.0.weight": (16, 150),
        "q_net.2.weight": (16, 16),
        "q_net.4.weight": (6, 16),
        "value_net.0.weight": (16, 150),
        "value_net.2.weight": (16, 16),
        "value_net.4.weight": (1, 16),
    }
    limit = np.sqrt(6 / (150 + 16))
    for stream in ("q_net", "value_net"):
        assert (tensors[f"{stream}.0.bias"] == 0).all()
        assert 0.9 * limit < tensors[f"{stream}.0.weight"].abs().max() <= limit


def test_training_begins_with_the_loaded_network():
    config = replace(SLOW, learning_starts=1_000)
    first = learned(config, 40)
    assert network_to_bytes(learned(config, 40, initial=first)) == network_to_bytes(first)
    other = replace(config, hidden=(8, 8))
    with pytest.raises(RuntimeError, match="size mismatch"):
        learned(other, 40, initial=first)


@pytest.mark.parametrize("goes_on", [True, False])
def test_whether_the_value_continues_at_the_step_limit(goes_on):
    learner = dqn(SLOW, bootstrap_at_limit=goes_on, learning_starts=10_000)
    learner.learn(60)
    assert learner.replay_buffer.sample(500).ended.any() == (not goes_on)


@pytest.mark.parametrize(
    "config",
    [QUICK, replace(QUICK, priority=0.6, importance_first=0.4, symmetry=True, exploration_spread=4.0, averaging=0.9)],
    ids=["plain", "everything"],
)
def test_the_same_seed_gives_the_same_weights(config):
    assert network_to_bytes(learned(config, 300)) == network_to_bytes(learned(config, 300))


def test_an_average_is_kept_next_to_the_network_in_training():
    learner = dqn(QUICK, averaging=0.99)
    learner.learn(400)
    kept, live = network_of(learner).tensors, learner.q_net.state_dict()
    name = "q_net.0.weight"
    assert not torch.equal(live[name], kept[name])
    np.testing.assert_allclose(live[name], kept[name], atol=0.2)


def test_nothing_is_left_in_the_temporary_files(tmp_path, monkeypatch):
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    dqn(QUICK).learn(200)
    assert list(tmp_path.iterdir()) == []
