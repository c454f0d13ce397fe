"""Anyone's policy, scored on the frozen problems."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from bimvox_cli.main import run
from bimvox_pipeline.policy import score_policy
from bimvox_pipeline.schema import schema

from bimvox.env.observation import VIEW_NAME
from bimvox.errors import FileError, InputError, PolicyError
from bimvox.policy.generalist.suite import frozen_digests, set_digest
from bimvox.policy.generalist.weights import generalist_record, load_generalist
from bimvox.policy.onnx_file import onnx_bytes
from bimvox.policy.score import PolicyScore
from bimvox.progress import SilentProgress

SHARE = 0.02


def scored(policy: str, share: float = SHARE, sets: tuple[str, ...] = ("boxes", "slabs")):
    return score_policy(policy, sets=sets, share=share, progress=SilentProgress())


@pytest.fixture
def module(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """Writes mine.py into the current folder."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.delitem(sys.modules, "mine", raising=False)

    def write(body: str) -> str:
        sys.modules.pop("mine", None)
        Path("mine.py").write_text(f"import numpy as np\n\n\ndef values(seen):\n    {body}\n")
        return "mine:values"

    return write


def test_the_shipped_network_has_a_score_on_named_problems():
    document = scored("default")
    assert document["observation"] == VIEW_NAME
    assert [(one["set"], one["problems"]) for one in document["sets"]] == [("boxes", 4), ("slabs", 4)]
    for one in document["sets"]:
        assert one["digest"] == set_digest(frozen_digests()[one["set"]][:4])
        assert one["alone"]["arrived"] <= one["guarded"]["arrived"] == 4
        assert one["guarded"]["interval"] == pytest.approx([0.025 ** (1 / 4), 1.0])
        assert 1.0 <= one["guarded"]["moves_per_shortest"] < 1.1
        assert one["guarded"]["moves_per_shortest"] < one["guarded"]["made_per_shortest"]  # up to four tries


def test_a_score_is_as_its_schema_says():
    document, rules = json.loads(json.dumps(scored("greedy"))), schema("score")
    assert isinstance(rules, dict)
    assert PolicyScore.model_validate_json(json.dumps(document)).model_dump(mode="json") == document
    tables = {"": [document], "SetScore": document["sets"]}
    tables["WayScore"] = [one[way] for one in document["sets"] for way in ("alone", "guarded")]
    assert set(rules["$defs"]) == set(tables) - {""}
    for name, rows in tables.items():
        rule = rules["$defs"][name] if name else rules
        assert rule["additionalProperties"] is False
        for row in rows:
            assert list(row) == list(rule["properties"])
            assert set(row) == set(rule["required"])
            assert all(row[key] == value["const"] for key, value in rule["properties"].items() if "const" in value)
        assert all(value.get("description") for value in rule["properties"].values())
    document["sets"][0]["alone"]["success"] = 1.1
    with pytest.raises(ValueError, match="less than or equal to 1"):
        PolicyScore.model_validate_json(json.dumps(document))


def test_the_same_network_from_onnx_has_the_same_score(tmp_path: Path):
    file = tmp_path / "house.onnx"
    file.write_bytes(onnx_bytes(load_generalist(), {}))
    assert scored(str(file))["sets"] == scored("default")["sets"]


def test_greedy_values_are_scored_on_the_same_problems():
    greedy, network = scored("greedy"), scored("default")
    assert (greedy["policy"], network["policy"]) == ("greedy", generalist_record()["id"])
    assert [one["digest"] for one in greedy["sets"]] == [one["digest"] for one in network["sets"]]
    assert all(one["guarded"]["arrived"] == 4 for one in greedy["sets"])


def test_a_function_that_only_climbs_never_arrives_alone(module):
    document = scored(module("return np.tile([0, 0, 0, 0, 1, 0.5], (len(seen), 1))"), sets=("boxes",))
    assert document["policy"] == "mine:values"
    assert document["sets"][0]["alone"]["arrived"] == 0
    assert document["sets"][0]["alone"]["moves_per_shortest"] is None
    assert document["sets"][0]["alone"]["interval"] == pytest.approx([0.0, 1.0 - 0.025 ** (1 / 4)])


@pytest.mark.parametrize(
    ("body", "reason"),
    [
        ("return seen[:, :5]", r"shape \(4, 5\) for 4 observations, not \(4, 6\)"),
        ("return np.full((len(seen), 6), np.nan)", "NaN or infinite"),
        ("raise ValueError('no weights')", "the policy failed: ValueError: no weights"),
    ],
)
def test_a_function_that_gives_something_else_is_refused(module, body, reason):
    with pytest.raises(PolicyError, match=reason):
        scored(module(body))


def test_what_is_no_policy_is_refused(tmp_path: Path, module):
    with pytest.raises(PolicyError, match="cannot be imported: ModuleNotFoundError"):
        scored("nowhere_at_all:values")
    module("return seen")
    with pytest.raises(PolicyError, match="no function 'other'"):
        scored("mine:other")
    with pytest.raises(FileError):
        scored(str(tmp_path / "none.onnx"))
    (tmp_path / "bad.onnx").write_bytes(b"x")
    with pytest.raises(PolicyError, match="not an ONNX model"):
        scored(str(tmp_path / "bad.onnx"))
    for share in (0.0, 1.5, np.nan):
        with pytest.raises(InputError, match="--share"):
            scored("default", share=share)
    for name in ("unsolvable", "box"):
        with pytest.raises(InputError, match="no such set"):
            scored("default", sets=(name,))


@pytest.mark.slow
def test_the_command_prints_a_table_and_json(module, capsys: pytest.CaptureFixture[str]):
    words = ["policy", "score", module("return np.zeros((len(seen), 6))"), "--set", "boxes", "--share", "0.005"]
    assert run(words) == 0
    assert "policy mine:values" in capsys.readouterr().out
    # A process of its own finds the module too, in the folder where it is started.
    command = [sys.executable, "-m", "bimvox_cli", *words, "--json"]
    document = json.loads(subprocess.run(command, capture_output=True, text=True, check=True).stdout)
    assert (document["format"], document["sets"][0]["problems"]) == ("bimvox-policy-score", 1)
