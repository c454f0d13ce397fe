"""In which set-up each part is lifted: as few as serve all, in the order of the site file."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from moving_sites import box, planned_row, row, row_file

import bimvox
from bimvox.errors import ConfigError
from bimvox.library.hand_over import may_go_to_others, preparation_of
from bimvox.planning.contact.pairs import Contacts
from bimvox.planning.order.relations import OrderGraph, order_graph, precedence
from bimvox.planning.order.set_up_choice import _Choice, set_ups_of, stands_in_the_way
from bimvox.proof.set_ups import verify_set_ups
from bimvox.records.lift import Status


def chosen(reached, after=(), stands=None, away_m=None, these=None):
    """Return the choice for parts with these set-ups within reach; ``after``: pairs (earlier, later)."""
    reached = np.array(reached, bool)
    count, places = reached.shape
    earlier, later = [set() for _ in range(count)], [set() for _ in range(count)]
    for one, other in after:
        earlier[other].add(one)
        later[one].add(other)
    graph = OrderGraph(tuple(map(frozenset, earlier)), tuple(map(frozenset, later)), ())
    away_m = np.zeros((count, places)) if away_m is None else np.array(away_m, float)
    stands = np.zeros((count, places), bool) if stands is None else np.array(stands, bool)
    choice = _Choice(graph, reached, away_m, stands, np.ones(count, bool))
    return choice.among(tuple(range(places)) if these is None else these)


def test_a_part_is_lifted_where_the_crane_is_nearest() -> None:
    assert chosen([[1, 1], [1, 1]], away_m=[[1, 9], [9, 1]]).set_ups == [0, 1]


def test_no_part_is_lifted_before_what_it_needs() -> None:
    found = chosen([[0, 1], [1, 1]], after=[(0, 1)], away_m=[[0, 0], [0, 9]])
    assert found.set_ups == [1, 1] and found.served == 2


def test_a_part_that_needs_a_later_one_is_not_served_in_an_earlier_set_up() -> None:
    assert chosen([[0, 1], [1, 0]], after=[(0, 1)]).served == 1


def test_a_part_is_lifted_early_enough_for_those_that_need_it() -> None:
    found = chosen([[1, 1], [1, 0]], after=[(0, 1)], away_m=[[9, 0], [0, 0]])
    assert found.set_ups == [0, 0] and found.served == 2


def test_a_part_where_the_crane_stands_comes_after_that_set_up() -> None:
    found = chosen([[1, 1], [1, 1]], stands=[[1, 0], [0, 0]], away_m=[[0, 9], [0, 9]])
    assert found.set_ups == [1, 0] and found.served == 2
    assert chosen([[1, 0]], stands=[[1, 0]]).served == 0


def test_the_fewest_set_ups_are_used(tmp_path: Path) -> None:
    places = {"here": (2.0, -5.5), "there": (6.0, -5.5), "far": (34.5, -5.5)}
    loaded = row(tmp_path, places=places, panels=(0.0, 3.0, 6.0))
    site, preparation = preparation_of(loaded.site, free=may_go_to_others(loaded))
    assert len({part.crane for part in site.components}) == 1
    assert [site.components[n].crane for n in preparation.sequence.order] == [site.components[0].crane] * 3


def test_the_order_goes_from_set_up_to_set_up() -> None:
    plan = planned_row().record.plan
    assert all(lift.status is Status.PLANNED for lift in plan.lifts)
    assert [plan.site.components[lift.component].crane for lift in plan.lifts] == [0, 0, 0, 1, 1, 1]
    deliveries = [{lift.place.delivery for lift in half if lift.place} for half in (plan.lifts[:3], plan.lifts[3:])]
    assert deliveries[0].isdisjoint(deliveries[1])


def test_the_site_file_may_name_the_set_up(tmp_path: Path) -> None:
    places = {"here": (2.0, -5.5), "there": (7.0, -5.5)}
    named = '[[component]]\nglobal_id = "panel-1"\nsetup = "there"\n'
    loaded = row(tmp_path, places=places, panels=(0.0, 3.0, 6.0), more=named)
    site, _ = preparation_of(loaded.site, free=may_go_to_others(loaded))
    assert next(part.crane for part in site.components if part.id == "panel-1") == 1


@pytest.mark.parametrize(("at_m", "is_in_the_way"), [((1.5, 2.0), True), ((1.5, -5.5), False)])
def test_a_part_below_the_carrier_is_in_its_way(tmp_path: Path, at_m: tuple[float, float], is_in_the_way: bool) -> None:
    site = row(tmp_path, places={"near": at_m, "east": (34.5, -5.5)}).site
    assert stands_in_the_way(site, 0)[0] == is_in_the_way


def test_what_the_crane_does_not_lift_is_set_when_it_has_left(tmp_path: Path) -> None:
    file = row_file(tmp_path, panels=(0.0, 3.0, 6.0, 30.0, 33.0, 36.0))
    (tmp_path / "row.obj").write_text((tmp_path / "row.obj").read_text() + box("wall", (33, -6, 0), (36, -5, 1), 48))
    kinds = '{ select = "wall", kind = "concrete", means = "in_situ" }'
    file.write_text(file.read_text().replace('kind = "precast" }]', f'kind = "precast" }}, {kinds}]'))
    made = bimvox.plan(bimvox.load_site(file), policy="none", jobs=1)
    assert made.verdict is not None and made.verdict.verified
    assert [made.site.components[lift.component].name for lift in made.record.plan.lifts][-1] == "wall"
    assert sum(lift.status is Status.PLANNED for lift in made.record.plan.lifts) == 6
    steps, moving = made.record.steps, made.site.moving
    assert moving is not None
    (cast,) = steps.steps
    left_ns = steps.ending_ns(made.motions[-1].end_ns) + round(moving.derig_s * 1e9)
    assert cast.begins_ns == left_ns
    early = replace(steps, steps=(replace(cast, begins_ns=left_ns - 60_000_000_000),))
    assert verify_set_ups(made.record.plan, made.motions, steps).passed
    (failure,) = verify_set_ups(made.record.plan, made.motions, early).failures
    assert "where the crane stands in set-up 'east' until" in failure


def test_a_set_up_in_what_exists_is_refused_by_its_key(tmp_path: Path) -> None:
    file = row_file(tmp_path, more='[[component]]\nglobal_id = "old"\npinned = true\n')
    (tmp_path / "row.obj").write_text((tmp_path / "row.obj").read_text() + box("old", (33, -6, 0), (36, -5, 1), 48))
    with pytest.raises(ConfigError, match="the carrier would stand in old") as error:
        bimvox.load_site(file)
    assert error.value.key == "crane.setup[1].base_m"


def test_a_part_that_a_set_up_cannot_lift_goes_to_another_one(tmp_path: Path) -> None:
    site = row(tmp_path, places={"here": (2.0, -5.5), "there": (7.0, -5.5)}, panels=(0.0, 3.0, 6.0)).site
    contacts = Contacts(site)
    graph = order_graph(site, precedence(site, contacts), contacts)
    ids = [part.id for part in site.components]
    usual = set_ups_of(site, graph, ids)
    barred = {(0, usual[0])}
    assert set_ups_of(site, graph, ids, barred)[0] == 1 - usual[0]
