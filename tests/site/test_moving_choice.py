"""The places of a crane that moves: against every sequence of places of small random problems."""

from __future__ import annotations

import dataclasses
import itertools

import numpy as np
import pytest

from bimvox.site.moving_choice import Stands, carriers, chosen_places, set_up_of_parts

NOTHING = np.zeros(0, np.int64)


def stands_of(served: list[list[int]], taken: list[list[int]] | None = None) -> Stands:
    able = np.array(served, np.bool_)
    there = np.zeros_like(able) if taken is None else np.array(taken, np.bool_)
    return Stands(able, there, np.ones(able.shape), np.zeros(able.shape[1], np.bool_))


def test_the_fewest_places_that_serve_every_part_are_chosen() -> None:
    stands = stands_of([[1, 1, 0, 0], [0, 1, 1, 0], [0, 0, 1, 1], [1, 0, 0, 0]])
    found = chosen_places(stands, [NOTHING] * 4, range(4), 10)
    assert sorted(found) == [0, 2]
    assert len(chosen_places(stands, [NOTHING] * 4, range(4), 1)) == 1
    assert chosen_places(stands_of([[0, 0]]), [NOTHING] * 2, range(2), 10) == []


def test_the_crane_backs_out_of_where_parts_will_stand() -> None:
    """Part 0 is reached only from place 0, on which part 1 will stand; place 1 reaches that one."""
    stands = stands_of([[1, 1], [0, 1]], taken=[[0, 1], [0, 0]])
    found = chosen_places(stands, [NOTHING] * 2, range(2), 10)
    assert found == [0, 1]
    assert set_up_of_parts(stands, [NOTHING] * 2, range(2), found).tolist() == [0, 1]
    assert set_up_of_parts(stands, [NOTHING] * 2, range(2), [1, 0]).tolist() == [1, -1]
    assert set_up_of_parts(stands_of([[1, 1]], taken=[[0, 1]]), [NOTHING] * 2, range(2), [0]).tolist() == [0, -1]


def test_nothing_comes_before_what_it_rests_on() -> None:
    stands = stands_of([[0, 1], [1, 0]])
    under = [NOTHING, np.array([0])]
    assert set_up_of_parts(stands, under, range(2), [0, 1]).tolist() == [1, -1]
    assert chosen_places(stands, under, range(2), 10) == [1, 0]


def test_the_crane_comes_back_for_what_rests_on_what_is_cast_meanwhile() -> None:
    """Part 2 is a slab that is cast on walls 0 and 1, which two places serve; walls 3 and 4 stand on it."""
    stands = stands_of([[1, 0, 0, 1, 0], [0, 1, 0, 0, 1]])
    stands = dataclasses.replace(stands, free=np.arange(5) == 2)
    under = [NOTHING, NOTHING, np.array([0, 1]), np.array([2]), np.array([2])]
    found = chosen_places(stands, under, range(5), 10)
    assert len(found) == 3
    assert set_up_of_parts(stands, under, range(5), found).tolist()[2] == 1
    # What is cast where the crane stands last is cast when it has left; nothing is lifted onto it.
    taken = dataclasses.replace(stands_of([[1, 0, 1]], taken=[[0, 1, 0]]), free=np.arange(3) == 1)
    assert set_up_of_parts(taken, [NOTHING, NOTHING, np.array([1])], range(3), [0]).tolist() == [0, 1, -1]


def test_parts_are_carried_by_what_is_under_them() -> None:
    bounds_m = np.array(
        [
            [[0.0, 0.0, 0.0], [1.0, 1.0, 3.0]],
            [[0.0, 0.0, 3.05], [5.0, 5.0, 3.3]],
            [[4.0, 4.0, 0.0], [5.0, 5.0, 3.0]],
            [[9.0, 9.0, 3.05], [10.0, 10.0, 3.3]],
        ]
    )
    assert [under.tolist() for under in carriers(bounds_m)] == [[], [0, 2], [], []]


def test_a_ramp_comes_before_the_slab_that_would_shut_it_in() -> None:
    slab, ramp = [[-17.0, -9.0, 0.17], [26.0, 15.0, 0.32]], [[0.0, 7.0, 0.0], [4.0, 8.0, 1.8]]
    assert [before.tolist() for before in carriers(np.array([slab, ramp]))] == [[1], []]


def test_another_place_is_taken_back_if_two_others_serve_more() -> None:
    """Place 0 serves most by itself, but with it no second one serves more; places 1 and 2 serve all."""
    stands = stands_of([[1, 1, 1, 1, 0, 0], [1, 1, 0, 0, 1, 0], [0, 0, 1, 1, 0, 1]])
    assert sorted(chosen_places(stands, [NOTHING] * 6, range(6), 2)) == [1, 2]


@pytest.mark.parametrize("seed", range(12))
def test_no_sequence_of_two_places_serves_more_than_what_is_chosen(seed: int) -> None:
    random = np.random.default_rng(seed)
    places, parts = 7, 9
    served = random.random((places, parts)) < 0.45
    taken = (random.random((places, parts)) < 0.1) & ~served
    stands = Stands(served, taken, random.uniform(5.0, 20.0, served.shape), random.random(parts) < 0.2)
    under = [random.choice(part, min(part, 1), replace=False).astype(np.int64) for part in range(parts)]
    found = chosen_places(stands, under, range(parts), 10)

    def served_by(places) -> int:
        return int((set_up_of_parts(stands, under, range(parts), places)[~stands.free] >= 0).sum())

    count = served_by(found)
    # As good as any sequence of at most two places, and it needs no place that it could do without.
    for steps in (1, 2):
        for other in itertools.permutations(range(places), steps):
            assert served_by(other) <= count
    for at in range(len(found)) if len(found) > 1 else ():
        assert served_by(found[:at] + found[at + 1 :]) < count
