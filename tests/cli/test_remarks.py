"""The verdict with the count of remarks next to it, and the remarks by part."""

from __future__ import annotations

import io
import json
import re
from pathlib import Path

import pytest
import seeded_faults as faults
from bimvox_cli.main import run
from bimvox_cli.matters import remark_matters, show_matters
from bimvox_cli.remarks import show_remarks, verdict
from rich.console import Console

from bimvox.library.plan_value import write_log_file

SOME = [
    {
        "kind": "floats",
        "severity": "serious",
        "component": "1",
        "name": "cloud",
        "text": "floats 5.9 m up",
    },
    {
        "kind": "floats",
        "severity": "serious",
        "component": "2",
        "name": "mist",
        "text": "floats 6.1 m up",
    },
    {"kind": "wind", "severity": "minor", "component": None, "name": None, "text": "no wind is considered"},
    {"kind": "assumed_mass", "severity": "note", "component": None, "name": None, "text": "masses are estimated"},
]


def matters(remarks: list[dict], most_lines: int = 9) -> str:
    stream = io.StringIO()
    show_matters(Console(file=stream, width=160), remark_matters(remarks), most_lines=most_lines)
    return stream.getvalue()


@pytest.mark.parametrize(
    ("proven", "remarks", "words", "colour"),
    [
        (True, [], "proven, no remarks", "green"),
        (True, SOME[3:], "proven, 1 note", "green"),
        (True, SOME[2:], "proven, 1 remark", "yellow"),
        (True, SOME, "proven, 3 remarks (2 serious)", "yellow"),
        (False, SOME[:0], "proven, no remarks", "red"),
    ],
)
def test_green_is_only_what_is_proven_and_clean(proven: bool, remarks: list[dict], words: str, colour: str) -> None:
    text = verdict("proven", {"verified": proven, "remarks": remarks})
    assert (text.plain, text.style) == (words, colour)


def test_parts_that_are_set_by_other_means_are_not_green() -> None:
    assert verdict("proven", {"verified": True, "remarks": []}, others=1).style == "yellow"


def test_a_kind_is_counted_and_shown_by_its_first_remark() -> None:
    lines = matters(SOME).splitlines()
    assert lines[2].split() == ["serious", "2", "floats", "cloud:", "floats", "5.9", "m", "up"]
    assert "mist" not in matters(SOME)
    assert "masses" not in matters(SOME)


def test_only_what_fits_is_shown_the_gravest_first() -> None:
    more = [{**SOME[2], "kind": f"small_{n}", "text": f"matter {n}"} for n in range(7)]
    told = matters([*SOME, *more, more[6]])
    assert len(told.splitlines()) == 9
    assert "small 3" in told
    assert told.splitlines()[-1] == "... and 4 more (small 4, small 5, small 6)"


def test_long_texts_are_whole_if_they_fit_and_cut_to_one_line_otherwise() -> None:
    long = [{**SOME[2], "kind": f"small_{n}", "text": "wind " * 40} for n in range(3)]
    assert "..." not in matters(long)
    cut = matters(long, 5).splitlines()
    assert len(cut) == 5
    assert all(line.endswith("...") for line in cut[2:])


def test_remarks_are_listed_by_part_with_the_notes() -> None:
    stream = io.StringIO()
    show_remarks(Console(file=stream, width=160), SOME)
    for remark in SOME:
        assert str(remark["text"]) in stream.getvalue()
    assert "mist" in stream.getvalue()


def test_verify_tells_conditions_and_remarks_and_its_exit_code_does_not_change(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "200")
    log = tmp_path / "log.mcap"
    write_log_file(log, faults.good_log())
    assert run(["verify", str(log)]) == 0
    told = capsys.readouterr().out
    assert re.search(r"every check passed: proven, with \d+ claims of the log, 6 remarks", told)
    assert told.startswith("yes: every check passed")
    assert len(told.splitlines()) <= 25
    assert "--obstructions proves 1" in told
    assert "there is no wind" in told
    assert run(["verify", str(log), "--table", "claims", "--table", "checks"]) == 0
    tables = capsys.readouterr().out
    assert "no obstruction is missing [--obstructions proves it]" in tables
    assert re.search(r"^motion_cells +yes", tables, re.MULTILINE)
    assert "a mass of unknown origin" not in told
    assert run(["verify", str(log), "--remarks"]) == 0
    listed = capsys.readouterr().out
    assert "a mass of unknown origin" in listed
    assert run(["verify", str(log), "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["verdict"] == f"yes: every check passed: proven, with {len(document['claims'])} claims of the log"
    tag_line, wind = document["conditions"]
    assert tag_line.startswith("people keep the heading of every load by tag line while the jib turns: by 59 degrees")
    assert wind == "there is no wind"
    assert set(document["remarks"][0]) == {"kind", "severity", "component", "name", "text"}
    assert sum(remark["severity"] != "note" for remark in document["remarks"]) == 6
    assert run(["inspect", str(log), "--json"]) == 0
    inspected = json.loads(capsys.readouterr().out)["remarks"]
    assert inspected["minor"] + inspected["serious"] == 6
