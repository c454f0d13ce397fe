import pytest
from bimvox_cli import watch as command
from bimvox_cli.main import run
from bimvox_cli.watch import line_of

CHANGE = {
    "event": "replanned",
    "revision": 3,
    "changed_cells": 1234,
    "kept": ["a", "b"],
    "replanned": ["d"],
    "infeasible": ["e", "f"],
    "latency_ms": 41.0,
    "blocked": [
        {"component": "e", "reason": "it is blocked", "blocked_by": ["truck"], "blocked_by_names": ["truck"]},
        {"component": "f", "reason": "what it rests on cannot be set", "blocked_by": [], "blocked_by_names": []},
    ],
}


def test_a_line_names_what_cannot_be_lifted_and_why():
    said = "revision 3: replanned, 1,234 cells changed, 2 kept, 1 replanned, 2 infeasible (e by truck; f), 41 ms"
    assert line_of(CHANGE) == said


def test_a_line_names_a_few_and_counts_the_rest():
    blocked = [{"component": f"p{n}", "reason": "", "blocked_by": [], "blocked_by_names": []} for n in range(9)]
    assert "9 infeasible (p0; p1; p2 and 6 more)" in line_of(
        CHANGE | {"infeasible": [one["component"] for one in blocked], "blocked": blocked}
    )


def test_a_line_counts_the_remarks_about_a_first_plan():
    counts = {"serious": 1, "minor": 2, "note": 5}
    assert line_of(CHANGE | {"remarks": counts}).endswith("41 ms, 3 remarks (1 serious)")


def test_a_line_says_which_infeasible_lifts_are_set_by_other_means():
    one, other = CHANGE["blocked"]
    both = CHANGE | {"blocked": [one | {"by_other_means": True}, other | {"by_other_means": True}]}
    assert "1 replanned, 2 by other means (e by truck; f), 41 ms" in line_of(both)
    first = CHANGE | {"blocked": [one | {"by_other_means": True}, other]}
    assert "2 infeasible, 1 of them by other means (e by truck; f)" in line_of(first)


def test_a_line_without_infeasible_lifts_names_none():
    assert "0 infeasible, 41 ms" in line_of(CHANGE | {"infeasible": [], "blocked": []})


def test_the_lines_about_traffic_say_what_happened_and_whether_it_is_proven():
    change = {
        "event": "traffic",
        "revision": 0,
        "log": "a.traffic.mcap",
        "traffic": "random, medium, seed 7",
        "decider": "a rule",
        "lifts": 6,
        "delivered": 5,
        "time_s": 5854.0,
        "time_lost_s": 1656.4,
        "moved": 2,
        "stops": 7,
        "waits": 3,
        "others_waited_s": 262.0,
        "least_distance_m": 0.334,
        "violations": 0,
        "verified": True,
        "failures": [],
    }
    lines = line_of(change).splitlines()
    assert lines[0] == "traffic: random, medium, seed 7; a rule"
    assert "5 of 6 lifts delivered in 1 h 38 min, 28 min lost; 2 at another place" in lines[1]
    assert "7 stops with a load, 3 waits; others waited for 4 min" in lines[2]
    assert "0 times somebody under a suspended load (nobody nearer than 0.33 m); proven" in lines[3]
    bad = change | {"verified": False, "failures": ["others: crew 1"], "least_distance_m": None}
    assert line_of(bad).splitlines()[3].endswith("(nobody near); not proven: others: crew 1")


@pytest.mark.parametrize("event", ["rejected", "missing", "failed"])
def test_a_line_about_a_plan_that_stays_counts_no_lifts(event):
    change = CHANGE | {"event": event, "changed_cells": 0, "retimed": ["a"], "message": "the last good plan stands"}
    assert line_of(change) == f"revision 3: {event}, 41 ms: the last good plan stands"


@pytest.mark.parametrize(("shown", "code"), [(0, 130), (1, 0)])
def test_ctrl_c_while_a_change_is_shown_ends_a_watch_that_has_a_plan(monkeypatch, tmp_path, shown, code):
    closed = []

    def changes(*_args, **_options):
        try:
            if shown == 0:
                raise KeyboardInterrupt
            yield CHANGE
        finally:
            closed.append(True)

    def interrupted(*_args, **_options):
        raise KeyboardInterrupt

    monkeypatch.setattr("bimvox_pipeline.watch.watch.watch", changes)
    monkeypatch.setattr(command.Output, "line", interrupted)
    assert run(["watch", str(tmp_path / "o.json"), "--site", str(tmp_path / "s.toml")]) == code
    assert closed == [True]
