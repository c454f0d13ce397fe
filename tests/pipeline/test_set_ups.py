"""A crane that moves, from the site file to the studio and the exports."""

import json
import struct
from collections.abc import Callable
from dataclasses import replace
from datetime import datetime
from pathlib import Path

import pytest
from bimvox_pipeline.report import report
from bimvox_pipeline.studio.opened import open_site
from bimvox_pipeline.studio.saving import save
from bimvox_pipeline.verify import verify
from moving_sites import box, planned_row, row, row_file

import bimvox
from bimvox.errors import InputError
from bimvox.exporters.animation import to_animated_glb
from bimvox.library.plan_value import write_log_file
from bimvox.log.plan_log import log_dates
from bimvox.log.reader import read_log
from bimvox.progress import SilentProgress
from bimvox.records.motion import stays_of
from bimvox.remarks.remarks import remarks_of
from bimvox.rendering.pictures.cranes import poses_at, site_cranes
from bimvox.site.build import with_digests
from bimvox.site.machine import cranes_of
from bimvox.site.moving import Moving
from bimvox.site.site import Site


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("row") / "row.mcap"
    write_log_file(path, planned_row().record)
    return path


def test_a_log_is_proven_from_the_file_alone(log: Path) -> None:
    document = verify(log, progress=SilentProgress())
    assert document["verified"], {name: one for name, one in document["checks"].items() if not one["passed"]}
    assert document["checks"]["set_ups"]["samples"]
    west, east = document["set_ups"]
    assert (west["first"], west["last"], east["first"], east["last"]) == (1, 3, 4, 6)
    (move,) = document["moves"]
    assert (move["number"], move["from"], move["to"], move["ends_s"]) == (4, "west", "east", east["ready_s"])


def test_a_log_is_bound_to_the_users_files(log: Path, tmp_path: Path) -> None:
    mine = row_file(tmp_path)
    assert verify(log, site=mine, progress=SilentProgress())["verified"]
    mine.write_text(mine.read_text().replace("34.5", "35.5"))
    assert not verify(log, site=mine, progress=SilentProgress())["verified"]


def test_a_log_with_shorter_moves_than_its_site_file_is_refused(log: Path, tmp_path: Path) -> None:
    mine = row_file(tmp_path, more="[crane.moving]\nrig_min = 90\n")
    checks = verify(log, site=mine, progress=SilentProgress())["checks"]
    failures = [failure for check in checks.values() for failure in check["failures"]]
    assert any("set-ups of the crane" in failure for failure in failures), failures


def test_the_log_reads_back_the_same(log: Path) -> None:
    before, after = planned_row().record, read_log(log)
    assert after.plan.site.moving == before.plan.site.moving
    assert after.plan.site.digest == before.plan.site.digest
    assert after.steps == before.steps


def test_the_animation_shows_the_crane_in_one_place_at_a_time() -> None:
    glb = to_animated_glb(planned_row().record)
    length = struct.unpack("<I", glb[12:16])[0]
    document = json.loads(glb[20 : 20 + length])
    (motions,) = document["animations"]
    names = [document["nodes"][one["target"]["node"]]["name"] for one in motions["channels"]
             if one["target"]["path"] == "scale"]  # fmt: skip
    assert sum("mast" in name for name in names) == 2, names


def test_a_picture_shows_the_crane_where_it_stands() -> None:
    made = planned_row()
    first, second = stays_of(made.motions)
    assert first.until_ns == second.from_ns and second.until_ns is None
    for stay in (first, second):
        poses = poses_at(made.site, made.motions, stay.from_ns + 1)
        assert list(poses) == [stay.crane]
        assert len(site_cranes(made.site, poses).strokes) == len(site_cranes(made.site).strokes) / 2


def test_the_programme_has_the_move_in_working_hours(tmp_path: Path) -> None:
    made, start = planned_row(), datetime.fromisoformat("2026-03-02T07:00")
    bimvox.export(made, tmp_path / "row.xml", to="msproject", start=start)
    text = (tmp_path / "row.xml").read_text()
    assert "Move the crane from west to east: derig, drive, rig" in text
    dates = log_dates(made.record, start)
    assert dates is not None
    begins_ns, ends_ns = dates.moves[3]
    (move,) = made.record.steps.moves
    assert dates.work.between(begins_ns, ends_ns) == pytest.approx(move.ends_ns - move.begins_ns, abs=1e3)
    assert dates.lifts[2][1] <= begins_ns and ends_ns <= dates.lifts[3][0]


def test_other_obstructions_give_another_proven_plan() -> None:
    made = planned_row()
    truck = bimvox.Obstruction("truck", bimvox.Box((29.5, -10.0, 0.0), (30.5, -8.5, 4.0)))
    revised = bimvox.revise(made, bimvox.ObstructionSet.of([truck]))
    assert revised.verdict is not None and revised.verdict.verified
    assert [one.crane for one in revised.motions] == [0, 0, 0, 1, 1, 1]


def test_a_set_up_that_serves_nothing_is_a_remark_and_takes_no_time(tmp_path: Path) -> None:
    places = {"west": (4.5, -5.5), "nowhere": (20.0, -5.5)}
    made = bimvox.plan(row(tmp_path, places=places, panels=(0.0, 3.0, 6.0)), policy="none", jobs=1)
    assert not made.record.steps.moves
    bimvox.write_log(made, tmp_path / "row.mcap")
    report(tmp_path / "row.mcap", tmp_path / "row.html", progress=SilentProgress())
    said = (tmp_path / "row.html").read_text()
    assert "no lift: the crane does not go there" in said and "lifts 1 to 3" in said
    remarks = remarks_of(made.record.plan, made.motions)
    assert ["'nowhere' serves no lift" in one.text for one in remarks if one.kind == "set_up_unused"] == [True]


def test_a_place_on_the_building_is_a_serious_remark_with_its_load(tmp_path: Path) -> None:
    file = row_file(tmp_path)
    slab = box("slab", (28, -10, -0.3), (40, -1.5, 0), 48)
    (tmp_path / "row.obj").write_text((tmp_path / "row.obj").read_text() + slab)
    kinds = '{ select = "slab", kind = "concrete", means = "in_situ" }'
    file.write_text(file.read_text().replace('kind = "precast" }]', f'kind = "precast" }}, {kinds}]'))
    made = bimvox.plan(bimvox.load_site(file), policy="none", jobs=1)
    (said,) = [one for one in remarks_of(made.record.plan, made.motions) if one.kind == "set_up_ground"]
    assert "stands on slab" in said.text and "kN on one outrigger" in said.text


def test_what_is_cast_where_the_crane_stood_is_not_in_its_way(tmp_path: Path) -> None:
    file = row_file(tmp_path)
    wall = box("wall", (0, -6, 0), (9, -5, 1.2), 48)
    (tmp_path / "row.obj").write_text((tmp_path / "row.obj").read_text() + wall)
    kinds = '{ select = "wall", kind = "concrete", means = "in_situ" }'
    text = file.read_text().replace('kind = "precast" }]', f'kind = "precast" }}, {kinds}]')
    file.write_text(text + '[[component]]\nglobal_id = "wall"\nbefore = ["panel-4", "panel-5", "panel-6"]\n')
    made = bimvox.plan(bimvox.load_site(file), policy="none", jobs=1)
    assert made.verdict is not None and made.verdict.verified
    (cast,) = (one.order for one in made.record.plan.lifts if made.site.components[one.component].name == "wall")
    west, east = ([one.order for one in made.motions if one.crane == number] for number in (0, 1))
    assert max(west) < cast < min(east)
    said = [one.text for one in remarks_of(made.record.plan, made.motions) if one.kind in ("crane_foot", "crane_tail")]
    assert not [text for text in said if "west" in text], said


def test_the_studio_shows_each_set_up_and_saves_places_and_booms(tmp_path: Path) -> None:
    file = row_file(tmp_path, more="[crane.moving]\nrig_min = 90 # measured\n")
    opened = open_site(file)
    west, east = opened.setup.cranes
    assert (west.name, west.base_m, west.machine) == ("west", (4.5, -5.5), "mobile-60t")
    assert opened.document("row.site.toml")["moves"]
    tried = opened.tried(opened.setup)
    assert (tried["served"], tried["problems"]) == (6, [])
    assert {one["crane"] for one in tried["parts"].values()} == {"mobile-60t at west", "mobile-60t at east"}
    moved = opened.setup.model_copy(
        update={"cranes": (west, east.model_copy(update={"base_m": (36.0, -6.0), "jib_m": 28.0}))}
    )
    saved, changed = save(opened, moved)
    assert changed == ["crane.setup[1].base_m", "crane.setup[1].boom_m"]
    assert "rig_min = 90 # measured" in file.read_text()
    assert [one.base_m for one in saved.config.cranes] == [(4.5, -5.5), (36.0, -6.0)]
    assert cranes_of(saved.config)[1].jib_own_m == 28.0
    for other in (
        (west,),
        (west, east.model_copy(update={"machine": "mobile-100t"})),
        (*moved.cranes, west.model_copy(update={"name": "third"})),
    ):
        with pytest.raises(InputError, match="only places and booms"):
            saved.tried(moved.model_copy(update={"cranes": other}))


@pytest.mark.parametrize(
    "forge",
    [
        lambda site: None,  # two cranes at the same time
        lambda site: replace(site.moving, rig_s=0.0),
        lambda site: replace(site.moving, names=("east", "west")),
    ],
)
def test_a_log_whose_crane_moves_in_another_way_than_its_site_file_says_is_refused(
    tmp_path: Path, forge: Callable[[Site], Moving | None]
) -> None:
    record = planned_row().record
    site = with_digests(replace(record.plan.site, moving=forge(record.plan.site)))
    write_log_file(tmp_path / "row.mcap", replace(record, plan=replace(record.plan, site=site)))
    document = verify(tmp_path / "row.mcap", progress=SilentProgress())
    assert not document["verified"]
    failures = document["checks"]["own_files"]["failures"]
    assert any("set-ups of the crane" in failure for failure in failures), failures
