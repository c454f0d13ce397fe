from __future__ import annotations

import itertools
import json
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from multiprocessing import get_context

import numpy as np
import pytest
from store_work import use_store

from bimvox.env.observation import INPUT_SIZE, VIEW_NAME
from bimvox.errors import PolicyError
from bimvox.policy import manifest as manifest_module
from bimvox.policy import store
from bimvox.policy.config import DqnConfig
from bimvox.policy.manifest import CurvePoint, SiteOutline, TrainedPolicy, id_of
from bimvox.policy.network import QNetwork


def policy(seed: int = 0, success: float = 1.0) -> TrainedPolicy:
    random = np.random.default_rng(seed)
    sizes = (INPUT_SIZE, 4, 6)
    network = QNetwork(
        tuple(random.standard_normal((a, b)).astype(np.float32) for a, b in itertools.pairwise(sizes)),
        tuple(random.standard_normal(b).astype(np.float32) for b in sizes[1:]),
    )
    curve = (CurvePoint(2000, 0.5, 1.25), CurvePoint(4000, success, 1.01))
    return TrainedPolicy(curve, 4000, success, 1.01, 191, DqnConfig(hidden=(4,)), seed, network=network)


def rewrite(folder, change) -> None:
    """Change a manifest and give it the matching id."""
    file = folder / store.MANIFEST_FILE
    plain = json.loads(file.read_text())
    change(plain)
    plain["id"] = id_of(plain)
    file.write_text(json.dumps(plain))
    folder.rename(folder.with_name(plain["id"]))


def test_what_is_saved_is_loaded(tmp_path):
    saved = policy()
    policy_id = store.save(saved, "site-a", folder=tmp_path)
    loaded = store.load(policy_id, folder=tmp_path)
    for name, array in saved.network.arrays().items():
        np.testing.assert_array_equal(loaded.network.arrays()[name], array)
    manifest = loaded.manifest
    assert (manifest.geometry_key, manifest.observation, manifest.seed) == ("site-a", VIEW_NAME, 0)
    assert manifest.curve == saved.curve
    assert manifest.config == saved.config
    assert set(manifest.versions) >= {"torch", "stable-baselines3", "numpy"}
    assert [p.name for p in tmp_path.iterdir()] == [policy_id]


def test_saving_again_changes_nothing_and_another_is_another(tmp_path):
    first = store.save(policy(), "site-a", folder=tmp_path)
    before = {p: p.stat().st_mtime_ns for p in (tmp_path / first).iterdir()}
    assert store.save(policy(), "site-a", folder=tmp_path) == first
    assert before == {p: p.stat().st_mtime_ns for p in (tmp_path / first).iterdir()}
    others = {store.save(policy(), "site-b", folder=tmp_path), store.save(policy(1), "site-a", folder=tmp_path)}
    assert len(others | {first}) == 3


def test_find_gives_the_best_first(tmp_path):
    worse = store.save(policy(1, success=0.9), "site-a", folder=tmp_path)
    better = store.save(policy(2, success=0.95), "site-a", folder=tmp_path)
    store.save(policy(3), "site-b", folder=tmp_path)
    assert [m.id for m in store.find("site-a", folder=tmp_path)] == [better, worse]
    assert store.find("site-c", folder=tmp_path) == ()
    assert len(store.scan(folder=tmp_path).manifests) == 3


def test_the_variable_names_the_store(tmp_path, monkeypatch):
    monkeypatch.setenv(store.STORE_VARIABLE, str(tmp_path / "mine"))
    assert store.scan().manifests == ()
    policy_id = store.save(policy(), "site-a")
    assert (tmp_path / "mine" / policy_id / "manifest.json").is_file()
    assert store.load(policy_id[:6]).manifest.id == policy_id
    assert store.remove(policy_id[:6]) == policy_id
    assert store.scan().manifests == ()


@pytest.mark.parametrize("wanted", ["", "no-such", "../../etc"])
def test_a_missing_policy_is_reported(tmp_path, wanted):
    policy_id = store.save(policy(), "site-a", folder=tmp_path)
    for act in (store.load, store.remove):
        with pytest.raises(PolicyError, match="there is no policy") as caught:
            act(wanted, folder=tmp_path)
        assert caught.value.differs == {"available": [policy_id]}


def test_changed_weights_are_noticed(tmp_path):
    place = tmp_path / store.save(policy(), "site-a", folder=tmp_path)
    weights = bytearray((place / store.WEIGHTS_FILE).read_bytes())
    weights[-1] ^= 1
    (place / store.WEIGHTS_FILE).write_bytes(weights)
    with pytest.raises(PolicyError, match="checksum mismatch: these are not the weights") as caught:
        store.load(place.name, folder=tmp_path)
    assert "weights_sha256" in caught.value.differs
    assert store.save(policy(), "site-a", folder=tmp_path) == place.name  # repairs it
    store.load(place.name, folder=tmp_path)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"\xff\xfe", "not JSON"),
        (b"[1, 2]", "not a JSON object"),
        (b"[" * 200_000, "not JSON"),
        (b"{}", "format version None"),
        (b'{"format_version": 99}', "format version 99"),
        (b'{"format_version": 1}', "other keys"),
    ],
)
def test_a_damaged_manifest_is_refused_and_listed_as_damaged(tmp_path, content, message):
    good = store.save(policy(1), "site-a", folder=tmp_path)
    bad = store.save(policy(2), "site-a", folder=tmp_path)
    (tmp_path / bad / store.MANIFEST_FILE).write_bytes(content)
    with pytest.raises(PolicyError, match=message):
        store.load(bad, folder=tmp_path)
    scan = store.scan(folder=tmp_path)
    assert [m.id for m in scan.manifests] == [good]
    assert [name for name, _ in scan.damaged] == [bad]
    assert store.remove(bad, folder=tmp_path) == bad


def test_a_manifest_that_was_edited_is_refused(tmp_path):
    place = tmp_path / store.save(policy(), "site-a", folder=tmp_path)
    file = place / store.MANIFEST_FILE
    file.write_text(file.read_text().replace('"geometry_key": "site-a"', '"geometry_key": "site-b"'))
    with pytest.raises(PolicyError, match="changed since it was written"):
        store.load(place.name, folder=tmp_path)


@pytest.mark.parametrize(
    ("key", "value"), [("observation", "map-v0"), ("observation_size", 7), ("layer_sizes", [INPUT_SIZE, 5, 6])]
)
def test_a_policy_that_does_not_fit_says_in_what(tmp_path, key, value):
    place = tmp_path / store.save(policy(), "site-a", folder=tmp_path)
    rewrite(place, lambda plain: plain.update({key: value}))
    (changed,) = store.scan(folder=tmp_path).manifests
    with pytest.raises(PolicyError) as caught:
        store.load(changed.id, folder=tmp_path)
    assert key in caught.value.differs
    assert (store.find("site-a", folder=tmp_path) == ()) == key.startswith("observation")


@pytest.mark.parametrize(("key", "value"), [("curve", [[1]]), ("versions", 3), ("config", 5), ("success_rate", "high")])
def test_impossible_values_are_refused(tmp_path, key, value):
    place = tmp_path / store.save(policy(), "site-a", folder=tmp_path)
    rewrite(place, lambda plain: plain.update({key: value}))
    with pytest.raises(PolicyError):
        store.load(next(tmp_path.iterdir()).name, folder=tmp_path)


def test_a_pickle_in_place_of_weights_is_never_run(tmp_path):
    place = tmp_path / store.save(policy(), "site-a", folder=tmp_path)
    bomb = b"cos\nmkdir\n(S'" + str(tmp_path / "ran").encode() + b"'\ntR."
    (place / store.WEIGHTS_FILE).write_bytes(bomb)
    import hashlib

    rewrite(place, lambda plain: plain.update({"weights_sha256": hashlib.sha256(bomb).hexdigest()}))
    (changed,) = store.scan(folder=tmp_path).manifests
    with pytest.raises(PolicyError, match="not a safetensors file"):
        store.load(changed.id, folder=tmp_path)
    assert not (tmp_path / "ran").exists()


def test_a_huge_file_is_not_read(tmp_path, monkeypatch):
    policy_id = store.save(policy(), "site-a", folder=tmp_path)
    monkeypatch.setattr(store, "LARGEST_FILE_BYTES", 10)
    with pytest.raises(PolicyError, match="the most that is read"):
        store.load(policy_id, folder=tmp_path)


def test_a_store_that_cannot_be_written_leaves_nothing(tmp_path):
    blocked = tmp_path / "file"
    blocked.write_text("not a folder")
    with pytest.raises(PolicyError, match="could not be written"):
        store.save(policy(), "site-a", folder=blocked)


def test_an_interrupted_write_is_not_a_policy(tmp_path, monkeypatch):
    def interrupted(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr(store, "_rename", interrupted)
    with pytest.raises(KeyboardInterrupt):
        store.save(policy(), "site-a", folder=tmp_path)
    assert list(tmp_path.iterdir()) == []
    (tmp_path / ".writing-killed").mkdir()  # as after a kill
    assert store.scan(folder=tmp_path) == store.StoreScan((), ())


def test_manifest_is_written_one_way():
    assert manifest_module.canonical_json({"b": 1, "a": [1.5]}) == '{\n  "a": [\n    1.5\n  ],\n  "b": 1\n}\n'
    assert replace(policy(), parent="x").parent == "x"


def outline(**changes) -> SiteOutline:
    return replace(SiteOutline((15, 15, 6), 1.0, 1, 4, False, "00" * 256), **changes)


def test_the_nearest_policy_is_the_one_of_the_most_similar_site(tmp_path):
    far = store.save(policy(1), "a", site=outline(shape_vox=(150, 150, 60)), folder=tmp_path)
    near = store.save(policy(2), "b", site=outline(components=2), folder=tmp_path)
    twin = store.save(policy(3), "c", site=outline(components=2), folder=tmp_path)
    store.save(policy(4), "d", folder=tmp_path)
    found = store.nearest(outline(), folder=tmp_path)
    assert [manifest.id for _, manifest in found][2] == far
    assert {manifest.id for _, manifest in found[:2]} == {near, twin}
    assert found[0][0] == found[1][0] == pytest.approx(0.25)
    assert found[0][1].id < found[1][1].id
    assert store.nearest(outline(), folder=tmp_path / "none") == ()


def test_a_policy_that_does_not_fit_is_never_near(tmp_path):
    policy_id = store.save(policy(), "a", site=outline(), folder=tmp_path)
    rewrite(tmp_path / policy_id, lambda plain: plain.update(observation="another"))
    assert store.nearest(outline(), folder=tmp_path) == ()


@pytest.mark.parametrize(("version", "without"), [(1, {"site", "budget"}), (2, {"budget"})])
def test_older_versions_are_read_without_what_came_later(tmp_path, version, without):
    policy_id = store.save(policy(), "a", folder=tmp_path)

    def older(plain) -> None:
        plain["format_version"] = version
        for key in without:
            del plain[key]

    rewrite(tmp_path / policy_id, older)
    (manifest,) = store.scan(folder=tmp_path).manifests
    assert manifest.site is None
    assert manifest.budget is None
    assert manifest.format_version == version
    assert store.load(manifest.id, folder=tmp_path).manifest == manifest


@pytest.mark.slow
def test_processes_that_share_a_store_do_not_interfere(tmp_path):
    with ProcessPoolExecutor(3, mp_context=get_context("spawn")) as processes:
        wrong = list(processes.map(use_store, [tmp_path] * 3, [40] * 3))
    assert wrong == [[], [], []]
    assert len(list(tmp_path.iterdir())) == 5
