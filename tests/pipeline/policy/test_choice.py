"""What proposes the paths of a plan: greedy values, the shipped network, a stored, nearest or retrained policy."""

import json
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from bimvox_pipeline.plan import plan

from bimvox.env.actions import ACTION_COUNT
from bimvox.env.observation import INPUT_SIZE
from bimvox.errors import PolicyError
from bimvox.library.arguments import PolicyWish
from bimvox.library.site import load_site
from bimvox.log.reader import read_log
from bimvox.policy import store as policies
from bimvox.policy.choice import DEFAULT_STEPS
from bimvox.policy.config import DqnConfig, adapting
from bimvox.policy.generalist.weights import generalist_record, load_generalist
from bimvox.policy.manifest import TrainedPolicy, id_of, outline_of
from bimvox.policy.network import QNetwork
from bimvox.progress import SilentProgress

WITHOUT_TORCH = """
import sys
from pathlib import Path
sys.modules["torch"] = sys.modules["stable_baselines3"] = None
from bimvox_pipeline.plan import plan
from bimvox.progress import SilentProgress
document = plan(Path(sys.argv[1]), Path(sys.argv[2]), progress=SilentProgress())
methods = sorted({str(one["method"]) for one in document["lifts"]})
print(document["policy"]["id"], document["policy"]["shipped"], document["policy"]["tested"], *methods)
"""


@pytest.fixture
def site(site_folder: Path) -> Path:
    """Return the frame's site file, which requires only the success that the shipped policy reaches there."""
    file = site_folder / "frame.site.toml"
    text = file.read_text()
    assert "\nrequired_success = 1 " in text
    file.write_text(text.replace("\nrequired_success = 1 ", "\nrequired_success = 0.9 "))
    return file


def stored(network: QNetwork, site: Path | None = None, *, key: str = "other") -> str:
    """Store a network as if it were trained, for a site if one is given."""
    outline = outline_of(load_site(site, SilentProgress()).site) if site is not None else None
    policy = TrainedPolicy((), 0, 0.5, 1.5, 10, DqnConfig(hidden=network.layer_sizes[1:-1]), seed=0, network=network)
    return policies.save(policy, key, site=outline)


def knows_nothing() -> QNetwork:
    """Return a network that always prefers west; the loop guard does the rest."""
    weights = (np.zeros((INPUT_SIZE, 8), np.float32), np.zeros((8, ACTION_COUNT), np.float32))
    return QNetwork(weights, (np.zeros(8, np.float32), np.arange(ACTION_COUNT, 0, -1).astype(np.float32)))


def made(site: Path, **options) -> dict:
    progress = options.pop("progress", SilentProgress())
    return plan(site, site.with_name("made.mcap"), wish=PolicyWish(**options), progress=progress)


@pytest.mark.slow
def test_a_plan_takes_greedy_values_without_training_and_without_torch(site, own_store):
    out = site.with_name("without.mcap")
    done = subprocess.run([sys.executable, "-c", WITHOUT_TORCH, site, out], capture_output=True, text=True, check=True)
    policy, is_shipped, tested, *methods = done.stdout.split()
    # Where the greedy path is longer than the searched one, that is used.
    assert (policy, is_shipped, tested) == ("greedy", "False", "0")
    assert {"greedy"} <= set(methods) <= {"greedy", "search"}
    assert read_log(out).metadata["policy"] == "greedy"
    assert not policies.scan().manifests  # nothing was tested, trained or stored


@pytest.mark.slow
def test_a_start_that_is_good_enough_is_used_and_not_stored(site, own_store):
    trained = made(site, train=True)["policy"]  # the shipped policy is good enough here
    assert trained["id"] == trained["from"] == generalist_record()["id"]
    assert (trained["loaded"], trained["shipped"], trained["steps"], trained["tested"] > 0) == (True, True, 0, True)
    assert not policies.scan().manifests
    assert made(site)["policy"]["id"] == "greedy"
    assert made(site, policy=trained["id"])["policy"]["shipped"]
    named = {name: made(site, policy=name) for name in ("default", "greedy")}
    assert named["default"]["policy"]["shipped"]
    assert {one["method"] for one in named["default"]["lifts"]} <= {"policy", "search"}
    assert named["greedy"]["policy"]["id"] == "greedy"


def test_the_nearest_policy_is_used_on_request(site, own_store):
    with pytest.raises(PolicyError, match="no policy of any site"):
        made(site, policy="nearest")
    stored(load_generalist())  # without a site, so it is never the nearest
    near = stored(load_generalist(), site, key="a little different")
    progress = SilentProgress()
    assert made(site, policy="nearest", progress=progress)["policy"]["id"] == near
    assert any("nearest site: distance 0.00" in note for note in progress.notes)


@pytest.fixture
def moved(site: Path) -> Path:
    """Return the site file with the crane half a metre further."""
    file = site.with_name("moved.site.toml")
    text = site.read_text()
    moved, times = re.subn(r"(?<=\nbase_m = \[)[-\d.]+", lambda base: str(float(base[0]) + 0.5), text)
    assert times == 1
    file.write_text(moved)
    return file


def trained_for(site: Path, *, seed: int) -> str:
    """Store a policy as if it were trained for a site as its file asks, but for the seed (there it is 0)."""
    network = load_generalist()
    config = adapting(DqnConfig(required_success=0.9), network.layer_sizes[1:-1])
    parent, built = generalist_record()["id"], load_site(site, SilentProgress()).site
    policy = TrainedPolicy((), 4_000, 1.0, 1.0, 20, config, seed, parent, DEFAULT_STEPS, network=network)
    return policies.save(policy, built.geometry_digest, site=outline_of(built))


def test_a_crane_that_moved_a_little_takes_the_policy_of_the_place_before(site, moved, own_store):
    held = trained_for(site, seed=0)
    assert "distance" not in made(site)["policy"]
    progress = SilentProgress()
    used = made(moved, progress=progress)["policy"]
    assert (used["id"], 0.0 < used["distance"] < 0.1) == (held, True)
    assert used["note"].startswith(f"{held}, of nearly this site (distance 0.0")
    assert f"policy: {used['note']}" in progress.notes
    assert made(moved, policy="none")["policy"] == made(site, policy="none")["policy"]


def test_a_policy_that_was_trained_otherwise_is_named_and_not_used(site, moved, own_store):
    held = trained_for(site, seed=7)
    for file, which in ((site, "this site's"), (moved, "nearly this site's")):
        policy = made(file)["policy"]
        assert policy["id"] == "greedy"
        assert policy["note"].endswith(f"; {which}, trained otherwise: --policy {held}")


def test_the_policy_of_another_building_is_never_near(site, own_store):
    stored(load_generalist(), Path("sample_models/yard.site.toml"))
    policy = made(site)["policy"]
    assert (policy["id"], "note" in policy) == ("greedy", False)


def test_a_policy_with_another_observation_is_refused_by_name_and_replaced_by_default(site, own_store):
    old = own_store / stored(load_generalist(), key=load_site(site, SilentProgress()).site.geometry_digest)
    manifest = json.loads((old / policies.MANIFEST_FILE).read_text())
    manifest["observation"], manifest["observation_size"] = "window-7x7x5-v1", 263
    del manifest["config"]["both_ways"]
    manifest["id"] = id_of(manifest)
    (old / policies.MANIFEST_FILE).write_text(json.dumps(manifest, sort_keys=True, indent=2) + "\n")
    old = old.rename(own_store / manifest["id"])
    with pytest.raises(PolicyError, match="does not fit: observation 'window-7x7x5-v1' instead of") as refusal:
        made(site, policy=old.name)
    assert refusal.value.differs["observation_size"][0] == 263
    assert made(site)["policy"]["id"] == "greedy"


class TrainedError(Exception):
    """A training was about to begin."""


@pytest.mark.slow
@pytest.mark.parametrize(
    ("steps", "budget", "rate", "asked", "serves"),
    [
        (4_000, 4_000, 0.5, 4_000, True),  # it used up its budget
        (8_000, 8_000, 0.5, 4_000, False),  # with half of the budget, the result would differ
        (2_000, 8_000, 1.0, 4_000, False),  # also if it stopped early, because the learning rate falls differently
        (2_000, 8_000, 1.0, 8_000, True),
        (0, 8_000, 1.0, 4_000, True),  # good enough untrained
        (0, 0, 0.5, 4_000, False),
        (4_000, None, 1.0, 4_000, False),  # limited by time, resumed, or trained on other lessons
    ],
)
def test_a_stored_policy_is_used_only_if_training_would_give_it(
    site, own_store, monkeypatch, steps, budget, rate, asked, serves
):
    def trains(*_, **__):
        raise TrainedError

    network = load_generalist()
    config = adapting(DqnConfig(required_success=0.9), network.layer_sizes[1:-1])
    parent = generalist_record()["id"]
    built = load_site(site, SilentProgress()).site
    policy = TrainedPolicy((), steps, rate, 1.0, 20, config, 0, parent, budget, network=network)
    held = policies.save(policy, built.geometry_digest)
    monkeypatch.setattr("bimvox.policy.choice.train", trains)
    if serves:
        assert made(site, steps=asked)["policy"]["id"] == held
    else:
        with pytest.raises(TrainedError):
            made(site, steps=asked)


@pytest.mark.slow
def test_lifts_that_the_policy_fails_are_retrained_on(site, own_store, monkeypatch):
    weak = stored(knows_nothing())
    without = made(site, policy=weak)
    failed = {lift["component"] for lift in without["lifts"] if lift["method"] == "search"}
    assert failed
    assert "retrained" not in without

    def trained(problems, config, *, seed, steps, start, **rest) -> TrainedPolicy:
        """Replaces the training itself, which is tested in tests/policy."""
        assert (steps, start.parent) == (4_000, weak)
        np.testing.assert_array_equal(start.network.biases[-1], knows_nothing().biases[-1])
        assert len(problems) >= len(failed)
        return TrainedPolicy((), 1_234, 1.0, 1.0, 20, config, seed, start.parent, network=load_generalist())

    monkeypatch.setattr("bimvox.policy.choice.train", trained)
    progress = SilentProgress()
    document = made(site, policy=weak, retrain=4_000, progress=progress)
    better = document["retrained"]
    assert (better["from"], better["steps"]) == (weak, 1_234)
    assert policies.load(better["id"]).manifest.parent == weak
    found = {lift["component"]: lift["method"] for lift in document["lifts"]}
    assert {name for name, method in found.items() if method != "policy"} == failed
    assert "retrained" in found.values()
    kept = {lift.method for lift in read_log(site.with_name("made.mcap")).plan.lifts}
    assert "retrained" in kept
    assert any("is asked next" in note for note in progress.notes)


def test_nothing_is_retrained_if_the_policy_solves_every_lift(site, own_store, monkeypatch):
    monkeypatch.setattr("bimvox.library.plan.retrained", None)  # calling it fails
    document = made(site, policy="default", retrain=4_000)
    if any(lift["method"] == "search" for lift in document["lifts"]):
        pytest.fail("the shipped network should find all lifts of the frame")
    assert "retrained" not in document


def test_retraining_after_greedy_values_starts_from_the_shipped_network(site, own_store, monkeypatch):
    from bimvox.library.prove import prepared
    from bimvox.policy.choice import GREEDY_POLICY, NO_POLICY, retrained

    trains_to = []

    def trained(problems, config, *, seed, steps, start, **rest) -> TrainedPolicy:
        assert start.network is load_generalist()
        return TrainedPolicy((), 1_234, 1.0, 1.0, 20, config, seed, start.parent, network=trains_to[-1])

    monkeypatch.setattr("bimvox.policy.choice.train", trained)
    progress = SilentProgress()
    built = load_site(site, progress).site
    _, preparation = prepared(built, progress)

    def again(policy):
        return retrained(built, preparation, policy, failed=(0,), seed=0, steps=4_000, progress=progress)

    assert again(NO_POLICY) is NO_POLICY  # search alone trains nothing
    trains_to.append(load_generalist())  # none better
    assert again(GREEDY_POLICY) is GREEDY_POLICY
    trains_to.append(knows_nothing())
    better = again(GREEDY_POLICY)
    assert (better.network, better.parent) == (trains_to[-1], generalist_record()["id"])


@pytest.mark.slow
def test_the_old_policy_is_kept_if_none_is_better(site, own_store):
    weak = stored(knows_nothing())
    progress = SilentProgress()
    from bimvox.library.prove import prepared
    from bimvox.policy.choice import PolicyRequest, choose_policy, retrained

    built = load_site(site, progress).site
    _, preparation = prepared(built, progress)
    policy = choose_policy(built, preparation, PolicyRequest(0, 1.0, policy_id=weak), progress)
    assert retrained(built, preparation, policy, seed=0, steps=0, progress=progress) is policy
    assert [manifest.id for manifest in policies.scan().manifests] == [weak]
