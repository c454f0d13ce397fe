from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from paper_reference import ReferenceSite, specs

from bimvox.errors import PlanningError
from bimvox.paper.env.batched import BatchedPaperSite
from bimvox.paper.env.layout import random_layouts, yard_layouts
from bimvox.paper.env.observation import OBSERVATIONS
from bimvox.paper.env.site_env import PaperSiteEnv
from bimvox.paper.env.spec import FOUR_COLUMNS_FOUR_BEAMS, OBSTRUCTED, PAPER, column
from bimvox.paper.env.state import AIR, FIRST_COMPONENT

TOWARDS = st.sampled_from([0.0, 0.7])


def some_actions(batch, random, greedy_share):
    greedy = random.random(batch.count) < greedy_share
    return np.where(greedy, batch.greedy_actions(), random.integers(6, size=batch.count))


@settings(max_examples=40, deadline=None)
@given(specs(), st.integers(0, 2**31), TOWARDS)
def test_batched_agrees_with_the_slow_reference(spec, seed, greedy_share):
    batch = BatchedPaperSite(spec, 3, observation="paper", seed=seed)
    batch.keep_distance_field()
    try:
        observations = batch.reset()
    except PlanningError:
        return  # the yard has no room
    random = np.random.default_rng(seed)
    slow = [ReferenceSite(batch.spec, batch.layout(n)) for n in range(3)]
    for _ in range(45):
        for n, reference in enumerate(slow):
            np.testing.assert_array_equal(observations[n], reference.map())
        last, held = observations, observations.copy()
        actions = some_actions(batch, random, greedy_share)
        step = batch.step(actions)
        observations = step.observations
        np.testing.assert_array_equal(last, held)
        for n, reference in enumerate(slow):
            reward, bumped, terminated, truncated = reference.step(actions[n])
            assert np.float32(reward) == step.rewards[n]
            assert (bumped, terminated, truncated) == (step.bumped[n], step.terminated[n], step.truncated[n])
            if terminated or truncated:
                np.testing.assert_array_equal(step.final_observations[n], reference.map())
                slow[n] = ReferenceSite(batch.spec, batch.layout(n))


@settings(max_examples=15, deadline=None)
@given(specs(), st.integers(0, 2**31), st.sampled_from(sorted(OBSERVATIONS)), st.sampled_from(["paper", "shaped"]))
def test_single_and_batched_agree_step_for_step(spec, seed, observation, reward):
    batch = BatchedPaperSite(spec, 2, observation=observation, reward=reward, seed=seed)
    batch.keep_distance_field()
    try:
        observations = batch.reset()
    except PlanningError:
        return
    singles = [PaperSiteEnv(spec, observation=observation, reward=reward) for _ in range(2)]
    random = np.random.default_rng(seed)
    for n, env in enumerate(singles):
        np.testing.assert_array_equal(env.reset(options={"layout": batch.layout(n)})[0], observations[n])
    for _ in range(30):
        actions = some_actions(batch, random, 0.7)
        step = batch.step(actions)
        for n, env in enumerate(singles):
            seen, earned, terminated, truncated, info = env.step(actions[n])
            assert np.float32(earned) == step.rewards[n]
            assert (terminated, truncated) == (step.terminated[n], step.truncated[n])
            assert (info["bumped"], info["late"]) == (step.bumped[n], step.late[n])
            assert tuple(step.final_states[n]) == env.state
            if terminated or truncated:
                np.testing.assert_array_equal(seen, step.final_observations[n])
                seen, _ = env.reset(options={"layout": batch.layout(n)})
            np.testing.assert_array_equal(seen, step.observations[n])


@settings(max_examples=25, deadline=None)
@given(specs(), st.integers(0, 2**31))
def test_no_two_objects_ever_share_a_cell(spec, seed):
    batch = BatchedPaperSite(spec, 4, seed=seed)
    batch.keep_distance_field()
    try:
        batch.reset()
    except PlanningError:
        return
    random = np.random.default_rng(seed)
    for _ in range(40):
        batch.step(some_actions(batch, random, 0.6))
        for n in range(4):
            state, cells = batch.state(n), batch.cells(n)
            for i, part in enumerate(batch.spec.components):
                held = int((cells == FIRST_COMPONENT + i).sum())
                assert held == (0 if i == state.component else part.length_vox)
            (x0, y0, z0), (x1, y1, z1) = batch.spec.components[state.component].box_at(state[1:4])
            assert (cells[x0:x1, y0:y1, z0:z1] == AIR).all()
            assert cells[x0:x1, y0:y1, z0:z1].size == batch.spec.components[state.component].length_vox
            for i in range(state.component):  # an assembled component and all it waited for are at their targets
                assert all(serial <= i for serial in batch.spec.waits_for(i + 1))


def life(batch, steps=60):
    random = np.random.default_rng(0)
    actions = random.integers(6, size=(steps, 1024))
    seen = [batch.reset().copy()]
    for row in actions:
        step = batch.step(row[: batch.count])
        seen.append(np.concatenate([step.observations, step.rewards[:, None], step.truncated[:, None]], axis=1))
    return seen


def test_neither_threads_nor_neighbours_change_an_episode():
    one, two = (life(BatchedPaperSite(OBSTRUCTED, 600, seed=4, threads=threads)) for threads in (1, 2))
    few = life(BatchedPaperSite(OBSTRUCTED, 5, seed=4))
    other = life(BatchedPaperSite(OBSTRUCTED, 5, seed=5))
    for a, b, c in zip(one, two, few, strict=True):
        np.testing.assert_array_equal(a, b)
        np.testing.assert_array_equal(a[:5], c)
    assert not np.array_equal(few[0], other[0])


def test_threads_are_only_as_many_as_there_is_work_for():
    assert BatchedPaperSite(PAPER, 8, threads=2).threads == 1
    batch = BatchedPaperSite(PAPER, 600, threads=2)
    assert batch.threads == 2
    batch.close()
    batch.close()


def test_an_ended_episode_is_followed_by_another_in_the_same_step():
    batch = BatchedPaperSite(replace(PAPER, max_steps=3), 4, seed=1)
    batch.reset()
    for _ in range(2):
        assert not batch.step([4] * 4).ended.any()
    step = batch.step([4] * 4)
    assert step.truncated.all()
    assert (step.final_states[:, 6] == 3).all()
    assert (batch.states[:, 5:] == 0).all()
    np.testing.assert_array_equal(step.observations, batch.step([4] * 4).observations)  # up is always blocked


def test_episodes_are_drawn_from_the_layouts_given():
    layouts = random_layouts(OBSTRUCTED, 3, seed=2)
    batch = BatchedPaperSite(PAPER, 50, layouts=layouts, seed=0)
    batch.reset()
    assert {batch.layout(n) for n in range(50)} == set(layouts)
    with pytest.raises(ValueError, match="empty list"):
        BatchedPaperSite(PAPER, 2, layouts=[])


def solve(batch):
    """Follow the exact distance until every episode has ended once; return which succeeded, and their steps."""
    succeeded = np.zeros(batch.count, np.int64)
    ended = np.zeros(batch.count, np.bool_)
    for _ in range(batch.spec.steps_allowed):
        step = batch.step(batch.greedy_actions())
        first = step.terminated & ~ended
        succeeded[first] = step.final_states[first, 6]
        ended |= step.ended
    assert ended.all()
    return succeeded


def test_optimal_play_builds_the_column_from_every_start_of_the_yard():
    layouts = yard_layouts(PAPER)
    batch = BatchedPaperSite(PAPER, len(layouts))
    batch.keep_distance_field()
    batch.reset()
    for n, layout in enumerate(layouts):
        batch.place(n, layout)
    steps = solve(batch)
    manhattan = [abs(p.starts[0].x - 7) + abs(p.starts[0].y - 7) + 1 for p in layouts]
    assert steps.tolist() == manhattan
    assert max(manhattan) <= 15


def test_optimal_play_builds_the_frame():
    batch = BatchedPaperSite(FOUR_COLUMNS_FOUR_BEAMS, 100, seed=3)
    batch.keep_distance_field()
    batch.reset()
    steps = solve(batch)
    assert (steps > 0).all()
    assert steps.max() < batch.spec.steps_allowed / 2


def test_impossible_arguments_are_refused():
    with pytest.raises(ValueError, match="observation: 'x' is unknown; there are paper"):
        BatchedPaperSite(PAPER, 1, observation="x")
    with pytest.raises(ValueError, match="reward: 'x' is unknown; there are paper"):
        BatchedPaperSite(PAPER, 1, reward="x")
    with pytest.raises(ValueError, match="sites: 0"):
        BatchedPaperSite(PAPER, 0)
    batch = BatchedPaperSite(PAPER, 2)
    batch.reset()
    for actions in ([0], [0, 6], [0, -1]):
        with pytest.raises(ValueError, match="2 integers from 0 to 5"):
            batch.step(actions)
    with pytest.raises(ValueError, match="without the distance field"):
        batch.greedy_actions()
    columns = tuple(column(3, (1 + i, 1, 1)) for i in range(6))
    crowded = replace(PAPER, shape=(8, 8, 6), construction_area=(1, 1, 8, 8), components=columns)
    with pytest.raises(PlanningError, match="no room for all"):
        BatchedPaperSite(crowded, 2).reset()
