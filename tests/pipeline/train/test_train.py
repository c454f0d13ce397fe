"""Training a site's policy by the pipeline, and resuming a killed training."""

import csv
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from bimvox_pipeline.train import train

from bimvox.policy import store as policies
from bimvox.policy.generalist.weights import load_generalist
from bimvox.policy.tensorboard import FILE_NAME
from bimvox.progress import SilentProgress

SCRIPT = """
import sys
from pathlib import Path
from bimvox.progress import SilentProgress
from bimvox_pipeline.train import train
train(Path(sys.argv[1]), start_from="none", steps=int(sys.argv[2]), seed=5, progress=SilentProgress())
"""


def without_clearances(site_folder: Path) -> Path:
    """Return the frame's site file, with loads close to everything: high above it there is little to learn."""
    file = site_folder / "frame.site.toml"
    text = file.read_text()
    for key in ("transit_clearance_m", "rope_clearance_m"):
        assert f"\n# {key} = " in text
        text = text.replace(f"\n# {key} = ", f"\n{key} = 0  # ")
    file.write_text(text)
    return file


@pytest.mark.slow
def test_a_policy_is_stored_with_its_outline_and_its_curve_is_written_on_request(site_folder, own_store, tmp_path):
    progress = SilentProgress()
    document = train(
        without_clearances(site_folder),
        start_from="none",
        steps=2_100,
        curve=tmp_path / "curve.csv",
        tensorboard=tmp_path / "runs",
        progress=progress,
    )
    stored = policies.load(document["policy"]).manifest
    assert stored.site is not None
    assert stored.parent is None
    assert document["from"] is None
    assert document["tested"] == stored.tested > 0
    assert 0.0 < document["success_at_least"] < document["success_rate"] or document["success_rate"] == 0.0
    with (tmp_path / "curve.csv").open() as stream:
        rows = list(csv.DictReader(stream))
    assert [int(row["steps"]) for row in rows] == [steps for steps, _ in document["curve"]]
    assert (tmp_path / "runs" / FILE_NAME).stat().st_size > 100
    assert any("steps a second" in note and "left" in note for note in progress.notes)


def test_training_begins_with_the_policy_that_ships(site_folder, own_store):
    from bimvox.policy.generalist.weights import generalist_record

    document = train(site_folder / "frame.site.toml", steps=0, progress=SilentProgress())
    assert document["from"] == generalist_record()["id"]
    assert document["curve"][0][0] == 0
    assert document["curve"][0][1] > 0.9  # on a site that it has never seen


def test_nothing_is_stored_if_nothing_was_to_be_learned(site_folder, own_store):
    from bimvox.policy.generalist.weights import generalist_record

    progress, shipped = SilentProgress(), generalist_record()["id"]
    document = train(site_folder / "frame.site.toml", progress=progress)
    assert (document["policy"], document["learned"], document["steps"]) == (shipped, False, 0)
    assert any(note.startswith(f"nothing was to be learned: policy {shipped}, the shipped") for note in progress.notes)
    assert policies.scan().manifests == ()


@pytest.mark.slow
def test_a_policy_is_trained_anyway_if_asked(site_folder, own_store):
    document = train(site_folder / "frame.site.toml", steps=2_000, anyway=True, progress=SilentProgress())
    (manifest,) = policies.scan().manifests
    assert (document["policy"], document["learned"], document["from"]) == (manifest.id, True, manifest.parent)
    assert [steps for steps, _ in document["curve"]] == [0, document["steps"]]
    assert not policies.load(manifest.id).network.equals(load_generalist())


@pytest.mark.slow
def test_a_killed_training_resumes(site_folder, own_store):
    site = without_clearances(site_folder)
    steps = 60_000  # more than it gets
    unfinished = own_store.with_name(f"{own_store.name}-unfinished")
    running = subprocess.Popen([sys.executable, "-c", SCRIPT, str(site), str(steps)], env=os.environ)
    try:
        give_up = time.monotonic() + 500
        while not list(unfinished.glob("*/*/manifest.json")):
            assert running.poll() is None, "it ended before its first test"
            assert time.monotonic() < give_up
            time.sleep(0.05)
    finally:
        running.send_signal(signal.SIGKILL)
        running.wait()
    assert policies.scan().manifests == ()
    kept = max(m.steps for place in unfinished.iterdir() for m in policies.scan(folder=place).manifests)

    progress = SilentProgress()
    document = train(site, start_from="none", steps=steps, seed=5, seconds=0.0, progress=progress)
    assert any(note.startswith("resumed an interrupted training after") for note in progress.notes)
    assert document["curve"][0][0] <= kept < document["steps"]
    assert list(unfinished.iterdir()) == []  # the training has ended
