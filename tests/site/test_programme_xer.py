"""A programme of Primavera P6: what is read of it, and what a damaged file is refused with."""

from __future__ import annotations

from datetime import datetime
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from xer_files import xer_text

from bimvox.errors import ConfigError
from bimvox.site.programme import Programme, read_programme, read_xer

WALL_ID = "0aaaaaaaaaaaaaaaaaaaaa"
TASKS = [
    ("101", "11", "Columns", "2026-03-09 07:00", "2026-03-09 16:00"),
    ("102", "11", "Wände", "2026-03-10 07:00", "2026-03-10 16:00"),
    ("103", "12", '12"" Walls', "2026-03-11 07:00", "2026-03-11 16:00"),
    ("104", "12", 'Roof "A', "2026-03-12 07:00", ""),
]


def read(text: str, encoding: str = "cp1252") -> Programme:
    return read_programme(text.encode(encoding), "site.xer", Path("a.site.toml"))


@pytest.mark.parametrize("encoding", ["cp1252", "utf-8", "utf-8-sig"])
def test_activities_have_their_place_their_dates_and_their_order(encoding):
    text = xer_text(TASKS, links=[("104", "101", "PR_FS")], memos={"102": f"wall {WALL_ID}\x7f\x7fcast elsewhere"})
    programme = read(text, encoding)
    assert [one.path for one in programme.tasks] == [
        "Tower / Level 1 / Columns",
        "Tower / Level 1 / Wände",
        'Tower / Level 2 / 12" Walls',
        'Tower / Level 2 / Roof "A',
    ]
    assert [one.rank for one in programme.tasks].index(max(one.rank for one in programme.tasks)) == 0
    assert programme.tasks[0].start == datetime(2026, 3, 9, 7)
    assert programme.tasks[0].finish == datetime(2026, 3, 9, 16)
    assert programme.tasks[3].finish is None
    assert programme.tasks[1].ids == {WALL_ID}


def test_links_of_every_kind_and_fields_of_ones_own_are_read():
    text = xer_text(
        TASKS,
        links=[("103", "101", "PR_SS"), ("103", "102", "PR_FF"), ("102", "104", "PR_SF")],
        fields={"103": WALL_ID},
    )
    table = read_xer(text.encode())
    assert [(first, then, kind.value) for first, then, kind in table.links] == [
        (5, 3, "START_START"),
        (5, 4, "FINISH_FINISH"),
    ]
    assert WALL_ID in table.rows[5].words


def test_what_is_done_goes_before_what_was_planned_and_a_note_may_have_lines():
    text = xer_text(TASKS, memos={"101": "first line\r\nsecond line " + WALL_ID})
    plain = [line.split("\t") for line in text.split("\r\n")]
    for cells in plain:
        if "target_end_date" in cells:
            cells.append("act_start_date")
        elif cells[:2] == ["%R", "101"]:
            cells.append("2026-03-16 07:00")
    programme = read("\r\n".join("\t".join(cells) for cells in plain))
    assert programme.tasks[0].start == datetime(2026, 3, 16, 7)


@pytest.mark.parametrize(
    ("change", "told"),
    [
        (lambda text: text.replace("ERMHDR", "ERM"), r"line 1: not a file of Primavera P6"),
        (lambda text: text[: text.index("%T\tTASKPRED")], r"line \d+: it was cut off"),
        (lambda text: text.replace("\ttask_name", "\tname"), r"line 14: table TASK has no column task_name"),
        (
            lambda text: text.replace("2026-03-10 07:00", "10.03.26"),
            r"line 16: activity: target_start_date: '10.03.26'",
        ),
        (lambda text: text.replace("\tColumns", "\tCol\tumns\tand\tmore"), r"line 15: a row of 1\d values"),
        (lambda text: text.replace("%T\tTASK\r", "%T\tTASKS\r"), r"no activities"),
        (lambda text: text.replace("%T\tPROJECT", "garbage"), r"line 2: it begins with 'garbage'"),
    ],
)
def test_a_damaged_file_is_refused_with_its_line(change, told):
    with pytest.raises(ConfigError, match=rf"sequence\.programme: site\.xer: .*{told}") as caught:
        read(change(xer_text(TASKS)))
    assert "Primavera XER" in caught.value.hint


def test_a_programme_given_without_a_site_file_is_named_alone():
    with pytest.raises(ConfigError, match=r"^ours\.xer: line 1: ") as caught:
        read_programme(b"nothing", "ours.xer", None)
    assert "sequence" not in str(caught.value)


@given(st.data())
def test_a_garbled_file_is_read_or_refused(data):
    """Whatever happens to a file, it ends in a programme or in a sentence."""
    raw = bytearray(xer_text(TASKS, links=[("101", "102", "PR_FS")], memos={"101": "note"}).encode())
    for _ in range(data.draw(st.integers(1, 6))):
        at = data.draw(st.integers(0, len(raw) - 1))
        raw[at : at + data.draw(st.integers(0, 30))] = data.draw(st.binary(max_size=10))
        raw = raw or bytearray(b"x")
    try:
        read_programme(bytes(raw), "site.xer", None)
    except ConfigError as error:
        assert str(error).startswith("site.xer: ")
