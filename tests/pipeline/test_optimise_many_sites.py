"""Several sites are optimised as the runs of a fleet: one table and page of all; a site that fails is a row of them."""

from __future__ import annotations

import csv
import json
import shutil
from pathlib import Path
from typing import Any

import pytest
from bimvox_cli.main import run as command
from bimvox_pipeline import optimise as acts
from bimvox_pipeline.fleet.schedule import Execution
from bimvox_pipeline.optimise import PAGE, optimise_all
from fleet_work import carry_out_in_process

from bimvox.errors import InputError
from bimvox.progress import SilentProgress

SAMPLES = Path(__file__).parents[2] / "sample_models"


@pytest.fixture
def searched(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Search in this process, with made-up results; return the names of the sites searched so far."""
    names: list[str] = []

    def found(site: Path, out: Path, **asked: Any) -> dict[str, Any]:
        assert asked["execution"].jobs == 1
        names.append(site.name)
        if site.name.startswith("hall"):
            raise InputError("no machine serves any part")
        out.mkdir(parents=True, exist_ok=True)
        (out / PAGE).write_text("page")
        given = {"machine": "flat-top-75", "refused": 1, "hours": 10.0, "cost": 900.0}
        fastest, cheapest = given | {"refused": 0, "hours": 7.5}, given | {"machine": "hammerhead-30", "cost": 600.0}
        return {"parts": 6, "currency": "EUR", "verified": True, "baseline": given, "front": [fastest, cheapest]}

    monkeypatch.setattr(acts, "optimise", found)
    carry_out_in_process(monkeypatch)
    return names


@pytest.fixture
def sites(tmp_path: Path) -> list[Path]:
    for file in SAMPLES.iterdir():
        if file.name.startswith(("yard.", "hall.", "paper.")):
            shutil.copy(file, tmp_path)
    return [tmp_path / f"{name}.site.toml" for name in ("yard", "hall", "paper")]


def optimised(sites: list[Path], *, fresh: bool = False, **options: Any) -> dict[str, Any]:
    return optimise_all(
        sites, sites[0].parent / "out", execution=Execution(jobs=1, fresh=fresh), progress=SilentProgress(), **options
    )


def test_each_site_is_a_row_of_the_table_and_of_the_page(sites: list[Path], searched: list[str]):
    found = optimised(sites)
    assert searched == [site.name for site in sites]
    rows = list(csv.DictReader(Path(found["table"]).read_text(encoding="utf-8").splitlines()))
    assert [(row["name"], row["status"]) for row in rows] == [
        ("yard", "optimised"), ("hall", "failed"), ("paper", "optimised"),
    ]  # fmt: skip
    assert (rows[0]["given_hours"], rows[0]["fastest_hours"], rows[0]["cheapest_cost"]) == ("10.0", "7.5", "600.0")
    assert "no machine serves any part" in rows[1]["error"]
    assert (found["failed"], found["verified"]) == (1, False)
    page = Path(found["page"]).read_text(encoding="utf-8")
    assert f'<a href="yard/{PAGE}">yard</a>' in page
    assert "no machine serves any part" in page
    assert "20.0 given" in page
    assert "25 % less; 2 sites" in page
    assert "<td>33 % less</td>" in page


def test_what_is_found_is_kept_until_something_changes(sites: list[Path], searched: list[str]):
    first = optimised(sites)
    page = Path(first["page"]).read_bytes()
    searched.clear()
    again = optimised(sites)
    assert searched == ["hall.site.toml"], "what failed is tried again"
    assert [one["kept"] for one in again["sites"]] == [True, False, True]
    assert Path(again["page"]).read_bytes() == page
    searched.clear()
    sites[2].write_text(sites[2].read_text() + "\n# changed\n")
    optimised(sites)
    assert searched == ["hall.site.toml", "paper.site.toml"]
    searched.clear()
    optimised(sites, crane="luffing")
    assert len(searched) == 3
    assert optimised(sites, crane="luffing", fresh=True)["kept"] == 0


def test_the_command_takes_several_sites(sites: list[Path], searched: list[str], capsys: pytest.CaptureFixture[str]):
    arguments = ["optimise", str(sites[0]), str(sites[2]), "--jobs", "1", "-o", str(sites[0].parent / "out")]
    assert command([*arguments, "--json"]) == 0
    assert [one["name"] for one in json.loads(capsys.readouterr().out)["sites"]] == ["yard", "paper"]
    assert command(arguments) == 0
    assert "2, 2 of them kept" in capsys.readouterr().out
