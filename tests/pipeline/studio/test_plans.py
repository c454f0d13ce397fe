"""Of what the plan on disk is one: the four states, what has changed since, and what the folder holds of a site."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

import pytest
from bimvox_pipeline.plan import plan
from bimvox_pipeline.studio.app import Studio, application
from bimvox_pipeline.watch.plan import WatchWish
from bimvox_pipeline.watch.watch import watch
from planned_frame import copy_to
from starlette.testclient import TestClient

from bimvox.library.arguments import PolicyWish
from bimvox.progress import SilentProgress

TOKEN = "a-token"
TITLES = {
    "none": "No plan",
    "current": "Plan of exactly these files",
    "earlier": "Plan of an earlier state",
}
SITE = "frame.site.toml"
OBSTRUCTIONS = "frame.obstructions.json"
CRATE = {"id": "crate", "min": [6.0, -10.0, 0.0], "max": [7.0, -9.0, 1.0]}


class Page:
    """A page with the planned frame open."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.client = TestClient(application(Studio(folder, TOKEN), 8000), base_url="http://127.0.0.1:8000")
        self.opened = self.send("/api/open", path=SITE)
        self.setup = self.opened["setup"]

    def send(self, address: str, /, **asked: Any) -> Any:
        answer = self.client.post(address, json=asked, headers={"X-Bimvox-Token": TOKEN})
        assert answer.status_code == 200, answer.text
        return answer.json()

    def state(self, **setup: Any) -> Any:
        wanted = {**self.setup, **setup}
        return self.send("/api/state", path=SITE, setup=wanted, sha256=self.opened["sha256"])

    def changes(self, **setup: Any) -> list[str]:
        found = self.state(**setup)
        assert found["state"] == ("earlier" if found["changes"] else "current")
        assert found["title"] == TITLES[found["state"]]
        assert found["words"].startswith(f"{found['title']}, of {found['when']}: 8 lifts planned, 0 refused.")
        changes: list[str] = found["changes"]
        assert found["words"].endswith(f"Changed since: {', '.join(changes)}." if changes else "refused.")
        return changes

    def crane(self, **values: Any) -> dict[str, Any]:
        return {"cranes": [{**self.setup["cranes"][0], **values}]}

    def rewrite(self, old: str, new: str) -> None:
        file = self.folder / SITE
        text = file.read_text()
        assert old in text
        file.write_text(text.replace(old, new))


@pytest.fixture
def page(tmp_path: Path) -> Page:
    return Page(copy_to(tmp_path))


def test_a_site_with_its_unchanged_log_has_its_plan(page: Page) -> None:
    found = page.state()
    assert found["state"] == "current"
    found = found["plan"]
    assert found["page"] == "/page/frame.mcap"
    assert (found["refused"], found["replanned"], found["retimed"], found["done"]) == ([], [], [], [])
    assert found["figures"]["crane_hours"] > 0
    assert found["time"]["crane_hours"] == pytest.approx(found["figures"]["crane_hours"])
    assert found["time"]["span_in_words"].startswith("day 1 07:00 to day 1 ")


def test_what_is_changed_on_the_screen_is_named_and_undone(page: Page) -> None:
    moved = page.crane(base_m=[-4.5, -4.0])
    assert page.changes(**moved) == ["the crane (moved 0.50 m)"]
    assert page.changes(truckload_kg=20000) == ["[rules] truckload_kg 20000.0, was 0.0"]
    yard = [[[x - 0.5, y] for x, y in polygon] for polygon in page.setup["yard"]]
    assert page.changes(yard=yard) == ["the yard"]
    zone = {"kind": "slow", "polygon": [[0, 0], [5, 0], [5, 5]], "share": 0.4}
    assert page.changes(zones=[zone]) == ["zone without a name"]
    first = page.opened["parts"][0]["id"]
    assert page.changes(means={**page.setup["means"], first: "by_hand"}) == ["how parts are set (1)"]
    assert page.changes(yard=[]) == ["the set-up"]
    assert page.changes() == []


def test_a_crane_that_is_moved_saved_and_moved_back_is_planned_again(page: Page) -> None:
    back = page.setup
    moved = {**page.setup, **page.crane(base_m=[-4.5, -4.0])}
    page.opened |= page.send("/api/save", path=SITE, setup=moved, sha256=page.opened["sha256"])
    page.setup = moved
    assert page.changes() == ["the crane (moved 0.50 m)"]
    page.setup = back  # undone, not saved
    assert page.changes() == ["the crane (moved 0.50 m) in the saved file"]
    page.opened |= page.send("/api/save", path=SITE, setup=back, sha256=page.opened["sha256"])
    assert page.changes() == []


@pytest.mark.slow
def test_rules_that_are_edited_on_disk_are_seen_and_then_named(page: Page) -> None:
    page.rewrite("# highest_utilisation = 0.85", "highest_utilisation = 0.9 ")
    assert page.changes() == ["the site file on disk"]
    page.opened = page.send("/api/open", path=SITE)
    rules = ["[rules] highest_utilisation 0.9, was not set"]
    assert page.changes() == rules
    assert page.send("/api/state", path=SITE)["changes"] == rules
    page.rewrite("highest_utilisation = 0.9 ", "# highest_utilisation = 0.85, and a comment is free ")
    page.opened = page.send("/api/open", path=SITE)
    assert page.changes() == []


def test_obstructions_of_another_program_are_seen(page: Page) -> None:
    file = page.folder / OBSTRUCTIONS
    assert page.state()["obstructions_sha256"] is None
    file.write_text(json.dumps({"version": 1, "obstructions": []}))
    assert page.changes() == []
    seen = page.state()["obstructions_sha256"]
    written = page.send("/api/obstructions", path=SITE, obstructions=[CRATE], sha256=seen)
    assert page.changes() == ["obstruction crate (new)"]
    assert page.state()["obstructions_sha256"] == written["sha256"]
    made = plan(
        page.folder / SITE,
        page.folder / "frame.mcap",
        obstructions=file,
        wish=PolicyWish("none"),
        progress=SilentProgress(),
    )
    found = page.state()
    assert found["state"] == "current"
    assert found["counts"]["refused"] == len(found["plan"]["refused"]) == len(made["infeasible"])
    mm = [{"id": "crate", "box": {key: [v * 1000 for v in CRATE[key]] for key in ("min", "max")}}]  # type: ignore[attr-defined]
    file.write_text(json.dumps({"version": 1, "unit": "mm", "obstructions": mm}))
    assert page.changes() == []  # the same in another unit
    file.write_text("{")
    assert page.changes() == [f"{OBSTRUCTIONS}, which cannot be used"]
    file.unlink()
    assert page.changes() == ["obstruction crate (removed)"]


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="there are no pipes")
@pytest.mark.parametrize("name", [OBSTRUCTIONS, SITE, "frame.ifc"])
def test_a_pipe_in_the_place_of_a_file_is_refused_and_not_waited_for(page: Page, name: str) -> None:
    (page.folder / name).unlink(missing_ok=True)
    os.mkfifo(page.folder / name)
    for asked in ({"path": SITE}, {"path": SITE, "setup": page.setup, "sha256": page.opened["sha256"]}):
        answer = page.client.post("/api/state", json=asked, headers={"X-Bimvox-Token": TOKEN})
        assert answer.status_code == 400
        assert answer.json()["error"].endswith(f"{name}: cannot be read: this is a pipe, not a regular file")


@pytest.mark.slow
def test_a_plan_of_the_studio_is_of_the_obstructions_too(page: Page) -> None:
    page.send("/api/obstructions", path=SITE, obstructions=[CRATE])
    job = page.send("/api/plan", path=SITE)["job"]
    while (now := page.client.get(f"/api/plan/{job}", headers={"X-Bimvox-Token": TOKEN}).json())["state"] == "running":
        pass
    assert now["state"] == "done", now
    assert page.changes() == []


def test_another_variant_has_its_own_plan_or_none(page: Page) -> None:
    moved = {**page.setup, **page.crane(base_m=[-4.5, -4.0])}
    west = page.send("/api/variant", path=SITE, setup=moved, name="west")["path"]
    none = page.send("/api/state", path=west)
    assert (none["state"], none["title"], none["plan"]) == ("none", "No plan", None)
    (page.folder / "frame.mcap").rename(page.folder / "west.mcap")
    assert page.send("/api/state", path=west)["changes"] == ["the crane (moved 0.50 m)"]
    assert page.state()["plan"] is None


def test_another_model_is_named(page: Page) -> None:
    model = page.folder / "frame.ifc"
    model.write_bytes(model.read_bytes().replace(b"Beam 2", b"Beam B"))
    assert page.changes() == ["the model on disk"]
    page.opened = page.send("/api/open", path=SITE)
    assert page.changes() == ["the model"]


def test_a_log_that_cannot_be_read_is_no_plan(page: Page) -> None:
    (page.folder / "frame.mcap").write_bytes(b"not a log")
    assert page.state()["plan"] is None


def test_a_plan_of_exactly_these_files_is_known_without_reading_the_model(
    page: Page, monkeypatch: pytest.MonkeyPatch
) -> None:
    client = TestClient(application(Studio(page.folder, TOKEN), 8000), base_url="http://127.0.0.1:8000")
    monkeypatch.setattr("bimvox_pipeline.studio.opened.read_building", None)
    answer = client.post("/api/found", json={"path": SITE}, headers={"X-Bimvox-Token": TOKEN})
    assert answer.status_code == 200, answer.text
    found = answer.json()
    assert (found["state"], found["counts"]["planned"], found["name"]) == ("current", 8, "frame")
    assert (found["revisions"], found["documents"]) == ([], [])


def test_a_variant_takes_the_obstructions_along_and_says_what_it_differs_in(page: Page) -> None:
    page.send("/api/obstructions", path=SITE, obstructions=[CRATE])
    moved = {**page.setup, **page.crane(base_m=[-4.5, -4.0])}
    west = page.send("/api/variant", path=SITE, setup=moved, name="west")
    assert (west["path"], west["double"]) == ("west.site.toml", False)
    assert (page.folder / "west.obstructions.json").read_bytes() == (page.folder / OBSTRUCTIONS).read_bytes()
    found = page.send("/api/found", path="west.site.toml", against=SITE, whole=True)
    assert found["state"] == "none"
    assert found["differs"] == ["the crane (moved 0.50 m)"]
    assert found["setup"]["cranes"][0]["base_m"] == [-4.5, -4.0]
    assert found["answer"]["of"] == 8
    models = {one["path"]: one["model"] for one in _files(page) if one["kind"] == "site"}
    assert models == {SITE: "frame.ifc", "west.site.toml": "frame.ifc"}


def test_a_variant_that_is_there_already_is_not_written_again(page: Page) -> None:
    same = page.send("/api/variant", path=SITE, setup=page.setup, name="copy")
    assert (same["path"], same["double"]) == (SITE, True)
    moved = {**page.setup, **page.crane(base_m=[-4.5, -4.0])}
    page.send("/api/variant", path=SITE, setup=moved, name="west")
    again = page.send("/api/variant", path=SITE, setup=moved, name="west again")
    assert (again["path"], again["double"]) == ("west.site.toml", True)
    assert sorted(path.name for path in page.folder.glob("*.site.toml")) == [SITE, "west.site.toml"]


def test_a_report_says_of_which_plan_it_is_and_runs_nothing(page: Page) -> None:
    job = page.send("/api/document", path=SITE)["job"]
    while (now := _get(page, f"/api/plan/{job}").json())["state"] == "running":
        assert page.state()["state"] == "current", "a document is no plan"
    assert (now["state"], now["page"]) == ("done", "/document/frame.report.html")
    (report,) = page.send("/api/found", path=SITE)["documents"]
    assert (report["name"], report["is_of_plan"]) == ("frame.report.html", True)
    shown = page.client.get(f"/document/frame.report.html?token={TOKEN}")
    assert shown.status_code == 200
    assert shown.headers["content-security-policy"].startswith("sandbox; default-src 'none'")
    assert page.client.get("/document/frame.report.html").status_code == 403
    assert page.client.get(f"/document/frame.site.toml?token={TOKEN}").status_code == 400
    (page.folder / "frame.report.html").write_text("of an earlier plan")
    assert not page.send("/api/found", path=SITE)["documents"][0]["is_of_plan"]
    asked = {"path": SITE, "suffix": ".exe"}
    refused = page.client.post("/api/document", json=asked, headers={"X-Bimvox-Token": TOKEN})
    assert refused.status_code == 400


@pytest.mark.parametrize("suffix", [".project.xml", ".4d.ifc"])
def test_a_schedule_is_made_and_downloaded(page: Page, suffix: str) -> None:
    job = page.send("/api/document", path=SITE, suffix=suffix)["job"]
    while (now := _get(page, f"/api/plan/{job}").json())["state"] == "running":
        pass
    assert (now["state"], now["page"]) == ("done", f"/document/frame{suffix}"), now
    (made,) = page.send("/api/found", path=SITE)["documents"]
    assert (made["name"], made["is_of_plan"]) == (f"frame{suffix}", True)
    got = page.client.get(f"{made['page']}?token={TOKEN}")
    assert got.content == (page.folder / f"frame{suffix}").read_bytes()
    assert got.headers["content-disposition"].startswith("attachment")
    assert {one["path"] for one in _files(page) if one["kind"] == "model"} == {"frame.ifc"}, "a schedule is no model"


@pytest.mark.slow
def test_while_a_plan_is_made_the_state_says_so_and_of_what(page: Page) -> None:
    job = page.send("/api/plan", path=SITE)["job"]
    found = page.state()
    moved = page.state(**page.crane(base_m=[-4.5, -4.0]))
    running = _get(page, f"/api/plan/{job}").json()["state"] == "running"
    assert running
    assert (found["state"], found["title"], found["changes"]) == ("working", "Plan being made", [])
    assert "Shown is the plan of" in found["words"]
    assert (moved["state"], moved["changes"]) == ("working", ["the crane (moved 0.50 m)"])
    while _get(page, f"/api/plan/{job}").json()["state"] == "running":
        pass
    assert page.changes() == []


@pytest.mark.slow
def test_the_last_revision_of_a_watch_is_found_again(page: Page) -> None:
    blocking = {"id": "truck", "box": {"min": [0, -8, 0], "max": [6, -5, 3]}}
    file = page.folder / OBSTRUCTIONS
    file.write_text(json.dumps({"version": 1, "obstructions": [blocking]}))
    events = watch(
        file,
        site=page.folder / SITE,
        out=page.folder / "frame.mcap",
        how=WatchWish(once=True),
        progress=SilentProgress(),
    )
    (event,) = events
    for anew in (page, Page(page.folder)):
        found = anew.state()
        counts, plan = found["counts"], found["plan"]
        assert found["state"] == "current"
        assert (counts["planned"], counts["refused"]) == (8 - len(event["infeasible"]), len(event["infeasible"]))
        assert [one["component"] for one in plan["refused"]] == event["infeasible"]
        assert sorted(plan["replanned"]) == sorted(event["replanned"])
        assert (counts["replanned"], counts["revision"]) == (len(event["replanned"]), 1)
        assert sorted(plan["retimed"]) == sorted(event["retimed"])
        assert plan["obstructions"] == ["truck"]
    assert [one["revision"] for one in page.send("/api/found", path=SITE)["revisions"]] == [0, 1]


def _get(page: Page, address: str) -> Any:
    return page.client.get(address, headers={"X-Bimvox-Token": TOKEN})


def _files(page: Page) -> Any:
    return _get(page, "/api/files").json()["files"]
