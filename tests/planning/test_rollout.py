from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from lift_sites import clearance_of, random_occupancy

from bimvox.env.dynamics import StepLimit
from bimvox.env.guard import GUARDS
from bimvox.env.observation import FRAME_ACTIONS, FRAME_COUNT, GOAL_SIZE, GOAL_START, VIEW_SIZE
from bimvox.env.problem import LiftProblem, lift_problem
from bimvox.planning.rollout import (
    ARRIVALS,
    GREEDY,
    LIFTS_AT_ONCE,
    SCALE,
    Outcome,
    lifts_at_once,
    proposer,
    roll_out,
    roll_out_all,
    roll_out_starts,
)
from bimvox.planning.stage import ProposedGreedily, Transit
from bimvox.site.collision import placement_is_free

SHARES = slice(GOAL_START + GOAL_SIZE - 4, GOAL_START + GOAL_SIZE - 1)


def beeline(observations: np.ndarray) -> np.ndarray:
    """Return values that rise along the direction to the goal and ignore walls."""
    dx, dy, dz = observations[:, SHARES].T
    in_frame = np.stack([dy, -dy, -dx, dx, dz, -dz], axis=1).astype(np.float32)
    frames = np.rint(observations[:, -1] * (FRAME_COUNT - 1)).astype(int)
    return np.take_along_axis(in_frame, FRAME_ACTIONS[frames], axis=1)


def whimsical(observations: np.ndarray) -> np.ndarray:
    """Return arbitrary values that depend on each row alone."""
    mix = np.random.default_rng(0).standard_normal((VIEW_SIZE, 6)).astype(np.float32)
    return np.stack([row @ mix for row in observations])


def empty(shape=(12, 11, 7)) -> np.ndarray:
    return np.zeros(shape, np.bool_)


def wall_with_a_gap() -> LiftProblem:
    occupied = empty()
    occupied[6] = True
    occupied[6, 9, 1] = False
    return lift_problem(clearance_of(occupied), (2, 2, 3), (10, 2, 3))


ZERO, START = np.zeros(1, np.int64), np.array([[2, 2, 3]], np.int32)
"""The problem and its start in :func:`wall_with_a_gap`."""


def assert_is_a_way(problem: LiftProblem, path: np.ndarray) -> None:
    assert (np.abs(np.diff(path, axis=0)).sum(axis=1) == 1).all()
    assert len(np.unique(path, axis=0)) == len(path)
    assert all(placement_is_free(problem.space, *(int(n) for n in cell)) for cell in path)


def test_a_good_policy_goes_straight():
    problem = lift_problem(clearance_of(empty()), (1, 1, 1), (9, 8, 4))
    rollout = roll_out(beeline, problem)
    assert rollout.outcome is Outcome.ARRIVED
    assert rollout.steps == len(rollout.path_vox) - 1 == 8 + 7 + 3
    assert rollout.path_vox.dtype == np.int32
    assert tuple(rollout.path_vox[0]) == problem.start_vox
    assert tuple(rollout.path_vox[-1]) == problem.target_vox
    assert_is_a_way(problem, rollout.path_vox)


def test_the_guard_leads_a_stubborn_policy_along_a_wall():
    occupied = empty()
    occupied[6, :, :5] = True
    problem = lift_problem(clearance_of(occupied), (2, 2, 3), (10, 2, 3))
    rollout = roll_out(beeline, problem)
    assert rollout.arrived
    assert_is_a_way(problem, rollout.path_vox)


@settings(max_examples=40, deadline=None)
@given(seed=st.integers(0, 10_000), values=st.sampled_from([beeline, whimsical]))
def test_any_policy_gives_a_valid_path_as_far_as_it_goes(seed, values):
    occupied = random_occupancy(seed, (8, 8, 5), 0.3)
    problem = lift_problem(clearance_of(occupied), (0, 0, 0), (7, 7, 4))
    rollout = roll_out(values, problem, limit=StepLimit(2.0, 10))
    assert rollout.steps <= 2 * len(GUARDS) * (2 * 18 + 10)  # under each guard, from both ends
    assert tuple(rollout.path_vox[0]) == (0, 0, 0)
    if occupied[0, 0, 0]:
        assert rollout.outcome is Outcome.START_NOT_FREE
        return
    assert_is_a_way(problem, rollout.path_vox)
    assert rollout.arrived == (tuple(rollout.path_vox[-1]) == problem.target_vox)


def test_outcomes_other_than_arrival():
    boxed = empty()
    boxed[:3, :3, :3] = True
    boxed[1, 1, 1] = False
    assert roll_out(beeline, lift_problem(clearance_of(boxed), (1, 1, 1), (9, 9, 5))).outcome is Outcome.ENCLOSED
    assert roll_out(beeline, lift_problem(clearance_of(boxed), (0, 1, 1), (9, 9, 5))).outcome is Outcome.START_NOT_FREE
    hopeless = roll_out(beeline, lift_problem(clearance_of(boxed), (9, 9, 5), (1, 1, 1)), limit=StepLimit(1.0, 5))
    assert hopeless.outcome is Outcome.STEP_LIMIT
    assert 4 * (20 + 5) <= hopeless.steps <= 8 * (20 + 5)


def test_after_enough_arrivals_the_shortest_path_is_taken():
    problem = wall_with_a_gap()
    alone = [roll_out_starts(beeline, [problem], ZERO, START, guard=guard)[0] for guard in GUARDS]
    enough = [rollout for rollout in alone if rollout.arrived][:ARRIVALS]
    last = max(n for n, rollout in enumerate(alone) if rollout in enough)
    found = roll_out_all(beeline, [problem], from_target=False)[0]
    assert len(enough) == ARRIVALS
    assert found.steps == sum(rollout.steps for rollout in alone[: last + 1])
    assert len(found.path_vox) <= min(len(rollout.path_vox) for rollout in enough)
    assert_is_a_way(problem, found.path_vox)


def test_no_further_try_after_a_shortest_path():
    problem = wall_with_a_gap()
    found = roll_out_all(beeline, [problem])[0]
    moves = len(found.path_vox) - 1
    known = roll_out_all(beeline, [problem], least_moves=[moves])[0]
    assert known.steps <= found.steps
    np.testing.assert_array_equal(known.path_vox, found.path_vox)


def test_if_none_arrives_the_lift_is_tried_from_its_target():
    def eastward(observations: np.ndarray) -> np.ndarray:
        return np.tile(np.array([0, 0, 0, 1, 0, 0], np.float32), (len(observations), 1))

    problem = lift_problem(clearance_of(empty()), (10, 5, 3), (1, 5, 3))
    limit = StepLimit(1.0, 0)
    one_way = roll_out_all(eastward, [problem], limit=limit, from_target=False)[0]
    assert one_way.outcome is Outcome.STEP_LIMIT
    found = roll_out_all(eastward, [problem], limit=limit)[0]
    assert found.steps == one_way.steps + 9
    assert found.path_vox[:, 0].tolist() == list(range(10, 0, -1))


@pytest.mark.parametrize("guard", GUARDS)
def test_greedy_values_take_the_path_of_a_policy_that_goes_towards_the_target(guard):
    problems = [lift_problem(clearance_of(random_occupancy(seed)), (0, 0, 0), (8, 7, 5)) for seed in range(20)]
    problems.append(wall_with_a_gap())
    each, starts = np.arange(len(problems)), np.array([problem.start_vox for problem in problems], np.int32)
    policy = roll_out_starts(lambda views: np.float32(SCALE) * beeline(views), problems, each, starts, guard=guard)
    greedy = roll_out_starts(GREEDY, problems, each, starts, guard=guard)
    assert {rollout.outcome for rollout in greedy} >= {Outcome.ARRIVED, Outcome.START_NOT_FREE}
    for ours, theirs in zip(greedy, policy, strict=True):
        assert (ours.outcome, ours.steps) == (theirs.outcome, theirs.steps)
        np.testing.assert_array_equal(ours.path_vox, theirs.path_vox)


def test_already_there():
    rollout = roll_out(beeline, lift_problem(clearance_of(empty()), (3, 3, 3), (3, 3, 3)))
    assert rollout.arrived
    assert rollout.path_vox.tolist() == [[3, 3, 3]]


@pytest.mark.slow
def test_together_is_as_alone():
    problems = [
        lift_problem(clearance_of(random_occupancy(seed, (9, 8, 6), 0.15)), (0, 0, 0), (8, 7, 5)) for seed in range(40)
    ]
    limit = StepLimit(2.0, 10)
    for together, problem in zip(roll_out_all(whimsical, problems, limit=limit), problems, strict=True):
        alone = roll_out(whimsical, problem, limit=limit)
        assert (together.outcome, together.steps) == (alone.outcome, alone.steps)
        np.testing.assert_array_equal(together.path_vox, alone.path_vox)


def test_no_lifts_no_rollouts():
    assert roll_out_all(beeline, []) == ()
    assert roll_out_starts(beeline, [], np.zeros(0, np.int64), np.zeros((0, 3), np.int32)) == ()


def test_proposer_gives_a_path_or_nothing():
    problem, gap = lift_problem(clearance_of(empty()), (1, 1, 1), (9, 8, 4)), wall_with_a_gap()
    free, around = [Transit(p.space, p.start_vox, p.target_vox) for p in (problem, gap)]
    np.testing.assert_array_equal(proposer(beeline)(free), roll_out(beeline, problem).path_vox)
    assert proposer(beeline, limit=StepLimit(1.0, 0))(around) is None
    assert proposer(GREEDY, limit=StepLimit(1.0, 0))(around) is None
    assert [isinstance(proposer(values), ProposedGreedily) for values in (beeline, GREEDY)] == [False, True]


def test_a_large_site_takes_fewer_lifts_at_once():
    assert lifts_at_once((200, 200, 60)) == LIFTS_AT_ONCE
    assert 1 <= lifts_at_once((400, 400, 100)) < LIFTS_AT_ONCE
    assert lifts_at_once((4000, 4000, 1000)) == 1
