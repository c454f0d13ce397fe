"""Equation (1), the map and the states, computed by hand."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bimvox.paper.env.layout import PaperLayout
from bimvox.paper.env.site_env import PaperSiteEnv
from bimvox.paper.env.spec import PAPER, PaperSpec, YardPose, beam, column, obstruction

FORWARD, BACKWARD, LEFT, RIGHT, UP, DOWN = range(6)

NEAR = PaperLayout((YardPose(4, 7, "y"),), ((7, 7, 1),))
"""The column lies in (4, 7..10, 1) and hangs at (4, 7, 2): right, right, right, down."""

THREE = PaperSpec(
    (9, 7, 6),
    (4, 2, 8, 5),
    (
        column(2, (4, 2, 1), start=YardPose(3, 2, "y")),
        column(2, (6, 2, 1), start=YardPose(6, 0, "x")),
        beam(3, (4, 2, 3), "x", start=YardPose(4, 6, "x")),
    ),
    step_limit=2,
)
"""Two columns of two, a beam of three on them; n = 3."""


def play(env, actions):
    steps = [env.step(np.int64(action)) for action in actions]
    return [step[1] for step in steps], steps[-1]


def test_equation_1_for_one_component():
    env = PaperSiteEnv(PAPER)
    env.reset(options={"layout": NEAR})
    rewards, last = play(env, [RIGHT, RIGHT, RIGHT, DOWN])
    assert rewards == [-1.0, -1.0, -1.0, 1.0]  # completing is positive, also the only component
    assert (last[2], last[3], last[4]["is_success"]) == (True, False, True)


def test_the_step_cost_doubles_from_the_limit_on_and_the_flag_shows_it():
    env = PaperSiteEnv(PAPER, observation="paper", step_limit=2)
    env.reset(options={"layout": NEAR})
    flags, rewards = [], []
    for action in [RIGHT, RIGHT, RIGHT, UP, DOWN]:  # up is blocked: the column fills k = 2..5 of six layers
        observation, reward, *_, info = env.step(np.int64(action))
        flags.append((float(observation[:, :, 1].sum()), info["late"], info["bumped"]))
        rewards.append(reward)
    assert rewards == [-1.0, -1.0, -2.0, -2.0, 1.0]
    assert flags == [(0, False, False), (1, True, False), (1, True, False), (1, True, True), (0, False, False)]


def test_a_blocked_move_costs_its_step_and_moves_nothing():
    env = PaperSiteEnv(PAPER)
    env.reset(options={"layout": PaperLayout((YardPose(0, 0, "y"),), ((7, 7, 1),))})
    for action in (LEFT, BACKWARD, UP):
        _, reward, terminated, truncated, info = env.step(np.int64(action))
        assert (reward, terminated, truncated) == (-1.0, False, False)
        assert (info["bumped"], info["cell_vox"]) == (True, (0, 0, 2))
    assert env.state.total == 3


def test_equation_1_for_three_components_with_a_late_one():
    env = PaperSiteEnv(THREE)
    env.reset()
    rewards, _ = play(env, [RIGHT, DOWN])  # (3, 2, 2) -> (4, 2, 1)
    assert rewards == [-1.0, 3.0 * 1]
    rewards, _ = play(env, [FORWARD, FORWARD, DOWN])  # (6, 0, 2) -> (6, 2, 1), the third step late
    assert rewards == [-1 / 2, -1 / 2, 3 * 2]
    assert env.state.component == 2
    rewards, last = play(env, [UP, *[BACKWARD] * 4])  # (4, 6, 2) -> (4, 2, 3)
    assert rewards == pytest.approx([-1 / 3, -1 / 3, -2 / 3, -2 / 3, 3 * 3])
    assert last[2]
    assert env.state.total == 10


def test_nothing_moves_after_the_end():
    env = PaperSiteEnv(PAPER)
    env.reset(options={"layout": NEAR})
    play(env, [RIGHT, RIGHT, RIGHT, DOWN])
    _, _, terminated, truncated, info = env.step(np.int64(UP))
    assert (terminated, truncated, info["cell_vox"], info["bumped"]) == (True, False, (7, 7, 1), True)


def test_the_map_by_hand():
    env = PaperSiteEnv(THREE, observation="paper", obstructions=(obstruction(0, 0, "x", 2, 3),), step_limit=3)
    observation, _ = env.reset()
    expected = np.zeros((9, 7, 6), np.float32)
    expected[0:2, 0, 0] = 3  # obstruction, k = 1..3
    expected[6:8, 0, 0] = 1  # second column, in the yard
    expected[4:7, 6, 0] = 1  # beam, in the yard
    expected[3, 2, 2] = 3  # first column in transit, k = 2..3
    expected[4, 2, 3] = 2  # its target, k = 1..2
    np.testing.assert_array_equal(observation, expected)

    _, last = play(env, [RIGHT, DOWN, UP, UP, DOWN])  # the first is assembled; the second hangs at (6, 0, 3), late
    expected[6:8, 0, 0] = 0
    expected[3, 2, 2] = 0
    expected[4, 2, 4:] = 1
    expected[6, 0, 1:3] = (1, 4)
    expected[6, 2, 3] = 2
    np.testing.assert_array_equal(last[0], expected)

    _, last = play(
        env, [FORWARD, FORWARD, DOWN, DOWN, UP, UP, BACKWARD]
    )  # two are assembled; the beam hangs at (4, 5, 4)
    expected[6, 0, 1:3] = 0
    expected[4:7, 6, 0] = 0
    expected[[4, 6], 2, 4] = 1
    expected[[4, 6], 2, 5] = 2
    expected[4:7, 5, 1:3] = (1, 4)
    expected[4:7, 2, 3] = 3  # the beam's target, higher than the columns under it
    np.testing.assert_array_equal(last[0], expected)


def test_shaped_and_sparse_rewards_by_hand():
    shaped = PaperSiteEnv(PAPER, reward="shaped")
    shaped.reset(options={"layout": NEAR})
    rewards, _ = play(shaped, [LEFT, UP, *[RIGHT] * 4, DOWN])
    assert rewards == pytest.approx([-0.25, -0.15, *[0.15] * 4, 1.15])
    sparse = PaperSiteEnv(PAPER, reward="sparse", step_limit=3)
    sparse.reset(options={"layout": NEAR})
    rewards, _ = play(sparse, [RIGHT, RIGHT, RIGHT, DOWN])
    assert rewards == pytest.approx([-0.1, -0.1, -0.1, 0.8])


def test_components_come_one_after_the_other_and_beams_wait():
    beams_first = replace(THREE, components=(THREE.components[2], *THREE.components[:2]))
    env = PaperSiteEnv(beams_first)
    _, info = env.reset()
    assert [part.kind for part in env.site_spec.components] == ["column", "column", "beam"]
    assert info["states"] == ("in_transit", "unbuilt", "unbuilt")
    _, last = play(env, [RIGHT, DOWN])
    assert last[4]["states"] == ("arrived", "in_transit", "unbuilt")
    _, last = play(env, [FORWARD])
    assert last[4]["states"] == ("assembled", "in_transit", "unbuilt")
    assert (last[4]["component"], last[4]["assembled"], last[4]["steps"]) == (2, 1, 1)


def test_stored_components_are_in_the_way():
    beside = replace(
        THREE,
        components=(
            THREE.components[0],
            replace(THREE.components[1], start=YardPose(3, 0, "y"), length_vox=2),
            THREE.components[2],
        ),
    )
    env = PaperSiteEnv(beside)
    env.reset()
    env.step(np.int64(DOWN))
    assert env.state[1:4] == (3, 2, 1)  # its place in the yard is free again
    assert env.step(np.int64(BACKWARD))[4]["bumped"]  # the second column lies in (3, 0..1, 1)
    env.step(np.int64(UP))
    assert not env.step(np.int64(BACKWARD))[4]["bumped"]  # above it
    assert env.step(np.int64(DOWN))[4]["bumped"]
