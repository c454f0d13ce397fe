"""The studio in a real browser: what is dragged, typed and chosen is what the site file says then."""

from __future__ import annotations

import json
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from logged_numbers import Logged
from number_words import fixed, percent, tonnes
from seen_pages import Seen
from shown_numbers import differences
from studios import Studio, served

pytestmark = pytest.mark.browser

SAMPLES = Path(__file__).parents[3] / "sample_models"
BASE = [4.5, 9.5]
CRANE = '[data-handle="cranes/0"]'


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    return tmp_path_factory.mktemp("site")


@pytest.fixture(scope="module")
def address(folder) -> Iterator[str]:
    shutil.copy(SAMPLES / "hall.ifc", folder)
    with served(folder) as found:
        yield found


def show(browser: Any, address: str, folder: Path, width: int = 1440, height: int = 900, **context: Any) -> Studio:
    shutil.copy(SAMPLES / "hall.site.toml", folder)
    made = {file for ending in ("*.site.toml", "*.mcap", "*.obstructions.json") for file in folder.glob(ending)}
    for file in made - {folder / "hall.site.toml"}:
        file.unlink()
    options = {"viewport": {"width": width, "height": height}, "reduced_motion": "reduce", **context}
    studio = Studio(browser.new_context(**options).new_page(), folder)
    studio.page.goto(f"{address}&open=hall.site.toml")
    studio.settled()
    return studio


@pytest.fixture
def studio(browser, address, folder) -> Iterator[Studio]:
    studio = show(browser, address, folder)
    yield studio
    assert studio.complaints == []
    studio.page.context.close()


def test_the_crane_is_dragged_and_the_site_file_says_where(studio):
    before = (studio.folder / "hall.site.toml").read_text()
    assert studio.base() == BASE
    studio.drag(CRANE, 2.1, 3.2)
    assert studio.base() == [6.5, 12.5]
    assert "unsaved changes" in studio.page.inner_text("#path")
    studio.save()
    assert studio.saved()["crane"][0]["base_m"][:2] == [6.5, 12.5]
    after = (studio.folder / "hall.site.toml").read_text()
    assert after.splitlines()[:2] == before.splitlines()[:2]  # its comments


SHOWN = """() => {
  const { answer, setup, drawing } = window.studio;
  const rows = (where) => [...document.querySelectorAll(`#parts-list ${where} li`)];
  const uses = rows("> :not(.cannot, .types)").map((row) => [row.dataset.part, row.querySelector(".use").textContent]);
  const centre = (one) => {
    const box = document.querySelector(one).getBoundingClientRect();
    return [box.x + box.width / 2, box.y + box.height / 2];
  };
  return {
    rows: Object.fromEntries(uses),
    cannot: rows("> .cannot").map((row) => row.dataset.part),
    colours: Object.fromEntries([...drawing.parts].map(([id, path]) => [id, path.classList[1]])),
    found: answer.parts,
    reach: centre(".rings .reach:not(.least)"),
    crane: centre('[data-handle="cranes/0"] .mark'),
    field: document.querySelector('[data-key="cranes/0-0"]').value,
    base: setup.cranes[0].base_m,
  };
}"""


def test_list_colours_and_rings_follow_the_hand(studio):
    for group in studio.page.locator("#parts-list > details:not(.types):visible summary").all()[1:]:
        group.click()
    closed = studio.page.locator("#parts-list > details:not(.types):not([open]) li").count()
    assert closed > 0
    scale = studio.page.evaluate("() => window.studio.drawing.view.scale")
    x, y = studio.middle(CRANE)
    studio.page.mouse.move(x, y)
    studio.page.mouse.down()
    for dy_m in (6.0, 14.0, 24.0):
        studio.page.mouse.move(x, y - dy_m / scale, steps=3)
        studio.settled()
        studio.wait("window.studio.form.waiting === null")
        seen = studio.page.evaluate(SHOWN)
        assert seen["base"][1] > BASE[1]
        refused = {name for name, part in seen["found"].items() if part["reason"]}
        assert set(seen["cannot"]) == refused
        assert {name for name, colour in seen["colours"].items() if colour == "cannot"} == refused
        assert seen["reach"] == pytest.approx(seen["crane"], abs=1.0)
        assert float(seen["field"]) == seen["base"][0]
    assert refused
    studio.page.mouse.up()
    studio.settled()
    for group in studio.page.locator("#parts-list > details:not(.types):not([open]):visible summary").all():
        group.click()
    seen = studio.page.evaluate(SHOWN)
    assert len(seen["rows"]) + len(refused) == 33
    for name, use in seen["rows"].items():
        assert use == percent(seen["found"][name]["utilisation"])


def test_a_move_that_snaps_to_the_same_place_is_not_tried_again(studio):
    x, y = studio.middle(CRANE)
    studio.page.mouse.move(x, y)
    studio.page.mouse.down()
    studio.page.mouse.move(x + 60, y, steps=3)
    studio.settled()
    before = studio.page.evaluate(
        "() => { window.before = window.studio.draft; return window.before.cranes[0].base_m; }"
    )
    studio.page.mouse.move(x + 60.5, y, steps=2)
    assert studio.page.evaluate("() => window.studio.draft === window.before")
    studio.page.mouse.move(x + 90, y, steps=2)
    assert studio.base() != before
    studio.page.mouse.up()


OVERLAPS = """() => {
  const boxes = (where) => [...document.querySelectorAll(where)].map((one) => one.getBoundingClientRect());
  const rings = boxes(".ring-label");
  const meet = (a, b) => a.right > b.left && a.left < b.right && a.bottom > b.top && a.top < b.bottom;
  return boxes(".dimension-label").filter((one) => rings.some((ring) => meet(one, ring))).length;
}"""


def test_dimensions_and_rings_do_not_cover_each_other(studio):
    x, y = studio.middle(CRANE)
    studio.page.mouse.move(x, y)
    studio.page.mouse.down()
    for n in range(1, 13):
        studio.page.mouse.move(x + 9 * n, y - 14 * n, steps=2)
        assert studio.page.locator(".dimension-label").count() > 0
        assert studio.page.evaluate(OVERLAPS) == 0, n
    studio.page.mouse.up()


def test_alt_places_freely_and_escape_lets_go(studio):
    studio.drag(CRANE, 0.23, 0.0, alt=True)
    assert 0.1 < studio.base()[0] - BASE[0] < 0.4
    assert studio.base()[0] % 0.5 != 0
    x, y = studio.middle(CRANE)
    there = studio.base()
    studio.page.mouse.move(x, y)
    studio.page.mouse.down()
    studio.page.mouse.move(x + 80, y, steps=3)
    assert studio.base() != there
    studio.page.keyboard.press("Escape")
    studio.page.mouse.up()
    assert studio.base() == there


def test_arrow_keys_move_a_handle_and_are_undone(studio):
    studio.page.focus(CRANE)
    for key in ("ArrowRight", "ArrowUp", "Shift+ArrowLeft"):
        studio.page.keyboard.press(key)
    assert studio.base() == pytest.approx([4.9, 10.0])
    label = studio.page.get_attribute(CRANE, "aria-label")
    assert "x 4.90 m, y 10.00 m" in label
    for _ in range(3):
        studio.page.keyboard.press("Control+z")
    assert studio.base() == BASE
    assert studio.page.is_disabled("#undo")
    studio.page.keyboard.press("Control+y")
    assert studio.base() == [5.0, 9.5]
    studio.page.keyboard.press("Control+Shift+z")
    assert studio.base() == [5.0, 10.0]


def test_the_tab_key_reaches_every_handle(studio):
    studio.page.focus("#sheet")
    seen = []
    for _ in range(8):
        studio.page.keyboard.press("Tab")
        seen.append(studio.page.evaluate("() => document.activeElement.dataset.handle"))
    assert seen == ["cranes/0", "cranes/1", "yard/0", "yard/0/0", "yard/0/1", "yard/0/2", "yard/0/3", "yard/1"]


def test_the_yard_is_moved_whole_and_by_a_corner(studio):
    before = studio.setup()["yard"]
    studio.drag('[data-handle="yard/0"]', 1.0, -2.0)
    moved = studio.setup()["yard"]
    assert moved[0] == [[x + 1, y - 2] for x, y in before[0]]
    assert moved[1] == before[1]
    studio.drag('[data-handle="yard/0/0"]', -0.5, 0.5)
    assert studio.setup()["yard"][0][1:] == moved[0][1:]
    assert studio.setup()["yard"][0][0] == [moved[0][0][0] - 0.5, moved[0][0][1] + 0.5]
    studio.save()
    assert studio.saved()["areas"]["yard"][0] == studio.setup()["yard"][0]


def test_coordinates_are_typed(studio):
    field = '[data-key="cranes/0-0"]'
    studio.page.fill(field, "7,25")
    studio.page.keyboard.press("Tab")
    assert studio.base() == [7.25, 9.5]
    assert studio.page.evaluate("() => document.activeElement.dataset.key") == "cranes/0-1"
    studio.page.fill(field, "north")
    studio.page.keyboard.press("Enter")
    assert "“north” is not a coordinate" in studio.page.inner_text("#told")
    assert studio.page.get_attribute(field, "aria-invalid") == "true"
    assert studio.base() == [7.25, 9.5]
    studio.page.keyboard.press("Escape")
    assert studio.page.input_value(field) == "7.25"


def test_what_cannot_be_lifted_comes_first_with_its_reason(studio):
    assert studio.page.locator("#parts-list .cannot").first.is_hidden()
    for n in (0, 1):
        studio.page.fill(f'[data-key="cranes/{n}-1"]', "60")
        studio.page.keyboard.press("Enter")
    studio.settled()
    first = studio.page.locator("#parts-list > details:visible").first
    assert "Cannot be lifted (33)" in first.inner_text()
    assert first.locator(".why").first.text_content() != ""
    assert "0 of 33" in studio.page.inner_text("#served")
    first.locator("button").first.click()
    assert studio.page.locator("#pane-setup .chosen-part .warn").count() == 1
    assert studio.page.locator(".part.chosen.cannot").count() == 1


def test_search_and_legend_filter_list_and_drawing(studio):
    total = studio.page.locator("#parts-list > :not(.types) li").count()
    assert total == 33
    studio.page.keyboard.press("/")
    studio.page.keyboard.type("beam a1")
    assert studio.page.inner_text("#parts-count") == "1 of 33 parts"
    assert studio.page.locator(".part.ghost").count() == total - 1
    studio.page.keyboard.press("Escape")
    assert studio.page.locator(".part.ghost").count() == 0
    studio.page.locator("#key button:visible").first.click()
    shown = studio.page.locator("#parts-list > :not(.types) li:visible").count()
    assert 0 < shown <= total
    assert studio.page.locator(".part:not(.ghost)").count() == shown


def test_means_of_a_part_and_of_a_group(studio):
    studio.page.locator("#parts-list > :not(.types) li button").first.click()
    studio.page.select_option('[data-key="part-means"]', "in_situ")
    studio.settled()
    assert list(studio.setup()["means"].values()).count("in_situ") == 1
    assert "32 of 32" in studio.page.inner_text("#served")
    studio.page.locator(".all select").first.select_option("by_hand")
    studio.settled()
    group = list(studio.setup()["means"].values()).count("by_hand")
    assert group > 1
    assert studio.page.locator(".part.by_hand").count() == group


def test_machine_and_jib_are_chosen(studio):
    rings = studio.page.locator(".ring-label").all_text_contents()
    studio.page.focus('[data-key="crane-0-machine"]')
    studio.page.select_option('[data-key="crane-0-machine"]', "flat-top-120")
    studio.settled()
    assert studio.setup()["cranes"][0]["machine"] == "flat-top-120"
    assert studio.page.evaluate("() => document.activeElement.dataset.key") == "crane-0-machine"
    height_m = studio.page.evaluate("() => window.studio.answer.cranes[0].height_m")
    assert float(studio.page.input_value('[data-key="crane-0-height"]')) == height_m
    studio.page.select_option('[data-key="crane-0-jib"]', "50")
    studio.settled()
    assert studio.page.evaluate("() => window.studio.answer.cranes[0].most_m") == pytest.approx(50, abs=0.5)
    assert studio.page.locator(".ring-label").all_text_contents() != rings


def test_cranes_are_removed_and_added(studio):
    studio.page.click('[data-key="crane-1-remove"]')
    studio.settled()
    assert [crane["name"] for crane in studio.setup()["cranes"]] == ["west"]
    assert studio.page.locator('[data-handle^="cranes/"]').count() == 1
    assert studio.page.locator('[data-key="crane-0-remove"]').count() == 0
    studio.save()
    assert [crane["name"] for crane in studio.saved()["crane"]] == ["west"]
    studio.page.click('[data-key="add-crane"]')
    assert studio.page.evaluate("() => document.activeElement.dataset.key") == "cranes/1-0"
    studio.settled()
    studio.save()
    west, new = studio.saved()["crane"]
    assert (west["base_m"], new["name"], new["machine"]) == (BASE, "Crane 2", "hammerhead-30")
    assert studio.page.evaluate("() => window.studio.answer.cranes.length") == 2


def test_zones_are_added_bent_and_removed(studio):
    studio.page.click('[data-key="add-zone"]')
    assert studio.page.evaluate("() => document.activeElement.dataset.key") == "zones/0-name"
    assert studio.page.locator('[data-handle="zones/0/3"]').count() == 1
    studio.page.focus('[data-handle="zones/0/3"]')
    studio.page.keyboard.press("Insert")
    assert len(studio.setup()["zones"][0]["polygon"]) == 5
    assert studio.page.evaluate("() => document.activeElement.dataset.handle") == "zones/0/3"
    studio.page.keyboard.press("Delete")
    assert len(studio.setup()["zones"][0]["polygon"]) == 4
    studio.page.focus('[data-handle="zones/0"]')
    studio.page.keyboard.press("Enter")
    assert studio.page.evaluate("() => document.activeElement.dataset.key") == "zones/0-name"
    studio.page.keyboard.type("street")
    studio.page.keyboard.press("Tab")
    assert studio.page.evaluate("() => document.activeElement.dataset.key") == "zones/0-kind"
    assert studio.page.inner_text('[data-group="zones/0"] summary') == "Zone street"
    studio.page.select_option('[data-key="zones/0-kind"]', "slow")
    assert studio.setup()["zones"][0]["share"] == 0.5
    studio.settled()
    studio.page.click('[data-key="zones/0-remove"]')
    assert studio.setup()["zones"] == []


def figures(studio: Studio, title: str) -> list[str]:
    """Return a row of the table of variants: the first line of each cell."""
    return studio.page.locator(".compare tr", has_text=title).locator("td span:first-child").all_text_contents()


def test_variants_stand_side_by_side(studio):
    studio.drag(CRANE, 1.0, 0.0)
    studio.page.click("#save-variant")
    studio.page.fill("#new-name", "a/b")
    studio.page.keyboard.press("Enter")
    assert "A name has none of" in studio.page.inner_text("#ask")
    studio.page.fill("#new-name", "other place")
    studio.page.keyboard.press("Enter")
    studio.wait("window.studio.opened.path === 'other place.site.toml' && window.studio.answer")
    assert studio.saved("other place.site.toml")["crane"][0]["base_m"][0] == 5.5
    assert studio.base() == [5.5, 9.5]
    studio.page.click("#open")
    studio.page.click("#files button:has-text('hall.site.toml')")
    studio.wait("window.studio.opened.path === 'hall.site.toml' && window.studio.answer")
    studio.page.click("#tab-variants")
    studio.wait("document.querySelector('.compare').textContent.includes('crane west (moved 1.00 m)')")
    assert figures(studio, "Place x, y") == ["4.50, 9.50", "5.50, 9.50"]
    studio.page.click('.compare button:has-text("Plan")')
    studio.wait("document.querySelector('[data-key^=result]')")
    here, there = figures(studio, "Crane hours")
    assert here == "–"
    assert float(there) > 0
    assert studio.page.locator(".compare tbody tr").first.locator("td").all_text_contents() == [
        "No plan",
        "Plan of exactly these files",
    ]
    studio.page.click('[data-key^="result "]')
    assert studio.page.inner_text("#standing").startswith(
        "Of other place.site.toml, not of what is open here: Plan of exactly these files"
    )
    assert studio.page.evaluate("() => getComputedStyle(document.getElementById('shown')).filter") != "none"
    studio.page.click("#tab-variants")
    studio.page.click('.compare button:has-text("Show")')
    studio.wait("window.studio.opened.path === 'other place.site.toml' && window.studio.answer")
    assert studio.base() == [5.5, 9.5]


def test_a_file_that_changed_is_not_overwritten_and_nothing_is_lost(studio):
    studio.page.focus(CRANE)
    studio.page.keyboard.press("ArrowRight")
    file = studio.folder / "hall.site.toml"
    file.write_text(file.read_text() + "\n# changed by somebody else\n")
    studio.page.keyboard.press("Control+s")
    studio.page.wait_for_selector("#told .warn")
    assert "hall.site.toml" in studio.page.inner_text("#told")
    assert studio.page.locator("#told button", has_text="variant").count() == 1
    assert file.read_text().endswith("# changed by somebody else\n")
    assert studio.base() == [5.0, 9.5]


def test_two_pages_that_save_at_once_lose_nothing(studio, address):
    other = Studio(studio.page.context.new_page(), studio.folder)
    other.page.goto(f"{address}&open=hall.site.toml")
    other.settled()
    for page, key in ((studio, "ArrowRight"), (other, "ArrowLeft")):
        page.page.focus(CRANE)
        page.page.keyboard.press(key)
    both = (studio, other)
    for page in both:
        page.page.evaluate("() => void window.studio.save()")
    for page in both:
        page.wait("!window.studio.isSaving")
    (loser,) = [page for page in both if page.page.evaluate("() => window.studio.isChanged")]
    (winner,) = [page for page in both if page is not loser]
    assert studio.saved()["crane"][0]["base_m"][:2] == winner.base()
    mine = loser.base()
    assert mine in ([5.0, 9.5], [4.0, 9.5])
    assert mine != winner.base()
    assert "changed since" in loser.page.inner_text("#told")
    assert loser.page.locator("#told button", has_text="variant").count() == 1
    loser.page.click("#told button:has-text('Save mine over it')")
    loser.wait("!window.studio.isChanged")
    assert studio.saved()["crane"][0]["base_m"][:2] == mine
    winner.wait("document.querySelector('#told').textContent.includes('changed on disk')")
    winner.page.click("#told button:has-text('Open it again')")
    winner.wait(f"window.studio.setup.cranes[0].base_m[0] === {mine[0]}")
    assert other.complaints == []


def test_two_pages_that_drop_obstructions_at_once_lose_nothing(studio, address):
    other = Studio(studio.page.context.new_page(), studio.folder)
    other.page.goto(f"{address}&open=hall.site.toml")
    other.settled()
    both = (studio, other)
    for page, x in zip(both, (3, 30), strict=True):
        box = f"{{ id: 'at {x}', min: [{x}, 12, 0], max: [{x + 1}, 13, 1] }}"
        page.page.evaluate(f"() => window.studio.change({{ ...window.studio.setup, boxes: [{box}] }}, 'new')")
    for page in both:
        page.wait("!window.studio.placing.busy")
    (loser,) = [page for page in both if not page.page.evaluate("() => window.studio.isPlaced")]
    names = [box["id"] for box in loser.setup()["boxes"]]
    assert [box["id"] for box in boxes(studio)] != names
    assert "changed since" in loser.page.inner_text("#told")
    loser.page.click("#told button:has-text('Write mine over it')")
    loser.wait("window.studio.isPlaced")
    assert [box["id"] for box in boxes(studio)] == names
    (winner,) = [page for page in both if page is not loser]
    winner.wait(f"window.studio.setup.boxes[0].id === '{names[0]}'")


def test_a_plan_of_an_earlier_state_is_marked(studio, address):
    studio.page.click("#start-plan")
    studio.wait("document.querySelector('#pane-result iframe')")
    shown = studio.page.inner_text("#standing")
    assert shown.startswith("Plan of exactly these files, of ")
    assert shown.endswith(": 33 lifts planned, 0 refused.")

    seen = """(() => {
      const textOf = (id) => document.getElementById(id).textContent;
      const [line, tab, chip] = ["standing", "tab-result", "state"].map(textOf);
      const isGrey = getComputedStyle(document.getElementById("shown")).filter !== "none";
      const isMarked = tab === "Result, earlier" && chip.includes("earlier state") && isGrey;
      return { line, isMarked, isClean: tab === "Result" && !chip.includes("earlier") && !isGrey };
    })()"""

    def marked(what: str) -> None:
        studio.wait(f"{seen}.isMarked && {seen}.line.includes('Changed since: {what}')")

    def proven() -> None:
        studio.wait(f"{seen}.isClean && {seen}.line === '{shown}'")

    studio.page.evaluate("() => window.studio.nudge('cranes/0', [0.5, 0], false)")
    marked("crane west (moved 0.50 m)")
    studio.page.keyboard.press("Control+z")
    proven()
    file = studio.folder / "hall.obstructions.json"
    truck = {"id": "truck", "box": {"min": [0, 0, 0], "max": [2, 5, 3]}}
    file.write_text(json.dumps({"version": 1, "obstructions": [truck]}))
    marked("obstruction truck (new)")
    studio.wait("window.studio.setup.boxes[0]?.id === 'truck'")
    file.unlink()
    proven()
    # Another page finds the plan next to its site, and the figures of it in the table.
    other = Studio(studio.page.context.new_page(), studio.folder)
    other.page.goto(f"{address}&open=hall.site.toml")
    other.settled()
    other.wait("window.studio.state.now.state === 'current'")
    assert not other.page.is_disabled("#tab-result")
    other.page.click("#tab-variants")
    assert float(figures(other, "Crane hours")[0]) > 0
    other.page.click("#tab-plan")
    site = studio.folder / "hall.site.toml"
    site.write_text(site.read_text() + "\n[rules]\nhighest_utilisation = 0.9\n")
    marked("the site file on disk")


def test_what_obstructions_refuse_is_still_said_after_a_watch(studio):
    truck = {"id": "truck", "box": {"min": [0, 0, 0], "max": [2, 5, 3]}}
    (studio.folder / "hall.obstructions.json").write_text(json.dumps({"version": 1, "obstructions": [truck]}))
    studio.wait("window.studio.setup.boxes.length === 1")
    studio.page.click("#start-watch")
    studio.page.keyboard.press("Enter")
    studio.wait("document.getElementById('stage')?.textContent.startsWith('Watching')")
    studio.wait("window.studio.state.now.state === 'current'")
    assert "1 refused" in studio.page.inner_text("#state")
    studio.page.evaluate("() => window.studio.nudge('cranes/0', [0.5, 0], false)")
    studio.wait("window.studio.state.now.state === 'earlier'")
    studio.page.keyboard.press("Control+z")
    studio.wait("window.studio.state.now.state === 'current'")
    studio.page.click("#job button")
    studio.wait("document.getElementById('job').hidden")
    studio.wait("window.studio.state.now.state === 'current'")
    assert "1 refused" in studio.page.inner_text("#state")
    assert "refused" in studio.page.get_attribute("#state", "class")
    studio.page.click("#tab-result")
    assert "32 lifts planned, 1 refused" in studio.page.inner_text("#standing")


def test_leaving_with_unsaved_changes_asks(studio):
    studio.page.focus(CRANE)
    studio.page.keyboard.press("ArrowRight")
    asked: list[str] = []
    studio.page.on("dialog", lambda dialog: (asked.append(dialog.type), dialog.dismiss()))
    studio.page.close(run_before_unload=True)
    studio.wait("true")  # the page still answers
    assert asked == ["beforeunload"]
    studio.page.keyboard.press("Control+o")
    studio.page.click("#files button:has-text('hall.ifc')")
    studio.page.wait_for_selector("#ask[open]")
    assert "not saved" in studio.page.inner_text("#ask")
    studio.page.click("#ask button:has-text('Cancel')")
    assert studio.base() == [5.0, 9.5]


def test_plan_shows_its_progress_and_then_its_page(studio):
    studio.page.click("#start-plan")
    studio.page.wait_for_selector("#job:not([hidden])")
    assert studio.page.is_disabled("#start-plan")
    studio.wait("document.querySelector('#pane-result iframe')")
    assert studio.page.is_hidden("#job")
    assert "/page/" in studio.page.get_attribute("#pane-result iframe", "src")
    studio.page.click("#tab-variants")
    assert float(figures(studio, "Crane hours")[0]) > 0


def test_the_numbers_of_table_list_and_result_are_those_of_the_log(studio, tmp_path):
    studio.page.click("#start-plan")
    studio.wait("document.querySelector('#pane-result iframe')")
    logged = Logged(Path(shutil.copy(studio.folder / "hall.mcap", tmp_path)))
    shares = [logged.governing(lift)["share"] for lift in logged.planned]
    studio.page.click("#tab-variants")
    assert figures(studio, "Crane hours") == [fixed((logged.ends_s - logged.begins_s) / 3600, 1)]
    assert figures(studio, "Highest in the plan") == [percent(max(shares))]
    assert figures(studio, "Critical") == [str(sum(share >= logged.site.rules.critical_share for share in shares))]
    assert figures(studio, "Lifts refused") == [str(sum(lift["status"] == "infeasible" for lift in logged.lifts))]
    read = "(all) => all.map((one) => [one.dataset.part, one.querySelector('small').textContent])"
    masses = dict(studio.page.eval_on_selector_all("#parts-list > :not(.types) li", read))
    assert masses == {lift["component"]: tonnes(lift["mass_kg"]) for lift in logged.lifts}
    result = studio.page.context.new_page()
    result.goto(studio.page.evaluate("() => document.querySelector('#pane-result iframe').src"))
    seen = Seen(result)
    seen.wait("document.documentElement.dataset.drawn > 0")
    assert differences(seen, logged).found == []


def test_planning_is_cancelled(studio):
    studio.page.click("#start-plan")
    studio.page.click("#job button")
    studio.wait("document.getElementById('job').hidden")
    assert "cancelled" in studio.page.inner_text("#told")
    assert not list(studio.folder.glob("*.mcap"))


def boxes(studio: Studio) -> list[dict[str, Any]]:
    """Return the obstructions of the file."""
    file = studio.folder / "hall.obstructions.json"
    return json.loads(file.read_text())["obstructions"] if file.exists() else []


def test_an_obstruction_is_added_dragged_typed_and_written_at_once(studio):
    studio.page.click('[data-key="add-box"]')
    studio.wait("!window.studio.placing.busy")
    (box,) = boxes(studio)
    assert box["id"] == "obstruction 1"
    assert not studio.page.evaluate("() => window.studio.isChanged")  # the site file does not change
    studio.drag('[data-handle="boxes/0"]', 3.0, -2.0)
    studio.wait("!window.studio.placing.busy")
    (dragged,) = boxes(studio)
    assert dragged["box"]["min"] == [box["box"]["min"][0] + 3, box["box"]["min"][1] - 2, 0]
    studio.page.fill('[data-key="boxes/0-name"]', "truck")
    studio.page.keyboard.press("Tab")
    studio.page.fill('[data-key="boxes/0-max-2"]', "2.75")
    studio.page.keyboard.press("Tab")
    studio.wait("!window.studio.placing.busy && !window.studio.placing.next")
    (typed,) = boxes(studio)
    assert typed["id"] == "truck"
    assert typed["box"]["max"][2] == 2.75
    studio.page.focus('[data-handle="boxes/0/2"]')
    studio.page.keyboard.press("ArrowRight")
    studio.page.keyboard.press("Control+z")
    studio.page.keyboard.press("Control+y")
    studio.wait("!window.studio.placing.busy && !window.studio.placing.next")
    assert boxes(studio)[0]["box"]["max"][0] == typed["box"]["max"][0] + 0.5
    studio.page.click('[data-key="boxes/0-remove"]')
    studio.wait("!window.studio.placing.busy && !window.studio.placing.next")
    assert boxes(studio) == []


def test_a_truck_that_is_dropped_while_watched_brings_a_revision(studio):
    studio.page.click("#start-watch")
    studio.page.keyboard.press("Enter")
    studio.wait("document.getElementById('stage')?.textContent.startsWith('Watching')")
    assert studio.page.is_disabled("#start-plan")
    studio.page.click('[data-key="add-box"]')
    studio.wait("document.getElementById('stage').textContent.startsWith('Revision 1')")
    assert " ms" in studio.page.inner_text("#stage")
    studio.wait("window.studio.changes")
    changes = studio.page.evaluate("() => [...window.studio.changes.values()].map(({ kind }) => kind)")
    assert studio.page.locator(".part.changed").count() == len(changes)
    first = studio.page.locator("#parts-list > details:visible").first
    assert first.locator("summary").inner_text().startswith("Revision 1: ")
    counts = studio.page.evaluate("() => window.studio.state.now.counts")
    assert (changes.count("refused"), changes.count("replanned")) == (counts["refused"], counts["replanned"])
    assert first.locator("li").count() == len(changes)
    assert not studio.page.is_disabled("#tab-result")
    studio.page.click("#job button")
    studio.wait("document.getElementById('job').hidden")
    assert studio.page.locator(".part.changed").count() == len(changes)


def test_a_plan_is_carried_out_and_a_truck_is_dropped_meanwhile(studio):
    studio.page.click("#start-watch")
    studio.page.check("[name=carried][value=yes]")
    studio.page.fill("#speed", "fast")
    studio.page.keyboard.press("Enter")
    assert "is a number" in studio.page.inner_text("#ask")
    studio.page.fill("#speed", "200")
    studio.page.keyboard.press("Enter")
    studio.wait("/lifting .* of 33 set/.test(document.getElementById('carried')?.textContent)")
    before = studio.page.inner_text("#carried")
    assert studio.page.locator(".part.unset").count() > 20
    assert studio.page.locator(".part.lifting").count() >= 1
    assert studio.page.locator("#parts-list small", has_text="is lifted now").count() >= 1
    studio.wait("/ [1-9]\\d* of 33 set/.test(document.getElementById('carried').textContent)")
    assert studio.page.inner_text("#carried").split(" · ")[0] > before.split(" · ")[0]
    studio.page.click('[data-key="add-box"]')
    studio.wait("document.getElementById('stage').textContent.startsWith('Revision 1 (obstruction 1)')")
    studio.drag('[data-handle="boxes/0"]', 18.0, 0.0)  # onto the place of Column A7, one of the last columns
    studio.wait("document.getElementById('stage').textContent.startsWith('Revision 2 (obstruction 1)')")
    studio.wait("document.querySelector('#parts-list .changed .why')?.textContent.includes('obstruction 1')")
    studio.page.click("#job button")
    studio.wait("document.getElementById('job').hidden")
    assert studio.page.locator(".part.unset").count() == 0


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize(("width", "height"), [(1440, 900), (390, 844)])
def test_text_has_contrast_and_panes_fit(browser, address, folder, scheme, width, height):
    studio = show(browser, address, folder, width, height, color_scheme=scheme, has_touch=width < 500)
    tabs = ["parts", "plan", "setup", "variants"] if width < 500 else ["plan", "variants"]
    for name in tabs:
        studio.page.click(f"#tab-{name}")
        assert studio.page.is_visible(f"#pane-{name}")
        assert studio.page.evaluate("() => document.documentElement.scrollWidth <= innerWidth")
        low = studio.page.evaluate(CONTRAST)
        assert low == [], f"{scheme} {name}"
        if width < 500:
            assert studio.page.locator(".pane:visible").count() == 1
            small = studio.page.evaluate(SMALL)
            assert small == [], name
    assert studio.complaints == []
    studio.page.context.close()


COVERED = """() => {
  const tools = document.querySelector(".sheet .tools .group").getBoundingClientRect();
  return [...document.querySelectorAll(".ring-label")].filter((one) => {
    const box = one.getBoundingClientRect();
    return box.right > tools.left && box.left < tools.right && box.bottom > tools.top && box.top < tools.bottom;
  }).length;
}"""


def test_a_problem_is_read_on_a_phone_and_rings_keep_clear_of_the_buttons(browser, address, folder):
    studio = show(browser, address, folder, 390, 844, has_touch=True)
    centre = "(all) => all.reduce(([x, y], at) => [x + at[0] / all.length, y + at[1] / all.length], [0, 0])"
    step = f"({centre})(window.studio.setup.yard[0]).map((value, n) => value - {BASE}[n])"
    assert "mast" not in studio.page.inner_text("#served")
    studio.page.evaluate(f"() => window.studio.nudge('cranes/0', {step}, false)")
    studio.settled()
    assert "The mast of west stands in the yard" in studio.page.inner_text("#served")
    assert studio.page.evaluate("() => document.documentElement.scrollWidth <= innerWidth")
    assert studio.page.locator(".ring-label").count() > 0
    for _ in range(12):
        assert studio.page.evaluate(COVERED) == 0
        studio.page.evaluate("() => window.studio.drawing.pan(12, -25)")
    assert studio.complaints == []
    studio.page.context.close()


def test_another_site_does_not_show_the_last_ones_picture(studio):
    studio.wait("!window.studio.picture.asking.busy && window.studio.picture.image.src")
    held: list[Any] = []

    def hold(asked: Any) -> None:
        held.append(asked)

    studio.page.route("**/api/picture", hold)
    studio.page.evaluate("() => window.studio.openFile('hall.ifc')")
    studio.wait("window.studio.picture.asking.busy")
    assert studio.page.locator(".solid img").is_hidden()
    assert "is being drawn" in studio.page.inner_text(".solid p")
    held[0].continue_()
    studio.page.unroute("**/api/picture")
    studio.wait("!window.studio.picture.image.hidden")
    assert studio.page.inner_text(".solid p") == ""


def test_a_finger_drags_the_crane_on_a_phone(browser, address, folder):
    studio = show(browser, address, folder, 390, 844, has_touch=True, is_mobile=True)
    x, y = studio.middle(CRANE)
    touch = studio.page.context.new_cdp_session(studio.page)
    for kind, at in (("touchStart", (x, y)), ("touchMove", (x + 20, y)), ("touchMove", (x + 50, y - 30))):
        touch.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": [{"x": at[0], "y": at[1]}]})
    touch.send("Input.dispatchTouchEvent", {"type": "touchEnd", "touchPoints": []})
    studio.settled()
    assert studio.base()[0] > BASE[0]
    assert studio.base()[1] > BASE[1]
    assert studio.complaints == []
    studio.page.context.close()


SMALL = """() => [...document.querySelectorAll("button, select, summary, input, [role=tab]")]
  .filter((one) => one.checkVisibility() && !one.closest("dialog:not([open])"))
  .map((one) => [one.id || one.dataset.key || one.innerText.slice(0, 20), one.getBoundingClientRect()])
  .filter(([, box]) => box.width > 0 && (box.height < 43.5 || box.width < 43.5))
  .map(([name, box]) => `${name} ${box.width} x ${box.height}`)"""
"""What is smaller than a finger needs: 44 CSS pixels."""

CONTRAST = """() => {
  const channels = (colour) => {
    const found = (colour.match(/[\\d.]+/g) ?? []).map(Number);
    return colour.startsWith("color(srgb") ? found.map((value, n) => n < 3 ? value * 255 : value) : found;
  };
  const light = ([r, g, b]) => [r, g, b].map((value) => value / 255)
    .map((value) => value <= 0.03928 ? value / 12.92 : ((value + 0.055) / 1.055) ** 2.4)
    .reduce((sum, value, n) => sum + value * [0.2126, 0.7152, 0.0722][n], 0);
  const paperOf = (one) => {
    for (let at = one; at; at = at.parentElement) {
      const paper = channels(getComputedStyle(at).backgroundColor);
      if (paper.length >= 3 && (paper.length < 4 || paper[3] > 0.5)) return paper;
    }
    return [255, 255, 255];
  };
  const low = [];
  const walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  for (let node = walker.nextNode(); node; node = walker.nextNode()) {
    const one = node.parentElement;
    if (!node.data.trim() || !one.checkVisibility() || one.closest(":disabled, .unseen, .skip, noscript")) continue;
    const style = getComputedStyle(one);
    const ink = channels(one instanceof SVGElement ? style.fill : style.color);
    const [a, b] = [light(ink), light(paperOf(one))].sort((x, y) => y - x);
    const ratio = (a + 0.05) / (b + 0.05);
    if (ratio < 4.5) low.push(`${node.data.trim().slice(0, 30)} ${ratio.toFixed(2)}`);
  }
  return low;
}"""
"""Texts with less contrast than WCAG AA asks for (4.5)."""


def test_the_first_day_and_the_shifts_are_typed_and_saved(studio):
    studio.page.click('[data-group="calendar"] summary')
    studio.page.fill('[data-key="calendar-start"]', "2026-12-07")
    studio.page.uncheck('[data-key="calendar-Fri"]')
    studio.page.fill('[data-key="calendar-shifts"]', "seven")
    studio.page.keyboard.press("Tab")
    assert "are no shifts" in studio.page.inner_text("#told")
    studio.page.fill('[data-key="calendar-shifts"]', "7:00-12:00, 13:00-17:00")
    studio.page.keyboard.press("Tab")
    studio.settled()
    studio.save()
    saved = studio.saved()["calendar"]
    assert str(saved["start"]) == "2026-12-07"
    assert saved["days"] == ["Mon", "Tue", "Wed", "Thu"]
    assert saved["shifts"] == ["07:00-12:00", "13:00-17:00"]
    studio.page.click("#undo")
    assert studio.page.input_value('[data-key="calendar-shifts"]') == "07:00-16:00"


GRIP = ".ground-handle .grip"


def test_the_ground_is_moved_in_3d_and_saved(studio):
    def drawn() -> None:
        studio.wait("!window.studio.picture.asking.busy && !window.studio.picture.image.hidden")
        studio.wait("window.studio.picture.ground.drawn_m === window.studio.setup.ground_m")

    drawn()
    before = studio.setup()["ground_m"]
    metre_px = studio.page.evaluate("() => 1 / Math.abs(window.studio.picture.ground.metresOf(1))")
    x, y = studio.middle(f"{GRIP} .target")
    studio.page.mouse.move(x, y)
    studio.page.mouse.down()
    studio.page.mouse.move(x, y - 2.0 * metre_px, steps=5)
    assert studio.setup()["ground_m"] == before, "it is entered when the hand lets go"
    studio.page.keyboard.press("Escape")
    studio.page.mouse.up()
    assert studio.setup()["ground_m"] == before
    studio.page.mouse.move(x, y)
    studio.page.mouse.down()
    studio.page.mouse.move(x, y + 1.0 * metre_px, steps=5)
    studio.page.mouse.up()
    lower = studio.setup()["ground_m"]
    assert lower == pytest.approx(before - 1.0, abs=0.06)
    studio.settled()
    assert float(studio.page.locator('[data-key="ground"]').input_value()) == lower
    drawn()
    studio.page.locator(GRIP).focus()
    studio.page.keyboard.press("ArrowUp")
    studio.page.keyboard.press("Shift+ArrowUp")
    wanted = round(lower + 0.6, 2)
    assert studio.setup()["ground_m"] == pytest.approx(wanted)
    studio.settled()
    assert studio.page.locator(GRIP).get_attribute("aria-valuenow") == f"{wanted:g}"
    studio.save()
    assert studio.saved()["model"]["ground_m"] == pytest.approx(wanted)
    studio.page.keyboard.press("Control+z")
    drawn()
    assert studio.page.locator(GRIP).get_attribute("aria-valuenow") == f"{lower + 0.5:g}"
    assert studio.complaints == []


def test_the_site_is_drawn_in_3d_and_turned(studio):
    def drawn() -> str:
        studio.wait("!window.studio.picture.asking.busy && window.studio.picture.image.src")
        return str(studio.page.get_attribute(".solid img", "src"))

    first = drawn()
    assert first.startswith("data:image/png;base64,")
    studio.page.click('.solid button[aria-label*="right"]')
    studio.wait("window.studio.picture.asking.busy")
    assert drawn() != first
