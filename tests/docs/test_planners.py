"""The planner with OMPL for researchers; the other examples of the page run with the docs' code blocks."""

from __future__ import annotations

import runpy
from pathlib import Path

import pytest

import bimvox

TOP = Path(__file__).parents[2]


def test_a_planner_with_ompl_plans_and_is_proven():
    pytest.importorskip("ompl", reason="a library of the reader's")
    planner = runpy.run_path(str(TOP / "docs/start/ompl_planner.py"), run_name="ompl_planner")["rrt_connect"]
    site = bimvox.guess_site(bimvox.read(TOP / "sample_models/frame.ifc"))
    plan = bimvox.plan(site, paths=planner, policy="none")
    assert plan.verdict is not None
    assert plan.verdict.verified
    name = "ompl_planner:rrt_connect"
    assert sum(lift.row.method == name for lift in plan.lifts) >= 6
    # A planner that draws may fail a lift, but no path that it finds is refused.
    notes = {lift.lift.planner_note for lift in plan.lifts if lift.row.method != name}
    assert notes <= {f"{name}: it found no path"}
