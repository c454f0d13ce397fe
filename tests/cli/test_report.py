from __future__ import annotations

import csv
import json
import stat
import sys
from pathlib import Path

import pytest
from bimvox_cli.main import run
from drawn_plans import motions_by_hand, plan_by_hand
from report_reading import ReadReport

from bimvox.log.plan_log import PlanLog
from bimvox.log.reader import read_log
from bimvox.log.recorder import write_log
from bimvox.records.proof import in_words
from bimvox.remarks.remarks import remarks_of


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    plan = plan_by_hand(crane=True, infeasible=("roof",))
    path = tmp_path_factory.mktemp("log") / "boxes.mcap"
    with path.open("wb") as stream:
        write_log(stream, PlanLog(plan=plan, motions=motions_by_hand(plan)))
    return path


def test_a_report_is_written_with_pictures_and_the_numbers_of_the_log(log, tmp_path, capsys):
    out = tmp_path / "boxes.html"
    code = run(["report", str(log), "-o", str(out), "--no-proof", "--json"])
    document = json.loads(capsys.readouterr().out)
    assert code == 0
    assert document["out"] == str(out)
    assert document["bytes"] == out.stat().st_size
    assert document["verified"] is None
    read = ReadReport(out.read_bytes())
    assert read.record == document["record"]
    assert read.tags.count("img") == 3  # the building, the blockers of the roof, a plot
    stored = read_log(log)
    rows = {int(row["order"]): row for row in read.rows["lifts"] if "order" in row}
    assert {motion.order for motion in stored.motions} <= set(rows)
    assert read.record["infeasible"] == [2]
    assert "silo" in read.text


def test_without_matplotlib_the_rest_is_there_and_the_missing_plots_are_named(log, tmp_path, monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    out = tmp_path / "boxes.html"
    assert run(["report", str(log), "-o", str(out), "--no-proof"]) == 0
    assert 'pip install "bimvox[plots]"' in " ".join(capsys.readouterr().err.split())
    assert ReadReport(out.read_bytes()).tags.count("img") == 2  # the building, the blockers of the roof
    assert run(["report", str(log), "-o", str(out), "--no-proof", "--figures", str(tmp_path / "figures")]) == 2
    assert 'pip install "bimvox[plots]"' in " ".join(capsys.readouterr().err.split())


def test_a_failed_proof_is_reported_with_exit_code_1(log, tmp_path, capsys):
    # Motions made by hand jump from cell to cell, which no crane can do.
    code = run(["report", str(log), "-o", str(tmp_path / "x.html"), "--pictures", "0", "--json"])
    document = json.loads(capsys.readouterr().out)
    assert code == 1
    assert document["verified"] is False
    read = ReadReport((tmp_path / "x.html").read_bytes())
    assert "NOT PROVEN" in read.text
    assert "img" not in read.tags


def test_it_is_named_after_its_log(log, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert run(["report", str(log), "--no-proof", "--pictures", "0"]) == 0
    assert (tmp_path / "boxes.report.html").is_file()
    assert "2 of 3 planned" in capsys.readouterr().out


@pytest.mark.slow
def test_figures_and_their_numbers_are_separate_files(log, tmp_path, capsys):
    folder = tmp_path / "figures"
    code = run(["report", str(log), "-o", str(tmp_path / "x.html"), "--no-proof", "--figures", str(folder), "--json"])
    document = json.loads(capsys.readouterr().out)
    assert code == 0
    drawn = ("hook-travel", "methods", "path-lengths", "utilisation")
    names = sorted(["lifts.csv", *(f"{name}.{suffix}" for name in drawn for suffix in ("png", "svg"))])
    assert sorted(file.name for file in folder.iterdir()) == names
    assert document["figures"] == [str(folder / name) for name in names]
    rows = list(csv.DictReader((folder / "lifts.csv").open()))
    assert [int(row["order"]) for row in rows] == [0, 1, 2]
    for row, lift in zip(rows, document["record"]["lifts"], strict=True):
        assert row["status"] == lift["status"]
        if lift["governs"]:
            assert float(row["utilisation"]) == lift["governs"]["utilisation"]
            assert float(row["governing_time_s"]) == lift["governs"]["time_s"]
            assert float(row["duration_s"]) == lift["duration_s"]
        else:
            assert row["utilisation"] == ""
    (tmp_path / "file").write_text("x")
    assert (
        run(["report", str(log), "-o", str(tmp_path / "y.html"), "--no-proof", "--figures", str(tmp_path / "file")])
        == 2
    )


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["-o", "x.docx"], "HTML or PDF"),
        (["--critical", "0"], "critical"),
        (["--critical", "75"], "critical"),
    ],
)
def test_what_cannot_be_written_is_reported(log, tmp_path, monkeypatch, capsys, arguments, words):
    monkeypatch.chdir(tmp_path)
    assert run(["report", str(log), *arguments]) == 2
    assert words in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


def test_only_a_log_has_a_report(tmp_path, capsys):
    other = tmp_path / "o.json"
    other.write_text('{"version": 1, "unit": "m", "obstructions": []}')
    assert run(["report", str(other)]) == 2
    assert "only a log has a report" in capsys.readouterr().err


def test_without_a_browser_there_is_no_pdf_which_is_reported_first(log, tmp_path, monkeypatch, capsys):
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.delenv("BIMVOX_BROWSER", raising=False)
    monkeypatch.setattr("sys.platform", "linux")
    assert run(["report", str(log), "-o", str(tmp_path / "x.pdf")]) == 2
    assert "none is installed" in capsys.readouterr().err
    monkeypatch.setenv("BIMVOX_BROWSER", "no-such-browser")
    assert run(["report", str(log), "-o", str(tmp_path / "x.pdf")]) == 2
    assert "no-such-browser" in capsys.readouterr().err


def _fake_browser(folder: Path, script: str) -> Path:
    file = folder / "browser"
    file.write_text(f"#!/bin/sh\n{script}\n")
    file.chmod(file.stat().st_mode | stat.S_IXUSR)
    return file


def test_the_browser_prints_the_page_and_todays_date_is_not_in_the_pdf(log, tmp_path, monkeypatch, capsys):
    browser = _fake_browser(
        tmp_path,
        'for a in "$@"; do case "$a" in --print-to-pdf=*) out="${a#*=}";; file:*) page="${a#file://}";; esac; done\n'
        'test -s "$page" || exit 3\n'
        "printf '%%PDF-1.4 /CreationDate (D:20260102030405+00'\"'\"'00'\"'\"') "
        '/ModDate (D:20260102030405Z)\' > "$out"',
    )
    monkeypatch.setenv("BIMVOX_BROWSER", str(browser))
    out = tmp_path / "x.pdf"
    assert run(["report", str(log), "-o", str(out), "--no-proof", "--pictures", "0"]) == 0
    assert out.read_bytes() == b"%PDF-1.4 /CreationDate (D:19800101000000+00'00') /ModDate (D:19800101000000Z)"


def test_a_browser_that_fails_leaves_nothing_behind(log, tmp_path, monkeypatch, capsys):
    monkeypatch.setenv("BIMVOX_BROWSER", str(_fake_browser(tmp_path, "echo cannot open display >&2; exit 1")))
    assert run(["report", str(log), "-o", str(tmp_path / "x.pdf"), "--no-proof", "--pictures", "0"]) != 0
    assert "cannot open display" in capsys.readouterr().err
    assert not (tmp_path / "x.pdf").exists()


def test_the_record_and_the_console_have_the_remarks_next_to_the_proof(log, tmp_path, capsys):
    stored = read_log(log)
    found = remarks_of(stored.plan, stored.motions, stored.context)
    run(["report", str(log), "-o", str(tmp_path / "x.html"), "--pictures", "0", "--json"])
    record = json.loads(capsys.readouterr().out)["record"]
    assert record["remarks"] == [remark.to_dict() for remark in found]
    assert in_words(found) in record["verdict"]["remarks"]
    run(["report", str(log), "-o", str(tmp_path / "x.html"), "--pictures", "0"])
    said = capsys.readouterr().out
    assert "NOT PROVEN: " in said
    assert in_words(found) in said


def test_cards_of_lifts_are_written_instead_and_what_has_none_is_named(log, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert run(["report", str(log), "--no-proof", "--lift", "1", "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["cards"] == [1]
    page = (tmp_path / "boxes.cards.html").read_text(encoding="utf-8")
    assert page.count('<section class="card"') == 1
    assert run(["report", str(log), "--no-proof", "--critical", "0.0001", "--lift", "critical", "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["cards"] == [order + 1 for order in sorted(document["record"]["critical"])]
    for wanted, said in (("3", "it has no card"), ("critical", "no lift is critical"), ("nobody", "nobody")):
        share = ["--critical", "1"] if wanted == "critical" else []
        assert run(["report", str(log), "--no-proof", *share, "--lift", wanted]) == 2
        assert said in capsys.readouterr().err
