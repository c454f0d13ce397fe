"""The answer to a plan: at most 25 lines, the verdict first, alike matters in one line, tables on request."""

from __future__ import annotations

import io
import json
from pathlib import Path
from typing import Any

import pytest
from bimvox_cli.answer import first_line, matters_of, show_answer
from bimvox_cli.main import run
from bimvox_cli.plan_tables import TABLES, figure_fields, show_table
from rich.console import Console

MODEL = Path(__file__).parents[2] / "sample_models" / "frame.ifc"
MOST = 25
HOW = ("found by", "moves", "shortest", "bound s")
FIGURES = {
    "planned": 2,
    "moves": 10,
    "moves_over_shortest": 1.0,
    "crane_hours": 2.03,
    "loaded_hours": 0.13,
    "shares": {"search": 1.0},
    "hook_travel_m": 220.0,
    "critical_lifts": 0,
    "critical_share": 0.75,
    "swing": None,
    "permitted_wind": {"speed_m_s": 9.26, "name": "Wall 1"},
    "hire_days": 3,
}


def lift(number: int, status: str = "planned", **more: Any) -> dict[str, Any]:
    """Return a lift of the document of a plan."""
    seen = {
        "load_kg": 1100.0,
        "gross_capacity_kg": 2000.0,
        "radius_m": 12.34,
        "utilisation": 0.5 + number / 100.0,
        "permitted_wind_m_s": 10.0,
        "begins_in_words": f"day 1 {7 + number % 10:02d}:00",
    }
    return {
        "number": number,
        "component": f"2O2Fr$t4X7Zf8NOew3FL{number:02d}",
        "name": f"Wall {number}",
        "ifc_class": "IfcWall",
        "status": status,
        "mass_kg": 1000.0,
        "method": "search" if status == "planned" else None,
        "moves": 10,
        "shortest_moves": 10,
        "duration_s": 60.0,
        "bound_s": 50.0,
        "storey": "1",
        "kind": "precast",
        "kind_from": "its name says so",
        "confidence": "named",
        "mass_from": "density",
        **(seen if status == "planned" else {}),
        **more,
    }


def refused(number: int, reason: str, **more: Any) -> dict[str, Any]:
    """Return an entry of ``infeasible``."""
    return {
        "number": number,
        "component": f"2O2Fr$t4X7Zf8NOew3FL{number:02d}",
        "name": f"Wall {number}",
        "reason": reason,
        "blocked_by": [],
        "blocked_by_names": [],
        "is_carried": True,
        "by_other_means": False,
        **more,
    }


def remark(kind: str, severity: str, number: int) -> dict[str, Any]:
    """Return a remark about a part."""
    return {"kind": kind, "severity": severity, "name": f"Wall {number}", "component": "", "text": f"{kind} " * 60}


def document_of(lifts: list[dict[str, Any]], **more: Any) -> dict[str, Any]:
    """Return the document of a plan."""
    return {
        "verified": True,
        "log": "house.mcap",
        "lifts": lifts,
        "infeasible": [],
        "remarks": [],
        "not_lifted": [],
        "deliveries": [],
        "pauses": [],
        "held": [],
        "props_needed": {},
        "notes": ["a note"],
        "not_covered": [{"topic": "Tandem lifts", "text": "None.", "code": "tandem", "components": []}],
        "cranes": [{"name": "C1", "machine": "C1", "jib_length_m": 40.0, "falls": 2, "overrides": []}],
        "figures": FIGURES,
        "calendar": None,
        "policy": {"id": "none"},
        "seconds": {"plan": 1.0},
        "time": {
            "begins": "day 1 07:00",
            "ends": "day 3 14:10",
            "working_days": 3,
            "crane_hours": 20.04,
            "span_in_words": "day 1 07:00 to day 3 14:10, 3 working days",
            "hours_in_words": "20.0 crane hours to lift and 2.5 to unload",
        },
        **more,
    }


def answer(document: dict[str, Any], width: int = 160) -> list[str]:
    """Return the lines of the answer."""
    stream = io.StringIO()
    show_answer(Console(file=stream, width=width, markup=False, highlight=False, emoji=False), document)
    return stream.getvalue().splitlines()


def told(document: dict[str, Any], name: str, *, verbose: bool = False) -> str:
    """Return the text of a table."""
    stream = io.StringIO()
    console = Console(file=stream, width=200, markup=False, highlight=False, emoji=False)
    show_table(console, name, document, verbose=verbose)
    return stream.getvalue()


MANY = document_of(
    [lift(number) for number in range(1, 31)]
    + [lift(number, "infeasible") for number in range(31, 71)]
    + [lift(71, "in_situ"), lift(72, "by_hand"), lift(73, "by_hand")],
    infeasible=[refused(number, f"Wall {number - 1} is in its way after {number} moves") for number in range(31, 71)],
    remarks=[remark(f"matter_{n % 12}", ("serious", "minor")[n % 12 > 3], n) for n in range(120)],
)


@pytest.mark.parametrize("width", [60, 80, 120, 160])
def test_the_answer_has_25_lines_at_most_with_the_next_command(width: int) -> None:
    lines = answer(MANY, width)
    assert len(lines) <= MOST - 1
    assert all(len(line) <= width for line in lines)


def test_the_verdict_comes_first_and_says_of_how_many_parts() -> None:
    first = answer(MANY)[0]
    assert first.startswith("30 of 70 lifts planned (73 parts: 1 cast in place, 2 by hand), ")
    assert first.endswith("every planned lift is proven, 120 remarks (40 serious)")
    assert str(first_line(document_of([lift(1)]))) == "1 of 1 lift planned, every planned lift is proven, no remarks"


def test_forty_alike_refusals_are_one_line_and_come_before_remarks() -> None:
    what, count, about, first = matters_of(MANY)[0]
    assert (what, count, about) == ("refused", 40, "what is around")
    assert first == "31 Wall 31: Wall 30 is in its way after 31 moves"
    assert [one[0] for one in matters_of(MANY)[1:6]] == ["serious"] * 4 + ["minor"]


def test_refusals_by_reach_chart_or_gear_and_those_set_by_other_means_say_so() -> None:
    heavy = refused(1, "no crane carries it", is_carried=False)
    other = refused(2, "no crane carries it", is_carried=False, by_other_means=True)
    found = matters_of(document_of([lift(1, "infeasible"), lift(2, "infeasible")], infeasible=[heavy, other]))
    assert [one[:3] for one in found] == [("refused", 1, "crane or gear"), ("by other means", 1, "crane or gear")]


def test_an_example_has_the_number_of_its_lift_because_many_parts_have_one_name() -> None:
    lifts = [lift(number, name="WALL") for number in (1, 2)]
    found = {**remark("near", "minor", 2), "component": lifts[1]["component"], "name": "WALL"}
    document = document_of(lifts, remarks=[found])
    assert matters_of(document)[0][3].startswith("2 WALL: near")
    assert told(document, "remarks").splitlines()[2].split()[:3] == ["2", "minor", "WALL"]


def test_what_parts_are_taken_as_stands_between_serious_and_minor_remarks() -> None:
    assumed = {"kind": "assumed_kind", "severity": "note", "name": None, "component": None, "text": "2 are assumed"}
    found = matters_of(document_of([lift(1)], remarks=[remark("a", "serious", 1), remark("b", "minor", 1), assumed]))
    assert [one[0] for one in found] == ["serious", "assumed", "minor"]


def test_the_five_lifts_that_use_most_come_with_what_capacity_means() -> None:
    lines = answer(document_of([lift(number) for number in range(1, 31)]))
    title = next(n for n, line in enumerate(lines) if line.startswith("worst lifts by capacity"))
    assert "gross: gear and hook block count as load" in lines[title]
    assert [line.split()[0] for line in lines[title + 2 : title + 7]] == ["30", "29", "28", "27", "26"]


def test_how_paths_were_found_is_left_to_verbose() -> None:
    document = document_of([lift(1)])
    shown = "\n".join(answer(document)) + told(document, "lifts")
    assert [word for word in HOW if word in shown] == []
    assert [word for word in HOW if word in told(document, "lifts", verbose=True)] == list(HOW)


@pytest.mark.parametrize("name", TABLES)
def test_every_table_is_printed_whole_or_says_that_there_is_nothing(name: str) -> None:
    assert told(document_of([]), name).strip()
    assert "... and" not in told(MANY, name)


def test_time_is_told_by_day_and_clock_and_hours_of_the_crane() -> None:
    lines = answer(document_of([lift(1)]))
    assert "time   day 1 07:00 to day 3 14:10, 3 working days; 20.0 crane hours to lift and 2.5 to unload" in lines
    narrow = answer(document_of([lift(1)]), 60)
    assert "time   day 1 07:00 to day 3 14:10, 3 working days" in narrow
    assert "work   20.0 crane hours to lift and 2.5 to unload" in narrow
    assert "elapsed" not in "\n".join(lines)


def test_hire_is_told_in_days_if_it_is_known() -> None:
    assert dict(figure_fields(FIGURES | {"hire_days": None}))["hire"] is None
    said = [dict(figure_fields(FIGURES | {"hire_days": days}))["hire"] for days in (1, 12)]
    assert [str(one).split(" of ")[0] for one in said] == ["1 day", "12 days"]


def test_the_likely_end_and_what_numbers_count_are_said():
    time = MANY["time"] | {"ends_p80": "day 4 09:00"}
    lines = answer(MANY | {"time": time})
    assert any("in 80 of 100 cases by day 4 09:00 (P80)" in line for line in lines)
    assert not any("(P80)" in line for line in answer(MANY))
    assert any("; numbers are of all 73 parts, in their order" in line for line in answer(MANY))
    assert not any("numbers are of all" in line for line in answer(MANY | {"lifts": MANY["lifts"][:30]}))


def test_the_command_answers_and_prints_tables_on_request(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert run(["init", str(MODEL)]) == 0
    assert len(capsys.readouterr().out.splitlines()) < MOST
    assert run(["plan", "frame.site.toml"]) == 0
    out, err = capsys.readouterr()
    assert out.splitlines()[0].startswith("8 of 8 lifts planned")
    assert len(out.splitlines()) < MOST
    assert "note:" not in err
    assert err.splitlines()[-1] == "next: bimvox render frame.mcap -o frame.html"
    assert run(["plan", "frame.site.toml", "--table", "lifts,remarks", "-v"]) == 0
    out = capsys.readouterr().out
    assert out.splitlines()[0].startswith("8 of 8 lifts planned")
    assert "lifts: 8" in out
    assert "remarks: " in out
    assert "how their paths were found" in out
    assert "found by" in out
    assert run(["plan", "frame.site.toml", "--table", "lift"]) == 2
    assert "did you mean lifts?" in capsys.readouterr().err
    assert run(["plan", "frame.site.toml", "--json"]) == 0
    _has_time_and_what_governs(json.loads(capsys.readouterr().out))


def _has_time_and_what_governs(document: dict[str, Any]) -> None:
    time = document["time"]
    assert time["begins"] == "Mon 8 January 2024 07:00"
    assert time["crane_hours"] == pytest.approx(document["figures"]["crane_hours"])
    for one in document["lifts"]:
        assert one["load_kg"] > one["mass_kg"]
        assert one["utilisation"] == pytest.approx(one["load_kg"] / one["gross_capacity_kg"], rel=1e-3)
        assert one["begins_in_words"].startswith("Mon 8 Jan")
