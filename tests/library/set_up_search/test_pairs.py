"""Pairs of cranes stand apart, divide the parts, and are beaten where a second crane is not worth it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
import shapely
from rough_search import read_model

from bimvox.library.set_up_search.pairs import may_pair, pairs
from bimvox.library.set_up_search.placed import PlacedSite
from bimvox.library.set_up_search.search import Search
from bimvox.library.set_up_search.set_up import Tried, front_of, why_lost
from bimvox.progress import SilentProgress
from bimvox.site.catalogue import machines_called
from bimvox.site.checks import check_cranes
from bimvox.site.config.site_config import ComponentConfig, ModelConfig
from bimvox.site.guess import guess_site

SAMPLES = Path(__file__).parents[3] / "sample_models"


def placed_site(name: str) -> PlacedSite:
    building = read_model(SAMPLES / name)
    return PlacedSite(guess_site(building, ModelConfig(path=Path(name)), name="site"), building)


@pytest.fixture(scope="module")
def search() -> Search:
    return Search(placed_site("frame.ifc"), SilentProgress())


@pytest.fixture(scope="module")
def found(search: Search) -> list[Tried]:
    return pairs(search, machines_called("hammerhead")[:4])


def test_the_cranes_of_a_pair_stand_clear_of_each_other_and_share_the_parts(search: Search, found: list[Tried]) -> None:
    assert found
    for one in found:
        assert one.second is not None
        assert one.cranes == 2
        cranes = [one.crane, one.second.crane]
        check_cranes(search.config, cranes, search.config.rules_in_force.crane_separation_m)
        assert one.served == len(search.work.masses_kg)
        assert 0 < one.second.served < one.served


def test_each_of_two_cranes_sets_its_parts_one_by_one_and_both_are_paid_for_all_hours(
    search: Search, found: list[Tried]
) -> None:
    setting_s = sum(crew.brace_s + crew.hook_off_s for crew in search.crews)
    rates = {machine.name: search.rates(machine) for machine in machines_called("hammerhead")}
    lorries = next(iter(rates.values())).lorries
    assert lorries > 0.0
    for one in found:
        assert one.second is not None
        assert max(setting_s / 2.0, one.second.crane_s) < one.crane_s < search.work.standing_s.sum() + 3600.0
        hours = one.crane_s / 3600.0
        both = rates[one.machine].total(hours) + rates[one.second.machine].total(hours)
        assert one.cost == pytest.approx(both - lorries), "the lorries come once"


def test_a_pair_is_beaten_by_one_crane_that_is_as_fast_and_cheaper_however_little_it_is_used(
    search: Search, found: list[Tried]
) -> None:
    alone = list(search.tried(machines_called("hammerhead")[:4]))
    pair = min(found, key=lambda one: one.crane_s)
    fastest = min((one for one in alone if one.served == pair.served), key=lambda one: one.crane_s)
    assert pair.crane_s < fastest.crane_s  # here a second crane saves time
    assert pair in front_of([*alone, pair])
    slow = replace(pair, crane_s=fastest.crane_s + 60.0, highest=0.01)
    front = front_of([*alone, slow])
    assert slow not in front
    assert "takes 0.02 h less" in why_lost(slow, front)


def test_no_pair_where_a_load_turns_with_the_jib_or_a_part_names_its_crane(search: Search) -> None:
    config = search.config
    assert may_pair(config)
    rules = config.rules.model_copy(update={"heading": "with_jib"})
    assert not may_pair(config.model_copy(update={"rules": rules}))
    given = ComponentConfig(global_id="x", crane="A")
    assert not may_pair(config.model_copy(update={"component": (given,)}))


def test_a_part_that_its_crane_reaches_only_where_it_does_not_lie_is_served_by_none(
    search: Search, found: list[Tried], monkeypatch: pytest.MonkeyPatch
) -> None:
    pair = found[0]
    far = search.work.rooms.copy()
    far[0] = shapely.Point(1e3, 1e3)
    monkeypatch.setattr(search, "work", replace(search.work, rooms=far))
    fewer = pairs(search, machines_called("hammerhead")[:4])
    assert fewer
    assert all(one.served == pair.served - 1 for one in fewer)
    assert fewer[0].why == f"serve {pair.served - 1} of {pair.served} parts"
