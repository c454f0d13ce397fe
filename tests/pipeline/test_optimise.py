"""A search for a set-up: what it plans is no worse than the given one, it resumes, and it loses nothing."""

from __future__ import annotations

import csv
import json
import re
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest
import shapely
from bimvox_pipeline import optimise as command
from bimvox_pipeline.fleet.schedule import Execution
from bimvox_pipeline.optimise import optimise
from bimvox_pipeline.site import init
from bimvox_pipeline.studio.opened import open_site
from bimvox_pipeline.studio.saving import save_variant
from fleet_work import carry_out_in_process
from rough_search import time_few_lifts

from bimvox.errors import FileError, InputError
from bimvox.library.set_up_search.placed import PlacedSite
from bimvox.library.set_up_search.search import Search
from bimvox.library.set_up_search.set_up import Effort
from bimvox.library.set_up_search.yards import JOURNAL, Yards, may_move, other_yards
from bimvox.library.verify import verify
from bimvox.progress import SilentProgress
from bimvox.site.catalogue import machines_called
from bimvox.site.config.file import load_site_config
from bimvox.site.config.site_config import ComponentConfig

SAMPLES = Path(__file__).parents[2] / "sample_models"


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, Any]]:
    folder = tmp_path_factory.mktemp("optimised")
    shutil.copy(SAMPLES / "frame.ifc", folder)
    site = folder / "frame.site.toml"
    init(folder / "frame.ifc", out=site, voxel_size_m=0.5, full=True, progress=SilentProgress())
    site.write_text("# a remark of mine\n" + site.read_text().replace("search = true", "search = false"))
    return site, run(site)


def run(site: Path, out: Path | None = None, **options: Any) -> dict[str, Any]:
    """Optimise with the first two hammerheads, if no other crane is asked for, and plan in this process."""
    options = {"effort": Effort(2, 0, cranes=1), "crane": "hammerhead", "execution": Execution(jobs=1), **options}
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(command, "machines_for", lambda config, crane: (config, machines_called(crane)[:2]))
        time_few_lifts(patched)
        carry_out_in_process(patched)
        return optimise(site, out or site.parent / "found", progress=SilentProgress(), **options)


def planned(document: dict[str, Any]) -> list[dict[str, Any]]:
    return [*document["front"], *document["losers"]]


def test_the_front_is_proven_and_not_beaten_by_the_given_set_up(made: tuple[Path, dict[str, Any]]) -> None:
    _, document = made
    given, found = document["baseline"], planned(document)
    assert len(found) == 2
    assert document["front"]
    assert document["verified"]
    assert document["front"][0]["hours"] <= given["hours"] + 0.01
    assert 0.0 < document["least_moving_hours"] <= min(one["moving_hours"] for one in (given, *found))
    assert 0.5 * given["cost"] < document["least_cost"] <= min(one["cost"] for one in (given, *found))
    for key in ("hours", "cost", "highest_utilisation"):
        assert min(one[key] for one in document["front"]) == min(one[key] for one in found)
    for one in (given, *found):
        assert one["refused"] == given["refused"]
        assert one["moving_hours"] == pytest.approx(one["hours"] - document["standing_hours"], abs=1e-4)
        assert 0.0 < one["highest_utilisation"] <= 1.0
        assert one["critical_lifts"] is not None
        assert verify(one["log"]).verified
    assert all(one["why_lost"] for one in document["losers"])


@pytest.mark.slow
def test_hours_are_paid_by_the_site_files_rates(made: tuple[Path, dict[str, Any]]) -> None:
    site, document = made
    assert document["currency"] == "EUR"
    given = document["baseline"]
    priced = site.with_name("priced.site.toml")
    offer = f'machine = [{{ name = "{given["machine"]}", month = 0, set_up = 5 }}]'
    priced.write_text(f'{site.read_text()}\n[costs]\ncurrency = "CHF"\nperson_hour = 100\n{offer}\n')
    again = run(priced, site.parent / "priced", effort=Effort(1, 0, cranes=1), crane="hammerhead-45")
    assert again["currency"] == "CHF"
    lorries = 600.0 * given["lorries"]
    assert given["hook_hours"] > given["hours"]
    assert again["baseline"]["cost"] == pytest.approx(5.0 + 400.0 * given["hook_hours"] + lorries, abs=0.01)


DAMAGES: dict[str, Callable[[bytes], bytes]] = {
    "cut": lambda data: data[:-7],
    "garbled": lambda data: data[: len(data) // 2] + b"\xff" + data[len(data) // 2 + 1 :],
    "other": lambda data: b"4\n" + data,
}


def test_how_long_the_crane_moves_is_told_only_if_it_sets_every_part(made: tuple[Path, dict[str, Any]]) -> None:
    site, distant = made[0], made[0].with_name("distant.site.toml")
    text = site.read_text().replace("\naccess = ", "\n# access = ")
    distant.write_text(re.sub(r"base_m = .*", "base_m = [-30, 3]", text))
    document = run(distant, site.parent / "distant", effort=Effort(1, 0, cranes=1), crane="hammerhead-45")
    given, (found,) = document["baseline"], document["front"]
    assert given["refused"] > found["refused"] == 0
    assert given["moving_hours"] is None
    assert found["moving_hours"] > 0.0
    assert f"infeasible lifts: 0, given {given['refused']};" in Path(document["page"]).read_text()


@pytest.mark.slow
def test_other_yards_are_tried_and_a_killed_call_is_continued(
    made: tuple[Path, dict[str, Any]], monkeypatch: pytest.MonkeyPatch
) -> None:
    time_few_lifts(monkeypatch)
    site, _ = made
    opened = open_site(site)
    search, machines = Search(opened, SilentProgress()), machines_called("hammerhead")[:3]

    def tried(
        folder: str, *efforts: Effort, damage: Callable[[bytes], bytes] | None = None
    ) -> tuple[list[tuple[Any, ...]], int]:
        where = site.parent / folder
        where.mkdir()
        for effort in efforts:
            if damage is not None and (journal := where / JOURNAL).exists():
                journal.write_bytes(damage(journal.read_bytes()))
            found, count = other_yards(opened, search, machines, where, effort, SilentProgress())
        return [(one.machine, one.yard, one.crane_s) for one in found], count

    whole, count = tried("whole", Effort(yards=10))
    assert count == 10
    assert len({yard.polygon for _, yard, _ in whole}) >= 4, "the fastest ones, not only the very best"
    assert tried("in-parts", Effort(yards=4), Effort(yards=10)) == (whole, 10)
    for name, damage in DAMAGES.items():
        assert tried(name, Effort(yards=4), Effort(yards=10), damage=damage) == (whole, 10), name
    assert tried("no-time", Effort(yards=10, seconds=0.0))[1] == 0
    taken = shapely.box(0.0, 0.0, 6.5, 6.5)
    for _, yard, _ in whole:
        assert shapely.Polygon(yard.polygon).intersection(taken).area == 0.0


def test_a_smaller_truckload_takes_a_smaller_yard_and_is_never_above_the_site_files(
    made: tuple[Path, dict[str, Any]],
) -> None:
    site, _ = made
    opened = open_site(site)
    own_kg = opened.config.rules.truckload_kg
    values = {"side": 0, "along": 0.0, "longer": 1.0}
    found = [Yards(opened).of({**values, "truckload": load}, load) for load in range(3)]
    assert [one.truckload_kg for one in found] == [own_kg, 0.75 * own_kg, 0.5 * own_kg]
    areas = [shapely.Polygon(one.polygon).area for one in found]
    assert areas[0] >= areas[1] >= areas[2]
    rules = opened.config.rules.model_copy(update={"truckload_kg": 0.0})
    unlimited = PlacedSite(opened.config.model_copy(update={"rules": rules}), opened.building)
    assert [Yards(unlimited).of({**values, "truckload": load}, load).truckload_kg for load in (0, 2)] == [0.0, 12_000.0]


@pytest.mark.slow
def test_a_set_up_with_another_yard_plans_as_it_is(made: tuple[Path, dict[str, Any]]) -> None:
    site, far = made[0], made[0].with_name("far.site.toml")
    opened = open_site(site)
    distant = tuple(tuple((x + 12.0, y - 12.0) for x, y in polygon) for polygon in opened.setup.yard)
    lane = opened.with_areas_of(opened.config, distant).areas.access or ()
    save_variant(opened, opened.setup.model_copy(update={"yard": distant, "access": lane}), far)
    document = run(far, site.parent / "yards", effort=Effort(3, 12, cranes=1), crane="hammerhead-45")
    moved = [one for one in planned(document) if one["yard"] is not None]
    assert document["trials"] == 12
    assert moved
    for one in moved:
        written = load_site_config(Path(one["site"]))
        assert [list(corner) for corner in written.areas.yard[0]] == one["yard"]
        (lane,), yard = written.areas.access, shapely.Polygon(written.areas.yard[0])
        assert shapely.Polygon(lane).distance(yard) == 0.0 and not shapely.Polygon(lane).intersection(yard).area
        assert written.rules.truckload_kg == one["truckload_kg"]
        assert (one["refused"], one["error"]) == (0, None)
    rows = list(csv.DictReader(Path(document["table"]).read_text().splitlines()))
    assert {row["yard"] for row in rows} > {"given"}


def test_the_yard_stays_where_trucks_or_parts_have_their_places(made: tuple[Path, dict[str, Any]]) -> None:
    site, _ = made
    opened = open_site(site)
    assert opened.config.areas.access and not may_move(opened.config)
    config = opened.searched
    assert may_move(config), "an access as init gives it moves with the yard"
    street = ((-30.0, -30.0), (-20.0, -30.0), (-20.0, -26.0))
    areas = config.areas.model_copy(update={"access": (street,)})
    elsewhere = config.model_copy(update={"areas": areas})
    assert not may_move(elsewhere)
    assert PlacedSite(elsewhere, opened.building).searched is elsewhere
    given = ComponentConfig(global_id="x", start=(1.0, 2.0))
    assert not may_move(config.model_copy(update={"component": (given,)}))


def test_the_page_shows_every_plan_and_loads_nothing(made: tuple[Path, dict[str, Any]]) -> None:
    site, document = made
    page = Path(document["page"])
    text = page.read_text(encoding="utf-8")
    assert "default-src 'none'" in text
    assert "http" not in text.replace("http-equiv", "").replace("http://www.w3.org", "")
    record = json.loads(re.findall(r'id="record">(.*?)</script>', text)[0])
    assert [one["hours"] for one in record["front"]] == [one["hours"] for one in document["front"]]
    assert str(site.parent) not in text
    shown = [float(value) for value in re.findall(r'<data value="([0-9.]+)">', text)]
    for one in (document["baseline"], *planned(document)):
        assert one["hours"] in shown
        assert one["cost"] in shown
    for link in re.findall(r'href="([^"]+)"', text):
        assert link == "data:," or (page.parent / link).is_file()


def test_a_site_file_of_a_set_up_keeps_what_people_wrote(made: tuple[Path, dict[str, Any]]) -> None:
    _, document = made
    for one in planned(document):
        assert Path(one["site"]).read_text().startswith("# a remark of mine\n")


def test_the_table_has_every_machine_and_the_map_is_a_picture(made: tuple[Path, dict[str, Any]]) -> None:
    _, document = made
    rows = list(csv.DictReader(Path(document["table"]).read_text().splitlines()))
    places = {(row["machine"], row["jib_m"], row["falls"]): int(row["places"]) for row in rows}
    assert len(places) == document["machines"]
    assert sum(places.values()) == document["tried"]
    assert not rows[0]["why_lost"]
    kept = [row for row in rows if not row["why_lost"]]
    least = min(float(row["estimated_utilisation"]) for row in rows if row["parts_served"] == rows[0]["parts_served"])
    assert min(float(row["estimated_utilisation"]) for row in kept) == least < float(rows[0]["estimated_utilisation"])
    assert all(row["why_lost"] for row in rows if int(row["parts_served"]) < int(rows[0]["parts_served"]))
    root = ElementTree.parse(document["map"]).getroot()
    assert root.tag.endswith("svg")


def test_a_second_call_keeps_the_plans_and_writes_the_same_bytes(made: tuple[Path, dict[str, Any]]) -> None:
    site, document = made
    before = {
        path: path.read_bytes() for path in site.parent.rglob("*") if path.suffix in (".mcap", ".csv", ".svg", ".html")
    }
    again = run(site)
    assert [one["hours"] for one in planned(again)] == [one["hours"] for one in planned(document)]
    assert {path: path.read_bytes() for path in before} == before


def test_a_changed_site_file_of_a_set_up_is_not_overwritten(made: tuple[Path, dict[str, Any]]) -> None:
    site, document = made
    member = Path(planned(document)[0]["site"])
    kept = member.read_bytes()
    for edited in (kept + b"# an edit\n", kept.replace(b"base_m = [", b"base_m = [ ", 1), kept[:-1], b""):
        member.write_bytes(edited)
        with pytest.raises(FileError, match="may hold edits"):
            run(site)
        assert member.read_bytes() == edited
    member.write_bytes(kept)


@pytest.mark.slow
def test_a_site_file_of_a_set_up_that_nobody_edited_follows_the_given_one(made: tuple[Path, dict[str, Any]]) -> None:
    given = made[0].with_name("given.site.toml")
    for remark in ("# one remark of mine\n", "# another one\n"):
        given.write_text(made[0].read_text() + remark)
        (found,) = planned(run(given, effort=Effort(1, 0, cranes=1), crane="hammerhead-45"))
        assert remark in Path(found["site"]).read_text()
    # From a set-up that was found, the search goes on: its stamp is not copied.
    (further,) = planned(run(Path(found["site"]), effort=Effort(1, 0, cranes=1), crane="hammerhead-45"))
    assert Path(further["site"]).read_bytes().count(b"bimvox optimise wrote") == 1


def test_a_site_with_several_cranes_or_none_is_refused(made: tuple[Path, dict[str, Any]]) -> None:
    site, _ = made
    other = site.with_name("none.site.toml")
    other.write_text('[model]\npath = "frame.ifc"\n[crane]\nkind = "none"\n')
    with pytest.raises(InputError, match="one crane"):
        run(other)
    with pytest.raises(InputError):
        run(site, crane="no such crane")


@pytest.mark.slow
def test_no_set_up_over_the_budget_is_planned(made: tuple[Path, dict[str, Any]]) -> None:
    site, document = made
    most = min(one["estimated_cost"] for one in planned(document)) + 1.0
    limited = site.with_name("limited.site.toml")
    limited.write_text(f"{site.read_text()}\n[costs]\nbudget = {most}\n")
    found = run(limited, site.parent / "limited")
    assert all(one["estimated_cost"] <= most for one in planned(found))
    rows = csv.DictReader(Path(found["table"]).read_text().splitlines())
    assert any("more than the budget" in row["why_lost"] for row in rows)
    limited.write_text(f"{site.read_text()}\n[costs]\nbudget = 1\n")
    with pytest.raises(InputError, match="the cheapest costs"):
        run(limited, site.parent / "none")


@pytest.mark.slow
def test_two_cranes_are_planned_and_proven_and_their_site_file_holds_both(made: tuple[Path, dict[str, Any]]) -> None:
    site, _ = made
    document = run(site, site.parent / "two", effort=Effort(3, 0), crane="hammerhead-45")
    (pair,) = (one for one in planned(document) if one["second"] is not None)
    config = load_site_config(Path(pair["site"]))
    assert [crane.machine for crane in config.cranes] == [pair["machine"], pair["second"]["machine"]]
    assert len({crane.name for crane in config.cranes}) == 2
    assert (pair["refused"], pair["moving_hours"], pair["error"]) == (0, None, None)
    assert verify(pair["log"]).verified
    alone = [one for one in planned(document) if one["second"] is None]
    assert pair["cost"] > min(one["cost"] for one in alone)
    if pair not in document["front"]:
        assert pair["hours"] >= min(one["hours"] for one in alone)
        assert pair["why_lost"]
    page = Path(document["page"]).read_text(encoding="utf-8")
    assert "; and hammerhead-45" in page
