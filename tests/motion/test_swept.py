import numpy as np
import pytest
from crane_rooms import BEAM_HOOK, FRAME, crane_room, load_is_clear
from hypothesis import given, settings
from hypothesis import strategies as st

from bimvox.crane.kinematics import hook_of
from bimvox.crane.tower_crane import CranePose
from bimvox.grid.summed_area import summed_area_table
from bimvox.motion.move import Line, Move, axes_along, axes_of
from bimvox.motion.swept import (
    _each_is_free,
    _first_hit,
    _stretch_is_free,
    axes_of_cells,
    box_is_free,
    cells_of_axes,
    line_is_free,
    samples_are_free,
    swaying_is_free,
)


def random_move(room, seed):
    rng = np.random.default_rng(seed)
    axes = np.stack([rng.uniform(-1.5, 1.5, 2), rng.uniform(3.0, 9.0, 2), rng.uniform(3.5, 11.0, 2)], axis=1)
    axes[1, 0] = axes[0, 0] + rng.uniform(-1.0, 1.0)
    line = Line.SITE if rng.random() < 0.3 else Line.JOINT
    return Move(CranePose(*axes[0].tolist()), CranePose(*axes[1].tolist()), line)


def test_the_hook_is_over_the_hook_column_one_sling_above_the_load():
    room = crane_room(0)
    cell = np.array([5, 7, 3])
    axes = axes_of_cells(room.load, cell)
    hook_m = hook_of(room.crane, *axes)
    assert hook_m[:2] == pytest.approx(FRAME.centre_of(cell + BEAM_HOOK)[:2])
    assert hook_m[2] == pytest.approx(FRAME.corner_of(cell + BEAM_HOOK)[2] + room.crane.sling_m)
    assert cells_of_axes(room.load, axes) == pytest.approx(cell)


@pytest.mark.slow
@settings(max_examples=120, deadline=None)
@given(st.integers(0, 40), st.integers(0, 10_000))
def test_a_line_is_free_exactly_where_a_dense_look_at_the_raw_cells_says_so(room_seed, seed):
    room = crane_room(room_seed)
    move = random_move(room, seed)
    free = line_is_free(room.space, room.load, axes_of(move.start), axes_of(move.end), move.line is Line.SITE)
    dense = cells_of_axes(room.load, axes_along(room.crane, move, np.linspace(0.0, 1.0, 1500)))
    if free:
        assert all(load_is_clear(room, at) for at in dense)
    else:
        # A refused motion comes within a sixteenth of a cell (plus the dense step) of something.
        assert not all(load_is_clear(room, at, 1 / 16 + 0.02) for at in dense)


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 40), st.integers(0, 10_000))
def test_one_position_is_free_exactly_where_the_raw_cells_are(room_seed, seed):
    room = crane_room(room_seed)
    for share in np.linspace(0.0, 1.0, 25):
        axes = axes_along(room.crane, random_move(room, seed), np.array([share]))
        (at,) = cells_of_axes(room.load, axes)
        assert box_is_free(room.space, *at, *at) == load_is_clear(room, at)


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 40), st.integers(0, 10_000))
def test_between_samples_any_order_of_the_axes_is_covered(room_seed, seed):
    room, rng = crane_room(room_seed), np.random.default_rng(seed)
    first = axes_along(room.crane, random_move(room, seed), np.array([0.5]))[0]
    pair = np.stack([first, first + rng.uniform(-1.0, 1.0, 3) * [0.01, 0.06, 0.06]])
    if samples_are_free(room.space, room.load, pair):
        for shares in rng.random((200, 3)):
            (at,) = cells_of_axes(room.load, (pair[0] + shares * (pair[1] - pair[0]))[None])
            assert load_is_clear(room, at)


@pytest.mark.slow
@settings(max_examples=200, deadline=None)
@given(st.integers(0, 40), st.integers(0, 10_000), st.integers(2, 400), st.floats(0.0, 0.5))
def test_stretches_of_samples_tell_the_same_as_each_sample(room_seed, seed, count, share):
    """A stretch of samples that is free as a whole has only free samples; the first hit is the same."""
    room, rng = crane_room(room_seed), np.random.default_rng(seed)
    axes = axes_along(room.crane, random_move(room, seed), share + np.linspace(0.0, 0.2, count))
    space, load = room.space, room.load
    assert samples_are_free(space, load, axes) == _each_is_free(space, load, axes, 0, count - 1)
    begin, end = sorted(rng.integers(0, count, 2).tolist())
    if _stretch_is_free(space, load, axes, begin, end, 0.0, 0.0):
        assert _each_is_free(space, load, axes, begin, end)
    sway_vox = rng.uniform(-1.0, 1.0, (count, 2)) * rng.random()
    looked_at = rng.random(count) < rng.choice([0.5, 0.9, 1.0])
    for both_sides in (False, True):
        first_hit = _first_hit(space, load, axes, sway_vox, looked_at, both_sides, 0, count)
        assert swaying_is_free(space, load, axes, sway_vox, looked_at, both_sides) == first_hit


def test_a_stretch_around_a_corner_counts_the_bulge_of_its_arc():
    """The box of the ends of an arc does not hold its middle."""
    room = crane_room(0, blocks=0)
    axes = np.stack([np.linspace(-0.5, 0.5, 30), np.full(30, 8.0), np.full(30, 9.0)], axis=1)
    assert samples_are_free(room.space, room.load, axes)
    cells = cells_of_axes(room.load, axes)
    ends_x, middle_x = cells[0, 0], cells[15, 0]
    assert middle_x > ends_x + 1.0
    occupied = room.occupied.copy()
    occupied[int(middle_x) + int(room.space.boxes[:, 3].max()) :] = True
    space = room.space._replace(table=summed_area_table(occupied))
    assert not _stretch_is_free(space, room.load, axes, 0, 29, 0.0, 0.0)
    assert not samples_are_free(space, room.load, axes)


def test_straight_up_a_shaft_of_the_loads_own_width_is_free():
    room = crane_room(0, blocks=0)
    occupied = room.occupied.copy()
    occupied[3:20, 3:10, 1:14] = True
    occupied[6:12, 6:7, 1:] = False
    space = room.space._replace(table=summed_area_table(occupied), hook_floor=np.zeros(occupied.shape[:2], np.int32))
    low, high = axes_of_cells(room.load, np.array([[6, 6, 1], [6, 6, 16]]))
    assert line_is_free(space, room.load, low, high, False)
    beside = axes_of_cells(room.load, np.array([6.05, 6.0, 16.0]))
    assert not line_is_free(space, room.load, low, beside, False)
