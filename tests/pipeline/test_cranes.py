"""`bimvox cranes`, and cranes from a machine's file: planned, listed in every output, proven from the log alone."""

from __future__ import annotations

import dataclasses
import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from bimvox_pipeline.cranes import cranes
from bimvox_pipeline.fleet.runs import Wish, digest_of
from bimvox_pipeline.inspect.building import describe_site
from bimvox_pipeline.optimise import set_up
from bimvox_pipeline.plan import plan
from bimvox_pipeline.report import report
from bimvox_pipeline.site import init
from bimvox_pipeline.studio.opened import open_site
from bimvox_pipeline.studio.saving import as_text
from bimvox_pipeline.verify import verify
from own_machine import machine_text

from bimvox.errors import ConfigError, FileError
from bimvox.library.arguments import PolicyWish
from bimvox.library.attached_files import check_attached_files
from bimvox.library.optimise import with_set_up
from bimvox.library.set_up_search.choose import search_set_ups
from bimvox.library.set_up_search.placed import PlacedSite
from bimvox.library.set_up_search.set_up import Effort
from bimvox.log.reader import read_log
from bimvox.progress import SilentProgress
from bimvox.site.catalogue import catalogue, every_machine, machines_for, machines_of, own_machines
from bimvox.site.config.file import load_site_config
from bimvox.site.machine import cranes_of

SAMPLES = Path(__file__).parents[2] / "sample_models"
SITE = """
[model]
path = "frame.ifc"
voxel_size_m = 0.5
[crane]
name = "north"
machine = "lx.toml"
base_m = [-5, -4]
jib_height_m = 18
[crane.override]
max_wind_m_s = 15
hook_block_kg = 100
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with the sample frame, a machine's file, and a site file that changes that machine."""
    found = tmp_path_factory.mktemp("own")
    shutil.copy(SAMPLES / "frame.ifc", found)
    (found / "lx.toml").write_bytes(machine_text("LX 280", "hammerhead-30"))
    (found / "frame.site.toml").write_text(SITE)
    return found


@pytest.fixture(scope="module")
def planned(folder: Path) -> dict[str, Any]:
    return plan(folder / "frame.site.toml", folder / "frame.mcap", wish=PolicyWish("none"), progress=SilentProgress())


OVERRIDES = [
    {"key": "hook_block_kg", "catalogue": "150 kg", "site": "100 kg"},
    {"key": "max_wind_m_s", "catalogue": "20 m/s", "site": "15 m/s"},
]


def test_without_a_site_it_lists_the_catalogue() -> None:
    document = cranes(None, progress=SilentProgress())
    assert [one["machine"] for one in document["machines"]] == [machine.name for machine in every_machine()]
    only = cranes(None, crane="mobile", progress=SilentProgress())["machines"]
    assert [one["machine"] for one in only] == [machine.name for machine in machines_of("mobile")]
    real = cranes(None, crane="public", progress=SilentProgress())["machines"]
    assert {one["source"] for one in real} == {"public figures"}
    assert all(one["sources"] and one["not_found"] for one in real)
    assert {one["source"] for one in only} == {"typical of its class, not a maker's machine"}


@pytest.mark.parametrize("name", ["potain-mdt-178", "wolff-100-b", "terex-rt-665"])
def test_a_real_machine_is_chosen_by_name_planned_proven_and_remarked(tmp_path: Path, name: str) -> None:
    shutil.copy(SAMPLES / "frame.ifc", tmp_path)
    site = tmp_path / "frame.site.toml"
    assert init(tmp_path / "frame.ifc", site, voxel_size_m=0.5, crane=name, progress=SilentProgress())["crane"] == name
    document = plan(site, tmp_path / "frame.mcap", wish=PolicyWish("none"), progress=SilentProgress())
    assert document["verified"] and not document["infeasible"]
    proven = verify(tmp_path / "frame.mcap", progress=SilentProgress())
    assert proven["verified"]
    for remarks in (document["remarks"], proven["remarks"]):
        (remark,) = (one for one in remarks if one["kind"] == "crane_public")
        assert "chart from public end points" in remark["text"]
    report(tmp_path / "frame.mcap", tmp_path / "frame.html", progress=SilentProgress())
    assert "chart from public end points" in (tmp_path / "frame.html").read_text(encoding="utf-8")


def test_a_machine_may_be_named_by_its_file(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(folder)
    (folder / "ky.toml").write_bytes(machine_text("KY 100", "hammerhead-45"))
    (listed,) = cranes(None, crane="ky.toml", progress=SilentProgress())["machines"]
    assert (listed["machine"], listed["kind"]) == ("KY 100", "hammerhead")
    document = cranes(Path("frame.site.toml"), crane="ky.toml", progress=SilentProgress())
    assert [(one["machine"], one["serves"]) for one in document["machines"]] == [("KY 100", True)]
    elsewhere = folder / "elsewhere"
    elsewhere.mkdir()
    (elsewhere / "ky.toml").write_bytes(machine_text("KY 100", "hammerhead-45"))
    with pytest.raises(FileError, match="is not next to the site file"):
        cranes(Path("frame.site.toml"), crane="elsewhere/ky.toml", progress=SilentProgress())


def test_optimise_tries_a_machine_of_a_file_and_writes_site_files_that_name_it(folder: Path) -> None:
    site = folder / "tried.site.toml"
    site.write_text(SITE.replace('machine = "lx.toml"', 'machine = "hammerhead-45"').split("[crane.override]")[0])
    machine = folder / "ky2.toml"
    machine.write_bytes(machine_text("KY 200", "hammerhead-30"))
    config, machines = machines_for(load_site_config(site), str(machine))
    assert [one.name for one in machines] == ["KY 200"] == [one.name for one in own_machines(config)]
    opened = open_site(site)
    opened = dataclasses.replace(opened, config=machines_for(opened.config, str(machine))[0])
    found = search_set_ups(opened, "x", machines, Effort(1, 0, cranes=1), None, SilentProgress())
    wanted = set_up(opened, found.found[0])
    text, _, _ = as_text(opened, opened.with_setup(wanted), wanted, folder / "made.site.toml")
    (folder / "made.site.toml").write_text(text)
    (crane,) = cranes_of(open_site(folder / "made.site.toml").config)
    assert (crane.machine or crane.name) == "KY 200"
    assert 'machine = "ky2.toml"' in text
    made = with_set_up(PlacedSite(opened.config, opened.building), found.found[0])
    assert made.cranes[0].machine == "ky2.toml"


def test_one_table_compares_all_machines_on_a_site(folder: Path) -> None:
    document = cranes(folder / "frame.site.toml", progress=SilentProgress())
    own = document["own"]
    assert (own["machine"], own["serves"], own["parts_served"], own["parts"]) == ("LX 280", True, 8, 8)
    assert own["base_m"] == [-5.0, -4.0, 0.0]
    rows = {one["machine"]: one for one in document["machines"]}
    assert set(rows) == {"LX 280", *(machine.name for machine in catalogue())}  # its own, at other places, too
    for row in rows.values():
        assert row["serves"] and row["reason"] == "" and row["cannot_lift"] == []
        assert 0.0 < row["highest_utilisation"] <= 1.0
        assert 0.0 < row["largest_radius_m"] <= 80.0


def test_the_document_of_plan_and_verify_names_the_machine_and_what_differs(
    folder: Path, planned: dict[str, Any]
) -> None:
    assert planned["verified"] and not planned["infeasible"]
    (crane,) = planned["cranes"]
    assert (crane["name"], crane["machine"], crane["falls"]) == ("north", "LX 280", 2)
    assert crane["overrides"] == OVERRIDES
    document = verify(folder / "frame.mcap", progress=SilentProgress())
    assert document["verified"]
    assert document["cranes"] == planned["cranes"]
    (remark,) = (one for one in document["remarks"] if one["kind"] == "crane_altered")
    assert "as its [crane.override] says: hook block 100 kg instead of 150 kg" in remark["text"]
    assert describe_site(folder / "frame.site.toml", SilentProgress())["crane"]["overrides"] == OVERRIDES


def test_the_report_lists_what_differs(folder: Path, planned: dict[str, Any]) -> None:
    report(folder / "frame.mcap", folder / "frame.html", progress=SilentProgress())
    text = (folder / "frame.html").read_text(encoding="utf-8")
    assert "max_wind_m_s: 15 m/s instead of 20 m/s" in text
    assert "LX 280" in text


def test_the_log_carries_the_machines_file_and_is_proven_without_it(folder: Path, planned: dict[str, Any]) -> None:
    record = read_log(folder / "frame.mcap")
    assert record.attachments["machine.lx.toml"] == (folder / "lx.toml").read_bytes()
    assert check_attached_files(record).passed
    text = record.attachments["site.toml"]
    forged = {
        "weaker": {"machine.lx.toml": record.attachments["machine.lx.toml"].replace(b"5000]", b"4000]")},
        "undeclared": {"site.toml": text.replace(b"max_wind_m_s = 15", b"")},
        "gone": {"machine.lx.toml": b""},
    }
    for name, files in forged.items():
        check = check_attached_files(replace(record, attachments=dict(record.attachments) | files))
        assert not check.passed, name


def test_a_log_that_hides_an_override_is_refused(folder: Path, planned: dict[str, Any]) -> None:
    record = read_log(folder / "frame.mcap")
    (crane,) = record.plan.site.cranes
    site = replace(record.plan.site, cranes=(replace(crane, overrides=()),))
    check = check_attached_files(replace(record, plan=replace(record.plan, site=site)))
    assert any("overrides" in failure for failure in check.failures)


def test_a_machines_file_belongs_to_the_inputs_of_a_run(folder: Path, tmp_path: Path) -> None:
    for name in ("frame.ifc", "lx.toml", "frame.site.toml"):
        shutil.copy(folder / name, tmp_path)
    wish = Wish(tmp_path / "frame.site.toml")
    before = digest_of(wish)
    (tmp_path / "lx.toml").write_bytes(machine_text("LX 281", "hammerhead-30"))
    assert digest_of(wish) != before


@pytest.mark.parametrize(("name", "said"), [("gone.toml", "gone.toml"), ("../lx.toml", "is not next to the site file")])
def test_a_machines_file_is_next_to_the_site_file(folder: Path, tmp_path: Path, name: str, said: str) -> None:
    shutil.copy(folder / "frame.ifc", tmp_path)
    (tmp_path / "s.site.toml").write_text(SITE.replace("lx.toml", name))
    with pytest.raises(ConfigError, match=said) as caught:
        cranes(tmp_path / "s.site.toml", progress=SilentProgress())
    assert caught.value.key == "crane.machine"


@pytest.mark.slow
def test_init_says_why_smaller_machines_do_not_serve(tmp_path: Path) -> None:
    target = tmp_path / "prefab.site.toml"
    document = init(SAMPLES / "prefab.ifc", target, progress=SilentProgress())
    assert document["crane"] == "flat-top-155"
    reasons = {one["machine"]: one["reason"] for one in document["smaller_cranes"]}
    assert set(reasons) == {"flat-top-75", "hammerhead-30", "hammerhead-45", "flat-top-120"}
    assert "storey 2 weighs 6.3 t" in reasons["flat-top-75"]
    text = target.read_text()
    assert f"flat-top-75 does not serve this site: {reasons['flat-top-75']} " in text.replace("\n# ", " ")
    assert "# flat-top-155 carries 137 of 137 parts from the yard to their places. Estimate: " in text
    assert document["cannot_lift"] == []
    assert document["other_cranes"]
    assert not {*document["other_cranes"]} & {*reasons, document["crane"]}
