"""The page on a phone: one pane at a time, everything large enough for a thumb, and the same things can be done."""

from __future__ import annotations

from typing import Any

import pytest
from opened_pages import passed_proof, some_remarks, tiny_source
from seen_pages import Seen, show

pytestmark = pytest.mark.browser

PANES = {"view": "#view", "list": "#lifts", "details": "#side", "timeline": "#gantt"}
SMALL = """() => [...document.querySelectorAll("button, select, input, summary, #layers label")].filter((e) => {
  if (e.closest(".track, .skip") || e.matches("label input, .unseen, .unseen *")) return false;
  const box = e.getBoundingClientRect();
  return box.width > 0 && (box.width < 43.5 || box.height < 43.5);
}).map((e) => e.id || e.outerHTML.slice(0, 90))"""
OUT = """() => [...document.querySelectorAll("button, select, input, summary, canvas, .card")].filter((e) => {
  const box = e.getBoundingClientRect();
  const out = box.left < -1 || box.right > innerWidth + 1 || box.bottom > innerHeight + 1;
  return box.width > 0 && !e.closest(".scroll, details:not([open])") && out;
}).map((e) => e.id || e.outerHTML.slice(0, 70))"""


def phone(browser: Any, tmp_path: Any, **more: Any) -> Seen:
    source = tiny_source(proof=passed_proof(), remarks=some_remarks(floating=3))
    seen = show(browser, tmp_path, source, reduced_motion="reduce", **more)
    seen.page.set_viewport_size({"width": 390, "height": 844})
    seen.drawn()
    return seen


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_one_pane_at_a_time_with_targets_of_44_pixels(browser, tmp_path, scheme):
    seen = phone(browser, tmp_path, color_scheme=scheme)
    for name in PANES:
        seen.page.click(f"#pane-{name}")
        assert [other for other, at in PANES.items() if seen.page.is_visible(at)] == [name]
        assert seen.page.get_attribute(f"#pane-{name}", "aria-selected") == "true"
        for summary in ("#layers", "#legend") if name == "view" else ():
            seen.page.click(f"{summary} summary")
            seen.page.click("#pane-view")
            assert seen.page.evaluate(SMALL) == []
            seen.page.click(f"{summary} summary")
        assert seen.page.evaluate(SMALL) == []
        assert seen.page.evaluate(OUT) == []
        assert seen.page.evaluate("() => document.documentElement.scrollWidth") <= 390
    assert seen.complaints == []
    seen.page.context.close()


def test_a_lift_of_the_list_opens_its_details_and_the_view_returns_as_it_was(browser, tmp_path):
    seen = phone(browser, tmp_path)
    before = seen.picture()
    seen.page.click("#pane-list")
    seen.page.click('#list tr[data-part="2"] button')
    assert seen.page.is_visible("#side")
    assert seen.text("#panel-part h2") == "Beam"
    seen.page.keyboard.press("f")  # a key of a hidden view
    seen.page.keyboard.press("Escape")
    seen.page.click("#pane-view")
    seen.wait("window.page.camera.aspect < 1")
    assert seen.picture().shape == before.shape
    seen.page.click("#remarks-button")
    assert seen.page.is_visible("#panel-remarks")
    seen.page.keyboard.press("/")
    assert seen.page.evaluate("() => document.activeElement.id") == "search"
    seen.page.context.close()


def test_arrows_move_between_the_panes_and_a_wide_window_has_all(browser, tmp_path):
    seen = phone(browser, tmp_path)
    seen.page.focus("#pane-view")
    seen.page.keyboard.press("ArrowLeft")
    assert seen.page.is_visible("#gantt")
    seen.page.keyboard.press("ArrowRight")
    seen.page.keyboard.press("ArrowRight")
    assert seen.page.evaluate("() => document.activeElement.id") == "pane-list"
    assert seen.page.evaluate("() => page.time") == 0
    seen.page.set_viewport_size({"width": 1280, "height": 800})
    assert all(seen.page.is_visible(at) for name, at in PANES.items() if name != "timeline")
    assert not seen.page.is_visible("#pane-view")
    seen.page.context.close()


def test_the_list_scrolls_to_the_lift_under_way(browser, tmp_path):
    seen = phone(browser, tmp_path)
    seen.page.set_viewport_size({"width": 390, "height": 560})
    seen.page.click("#pane-list")
    seen.page.keyboard.press("End")
    row, pane = (seen.page.locator(at).bounding_box() for at in ("#list tr.now", "#list-scroll"))
    assert pane["y"] <= row["y"]
    assert row["y"] + row["height"] <= pane["y"] + pane["height"] + 1
    seen.page.context.close()
