import importlib
import json
import shutil
import tomllib
from dataclasses import replace
from pathlib import Path

import pytest
from bimvox_cli.main import run as main
from bimvox_pipeline.plan import plan
from bimvox_pipeline.site import init
from bimvox_pipeline.verify import verify
from bimvox_pipeline.watch.log import read_newest
from planned_frame import plan_it, write_site

from bimvox.bim.read import read_building
from bimvox.cranes.schedule import time_lifts
from bimvox.errors import FileError, InputError, NoPlanError, PolicyError, VerificationError
from bimvox.library.arguments import PolicyWish
from bimvox.library.site import load_site
from bimvox.log.plan_log import LogRate
from bimvox.log.reader import read_log
from bimvox.log.recorder import write_log
from bimvox.progress import SilentProgress
from bimvox.proof.plan import verify_plan
from bimvox.records.lift import Status
from bimvox.records.proof import turn_to

SAMPLES = Path(__file__).parents[2] / "sample_models"
STEPS = 2_000


@pytest.fixture(scope="module")
def planned(store: Path, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict]:
    """Folder with model, site file and log, planned here after a short training, and the plan's document."""
    folder = tmp_path_factory.mktemp("frame")
    return folder, plan_it(write_site(folder), PolicyWish(steps=STEPS))


@pytest.fixture
def site_folder(planned: tuple[Path, dict], tmp_path: Path) -> Path:
    """Return a fresh copy of the planned folder that the test may change."""
    for source in planned[0].iterdir():
        shutil.copy(source, tmp_path / source.name)
    return tmp_path


def test_a_log_has_under_60_kilobytes_a_lift_and_at_the_full_rate_the_same_proof(site_folder):
    log = site_folder / "frame.mcap"
    assert log.stat().st_size < 60_000 * 8
    full = Path(plan_again(site_folder, "full.mcap", full_rate=True)["log"])
    assert full.stat().st_size > 2 * log.stat().st_size
    few, every = read_log(log), read_log(full)
    assert (few.rate, every.rate) == (LogRate.MOTION, LogRate.FULL)
    for one, other in zip(few.motions, every.motions, strict=True):
        for found, wanted in zip(one.samples(), other.samples(), strict=True):
            assert found.tobytes() == wanted.tobytes()
    assert main(["export", str(log), "--to", "full-rate", "-o", str(site_folder / "made.mcap"), "-q"]) == 0
    assert (site_folder / "made.mcap").read_bytes() == full.read_bytes()
    assert verify(full, progress=SilentProgress())["verified"] is True


def test_the_processes_that_plan_also_make_the_log_with_the_same_bytes(site_folder, monkeypatch):
    counts = []

    def counted(stream, record, *, workers):
        counts.append(workers.count)
        return write_log(stream, record, workers=workers)

    monkeypatch.setattr("bimvox_pipeline.plan.write_log", counted)
    monkeypatch.setattr("bimvox.library.arguments._FEW_PARTS", 1)
    logs = [plan_again(site_folder, f"{jobs}.mcap", jobs=jobs)["log"] for jobs in (1, 2)]
    assert counts == [1, 2]
    assert Path(logs[0]).read_bytes() == Path(logs[1]).read_bytes()


def plan_again(folder: Path, name: str = "again.mcap", policy: str | None = None, **options) -> dict:
    wish = PolicyWish(policy, steps=STEPS)
    return plan(folder / "frame.site.toml", folder / name, wish=wish, progress=SilentProgress(), **options)


def obstruct(folder: Path, *obstructions: dict) -> Path:
    file = folder / "obstructions.json"
    file.write_text(json.dumps({"version": 1, "unit": "m", "obstructions": list(obstructions)}))
    return file


def at_target(folder: Path, component: str) -> dict:
    """A box inside a component's place."""
    site = read_log(folder / "frame.mcap").plan.site
    part = next(c for c in site.components if c.id == component)
    low = site.frame.corner_of(part.target_vox) + 0.05
    return {"id": "pallet", "box": {"min": low.tolist(), "max": (low + 0.2).tolist()}}


def test_every_lift_of_the_frame_is_planned_proven_and_timed(planned):
    folder, document = planned
    assert document["verified"] is True
    assert document["infeasible"] == []
    assert len(document["lifts"]) == 8
    for order, lift in enumerate(document["lifts"]):
        assert lift["order"] == order
        assert lift["status"] == "planned"
        assert lift["method"] in ("policy", "search")
        assert lift["moves"] >= lift["shortest_moves"] > 0
        assert lift["duration_s"] >= lift["bound_s"] > 0
    classes = [lift["ifc_class"] for lift in document["lifts"]]
    assert classes == ["IfcColumn"] * 4 + ["IfcBeam"] * 4
    assert verify_plan(read_log(folder / "frame.mcap").plan).verified


def test_the_figures_are_those_of_the_lifts(planned):
    _, document = planned
    figures, lifts = document["figures"], document["lifts"]
    assert figures["planned"] == len(lifts)
    assert figures["moves"] == sum(lift["moves"] for lift in lifts)
    assert figures["moves_over_shortest"] == pytest.approx(
        figures["moves"] / sum(lift["shortest_moves"] for lift in lifts), abs=1e-6
    )
    for method, share in figures["shares"].items():
        assert share == pytest.approx(sum(lift["method"] == method for lift in lifts) / len(lifts), abs=1e-6)
    assert figures["crane_hours"] == pytest.approx(lifts[-1]["end_s"] / 3600, abs=1e-5)
    assert figures["hook_travel_m"] > 0
    assert 0 <= figures["critical_lifts"] <= len(lifts)


def test_by_search_alone_nothing_is_trained(planned, tmp_path):
    folder, _ = planned
    found = plan_again(folder, "search.mcap", policy="none")
    assert found["policy"]["id"] == "none"
    assert {lift["method"] for lift in found["lifts"]} == {"search"}
    assert found["figures"]["moves_over_shortest"] == 1.0
    assert "train" not in found["seconds"]


def test_the_log_holds_the_plan_that_was_reported(planned):
    folder, document = planned
    log = read_log(folder / "frame.mcap")
    assert [lift.moves for lift in log.plan.lifts] == [lift["moves"] for lift in document["lifts"]]
    assert [m.loaded.duration_s for m in log.motions] == pytest.approx(
        [d["duration_s"] for d in document["lifts"]], abs=2e-3
    )
    assert log.attachments["site.toml"] == (folder / "frame.site.toml").read_bytes()
    assert log.metadata["policy"] == document["policy"]["id"]


def test_the_same_inputs_and_seed_give_the_same_bytes(site_folder):
    document = plan_again(site_folder)
    assert document["policy"]["loaded"] is True
    assert (site_folder / "again.mcap").read_bytes() == (site_folder / "frame.mcap").read_bytes()


def test_a_blocked_place_makes_that_lift_infeasible_and_the_rest_goes_on(site_folder, planned):
    column = planned[1]["lifts"][0]["component"]
    document = plan_again(site_folder, obstructions=obstruct(site_folder, at_target(site_folder, column)))
    assert document["verified"] is True
    reasons = {item["component"]: item for item in document["infeasible"]}
    assert reasons[column]["blocked_by"] == ["pallet"]
    assert all(item["blocked_by"] for item in reasons.values())
    log = read_log(site_folder / "again.mcap")
    planned_again = [lift for lift in log.plan.lifts if lift.status is Status.PLANNED]
    assert 0 < len(planned_again) < 8
    assert verify_plan(log.plan).verified
    assert "obstructions.json" in log.attachments


def test_nothing_is_written_when_no_lift_can_be_planned(site_folder):
    everywhere = {"id": "flood", "box": {"min": [-100, -100, 0], "max": [100, 100, 50]}}
    with pytest.raises(NoPlanError, match="flood"):
        plan_again(site_folder, "none.mcap", obstructions=obstruct(site_folder, everywhere))
    assert not (site_folder / "none.mcap").exists()


def test_the_log_may_not_overwrite_its_inputs(site_folder):
    before = (site_folder / "frame.ifc").read_bytes()
    with pytest.raises(FileError, match="overwrite"):
        plan(site_folder / "frame.site.toml", site_folder / "frame.ifc", progress=SilentProgress())
    assert (site_folder / "frame.ifc").read_bytes() == before


def test_an_unknown_policy_is_refused(site_folder):
    with pytest.raises(PolicyError):
        plan_again(site_folder, policy="0123456789abcdef")
    assert not (site_folder / "again.mcap").exists()


@pytest.mark.parametrize(
    "name",
    [
        *("paper.ifc", "frame.ifc", "frame_ifc2x3_mm.ifc", "frame_georeferenced.ifc", "yard.glb", "yard.stl"),
        pytest.param("prefab.ifc", marks=pytest.mark.slow),
    ],
)
def test_init_writes_a_site_file_that_loads_without_edits(name, tmp_path):
    document = init(SAMPLES / name, tmp_path / "s.site.toml", progress=SilentProgress())
    tomllib.loads((tmp_path / "s.site.toml").read_text())
    site = load_site(tmp_path / "s.site.toml", SilentProgress()).site
    assert len(site.components) == document["components"] > 0
    assert site.yard.any()


@pytest.mark.parametrize("name", ["paper.site.toml", "yard.site.toml"])
def test_the_sample_site_files_load(name):
    assert load_site(SAMPLES / name, SilentProgress()).site.components


@pytest.mark.slow
def test_the_three_dialects_of_the_frame_give_one_site(tmp_path):
    sites = []
    for name in ("frame.ifc", "frame_ifc2x3_mm.ifc", "frame_georeferenced.ifc"):
        init(SAMPLES / name, tmp_path / f"{name}.site.toml", voxel_size_m=0.25, progress=SilentProgress())
        sites.append(load_site(tmp_path / f"{name}.site.toml", SilentProgress()).site)
    for other in sites[1:]:
        assert other.shape == sites[0].shape
        assert [c.id for c in other.components] == [c.id for c in sites[0].components]
        assert [c.target_vox for c in other.components] == [c.target_vox for c in sites[0].components]
    assert read_building(SAMPLES / "frame_georeferenced.ifc").origin_m[:2].tolist() == [155000.0, 463000.0]


@pytest.mark.parametrize("asked", ["luffing-40", "mobile"])
def test_a_crane_of_another_kind_is_proposed_planned_by_the_shipped_policy_and_proven(asked, store, tmp_path):
    target = tmp_path / "s.site.toml"
    document = init(SAMPLES / "frame.ifc", target, voxel_size_m=0.5, crane=asked, progress=SilentProgress())
    assert document["crane"] == {"luffing-40": "luffing-40", "mobile": "mobile-35t"}[asked]
    assert "hammerhead-30" in document["other_cranes"]
    assert document["crane"] not in document["other_cranes"]
    made = plan(target, tmp_path / "s.mcap", wish=PolicyWish("default"), progress=SilentProgress())
    assert made["verified"]
    assert made["policy"]["shipped"]
    assert [lift["method"] for lift in made["lifts"]] == ["policy"] * 8


def test_init_refuses_an_unknown_crane_before_it_reads_anything(tmp_path):
    with pytest.raises(InputError, match=r"did you mean .luffing-40."):
        init(tmp_path / "none.ifc", crane="lufing-40", progress=SilentProgress())


def test_init_keeps_an_edited_site_file(tmp_path):
    target = tmp_path / "s.site.toml"
    target.write_text("mine")
    with pytest.raises(FileError, match="exists"):
        init(SAMPLES / "frame.ifc", target, progress=SilentProgress())
    assert target.read_text() == "mine"
    init(SAMPLES / "frame.ifc", target, force=True, progress=SilentProgress())
    assert target.read_text() != "mine"


@pytest.mark.parametrize("prover", ["bimvox.library.prove.verify_plan", "bimvox.library.prove.verify_motions"])
def test_a_lift_that_cannot_be_proven_is_refused_and_the_rest_is_written(site_folder, planned, monkeypatch, prover):
    """Parts that rest on it are refused too, and nothing unproven is written."""
    module, name = prover.rsplit(".", 1)
    real = getattr(importlib.import_module(module), name)
    suspect = planned[1]["lifts"][0]["component"]

    def doubting(plan, *more, **known):
        proof = real(plan, *more, **known)
        lift = next(lift for lift in plan.lifts if plan.site.components[lift.component].id == suspect)
        if lift.status is Status.PLANNED:
            turn_to(proof.checks, suspect)
            proof.checks[0].look(False, f"{suspect}: doubted")
        return proof

    monkeypatch.setattr(prover, doubting)
    document = plan_again(site_folder)
    reasons = {item["component"]: item["reason"] for item in document["infeasible"]}
    assert "could not be proven" in reasons[suspect]
    assert "doubted" in reasons[suspect]
    assert 0 < len([lift for lift in document["lifts"] if lift["status"] == "planned"]) < 8
    assert verify_plan(read_log(site_folder / "again.mcap").plan).verified


def test_a_motion_whose_values_make_no_sense_is_refused_before_anything_is_written(site_folder, planned, monkeypatch):
    suspect = planned[1]["lifts"][0]["component"]

    def too_long(plan, *more):
        return tuple(
            replace(motion, loaded=replace(motion.loaded, bound_s=motion.loaded.duration_s + 1.0))
            if plan.site.components[motion.component].id == suspect
            else motion
            for motion in time_lifts(plan, *more)
        )

    monkeypatch.setattr("bimvox.library.prove.time_lifts", too_long)
    reasons = {item["component"]: item["reason"] for item in plan_again(site_folder)["infeasible"]}
    assert set(reasons) >= {suspect}
    assert "could not be proven: values" in reasons[suspect]


def test_a_proof_that_fails_about_the_whole_plan_writes_nothing(site_folder, monkeypatch):
    def doubting(plan, *more, **known):
        proof = verify_plan(plan, *more, **known)
        turn_to(proof.checks, None)
        proof.checks[0].look(False, "nothing adds up")
        return proof

    monkeypatch.setattr("bimvox.library.prove.verify_plan", doubting)
    with pytest.raises(VerificationError, match="nothing adds up"):
        plan_again(site_folder)
    assert not (site_folder / "again.mcap").exists()


def test_a_crane_too_weak_for_everything_is_reported_before_training(site_folder):
    text = (site_folder / "frame.site.toml").read_text()
    (site_folder / "frame.site.toml").write_text(f"{text}\n[crane.override]\nchart = [[30.0, 600.0]]\n")
    with pytest.raises(NoPlanError, match=r"governing radius .* carries 600 kg"):
        plan_again(site_folder)
    assert not (site_folder / "again.mcap").exists()


@pytest.mark.slow
def test_a_plan_that_is_made_again_after_a_watch_is_its_newest_revision(site_folder):
    log = site_folder / "frame.mcap"
    first = read_log(log)
    assert first.revision == 0
    with (site_folder / "frame.r0003.mcap").open("wb") as stream:
        write_log(stream, replace(first, revision=3))
    plan_again(site_folder, "frame.mcap")
    assert read_log(log).revision == 4
    newest = read_newest(log, None, SilentProgress())
    assert newest is not None
    assert newest.log.revision == 4
    assert verify(log, progress=SilentProgress())["verified"] is True
