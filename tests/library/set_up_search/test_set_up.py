"""The front holds what no other set-up beats, and every loser says why."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from box_sites import test_crane as crane_of
from hypothesis import given
from hypothesis import strategies as st

from bimvox.library.set_up_search.set_up import (
    Tried,
    ends,
    front_of,
    planned_goals,
    proven_front,
    to_plan,
    why_beaten,
    why_lost,
)

CRANE = crane_of(base=(0.0, 0.0, 0.0), jib=40.0, height=30.0)


def tried(
    served: int,
    crane_s: float,
    size: float,
    name: str = "m",
    highest: float = 0.5,
    *,
    placed: bool = True,
    over: str = "",
) -> Tried:
    none, crane = np.zeros(0), CRANE if placed else None
    places = (np.zeros((0, 2)), none.astype(int), none)
    return Tried(name, 40.0, 2, size, crane, served, crane_s, *places, "why", size, highest, over)


def goals(one: Tried) -> tuple[float, float, float]:
    return one.crane_s, one.cost, round(one.highest, 2)


some = st.lists(
    st.builds(
        tried,
        st.integers(0, 3),
        st.floats(0.0, 1e5),
        st.floats(1.0, 500.0),
        st.sampled_from("abc"),
        st.integers(1, 100).map(lambda percent: percent / 100.0),
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
            and all(theirs <= own for theirs, own in zip(goals(other), goals(one), strict=True))
            and goals(other) != goals(one)
            for other in able
        )
    assert [one.cost for one in front] == sorted(one.cost for one in front), "the cheapest first"
    for one in found:
        in_front = any(one is other for other in front)
        assert bool(why_lost(one, front)) is not in_front
    assert bool(front) is any(one.served for one in able)
    assert all(why_lost(one, front) == one.over for one in found if one.over)


def test_a_set_up_that_is_only_used_less_is_of_the_front() -> None:
    fast, spared, neither = tried(3, 100.0, 5.0), tried(3, 200.0, 9.0, "b", 0.3), tried(3, 200.0, 9.0, "c", 0.52)
    assert front_of([neither, spared, fast]) == [fast, spared]
    assert why_lost(neither, [fast, spared]) == (
        "m with a jib of 40 m takes 0.03 h less, costs 4 less and uses 2 points less of its capacity"
    )
    assert why_lost(tried(3, 100.5, 5.1), [fast]) == "m with a jib of 40 m is as good"
    assert why_lost(tried(3, 101.0, 6.0), [fast]) == "m with a jib of 40 m costs 1 less"


@given(some, st.integers(1, 8))
def test_what_is_planned_begins_with_the_ends_of_the_front_then_other_machines(found: list[Tried], most: int) -> None:
    front = front_of(found)
    chosen = to_plan(found, front, most)
    able = [one for one in found if one.crane is not None and not one.over]
    able = [one for one in able if front and one.served == front[0].served]
    assert len(chosen) == min(most, len(able))
    assert len({id(one) for one in chosen}) == len(chosen)
    if not front:
        return
    few = ends(front, goals, lambda one: one.cranes)
    assert chosen[: len(few)] == few[:most]
    for n in range(3):
        assert min(goals(one)[n] for one in few) == min(goals(one)[n] for one in front)
    assert chosen[0] is front[0]
    if len({one.machine for one in able}) >= most:
        fast = [one for one in chosen if one not in front]
        assert len({one.machine for one in fast}) == len(fast)


def test_of_pairs_the_cheapest_is_planned_too_although_one_crane_alone_is_cheaper() -> None:
    single = tried(3, 300.0, 1.0)
    fast, cheap, between = (
        replace(tried(3, crane_s, cost), second=single) for crane_s, cost in ((100.0, 20.0), (200.0, 2.0), (150.0, 9.0))
    )
    front = front_of([between, single, cheap, fast])
    assert front == [single, cheap, between, fast]
    assert to_plan(front, front, 3) == [single, fast, cheap]


plans = st.lists(
    st.builds(
        lambda refused, hours, cost, highest: {
            "machine": "m",
            "jib_m": 40.0,
            "second": None,
            "refused": refused,
            "hours": hours,
            "cost": cost,
            "highest_utilisation": highest,
            "error": None if hours is not None else {"message": "no path"},
        },
        st.integers(0, 2),
        st.none() | st.floats(0.1, 100.0),
        st.floats(1.0, 100.0),
        st.none() | st.floats(0.1, 1.0),
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
        own = planned_goals(one)
        assert not any(
            other["refused"] <= one["refused"]
            and all(theirs <= mine for theirs, mine in zip(planned_goals(other), own, strict=True))
            and planned_goals(other) != own
            for other in able
        )
    assert all(why_beaten(one, front, budget) for one in planned if not any(one is other for other in front))
