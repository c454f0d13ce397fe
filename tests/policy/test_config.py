from __future__ import annotations

import json

import numpy as np
import pytest

from bimvox.env.dynamics import StepLimit
from bimvox.errors import PolicyError
from bimvox.policy.config import DqnConfig, config_from_dict


def test_through_json_and_back():
    config = DqnConfig(hidden=(32,), reward="sparse", limit=StepLimit(3.0, 7), lifts=8)
    assert config_from_dict(json.loads(json.dumps(config.to_dict()))) == config


@pytest.mark.parametrize(
    "wrong",
    [{"reward": "fame"}, {"lifts": 0}, {"discount": 1.0}, {"buffer_size": 3}, {"hidden": (0,)}, {"test_every": 0}],
)
def test_impossible_choices_are_refused(wrong):
    with pytest.raises(ValueError, match=next(iter(wrong))):
        DqnConfig(**wrong)


def test_unknown_and_missing_keys_are_named():
    plain = DqnConfig().to_dict()
    plain["colour"] = plain.pop("discount")
    with pytest.raises(PolicyError) as caught:
        config_from_dict(plain)
    assert caught.value.differs == {"missing": ["discount"], "unknown": ["colour"]}


def test_exploration_falls_by_steps_not_by_share_of_the_budget():
    config = DqnConfig(exploration_first=0.8, exploration_last=0.2, exploration_steps=100)
    shares = [config.random_shares(steps, 10_000, 3) for steps in (0, 50, 100, 400)]
    np.testing.assert_allclose(shares, np.repeat([[0.8], [0.5], [0.2], [0.2]], 3, axis=1))


def test_lifts_explore_differently_if_wanted():
    config = DqnConfig(exploration_first=0.5, exploration_last=0.5, exploration_spread=2.0)
    np.testing.assert_allclose(config.random_shares(0, 1, 3), [0.5, 0.25, 0.125])
    np.testing.assert_allclose(config.random_shares(0, 1, 1), [0.5])
