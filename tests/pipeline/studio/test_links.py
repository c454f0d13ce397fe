"""Nothing outside the studio's folder is read or written: not by a name, and not by a link in any place."""

from __future__ import annotations

import json
import shutil
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from bimvox_pipeline.studio.app import Studio, application
from planned_frame import copy_to
from starlette.testclient import TestClient

from bimvox.processes import python_module, run_to_end

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="links need a right there")

TOKEN = "a-token"
SECRET = '{"version": 1, "obstructions": [{"id": "secret", "box": {"min": [0, 0, 0], "max": [1, 1, 1]}}]}'
MINE = [{"id": "mine", "min": [0.0, 0.0, 0.0], "max": [1.0, 1.0, 1.0]}]


class Two:
    """A folder with a studio, and one outside it."""

    def __init__(self, tmp_path: Path) -> None:
        self.inside, self.outside = tmp_path / "inside", tmp_path / "outside"
        for folder in (self.inside, self.outside):
            folder.mkdir()
            copy_to(folder)
        (self.outside / "secret.json").write_text(SECRET)
        self.before = self.all_outside()
        self.client = TestClient(application(Studio(self.inside, TOKEN), 8000), base_url="http://127.0.0.1:8000")

    def all_outside(self) -> dict[str, bytes]:
        return {path.name: path.read_bytes() for path in self.outside.iterdir()}

    def link(self, name: str, to: str) -> None:
        place = self.inside / name
        if place.is_dir():
            shutil.rmtree(place)
        place.unlink(missing_ok=True)
        place.symlink_to(self.outside / to)

    def send(self, address: str, /, **asked: Any) -> Any:
        headers = {"X-Bimvox-Token": TOKEN}
        return self.client.post(address, json=asked, headers=headers) if asked else self.get(address)

    def get(self, address: str) -> Any:
        return self.client.get(address, headers={"X-Bimvox-Token": TOKEN})

    def opened(self, path: str = "frame.site.toml") -> Any:
        return self.send("/api/open", path=path).json()


@pytest.fixture
def two(tmp_path: Path) -> Two:
    return Two(tmp_path)


def opening(two: Two) -> Any:
    return two.send("/api/open", path="frame.site.toml")


def opening_the_model(two: Two) -> Any:
    return two.send("/api/open", path="frame.ifc")


def planning(two: Two) -> Any:
    return two.send("/api/plan", path="frame.site.toml")


def watching(two: Two) -> Any:
    return two.send("/api/watch", path="frame.site.toml", simulate=None)


def showing(two: Two) -> Any:
    return two.client.get(f"/page/frame.mcap?token={TOKEN}")


def reading(two: Two) -> Any:
    return two.get("/api/obstructions?path=frame.site.toml")


def placing(two: Two) -> Any:
    return two.send("/api/obstructions", path="frame.site.toml", obstructions=MINE)


@pytest.mark.parametrize(
    ("name", "to", "act"),
    [
        ("frame.site.toml", "frame.site.toml", opening),
        ("frame.site.toml", "frame.site.toml", opening_the_model),
        ("frame.ifc", "frame.ifc", opening),
        ("frame.ifc", "frame.ifc", opening_the_model),
        ("frame.mcap", "frame.mcap", planning),
        ("frame.mcap", "new.mcap", planning),
        ("frame.mcap", "frame.mcap", watching),
        ("frame.mcap", "frame.mcap", showing),
        ("frame.r0001.mcap", "frame.mcap", showing),
        ("frame.r0001.mcap", "new.mcap", watching),
        ("frame.obstructions.json", "secret.json", reading),
        ("frame.obstructions.json", "secret.json", placing),
        ("frame.obstructions.json", "new.json", placing),
        ("frame.obstructions.json", "secret.json", watching),
    ],
)
def test_a_link_that_leaves_the_folder_is_refused(two: Two, name: str, to: str, act: Callable[[Two], Any]) -> None:
    two.link(name, to)
    answer = act(two)
    assert answer.status_code == 400, answer.text
    assert "outside" in answer.json()["error"] + str(answer.json()["hint"])
    assert "secret" not in answer.text
    assert str(two.outside) not in answer.text
    assert two.all_outside() == two.before


@pytest.mark.parametrize("key", ["points", "mesh"])
@pytest.mark.parametrize("by_link", [False, True])
def test_a_file_that_an_obstruction_file_names_lies_in_the_folder(two: Two, key: str, by_link: bool) -> None:
    name = "scan.obj" if key == "mesh" else "scan.xyz"
    (two.outside / name).write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n" if key == "mesh" else "1 2 3\n")
    two.before = two.all_outside()
    if by_link:
        two.link(name, name)
    named = name if by_link else f"../outside/{name}"
    file = two.inside / "frame.obstructions.json"
    file.write_text(json.dumps({"version": 1, "obstructions": [{"id": "scan", key: named}]}))
    text = file.read_text()
    for act in (reading, placing):
        answer = act(two)
        assert answer.status_code == 400, answer.text
        assert "outside" in answer.json()["error"]
    assert file.read_text() == text


@pytest.mark.parametrize("named", ["../outside/frame.ifc", "linked/frame.ifc"])
def test_the_model_of_a_site_lies_in_the_folder(two: Two, named: str) -> None:
    two.link("linked", ".")
    site = two.inside / "frame.site.toml"
    site.write_text(site.read_text().replace('path = "frame.ifc"', f'path = "{named}"'))
    answer = opening(two)
    assert answer.status_code == 400
    assert "model.path" in answer.text
    assert "outside" in answer.json()["error"]


@pytest.mark.parametrize("to", ["frame.site.toml", "new.site.toml"])
def test_a_variant_is_not_written_through_a_link(two: Two, to: str) -> None:
    opened = two.opened()
    two.link("west.site.toml", to)
    answer = two.send("/api/variant", path="frame.site.toml", setup=opened["setup"], name="west")
    assert answer.status_code == 400
    assert two.all_outside() == two.before


def test_a_folder_that_becomes_a_link_after_a_site_was_opened_is_refused(two: Two) -> None:
    sub = two.inside / "sub"
    sub.mkdir()
    copy_to(sub)
    opened = two.opened("sub/frame.site.toml")
    two.link("sub", ".")
    crane = opened["setup"]["cranes"][0]
    setup = {**opened["setup"], "cranes": [{**crane, "base_m": [-6.0, -4.0]}]}
    for address, more in (
        ("/api/save", {"setup": setup, "sha256": opened["sha256"]}),
        ("/api/variant", {"setup": setup, "name": "west"}),
        ("/api/obstructions", {"obstructions": MINE}),
        ("/api/plan", {}),
    ):
        answer = two.send(address, path="sub/frame.site.toml", **more)
        assert answer.status_code == 400, address
    assert two.all_outside() == two.before


def test_a_link_that_is_made_between_check_and_write_is_refused(two: Two, monkeypatch: pytest.MonkeyPatch) -> None:
    opened = two.opened()
    from bimvox_pipeline.studio import saving

    def swapped(*given: Any) -> Any:
        two.link("frame.site.toml", "frame.site.toml")
        return True

    monkeypatch.setattr(saving, "unchanged", swapped)
    crane = opened["setup"]["cranes"][0]
    setup = {**opened["setup"], "cranes": [{**crane, "base_m": [-6.0, -4.0]}]}
    answer = two.send("/api/save", path="frame.site.toml", setup=setup, sha256=opened["sha256"])
    assert answer.status_code == 400
    assert two.all_outside() == two.before


def test_a_link_within_the_folder_is_followed(two: Two) -> None:
    (two.inside / "real").mkdir()
    (two.inside / "frame.ifc").rename(two.inside / "real" / "a.ifc")
    (two.inside / "frame.ifc").symlink_to(two.inside / "real" / "a.ifc")
    assert opening(two).status_code == 200


def test_a_loop_of_links_is_refused_in_a_sentence(two: Two) -> None:
    (two.inside / "loop.site.toml").symlink_to(two.inside / "loop.site.toml")
    for path in ("loop.site.toml", "a\ud800.ifc", "a" * 5000):
        answer = two.client.post("/api/open", content=json.dumps({"path": path}), headers={"X-Bimvox-Token": TOKEN})
        assert answer.status_code == 400, path


@pytest.mark.slow
@pytest.mark.parametrize(("name", "to"), [("frame.mcap", "new.mcap"), ("frame.ifc", "frame.ifc")])
def test_the_process_of_a_plan_looks_itself(two: Two, name: str, to: str) -> None:
    two.link(name, to)
    files = [str(two.inside / own) for own in ("frame.site.toml", "frame.mcap", "frame.obstructions.json")]
    done = run_to_end(python_module("bimvox_pipeline.studio.work", "plan", str(two.inside), *files, ""), 60.0)
    assert done is not None
    assert done.code == 1
    assert "leads out of the folder" in json.loads(done.out.splitlines()[-1])["error"]["error"]
    assert two.all_outside() == two.before
