"""``bimvox.optimise`` plans what the search finds: its front is not beaten, and its sites are those of the command."""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path

import pytest
from bimvox_pipeline.optimise import set_up
from bimvox_pipeline.studio.opened import open_site
from rough_search import time_few_lifts

import bimvox
from bimvox.errors import InputError
from bimvox.library.optimise import with_set_up
from bimvox.library.set_up_search.choose import search_set_ups
from bimvox.library.set_up_search.set_up import Effort
from bimvox.progress import SilentProgress
from bimvox.site.catalogue import machines_called
from bimvox.site.crane_guess import machine_of_crane
from bimvox.site.machine import cranes_of

SAMPLES = Path(__file__).parents[2] / "sample_models"


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("optimise")
    shutil.copy(SAMPLES / "frame.ifc", folder)
    path = folder / "frame.site.toml"
    text = bimvox.guess_site(bimvox.read(folder / "frame.ifc"), voxel_size_m=0.5).to_toml()
    path.write_text(text.replace("search = true", "search = false"))
    return path


def test_the_front_is_planned_proven_and_not_beaten_and_its_site_files_load(site: Path) -> None:
    found = bimvox.optimise(site, crane="hammerhead-45", plans=2, trials=0, cranes=1, jobs=1)
    planned = [*found.front, *found.losers]
    assert len(planned) == 2
    assert found.tried > 100
    for one in (found.given, *planned):
        assert one.plan is not None
        assert one.plan.verdict is not None
        assert one.plan.verdict.verified
        assert one.refused == 0
        rows = one.plan.to_dataframe()
        assert one.hours == pytest.approx((rows["start_s"] + rows["duration_s"]).max() / 3600.0)
    for key in ("hours", "cost", "highest_utilisation"):
        assert min(getattr(one, key) for one in found.front) == min(getattr(one, key) for one in planned)
    assert all(one.why_lost for one in found.losers)
    assert not any(one.why_lost for one in found.front)
    written = site.with_name("best.site.toml")
    written.write_text(found.front[0].site.to_toml())
    assert cranes_of(bimvox.load_site(written).config) == found.front[0].site.cranes
    assert repr(found).startswith("<SetUps: ")
    assert "hammerhead-45" in repr(found.front[0])


def test_what_is_stated_of_one_machine_is_not_taken_for_all(site: Path) -> None:
    (given,) = cranes_of(bimvox.load_site(site).config)
    name = machine_of_crane(given).name
    other = next(one for one in machines_called("hammerhead") if one.name != name)
    stated = site.with_name("stated.site.toml")
    stated.write_text(f"{site.read_text()}\n[[support]]\nmat_m2 = 36\n")
    with pytest.raises(InputError, match="every machine") as refused:
        bimvox.optimise(stated)
    assert refused.value.hint is not None and name in refused.value.hint
    stated.write_text(f'{site.read_text()}\n[[support]]\nmachine = "{name}"\nmat_m2 = 36\n')
    config = bimvox.load_site(stated).config
    assert cranes_of(config)[0].foundation_m2 == 36.0
    table = config.one_crane.model_copy(update={"machine": other.name, "jib_length_m": None, "falls": None})
    assert cranes_of(config.model_copy(update={"crane": table}))[0].foundation_m2 is None


def test_for_each_plan_that_refuses_parts_another_set_up_is_planned(
    site: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    time_few_lifts(monkeypatch)
    found = search_set_ups(
        open_site(site), "x", machines_called("hammerhead")[:3], Effort(2, 0, cranes=1), None, SilentProgress()
    )
    planned = [{"hours": 2.0, "refused": 0, "cost": 9.0, "highest_utilisation": 0.5, "second": None}] * 2
    refusing, failed = {**planned[0], "refused": 1}, {**planned[0], "hours": None, "refused": None}
    assert found.instead(planned) == found.instead([refusing, refusing]) == []
    for lost in (refusing, failed):
        (other,) = found.instead([planned[0], lost])
        assert other in found.found
        assert other not in found.chosen
        assert other.served == found.front[0].served
    around = found.around_cheapest((*found.chosen, other), [refusing, failed, planned[0]], Effort(4, 0))
    assert {one.machine for one in around} == {other.machine}


@pytest.mark.slow
@pytest.mark.parametrize("angle_deg", [pytest.param(60, marks=pytest.mark.slow), 20])
def test_its_sites_have_the_cranes_of_the_search_and_of_the_commands_site_files(
    site: Path, monkeypatch: pytest.MonkeyPatch, angle_deg: int
) -> None:
    time_few_lifts(monkeypatch)
    other = site.with_name(f"angle-{angle_deg}.site.toml")
    text = site.read_text().replace("sling_angle_deg = 60", f"sling_angle_deg = {angle_deg}")
    assert f"sling_angle_deg = {angle_deg}" in text
    other.write_text(text)
    opened = open_site(other)
    found = search_set_ups(opened, "x", machines_called("hammerhead")[1:3], Effort(6, 12), None, SilentProgress())
    assert any(one.second for one in found.chosen)
    given_m = cranes_of(opened.config)[0].jib_height_m
    for one in found.lattice:
        # As high as the search takes it to be: with steep slings, loads hang further below the hook.
        assert one.crane is not None
        assert cranes_of(with_set_up(opened, one))[0].jib_height_m == one.crane.jib_height_m
        assert (one.crane.jib_height_m > given_m) == (angle_deg == 20)
    for one in found.found:
        config, theirs = with_set_up(opened, one), opened.with_setup(set_up(opened, one))
        for own, their in zip(cranes_of(config), cranes_of(theirs), strict=True):
            assert replace(own, jib_height_m=their.jib_height_m) == their
            assert own.jib_height_m == pytest.approx(their.jib_height_m, abs=0.002)
        assert (config.areas.yard, config.rules.truckload_kg) == (theirs.areas.yard, theirs.rules.truckload_kg)


@pytest.mark.slow
def test_a_budget_that_nothing_keeps_and_a_site_of_several_cranes_are_refused(site: Path) -> None:
    poor = site.with_name("poor.site.toml")
    poor.write_text(f"{site.read_text()}\n[costs]\nbudget = 1\n")
    with pytest.raises(InputError, match="the cheapest costs"):
        bimvox.optimise(poor, crane="hammerhead-45", trials=0)
    bare = site.with_name("bare.site.toml")
    bare.write_text('[model]\npath = "frame.ifc"\n[crane]\nkind = "none"\n')
    with pytest.raises(InputError, match="has 0"):
        bimvox.optimise(bare)
    for key, value in (("plans", 0), ("trials", -1), ("cranes", 0)):
        with pytest.raises(InputError, match=key):
            bimvox.optimise(site, **{key: value})
    with pytest.raises(InputError, match="site file"):
        bimvox.optimise(3)
