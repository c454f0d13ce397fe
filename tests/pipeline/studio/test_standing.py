"""Whether the plan on disk is one of what a page shows."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

import pytest
from bimvox_pipeline.plan import plan
from bimvox_pipeline.studio.app import Studio, application
from planned_frame import copy_to
from starlette.testclient import TestClient

from bimvox.library.arguments import PolicyWish
from bimvox.progress import SilentProgress

TOKEN = "a-token"
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

    def standing(self, **setup: Any) -> Any:
        wanted = {**self.setup, **setup}
        return self.send("/api/standing", path=SITE, setup=wanted, sha256=self.opened["sha256"])

    def differs(self, **setup: Any) -> list[str]:
        plan = self.standing(**setup)["plan"]
        assert plan["is_current"] is not plan["differs"]
        assert plan["is_current"] == (not plan["differs"])
        found: list[str] = plan["differs"]
        return found

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
    found = page.standing()["plan"]
    assert found["is_current"]
    assert found["page"] == "/page/frame.mcap"
    assert found["planned"] == 8
    assert found["infeasible"] == []
    assert found["figures"]["crane_hours"] > 0
    assert found["time"]["crane_hours"] == pytest.approx(found["figures"]["crane_hours"])
    assert found["time"]["span_in_words"].startswith("day 1 07:00 to day 1 ")


def test_what_is_changed_on_the_screen_is_named_and_undone(page: Page) -> None:
    moved = page.crane(base_m=[-4.5, -4.0])
    assert page.differs(**moved) == ["the crane"]
    assert page.differs(truckload_kg=20000) == ["the rules"]
    yard = [[[x - 0.5, y] for x, y in polygon] for polygon in page.setup["yard"]]
    assert page.differs(yard=yard) == ["the areas"]
    zone = {"kind": "slow", "polygon": [[0, 0], [5, 0], [5, 5]], "share": 0.4}
    assert page.differs(zones=[zone]) == ["the zones"]
    first = page.opened["parts"][0]["id"]
    assert page.differs(means={**page.setup["means"], first: "by_hand"}) == ["how parts are set"]
    assert page.differs(yard=[]) == ["the set-up"]
    assert page.differs() == []


def test_a_crane_that_is_moved_saved_and_moved_back_is_planned_again(page: Page) -> None:
    back = page.setup
    moved = {**page.setup, **page.crane(base_m=[-4.5, -4.0])}
    page.opened |= page.send("/api/save", path=SITE, setup=moved, sha256=page.opened["sha256"])
    page.setup = moved
    assert page.differs() == ["the crane"]
    page.setup = back  # undone, not saved
    assert page.differs() == []
    page.opened |= page.send("/api/save", path=SITE, setup=back, sha256=page.opened["sha256"])
    assert page.differs() == []


@pytest.mark.slow
def test_rules_that_are_edited_on_disk_are_seen_and_then_named(page: Page) -> None:
    page.rewrite("# highest_utilisation = 0.85", "highest_utilisation = 0.9 ")
    assert page.differs() == ["the site file on disk"]
    page.opened = page.send("/api/open", path=SITE)
    assert page.differs() == ["the rules"]
    assert page.send("/api/standing", path=SITE)["plan"]["differs"] == ["the rules"]
    page.rewrite("highest_utilisation = 0.9 ", "# highest_utilisation = 0.85, and a comment is free ")
    page.opened = page.send("/api/open", path=SITE)
    assert page.differs() == []


def test_obstructions_of_another_program_are_seen(page: Page) -> None:
    file = page.folder / OBSTRUCTIONS
    assert page.standing()["obstructions_sha256"] is None
    file.write_text(json.dumps({"version": 1, "obstructions": []}))
    assert page.differs() == []
    seen = page.standing()["obstructions_sha256"]
    written = page.send("/api/obstructions", path=SITE, obstructions=[CRATE], sha256=seen)
    assert page.differs() == ["the obstructions"]
    assert page.standing()["obstructions_sha256"] == written["sha256"]
    made = plan(
        page.folder / SITE,
        page.folder / "frame.mcap",
        obstructions=file,
        wish=PolicyWish("none"),
        progress=SilentProgress(),
    )
    found = page.standing()["plan"]
    assert found["is_current"]
    assert len(found["infeasible"]) == len(made["infeasible"])
    mm = [{"id": "crate", "box": {key: [v * 1000 for v in CRATE[key]] for key in ("min", "max")}}]  # type: ignore[attr-defined]
    file.write_text(json.dumps({"version": 1, "unit": "mm", "obstructions": mm}))
    assert page.differs() == []  # the same in another unit
    file.write_text("{")
    assert page.differs() != []
    file.unlink()
    assert page.differs() == ["the obstructions"]


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="there are no pipes")
@pytest.mark.parametrize("name", [OBSTRUCTIONS, SITE, "frame.ifc"])
def test_a_pipe_in_the_place_of_a_file_is_refused_and_not_waited_for(page: Page, name: str) -> None:
    (page.folder / name).unlink(missing_ok=True)
    os.mkfifo(page.folder / name)
    for asked in ({"path": SITE}, {"path": SITE, "setup": page.setup, "sha256": page.opened["sha256"]}):
        answer = page.client.post("/api/standing", json=asked, headers={"X-Bimvox-Token": TOKEN})
        assert answer.status_code == 400
        assert answer.json()["error"] == f"{name}: cannot be read: this is a pipe, not a regular file"


@pytest.mark.slow
def test_a_plan_of_the_studio_is_of_the_obstructions_too(page: Page) -> None:
    page.send("/api/obstructions", path=SITE, obstructions=[CRATE])
    job = page.send("/api/plan", path=SITE)["job"]
    while (now := page.client.get(f"/api/plan/{job}", headers={"X-Bimvox-Token": TOKEN}).json())["state"] == "running":
        pass
    assert now["state"] == "done", now
    assert page.differs() == []


def test_another_variant_has_its_own_plan_or_none(page: Page) -> None:
    moved = {**page.setup, **page.crane(base_m=[-4.5, -4.0])}
    west = page.send("/api/variant", path=SITE, setup=moved, name="west")["path"]
    assert page.send("/api/standing", path=west)["plan"] is None
    (page.folder / "frame.mcap").rename(page.folder / "west.mcap")
    assert page.send("/api/standing", path=west)["plan"]["differs"] == ["the crane"]
    assert page.standing()["plan"] is None


def test_another_model_is_named(page: Page) -> None:
    model = page.folder / "frame.ifc"
    model.write_bytes(model.read_bytes().replace(b"Beam 2", b"Beam B"))
    assert page.differs() == ["the model on disk"]
    page.opened = page.send("/api/open", path=SITE)
    assert page.differs() == ["the model"]


def test_a_log_that_cannot_be_read_is_no_plan(page: Page) -> None:
    (page.folder / "frame.mcap").write_bytes(b"not a log")
    assert page.standing()["plan"] is None
