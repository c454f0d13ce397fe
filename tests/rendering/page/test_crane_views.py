"""What the page shows of the crane: rings of radii with the chart's capacities, and the views from its own seats."""

from __future__ import annotations

import json
import math

import pytest
from log_building import tiny_log
from page_program import needs_node, program_says

from bimvox.crane.kinematics import hook_of

RINGS = """
import { ringsOf } from "WEB/cranes.mjs";
"""


@needs_node
def test_rings_are_points_of_the_chart_within_reach_and_the_ends(tmp_path):
    chart = {"radius_m": [float(n) for n in range(2, 50)], "capacity_kg": [9e4 / n for n in range(2, 50)]}
    record = {"chart": chart, "min_radius_m": 2.5, "jib_length_m": 40.5}
    rings = program_says(tmp_path, RINGS, f"ringsOf({json.dumps(record)})")
    assert [rings[0], rings[-1]] == [{"radius": 2.5, "capacity": None}, {"radius": 40.5, "capacity": None}]
    assert 4 <= len(rings) <= 9
    radii = [ring["radius"] for ring in rings]
    assert radii == sorted(radii)
    assert all(ring["capacity"] == 9e4 / ring["radius"] for ring in rings[1:-1])


@pytest.mark.browser
def test_rings_are_drawn_and_named_with_the_capacity_of_the_log(seen):
    crane = tiny_log().plan.site.cranes[0]
    before = seen.picture()
    seen.page.keyboard.press("b")
    assert seen.shows_other(before, by=40, pixels=200)
    words = seen.page.eval_on_selector_all("#labels span", "(all) => all.map((one) => one.textContent)")
    capacity_kg = dict(zip(crane.chart.radius_m, crane.chart.capacity_kg, strict=True))
    named = [word.split(" m: ") for word in words if ": " in word]
    assert named
    for radius, capacity in named:
        kg = capacity_kg[float(radius)]
        assert capacity == (f"{kg:.0f} kg" if kg < 1000 else f"{kg / 1000:.2f} t")
    seen.page.keyboard.press("b")
    seen.page.evaluate("() => page._draw()")  # not before the next frame
    assert seen.page.locator("#labels span").count() == 0


@pytest.mark.browser
def test_the_crane_looks_from_the_trolley_then_from_the_cab_and_back(seen):
    log = tiny_log()
    crane, motion = log.plan.site.cranes[0], log.motions[0].loaded
    n = len(motion.time_ns) // 2
    seen.seek(motion.time_ns[n] / 1e9)
    eye = "() => { page._draw(); return page.camera.eye; }"
    outside = seen.page.evaluate(eye)
    seen.page.keyboard.press("5")
    slew, radius = float(motion.slew_rad[n]), float(motion.radius_m[n])
    at = seen.page.evaluate(eye)
    assert math.dist(at[:2], hook_of(crane, slew, radius, 0.0)[:2]) < 1.2
    assert crane.jib_height_m - 2 < at[2] < crane.jib_height_m
    seen.page.keyboard.press("5")
    at = seen.page.evaluate(eye)
    assert math.dist(at[:2], crane.base_m[:2]) < crane.mast_size_m + 4
    hook = seen.page.evaluate("() => page.scene.hook")
    assert seen.page.evaluate("() => page.camera.target") == pytest.approx(hook, abs=1e-6)
    seen.page.evaluate("() => page.seek(page.time + 5)")
    assert seen.page.evaluate(eye) != at  # it goes with the crane
    seen.page.keyboard.press("5")
    assert seen.page.evaluate(eye) == pytest.approx(outside)
    assert seen.page.get_attribute('[data-view="crane"]', "aria-pressed") == "false"
