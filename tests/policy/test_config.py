from __future__ import annotations

import json

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
