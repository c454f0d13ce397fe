"""After the first plans, other places of the fastest machine and smaller deliveries are planned."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from rough_search import read_model

from bimvox.library.set_up_search import choose
from bimvox.library.set_up_search.choose import better_placed, closer, refined
from bimvox.library.set_up_search.placed import PlacedSite
from bimvox.library.set_up_search.search import Search
from bimvox.library.set_up_search.set_up import Effort, OtherYard, Tried, front_of, to_plan
from bimvox.library.set_up_search.timed import LIFTS
from bimvox.progress import SilentProgress
from bimvox.site.catalogue import machines_called
from bimvox.site.config.rules import CuringConfig
from bimvox.site.config.site_config import ModelConfig
from bimvox.site.guess import guess_site

SAMPLES = Path(__file__).parents[3] / "sample_models"


@pytest.fixture(scope="module")
def search() -> Search:
    building = read_model(SAMPLES / "frame.ifc")
    config = guess_site(building, ModelConfig(path=Path("frame.ifc")), name="site")
    return Search(PlacedSite(config, building), SilentProgress())


def test_hire_is_estimated_with_the_waits_for_joints(search: Search) -> None:
    config, (machine, *_) = search.config, machines_called("mobile")
    cured_h = []
    for hours in (0.0, 16.0, 100.0):
        curing = {name: hours for name in CuringConfig.model_fields if name.endswith("_h")}
        rules = config.rules.model_copy(update={"curing": CuringConfig(floors_wait=True, **curing)})
        placed = PlacedSite(config.model_copy(update={"rules": rules}), read_model(SAMPLES / "frame.ifc"))
        cured_h.append(Search(placed, SilentProgress()).rates(machine).waits_h)
    assert 0.0 <= cured_h[0] <= cured_h[1] < cured_h[2]
    standing_h = float(search.work.standing_s.sum()) / 3600.0
    assert 0.0 < search.least_cost([machine], 8) <= search.rates(machine).total(standing_h)


@pytest.fixture(scope="module")
def best(search: Search) -> Tried:
    return min(search.tried(machines_called("hammerhead-45")), key=lambda one: one.crane_s)


@pytest.mark.slow
def test_half_as_many_again_the_truckload_halved_and_places_apart(search: Search, best: Tried) -> None:
    load, *places = refined(search, best, Effort(8))
    assert load.yard == OtherYard(None, search.config.areas.yard[0], search.config.rules.truckload_kg / 2.0)
    assert load.crane is best.crane
    assert [one.place for one in places] == [2, 3, 4]
    bases = np.array([one.crane.base_m[:2] for one in (best, *places)])
    gaps = np.hypot(*(bases[:, None] - bases[None]).transpose(2, 0, 1))
    assert gaps[np.triu_indices(len(bases), 1)].min() >= 4.0
    for one in places:
        assert one.served == best.served
        assert one.cost == pytest.approx(search.rates_of(one).total(one.crane_s / 3600.0))


@pytest.mark.slow
def test_few_plans_are_not_refined_and_another_yard_keeps_its_number(search: Search, best: Tried) -> None:
    assert refined(search, best, Effort(3)) == []
    assert refined(search, replace(best, crane=None), Effort(8)) == []
    polygon = search.config.areas.yard[0]
    load, *_ = refined(search, replace(best, yard=OtherYard(4, polygon, 12_000.0)), Effort(4))
    assert load.yard == OtherYard(4, polygon, 6_000.0)


def test_a_closer_look_keeps_what_serves_fewer_and_moves_the_fastest_to_a_place_that_is_no_slower(
    search: Search, best: Tried
) -> None:
    fewer = replace(best, served=best.served - 1, crane_s=1.0)
    found, same = closer(search, [best, fewer], 6)
    assert same is fewer
    own = search.from_place(best, np.array(best.crane.base_m[:2]))
    assert own.crane_s > best.crane_s  # the quick estimate knows no swing
    assert (found.served, found.machine) == (best.served, best.machine)
    assert found.crane_s <= own.crane_s
    assert found.cost == pytest.approx(search.rates_of(found).total(found.crane_s / 3600.0))


def test_what_would_be_planned_is_timed_itself_and_is_as_fast_as_if_all_were(
    search: Search, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(choose, "_FASTEST", 2)
    lattice = list(search.tried(machines_called("hammerhead-45")))
    found = closer(search, lattice, 2)
    assert {one.lifts for one in found} == {0, LIFTS}
    assert all(one.lifts == LIFTS for one in to_plan(found, front_of(found), 2))
    every = [search.from_place(one, np.array(one.crane.base_m[:2])) for one in lattice]
    assert min(one.crane_s for one in found) <= 1.001 * min(one.crane_s for one in every)
    for one, timed in zip(found, every, strict=True):
        assert one.lifts or one.crane_s == pytest.approx(timed.crane_s, rel=0.02)


def test_another_yard_is_looked_at_closer_by_its_own_parts_and_only_with_machines_that_carry_them(
    search: Search, best: Tried
) -> None:
    (machine,) = machines_called("hammerhead-45")
    x, y = np.array(search.config.areas.yard[0]).T
    further = OtherYard(3, tuple(zip((x - 14.0).tolist(), (y - 14.0).tolist(), strict=True)), 12_000.0)
    moved = search.with_yard(machine, further)
    found = better_placed(search, moved)
    assert found.yard is further
    assert found.crane_s <= moved.crane_s
    assert found.served == moved.served
    assert found.crane_s > search.from_place(best, np.array(best.crane.base_m[:2])).crane_s  # the yard is further away
    assert search.carries(machine) == len(search.work.masses_kg)
    short = replace(machine, jibs_m=machine.jibs_m[:1], cranes=(replace(machine.cranes[0], jib_length_m=8.0),))
    assert search.carries(short) < len(search.work.masses_kg)
