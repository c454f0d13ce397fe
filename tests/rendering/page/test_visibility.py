"""What the page shows of the parts: the search, isolating, hiding and ghosts filter the view, and can be undone."""

from __future__ import annotations

import numpy as np
import pytest
from log_building import tiny_log
from page_program import needs_node, program_says
from seen_pages import Seen, contrast

SEEN, GHOST, HIDDEN = 0, 1, 2
PLAN = """
import { Groups } from "WEB/groups.mjs";
import { Visibility } from "WEB/visibility.mjs";
const parts = [["a", "IfcColumn", "1", "A"], ["b", "IfcColumn", "2", "B"], ["c", "IfcBeam", "2", "C"]]
  .map(([id, ifc_class, storey, name]) => ({ id, ifc_class, storey, name }));
const motions = [{ crane: 0 }, { crane: 1 }, { crane: 1 }];
const lifts = parts.map((_, part) => ({ part, motion: part }));
const plan = {
  ofPart: lifts, motionOf: (lift) => motions[lift.motion],
  hot: 0.75, revision: { remarks: [] },
  matching: (query) => lifts.filter((lift) => parts[lift.part].name.includes(query)),
};
const shown = new Visibility(new Groups(parts, ["west", "east"]));
const looks = () => Array.from(shown.update(plan));
"""


@needs_node
def test_steps_follow_each_other_and_are_undone_one_by_one(tmp_path):
    body = """(() => {
      const all = [];
      shown.apply("hide", "class", "IfcColumn"); all.push(looks());
      shown.apply("ghost", "part", "c"); all.push(looks());
      shown.apply("ghost", "part", "c"); all.push(looks());
      shown.apply("isolate", "crane", "east"); all.push(looks());
      shown.search("B"); shown.search("Bx"); shown.search("B"); all.push(looks());
      const words = shown.words;
      while (shown.undo()) all.push(looks());
      return { all, words, filters: shown.filters };
    })()"""
    told = program_says(tmp_path, PLAN, body)
    hidden, ghost = [HIDDEN, HIDDEN, SEEN], [HIDDEN, HIDDEN, GHOST]
    isolated, searched = [HIDDEN, SEEN, SEEN], [HIDDEN, SEEN, HIDDEN]
    none = [SEEN] * 3
    assert told["all"] == [hidden, ghost, ghost, isolated, searched, isolated, ghost, hidden, none]
    assert told["words"] == "1 of 3 parts shown: crane east isolated, search “B”"
    assert told["filters"] is False


@needs_node
def test_a_kept_filter_is_taken_over_without_what_is_unknown(tmp_path):
    body = """(() => {
      const bad = [{ act: "toString", by: "part", value: "b" }, null, { act: "hide", by: "x", value: "y" }];
      shown.take({ query: 3, steps: [{ act: "hide", by: "part", value: "a" }, ...bad] });
      return [shown.query, shown.steps.length];
    })()"""
    assert program_says(tmp_path, PLAN, body) == ["3", 1]


def looks(seen: Seen) -> list[int]:
    return seen.page.evaluate("() => Array.from(window.page.visibility.looks)")


def orange(picture: np.ndarray) -> int:
    """Count the pixels of parts in the yard."""
    return int(((picture[..., 0] > 150) & (picture[..., 2] < 60) & (picture[..., 1] < picture[..., 0] - 50)).sum())


def pink(picture: np.ndarray) -> int:
    """Count the pixels of assembled parts."""
    red, green, blue = picture[..., 0], picture[..., 1], picture[..., 2]
    return int(((red > 140) & (red > green + 50) & (blue > green + 20)).sum())


@pytest.mark.browser
def test_the_search_filters_the_view(seen):
    whole = orange(seen.picture())
    seen.page.keyboard.press("/")
    seen.page.keyboard.type("no such part")
    assert looks(seen) == [HIDDEN] * 3
    assert seen.shows(lambda shown: orange(shown) < whole / 4)
    assert seen.text("#filter-words") == "0 of 3 parts shown: search “no such part”"
    seen.page.keyboard.press("Escape")
    assert looks(seen) == [SEEN] * 3
    assert not seen.page.is_visible("#filter")
    assert seen.shows(lambda shown: orange(shown) == whole)
    seen.page.keyboard.press("u")
    assert seen.page.input_value("#search") == "no such part"
    assert looks(seen) == [HIDDEN] * 3


@pytest.mark.browser
def test_a_part_is_isolated_hidden_or_a_ghost_by_keys_and_undone_by_one(seen):
    seen.seek(tiny_log().motions[-1].end_ns / 1e9)
    seen.page.click('#list tr[data-part="2"] button')
    whole = pink(seen.picture())
    seen.page.keyboard.press("h")
    assert looks(seen) == [SEEN, SEEN, HIDDEN]
    assert seen.shows(lambda shown: pink(shown) < whole - 50)
    assert "hidden in the view" in seen.text('#list tr[data-part="2"]')
    seen.page.keyboard.press("g")
    assert looks(seen) == [SEEN, SEEN, GHOST]
    assert seen.shows(lambda shown: pink(shown) < whole - 50)
    seen.page.keyboard.press("i")
    assert looks(seen) == [HIDDEN, HIDDEN, SEEN]
    assert seen.text("#filter-words") == "1 of 3 parts shown: Beam isolated"
    assert contrast(seen, "#filter") >= 4.5
    for wanted in ([SEEN, SEEN, GHOST], [SEEN, SEEN, HIDDEN], [SEEN, SEEN, SEEN]):
        seen.page.keyboard.press("u")
        assert looks(seen) == wanted
    assert seen.shows(lambda shown: pink(shown) == whole)


@pytest.mark.browser
def test_a_class_is_isolated_by_a_button_that_keeps_the_focus(seen):
    seen.page.click('#list tr[data-part="0"] button')
    seen.page.focus('[data-look="isolate class"]')
    seen.page.keyboard.press("Enter")
    assert looks(seen) == [SEEN, SEEN, HIDDEN]
    assert seen.page.evaluate("() => document.activeElement.dataset.look") == "isolate class"
    assert seen.page.locator("#list tbody tr").count() == 3  # only the search shortens the list
    assert seen.text("#live").startswith("2 of 3 parts shown")
    assert seen.page.locator('[data-look$="crane"]').count() == 0  # there is one
    seen.page.click("#filter-clear")
    assert looks(seen) == [SEEN] * 3


@pytest.mark.browser
def test_a_click_goes_through_what_is_hidden_or_a_ghost(seen):
    seen.seek(tiny_log().motions[-1].end_ns / 1e9)
    for act in ("hide", "ghost"):
        seen.page.evaluate("(act) => { page.showAll(); page.look(act, 'part', page.parts[2].id); }", act)
        seen.drawn()
        found = seen.page.evaluate(
            """() => {
              const { scene } = page, frame = page._frame(), hits = new Set();
              for (let x = 0; x < frame.width; x += 9)
                for (let y = 0; y < frame.height; y += 9) hits.add(scene.pick(frame, page.layers, x, y)?.index);
              return [...hits];
            }"""
        )
        assert 0 in found
        assert 2 not in found


@pytest.mark.browser
def test_fitting_shows_what_is_isolated(seen):
    seen.page.evaluate("() => page.look('isolate', 'part', page.parts[2].id)")
    before = seen.page.evaluate("() => window.page.camera.distance")
    seen.page.keyboard.press("f")
    assert seen.page.evaluate("() => window.page.camera.distance") < before / 2
