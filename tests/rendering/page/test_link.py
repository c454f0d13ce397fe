"""A link of the page leads to the same moment and view, also from disk; what it says wrong is left out."""

from __future__ import annotations

import json

import numpy as np
import pytest
from opened_pages import passed_proof, tiny_source
from page_program import needs_node, program_says
from seen_pages import Seen, show

LINK = """
import { linkOf, readLink } from "WEB/link.mjs";
"""
SHOWN = """() => {
  const { camera, visibility, time, chosen, colourBy } = window.page;
  const view = [camera.azimuth, camera.elevation, camera.distance, ...camera.target].map((value) => +value.toFixed(3));
  const { looks, query } = visibility;
  return { view, time, chosen, colourBy, looks: Array.from(looks), query, cut: window.page.section.state };
}"""


@needs_node
def test_what_a_link_says_is_what_was_shown(tmp_path):
    steps = [{"act": "hide", "by": "class", "value": "Ifc:Wall & co"}, {"act": "ghost", "by": "storey", "value": None}]
    app = {
        "time": 12.3456,
        "camera": {"azimuth": -30.5, "elevation": 20, "distance": 55.25, "target": [1, -2.5, 3]},
        "chosen": 0,
        "parts": [{"id": "#a=ä&"}],
        "colourBy": "storey",
        "section": {"state": [0, 0, 0, 5, 5, 2.5]},
        "visibility": {"query": "two words", "steps": steps},
        "plan": {"revision": {"sha256": "ab" * 32}},
    }
    told = program_says(tmp_path, LINK, f"readLink('#' + linkOf({json.dumps(app)}))")
    assert told == {
        "log": "ab" * 6,
        "time": 12.346,
        "camera": [-30.5, 20, 55.25, 1, -2.5, 3],
        "section": [0, 0, 0, 5, 5, 2.5],
        "part": "#a=ä&",
        "filter": {"query": "two words", "steps": steps},
        "colour": "storey",
    }


@needs_node
@pytest.mark.parametrize(
    "text", ["#", "#t=x&camera=1,2", "#t=&camera=,,,,,", "#t=Infinity&camera=1,2,3,4,5,NaN", "#%%%"]
)
def test_what_is_wrong_in_a_link_is_left_out(tmp_path, text):
    told = program_says(tmp_path, LINK, f"readLink({json.dumps(text)})")
    assert told["time"] is None
    assert told["camera"] is None
    assert told["filter"] == {"query": "", "steps": []}


def opened(seen: Seen, address: str) -> Seen:
    other = Seen(seen.page.context.new_page())
    other.page.goto(address)
    other.wait("document.documentElement.dataset.drawn > 0 && window.page?.live")
    return other


@pytest.mark.browser
def test_a_link_from_disk_opens_the_same_view(seen):
    seen.page.evaluate(
        "() => { page.seek(42); page.choose(2); page.look('ghost', 'class', 'IfcColumn'); page.section.nudge(-1); }"
    )
    seen.page.keyboard.press("c")
    seen.page.keyboard.press("w")
    seen.page.keyboard.press("l")
    seen.wait("!document.getElementById('note').hidden")
    assert "link to this moment" in seen.text("#note")
    assert seen.page.url.startswith("file://")
    wanted = seen.page.evaluate(SHOWN)
    other = opened(seen, seen.page.url)
    assert other.page.evaluate(SHOWN) == wanted
    assert other.text("#panel-part h2") == "Beam"
    seen.page.evaluate("() => { document.getElementById('note').hidden = true; }")
    assert (np.abs(other.picture() - seen.picture()).max(axis=2) > 30).mean() < 0.002
    assert other.complaints == []
    other.page.close()


@pytest.mark.browser
def test_a_link_in_the_same_window_is_followed_and_one_of_another_plan_says_so(seen):
    first = seen.page.evaluate(SHOWN)
    seen.page.evaluate(
        "() => { location.hash = '#log=000000000000&t=1e9&part=none&colour=crane&show=hide:class:IfcBeam'; }"
    )
    seen.wait("page.visibility.looks[2] === 2")
    told = seen.page.evaluate(SHOWN)
    assert told["view"] == first["view"]
    assert told["time"] == seen.page.evaluate("() => page.plan.ends")
    assert told["chosen"] is None
    assert told["colourBy"] == "crane"
    assert "another plan" in seen.text("#note")
    seen.page.evaluate("(log) => { location.hash = `#log=${log}&part=none`; }", "cd" * 6)
    seen.wait("page.visibility.looks[2] === 0")
    assert "not in this plan" in seen.text("#note")


@pytest.mark.browser
def test_a_hostile_link_is_only_text(browser, tmp_path):
    seen = show(browser, tmp_path, tiny_source(proof=passed_proof()), reduced_motion="reduce")
    evil = "%3Cimg%20src%3Dx%20onerror%3Dwindow.hacked%3D1%3E"
    address = f"{seen.page.url}#search={evil}&show=isolate:part:{evil}&part={evil}"
    other = opened(seen, address)
    assert "<img" in other.text("#filter-words")
    assert other.page.evaluate("() => window.hacked") is None
    assert other.page.locator("img").count() == 1
    assert other.complaints == []
    seen.page.context.close()
