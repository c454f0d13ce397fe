"""The page of set-ups: text stays text, and a set-up without a plan says why."""

from __future__ import annotations

import re

from bimvox.rendering.report.page import Figure
from bimvox.rendering.report.set_ups import best_of, set_ups_page

SVG = Figure(b"<svg xmlns='http://www.w3.org/2000/svg'/>", "image/svg+xml", "a map")


def set_up(machine: str, hours: float | None, cost: float | None, **more: object) -> dict:
    return {
        "site": f"../{machine}.site.toml",
        "machine": machine,
        "jib_m": 40.0,
        "falls": 2,
        "base_m": [1.0, -2.0],
        "yard": None,
        "refused": None if hours is None else 0,
        "hours": hours,
        "moving_hours": hours and hours - 1.0,
        "hire_days": hours and 7,
        "cost": cost,
        "critical_lifts": 1,
        "highest_utilisation": 0.5,
        "log": None if hours is None else f"{machine}.mcap",
        "error": None,
        **more,
    }


def document(front: list[dict], losers: list[dict]) -> dict:
    given = set_up("given", 4.0, 900.0)
    counts = {"tried": 1200, "machines": 10, "trials": 1}
    return {
        "site": "a.site.toml", "currency": "EUR", "verified": True, "baseline": given, "front": front, "losers": losers,
        **counts, "least_moving_hours": 0.25, "least_cost": 480.4,
    }  # fmt: skip


ROWS = [
    {
        "machine": "<b>x</b>", "jib_m": "40", "falls": "2", "second": "", "yard": "given", "parts_served": "3",
        "estimated_hours": "2.500", "estimated_cost": "800", "estimated_utilisation": "0.50", "why_lost": "a & b",
    }
]  # fmt: skip


def test_names_stay_text_and_figures_are_exact() -> None:
    hostile = "</script><script>alert(1)</script>"
    front = [set_up(hostile, 2.123456, 500.25, yard=[[0.0, 0.0]])]
    losers = [
        set_up("late", 3.0, 700.0, truckload_kg=12_000.0, why_lost="takes 0.88 h less"),
        set_up("none", None, None),
    ]
    losers[1]["error"] = {"message": "nothing to lift"}
    page = set_ups_page(document(front, losers), ROWS, [SVG], SVG).decode()
    assert "<script>" not in page
    assert page.count("</script") == 1
    assert "<b>x</b>" not in page
    assert re.search(r'<data value="2\.123456">2\.12</data>', page)
    assert "given, 12 t" in page
    assert "no hammerhead moves less than 0.25 h" in page
    assert "carries these parts alone for less than 480 EUR: at most 4.0 % of the cheapest is left to gain" in page
    assert "at most 77.7 % of the fastest one" in page  # 0.25 of 1.12 h
    assert "50 % less" not in page  # of the moving hours 3 become 1.12
    assert "63 % less moving, 44 % less cost than given" in page
    assert "nothing to lift" in page
    assert "takes 0.88 h less" in page
    assert page.count("<circle") == 3  # two plans and an estimate


def test_the_given_set_up_is_the_answer_where_none_is_better() -> None:
    dear, refusing = set_up("dear", 3.5, 990.0), set_up("refusing", 3.0, 700.0, refused=1)
    made = document([dear, refusing], [])
    given = made["baseline"]
    assert best_of(made["front"], given, "hours") is dear
    assert best_of(made["front"], given, "cost") is given
    assert best_of([], given, "hours") is given
    assert best_of([], set_up("none", None, None, refused=None), "hours") is None
    page = set_ups_page(made, [], [], SVG).decode()
    assert page.count("the given set-up; none of the others is better") == 2  # the cheapest and the least used


def test_without_any_plan_there_is_still_a_page() -> None:
    lost = set_up("none", None, None, error={"message": "no room"})
    nothing = document([], [lost])
    nothing["baseline"] = lost
    page = set_ups_page(nothing, [], [], SVG).decode()
    assert "no room" in page
