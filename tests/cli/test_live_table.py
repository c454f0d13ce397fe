import io

from bimvox_cli.live import WatchTable, states_of
from rich.console import Console

DOCUMENT = {
    "event": "replanned",
    "revision": 3,
    "kept": ["a", "b", "c"],
    "retimed": ["b"],
    "replanned": ["d"],
    "infeasible": ["e"],
    "pending": ["d"],
    "latency_ms": 41.0,
    "blocked": [
        {
            "component": "e",
            "reason": "it is blocked at its place",
            "blocked_by": ["truck"],
            "blocked_by_names": ["truck"],
        }
    ],
}


def test_every_lift_has_one_state_the_most_telling_one():
    assert states_of(DOCUMENT) == {"a": "kept", "b": "retimed", "c": "kept", "d": "pending", "e": "infeasible"}


def test_the_table_shows_states_reasons_and_latency():
    screen = io.StringIO()
    table = WatchTable(Console(file=screen, force_terminal=True, width=100, height=30), "o.json")
    table.show(DOCUMENT, "revision 3")
    table.close()
    text = screen.getvalue()
    for part in ("o.json, revision 3", "being planned", "new motion", "it is blocked at its place, truck", "41 ms"):
        assert part in text


def test_a_state_of_a_part_hides_nothing_of_the_last_change_and_is_no_change():
    screen = io.StringIO()
    table = WatchTable(Console(file=screen, force_terminal=True, width=100, height=30), "o.json")
    table.show(DOCUMENT, "revision 3: replanned")
    refused = {key: DOCUMENT[key] for key in ("kept", "replanned", "infeasible", "revision")}
    table.show(refused | {"event": "rejected", "latency_ms": 1.0}, "revision 3: rejected: o.json: not JSON")
    for state in ("in_transit", "arrived", "assembled"):
        screen.truncate(0)
        table.show({"event": "state", "component": "a", "state": state}, f"60 s: a is {state}")
        text = screen.getvalue()
        assert "rejected: o.json: not JSON" in text
        assert f"60 s: a is {state}" in text
        assert "(1 changes)" in text
    table.close()


def test_a_low_screen_shows_what_matters_and_counts_the_rest():
    screen = io.StringIO()
    table = WatchTable(Console(file=screen, force_terminal=True, width=100, height=11), "o.json")
    table.show(DOCUMENT | {"kept": [f"k{n}" for n in range(500)]}, "line")
    table.close()
    text = screen.getvalue()
    assert "infeasible" in text
    assert "more" in text
    assert "k499" not in text
