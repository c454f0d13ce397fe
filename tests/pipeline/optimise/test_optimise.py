"""A search for a set-up: what it plans is no worse than the given one, it resumes, and it loses nothing."""

from __future__ import annotations

import csv
import shutil
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest
from bimvox_pipeline.optimise.optimise import optimise
from bimvox_pipeline.site import init

from bimvox.errors import FileError, InputError
from bimvox.library.verify import verify
from bimvox.progress import SilentProgress

SAMPLES = Path(__file__).parents[3] / "sample_models"


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, Any]]:
    folder = tmp_path_factory.mktemp("optimised")
    shutil.copy(SAMPLES / "frame.ifc", folder)
    site = folder / "frame.site.toml"
    init(folder / "frame.ifc", out=site, progress=SilentProgress())
    site.write_text("# a remark of mine\n" + site.read_text())
    return site, run(site)


def run(site: Path, out: Path | None = None, **options: Any) -> dict[str, Any]:
    options = {"members": 2, "crane": "hammerhead", "jobs": 1, **options}
    return optimise(site, out or site.parent / "found", progress=SilentProgress(), **options)


def test_the_set_ups_are_proven_and_no_slower_than_the_given_one(made: tuple[Path, dict[str, Any]]) -> None:
    _, document = made
    given, *found = document["set_ups"]
    assert found
    assert document["verified"]
    assert found[0]["estimated_hours"] <= given["estimated_hours"]
    assert found[0]["crane_hours"] <= given["crane_hours"] + 0.01
    for one in (given, *found):
        assert one["infeasible"] == given["infeasible"]
        assert one["crane_hours"] >= document["standing_hours"] - 1e-3
        assert verify(one["log"]).verified


def test_hours_are_paid_by_the_site_files_rates(made: tuple[Path, dict[str, Any]]) -> None:
    site, document = made
    assert document["currency"] == "EUR"
    by_cost = [one for one in document["set_ups"] if one["cost"] is not None]
    assert document["cheapest"] == min(by_cost, key=lambda one: (one["infeasible"], one["cost"]))["site"]
    given = document["set_ups"][0]
    priced = site.with_name("priced.site.toml")
    offer = f'machine = [{{ name = "{given["machine"]}", month = 0, set_up = 5 }}]'
    priced.write_text(f'{site.read_text()}\n[costs]\ncurrency = "CHF"\nperson_hour = 100\n{offer}\n')
    again = run(priced, site.parent / "priced", members=1)
    assert again["currency"] == "CHF"
    assert again["set_ups"][0]["cost"] == pytest.approx(5.0 + 400.0 * given["crane_hours"], abs=0.01)


def test_a_site_file_of_a_set_up_keeps_what_people_wrote(made: tuple[Path, dict[str, Any]]) -> None:
    _, document = made
    for one in document["set_ups"][1:]:
        assert Path(one["site"]).read_text().startswith("# a remark of mine\n")


def test_the_table_has_every_machine_and_the_map_is_a_picture(made: tuple[Path, dict[str, Any]]) -> None:
    _, document = made
    rows = list(csv.DictReader(Path(document["table"]).read_text().splitlines()))
    assert len(rows) == document["machines"]
    assert sum(int(row["places"]) for row in rows) == document["tried"]
    assert not rows[0]["why_lost"]
    assert all(row["why_lost"] for row in rows if int(row["parts_served"]) < int(rows[0]["parts_served"]))
    root = ElementTree.parse(document["map"]).getroot()
    assert root.tag.endswith("svg")


def test_a_second_call_keeps_the_plans_and_writes_the_same_bytes(made: tuple[Path, dict[str, Any]]) -> None:
    site, document = made
    before = {path: path.read_bytes() for path in site.parent.rglob("*") if path.suffix in (".mcap", ".csv", ".svg")}
    again = run(site)
    assert [one["crane_hours"] for one in again["set_ups"]] == [one["crane_hours"] for one in document["set_ups"]]
    assert {path: path.read_bytes() for path in before} == before


def test_a_changed_site_file_of_a_set_up_is_not_overwritten(made: tuple[Path, dict[str, Any]]) -> None:
    site, document = made
    member = Path(document["set_ups"][1]["site"])
    kept = member.read_bytes()
    member.write_bytes(kept + b"# an edit\n")
    with pytest.raises(FileError, match="may hold edits"):
        run(site)
    assert member.read_bytes().endswith(b"# an edit\n")
    member.write_bytes(kept)


def test_a_site_with_several_cranes_or_none_is_refused(made: tuple[Path, dict[str, Any]]) -> None:
    site, _ = made
    other = site.with_name("none.site.toml")
    other.write_text('[model]\npath = "frame.ifc"\n[crane]\nkind = "none"\n')
    with pytest.raises(InputError, match="one crane"):
        run(other)
    with pytest.raises(InputError):
        run(site, crane="no such crane")


def test_no_set_up_over_the_budget_is_planned(made: tuple[Path, dict[str, Any]]) -> None:
    site, document = made
    most = min(one["estimated_cost"] for one in document["set_ups"][1:]) + 1.0
    limited = site.with_name("limited.site.toml")
    limited.write_text(f"{site.read_text()}\n[costs]\nbudget = {most}\n")
    found = run(limited, site.parent / "limited")
    assert all(one["estimated_cost"] <= most for one in found["set_ups"][1:])
    rows = csv.DictReader(Path(found["table"]).read_text().splitlines())
    assert any("more than the budget" in row["why_lost"] for row in rows)
    limited.write_text(f"{site.read_text()}\n[costs]\nbudget = 1\n")
    with pytest.raises(InputError, match="the cheapest costs"):
        run(limited, site.parent / "none")
