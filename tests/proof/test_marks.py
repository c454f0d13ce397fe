from operator import gt, lt

import numpy as np

from bimvox.proof.moment import NO_SOLID, Thing, beside
from bimvox.proof.space import Marks

SHAPE = (6, 5, 8)


def thing(name, *cells):
    return Thing(name, np.array(cells, np.int32).reshape(-1, 3), NO_SOLID)


def random_things(rng, count):
    return [thing(str(n), *np.unique(rng.integers(0, 5, (rng.integers(1, 9), 3)), axis=0)) for n in range(count)]


def counted(things):
    counts = np.zeros(SHAPE, int)
    for one in things:
        counts[tuple(one.cells.T)] += 1
    return counts


def test_they_are_the_current_objects_whatever_was_there_before():
    rng = np.random.default_rng(0)
    things, marks = random_things(rng, 12), Marks(SHAPE)
    for _ in range(30):
        present = tuple(one for one in things if rng.random() < 0.5)
        marks.move_to(present)
        assert np.array_equal(marks.counts, counted(present))
        gone = [one for one in things if rng.random() < 0.3]
        with marks.without(gone):
            assert np.array_equal(marks.counts, counted([one for one in present if one not in gone]))
        assert np.array_equal(marks.counts, counted(present))


def test_what_is_removed_twice_is_removed_once():
    one, other = thing("one", (1, 1, 1)), thing("other", (1, 1, 1), (2, 2, 2))
    marks = Marks(SHAPE, (one, other))
    with marks.without([one, one]):
        assert np.array_equal(marks.counts, counted([other]))
        with marks.without([one, other]):
            assert not marks.counts.any()
    assert np.array_equal(marks.counts, counted([one, other]))


def test_what_is_outside_the_grid_obstructs_nothing():
    marks = Marks(SHAPE, (thing("out", (-1, 0, 0), (0, 5, 0), (5, 4, 7), (0, 0, 8)),))
    assert marks.counts.sum() == marks.counts[5, 4, 7] == 1


def test_placements_hit_where_any_cell_of_the_part_is_occupied():
    rng = np.random.default_rng(1)
    marks = Marks(SHAPE, tuple(random_things(rng, 3)))
    own = np.array([[0, 0, 0], [1, 0, 0], [1, 0, 2]], np.int32)
    placements = rng.integers(0, (4, 5, 6), (40, 3))
    wanted = [bool(marks.counts[tuple((own + place).T)].any()) for place in placements]
    assert 0 < sum(wanted) < len(wanted)
    assert marks.hits(own, placements).tolist() == wanted
    assert not marks.hits(own, np.array([[-9, 0, 0]])).any()


def test_over_a_hook_is_what_is_in_its_column_from_its_cell_up():
    marks = Marks(SHAPE, (thing("low", (1, 1, 2)), thing("high", (2, 2, 7))))
    hooks = [[1, 1, 2], [1, 1, 3], [1, 1, -3], [2, 2, 0], [2, 2, 7], [2, 2, 8], [0, 0, 0], [-1, 0, 0], [1, 5, 0]]
    assert marks.over(np.array(hooks)).tolist() == [True, False, True, True, True, False, False, False, False]


def test_things_beside_a_box_are_those_that_are_not_apart_from_it():
    rng = np.random.default_rng(2)
    things = [*random_things(rng, 20), thing("nothing")]
    for _ in range(20):
        low = rng.integers(0, 5, 3).tolist()
        high = [n + int(rng.integers(0, 3)) for n in low]
        assert beside(things, low, high) == [
            one for one in things if not any(map(gt, one.low, high)) and not any(map(lt, one.high, low))
        ]
