import io
import json
import re
import sys

import pytest
from bimvox_cli.live import LiveProgress
from bimvox_cli.output import console_on, facts, open_output, print_json, rows, spent, written


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def test_results_go_to_stdout_and_notes_to_stderr(capsys: pytest.CaptureFixture[str]) -> None:
    with open_output(as_json=False, quiet=False) as output:
        output.progress.note("no unit: metres assumed")
    assert output.result({"kind": "grid"}, facts) == 0
    output.next_step("next: bimvox plan")
    out, err = capsys.readouterr()
    assert out.split() == ["kind", "grid"]
    assert err == "note: no unit: metres assumed\nnext: bimvox plan\n"


def test_json_is_all_there_is_on_stdout(capsys: pytest.CaptureFixture[str]) -> None:
    with open_output(as_json=True, quiet=False) as output:
        output.progress.note("a note")
    assert output.result({"verified": False, "name": "Stütze [1]"}, facts) == 1
    output.next_step("next: nothing")
    out, err = capsys.readouterr()
    assert json.loads(out) == {"verified": False, "name": "Stütze [1]"}
    assert err == "note: a note\n"


def test_quiet_prints_only_the_result(capsys: pytest.CaptureFixture[str]) -> None:
    with open_output(as_json=False, quiet=True) as output:
        output.progress.note("a note")
    output.result({"out": "x.mcap"}, facts)
    output.line({"event": "changed"}, "changed")
    output.next_step("next: nothing")
    assert capsys.readouterr() == ("", "")
    output.answer({"kind": "grid"}, facts)
    assert capsys.readouterr().out.split() == ["kind", "grid"]


def test_a_stream_is_one_object_a_line(capsys: pytest.CaptureFixture[str]) -> None:
    with open_output(as_json=True, quiet=False) as output:
        output.line({"revision": 1}, "revision 1")
        output.line({"revision": 2}, "revision 2")
    assert [json.loads(line) for line in capsys.readouterr().out.splitlines()] == [{"revision": 1}, {"revision": 2}]


def test_json_never_holds_nan() -> None:
    with pytest.raises(ValueError, match="not JSON compliant"):
        print_json({"worst": float("nan")})


def test_json_on_an_ascii_terminal_is_still_json(monkeypatch: pytest.MonkeyPatch) -> None:
    raw = io.BytesIO()
    monkeypatch.setattr(sys, "stdout", io.TextIOWrapper(raw, encoding="ascii"))
    print_json({"name": "Stütze"})
    sys.stdout.flush()
    assert json.loads(raw.getvalue().decode("ascii")) == {"name": "Stütze"}


def test_names_with_brackets_are_not_markup() -> None:
    stream = io.StringIO()
    facts(console_on(stream), {"name": "[bold]beam[/]"})
    assert "[bold]beam[/]" in stream.getvalue()


def test_no_colour_without_a_terminal_or_against_the_users_wish(monkeypatch: pytest.MonkeyPatch) -> None:
    document = {"site": "a.toml", "parts": [{"id": "b", "cells": 1234}]}
    monkeypatch.delenv("FORCE_COLOR", raising=False)
    plain = io.StringIO()
    facts(console_on(plain), document)
    assert "\x1b" not in plain.getvalue()
    assert "1,234" in plain.getvalue()
    monkeypatch.setenv("NO_COLOR", "1")
    terminal = Terminal()
    facts(console_on(terminal), document)
    assert "\x1b[3" not in terminal.getvalue()


def test_long_tables_say_what_they_leave_out() -> None:
    stream = io.StringIO()
    rows(console_on(stream), ("n",), [(n,) for n in range(25)], limit=20)
    assert "... and 5 more" in stream.getvalue()


def test_nothing_is_drawn_for_an_empty_table() -> None:
    stream = io.StringIO()
    rows(console_on(stream), ("n",), [])
    assert stream.getvalue() == ""


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (None, ""),
        (True, "yes"),
        (1234567, "1,234,567"),
        (0.123456, "0.1235"),
        (149600123.4567, "149,600,123.457"),
        (2.0, "2"),
        (0.0, "0"),
        (0.0000123, "1.2e-05"),
        ("a", "a"),
    ],
)
def test_values_for_people(value: object, text: str) -> None:
    assert written(value) == text


def test_stage_times() -> None:
    assert spent({"read": 1.25, "write": 0.5}) == "1.7 s (read 1.2, write 0.5)"  # the sum of what is shown


def test_facts_are_written_as_people_write_them(capsys: pytest.CaptureFixture[str]) -> None:
    document = {
        "voxel_size_m": 0.2,
        "origin_m": [-6.0, -11.0, 0.5],
        "sling_angle_rad": 1.0471975512,
        "crane": {"mass_t": 2.3041, "times": {"sling_s": 120.04, "hours_m3": 3}},
        "name_m": "text",
        "seconds": {"read": 1.24, "guess": 0.01},
        "lifts": [{"number": 1, "order": 0, "component": "2QxK1$EbrRl8zoFluYGbwb", "start_s": 1115.568}],
    }
    with open_output(as_json=False, quiet=False) as output:
        output.result(document, facts)
    lines = [line.rstrip() for line in capsys.readouterr().out.splitlines()]
    assert [re.sub(r"  +", "  ", line) for line in lines] == [
        "voxel size  0.2 m",
        "origin  -6, -11, 0.5 m",
        "sling angle  60 degrees",
        "crane  mass 2.3 t",
        "  times sling 120 s, hours m3 3",
        "name m  text",
        "took  1.2 s (read 1.2)",
        "",
        "lifts",
        "number  component  start s",
        "  1  2QxK1$EbrRl8zoFluYGbwb  1,115.6",
    ]


def test_an_id_is_never_cut_in_two(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "60")
    rows(console_on(sys.stdout), ("name", "component"), [("A name of many words " * 5, "2QxK1$EbrRl8zoFluYGbwb")])
    assert "2QxK1$EbrRl8zoFluYGbwb" in capsys.readouterr().out


def test_a_bar_on_a_terminal_is_removed_at_the_end(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("TERM", "xterm")
    stream = Terminal()
    progress = LiveProgress(console_on(stream))
    with progress.stage("plan [lifts]", total=3):
        progress.advance(3)
    shown = stream.getvalue()
    assert "plan [lifts]" in shown
    assert shown.rstrip().endswith("\x1b[2K")


def test_no_progress_bar_without_a_terminal() -> None:
    stream = io.StringIO()
    progress = LiveProgress(console_on(stream))
    with progress.stage("plan", total=3):
        progress.advance(3)
    assert stream.getvalue() == ""


def test_a_long_stage_without_a_terminal_prints_lines(monkeypatch: pytest.MonkeyPatch) -> None:
    now = [0.0]
    monkeypatch.setattr("bimvox_cli.live.time.monotonic", lambda: now[0])
    stream = io.StringIO()
    progress = LiveProgress(console_on(stream))
    progress.stage("train", total=20_000)
    now[0] = 11.0
    progress.advance(5_000)
    now[0] = 12.0
    progress.advance(5_000)
    assert stream.getvalue() == "train: 5,000 of 20,000\n"


def test_a_stage_that_runs_for_a_while_says_how_long_it_will_take(monkeypatch: pytest.MonkeyPatch) -> None:
    now = [0.0]
    for clock in ("bimvox_cli.live.time.monotonic", "bimvox.progress.time.perf_counter"):
        monkeypatch.setattr(clock, lambda: now[0])
    stream = io.StringIO()
    progress = LiveProgress(console_on(stream))
    progress.stage("lifts", total=100)
    for at_s, done in ((11.0, 20), (22.0, 20), (33.0, 58)):
        now[0] = at_s
        progress.advance(done)
    progress.stage("guess")
    now[0] = 60.0
    progress.advance()
    assert stream.getvalue().splitlines() == [
        "lifts: 20 of 100, about 45 s left",
        "lifts: 40 of 100, about 35 s left",
        "lifts: 98 of 100",
        "guess: 1",
    ]


def test_a_bar_says_it_too(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("TERM", "xterm")
    now = [0.0]
    monkeypatch.setattr("bimvox.progress.time.perf_counter", lambda: now[0])
    stream = Terminal()
    progress = LiveProgress(console_on(stream))
    progress.stage("lifts", total=1000)
    now[0] = 30.0
    progress.advance(100)
    progress._bars.refresh()
    progress.finish()
    assert "lifts, about 4 min left" in stream.getvalue()
    assert "100 of 1,000" in stream.getvalue()


def test_a_bar_counts_only_what_can_be_counted(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("TERM", "xterm")
    stream = Terminal()
    progress = LiveProgress(console_on(stream))
    with progress.stage("read"):
        progress._bars.refresh()
    assert "read" in stream.getvalue()
    assert "?" not in stream.getvalue().replace("\x1b[?25", "")


def test_v_prints_every_stage_with_its_time(monkeypatch: pytest.MonkeyPatch) -> None:
    now = [0.0]
    monkeypatch.setattr("bimvox.progress.time.perf_counter", lambda: now[0])
    stream = io.StringIO()
    progress = LiveProgress(console_on(stream), verbose=True)
    with progress.stage("read"):
        now[0] += 1.25
    progress.stage("plan")
    now[0] += 3.0
    progress.finish()
    progress.finish()
    assert stream.getvalue() == "read: 1.2 s\nplan: 3.0 s\n"


@pytest.mark.parametrize("columns", ["0", "1", "-5", "abc"])
def test_results_are_shown_whatever_the_width_of_the_terminal(
    columns: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("COLUMNS", columns)
    with open_output(as_json=False, quiet=False) as output:
        assert output.result({"kind": "grid"}, facts) == 0
    assert capsys.readouterr().out.split() == ["kind", "grid"]
