from __future__ import annotations

import numpy as np
import pytest
from lift_sites import clearance_of, random_occupancy

from bimvox.env.actions import MOVES
from bimvox.env.batched import BatchedLiftEnv
from bimvox.env.dynamics import StepLimit
from bimvox.env.lift_env import LiftEnv
from bimvox.env.observation import GOAL_SIZE, GOAL_START
from bimvox.env.pool import StartMix
from bimvox.env.problem import default_problem, lift_problem, training_problem


def problems():
    occupied = random_occupancy(4, (20, 15, 8), 0.15)
    occupied[:4, :4, :4] = occupied[14:, 10:, 5:] = False
    boxes = training_problem(clearance_of(occupied, (2, 1, 1), rope=True), (0, 0, 3), (15, 12, 6), [(1, 1, 3)])
    return [default_problem(), training_problem(clearance_of(occupied), (0, 0, 0), (15, 12, 6)), boxes]


def solvable():
    return [p for p in problems() if len(p.starts_vox)]


@pytest.mark.parametrize("reward_name", ["shaped", "sparse"])
def test_single_and_batched_agree_step_for_step(reward_name):
    pool = solvable()
    limit = StepLimit(1.0, 6)
    batch = BatchedLiftEnv(pool, 16, reward_name=reward_name, limit=limit, seed=5)
    singles = [LiftEnv(pool, reward_name=reward_name, limit=limit) for _ in range(16)]
    observations = batch.reset()
    random = np.random.default_rng(0)

    def follow(n: int) -> np.ndarray:
        """Start a single environment where lift ``n`` of the batch began."""
        options = {"problem": int(batch.state.problem[n]), "start": batch.state.cell[n]}
        return singles[n].reset(options=options)[0]

    for n in range(16):
        np.testing.assert_array_equal(follow(n), observations[n])
    ended = 0
    for _ in range(80):
        # Mostly along the teacher's field, so that some lifts reach their targets.
        actions = random.integers(6, size=16)
        step = batch.step(actions)
        for n, env in enumerate(singles):
            observation, reward, terminated, truncated, _ = env.step(actions[n])
            assert (terminated, truncated) == (step.terminated[n], step.truncated[n])
            assert np.float32(reward) == step.rewards[n]
            if terminated or truncated:
                ended += 1
                np.testing.assert_array_equal(observation, step.final_observations[n])
                observation = follow(n)
            np.testing.assert_array_equal(observation, step.observations[n])
    assert ended > 16


def test_arrival_ends_an_episode_with_its_last_observation():
    batch = BatchedLiftEnv([default_problem()], 2, seed=0)
    batch.reset()
    batch.place(0, 0, (7, 7, 2))
    step = batch.step(np.array([5, 4]))
    assert step.terminated.tolist() == [True, False]
    assert step.rewards[0] == pytest.approx(1.15)
    assert not step.final_observations[0][GOAL_START : GOAL_START + GOAL_SIZE].any()  # the component is at its target
    assert batch.state.steps[0] == 0  # a new episode has begun


def test_equal_seeds_give_equal_batches():
    def life(seed: int) -> np.ndarray:
        batch = BatchedLiftEnv(solvable(), 32, seed=seed, mix=StartMix(0.3, 0.3, 4), limit=StepLimit(1.0, 2))
        batch.reset()
        random = np.random.default_rng(0)
        cells = []
        for _ in range(60):
            batch.step(random.integers(6, size=32))
            cells.append(np.column_stack([batch.state.problem, batch.state.cell]))
        return np.array(cells)

    np.testing.assert_array_equal(life(1), life(1))
    assert not np.array_equal(life(1), life(2))


def test_problems_are_drawn_by_weight():
    batch = BatchedLiftEnv(solvable(), 400, seed=0)
    batch.weigh_problems([0.0, 1.0, *([0.0] * (len(solvable()) - 2))])
    batch.reset()
    assert (batch.state.problem == 1).all()


def test_an_unlearnable_problem_is_refused():
    with pytest.raises(ValueError, match="no distance field"):
        BatchedLiftEnv([lift_problem(default_problem().space, (0, 0, 2), (7, 7, 1))], 4)


def test_threads_change_nothing():
    lives = []
    for threads in (1, 3):
        batch = BatchedLiftEnv(solvable(), 37, seed=4, threads=threads, limit=StepLimit(1.0, 3))
        random = np.random.default_rng(0)
        seen = [batch.reset().copy()]
        for _ in range(30):
            values = random.random((37, 6)).astype(np.float32)
            seen.append(batch.step(batch.chosen_actions(values)).observations.copy())
        lives.append(np.array(seen))
    np.testing.assert_array_equal(*lives)


def test_the_teacher_knows_what_each_action_is_worth():
    """The teacher's values are the discounted rewards of following the distance field to the end."""
    pool, discount = solvable(), 0.9
    batch = BatchedLiftEnv(pool, 12, seed=2, teacher_discount=discount, limit=StepLimit(5.0, 50))
    batch.reset()
    problems, cells = batch.state.problem.copy(), batch.state.cell.copy()
    told = batch.step(np.zeros(12, np.int64)).teacher.copy()
    for n in range(12):
        problem = pool[problems[n]]
        for action in range(6):
            env = LiftEnv([problem], limit=StepLimit(5.0, 50))
            env.reset(options={"start": tuple(cells[n])})
            _, earned, arrived, _, _ = env.step(action)
            total, factor = float(earned), discount
            while not arrived:
                here = np.array(env.state[:3])
                ahead = [a for a in range(6) if _nearer(problem, here + MOVES[a], here)]
                _, earned, arrived, _, _ = env.step(ahead[0])
                total += factor * float(earned)
                factor *= discount
            assert told[n, action] == pytest.approx(total, abs=1e-4)


def _nearer(problem, there, here) -> bool:
    inside = (there >= 0).all() and (there < problem.grid_shape).all()
    return bool(inside and 0 <= problem.distance_from(there) < problem.distance_from(here))
