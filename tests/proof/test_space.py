import numpy as np
from crane_rooms import FRAME, SHAPE
from named_cranes import default_crane

from bimvox.crane.kinematics import hook_of
from bimvox.proof.moment import NO_SOLID, Thing
from bimvox.proof.space import BETWEEN_VOX, Placements, RawCells, reference_cells, tail_of, way_of
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
