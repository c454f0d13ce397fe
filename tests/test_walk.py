"""The walk: what a step finds does not depend on what was done before, nor on the store or the number of processes."""

from __future__ import annotations

import pickle
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bimvox.walk import Store, Walk, at_rest
from bimvox.workers import ALONE, Workers


@dataclass(eq=False)
class Site:
    """Something that is equal only to itself."""

    start: int = 7


@dataclass(eq=False)
class Sums(Walk[list[int], tuple[int, int], int]):
    """Adds numbers: the state is the sum so far; a step returns it times a factor."""

    site: Site
    numbers: tuple[int, ...]

    @property
    def roots(self):
        return (self.site,)

    @property
    def passed(self) -> Sequence[int]:
        return self.numbers

    @cached_property
    def made(self):
        return []

    def begin(self):
        return [self.site.start]

    def go_past(self, state, turn, until):
        assert turn < until
        state[0] += self.numbers[turn]

    def turn_of(self, task):
        return task[0]

    def step(self, state, task):
        self.made.append(task)
        return state[0] * task[1]

    def right(self, task):
        return (self.site.start + sum(self.numbers[: task[0]])) * task[1]


SITE = Site()
numbers = st.lists(st.integers(-3, 3), min_size=1, max_size=8).map(tuple)


def tasks_of(walk):
    return st.lists(st.tuples(st.integers(0, len(walk.numbers)), st.integers(1, 3)), max_size=12)


@given(st.data())
def test_any_walks_after_each_other_find_what_each_finds_alone(data):
    store = Store()
    for _ in range(data.draw(st.integers(1, 4))):
        walk = Sums(data.draw(st.sampled_from([SITE, Site(8)])), data.draw(numbers))
        tasks = data.draw(tasks_of(walk))
        assert walk.results(sorted(tasks), store, ALONE) == [walk.right(task) for task in sorted(tasks)]
        assert walk.steps(tasks) == [walk.right(task) for task in tasks], "in any order"


def test_a_step_is_made_once_until_something_before_it_differs():
    store, walk = Store(), Sums(SITE, (1, 2, 3))
    tasks = [(1, 1), (2, 1), (3, 1)]
    walk.results(tasks, store, ALONE)
    again = Sums(SITE, (1, 2, 3))
    assert again.results(tasks, store, ALONE) == [8, 10, 13]
    assert again.made == []
    other = Sums(SITE, (1, 5, 3))
    assert other.results(tasks, store, ALONE) == [8, 13, 16]
    assert other.made == tasks[1:]
    elsewhere = Sums(Site(), (1, 2, 3))
    assert elsewhere.results(tasks, store, ALONE) == [8, 10, 13]
    assert elsewhere.made == tasks, "another site is another, however alike"


def test_a_walk_goes_on_from_where_one_that_began_alike_stands():
    at_rest(Sums)
    Sums(SITE, (1, 2, 3)).steps([(2, 1)])
    on = Sums(SITE, (1, 2, 9, 4))
    passed = []
    on.go_past = lambda state, turn, until: passed.append(turn) or Sums.go_past(on, state, turn, until)
    assert on.steps([(4, 1)]) == [7 + 16]
    assert passed == [2, 3]
    assert on.steps([(1, 1)]) == [8], "an earlier turn is reached from the beginning"
    assert passed == [2, 3, 0]


def test_with_the_store_off_every_step_is_made_with_the_same_result(monkeypatch):
    tasks, on = [(1, 1), (2, 2)], Sums(SITE, (1, 2))
    expected = on.results(tasks, Store(), ALONE)
    monkeypatch.setenv("BIMVOX_STORE", "off")
    store, walk = Store(), Sums(SITE, (1, 2))
    assert walk.results(tasks, store, ALONE) == walk.results(tasks, store, ALONE) == expected
    assert walk.made == 2 * tasks
    made = []
    assert [store.once(b"key", lambda: made.append(1)) for _ in range(2)] == [None, None]
    assert made == [1, 1]


def test_another_process_begins_a_walk_by_its_fields():
    walk = Sums(SITE, (1, 2))
    walk.steps([(1, 1)])
    again = pickle.loads(pickle.dumps(walk))
    assert (again.site.start, again.numbers) == (7, (1, 2))
    assert vars(again).keys() == {"site", "numbers"}


def test_processes_share_the_steps():
    workers = Workers(2, (Walk.steps,))
    try:
        walk = Sums(SITE, tuple(range(40)))
        tasks = [(n, 2) for n in range(40)]
        with workers.knowing(SITE):
            assert walk.results(tasks, Store(), workers) == [walk.right(task) for task in tasks]
    finally:
        workers.close()


@dataclass(frozen=True, eq=False)
class Way:
    cells: np.ndarray
    name: str


@pytest.mark.parametrize(
    ("one", "other", "same"),
    [
        (1, 1, True),
        (1, 1.0, False),
        (1, True, False),
        ("a", b"a", False),
        (("ab", "c"), ("a", "bc"), False),
        ((1, (2,)), ((1, 2),), False),
        (frozenset({1, 2}), frozenset({2, 1}), True),
        ({"a": 1}, {"a": 1}, True),
        ({"a": 1}, {"a": 2}, False),
        (np.arange(3), np.arange(3), True),
        (np.arange(3), np.arange(3.0), False),
        (np.zeros((2, 3)), np.zeros((3, 2)), False),
        (np.int32(1), np.int32(1), True),
        (Way(np.arange(3), "x"), Way(np.arange(3), "x"), True),
        (Way(np.arange(3), "x"), Way(np.arange(4), "x"), False),
        (object(), object(), False),
        (SITE, Site(), True),
    ],
)
def test_what_was_read_is_known_by_its_content(one, other, same):
    store = Store()
    assert (store.key(one) == store.key(other)) is same


def test_what_counts_by_identity_is_not_mistaken_for_something_later_at_its_address():
    store, keys = Store(), set()
    for _ in range(200):
        keys.add(store.key(store.itself(object())))
    assert len(keys) == 200
