"""A correction of what parts are, from the table to the proven plan."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import pytest
from bimvox_pipeline.inspect.inspect import inspect
from bimvox_pipeline.plan import plan
from bimvox_pipeline.site import init
from bimvox_pipeline.verify import verify

from bimvox.bim.kinds.kind import Kind
from bimvox.errors import ConfigError, FileError, LogFileError, SelectionError
from bimvox.library.plan_value import write_log_file
from bimvox.log.reader import read_log
from bimvox.progress import SilentProgress
from bimvox.site.config.kind_file import corrections_in

TOLD = SilentProgress()
BEAMS = 'IfcBeam, Name*="Beam"'


def corrected(folder: Path, kinds: str, more: str = "") -> Path:
    """Write corrections into the site file of the planned frame."""
    site = folder / "frame.site.toml"
    head, tail = site.read_text(encoding="utf-8").split("kinds = [\n", 1)
    site.write_text(f"{head}kinds = [\n{kinds}\n{tail}{more}", encoding="utf-8")
    return site


def planned(site: Path) -> dict[str, dict]:
    document = plan(site, site.with_name("corrected.mcap"), progress=TOLD)
    assert document["verified"]
    return {lift["name"]: lift for lift in document["lifts"]}


def proof(folder: Path, **given: Path) -> dict:
    return verify(folder / "corrected.mcap", progress=TOLD, **given)


def test_plan_uses_a_correction_of_a_type_and_the_log_is_proven_with_it(site_folder: Path) -> None:
    site = corrected(site_folder, f"{{ select = '{BEAMS}', kind = 'timber', means = 'by_hand' }},")
    lifts = planned(site)
    assert {lift["status"] for name, lift in lifts.items() if name.startswith("Beam")} == {"by_hand"}
    assert {lift["kind"] for name, lift in lifts.items() if name.startswith("Beam")} == {"timber"}
    assert {lift["status"] for name, lift in lifts.items() if name.startswith("Column")} == {"planned"}
    assert proof(site_folder)["verified"]
    assert proof(site_folder, site=site, model=site_folder / "frame.ifc")["verified"]


def test_a_log_whose_site_file_does_not_say_what_it_claims_is_refused(site_folder: Path) -> None:
    site = corrected(site_folder, f"{{ select = '{BEAMS}', means = 'in_situ' }},")
    planned(site)
    log = read_log(site_folder / "corrected.mcap")
    parts = log.plan.site.components
    beam = next(one for one in parts if one.name.startswith("Beam"))

    def forged(**changes: object) -> dict:
        other = tuple(dataclasses.replace(one, **changes) if one is beam else one for one in parts)
        own = dataclasses.replace(log.plan, site=dataclasses.replace(log.plan.site, components=other))
        write_log_file(site_folder / "corrected.mcap", dataclasses.replace(log, plan=own))
        return proof(site_folder)["checks"]["own_files"]

    assert forged()["passed"]
    assert not forged(stated_means="built")["passed"]
    with pytest.raises(LogFileError, match="stated_means"):
        forged(stated_means="hovers")
    assert not forged(judgement=dataclasses.replace(beam.judgement, why="the site file says so"))["passed"]


def test_a_part_that_is_left_out_is_not_there_and_one_can_be_another_kind(site_folder: Path) -> None:
    ids = {one.name: one.id for one in read_log(site_folder / "frame.mcap").plan.site.components}
    more = "".join(
        f'\n[[component]]\nglobal_id = "{ids[name]}"\n{key}\n'
        for name, key in (("Beam 1", 'means = "out"'), ("Column A1", 'kind = "steel"'))
    )
    lifts = planned(corrected(site_folder, "", more))
    assert "Beam 1" not in lifts
    assert (lifts["Column A1"]["kind"], lifts["Column A2"]["kind"]) == ("steel", "concrete")
    assert proof(site_folder)["verified"]


def test_a_table_goes_out_is_corrected_and_comes_in(site_folder: Path) -> None:
    table = site_folder / "kinds.csv"
    assert inspect(site_folder / "frame.ifc", TOLD, kind_file=table)["csv"] == str(table)
    head, *rows = table.read_text(encoding="utf-8-sig").splitlines()
    assert (
        head == "set_kind,set_means,parts,ifc_class,type,material,kind,means,from_kg,to_kg,confidence,kind_from,select"
    )
    lines = [head, *(f"steel,{row[1:]}" if "IfcBeam" in row else row for row in rows)]
    table.write_text("\n".join(lines).replace(",", ";"), encoding="cp1252")
    table.write_text("\n".join(lines), encoding="utf-8")
    site = corrected(site_folder, '"kinds.csv",')
    lifts = planned(site)
    assert {lift["kind"] for name, lift in lifts.items() if name.startswith("Beam")} == {"steel"}
    assert proof(site_folder, site=site)["verified"]
    assert "machine.kinds.csv" in read_log(site_folder / "corrected.mcap").attachments
    table.write_text(table.read_text(encoding="utf-8").replace("steel", "timber"), encoding="utf-8")
    assert not proof(site_folder, site=site)["verified"]
    rows = inspect(site, TOLD)["kinds"]
    assert {row["kind"] for row in rows if row["ifc_class"] == "IfcBeam"} == {"timber"}
    assert not any("kind" in row["assumed"] for row in rows)


def test_init_takes_a_corrected_table(site_folder: Path) -> None:
    table = site_folder / "kinds.csv"
    table.write_text(f'set_kind,set_means,select\n,out,"{BEAMS.replace(chr(34), chr(34) * 2)}"\n', encoding="utf-8")
    site = site_folder / "new.site.toml"
    document = init(site_folder / "frame.ifc", site, kind_file=table, progress=TOLD)
    assert document["components"] == 4
    assert '  "kinds.csv",\n' in site.read_text(encoding="utf-8")
    with pytest.raises(FileError, match="is not next to the site file"):
        init(site_folder / "frame.ifc", site_folder.parent / "x.site.toml", kind_file=table, progress=TOLD)


def test_a_table_that_may_hold_corrections_is_not_written_over(site_folder: Path) -> None:
    table = site_folder / "kinds.csv"
    table.write_text("mine", encoding="utf-8")
    with pytest.raises(FileError, match="exists already and may hold your corrections"):
        inspect(site_folder / "frame.ifc", TOLD, kind_file=table)
    with pytest.raises(FileError, match="only models and sites have types"):
        inspect(site_folder / "frame.mcap", TOLD, kind_file=site_folder / "new.csv")


def test_a_bad_row_stops_the_plan_before_the_model_is_read(site_folder: Path) -> None:
    (site_folder / "kinds.csv").write_text("set_kind,set_means,select\nwood,,IfcBeam\n", encoding="utf-8")
    with pytest.raises(ConfigError, match=r"kinds\.csv: line 2, column set_kind: 'wood' is not one of"):
        plan(corrected(site_folder, '"kinds.csv",'), site_folder / "x.mcap", progress=TOLD)


def test_a_model_without_lifts_is_refused_with_a_way_that_needs_no_site_file(site_folder: Path) -> None:
    """The same answer in ``init`` and ``plan``; the table that the hint names makes lifts of the parts."""
    model, table = site_folder / "frame.ifc", site_folder / "kinds.csv"
    table.write_text("set_kind,set_means,select\nmasonry,,IfcBeam + IfcColumn\n", encoding="utf-8")
    with pytest.raises(SelectionError, match="nothing to lift: of 8 parts, 8 are built in place") as refused:
        init(model, site_folder / "new.site.toml", kind_file=table, progress=TOLD)
    with pytest.raises(SelectionError) as refused_too:
        plan(corrected(site_folder, '"kinds.csv",'), site_folder / "x.mcap", progress=TOLD)
    assert str(refused.value) == str(refused_too.value)
    assert "set_means" in (refused.value.hint or "")
    assert not (site_folder / "new.site.toml").exists()
    table.write_text("set_kind,set_means,select\nmasonry,crane,IfcBeam + IfcColumn\n", encoding="utf-8")
    assert init(model, site_folder / "new.site.toml", kind_file=table, progress=TOLD)["components"] == 8


def test_selected_masonry_is_lifted_and_the_log_is_proven(site_folder: Path) -> None:
    site = corrected(site_folder, '{ select = "IfcBeam + IfcColumn", kind = "masonry" },')
    site.write_text(site.read_text(encoding="utf-8").replace("[model]\n", '[model]\nselect = "IfcBeam + IfcColumn"\n'))
    assert {lift["status"] for lift in planned(site).values()} == {"planned"}
    assert proof(site_folder, site=site)["verified"]


def test_a_table_of_a_site_has_what_its_file_says_and_can_take_its_place(site_folder: Path) -> None:
    own = f"{{ select = '{BEAMS}', kind = 'steel' }},\n{{ select = 'IfcBeam + IfcColumn', means = 'crane' }},"
    site = corrected(site_folder, own)
    table = site_folder / "kinds.csv"
    before = inspect(site, TOLD, kind_file=table)["kinds"]
    found = {(one.select, one.kind, one.means) for one in corrections_in(table.read_bytes(), table)}
    assert found == {(BEAMS, Kind.STEEL, None), ("IfcBeam + IfcColumn", None, "crane")}
    site.write_text(site.read_text(encoding="utf-8").replace(own, '"kinds.csv",'), encoding="utf-8")
    assert inspect(site, TOLD)["kinds"] == before
