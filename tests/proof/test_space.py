from operator import gt, lt

import numpy as np
import pytest
from crane_rooms import FRAME, SHAPE
from named_cranes import default_crane

from bimvox.crane.kinematics import hook_of
from bimvox.proof.moment import NO_SOLID, Thing, beside
from bimvox.proof.space import BETWEEN_VOX, Marks, Placements, RawCells, reference_cells, tail_of, way_of
from bimvox.records.lift import Lift, Status

CRANE = default_crane("hammerhead-30", (0.0, 0.0, 0.0), 16.0)
OWN = np.array([[0, 0, 0], [1, 0, 0], [1, 0, 2]], np.int32)


def some_axes(rng, count):
    steps = rng.normal(0.0, (0.02, 0.2, 0.2), (count, 3))
    steps[rng.random(count) < 0.2] = 0.0
    return np.array([0.3, 8.0, 6.0]) + np.cumsum(steps, axis=0)


def test_a_way_holds_every_sample_and_points_on_the_chords_an_eighth_of_a_cell_apart():
    axes = some_axes(np.random.default_rng(0), 60)
    way = way_of(CRANE, axes, FRAME.voxel_size_m)
    at = np.flatnonzero(way.slack_vox < BETWEEN_VOX)
    assert np.array_equal(way.axes[at], axes)
    assert np.array_equal(way.sample[at], np.arange(60))
    hook_m = hook_of(CRANE, *way.axes.T)
    # The chord is straight in the axes; the hook travels slightly further where the jib slews.
    assert np.linalg.norm(np.diff(hook_m, axis=0), axis=1).max() <= 0.125 * FRAME.voxel_size_m * 1.01
    for n in range(59):
        between = way.axes[way.sample == n]
        share = np.arange(len(between)) / len(between)
        assert np.allclose(between, axes[n] + share[:, None] * (axes[n + 1] - axes[n]))


def test_a_load_hangs_below_the_hook_by_its_slings():
    axes = np.array([[0.0, 8.0, 6.0], [np.pi / 2.0, 4.0, 5.0]])
    cells = reference_cells(CRANE, FRAME, axes, (3, 0, 2))
    foot_m = np.array([[8.0, 0.0, 6.0 - CRANE.sling_m], [0.0, 4.0, 5.0 - CRANE.sling_m]])
    assert np.allclose(FRAME.corner_of(cells + np.array([3.5, 0.5, 2.0])), foot_m)


def test_the_tail_is_the_last_of_the_way_within_the_moves_in_contact():
    path = np.array([[0, 0, 9], [0, 0, 8], [0, 0, 7], [0, 0, 6]], np.int32)
    lift = Lift(0, 0, None, Status.PLANNED, path_vox=path, contact_moves=2)
    cells = np.array([[0.0, 0.0, 8.0], [0.0, 0.2, 8.0], [0.0, 0.0, 8.04], [0.0, 0.0, 7.5], [0.01, 0.0, 6.0]])
    assert tail_of(cells, lift).tolist() == [False, False, True, True, True]
    assert not tail_of(cells, None).any()
    assert not tail_of(cells, Lift(0, 0, None, Status.PLANNED, path_vox=path)).any()
    assert tail_of(cells[2:], Lift(0, 0, None, Status.PLANNED, path_vox=path, contact_moves=99)).all()


def test_a_load_on_its_way_to_where_its_last_moves_begin_is_in_transit_even_within_the_box_around_them():
    path = np.array([[6, 1, 5], [5, 1, 5], [5, 1, 4], [5, 1, 3], [4, 1, 3], [3, 1, 3]], np.int32)
    lift = Lift(0, 0, None, Status.PLANNED, path_vox=path, contact_moves=4)
    above = np.array([[3.4, 1.0, 5.0], [4.2, 1.0, 5.0], [4.9, 1.0, 5.0]])
    on_line = np.array([[5.0, 1.0, 5.0], [5.0, 1.04, 3.6], [5.0, 1.0, 3.0], [4.5, 0.97, 3.0], [3.0, 1.0, 3.0]])
    assert tail_of(np.concatenate([above, on_line]), lift).tolist() == [False] * 3 + [True] * 5


def test_a_placement_that_is_not_inside_the_grid_is_not_held_and_meets_nothing():
    low, high = np.array([0, 0, 0]), np.array(SHAPE) - 1
    cells = RawCells(SHAPE, (Thing("both corners", np.array([low, high], np.int32), NO_SOLID),))
    positions = np.array(
        [[0, 0, 0], [-1, 0, 0], [0, 0, -2], [38, 39, 21], [38, 39, 22], [39, 39, 21], [5, 5, 5]], float
    )
    placements = Placements(positions, np.full(len(positions), 1e-5))
    inside = ((placements.cells >= 0) & (placements.cells + OWN.max(axis=0) < SHAPE)).all(axis=1)
    assert np.array_equal(cells.holds(placements, OWN), inside)
    assert placements.at_positions(inside).tolist() == [True, False, False, True, False, False, True]
    met = placements.at_positions(cells.meets(placements, OWN))
    assert met.tolist() == [True, False, False, True, False, False, False]


def test_a_hook_line_meets_what_is_above_the_hook():
    cells = RawCells(SHAPE, (Thing("slab", np.array([[3, 3, 9]], np.int32), NO_SOLID),))
    placements = Placements(np.array([[2.0, 3.0, 5.0], [2.0, 3.0, 8.0], [2.0, 3.5, 5.0]]), np.full(3, 1e-5))
    assert placements.at_positions(cells.line_meets(placements, (1, 0, 1))).tolist() == [True, True, True]
    assert not cells.line_meets(placements, (1, 0, 5)).all()
    assert not cells.line_meets(placements, (0, 0, 0)).any()


CELLS = (6, 5, 8)


def thing(name, *cells):
    return Thing(name, np.array(cells, np.int32).reshape(-1, 3), NO_SOLID)


def random_things(rng, count):
    return [thing(str(n), *np.unique(rng.integers(0, 5, (rng.integers(1, 9), 3)), axis=0)) for n in range(count)]


def counted(things):
    counts = np.zeros(CELLS, int)
    for one in things:
        counts[tuple(one.cells.T)] += 1
    return counts


def test_they_are_the_current_objects_whatever_was_there_before():
    rng = np.random.default_rng(0)
    things, marks = random_things(rng, 12), Marks(CELLS)
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
    marks = Marks(CELLS, (one, other))
    with marks.without([one, one]):
        assert np.array_equal(marks.counts, counted([other]))
        with marks.without([one, other]):
            assert not marks.counts.any()
    assert np.array_equal(marks.counts, counted([one, other]))


def test_what_is_outside_the_grid_obstructs_nothing():
    marks = Marks(CELLS, (thing("out", (-1, 0, 0), (0, 5, 0), (5, 4, 7), (0, 0, 8)),))
    assert marks.counts.sum() == marks.counts[5, 4, 7] == 1


def test_placements_hit_where_any_cell_of_the_part_is_occupied():
    rng = np.random.default_rng(1)
    marks = Marks(CELLS, tuple(random_things(rng, 3)))
    own = np.array([[0, 0, 0], [1, 0, 0], [1, 0, 2]], np.int32)
    placements = rng.integers(0, (4, 5, 6), (40, 3))
    wanted = [bool(marks.counts[tuple((own + place).T)].any()) for place in placements]
    assert 0 < sum(wanted) < len(wanted)
    assert marks.hits(own, placements).tolist() == wanted
    assert not marks.hits(own, np.array([[-9, 0, 0]])).any()


def test_over_a_hook_is_what_is_in_its_column_from_its_cell_up():
    marks = Marks(CELLS, (thing("low", (1, 1, 2)), thing("high", (2, 2, 7))))
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


def around(position, slack):
    low, high = np.floor(position + slack), np.ceil(position - slack)
    return {tuple(np.where(corner, high, low).astype(int).tolist()) for corner in np.ndindex(2, 2, 2)}


def walk(rng, count, step):
    return rng.normal(0.0, 3.0, 3) + np.cumsum(rng.normal(0.0, step, (count, 3)), axis=0)


@pytest.mark.parametrize(("count", "step"), [(1, 0.1), (300, 0.1), (300, 4.0), (3000, 2.0)])
def test_they_are_the_whole_cells_on_every_side_of_each_position_each_once(count, step):
    rng = np.random.default_rng(count)
    positions = walk(rng, count, step)
    positions[::7] = np.round(positions[::7])
    slack = np.where(rng.random(count) < 0.5, 1e-5, 0.05)
    placements = Placements(positions, slack)
    wanted = [around(position, s) for position, s in zip(positions, slack, strict=True)]
    cells = [tuple(cell) for cell in placements.cells.tolist()]
    assert len(set(cells)) == len(cells)
    assert set(cells) == set().union(*wanted)
    assert [{tuple(cell) for cell in placements.at(n).tolist()} for n in range(count)] == wanted


def test_what_is_found_at_a_placement_is_found_at_the_positions_around_it():
    rng = np.random.default_rng(5)
    positions = walk(rng, 200, 0.3)
    placements = Placements(positions, np.full(200, 0.05))
    assert not placements.at_positions(np.zeros(len(placements.cells), bool)).any()
    found = rng.random(len(placements.cells)) < 0.05
    met = {tuple(cell) for cell in placements.cells[found].tolist()}
    wanted = [bool(around(position, 0.05) & met) for position in positions]
    assert 0 < sum(wanted) < len(wanted)
    assert placements.at_positions(found).tolist() == wanted
