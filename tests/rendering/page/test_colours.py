"""By what the page colours the parts: each group has a colour, a name and a count; what is critical has stripes too."""

from __future__ import annotations

import itertools
import json

import numpy as np
import pytest
from opened_pages import passed_proof, some_remarks, tiny_source
from page_program import needs_node, program_says
from seen_pages import Seen, contrast, show

from bimvox.rendering.colours import CLASSES, NO_GROUP, REMARKS, SHARES, Rgb

PALETTE = {"groups": CLASSES, "shares": SHARES, "remarks": REMARKS, "none": NO_GROUP}
GROUPS = (
    """
import { Groups } from "WEB/groups.mjs";
import { colouring, paintOf } from "WEB/colours.mjs";
const shares = [0.2, 0.25, 0.6, 0.75, 0.89, 0.9, 1, null];
const parts = shares.map((_, n) => ({
  id: `p${n}`, ifc_class: n % 3 ? "IfcWall" : "IfcBeam", storey: ["Up", "Low"][n % 2], target_m: [0, 0, n % 2 ? 0 : 3],
}));
const lifts = shares.map((utilisation, part) => (
  { part, motion: 0, delivery: part > 2 ? part : null, governs: { utilisation } }
));
const remarks = [["p1", "note"], ["p1", "serious"], ["p2", "minor"], ["x", "serious"]]
  .map(([component, severity]) => ({ component, severity }));
const groups = new Groups([...parts, { id: "not lifted", ifc_class: "", storey: null, target_m: [0, 0, 0] }], ["west"]);
const planOf = (hot) => ({ hot, ofPart: [...lifts, null], motionOf: () => ({}), revision: { remarks } });
"""
    + f"const colours = {json.dumps(PALETTE)};"
)


@needs_node
def test_ranges_of_utilisation_end_at_the_critical_share_of_the_site(tmp_path):
    body = """[0.75, 0.9].map((hot) => {
      groups.show(planOf(hot));
      return colouring(groups, "utilisation", colours).map(({ label, parts, striped }) => [label, parts, striped]);
    })"""
    usual, high = program_says(tmp_path, GROUPS, body)
    assert usual == [
        ["below 25 %", [0], False],
        ["25 % to 50 %", [1], False],
        ["50 % to 75 %", [2], False],
        ["75 % or more, critical", [3, 4, 5, 6], True],
        ["beyond the chart", [7], True],
        ["not by a crane", [8], False],
    ]
    assert high[3:5] == [["75 % to 90 %", [3, 4], False], ["90 % or more, critical", [5, 6], True]]


@needs_node
def test_groups_are_listed_in_the_order_of_the_building(tmp_path):
    body = """(() => {
      groups.show(planOf(0.75));
      const of = (by) => colouring(groups, by, colours).map(({ label, rgb, parts }) => [label, rgb, parts.length]);
      return Object.fromEntries(["storey", "class", "remark", "delivery", "crane"].map((by) => [by, of(by)]));
    })()"""
    told = program_says(tmp_path, GROUPS, body)
    assert [entry[0] for entry in told["storey"]] == ["Low", "Up", "no storey"]
    assert [entry[0] for entry in told["class"]] == ["Wall", "Beam", "none"]
    assert told["class"][0][1] == list(CLASSES[0])
    assert told["remark"] == [
        ["serious", list(REMARKS[next(iter(REMARKS))]), 1],
        ["minor", [238, 221, 136], 1],
        ["no remark", list(NO_GROUP), 7],
    ]
    assert [entry[0] for entry in told["delivery"]] == ["4", "5", "6", "7", "8", "without a delivery"]
    assert told["crane"] == [["west", list(CLASSES[0]), 8], ["not by a crane", list(NO_GROUP), 1]]


def luminance(rgb: Rgb) -> float:
    part = np.array(rgb) / 255
    return float(np.where(part <= 0.04045, part / 12.92, ((part + 0.055) / 1.055) ** 2.4) @ [0.2126, 0.7152, 0.0722])


def test_utilisation_darkens_with_every_range_and_stands_out_when_critical():
    light = [luminance(rgb) for rgb in SHARES]
    assert all(one > other for one, other in itertools.pairwise(light))
    assert (light[-2] + 0.05) / (light[-1] + 0.05) >= 2
    assert (light[0] + 0.05) / (light[-1] + 0.05) >= 4.5


def entries(seen: Seen) -> list[str]:
    return seen.page.eval_on_selector_all("#legend li button", "(all) => all.map((one) => one.innerText)")


@pytest.mark.browser
def test_every_colouring_has_a_legend_that_counts_all_parts(browser, tmp_path):
    seen = show(browser, tmp_path, tiny_source(proof=passed_proof(), remarks=some_remarks()), reduced_motion="reduce")
    seen.page.keyboard.press("End")
    before = seen.picture()
    for by in ("crane", "delivery", "utilisation", "class", "storey", "remark"):
        seen.page.keyboard.press("c")
        assert seen.page.input_value("#colour") == by
        assert sum(int(entry.rsplit("(", 1)[1][:-1]) for entry in entries(seen)) == 3, by
        assert seen.shows_other(before, by=40, pixels=100), by
        assert seen.text("#legend summary") == f"Legend: parts by {by}"
    assert entries(seen) == ["serious (1)", "minor (1)", "note (1)"]
    seen.page.keyboard.press("Shift+C")
    assert seen.page.input_value("#colour") == "storey"
    seen.page.select_option("#colour", "status")
    assert entries(seen) == []
    assert seen.shows_same(before)
    assert seen.complaints == []
    seen.page.context.close()


@pytest.mark.browser
def test_a_group_of_the_legend_is_isolated_and_named_in_the_details(seen):
    seen.page.select_option("#colour", "class")
    assert entries(seen) == ["Column (2)", "Beam (1)"]
    seen.page.focus("#legend li button")
    seen.page.keyboard.press("Enter")
    assert seen.text("#filter-words") == "2 of 3 parts shown: class Column isolated"
    seen.page.click('#list tr[data-part="2"] button')
    assert "Coloured by class: Beam." in seen.text("#panel-part")
    assert contrast(seen, "#colour") >= 4.5


@pytest.mark.browser
def test_parts_to_come_are_ghosts_at_their_places(seen):
    flags = """() => {
      const { scene, plan } = page;
      plan.lifts[2].delivery = 7;
      page._refresh();
      scene.show({ plan, time: page.time, layers: page.layers, chosen: null, obstruction: null });
      return page.parts.map((_, n) => scene.rows.data[scene.partRow(n) * 16 + 15]);
    }"""
    assert seen.page.evaluate(flags) == [1, 1, 0]
    seen.page.evaluate("() => page.setLayer('coming', true)")
    assert seen.page.evaluate(flags) == [1, 1, 1 + 8]
    place = seen.page.evaluate("() => page.scene.rows.placeOf(page.scene.partRow(2))[0]")
    assert place == pytest.approx(seen.page.evaluate("() => page.parts[2].target_m"), abs=1e-4)
