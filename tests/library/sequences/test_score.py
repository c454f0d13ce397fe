import pytest

from bimvox.library.sequences.baselines import BASELINES, trade, without_search
from bimvox.library.sequences.score import score
from bimvox.library.sequences.suite import sequence_problems
from bimvox.planning.given_order import PartToOrder
from bimvox.progress import SilentProgress

SMALL = sequence_problems()["small"]


def of(order, problem=SMALL[0]):
    (found,) = score("mine", lambda site: (site, order), [problem], SilentProgress()).buildings
    return found


def test_the_order_of_a_foreman_is_proven_and_takes_longer_than_the_bound():
    found = of(trade)
    assert (found.lifts, found.proven, found.reason) == (5, 5, None)
    assert found.makespan_s > found.least_s > 0
    assert found.ratio == pytest.approx(found.makespan_s / found.least_s, abs=1e-4)


def test_an_order_that_fails_costs_its_building_only():
    made = score("mine", lambda site: (site, lambda parts: []), SMALL[:2], SilentProgress())
    assert (made.solved, made.ratio, len(made.buildings)) == (0, None, 2)
    assert made.buildings[0].reason.startswith("order: 5 of 5 parts missing")
    assert made.buildings[0].makespan_s is None


def test_an_exact_order_is_for_few_parts_only():
    made = score("exact", BASELINES["exact"], [SMALL[0], *sequence_problems()["storeys"][:1]], SilentProgress())
    (found,) = made.buildings
    assert found.problem == "small-0"
    assert found.makespan_s <= of(trade).makespan_s + 5.0  # an estimate chose it


def test_trades_follow_each_other_storey_by_storey():
    def part(name, ifc_class, at, *after):
        return PartToOrder(name, name, ifc_class, 1.0, at, True, after, (), storey=f"Storey {int(at[2] // 3)}")

    parts = (
        part("beam", "IfcBeam", (0.0, 0.0, 2.5), "west", "east"),
        part("above", "IfcColumn", (0.0, 0.0, 3.0), "west"),
        part("east", "IfcColumn", (5.0, 0.0, 0.0)),
        part("west", "IfcColumn", (0.0, 0.0, 0.0)),
    )
    assert trade(parts) == ["west", "east", "beam", "above"]


def test_greedy_is_the_engine_without_its_search():
    assert not without_search(SMALL[0].site()).site.rules.order_search
