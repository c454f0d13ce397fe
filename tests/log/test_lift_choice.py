from __future__ import annotations

import dataclasses

import pytest
from log_building import tiny_log

from bimvox.errors import SelectionError
from bimvox.log.plan_log import PlanLog, chosen_lift, chosen_lifts


def renamed(log: PlanLog, *names: str) -> PlanLog:
    """Return a log whose parts have these names."""
    site = log.plan.site
    parts = zip(site.components, names, strict=True)
    components = tuple(dataclasses.replace(part, name=name) for part, name in parts)
    plan = dataclasses.replace(log.plan, site=dataclasses.replace(site, components=components))
    return dataclasses.replace(log, plan=plan)


@pytest.mark.parametrize(
    ("names", "orders"),
    [
        ([], (0, 1, 2)),
        (["3"], (2,)),
        (["0GlobalIdBeam"], (2,)),
        (["0GlobalIdBeam", "1", "3"], (0, 2)),
    ],
)
def test_lifts_are_named_by_id_or_by_number_from_1(names: list[str], orders: tuple[int, ...]) -> None:
    assert chosen_lifts(tiny_log(), names) == orders
    assert all((chosen_lift(tiny_log(), name),) == chosen_lifts(tiny_log(), [name]) for name in names)


@pytest.mark.parametrize("number", ["0", "4", "-1"])
def test_a_number_out_of_range_is_an_error_that_names_the_range(number: str) -> None:
    for choose in (lambda: chosen_lifts(tiny_log(), [number]), lambda: chosen_lift(tiny_log(), number)):
        with pytest.raises(SelectionError, match=f"there is no lift {number} in this log") as caught:
            choose()
        assert caught.value.hint == "its lifts are numbered 1 to 3"


def test_an_extract_says_that_its_numbers_have_gaps_and_shows_what_it_does_not_carry() -> None:
    part = tiny_log().extract([0, 2])
    with pytest.raises(SelectionError) as caught:
        chosen_lifts(part, ["2"])
    assert caught.value.hint == "its lifts are numbered 1 to 3, with gaps (it is an extract)"
    assert chosen_lift(part, "2") == 1


def test_an_unknown_lift_names_the_nearest_ones() -> None:
    with pytest.raises(SelectionError, match="no lift '0GlobalIdBaem' in this log of 3 lifts") as caught:
        chosen_lifts(tiny_log(), ["0GlobalIdBaem"])
    assert caught.value.hint is not None
    assert "0GlobalIdBeam" in caught.value.hint


def test_a_part_goes_by_its_name_unless_several_have_it() -> None:
    log = renamed(tiny_log(), "C1", "B1", "B1")
    assert chosen_lifts(log, ["C1"]) == (0,)
    with pytest.raises(SelectionError, match="2 lifts are of parts called 'B1'") as caught:
        chosen_lifts(log, ["B1"])
    assert caught.value.hint == "give the lift's number: 2, 3"
