"""The studio's interface: sites opened, set-ups tried and saved, plans made; and who is refused."""

from __future__ import annotations

import json
import math
import os
import shutil
import time
from datetime import date
from pathlib import Path
from typing import Any

import pytest
from bimvox_pipeline.studio.app import Studio, application
from starlette.testclient import TestClient

import bimvox
from bimvox.proof.crane.axes import shares_of_capacity
from bimvox.site.config.file import load_site_config
from bimvox.site.lifting import hung_kg

SAMPLES = Path(__file__).parents[3] / "sample_models"
TOKEN = "a-token"
SITE = """# my site
[model]
path = "frame.ifc"   # the model
voxel_size_m = 0.25

[areas]
# the yard, measured by Ann
yard = [[[-2, -12], [14, -12], [14, -3], [-2, -3]]]
construction = [[-2, -2], [10, -2], [10, 9], [-2, 9]]

[crane]
base_m = [-6, -4]   # by the gate
machine = "flat-top-155"
"""


class Page:
    """The studio as its page has it."""

    def __init__(self, folder: Path) -> None:
        self.studio = Studio(folder, TOKEN)
        self.client = TestClient(application(self.studio, 8000), base_url="http://127.0.0.1:8000")

    def get(self, path: str, **headers: str) -> Any:
        return self.client.get(path, headers={"X-Bimvox-Token": TOKEN, **headers})

    def post(self, address: str, /, **asked: Any) -> Any:
        return self.client.post(address, json=asked, headers={"X-Bimvox-Token": TOKEN})

    def ok(self, address: str, /, **asked: Any) -> dict[str, Any]:
        answer = self.post(address, **asked)
        assert answer.status_code == 200, answer.text
        found: dict[str, Any] = answer.json()
        return found

    def open(self, path: str = "a.site.toml") -> dict[str, Any]:
        return self.ok("/api/open", path=path)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for name in ("frame.ifc", "frame_georeferenced.ifc"):
        shutil.copy(SAMPLES / name, tmp_path)
    (tmp_path / "a.site.toml").write_text(SITE)
    return tmp_path


@pytest.fixture
def page(folder: Path) -> Page:
    return Page(folder)


def moved(setup: dict[str, Any], **crane: Any) -> dict[str, Any]:
    return {**setup, "cranes": [{**setup["cranes"][0], **crane}, *setup["cranes"][1:]]}


def test_the_files_of_the_folder_are_listed_and_no_others(page: Page, folder: Path):
    (folder / "notes.txt").write_text("")
    (folder / ".hidden.ifc").write_text("")
    (folder / "sub").mkdir()
    shutil.copy(SAMPLES / "yard.glb", folder / "sub")
    found = page.get("/api/files").json()
    assert found["folder"] == folder.name
    assert [(one["path"], one["kind"]) for one in found["files"]] == [
        ("a.site.toml", "site"),
        ("frame.ifc", "model"),
        ("frame_georeferenced.ifc", "model"),
        ("sub/yard.glb", "model"),
    ]


def test_a_site_opens_with_its_own_values(page: Page):
    found = page.open()
    assert (found["path"], found["exists"]) == ("a.site.toml", True)
    (crane,) = found["setup"]["cranes"]
    assert (crane["machine"], crane["base_m"]) == ("flat-top-155", [-6.0, -4.0])
    assert found["setup"]["yard"] == [[[-2, -12], [14, -12], [14, -3], [-2, -3]]]
    site = bimvox.load_site(page.studio.folder.root / "a.site.toml")
    parts = {part["id"]: part for part in found["parts"]}
    assert parts.keys() == {one.id for one in site.components}
    for one in site.components:
        low, high = one.mesh.bounds_m
        assert parts[one.id]["mass_kg"] == pytest.approx(one.mass_kg, abs=0.1)
        assert (parts[one.id]["low_m"], parts[one.id]["top_m"]) == pytest.approx((low[2], high[2]), abs=1e-3)
        xs, ys = zip(*parts[one.id]["hull"], strict=True)
        assert (min(xs), min(ys), max(xs), max(ys)) == pytest.approx((*low[:2], *high[:2]), abs=2e-3)


def test_a_model_without_a_site_file_opens_as_init_guesses_it_and_writes_nothing(page: Page, folder: Path):
    before = sorted(path.name for path in folder.iterdir())
    found = page.open("frame.ifc")
    assert (found["path"], found["exists"], found["sha256"]) == ("frame.site.toml", False, None)
    guessed = bimvox.guess_site(bimvox.read(folder / "frame.ifc")).config
    assert found["setup"]["cranes"][0]["machine"] == guessed.one_crane.machine
    assert found["setup"]["cranes"][0]["base_m"] == list(guessed.one_crane.base_m[:2])
    assert sorted(path.name for path in folder.iterdir()) == before


@pytest.mark.slow
def test_the_share_of_the_chart_is_at_most_that_of_the_planned_lift(page: Page, folder: Path):
    opened = page.open()
    tried = page.ok("/api/try", path="a.site.toml", setup=opened["setup"])
    assert tried["problems"] == []
    plan = bimvox.plan(bimvox.load_site(folder / "a.site.toml"))
    table = plan.record
    site, motions = table.plan.site, {motion.component: motion for motion in table.motions}
    assert tried["served"] == tried["of"] == len(motions)
    for part in site.components:
        crane, motion = site.cranes[part.crane], motions[part.index]
        planned = shares_of_capacity(crane, motion.loaded.slew_rad, motion.loaded.radius_m, hung_kg(crane, part))
        found = tried["parts"][part.id]
        assert found["utilisation"] <= planned.max() + 0.01
        set_m = float(motion.loaded.radius_m[-1])
        assert found["radius_m"] == pytest.approx(set_m, abs=0.05)


def test_a_crane_that_stands_far_away_says_why_it_lifts_nothing(page: Page):
    setup = moved(page.open()["setup"], base_m=[-300.0, 0.0])
    found = page.ok("/api/try", path="a.site.toml", setup=setup)
    assert found["served"] == 0
    assert all("flat-top-155 reaches" in part["reason"] for part in found["parts"].values())


def test_problems_of_places_are_said(page: Page):
    setup = page.open()["setup"]
    setup = moved(setup, base_m=[0.2, 0.2]) | {"yard": [[[-2, -2], [14, -2], [14, 8], [-2, 8]]]}
    found = " ".join(page.ok("/api/try", path="a.site.toml", setup=setup)["problems"])
    assert "stands at the place of" in found
    assert "lies on the construction area" in found
    low = page.ok("/api/try", path="a.site.toml", setup=moved(page.open()["setup"], height_m=7.0))
    assert "to carry every part over" in " ".join(low["problems"])


def test_a_part_below_a_closed_zone_is_not_lifted(page: Page):
    opened = page.open()
    part = opened["parts"][0]
    zone = {"kind": "prohibited", "name": "school", "polygon": [[x + d, y + e] for x, y, d, e in _around(part)]}
    found = page.ok("/api/try", path="a.site.toml", setup={**opened["setup"], "zones": [zone]})
    assert "zone school" in found["parts"][part["id"]]["reason"]


def _around(part: dict[str, Any]) -> list[tuple[float, float, float, float]]:
    xs, ys = zip(*part["hull"], strict=True)
    x, y = (min(xs) + max(xs)) / 2, (min(ys) + max(ys)) / 2
    return [(x, y, -9, -9), (x, y, 9, -9), (x, y, 9, 9), (x, y, -9, 9)]


def test_a_part_set_by_hand_is_not_asked_of_the_crane(page: Page):
    opened = page.open()
    name = opened["parts"][0]["id"]
    found = page.ok("/api/try", path="a.site.toml", setup={**opened["setup"], "means": {name: "by_hand"}})
    assert found["of"] == len(opened["parts"]) - 1
    assert found["parts"][name] == {"utilisation": None, "radius_m": None, "crane": None, "reason": None}


def test_saving_changes_what_was_moved_and_keeps_the_rest(page: Page, folder: Path):
    opened = page.open()
    name = opened["parts"][0]["id"]
    setup = moved(opened["setup"], base_m=[-6.5, -4.0]) | {"means": {**opened["setup"]["means"], name: "by_hand"}}
    setup["zones"] = [{"kind": "slow", "polygon": [[0, 0], [5, 0], [5, 5]], "share": 0.4}]
    saved = page.ok("/api/save", path="a.site.toml", setup=setup, sha256=opened["sha256"])
    text = (folder / "a.site.toml").read_text()
    for kept in ("# my site", "# the model", "# the yard, measured by Ann", "# by the gate"):
        assert kept in text
    assert text.startswith(SITE.split("[crane]")[0])
    assert set(saved["changed"]) == {"crane.base_m", "zone", "component[0].means"}
    config = load_site_config(folder / "a.site.toml")
    assert config.one_crane.base_m == (-6.5, -4.0)
    assert config.zone[0].share == 0.4
    assert (config.component[0].global_id, config.component[0].means) == (name, "by_hand")
    again = page.open()
    assert again["sha256"] == saved["sha256"]
    assert again["setup"]["cranes"][0]["base_m"] == [-6.5, -4.0]
    assert again["setup"]["means"][name] == "by_hand"
    nothing = page.ok("/api/save", path="a.site.toml", setup=again["setup"], sha256=again["sha256"])
    assert nothing["changed"] == []
    assert (folder / "a.site.toml").read_text() == text


def test_the_reason_of_init_goes_when_a_person_says_otherwise(page: Page, folder: Path):
    name = page.open()["parts"][0]["id"]
    path = folder / "a.site.toml"
    entry = f'\n[[component]]\nglobal_id = "{name}"\nmeans = "in_situ"\nwhy = "no usual crane lifts it"\n'
    path.write_text(path.read_text() + entry)
    opened = page.open()
    setup = {**opened["setup"], "means": {**opened["setup"]["means"], name: "by_hand"}}
    saved = page.ok("/api/save", path="a.site.toml", setup=setup, sha256=opened["sha256"])
    assert saved["changed"] == ["component[0].means", "component[0].why"]
    assert "no usual crane" not in path.read_text()


def test_the_ground_is_shown_with_its_reason_and_set_by_hand(page: Page, folder: Path):
    opened = page.open()
    assert opened["setup"]["ground_m"] == 0.0
    assert opened["ground_why"] == "the lowest part of the model"
    lower = {**opened["setup"], "ground_m": -1.5}
    assert page.ok("/api/try", path="a.site.toml", setup=lower)["served"] == 8
    page.ok("/api/save", path="a.site.toml", setup=lower, sha256=opened["sha256"])
    text = (folder / "a.site.toml").read_text()
    assert "ground_m = -1.5" in text
    assert "# the yard, measured by Ann" in text
    again = page.open()
    assert again["setup"]["ground_m"] == -1.5
    assert again["ground_why"] == "", "it is no longer what the model says"
    assert again["parts"][0]["low_m"] == opened["parts"][0]["low_m"] + 1.5


def test_the_first_day_and_the_shifts_are_set_by_hand(page: Page, folder: Path):
    opened = page.open()
    given = opened["setup"]["calendar"]
    assert given == {"start": None, "days": ["Mon", "Tue", "Wed", "Thu", "Fri"], "shifts": ["07:00-16:00"]}
    wanted = {"start": "2026-12-07", "days": ["Mon", "Sat"], "shifts": ["07:00-12:00", "13:00-17:00"]}
    setup = {**opened["setup"], "calendar": wanted}
    saved = page.ok("/api/save", path="a.site.toml", setup=setup, sha256=opened["sha256"])
    assert set(saved["changed"]) >= {"calendar.start", "calendar.days", "calendar.shifts"}
    calendar = load_site_config(folder / "a.site.toml").calendar
    assert (calendar.start, calendar.days) == (date(2026, 12, 7), ("Mon", "Sat"))
    assert "start = 2026-12-07" in (folder / "a.site.toml").read_text()
    again = page.open()
    assert again["setup"]["calendar"] == wanted
    setup = {**again["setup"], "calendar": {**wanted, "start": None}}
    saved = page.ok("/api/save", path="a.site.toml", setup=setup, sha256=again["sha256"])
    assert saved["changed"] == ["calendar.start"]
    assert page.open()["setup"]["calendar"]["start"] is None
    for wrong in ({"shifts": ["7 to 8"]}, {"days": ["Someday"]}, {"start": "soon"}, {"shifts": []}):
        answer = page.post("/api/try", path="a.site.toml", setup={**setup, "calendar": {**given, **wrong}})
        assert answer.status_code == 400, wrong


@pytest.mark.slow
def test_another_machine_gets_jib_and_height_of_its_own(page: Page, folder: Path):
    opened = page.open()
    setup = moved(opened["setup"], machine="hammerhead-75", jib_m=None, falls=None)
    page.ok("/api/save", path="a.site.toml", setup=setup, sha256=opened["sha256"])
    crane = load_site_config(folder / "a.site.toml").one_crane
    assert (crane.machine, crane.base_m) == ("hammerhead-75", (-6.0, -4.0)), "it stands on the ground, however high"
    assert bimvox.load_site(folder / "a.site.toml").cranes[0].name == "hammerhead-75"
    again = page.open()["setup"]["cranes"][0]
    jibs = next(one["jibs_m"] for one in opened["machines"] if one["name"] == "hammerhead-75")
    assert again["jib_m"] == max(jibs)
    setup = moved(page.open()["setup"], jib_m=min(jibs), height_m=31.5)
    saved = page.ok("/api/save", path="a.site.toml", setup=setup, sha256=page.open()["sha256"])
    assert set(saved["changed"]) == {"crane.jib_length_m", "crane.jib_height_m"}
    crane = bimvox.load_site(folder / "a.site.toml").cranes[0]
    assert (crane.jib_length_m, crane.jib_height_m) == (min(jibs), 31.5)


@pytest.mark.slow
@pytest.mark.parametrize("machine", ["luffing", "mobile"])
def test_a_machine_of_another_kind_can_be_chosen(page: Page, folder: Path, machine: str):
    opened = page.open()
    name = next(one["name"] for one in opened["machines"] if one["kind"] == machine)
    setup = moved(opened["setup"], machine=name, jib_m=None, falls=None)
    assert page.ok("/api/try", path="a.site.toml", setup=setup)["of"] == len(opened["parts"])
    page.ok("/api/save", path="a.site.toml", setup=setup, sha256=opened["sha256"])
    assert bimvox.load_site(folder / "a.site.toml").cranes[0].name == name
    back = moved(page.open()["setup"], machine="flat-top-155", jib_m=None, falls=None)
    page.ok("/api/save", path="a.site.toml", setup=back, sha256=page.open()["sha256"])
    assert bimvox.load_site(folder / "a.site.toml").cranes[0].name == "flat-top-155"


def test_a_file_that_was_changed_meanwhile_is_not_overwritten(page: Page, folder: Path):
    opened = page.open()
    (folder / "a.site.toml").write_text(SITE + "# by somebody else\n")
    setup = moved(opened["setup"], base_m=[-7.0, -4.0])
    answer = page.post("/api/save", path="a.site.toml", setup=setup, sha256=opened["sha256"])
    assert answer.status_code == 409
    assert "changed since" in answer.json()["error"]
    assert (folder / "a.site.toml").read_text().endswith("# by somebody else\n")
    assert page.post("/api/save", path="a.site.toml", setup=setup, sha256="0").status_code == 409


def test_a_new_site_file_is_that_of_init_with_what_was_set(page: Page, folder: Path):
    opened = page.open("frame.ifc")
    setup = moved(opened["setup"], base_m=[-7.5, -5.0])
    saved = page.ok("/api/save", path=opened["path"], setup=setup, sha256=None)
    assert saved["path"] == "frame.site.toml"
    text = (folder / "frame.site.toml").read_text()
    assert text.startswith("# Site file of bimvox")
    assert load_site_config(folder / "frame.site.toml").one_crane.base_m[:2] == (-7.5, -5.0)
    assert page.open("frame.ifc")["setup"]["cranes"][0]["base_m"] == [-7.5, -5.0]


def test_a_variant_is_a_file_beside_and_never_replaces_one(page: Page, folder: Path):
    opened = page.open()
    setup = moved(opened["setup"], base_m=[-8.0, -4.0])
    saved = page.ok("/api/variant", path="a.site.toml", setup=setup, name="west side")
    assert saved["path"] == "west side.site.toml"
    assert load_site_config(folder / saved["path"]).one_crane.base_m == (-8.0, -4.0)
    assert (folder / "a.site.toml").read_text() == SITE
    for name in ("west side", "../outside", "", ".hidden", "a\0b", 5):
        answer = page.post("/api/variant", path="a.site.toml", setup=setup, name=name)
        assert answer.status_code == 400, name
        assert answer.json()["error"]


@pytest.mark.parametrize(
    "name", [" .hidden", "a\nb", "\u202elmot", "\x7f", "..", ".", "../b", "a/b", "\t", 7, None, ["b"]]
)
def test_a_variant_has_a_name_that_people_can_read(page: Page, folder: Path, name: object):
    before = sorted(path.name for path in folder.iterdir())
    answer = page.post("/api/variant", path="a.site.toml", name=name, setup=page.open()["setup"])
    assert answer.status_code == 400
    assert answer.json()["error"] == "a variant needs a name of its own"
    assert sorted(path.name for path in folder.iterdir()) == before


def test_true_is_no_number(page: Page):
    setup = page.open()["setup"]
    answer = page.post("/api/picture", path="a.site.toml", setup=setup, turn_deg=True)
    assert (answer.status_code, answer.json()["error"]) == (400, "turn_deg is an angle in degrees")
    answer = page.post("/api/watch", path="a.site.toml", simulate=True)
    assert answer.status_code == 400
    assert answer.json()["error"].startswith("simulate is how many times")


def test_the_root_of_the_machine_is_named(page: Page):
    root = Path(Path().resolve().anchor)
    assert page.post("/api/open", path=str(root)).json()["error"] == f"{root} is outside the folder of the studio"


def test_a_file_in_map_coordinates_stays_in_them(page: Page, folder: Path):
    opened = page.open("frame_georeferenced.ifc")
    frame = opened["map"]
    assert frame is not None

    def on_map(at: list[float]) -> list[float]:
        turn = math.radians(frame["x_axis_deg"])
        x, y = at
        east = frame["eastings_m"] + x * math.cos(turn) - y * math.sin(turn)
        return [east, frame["northings_m"] + x * math.sin(turn) + y * math.cos(turn)]

    setup = opened["setup"]
    yard = [[on_map(at) for at in polygon] for polygon in setup["yard"]]
    base = on_map(setup["cranes"][0]["base_m"])
    machine = setup["cranes"][0]["machine"]
    (folder / "m.site.toml").write_text(
        f'coordinates = "map"\n[model]\npath = "frame_georeferenced.ifc"\n[areas]\nyard = {yard}\n'
        f'[crane]\nmachine = "{machine}"\nbase_m = {base}\n'
    )
    opened = page.open("m.site.toml")
    assert opened["setup"]["cranes"][0]["base_m"] == pytest.approx(setup["cranes"][0]["base_m"], abs=2e-3)
    x, y = opened["setup"]["cranes"][0]["base_m"]
    wanted = moved(opened["setup"], base_m=[x + 1.0, y])
    page.ok("/api/save", path="m.site.toml", setup=wanted, sha256=opened["sha256"])
    given = load_site_config(folder / "m.site.toml")
    assert given.coordinates == "map"
    assert list(given.one_crane.base_m[:2]) == pytest.approx(on_map([x + 1.0, y]), abs=2e-3)


def test_impossible_set_ups_are_refused_in_a_sentence(page: Page, folder: Path):
    opened = page.open()
    good = opened["setup"]
    for setup in (
        None,
        {"cranes": []},
        moved(good, machine="no-such-crane"),
        moved(good, base_m=[1]),
        moved(good, base_m=[float(10**9), 0.0]) | {"yard": []},
        {**good, "yard": []},
        {**good, "yard": [[[0, 0], [1, 1]]]},
        {**good, "zones": [{"kind": "moat", "polygon": [[0, 0], [1, 0], [1, 1]]}]},
        {**good, "zones": [{"kind": "limiter", "polygon": [[0, 0], [1, 0], [1, 1]]}]},
        moved(good, machine="hammerhead-75", jib_m=12.3),
        moved(good, machine="hammerhead-75", falls=9),
        {**good, "means": {opened["parts"][0]["id"]: "by_magic"}},
    ):
        answer = page.post("/api/try", path="a.site.toml", setup=setup)
        assert answer.status_code == 400, (setup, answer.text[:300])
        assert len(answer.json()["error"]) > 10
    assert (folder / "a.site.toml").read_text() == SITE


def test_a_broken_site_file_says_what_is_wrong(page: Page, folder: Path):
    (folder / "b.site.toml").write_text(SITE.replace("voxel_size_m = 0.25", "voxel_size_m = -1"))
    answer = page.post("/api/open", path="b.site.toml")
    assert answer.status_code == 400
    assert answer.json()["where"] == "model.voxel_size_m"
    assert page.post("/api/open", path="missing.site.toml").status_code == 400
    (folder / "c.ifc").write_bytes(b"garbage")
    assert page.post("/api/open", path="c.ifc").status_code == 400


def test_nothing_outside_the_folder_is_read_or_written(
    page: Page, folder: Path, tmp_path_factory: pytest.TempPathFactory
):
    outside = tmp_path_factory.mktemp("outside")
    (outside / "secret.site.toml").write_text(SITE)
    shutil.copy(SAMPLES / "frame.ifc", outside)
    if hasattr(os, "symlink"):
        (folder / "link.site.toml").symlink_to(outside / "secret.site.toml")
    for path in (
        "../" + outside.name + "/secret.site.toml",
        str(outside / "secret.site.toml"),
        "link.site.toml",
        "",
        None,
        7,
        "a\0b",
    ):
        answer = page.post("/api/open", path=path)
        assert answer.status_code == 400, path
    assert page.get(f"/page/../{outside.name}/x.mcap?token={TOKEN}").status_code in (400, 404)
    assert all("link" not in one["path"] for one in page.get("/api/files").json()["files"])


@pytest.mark.parametrize(
    ("headers", "status"),
    [
        ({}, 200),
        ({"X-Bimvox-Token": "another"}, 403),
        ({"X-Bimvox-Token": ""}, 403),
        ({"Host": "evil.example"}, 403),
        ({"Host": "127.0.0.1:9999"}, 403),
        ({"Host": "localhost:8000"}, 200),
        ({"Origin": "http://evil.example"}, 403),
        ({"Origin": "null"}, 403),
        ({"Origin": "http://127.0.0.1:8000"}, 200),
    ],
)
def test_only_its_own_page_is_answered(page: Page, headers: dict[str, str], status: int):
    answer = page.get("/api/files", **headers)
    assert answer.status_code == status
    assert answer.headers["cache-control"] == "no-store"
    if status != 200:
        assert answer.json()["error"]


def test_a_second_origin_does_not_hide_behind_the_first(page: Page):
    headers = [("X-Bimvox-Token", TOKEN), ("Origin", "http://127.0.0.1:8000"), ("Origin", "http://evil.example")]
    assert page.client.get("/api/files", headers=headers[:2]).status_code == 200
    assert page.client.get("/api/files", headers=headers).status_code == 403


def test_the_frame_needs_the_token_and_its_files_do_not(page: Page):
    assert page.client.get("/").status_code == 403
    assert page.client.get("/?token=wrong").status_code == 403
    frame = page.client.get(f"/?token={TOKEN}")
    assert frame.status_code == 200
    assert "default-src 'none'" in frame.headers["content-security-policy"]
    assert "unsafe" not in frame.headers["content-security-policy"]
    assert page.client.get("/web/studio/main.mjs").status_code == 200
    assert page.client.get("/web/studio/../../../../pyproject.toml").status_code in (403, 404)
    assert page.client.get("/web/page/assets.py").status_code == 404


@pytest.mark.parametrize("body", [b"", b"{", b"[1]", b"\xff\xfe", b"[" * 100_000])
def test_garbled_requests_are_refused(page: Page, body: bytes):
    answer = page.client.post("/api/open", content=body, headers={"X-Bimvox-Token": TOKEN})
    assert answer.status_code == 400
    assert answer.json()["error"]


def test_a_huge_request_is_refused(page: Page):
    answer = page.client.post("/api/open", content=b" " * (9 << 20), headers={"X-Bimvox-Token": TOKEN})
    assert answer.status_code == 413


def finished(page: Page, job: str) -> dict[str, Any]:
    for _ in range(600):
        found: dict[str, Any] = page.get(f"/api/plan/{job}").json()
        if found["state"] != "running":
            return found
        time.sleep(0.1)
    raise AssertionError("the plan does not end")


def test_a_plan_is_made_beside_its_site_and_shown(page: Page, folder: Path):
    job = page.ok("/api/plan", path="a.site.toml")["job"]
    assert page.post("/api/plan", path="a.site.toml").status_code == 400
    found = finished(page, job)
    assert found["state"] == "done", found
    assert found["page"] == "/page/a.mcap"
    assert found["document"]["verified"] is True
    assert found["document"]["log"] == "a.mcap"
    assert str(folder.parent) not in str(found)
    assert bimvox.verify(folder / "a.mcap").verified
    shown = page.client.get(f"/page/a.mcap?token={TOKEN}")
    assert shown.status_code == 200
    assert shown.content.lower().startswith(b"<!doctype html>")
    assert page.client.get("/page/a.mcap").status_code == 403
    assert page.get("/api/plan/77").status_code == 400


@pytest.mark.slow
def test_a_cancelled_plan_leaves_nothing(page: Page, folder: Path):
    shutil.copy(SAMPLES / "prefab.ifc", folder)
    opened = page.open("prefab.ifc")
    page.ok("/api/save", path=opened["path"], setup=opened["setup"], sha256=None)
    before = sorted(path.name for path in folder.iterdir())
    job = page.ok("/api/plan", path="prefab.site.toml")["job"]
    answer = page.client.delete(f"/api/plan/{job}", headers={"X-Bimvox-Token": TOKEN})
    assert answer.json()["state"] == "cancelled"
    assert finished(page, job)["state"] == "cancelled"
    assert sorted(path.name for path in folder.iterdir()) == before


@pytest.mark.slow
def test_a_plan_that_fails_says_why(page: Page, folder: Path):
    (folder / "far.site.toml").write_text(SITE.replace("[-6, -4]", "[-300, -4]"))
    found = finished(page, page.ok("/api/plan", path="far.site.toml")["job"])
    assert found["state"] == "failed"
    assert "no lift can be planned" in found["error"]
    assert not (folder / "far.mcap").exists()


def test_boxes_are_written_and_what_is_no_box_stays(page: Page, folder: Path):
    where = "/api/obstructions?path=a.site.toml"
    assert page.get(where).json() == {"file": "a.obstructions.json", "obstructions": [], "others": 0}
    pole = {"id": "pole", "cylinder": {"base": [1000.0, 2000.0, 0.0], "radius": 300.0, "height": 5000.0}}
    truck = {"id": "truck", "box": {"min": [0.0, 0.0, 0.0], "max": [2500.0, 6000.0, 3000.0]}}
    (folder / "a.obstructions.json").write_text(json.dumps({"version": 1, "unit": "mm", "obstructions": [pole, truck]}))
    found = page.get(where).json()
    assert found["others"] == 1
    assert found["obstructions"] == [{"id": "truck", "min": [0.0, 0.0, 0.0], "max": [2.5, 6.0, 3.0]}]
    crate = {"id": "crate", "min": [1.0, 1.0, 0.0], "max": [2.0, 2.5, 1.25]}
    now = page.ok("/api/obstructions", path="a.site.toml", obstructions=[crate], sha256=found["sha256"])
    assert now["obstructions"] == [crate]
    written = json.loads((folder / "a.obstructions.json").read_text())
    assert (written["unit"], written["obstructions"][0]) == ("mm", pole)
    assert written["obstructions"][1]["box"]["max"] == [2000.0, 2500.0, 1250.0]
    text = (folder / "a.obstructions.json").read_text()
    for bad in ([crate, crate], [{**crate, "max": [0.0, 0.0, 0.0]}], [{**crate, "id": "ground"}], [{"id": "x"}], 5):
        answer = page.post("/api/obstructions", path="a.site.toml", obstructions=bad, sha256=now["sha256"])
        assert answer.status_code == 400, bad
        assert answer.json()["error"]
    assert (folder / "a.obstructions.json").read_text() == text


def test_obstructions_that_the_page_has_not_seen_are_not_overwritten(page: Page, folder: Path):
    crate = {"id": "crate", "min": [1.0, 1.0, 0.0], "max": [2.0, 2.5, 1.25]}
    page.ok("/api/obstructions", path="a.site.toml", obstructions=[crate])
    text = (folder / "a.obstructions.json").read_text()
    answer = page.post("/api/obstructions", path="a.site.toml", obstructions=[])
    assert answer.status_code == 409
    assert answer.json()["obstructions"] == []
    assert (folder / "a.obstructions.json").read_text() == text


def test_what_is_called_a_site_file_and_is_none_is_refused_before_anything_is_written(page: Page, folder: Path):
    (folder / "d.site.toml").mkdir()
    (folder / "empty.site.toml").touch()
    names = ["d.site.toml", "empty.site.toml"]
    if hasattr(os, "mkfifo"):
        os.mkfifo(folder / "pipe.site.toml")
        names.append("pipe.site.toml")
    before = sorted(path.name for path in folder.iterdir())
    for name in names:
        for address, more in (("/api/plan", {}), ("/api/watch", {}), ("/api/obstructions", {"obstructions": []})):
            answer = page.post(address, path=name, **more)
            assert answer.status_code == 400, (address, name)
            assert answer.json()["error"].startswith(f"{name}: ")
    assert sorted(path.name for path in folder.iterdir()) == before


def news(page: Page, number: str, after: int) -> dict[str, Any]:
    """Return the next news that have an event, or tell of the end."""
    for _ in range(60):
        found: dict[str, Any] = page.get(f"/api/watch/{number}?after={after}").json()
        if found["events"] or found["state"] in ("ended", "failed"):
            return found
    raise AssertionError("nothing happens")


@pytest.mark.slow
def test_a_watch_replans_what_a_dropped_box_is_in_the_way_of(page: Page, folder: Path):
    number = page.ok("/api/watch", path="a.site.toml", simulate=None)["watch"]
    assert page.post("/api/plan", path="a.site.toml").status_code == 400
    first = news(page, number, 0)
    assert first["state"] == "running", first
    assert str(folder.parent) not in str(first)
    lifts = bimvox.read_log(folder / "a.mcap").lifts
    x, y, z = lifts[-1].path_m[len(lifts[-1].path_m) // 2]
    box = {"id": "scaffold", "min": [x - 0.5, y - 0.5, 0.0], "max": [x + 0.5, y + 0.5, z + 0.5]}
    page.ok("/api/obstructions", path="a.site.toml", obstructions=[box])
    second = news(page, number, first["next"])
    (event,) = second["events"]
    assert event["revision"] == 1
    assert lifts[-1].component.id in event["replanned"] + event["infeasible"]
    assert second["page"] == "/page/a.mcap"
    (folder / "a.obstructions.json").write_text("{")
    third = news(page, number, second["next"])
    assert third["events"][0]["event"] == "rejected"
    assert str(folder.parent) not in str(third)
    ended = page.client.delete(f"/api/watch/{number}", headers={"X-Bimvox-Token": TOKEN}).json()
    assert ended["state"] == "ended"
    assert bimvox.verify(folder / "a.mcap").verified
    assert page.get(f"/api/watch/{number}?after=x").status_code == 400
    assert page.post("/api/watch", path="a.site.toml", simulate="fast").status_code == 400


@pytest.mark.slow
def test_a_watch_that_carries_the_plan_out_tells_the_time_and_the_states(page: Page, folder: Path):
    number = page.ok("/api/watch", path="a.site.toml", simulate=5000)["watch"]
    events, lifts = [], set()
    while not any(event.get("state") == "assembled" for event in events):
        found = news(page, number, len(events))
        assert found["state"] == "running", found
        events += found["events"]
    lifts = {lift.component.id for lift in bimvox.read_log(folder / "a.mcap").lifts}
    (clock,) = [event for event in events if event["event"] == "clock"]
    assert clock == {"event": "clock", "time_s": 0.0, "speed": 5000.0}
    states = [event for event in events if event["event"] == "state"]
    assert {state["component"] for state in states} <= lifts
    assert events.index(clock) < events.index(states[0])
    page.client.delete(f"/api/watch/{number}", headers={"X-Bimvox-Token": TOKEN})


@pytest.mark.slow
def test_a_watch_that_cannot_begin_says_why(page: Page, folder: Path):
    (folder / "far.site.toml").write_text(SITE.replace("[-6, -4]", "[-300, -4]"))
    found = news(page, page.ok("/api/watch", path="far.site.toml")["watch"], 0)
    assert str(folder.parent) not in str(found)
    assert found["state"] == "failed" or found["events"][0]["event"] in ("failed", "rejected"), found
    assert "no lift can be planned" in str(found)


def test_a_fault_is_said_and_the_studio_goes_on(page: Page, monkeypatch: pytest.MonkeyPatch):
    def broken(_: Any) -> None:
        raise RuntimeError("a wheel came off")

    with monkeypatch.context() as patched:
        patched.setattr(page.studio.folder, "path", broken)
        answer = page.post("/api/open", path="a.site.toml")
    assert answer.status_code == 500
    assert "a wheel came off" in answer.json()["error"]
    assert page.open()["exists"]


def test_a_set_up_is_drawn_from_the_side_that_is_asked_for(page: Page, folder: Path):
    setup = page.open()["setup"]
    first = page.post("/api/picture", path="a.site.toml", setup=setup)
    assert first.status_code == 200
    assert first.headers["content-type"] == "image/png"
    assert first.content.startswith(b"\x89PNG")
    assert page.post("/api/picture", path="a.site.toml", setup=setup).content == first.content
    assert page.post("/api/picture", path="a.site.toml", setup=setup, turn_deg=30).content != first.content
    ground = json.loads(first.headers["X-Bimvox-Ground"])
    assert len(ground["corners"]) == len(setup["construction"])
    for x, y, aside, up in ground["corners"]:
        assert 0.0 < x < ground["size"][0]
        assert 0.0 < y < ground["size"][1]
        assert up < -2.0 * abs(aside), "a metre up is up in the picture"
    there = moved(setup, base_m=[-9.0, 3.0])
    assert page.post("/api/picture", path="a.site.toml", setup=there).content != first.content
    inside = page.post("/api/picture", path="a.site.toml", setup=moved(setup, base_m=[0.2, 0.2]))
    assert inside.status_code == 400
    assert "mast" in inside.json()["error"]
    assert page.post("/api/picture", path="a.site.toml", setup=setup, turn_deg="north").status_code == 400


def test_a_jib_that_would_hit_the_other_mast_is_a_problem(page: Page, folder: Path):
    for name in ("hall.ifc", "hall.site.toml"):
        shutil.copy(SAMPLES / name, folder)
    setup = page.open("hall.site.toml")["setup"]
    assert page.ok("/api/try", path="hall.site.toml", setup=setup)["problems"] == []
    (x, y), other = setup["cranes"][1]["base_m"], setup["cranes"][1]
    closer = {**setup, "cranes": [{**setup["cranes"][0], "base_m": [x + 1.0, y]}, other]}
    assert "masts of" in " ".join(page.ok("/api/try", path="hall.site.toml", setup=closer)["problems"])


def another(**crane: Any) -> dict[str, Any]:
    return {"name": "Crane 2", "machine": "hammerhead-30", "base_m": [18.0, 4.0], "jib_m": 18.0, **crane}


@pytest.mark.slow
def test_a_second_crane_is_tried_saved_planned_and_removed_again(page: Page, folder: Path):
    file = folder / "a.site.toml"
    file.write_text(SITE + "  [crane.override]\n  hook_block_kg = 400  # weighed\n\n[calendar]\nstart = 2027-03-01\n")
    opened = page.open()
    setup = opened["setup"]
    one = {**setup["cranes"][0], "name": "Crane 1"}
    two = {**setup, "cranes": [one, another()]}
    tried = page.ok("/api/try", path="a.site.toml", setup=two)
    assert [crane["name"] for crane in tried["cranes"]] == ["Crane 1", "Crane 2"]
    assert tried["problems"] == []
    assert tried["served"] == tried["of"]
    saved = page.ok("/api/save", path="a.site.toml", setup=two, sha256=opened["sha256"])
    assert {"crane[0].name", "crane[1]"} <= set(saved["changed"])
    text = file.read_text()
    for comment in ("# my site", "# the yard, measured by Ann", "# by the gate", "# weighed"):
        assert comment in text
    config = load_site_config(file)
    assert [crane.name for crane in config.cranes] == ["Crane 1", "Crane 2"]
    assert [crane.base_m[:2] for crane in config.cranes] == [(-6.0, -4.0), (18.0, 4.0)]
    assert config.cranes[0].override.hook_block_kg == 400
    assert config.calendar.start is not None
    assert all(lift.is_planned for lift in bimvox.plan(bimvox.load_site(file)).lifts)
    again = page.open()
    first = {**again["setup"], "cranes": again["setup"]["cranes"][:1]}
    saved = page.ok("/api/save", path="a.site.toml", setup=first, sha256=again["sha256"])
    assert "crane[1]" in saved["changed"]
    assert [crane.name for crane in load_site_config(file).cranes] == ["Crane 1"]
    assert "# by the gate" in file.read_text()
    back = {**again["setup"], "cranes": [another(name="Crane 0"), *again["setup"]["cranes"][:1]]}
    page.ok("/api/save", path="a.site.toml", setup=back, sha256=saved["sha256"])
    assert [crane.name for crane in load_site_config(file).cranes] == ["Crane 0", "Crane 1"]
    assert load_site_config(file).cranes[1].override.hook_block_kg == 400


def test_a_part_of_a_crane_that_is_removed_goes_to_the_other(page: Page, folder: Path):
    shutil.copy(SAMPLES / "hall.ifc", folder)
    part = next(one.id for one in bimvox.read(folder / "hall.ifc").elements if one.name == "Column A1")
    file = folder / "hall.site.toml"
    own = f'\n[[component]]\nglobal_id = "{part}"  # near the gate\ncrane = "east"\n'
    file.write_text((SAMPLES / "hall.site.toml").read_text() + own)
    opened = page.open("hall.site.toml")
    west = {**opened["setup"], "cranes": opened["setup"]["cranes"][:1]}
    tried = page.ok("/api/try", path="hall.site.toml", setup=west)
    assert tried["parts"][part]["crane"] == "west"
    page.ok("/api/save", path="hall.site.toml", setup=west, sha256=opened["sha256"])
    assert "# near the gate" in file.read_text()
    (entry,) = load_site_config(file).component
    assert entry.crane is None
    assert [crane.name for crane in load_site_config(file).cranes] == ["west"]


def test_cranes_without_names_of_their_own_are_refused(page: Page):
    setup = page.open()["setup"]
    for name in ("", "Crane 1"):
        two = {**setup, "cranes": [{**setup["cranes"][0], "name": "Crane 1"}, another(name=name)]}
        answer = page.post("/api/try", path="a.site.toml", setup=two)
        assert answer.status_code == 400
        assert "name" in answer.json()["error"] + answer.json()["hint"]
    assert page.post("/api/try", path="a.site.toml", setup={**setup, "cranes": []}).status_code == 400


def test_messages_name_files_as_the_page_does(page: Page, folder: Path):
    (folder / "sub").mkdir()
    (folder / "sub" / "b.site.toml").write_text(SITE.replace("[crane]", "[cran]"))
    (folder / "bad.ifc").write_text("this is not a model")
    (folder / "away.site.toml").write_text(SITE.replace("frame.ifc", "../away/frame.ifc"))
    assert "../away/frame.ifc" in page.post("/api/open", path="away.site.toml").text
    said = [
        page.post("/api/open", path=path).text
        for path in ("away.site.toml", "sub/b.site.toml", "bad.ifc", "../x.ifc", "none.ifc")
    ]
    assert "sub/b.site.toml" in said[1]
    assert "bad.ifc" in said[2]
    (folder / "a.obstructions.json").write_text("{")
    said.append(page.get("/api/obstructions?path=a.site.toml").text)
    for text in said:
        assert str(folder.parent) not in text


def test_a_page_is_made_again_when_a_revision_is_there(page: Page, folder: Path, monkeypatch: pytest.MonkeyPatch):
    made: list[Path] = []
    monkeypatch.setattr("bimvox_pipeline.studio.plans.page_of_log", lambda log, **_: made.append(log) or b"page")
    (folder / "a.mcap").write_bytes(b"plan")
    for _ in range(2):
        page.studio.plans.page("a.mcap")
    assert len(made) == 1
    (folder / "a.r0001.mcap").write_bytes(b"revision")
    page.studio.plans.page("a.mcap")
    assert len(made) == 2
