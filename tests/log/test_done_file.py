"""What has been carried out, read from tables and programmes."""

import dataclasses
from datetime import datetime, timedelta
from functools import cache
from pathlib import Path

import pytest
import seeded_faults as faults

from bimvox.errors import ConfigError, FileError
from bimvox.exporters.lift_schedule import DEFAULT_BEGIN, schedule_of
from bimvox.exporters.ms_project import to_ms_project
from bimvox.log.done_file import done_until, read_done
from bimvox.log.plan_log import PlanLog, log_dates
from bimvox.log.segments import NOW_NS
from bimvox.records.done import DoneWork

FILE = Path("done.csv")


@cache
def log() -> PlanLog:
    """Return the log of two columns, a beam that is cast on them, and a slab, with a start."""
    made = faults.log_with_a_cast_beam()
    calendar = b"\n[calendar]\nstart = 2026-03-09\n"
    return dataclasses.replace(made, attachments={"site.toml": made.attachments["site.toml"] + calendar})


def read(data: str | bytes, file: Path = FILE):
    return read_done(file, data if isinstance(data, bytes) else data.encode(), log(), log_dates(log()))


@pytest.mark.parametrize("separator", [",", ";", "\t"])
@pytest.mark.parametrize("form", ["2026-03-09T08:00,2026-03-09T08:30", "9.3.2026 8:00,09.03.2026 08:30"])
def test_a_table_names_parts_by_number_id_or_name_with_any_separator(separator, form):
    part = log().plan.site.components[log().plan.lifts[1].component].id
    text = f"Part,Actual start,Finish\n\n1,{form}\n{part},2026-03-09 09:00,\n3,,\n".replace(",", separator)
    done, notes = read("\ufeff" + text)
    eight = datetime(2026, 3, 9, 8)
    assert done == DoneWork({0: eight, 1: eight + timedelta(hours=1)}, {0: eight + timedelta(minutes=30)})
    assert notes == ()
    assert done.until == eight + timedelta(hours=1)


def test_without_a_beginning_a_part_took_as_long_as_planned():
    begins, ends = log_dates(log()).spans[0]
    done, _ = read("part,ends\n1,2026-03-11T10:00")
    assert done.begun[0] == datetime(2026, 3, 11, 10) - (ends - begins)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "it is empty"),
        ("part,begins\n1,2026-03-09T08:00", "line 1: no column 'ends'"),
        ("\nwho,ends\n1,2026-03-09T08:00", "line 2: no column 'part'"),
        ("part,ends\n1,yesterday", "line 2: 'yesterday' is not a date and time"),
        ("part,ends\n1,31.02.2026 08:00", "line 2: '31.02.2026 08:00' is not"),
        ("part,begins,ends\n1,2026-03-09T08:00,2026-03-09T07:00", "line 2: 1 ends before it begins"),
    ],
)
def test_what_cannot_be_read_is_refused_with_its_line(text, words):
    with pytest.raises(FileError, match=words):
        read(text)
    with pytest.raises(ConfigError, match="not XML"):
        read("<Project")


def test_an_unknown_part_is_named_and_the_rest_is_used():
    rows = "\n".join(f"Unknown {n},2026-03-09T08:00" for n in range(7))
    done, notes = read(f"part,ends\n1,2026-03-09T08:00\n{rows}\n99,2026-03-09T08:00")
    assert list(done.ended) == [0]
    assert "line 3: " in notes[0] and "Unknown 0" in notes[0]
    assert notes[-1] == "done.csv, not used: and 3 more"
    assert read("part,ends\n") == (None, ())


def test_a_schedule_of_ours_that_was_worked_on_gives_its_actual_dates_back():
    dates, orders = log_dates(log()), [lift.order for lift in log().plan.lifts]
    schedule = schedule_of(log(), DEFAULT_BEGIN, orders, dates)
    assert read(to_ms_project(schedule), Path("plan.xml")) == (None, ())
    spans = dates.spans
    worked = DoneWork({0: spans[0][0], 1: spans[1][0]}, {0: spans[0][1]})
    data = to_ms_project(schedule.with_progress(worked, schedule.all_times))
    assert read(data, Path("plan.xml")) == (worked, ())


def test_a_simulated_watch_says_what_was_carried_out_then():
    dates = log_dates(log())
    assert done_until(log(), dates) is None
    first, second = log().motions[:2]
    assert first.released_ns == second.work_starts_ns
    found = [
        done_until(dataclasses.replace(log(), metadata={**log().metadata, NOW_NS: str(now_ns)}), dates)
        for now_ns in (first.released_ns - 1, first.released_ns)
    ]
    assert [(len(one.begun), len(one.ended)) for one in found] == [(1, 0), (2, 1)]
    assert found[1].begun[second.order] == dates.spans[second.order][0]
