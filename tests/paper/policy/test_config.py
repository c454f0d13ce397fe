from __future__ import annotations

from dataclasses import replace

import pytest

from bimvox.errors import PolicyError
from bimvox.paper.policy.config import (
    MODES,
    OUR_MODE,
    PAPER_MODE,
    PaperDqnConfig,
    paper_config_from_dict,
)


def test_paper_mode_is_the_original_stable_baselines():
    wanted = {
        "learning_rate": 5e-4,
        "discount": 0.99,
        "buffer_size": 50_000,
        "batch_size": 32,
        "learning_starts": 1_000,
        "target_update": 500,
        "exploration_first": 1.0,
        "exploration_last": 0.02,
        "exploration_share": 0.1,
        "double_q": True,
        "dueling": True,
        "hidden": (64, 64),
        "sites": 1,
        "gradient_steps": 1,
        "observation": "paper",
        "reward": "paper",
    }
    assert {name: getattr(PAPER_MODE, name) for name in wanted} == wanted


def test_the_two_layers_are_the_papers():
    for config in MODES.values():
        assert (config.test_exploration, config.test_episodes, config.required_success) == (0.02, 100, 1.0)
        assert (config.trials, config.retrain_episodes, config.retrain_successes) == (10, 10, 8)
    assert PAPER_MODE.test_every == 2_000


def test_the_exploration_phase_is_a_share_of_the_budget_or_fixed():
    assert PAPER_MODE.exploration_phase(30_000) == 3_000
    assert replace(PAPER_MODE, exploration_steps=7).exploration_phase(30_000) == 7


def test_the_learning_rate_falls_over_the_budget_or_a_fixed_phase_or_not_at_all():
    assert PAPER_MODE.learning_rate_at(900, 0.9) == 5e-4
    falling = replace(PAPER_MODE, learning_rate=1e-3, learning_rate_last=1e-4)
    assert falling.learning_rate_at(0, 0.0) == 1e-3
    assert falling.learning_rate_at(500, 0.5) == pytest.approx(5.5e-4)
    assert falling.learning_rate_at(9_999, 9.9) == pytest.approx(1e-4)
    assert replace(falling, learning_rate_steps=10).learning_rate_at(5, 0.005) == pytest.approx(5.5e-4)


def test_random_actions_become_fewer_over_a_tenth_of_the_budget():
    shares = [PAPER_MODE.random_shares(steps, 1_000, 1).item() for steps in (0, 50, 100, 900)]
    assert shares == pytest.approx([1.0, 0.51, 0.02, 0.02])


@pytest.mark.parametrize("mode", MODES)
def test_json_values_and_back(mode):
    assert paper_config_from_dict(MODES[mode].to_dict()) == MODES[mode]


def test_other_keys_or_impossible_values_are_refused():
    plain = OUR_MODE.to_dict()
    with pytest.raises(PolicyError, match="other keys") as caught:
        paper_config_from_dict({**plain, "extra": 1})
    assert caught.value.differs["unknown"] == ["extra"]
    with pytest.raises(PolicyError, match="impossible"):
        paper_config_from_dict({**plain, "discount": 1.0})


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("observation", "nothing"),
        ("reward", "nothing"),
        ("hidden", ()),
        ("hidden", (0,)),
        ("sites", 0),
        ("budget", 0),
        ("buffer_size", 0),
        ("discount", 1.0),
        ("averaging", 1.0),
        ("retrain_successes", 11),
    ],
)
def test_impossible_choices_are_named(name, value):
    with pytest.raises(ValueError, match=name):
        PaperDqnConfig(**{name: value})


def test_images_only_of_observations_that_have_them():
    with pytest.raises(ValueError, match="symmetry: the observation 'paper' has no images"):
        replace(PAPER_MODE, symmetry=True)
