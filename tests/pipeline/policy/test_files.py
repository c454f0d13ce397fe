"""Policies as files: bimvox's own, ONNX, stable-baselines3."""

from __future__ import annotations

import io
import itertools
import json
import pickle
import zipfile
from pathlib import Path

import gymnasium
import numpy as np
import onnxruntime
import pytest
import torch
from bimvox_pipeline.policy import export_policy, import_policy, pack, unpack
from stable_baselines3 import DQN

from bimvox.env.actions import ACTION_COUNT
from bimvox.env.observation import INPUT_SIZE, VIEW_SIZE
from bimvox.errors import InputError, PolicyError
from bimvox.policy import store
from bimvox.policy.config import DqnConfig
from bimvox.policy.manifest import CurvePoint, TrainedPolicy
from bimvox.policy.network import QNetwork
from bimvox.policy.sb3_file import read_sb3_zip

_SIZES = (INPUT_SIZE, 12, 8, 6)


def network(seed: int = 0) -> QNetwork:
    random = np.random.default_rng(seed)
    return QNetwork(
        tuple(random.standard_normal((a, b)).astype(np.float32) for a, b in itertools.pairwise(_SIZES)),
        tuple(random.standard_normal(b).astype(np.float32) for b in _SIZES[1:]),
    )


def observations(seed: int = 1) -> np.ndarray:
    return np.random.default_rng(seed).uniform(-1, 1, (50, VIEW_SIZE)).astype(np.float32)


@pytest.fixture
def stored(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    monkeypatch.setenv(store.STORE_VARIABLE, str(tmp_path / "store"))
    curve = (CurvePoint(2000, 1.0, 1.01),)
    return store.save(TrainedPolicy(curve, 2000, 1.0, 1.01, 50, DqnConfig(hidden=(12, 8)), 3, network=network()), "key")


def test_a_policy_goes_to_another_store_and_is_the_same(
    stored: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    out = tmp_path / "mine.policy.zip"
    assert export_policy(stored[:6], out=out) == {"id": stored, "out": str(out), "format": "bimvox"}
    first = out.read_bytes()
    export_policy(stored, out=out)
    assert out.read_bytes() == first
    before = store.load(stored)
    monkeypatch.setenv(store.STORE_VARIABLE, str(tmp_path / "other"))
    assert import_policy(out)["id"] == stored
    assert import_policy(out)["id"] == stored
    after = store.load(stored)
    assert after.manifest == before.manifest
    np.testing.assert_array_equal(after.network(observations()), before.network(observations()))


def test_an_onnx_file_computes_what_the_network_does(stored: str, tmp_path: Path) -> None:
    out = tmp_path / "policy.onnx"
    assert export_policy(stored, out=out)["format"] == "onnx"
    session = onnxruntime.InferenceSession(out.read_bytes(), providers=["CPUExecutionProvider"])
    assert session.get_modelmeta().custom_metadata_map["policy"] == stored
    asked = observations()
    (found,) = session.run(["action_values"], {"observation": asked})
    np.testing.assert_allclose(found, network()(asked), rtol=1e-4, atol=1e-4)
    (one,) = session.run(None, {"observation": asked[:1]})
    np.testing.assert_allclose(one, found[:1], rtol=1e-5, atol=1e-5)
    first = out.read_bytes()
    export_policy(stored, out=out)
    assert out.read_bytes() == first


def test_a_stable_baselines3_file_survives_the_round_trip(stored: str, tmp_path: Path) -> None:
    out = tmp_path / "policy.sb3.zip"
    assert export_policy(stored, out=out)["format"] == "sb3"
    dqn = DQN.load(out, device="cpu")
    asked = observations()
    with torch.no_grad():
        values = dqn.q_net(torch.from_numpy(asked)).numpy()
    np.testing.assert_allclose(values, network()(asked), rtol=1e-4, atol=1e-4)
    with pytest.raises(PolicyError, match=r"policy\.sb3\.zip: this file is from stable-baselines3") as caught:
        import_policy(out)
    assert "--trust" in (caught.value.hint or "")
    identity = import_policy(out, trust=True)["id"]
    loaded = store.load(identity)
    np.testing.assert_array_equal(loaded.network(asked), network()(asked))
    assert loaded.manifest.geometry_key.startswith("imported:")
    assert store.find("key")[0].id == stored


class _Bomb:
    def __reduce__(self) -> tuple[object, tuple[str]]:
        return (Path.touch, (Path("exploded"),))


def test_a_stock_network_trained_on_the_environment_is_a_policy(own_store: Path, tmp_path: Path) -> None:
    """It observes all of the 2,597 numbers, and its actions are the site's."""
    env = gymnasium.make("bimvox/Lift-v0")
    assert env.observation_space.shape == (VIEW_SIZE,) == (2597,)
    stock = DQN("MlpPolicy", env, buffer_size=10, policy_kwargs={"net_arch": [8]}, seed=0)
    stock.save(tmp_path / "stock.zip")
    stored = import_policy(tmp_path / "stock.zip", trust=True)["id"]
    found = store.load(stored).network
    assert (found.is_framed, found.layer_sizes) == (False, (VIEW_SIZE, 8, ACTION_COUNT))
    seen = observations()
    actions = stock.predict(seen, deterministic=True)[0]
    np.testing.assert_array_equal(found(seen).argmax(axis=1), actions)

    export_policy(stored, out=tmp_path / "again.onnx")  # compared with the network by ONNX's own reader
    export_policy(stored, out=tmp_path / "again.sb3.zip")
    again = DQN.load(tmp_path / "again.sb3.zip", device="cpu")
    np.testing.assert_array_equal(again.predict(seen, deterministic=True)[0], actions)


def test_nothing_in_a_hostile_file_runs(stored: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    whole = tmp_path / "policy.sb3.zip"
    export_policy(stored, out=whole)
    for member in ("data", "policy.pth", "pytorch_variables.pth"):
        with zipfile.ZipFile(whole) as archive:
            files = {name: archive.read(name) for name in archive.namelist()}
        if member == "data":
            files["data"] = pickle.dumps(_Bomb())
        else:
            held = io.BytesIO()
            torch.save(_Bomb(), held)
            files[member] = held.getvalue()
        bad = tmp_path / "bad.zip"
        bad.write_bytes(pack(files))
        if member == "policy.pth":
            with pytest.raises(PolicyError, match="holds more than tensors"):
                import_policy(bad, trust=True)
        else:
            import_policy(bad, trust=True)
        assert not (tmp_path / "exploded").exists()


def test_damaged_files_are_refused_and_nothing_is_stored(stored: str, tmp_path: Path) -> None:
    out = tmp_path / "mine.policy.zip"
    export_policy(stored, out=out)
    whole = out.read_bytes()
    files = unpack(whole, (store.MANIFEST_FILE, store.WEIGHTS_FILE), 10**8)
    manifest = json.loads(files[store.MANIFEST_FILE])
    changed = {**files, store.MANIFEST_FILE: json.dumps({**manifest, "steps": 1}).encode()}
    escaping = {**files, store.MANIFEST_FILE: json.dumps({**manifest, "id": "../../evil"}).encode()}
    weights = {**files, store.WEIGHTS_FILE: files[store.WEIGHTS_FILE][:-4] + b"\0\0\0\0"}
    cases = {
        "changed since": pack(changed),
        "not 16 hexadecimal digits": pack(escaping),
        "not the weights that the manifest names": pack(weights),
        "holds .*, not manifest": pack({**files, "more": b""}),
        "not a manifest": pack({**files, store.MANIFEST_FILE: b"[" * 100_000}),
        "not a whole zip": whole[:-10],
    }
    store.remove(stored)
    for said, content in cases.items():
        out.write_bytes(content)
        with pytest.raises(PolicyError, match=f"(?s)mine.*{said}"):
            import_policy(out)
    assert store.scan().manifests == ()
    assert not (tmp_path / "evil").exists()


def test_damaged_deflated_members_are_refused(stored: str, tmp_path: Path) -> None:
    files = store.files_of(stored)
    for make, reader in ((files, {}), ({"policy.pth": b"x" * 5000, "data": b"{}"}, {"trust": True})):
        held = io.BytesIO()
        with zipfile.ZipFile(held, "w", zipfile.ZIP_DEFLATED) as archive:
            for name, content in make.items():
                archive.writestr(name, content)
            at = min(info.header_offset + 30 + len(info.filename) for info in archive.infolist())
        content = held.getvalue()
        bad = tmp_path / "bad.zip"
        bad.write_bytes(content[:at] + b"\xff" * 8 + content[at + 8 :])
        with pytest.raises(PolicyError, match="bad"):
            import_policy(bad, **reader)


@pytest.mark.parametrize("content", [b"", b"PK", b"no zip at all"])
def test_other_files_are_not_stable_baselines3_files(content: bytes) -> None:
    with pytest.raises(PolicyError, match="not a zip file of stable-baselines3"):
        read_sb3_zip(content)


def test_unknown_forms_and_missing_folders(stored: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no such format"):
        export_policy(stored, to="pickle")
    with pytest.raises(InputError, match="does not exist"):
        export_policy(stored, out=tmp_path / "nowhere" / "x.onnx")
