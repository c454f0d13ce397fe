"""The section of the page: what lies outside its planes is neither drawn nor clicked, and casts no shadow."""

from __future__ import annotations

import numpy as np
import pytest
from log_building import tiny_log
from seen_pages import Seen

pytestmark = pytest.mark.browser

HITS = """() => {
  const { scene } = page, frame = page._frame(), hits = new Set();
  for (let x = 0; x < frame.width; x += 7)
    for (let y = 0; y < frame.height; y += 7) {
      const thing = scene.pick(frame, page.layers, x, y);
      if (thing?.kind === "part") hits.add(thing.index);
    }
  return [...hits].sort();
}"""


@pytest.fixture
def built(seen: Seen) -> Seen:
    seen.seek(tiny_log().motions[-1].end_ns / 1e9)
    return seen


def test_keys_lower_the_cut_from_the_top_of_what_is_built_and_end_it(built):
    site = tiny_log().plan.site
    tops = [site.frame.corner_of(np.array(c.target_vox) + c.shape.size_vox)[2] for c in site.components]
    whole, hits = built.picture(), built.page.evaluate(HITS)
    assert hits == [0, 2]
    built.page.keyboard.press(",")
    assert built.page.evaluate("() => page.section.high[2]") == pytest.approx(max(tops) - 0.5, abs=0.051)
    assert built.text("#section summary") == "Section ✂"
    for _ in range(20):
        built.page.keyboard.press(",")
    built.drawn()
    assert built.page.evaluate(HITS) == []
    assert built.shows_other(whole, by=40, pixels=300)
    built.page.keyboard.press("x")
    assert built.shows_same(whole)
    assert built.page.evaluate("() => page.section.state") is None


def test_a_slider_cuts_along_an_axis_by_pointer_and_keys(built):
    built.page.click("#section summary")
    slider = '[data-cut="x low"]'
    box = built.page.locator(slider).bounding_box()
    built.page.mouse.click(box["x"] + box["width"] - 3, box["y"] + box["height"] / 2)
    built.drawn()
    assert built.page.evaluate(HITS) == []
    low = built.page.evaluate("() => page.section.low[0]")
    built.page.focus(slider)
    for _ in range(3):
        built.page.keyboard.press("ArrowLeft")
    assert built.page.evaluate("() => page.section.low[0]") == pytest.approx(low - 0.3, abs=0.01)
    assert built.page.evaluate("() => page.time") == tiny_log().motions[-1].end_ns / 1e9
    assert built.page.get_attribute(slider, "aria-label") == "Along x: from"
    assert built.page.get_attribute(slider, "aria-valuetext").endswith(" m")
    built.page.click("#section-clear")
    built.drawn()
    assert built.page.evaluate(HITS) == [0, 2]


def test_crane_and_load_in_transit_stay_whole(built):
    whole = built.picture()
    built.page.evaluate("() => { page.section.set(2, 'high', 0.1); page.setLayer('crane', false); }")
    without = built.picture()
    built.page.evaluate("() => page.setLayer('crane', true)")
    assert built.shows_other(without, by=40, pixels=200)
    assert whole.shape == without.shape
