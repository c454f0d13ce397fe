"""The page of many plans: a row a run with its figures and links, totals, and no script or request."""

from __future__ import annotations

import re
from typing import Any

from bimvox.rendering.report.many_sites import many_plans_page

_PLANNED = {
    "run": "north", "site": "north.site.toml", "obstructions": None, "seed": None, "status": "planned", "error": None,
    "verified": True, "lifts": 1200, "planned": 1200, "infeasible": 0, "crane_hours": 90.5, "loaded_hours": 30.25,
    "hook_travel_m": 12_000.0, "critical_lifts": 3, "remarks": 0, "serious_remarks": 0,
}  # fmt: skip
_FAILED: dict[str, Any] = dict.fromkeys(_PLANNED) | {
    "run": "<gone>",
    "site": "gone.site.toml",
    "obstructions": "truck.json",
    "seed": 7,
    "status": "failed",
    "error": "file: no such <file>",
}


def page(*rows: dict[str, Any], files: dict[str, dict[str, str]] | None = None) -> str:
    return many_plans_page(rows, files or {}).decode()


def exact(html: str, key: str) -> list[str]:
    """Return the exact values that the page gives for a key."""
    return re.findall(rf'<data value="([^"]*)" data-key="{key}"', html)


def test_each_run_is_a_row_with_its_figures_and_the_totals_add_them_up():
    south = _PLANNED | {"run": "south", "status": "partly", "planned": 1190, "infeasible": 10, "crane_hours": 80.0}
    html = page(_PLANNED, south)
    assert exact(html, "crane_hours") == ["170.5", "90.5", "80.0"]
    assert exact(html, "planned") == ["2390", "1200", "1190"]
    assert exact(html, "critical_lifts") == ["6", "3", "3"]
    assert html.index(">north<") < html.index(">south<")
    assert "1 planned, 1 in part, 0 failed" in html
    assert '<tr class="critical"><th scope="row">south</th>' in html
    assert "<h1>2 plans</h1>" in html


def test_a_failed_run_says_why_as_text_and_its_figures_are_unknown():
    html = page(_PLANNED, _FAILED)
    assert '<tr class="bad"><th scope="row">&lt;gone&gt;</th><td><b>failed</b>: file: no such &lt;file&gt;' in html
    assert "gone.site.toml, truck.json, seed 7" in html
    assert exact(html, "lifts") == ["1200", "1200"]
    assert "✕ 1 run failed" in html


def test_the_verdict_is_clean_only_without_failures_and_remarks():
    assert "✓ every planned lift is proven" in page(_PLANNED)
    assert 'class="chip clean"' in page(_PLANNED)
    remarked = page(_PLANNED | {"remarks": 4, "serious_remarks": 1})
    assert "✓" not in remarked
    assert '<p class="chip serious">4 remarks, 1 serious</p>' in remarked
    unproven = page(_PLANNED | {"verified": False})
    assert "✕ 1 NOT PROVEN" in unproven
    assert 'class="chip clean"' not in unproven.split("<h2>")[0].split("chip refused")[0]


def test_files_are_linked_by_relative_addresses_and_nothing_else_is_requested():
    html = page(_PLANNED, files={"north": {"log": "north.mcap", "report": "north #1.report.html"}})
    assert re.findall(r'<a href="([^"]*)">(\w+)</a>', html) == [
        ("north.mcap", "log"),
        ("north%20%231.report.html", "report"),
    ]
    assert "default-src 'none'" in html
    assert html.count("<script") == html.count('<script type="application/json"') == 1
    assert page(_PLANNED) == page(_PLANNED)
