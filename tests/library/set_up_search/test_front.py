"""The front holds what no other set-up beats, and every loser says why."""

from __future__ import annotations

import numpy as np
from box_sites import test_crane as crane_of
from hypothesis import given
from hypothesis import strategies as st

from bimvox.library.set_up_search.front import front_of, proven_front, spread, to_plan, why_beaten, why_lost
from bimvox.library.set_up_search.search import Tried

CRANE = crane_of(base=(0.0, 0.0, 0.0), jib=40.0, height=30.0)


def tried(served: int, crane_s: float, size: float, name: str = "m", *, placed: bool = True, over: str = "") -> Tried:
    none = np.zeros(0)
    return Tried(
        name,
        40.0,
        2,
        size,
        CRANE if placed else None,
        served,
        crane_s,
        np.zeros((0, 2)),
        none.astype(int),
        none,
        "why",
        size,
        0.5,
        over,
    )


some = st.lists(
    st.builds(
        tried,
        st.integers(0, 3),
        st.floats(0.0, 1e5),
        st.floats(1.0, 500.0),
        st.sampled_from("abc"),
        placed=st.booleans(),
        over=st.sampled_from(["", "", "costs more than the budget"]),
    ),
    max_size=12,
)


@given(some)
def test_no_set_up_beats_one_of_the_front_and_all_others_are_beaten(found: list[Tried]) -> None:
    front = front_of(found)
    able = [one for one in found if one.crane is not None and not one.over]
    most = max((one.served for one in able), default=0)
    for one in front:
        assert one.served == most > 0
        assert not any(
            other.served >= one.served
            and other.crane_s <= one.crane_s
            and other.cost <= one.cost
            and (other.crane_s, other.cost) != (one.crane_s, one.cost)
            for other in able
        )
    assert [one.crane_s for one in front] == sorted(one.crane_s for one in front)
    for one in found:
        in_front = any(one is other for other in front)
        assert bool(why_lost(one, front)) is not in_front
    assert bool(front) is any(one.served for one in able)
    assert all(why_lost(one, front) == one.over for one in found if one.over)


@given(some, st.integers(1, 5))
def test_a_few_of_the_front_hold_its_fastest_and_its_cheapest(found: list[Tried], most: int) -> None:
    front = front_of(found)
    few = spread(front, most)
    assert len(few) == min(most, len(front))
    if front:
        assert few[0] is front[0]
    if most > 1 and front:
        assert few[-1] is front[-1]


@given(some, st.integers(1, 5))
def test_what_is_planned_begins_with_the_front_then_other_machines(found: list[Tried], most: int) -> None:
    front = front_of(found)
    chosen = to_plan(found, front, most)
    few = spread(front, most)
    assert chosen[: len(few)] == few
    able = [one for one in found if one.crane is not None and not one.over]
    able = [one for one in able if front and one.served == front[0].served]
    assert len(chosen) == min(most, len(able))
    assert len({id(one) for one in chosen}) == len(chosen)
    if len({one.machine for one in able}) >= most:
        assert len({one.machine for one in chosen[len(few) :]}) == len(chosen[len(few) :])


plans = st.lists(
    st.builds(
        lambda refused, hours, cost: {
            "machine": "m",
            "jib_m": 40.0,
            "refused": refused,
            "hours": hours,
            "cost": cost,
            "error": None if hours is not None else {"message": "no path"},
        },
        st.integers(0, 2),
        st.none() | st.floats(0.1, 100.0),
        st.floats(1.0, 100.0),
    ),
    max_size=8,
)


@given(plans, st.none() | st.floats(10.0, 90.0))
def test_no_plan_beats_one_of_the_proven_front_and_the_others_say_why(planned: list, budget: float | None) -> None:
    front = proven_front(planned, budget)
    able = [one for one in planned if one["hours"] is not None and (budget is None or one["cost"] <= budget)]
    assert bool(front) is bool(able)
    for one in front:
        assert one["refused"] == min(other["refused"] for other in able)
        assert not any(
            other["refused"] <= one["refused"]
            and other["hours"] <= one["hours"]
            and other["cost"] <= one["cost"]
            and (other["hours"], other["cost"]) != (one["hours"], one["cost"])
            for other in able
        )
    assert all(why_beaten(one, front, budget) for one in planned if not any(one is other for other in front))
