"""The timeline of the page: bars of lifts at their times, linked to view and list, by pointer and keyboard."""

from __future__ import annotations

import dataclasses

import pytest
from log_building import tiny_log
from opened_pages import passed_proof, revision_of
from seen_pages import Seen, show
from two_cranes import two_crane_plan

from bimvox.log.moving import tracks_of
from bimvox.log.plan_log import PlanLog, log_dates
from bimvox.records.unloading import unloading_lifts
from bimvox.rendering.page.source import PageSource, Revision

pytestmark = pytest.mark.browser

BARS = """() => [...document.querySelectorAll("#gantt .row:not(.axis)")].map((row) => [
  row.getAttribute("aria-label"),
  [...row.querySelectorAll("button")].map((bar) => [
    Number(bar.dataset.part), parseFloat(bar.style.left) / 100, parseFloat(bar.style.width) / 100,
  ]),
])"""


SPAN = "(s) => s < 60 ? `${s.toFixed(1)} s` : `${Math.floor(Math.round(s) / 60)} min ${Math.round(s) % 60} s`"


def two_cranes() -> Revision:
    plan, motions = two_crane_plan()
    log = PlanLog(plan=plan, motions=motions, attachments={}, metadata={})
    return Revision(0, "two.mcap", "0" * 64, plan, (), motions, tracks_of(log), passed_proof(), ())


def focused(seen: Seen) -> int:
    return seen.page.evaluate("() => Number(document.activeElement.dataset.part)")


def test_bars_lie_at_the_times_of_the_log(seen):
    motions = tiny_log().motions
    seen.page.keyboard.press("t")
    rows = dict(seen.page.evaluate(BARS))
    whole = motions[-1].end_ns - motions[0].start_ns
    found = {part: (left, wide) for bars in rows.values() for part, left, wide in bars}
    assert set(found) == {motion.component for motion in motions}
    for motion in motions:
        left, wide = found[motion.component]
        assert left == pytest.approx((motion.start_ns - motions[0].start_ns) / whole, abs=1e-3)
        assert wide == pytest.approx((motion.end_ns - motion.start_ns) / whole, abs=1e-3)
    assert seen.page.get_attribute("#gantt-button", "aria-expanded") == "true"
    seen.page.keyboard.press("t")
    assert not seen.page.is_visible("#gantt")


def test_a_bar_chooses_its_part_and_moment_and_a_part_marks_its_bar(seen):
    motions = tiny_log().motions
    seen.page.click("#gantt-button")
    seen.page.click(f'#gantt button[data-part="{motions[1].component}"]')
    assert seen.page.evaluate("() => page.chosen") == motions[1].component
    assert seen.page.evaluate("() => page.time") == pytest.approx(motions[1].start_ns / 1e9)
    assert seen.page.get_attribute("#list tr.chosen", "data-part") == str(motions[1].component)
    seen.page.click(f'#list tr[data-part="{motions[0].component}"] button')
    marked = seen.page.locator("#gantt button[aria-current]")
    assert marked.count() == 1
    assert marked.get_attribute("data-part") == str(motions[0].component)
    assert seen.page.locator('#gantt button[data-when="now"]').get_attribute("data-part") == str(motions[1].component)
    track = seen.page.locator("#gantt .axis .track").bounding_box()
    seen.page.mouse.click(track["x"] + track["width"] / 2, track["y"] + 8)
    middle = (motions[0].start_ns + motions[-1].end_ns) / 2e9
    assert seen.page.evaluate("() => page.time") == pytest.approx(middle, rel=0.01)


def test_cranes_have_their_rows_and_arrows_lead_from_bar_to_bar(browser, tmp_path):
    revision = two_cranes()
    seen = show(browser, tmp_path, PageSource((revision,)), reduced_motion="reduce")
    seen.page.keyboard.press("t")
    rows = dict(seen.page.evaluate(BARS))
    assert {name: len(bars) for name, bars in rows.items()} == {"crane west, 4 lifts": 4, "crane east, 3 lifts": 3}
    crane_of = {motion.component: motion.crane for motion in revision.motions}
    assert {crane_of[part] for part, *_ in rows["crane east, 3 lifts"]} == {1}
    west, east = (bars for bars in rows.values())
    assert seen.page.locator('#gantt .track button[tabindex="0"]').count() == 1
    seen.page.focus(f'#gantt button[data-part="{west[0][0]}"]')
    seen.page.keyboard.press("ArrowRight")
    assert focused(seen) == west[1][0]
    seen.page.keyboard.press("End")
    assert focused(seen) == west[-1][0]
    seen.page.keyboard.press("ArrowDown")
    nearest = min(east, key=lambda bar: abs(bar[1] - west[-1][1]))
    assert focused(seen) == nearest[0]
    assert seen.page.evaluate("() => page.time") == 0  # arrows do not move the plan here
    seen.page.keyboard.press("Enter")
    assert seen.page.evaluate("() => page.chosen") == nearest[0]
    name = seen.page.evaluate("() => document.activeElement.getAttribute('aria-label')")
    number = next(lift.order for lift in revision.plan.lifts if lift.component == nearest[0]) + 1
    assert name.startswith(f"Lift {number}: east")
    seen.page.select_option("#gantt-by", "class")
    assert next(name for name, _ in seen.page.evaluate(BARS)).startswith("class ")
    seen.page.click("#gantt-in")
    track = seen.page.locator("#gantt .axis .track").bounding_box()
    assert track["width"] > 1280
    assert seen.complaints == []
    seen.page.context.close()


def test_with_a_calendar_the_axis_has_its_days(browser, tmp_path):
    site = b'[calendar]\nstart = 2026-03-13\nshifts = ["07:00-07:31"]\n'
    log = dataclasses.replace(tiny_log(crane=True), attachments={"site.toml": site})
    dates = log_dates(log)
    assert dates is not None
    first = dates.moment(dates.blocks[0][1])
    revision = dataclasses.replace(revision_of(log, passed_proof()), dates=dates)
    seen = show(browser, tmp_path, PageSource((revision,)), reduced_motion="reduce")
    seen.page.keyboard.press("t")
    days = seen.page.eval_on_selector_all("#gantt .axis .day", "(all) => all.map((one) => one.innerText)")
    assert days
    assert days[0] == f"{first:%a} {first.day} {first:%b %H:%M}"
    assert f"{first.day} {first:%B %Y}" in seen.page.get_attribute("#gantt .track button", "title")
    seen.page.context.close()


def test_bars_have_the_colours_of_the_parts_and_fade_with_the_filter(seen):
    seen.page.keyboard.press("t")
    seen.page.select_option("#colour", "utilisation")
    paint = "(part) => getComputedStyle(document.querySelector(`#gantt button[data-part='${part}']`)).backgroundColor"
    rgb = seen.page.evaluate("() => page.paint.rgb[2]")
    assert seen.page.evaluate(paint, 2) == f"rgb({rgb[0]}, {rgb[1]}, {rgb[2]})"
    seen.page.evaluate("() => page.look('hide', 'part', page.parts[2].id)")
    assert seen.page.evaluate(paint, 2) == "rgba(0, 0, 0, 0)"


def test_deliveries_that_the_crane_unloads_have_a_row(browser, tmp_path):
    log = tiny_log()
    site = dataclasses.replace(log.plan.site, access=~log.plan.site.yard)
    log = dataclasses.replace(log, plan=dataclasses.replace(log.plan, site=site))
    seen = show(browser, tmp_path, PageSource((revision_of(log, passed_proof()),)), reduced_motion="reduce")
    seen.page.keyboard.press("t")
    name, bars = seen.page.evaluate(BARS)[0]
    loads = [[lift for lift in log.plan.lifts if lift.place and lift.place.delivery == n] for n in range(len(bars))]
    assert "deliver" in name
    bar = seen.page.locator(".truck-bar").first
    found = unloading_lifts(site, loads[0])
    assert f"{len(found)} part" in bar.get_attribute("aria-label")
    bar.click()
    part = next(one for one in found if one.order == log.plan.lifts[bars[0][0]].order)
    told, terms = seen.text("#panel-part"), seen.terms("#panel-part")
    assert "unloading from the truck" in told.lower()
    assert terms["Crane time"] == seen.page.evaluate(SPAN, part.duration_s)
    assert seen.complaints == []
    seen.page.context.close()
