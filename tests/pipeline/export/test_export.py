import csv
import dataclasses
import json

import pytest
from bimvox_pipeline.export import export
from bimvox_pipeline.inspect.inspect import inspect
from bimvox_pipeline.verify import verify

from bimvox.errors import InputError, LogFileError
from bimvox.library.plan_value import write_log_file
from bimvox.log.reader import read_log
from bimvox.progress import SilentProgress
from bimvox.records.lift import not_lifted
from bimvox.site.means import Means


def run(folder, **options):
    return export(folder / "frame.mcap", progress=SilentProgress(), **options)


def test_mcap_of_chosen_lifts_holds_those_and_no_others(site_folder):
    plan = read_log(site_folder / "frame.mcap").plan
    names = [plan.site.components[plan.lifts[n].component].id for n in (2, 5)]
    document = run(site_folder, lifts=names, out=site_folder / "two.mcap")
    assert document["lifts"] == 2
    log = read_log(site_folder / "two.mcap")
    assert [log.plan.site.components[lift.component].id for lift in log.plan.lifts] == names
    assert document["messages"] > 0


def test_csv_has_one_row_per_sample_and_a_table_of_lifts(site_folder):
    document = run(site_folder, to="csv", out=site_folder / "path.csv")
    plan = read_log(site_folder / "frame.mcap").plan
    rows = list(csv.DictReader((site_folder / "path.csv").open()))
    assert len(rows) == document["messages"]
    assert {row["component"] for row in rows} == {plan.site.components[lift.component].id for lift in plan.lifts}
    lifts = list(csv.DictReader((site_folder / "path.lifts.csv").open()))
    assert [int(row["moves"]) for row in lifts] == [lift.moves for lift in plan.lifts]


def test_json_holds_the_paths(site_folder):
    run(site_folder, to="json", out=site_folder / "path.json")
    document = json.loads((site_folder / "path.json").read_text())
    plan = read_log(site_folder / "frame.mcap").plan
    assert [lift["path_vox"] for lift in document["lifts"]] == [lift.path_vox.tolist() for lift in plan.lifts]


@pytest.mark.parametrize(("options", "words"), [({"to": "pdf"}, "mcap, csv, json"), ({"lifts": ("nobody",)}, "nobody")])
def test_what_is_not_there_is_refused(site_folder, options, words):
    with pytest.raises(InputError, match=words):
        run(site_folder, out=site_folder / "out.x", **options)
    assert not (site_folder / "out.x").exists()


def test_a_cut_off_log_is_refused_and_recovered(site_folder):
    log = site_folder / "frame.mcap"
    data = log.read_bytes()
    log.write_bytes(data[: len(data) * 2 // 3])
    with pytest.raises(LogFileError, match="recover"):
        run(site_folder, out=site_folder / "out.mcap")
    document = run(site_folder, recover=True, out=site_folder / "out.mcap")
    assert document["lost"]
    assert document["verified"] is True
    assert 0 < len(read_log(site_folder / "out.mcap").plan.lifts) <= 8
    assert inspect(site_folder / "out.mcap", SilentProgress())["recovered"] is True
    proof = verify(site_folder / "out.mcap", progress=SilentProgress())
    assert proof["verified"] is True
    assert {"recovered", "extract"} <= {claim["name"] for claim in proof["claims"]}


@pytest.mark.parametrize(("name", "proven"), [("site.toml", True), ("crane.urdf", True), ("motions.json", False)])
def test_a_log_with_a_damaged_attachment_is_recovered_without_it_and_proven_again(site_folder, name, proven):
    log = site_folder / "frame.mcap"
    data = bytearray(log.read_bytes())
    data[data.index(len(name).to_bytes(4, "little") + name.encode()) + len(name) + 90] ^= 4
    log.write_bytes(data)
    with pytest.raises(LogFileError, match="damaged"):
        read_log(log)
    document = run(site_folder, recover=True, out=site_folder / "out.mcap")
    assert document["verified"] is proven
    (lost,) = document["lost"]
    assert lost.startswith(f"the attachment {name}: ")
    assert len(read_log(site_folder / "out.mcap").planned) == 8


def test_only_lifts_of_the_crane_are_counted(site_folder):
    log = read_log(site_folder / "frame.mcap")
    site, lifts = log.plan.site, list(log.plan.lifts)
    cast = dataclasses.replace(site.components[lifts[-1].component], means=Means.IN_SITU, means_reason="so")
    components = tuple(cast if part.index == cast.index else part for part in site.components)
    lifts[-1] = not_lifted(cast, lifts[-1].order)
    plan = dataclasses.replace(log.plan, site=dataclasses.replace(site, components=components), lifts=tuple(lifts))
    path = site_folder / "cast.mcap"
    write_log_file(path, dataclasses.replace(log, plan=plan, motions=log.motions[:-1]))
    document = export(path, to="csv", out=site_folder / "cast.csv", progress=SilentProgress())
    assert document["lifts"] == len(lifts) - 1
    assert len(list(csv.DictReader((site_folder / "cast.lifts.csv").open()))) == len(lifts), "a row says how it is set"
