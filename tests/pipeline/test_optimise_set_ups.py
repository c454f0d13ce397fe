"""A search for a set-up weighs mobile cranes that move: its site files plan as they are, and as it says."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import Any

import pytest
from bimvox_pipeline import optimise as command
from bimvox_pipeline.fleet.schedule import Execution
from bimvox_pipeline.optimise import optimise
from bimvox_pipeline.studio.opened import open_site
from fleet_work import carry_out_in_process
from moving_sites import row_file
from rough_search import time_few_lifts

import bimvox
from bimvox.library.set_up_search.search import Search
from bimvox.library.set_up_search.set_up import Effort
from bimvox.progress import SilentProgress
from bimvox.site.catalogue import machines_called
from bimvox.site.config.file import load_site_config

FAR = (0.0, 3.0, 6.0, 70.0, 73.0, 76.0)
"""Panels that no crane of 60 t sets from one place."""


def run(site: Path, machine: str = "mobile-60t") -> dict[str, Any]:
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(command, "machines_for", lambda config, crane: (config, machines_called(crane)))
        time_few_lifts(patched)
        carry_out_in_process(patched)
        return optimise(
            site, site.parent / "found", crane=machine, effort=Effort(2, 0, cranes=1), execution=Execution(jobs=1),
            progress=SilentProgress(),
        )  # fmt: skip


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, Any]]:
    stays = 'machine = "mobile-60t"\nheading_deg = 0\nbase_m = [4.5, -5.5]\n'
    folder = tmp_path_factory.mktemp("row")
    site = row_file(folder, panels=FAR, places={}, crane=stays, more="# by the street\n")
    site.write_text("# a remark of mine\n" + site.read_text())
    return site, run(site)


def test_what_no_place_serves_is_served_from_set_ups(made: tuple[Path, dict[str, Any]]) -> None:
    _, document = made
    (found,) = document["front"]
    assert document["verified"]
    assert (document["baseline"]["refused"], found["refused"], found["error"]) == (3, 0, None)
    assert len(found["set_ups"]) == 2 and all(one["yard"] for one in found["set_ups"])
    assert found["parts_served"] == 6
    assert found["move_hours"] > 1.0 > document["baseline"]["move_hours"] == 0.0
    assert document["least_cost"] <= found["cost"]
    assert found["estimated_hours"] == pytest.approx(found["hours"], rel=0.1)
    assert found["estimated_cost"] == pytest.approx(found["cost"], rel=0.1)


def test_its_site_file_plans_as_it_says(made: tuple[Path, dict[str, Any]]) -> None:
    _, document = made
    (found,) = document["front"]
    text = Path(found["site"]).read_text()
    assert text.startswith("# a remark of mine\n")
    config = load_site_config(Path(found["site"]))
    assert [list(one.base_m) for one in config.cranes] == [one["base_m"] for one in found["set_ups"]]
    plan = bimvox.plan(bimvox.load_site(Path(found["site"])), jobs=1)
    assert plan.verdict is not None and plan.verdict.verified
    assert plan.figures.crane_s == pytest.approx(3600.0 * found["hours"], abs=0.01)
    assert plan.figures.moves_s == pytest.approx(3600.0 * found["move_hours"], abs=0.01)
    assert plan.figures.cost is not None
    assert (plan.figures.hire_days, round(plan.figures.cost.total, 2)) == (found["hire_days"], found["cost"])


def test_page_and_table_say_in_how_many_set_ups_it_stands(made: tuple[Path, dict[str, Any]]) -> None:
    _, document = made
    rows = list(csv.DictReader(Path(document["table"]).read_text().splitlines()))
    assert [row["set_ups"] for row in rows if int(row["parts_served"]) == 6] == ["2"]
    page = Path(document["page"]).read_text(encoding="utf-8")
    assert "mobile-60t, 2 set-ups, boom" in page
    assert "one each" in page


def test_from_a_site_with_set_ups_one_place_is_found_and_its_file_has_no_set_up(tmp_path: Path) -> None:
    document = run(row_file(tmp_path))
    (found, *_), given = document["front"], document["baseline"]
    assert len(given["set_ups"]) == 2 and found["set_ups"] is None
    assert given["parts_served"] == found["parts_served"] == 6
    assert given["estimated_cost"] == pytest.approx(given["cost"], rel=0.1)
    assert found["cost"] < given["cost"]
    config = load_site_config(Path(found["site"]))
    assert not config.moves and list(config.cranes[0].base_m or ()) == found["base_m"]


def test_the_library_finds_the_same(made: tuple[Path, dict[str, Any]], monkeypatch: pytest.MonkeyPatch) -> None:
    time_few_lifts(monkeypatch)
    site, document = made
    found = bimvox.optimise(site, crane="mobile-60t", plans=1, trials=0, cranes=1, jobs=1)
    (best,), (told,) = found.front, document["front"]
    assert best.words == "mobile-60t in 2 set-ups"
    assert (best.refused, best.hours, best.move_hours) == (
        0, pytest.approx(told["hours"]), pytest.approx(told["move_hours"], abs=1e-5),
    )  # fmt: skip
    assert best.cost == pytest.approx(told["cost"], abs=0.01)
    assert best.site.config.areas.yard == tuple(
        tuple(tuple(corner) for corner in one["yard"]) for one in told["set_ups"]
    )


def test_a_set_up_where_parts_will_stand_does_not_stop_the_search(tmp_path: Path) -> None:
    site = open_site(row_file(tmp_path, places={"on it": (4.5, 0.1), "east": (34.5, -5.5)}))
    search = Search(site, SilentProgress())
    assert not search.config.moves
    assert len(search.work.masses_kg) == 6
