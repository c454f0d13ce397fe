"""A day with the studio in a real browser: the state of the plan in words, from the first opening to the report."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from planned_frame import write_site
from studios import Studio, served

pytestmark = pytest.mark.browser

SITE = "frame.site.toml"
CRANE = '[data-handle="cranes/0"]'
NONE, EXACT, EARLIER = "No plan", "Plan of exactly these files", "Plan of an earlier state"
MADE = "Plan being made"
TRUCK = {"id": "truck", "box": {"min": [0, -8, 0], "max": [6, -5, 3]}}


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    write_site(tmp_path)
    return tmp_path


def opened(browser: Any, address: str, folder: Path) -> Studio:
    options = {"viewport": {"width": 1440, "height": 900}, "reduced_motion": "reduce"}
    studio = Studio(browser.new_context(**options).new_page(), folder)
    studio.page.goto(address)
    return studio


def says(studio: Studio, title: str, more: str = "") -> None:
    """Wait until every view says a state: badge, page title, tab, result and table of variants."""
    studio.wait(f"document.getElementById('state').textContent.startsWith({json.dumps(title)})")
    studio.wait(f"window.studio.state.now.words.includes({json.dumps(more)})")
    seen = studio.page.evaluate(SEEN)
    assert seen["standing"].startswith(title), seen
    assert f": {title} · bimvox studio" in seen["title"], seen
    assert seen["table"] in (title, None), seen
    assert seen["green"] is (title == EXACT and " 0 refused" in seen["standing"]), seen
    if seen["page"] is not None:
        assert seen["page"].startswith(title) is (title != EXACT), seen
    assert seen["disabled"] is (seen["counts"] is None), seen
    if seen["counts"] is not None:
        assert seen["counts"]["words"] in seen["badge"], seen
        assert seen["counts"]["words"] in seen["standing"], seen


SEEN = """() => {
  const textOf = (id) => document.getElementById(id).textContent;
  const { table, state, panes } = window.studio;
  const now = panes.now;
  if (now === "plan") panes.show("variants");
  const cell = table.pane.querySelector("tbody td.current");
  if (now === "plan") panes.show("plan");
  const frame = document.querySelector("#shown iframe")?.contentDocument?.getElementById("proof");
  return {
    badge: textOf("state"),
    green: document.getElementById("state").classList.contains("clean"),
    standing: textOf("standing"),
    title: document.title,
    table: now === "plan" ? cell.textContent : null,
    page: frame?.textContent || null,
    disabled: document.getElementById("tab-result").disabled,
    counts: state.now.counts,
  };
}"""


def boxes(folder: Path, *obstructions: Any) -> None:
    (folder / "frame.obstructions.json").write_text(json.dumps({"version": 1, "obstructions": list(obstructions)}))


def marked(studio: Studio, kind: str) -> int:
    return int(studio.page.locator(f".part.{kind}").count())


def watch(studio: Studio, speed: int | None = None) -> None:
    studio.page.click("#start-watch")
    if speed is not None:
        studio.page.check("[name=carried][value=yes]")
        studio.page.fill("#speed", str(speed))
    studio.page.keyboard.press("Enter")
    studio.wait("document.getElementById('stage')?.textContent.startsWith('Watching')")


def end_watch(studio: Studio) -> None:
    studio.page.click("#job button")
    studio.wait("document.getElementById('job').hidden")


def test_a_day_from_the_first_opening_to_the_report(browser: Any, folder: Path) -> None:
    with served(folder) as address:
        studio = opened(browser, f"{address}&open={SITE}", folder)
        studio.settled()
        says(studio, NONE)
        studio.drag(CRANE, 0.5, 0.0)
        says(studio, NONE)
        studio.page.click("#start-plan")
        says(studio, MADE)
        studio.wait("document.querySelector('#pane-result iframe')")
        says(studio, EXACT, "8 lifts planned, 0 refused")
        # Stale: the crane is moved, undone, moved and saved.
        studio.page.click("#tab-plan")
        studio.drag(CRANE, -0.5, 0.0)
        says(studio, EARLIER, "Changed since: the crane (moved 0.50 m)")
        studio.page.keyboard.press("Control+z")
        says(studio, EXACT)
        studio.page.keyboard.press("Control+y")
        studio.save()
        says(studio, EARLIER, "Changed since: the crane (moved 0.50 m)")
        studio.page.click("#tab-result")
        says(studio, EARLIER)
        studio.page.click("#standing button:has-text('Plan again')")
        says(studio, MADE, "Shown is the plan of")
        says(studio, EXACT)
        assert studio.complaints == []
        studio.page.context.close()
    with served(folder) as address:  # the next morning
        studio = opened(browser, address, folder)
        studio.wait(f"document.querySelector('#files .held')?.textContent.startsWith({json.dumps(EXACT)})")
        assert "8 lifts planned, 0 refused" in studio.page.inner_text("#files")
        studio.page.click(f"#files button:has-text('{SITE}')")
        studio.settled()
        says(studio, EXACT, "8 lifts planned, 0 refused")
        watch(studio)
        says(studio, EXACT)
        boxes(folder, TRUCK)
        studio.wait("document.getElementById('stage').textContent.startsWith('Revision 1 (truck)')")
        says(studio, EXACT, "7 lifts planned, 1 refused, 1 replanned in revision 1")
        assert (marked(studio, "refused"), marked(studio, "replanned")) == (1, 1)
        end_watch(studio)
        says(studio, EXACT, "7 lifts planned, 1 refused, 1 replanned in revision 1")
        assert (marked(studio, "refused"), marked(studio, "replanned")) == (1, 1)
        assert "1 refused, 1 replanned" in studio.page.inner_text("#parts-list .changed summary")
        studio.page.click("#tab-result")
        studio.wait("document.querySelector('#shown iframe')?.contentDocument.getElementById('facts')?.textContent")
        facts = studio.page.evaluate(
            "() => document.querySelector('#shown iframe').contentDocument.getElementById('facts').textContent"
        )
        assert facts.startswith("7 lifts planned, 1 refused")
        studio.page.click("#kept button:has-text('As PDF')")
        studio.page.wait_for_selector("#kept a")
        assert studio.page.inner_text("#kept a").startswith("frame.report.pdf, ")
        assert "earlier" not in studio.page.inner_text("#kept a")
        assert (folder / "frame.report.pdf").read_bytes().startswith(b"%PDF")
        # The truck leaves: the plan and its report are of an earlier state, and planned again they are not.
        boxes(folder)
        says(studio, EARLIER, "Changed since: obstruction truck (removed)")
        studio.page.click("#standing button:has-text('Plan again')")
        says(studio, EXACT, "8 lifts planned, 0 refused")
        studio.wait("document.querySelector('#kept a')?.textContent.includes('of an earlier plan')")
        assert studio.complaints == []
        studio.page.context.close()


def test_what_is_done_counts_after_the_watch_and_after_a_restart(browser: Any, folder: Path) -> None:
    with served(folder) as address:
        studio = opened(browser, f"{address}&open={SITE}", folder)
        studio.settled()
        watch(studio, 2000)
        studio.wait("(window.studio.state.now.counts?.done ?? 0) >= 2")
        end_watch(studio)
        studio.page.evaluate("() => window.studio.state.settled()")
        says(studio, EXACT, " done")
        done = studio.page.evaluate("() => window.studio.state.now.counts.done")
        assert marked(studio, "set") == done >= 2
        assert studio.complaints == []
        studio.page.context.close()
    with served(folder) as address:
        studio = opened(browser, f"{address}&open={SITE}", folder)
        studio.settled()
        says(studio, EXACT, f", {done} done")
        assert marked(studio, "set") == done
        studio.page.context.close()


DROP = """([name, content]) => {
  const data = new DataTransfer();
  data.items.add(new File([content], name));
  document.body.dispatchEvent(new DragEvent("drop", { dataTransfer: data, bubbles: true, cancelable: true }));
}"""


def test_a_model_is_dropped_on_the_page_and_variants_are_no_doubles(browser: Any, folder: Path) -> None:
    model = (folder / "frame.ifc").read_text()
    for file in folder.iterdir():
        file.unlink()
    with served(folder) as address:
        studio = opened(browser, address, folder)
        studio.page.wait_for_selector("#files[open]")
        studio.page.evaluate(DROP, ["house.ifc", model])
        studio.wait("window.studio.opened?.path === 'house.site.toml' && window.studio.answer")
        assert (folder / "house.ifc").read_text() == model
        says(studio, NONE)
        studio.page.evaluate(DROP, ["house.exe", "x"])
        studio.page.wait_for_selector("#told .warn")
        assert "not of a kind that bimvox reads" in studio.page.inner_text("#told")
        studio.save()
        studio.page.evaluate(DROP, ["trucks.json", json.dumps({"version": 1, "obstructions": [TRUCK]})])
        studio.wait("window.studio.setup.boxes[0]?.id === 'truck'")
        studio.page.click("#save-variant")
        studio.page.keyboard.press("Enter")
        studio.wait("document.querySelector('#told').textContent.includes('Nothing is changed')")
        studio.drag(CRANE, 1.0, 0.0)
        studio.page.click("#save-variant")
        studio.page.keyboard.press("Enter")
        studio.wait("window.studio.opened.path === 'house 2.site.toml' && window.studio.answer")
        assert (folder / "house 2.obstructions.json").exists()
        studio.wait("document.querySelectorAll('.compare thead th').length === 2")
        row = studio.page.locator(".compare tr", has_text="Differs in")
        studio.wait("document.querySelector('.compare tbody').textContent.includes('the crane (moved 1.00 m)')")
        assert row.locator("td").all_text_contents() == ["–", "the crane (moved 1.00 m)"]
        assert sorted(file.name for file in folder.glob("*.site.toml")) == ["house 2.site.toml", "house.site.toml"]
        studio.page.click(".compare button:has-text('Show')")
        studio.wait("window.studio.opened.path === 'house.site.toml' && window.studio.answer")
        studio.drag(CRANE, 1.0, 0.0)
        studio.page.click("#save-variant")
        studio.page.keyboard.press("Enter")
        studio.wait("document.querySelector('#told').textContent.includes('holds this set-up already')")
        assert sorted(file.name for file in folder.glob("*.site.toml")) == ["house 2.site.toml", "house.site.toml"]
        assert studio.complaints == []
        studio.page.context.close()


@pytest.fixture(autouse=True)
def _has_policies(tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    monkeypatch.setenv("BIMVOX_POLICIES", str(tmp_path_factory.mktemp("policies")))
    yield
