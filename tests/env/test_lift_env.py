from __future__ import annotations

import warnings

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from lift_sites import clearance_of
from stable_baselines3.common.env_checker import check_env as check_env_sb3

import bimvox.env.lift_env as lift_env
from bimvox.env import gym
from bimvox.env.dynamics import StepLimit
from bimvox.env.lift_env import BLOCKED, COMPONENT, FREE, TARGET
from bimvox.env.problem import default_problem, lift_problem, training_problem


def greedy_action(env: lift_env.LiftEnv) -> int:
    """Return a move along the teacher's field."""
    from bimvox.env.actions import MOVES

    here = np.array(env.state[:3])
    nearer = [a for a in range(6) if 0 <= _distance(env, here + MOVES[a]) < _distance(env, here)]
    return nearer[0]


def _distance(env, cell) -> int:
    inside = (cell >= 0).all() and (cell < env.problem.grid_shape).all()
    return env.problem.distance_from(cell) if inside else -1


def test_gymnasium_and_sb3_find_nothing_to_warn_about():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(gymnasium.make("bimvox/Lift-v0").unwrapped)
        for render_mode in ("ansi", "rgb_array"):
            check_env(gymnasium.make("bimvox/Lift-v0", render_mode=render_mode).unwrapped)
        check_env_sb3(lift_env.LiftEnv())


def test_registering_twice_is_harmless():
    gym.register()
    assert gym.LIFT_ENV_ID in gymnasium.registry


def test_equal_seeds_give_equal_episodes():
    first, second = lift_env.LiftEnv(), lift_env.LiftEnv()
    actions = np.random.default_rng(1).integers(6, size=200)
    for twin_seed in (0, 1):
        a, b = first.reset(seed=twin_seed), second.reset(seed=twin_seed)
        np.testing.assert_array_equal(a[0], b[0])
        for action in actions:
            x, y = first.step(action), second.step(action)
            np.testing.assert_array_equal(x[0], y[0])
            assert x[1:] == y[1:]
            if x[2] or x[3]:
                np.testing.assert_array_equal(first.reset()[0], second.reset()[0])


def test_following_the_field_arrives_in_the_fewest_moves():
    env = lift_env.LiftEnv()
    _, info = env.reset(seed=3, options={"start": (1, 13, 2)})
    expected, earned = info["distance"], 0.0
    for moves in range(1, expected + 1):
        _, reward, terminated, truncated, info = env.step(np.int64(greedy_action(env)))
        earned += float(reward)
        assert not truncated
        assert terminated == (moves == expected) == info["is_success"]
    assert earned == pytest.approx(0.15 * expected + 1.0)


def test_an_episode_without_arrival_is_truncated_at_its_limit():
    env = lift_env.LiftEnv(limit=StepLimit(1.0, 3))
    _, info = env.reset(options={"start": (0, 0, 2)})
    for step in range(1, info["distance"] + 4):
        *_, terminated, truncated, last = env.step(np.int64(1))  # against the border
        assert last["bumped"]
        assert not terminated
        assert truncated == (step == info["distance"] + 3)


def test_problem_and_start_can_be_chosen_but_not_an_unsolvable_one():
    occupied = np.zeros((8, 4, 3), np.bool_)
    occupied[5] = True
    other = training_problem(clearance_of(occupied), (0, 0, 0), (4, 3, 2))
    env = lift_env.LiftEnv([default_problem(), other])
    _, info = env.reset(options={"problem": 1})
    assert info["distance"] == 9
    with pytest.raises(ValueError, match="cannot be reached"):
        env.reset(options={"problem": 1, "start": (7, 0, 0)})


def test_drawn_as_text():
    env = lift_env.LiftEnv(render_mode="ansi")
    env.reset(options={"start": (2, 3, 2)})
    env.step(np.int64(3))
    first, *rows = env.render().splitlines()
    assert first == "step 1, cell (3, 3, 2), target (7, 7, 1), last action right"
    assert len(rows) == 15
    assert rows[14 - 3][3] == "C"
    assert rows[14 - 7][7] == "T"
    assert lift_env.LiftEnv().render() is None


def test_drawn_as_pixels():
    env = lift_env.LiftEnv([default_problem(obstructions=(((10, 2, 1), (13, 4, 3)),))], render_mode="rgb_array")
    with pytest.raises(gymnasium.error.ResetNeeded, match="reset"):
        env.render()
    env.reset(options={"start": (2, 3, 2)})
    pixels = env.render()
    assert pixels.dtype == np.uint8
    assert max(pixels.shape) >= 480
    scale = pixels.shape[1] // 15
    squares = pixels[scale // 2 :: scale, scale // 2 :: scale]
    assert squares.shape == (15 + 1 + 6, 15, 3)
    above, front = squares[:15][::-1], squares[16:][::-1]  # [y, x] and [z, x]
    assert tuple(above[3, 2]) == tuple(front[2, 2]) == COMPONENT
    assert tuple(above[7, 7]) == tuple(front[1, 7]) == TARGET
    assert tuple(above[2, 11]) == tuple(front[2, 11]) == BLOCKED
    assert tuple(above[10, 11]) == tuple(front[2, 5]) == FREE
    env.step(np.int64(3))
    assert not np.array_equal(env.render(), pixels)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"begin": (0, 0, 2)}, "options: 'begin' unknown; there are problem, start"),
        ({"problem": 1}, "options: problem 1 is not one of 0 to 0"),
        ({"problem": -1}, "options: problem -1 is not one of 0 to 0"),
        ({"start": (99, 0, 2)}, r"options: start \(99, 0, 2\): the target cannot be reached"),
        ({"start": (0, -1, 2)}, r"options: start \(0, -1, 2\): the target cannot be reached"),
        ({"start": (0, 2)}, r"options: start \(0, 2\): the target cannot be reached"),
    ],
)
def test_impossible_options_are_refused(options, message):
    with pytest.raises(ValueError, match=message):
        lift_env.LiftEnv().reset(options=options)


def test_impossible_arguments_are_refused():
    with pytest.raises(ValueError, match="render_mode: 'human' is unknown; there are None, ansi, rgb_array"):
        lift_env.LiftEnv(render_mode="human")
    with pytest.raises(ValueError, match="no distance field"):
        lift_env.LiftEnv([lift_problem(default_problem().space, (0, 0, 2), (7, 7, 1))])


def test_a_step_before_the_first_reset_is_refused():
    with pytest.raises(gymnasium.error.ResetNeeded, match="reset"):
        lift_env.LiftEnv().step(np.int64(0))
