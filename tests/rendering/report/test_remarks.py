"""The remarks in the report: grouped, named, counted, and only text."""

from __future__ import annotations

import dataclasses
import json

from log_building import tiny_log
from opened_pages import EVIL, passed_proof, revision_of, some_remarks
from report_reading import ReadReport

from bimvox.records.proof import Remark, Severity
from bimvox.rendering.report.page import report_page
from bimvox.rendering.report.record import record_of


def page_of(remarks, proof=None) -> bytes:
    log = tiny_log(crane=True)
    return report_page(record_of(revision_of(log, proof, remarks)), log.plan.site.cranes)


def test_every_remark_is_a_row_under_its_severity_with_lift_and_part():
    read = ReadReport(page_of(some_remarks(floating=3), passed_proof()))
    serious, minor, notes = (
        [row for row in read.rows[f"{severity}-remarks"] if "data-kind" in row]
        for severity in ("serious", "minor", "note")
    )
    assert [row["order"] for row in serious] == [2, 2, 2]
    assert [row["data-kind"] for row in minor] == ["hand_load", "wind"]
    assert "the whole plan" in minor[1]["words"]
    assert "order" not in minor[1]
    for row, name, number, text in (
        (serious[0], "Beam", "3", "nothing carries it (0)"),
        (minor[0], "ColumnB", "2", "a hand carries it"),
        (notes[0], "ColumnA", "1", "the density of concrete"),
    ):
        assert name in row["words"]
        assert text in row["words"]
        assert row["words"].split()[0] == number


def test_they_are_counted_next_to_the_verdict_and_come_before_the_schedule():
    page = page_of(some_remarks(floating=2), passed_proof()).decode()
    head = page[page.index("<header>") : page.index("</header>")]
    assert '<p class="chip serious">proven</p>' in head
    assert '<p class="chip serious">⚠\ufe0e 4 remarks (2 serious)</p>' in head
    assert "Remarks: 2 serious, 2 minor, 1 note<" in page
    assert page.index('id="remarks"') < page.index('id="critical-lifts"') < page.index('id="lifts"')
    assert page.index('id="remarks"') < page.index('id="gantt"')


def test_within_a_severity_they_go_by_kind_then_by_lift():
    minor = Severity.MINOR
    remarks = tuple(
        Remark(kind, minor, f"text {name}", f"0GlobalId{name}", name)
        for kind, name in (("b", "Beam"), ("a", "Beam"), ("b", "ColumnA"), ("a", "ColumnA"))
    )
    rows = [row for row in ReadReport(page_of(remarks)).rows["minor-remarks"] if "data-kind" in row]
    assert [(row["data-kind"], row["order"]) for row in rows] == [("b", 0), ("b", 2), ("a", 0), ("a", 2)]


def test_equal_remarks_are_one_row_with_the_number_of_parts_and_their_names():
    minor = Severity.MINOR
    wide = [Remark("transport", minor, "is 3.7 m wide", f"0GlobalId{name}", name) for name in ("Beam", "ColumnA")]
    others = [Remark("transport", minor, "is 3.7 m wide", f"other {n}", f"other {n}") for n in range(3)]
    apart = Remark("transport", minor, "is 3.8 m wide", "0GlobalIdColumnB", "ColumnB")
    read = ReadReport(page_of((*wide, apart, *others)))
    first, second = (row for row in read.rows["minor-remarks"] if "data-kind" in row)
    assert first["parts"] == 5
    words = " ".join(first["words"].split())
    assert "5 parts : other 0, other 1 and 3 more (1, 3)" in words
    assert words.count("is 3.7 m wide") == 1
    assert second["order"] == 1
    assert "Remarks: 6 minor" in read.text


def test_a_plan_without_remarks_says_so():
    clean = page_of((), passed_proof()).decode()
    assert '<p class="chip clean">✓ proven</p>' in clean
    assert "Remarks: none" in clean


def test_the_record_has_them_in_the_form_of_verify():
    remarks = some_remarks()
    record = ReadReport(page_of(remarks, passed_proof())).record
    assert record["remarks"] == json.loads(json.dumps([remark.to_dict() for remark in remarks]))
    assert set(record["remarks"][0]) == {"kind", "severity", "component", "name", "text"}
    assert record["verdict"]["proof"] == "proven"


def test_lifts_proven_against_earlier_obstructions_only_are_named():
    proof = dataclasses.replace(passed_proof(), not_current=("0GlobalIdColumnA",))
    read = ReadReport(page_of((), proof))
    assert read.record["proof"]["not_current"] == [
        {"order": 0, "number": 1, "component": "0GlobalIdColumnA", "name": "ColumnA (0GlobalIdColumnA)"}
    ]
    assert "proven, 1 lift against earlier obstructions only" in read.text
    assert "set before the last change: 1 ColumnA (0GlobalIdColumnA)." in read.text
    (row,) = [row for row in read.rows["lifts"] if row.get("data-order") == "0"]
    assert "earlier obstructions" in row["words"]
    assert "✓ proven" not in row["words"]


def test_a_lift_says_how_many_remarks_there_are_about_its_part():
    rows = ReadReport(page_of(some_remarks(floating=2), passed_proof())).rows["lifts"]
    words = {row["data-order"]: " ".join(row["words"].split()) for row in rows if "data-order" in row}
    assert words["2"].endswith("planned, proven ⚠\ufe0e 2 serious")
    assert words["1"].endswith("✕ infeasible ! 1 minor")
    assert words["0"].endswith("planned, ✓ proven")  # a note only


def test_hostile_words_are_only_text():
    words = f"{EVIL}\x1b[31m\u202e" + "x" * 5000
    remarks = (
        Remark(words, Severity.SERIOUS, words, "no such part", words),
        Remark(words, Severity.MINOR, words),
    )
    page = page_of(remarks)
    shown = page.decode().split('<script type="application/json"')[0]
    assert "<img" not in shown
    assert not {"\x1b", "\u202e"} & set(shown)
    read = ReadReport(page)
    assert f"{EVIL}\\x1b[31m\\u202e" in read.text
    assert read.record["remarks"][0]["text"] == words


def test_square_metres_are_written_with_their_sign():
    read = ReadReport(page_of((Remark("low_wind", Severity.MINOR, "its sail area is 15.5 m2; m2 is a name"),)))
    assert "its sail area is 15.5 m²; m2 is a name" in read.text
