from __future__ import annotations

import itertools

import numpy as np
import pytest
from lift_sites import clearance_of, random_occupancy

from bimvox.env.dynamics import LiftState
from bimvox.env.observation import (
    GOAL_SIZE,
    GOAL_START,
    INPUT_SIZE,
    LEVELS,
    NEAREST_SIZE,
    NEAREST_WINDOW,
    PARTLY,
    TRAIL_SIZE,
    VIEW_SIZE,
    WINDOW,
    WINDOW_SIZE,
    frame_of,
    from_frame,
    look,
)
from bimvox.site.collision import CollisionSpace, placement_is_free

TRAIL = np.zeros((256, 3), np.int32)


def seen(space: CollisionSpace, cell, target=(1, 1, 1), last_action=-1) -> np.ndarray:
    out = np.full(VIEW_SIZE, np.nan, np.float32)
    trail = TRAIL.copy()
    trail[0] = cell
    look(space, np.array(target, np.int32), LiftState(*cell, last_action, 0), trail, out)
    assert np.isfinite(out).all()
    assert np.abs(out).max() <= 1.0
    return out


def level(out: np.ndarray, n: int) -> np.ndarray:
    """Return the cells of a level, without the clear heights."""
    window = WINDOW if n else NEAREST_WINDOW
    first = NEAREST_SIZE + (n - 1) * WINDOW_SIZE if n else 0
    return out[first : first + int(np.prod(window))].reshape(window)


def offsets(window):
    """Yield each index in a window with its offset from the middle."""
    for index in itertools.product(*map(range, window)):
        yield index, tuple(i - n // 2 for i, n in zip(index, window, strict=True))


@pytest.mark.parametrize("rope", [False, True])
@pytest.mark.parametrize("seed", range(4))
def test_nearest_level_is_the_one_rule_of_collision(seed, rope):
    occupied = random_occupancy(seed, (12, 11, 9), 0.1)
    space = clearance_of(occupied, (2, 1, 2), rope=rope)
    for target in ((1, 1, 1), (9, 2, 1), (6, 10, 1)):  # other frames
        out = level(seen(space, (5, 5, 4), target), 0)
        frame = frame_of(target[0] - 5, target[1] - 5)
        for index, (i, j, k) in offsets(NEAREST_WINDOW):
            a, b = from_frame(frame, i, j)
            expected = 0.0 if placement_is_free(space, 5 + a, 5 + b, 4 + k) else 1.0
            assert out[index] == expected


@pytest.mark.parametrize("size", [(1, 1, 1), (7, 1, 2), (12, 5, 11)])
@pytest.mark.parametrize("share", [0.0, 0.002, 0.05])
def test_coarse_levels_are_sure_where_they_say_so(size, share):
    """Without a rope: 0 means that all placements of the block are free, 1 that all are blocked."""
    occupied = random_occupancy(3, (40, 30, 24), share)
    space = clearance_of(occupied, size)
    cell = (15, 12, 6)
    out = seen(space, cell)
    frame = frame_of(1 - cell[0], 1 - cell[1])
    for n, (scale, rise) in enumerate(LEVELS, start=1):
        for index, (i, j, k) in offsets(WINDOW):
            value = level(out, n)[index]
            if 0.0 < value < 1.0:
                continue
            a, b = from_frame(frame, scale * i, scale * j)
            x, y, z = cell[0] + a, cell[1] + b, cell[2] + rise * k
            reach, reach_z = scale // 2, rise // 2
            for u, v, w in itertools.product((-reach, 0, reach), (-reach, 0, reach), (-reach_z, 0, reach_z)):
                assert placement_is_free(space, x + u, y + v, z + w) == (value == 0.0)


def test_a_thin_wall_shows_at_every_scale():
    occupied = np.zeros((80, 80, 40), np.bool_)
    occupied[60, :, :] = True
    out = seen(clearance_of(occupied), (40, 40, 20))
    assert (level(out, 0) == 0.0).all()
    assert all(level(out, n).max() >= PARTLY for n in range(3, len(LEVELS) + 1))  # levels that reach that far


def test_forbidden_hook_blocks_coarse_cells():
    occupied = np.zeros((40, 40, 20), np.bool_)
    space = clearance_of(occupied)
    space.hook_floor[30:, :] = 2**30
    out = seen(space, (20, 20, 10), target=(38, 21, 10))
    a, b = from_frame(frame_of(18, 1), 1, 0)
    assert (a, b) == (1, 0)  # the frame's x is the site's
    assert level(out, 3)[-1].min() == 1.0
    assert level(out, 3)[3, 3, 2] == 0.0


def test_size_does_not_depend_on_site_or_component():
    small = seen(clearance_of(np.zeros((6, 6, 6), np.bool_)), (2, 2, 2))
    large = seen(clearance_of(np.zeros((90, 50, 40), np.bool_), (24, 5, 1)), (30, 20, 10))
    assert small.shape == large.shape == (VIEW_SIZE,)


def test_goal_and_last_action():
    space = clearance_of(np.zeros((30, 30, 30), np.bool_))
    out = seen(space, (10, 10, 10), target=(16, 12, 10), last_action=3)
    goal = out[GOAL_START:][:GOAL_SIZE]
    np.testing.assert_allclose(goal[:3], [1, 1, 0])
    np.testing.assert_allclose(goal[6:9], np.array([np.log(7), np.log(3), 0]) / np.log(1024), rtol=1e-6)
    last = out[INPUT_SIZE - TRAIL_SIZE - 12 :][:6]
    np.testing.assert_array_equal(last, [0, 0, 0, 1, 0, 0])


def test_the_observation_does_not_depend_on_the_place_on_the_site():
    """The observation is egocentric: equal surroundings far from any border give equal observations."""
    near, far = np.zeros((300, 300, 24), np.bool_), np.zeros((300, 300, 24), np.bool_)
    near[148:151, 147:150, 14] = True
    far[153:156, 144:147, 14] = True
    np.testing.assert_array_equal(
        seen(clearance_of(near), (150, 150, 12), target=(155, 150, 12)),
        seen(clearance_of(far), (155, 147, 12), target=(160, 147, 12)),
    )


def test_an_observation_written_over_the_previous_one_of_the_lift_is_the_same():
    space = clearance_of(random_occupancy(5, (24, 20, 12), 0.2), (2, 1, 1))
    target, reused, frames = np.array((12, 10, 6), np.int32), np.full(VIEW_SIZE, np.nan, np.float32), []
    trail = TRAIL.copy()
    for step, cell in enumerate([(4, 4, 3), (5, 4, 3), (12, 4, 3), (18, 5, 3), (20, 15, 8), (19, 15, 8), (3, 18, 2)]):
        trail[step] = cell
        fresh = np.full(VIEW_SIZE, np.nan, np.float32)
        look(space, target, LiftState(*cell, -1, step), trail, fresh)
        look(space, target, LiftState(*cell, -1, step), trail, reused, step > 0)
        np.testing.assert_array_equal(reused, fresh)
        frames.append(float(fresh[-1]))
    assert len(set(frames)) > 2  # the target is seen from several sides
    assert frames[1] == frames[0]


def heights(out: np.ndarray) -> np.ndarray:
    """Return the clear heights of the nearest level."""
    cells = int(np.prod(NEAREST_WINDOW))
    return out[cells:NEAREST_SIZE]


def test_clear_heights_end_where_the_hook_may_not_be_higher():
    """With a limiter or a luffing jib, a column is closed if it can only be crossed above the highest hook."""
    occupied = random_occupancy(5, (30, 30, 20), 0.02)
    high = clearance_of(occupied, (3, 2, 2), rope=True)
    below = high._replace(hook_ceiling=np.full(occupied.shape[:2], 11, np.int32))
    cell = (14, 14, 4)
    free, closed = heights(seen(high, cell)), heights(seen(below, cell))
    assert ((closed == free) | (closed == 1.0)).all()
    assert 0 < (closed == 1.0).sum() - (free == 1.0).sum() < free.size
    room = GOAL_START + GOAL_SIZE + 4
    assert seen(below, cell)[room] < seen(high, cell)[room]
    nowhere = high._replace(hook_ceiling=np.full(occupied.shape[:2], -1, np.int32))
    assert (heights(seen(nowhere, cell)) == 1.0).all()
