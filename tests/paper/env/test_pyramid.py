from __future__ import annotations

import itertools

import numpy as np
import pytest
from lift_sites import clearance_of, random_occupancy

from bimvox.env.dynamics import LiftState
from bimvox.env.observation import WAY_SIZE
from bimvox.paper.env.observation import OBSERVATION_SIZE, SCALES, WINDOW, WINDOW_SIZE, observe
from bimvox.site.collision import CollisionSpace, placement_is_free

OFFSETS = [range(-(n // 2), n // 2 + 1) for n in WINDOW]


def seen(space: CollisionSpace, cell, target=(1, 1, 1), last_action=-1) -> np.ndarray:
    out = np.full(OBSERVATION_SIZE, np.nan, np.float32)
    observe(space, np.array(target, np.int32), LiftState(*cell, last_action, 0), out)
    assert np.isfinite(out).all()
    assert np.abs(out).max() <= 1.0
    return out


def level(out: np.ndarray, n: int) -> np.ndarray:
    return out[n * WINDOW_SIZE : (n + 1) * WINDOW_SIZE].reshape(WINDOW)


@pytest.mark.parametrize("rope", [False, True])
@pytest.mark.parametrize("seed", range(4))
def test_nearest_level_is_the_one_rule_of_collision(seed, rope):
    occupied = random_occupancy(seed, (12, 11, 9), 0.1)
    space = clearance_of(occupied, (2, 1, 2), rope=rope)
    out = level(seen(space, (5, 5, 4)), 0)
    for i, j, k in itertools.product(*OFFSETS):
        expected = 0.0 if placement_is_free(space, 5 + i, 5 + j, 4 + k) else 1.0
        assert out[i + WINDOW[0] // 2, j + WINDOW[1] // 2, k + WINDOW[2] // 2] == expected


@pytest.mark.parametrize("size", [(1, 1, 1), (7, 1, 2), (12, 5, 11)])
@pytest.mark.parametrize("share", [0.0, 0.002, 0.05])
def test_coarse_levels_are_sure_where_they_say_so(size, share):
    """Without a rope: 0 means that all placements of the block are free, 1 that all are blocked."""
    occupied = random_occupancy(3, (40, 30, 24), share)
    space = clearance_of(occupied, size)
    cell = (15, 12, 6)
    out = seen(space, cell)
    for n, scale in enumerate(SCALES[1:], start=1):
        for i, j, k in itertools.product(*OFFSETS):
            value = level(out, n)[i + WINDOW[0] // 2, j + WINDOW[1] // 2, k + WINDOW[2] // 2]
            if 0.0 < value < 1.0:
                continue
            x, y, z = (c + scale * o for c, o in zip(cell, (i, j, k), strict=True))
            reach = scale // 2
            for u, v, w in itertools.product((-reach, 0, reach), repeat=3):
                assert placement_is_free(space, x + u, y + v, z + w) == (value == 0.0)


def test_a_thin_wall_shows_at_every_scale():
    occupied = np.zeros((80, 80, 40), np.bool_)
    occupied[60, :, :] = True
    out = seen(clearance_of(occupied), (40, 40, 20))
    assert (level(out, 0) == 0.0).all()
    assert level(out, 3).max() >= 0.25


def test_forbidden_hook_blocks_coarse_cells():
    occupied = np.zeros((40, 40, 20), np.bool_)
    space = clearance_of(occupied)
    space.hook_floor[30:, :] = 2**30
    assert level(seen(space, (20, 20, 10)), 3)[-1].min() == 1.0
    assert level(seen(space, (20, 20, 10)), 3)[3, 3, 2] == 0.0


def test_size_does_not_depend_on_site_or_component():
    small = seen(clearance_of(np.zeros((6, 6, 6), np.bool_)), (2, 2, 2))
    large = seen(clearance_of(np.zeros((90, 50, 40), np.bool_), (24, 5, 1)), (30, 20, 10))
    assert small.shape == large.shape == (OBSERVATION_SIZE,)


def test_goal_and_last_action():
    space = clearance_of(np.zeros((30, 30, 30), np.bool_))
    out = seen(space, (10, 10, 10), target=(12, 4, 10), last_action=3)
    goal = out[len(SCALES) * WINDOW_SIZE :][:WAY_SIZE]
    np.testing.assert_allclose(goal[:3], [1, -1, 0])
    np.testing.assert_allclose(goal[3:6], [0.5, -1, 0])
    np.testing.assert_allclose(goal[6:9], np.array([np.log(3), -np.log(7), 0]) / np.log(1024), rtol=1e-6)
    np.testing.assert_allclose(goal[9:], [0.25, -0.75, 0])
    np.testing.assert_array_equal(out[-6:], [0, 0, 0, 1, 0, 0])


def test_the_observation_does_not_depend_on_the_place_on_the_site():
    """The observation is egocentric: equal surroundings far from any border give equal observations."""
    near, far = np.zeros((130, 130, 90), np.bool_), np.zeros((130, 130, 90), np.bool_)
    near[58:61, 57:60, 44] = True
    far[63:66, 54:57, 46] = True
    np.testing.assert_array_equal(
        seen(clearance_of(near), (60, 60, 42), target=(65, 60, 42)),
        seen(clearance_of(far), (65, 57, 44), target=(70, 57, 44)),
    )
