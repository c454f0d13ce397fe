from pathlib import Path

import numpy as np
import pytest
from bimvox_pipeline.inspect.inspect import inspect
from bimvox_pipeline.policy import list_policies, remove, show

from bimvox.env.actions import ACTION_COUNT
from bimvox.env.observation import INPUT_SIZE
from bimvox.errors import PolicyError
from bimvox.policy import store
from bimvox.policy.config import DqnConfig
from bimvox.policy.manifest import CurvePoint, TrainedPolicy
from bimvox.policy.network import QNetwork
from bimvox.progress import SilentProgress


@pytest.fixture
def policy_id(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    monkeypatch.setenv(store.STORE_VARIABLE, str(tmp_path))
    weights = np.zeros((INPUT_SIZE, ACTION_COUNT), np.float32)
    network = QNetwork((weights,), (np.zeros(ACTION_COUNT, np.float32),))
    curve = (CurvePoint(1000, 0.5, 1.1), CurvePoint(2000, 1.0, 1.0))
    return store.save(TrainedPolicy(curve, 2000, 1.0, 1.0, 50, DqnConfig(), seed=3, network=network), "key")


def test_a_stored_policy_is_listed_shown_and_removed(policy_id: str, tmp_path: Path) -> None:
    listed = list_policies()
    assert listed["store"] == str(tmp_path)
    assert [(one["id"], one["steps"], one["seed"]) for one in listed["policies"]] == [(policy_id, 2000, 3)]
    assert show(policy_id[:6])["curve"] == [[1000, 0.5, 1.1], [2000, 1.0, 1.0]]
    assert remove(policy_id)["removed"] == policy_id
    assert list_policies()["policies"] == []


def test_a_damaged_policy_is_listed_as_such(policy_id: str, tmp_path: Path) -> None:
    (tmp_path / policy_id / store.MANIFEST_FILE).write_text("{")
    listed = list_policies()
    assert listed["policies"] == []
    assert [one["id"] for one in listed["damaged"]] == [policy_id]
    with pytest.raises(PolicyError, match="not JSON"):
        show(policy_id)


def test_inspect_knows_a_policy_folder(policy_id: str, tmp_path: Path) -> None:
    document = inspect(tmp_path / policy_id, SilentProgress())
    assert (document["kind"], document["id"]) == ("policy", policy_id)


def test_a_missing_policy() -> None:
    with pytest.raises(PolicyError, match="no policy 'ffff'"):
        show("ffff")
