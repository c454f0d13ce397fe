"""Names that other programs would execute or could not read."""

import csv
import dataclasses
import io
from pathlib import Path
from xml.etree import ElementTree

import pytest
from bimvox_cli.main import run
from full_disk import full_disk
from log_building import tiny_log

from bimvox.exporters.csv_json import lifts_csv, to_csv
from bimvox.exporters.lift_schedule import DEFAULT_BEGIN, schedule_of
from bimvox.exporters.ms_project import to_ms_project
from bimvox.exporters.text import for_csv, for_xml
from bimvox.log.plan_log import PlanLog
from bimvox.log.recorder import write_log


def named(name: str) -> PlanLog:
    log = tiny_log()
    parts = tuple(dataclasses.replace(part, name=name) for part in log.plan.site.components)
    return dataclasses.replace(
        log, plan=dataclasses.replace(log.plan, site=dataclasses.replace(log.plan.site, components=parts))
    )


@pytest.mark.parametrize("character", ["\x1b", "\x07", "\0", "\ufffe", "\ud800"])
def test_project_xml_is_well_formed_whatever_a_name_holds(character: str) -> None:
    log = named(f"beam{character}<&>")
    written = to_ms_project(schedule_of(log, DEFAULT_BEGIN, [lift.order for lift in log.plan.lifts]))
    names = [entry.text or "" for entry in ElementTree.fromstring(written).iter() if entry.tag.endswith("}Name")]
    assert any(f"beam\\x{ord(character):02x}<&>" in name for name in names)


def test_ordinary_names_stay() -> None:
    assert for_xml("Stütze\tα\U0001f3d7") == "Stütze\tα\U0001f3d7"
    assert for_csv("beam-1") == "beam-1"
    assert for_csv(-1.5) == -1.5


@pytest.mark.parametrize("name", ["=1+1", "+1", "-1", "@SUM(A1)"])
def test_no_cell_of_a_table_is_a_formula(name: str) -> None:
    log = named(name)
    assert {row["name"] for row in csv.DictReader(io.StringIO(lifts_csv(log)))} == {f"'{name}"}
    first = next(csv.DictReader(io.StringIO(to_csv(log))))
    assert float(first["time_s"]) >= 0.0


@pytest.mark.parametrize("character", ["\x1b", "\0", "\ud800"])
def test_no_cell_of_a_table_holds_a_control_character(character: str) -> None:
    written = lifts_csv(named(f"beam{character}1"))
    assert {row["name"] for row in csv.DictReader(io.StringIO(written))} == {f"beam\\x{ord(character):02x}1"}


@pytest.mark.parametrize("to", ["mcap", "csv", "json", "glb", "ros2", "layout", "msproject"])
def test_a_full_disk_is_reported_and_leaves_nothing(
    to: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    if to == "ros2":
        pytest.importorskip("rosbags")
    monkeypatch.chdir(tmp_path)
    with Path("a.mcap").open("wb") as stream:
        write_log(stream, tiny_log())
    with full_disk(100):
        code = run(["export", "a.mcap", "--to", to, "-o", "out"])
    err = capsys.readouterr().err
    assert code == 2, err
    assert "file too large" in err
    assert "Traceback" not in err
    assert [path.name for path in tmp_path.iterdir()] == ["a.mcap"]


def test_two_tables_are_written_both_or_not_at_all(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    with Path("a.mcap").open("wb") as stream:
        write_log(stream, tiny_log())
    lifts, samples = len(lifts_csv(tiny_log()).encode()), len(to_csv(tiny_log()).encode())
    assert lifts < samples
    Path("out.lifts.csv").write_text("of an earlier plan")
    with full_disk((lifts + samples) // 2):
        code = run(["export", "a.mcap", "--to", "csv", "-o", "out.csv"])
    assert code == 2, capsys.readouterr().err
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.mcap", "out.lifts.csv"]
    assert Path("out.lifts.csv").read_text() == "of an earlier plan"


@pytest.mark.parametrize(("value", "cell"), [(6.399999999999999, "6.4"), (-1.6e-15, "0.0"), (1e-5, "1e-05"), (7, "7")])
def test_numbers_in_a_table_have_sensible_digits(value, cell):
    assert str(for_csv(value)) == cell
