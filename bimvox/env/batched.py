"""Thousands of lifts stepped in one compiled kernel, observations included.

A lift whose episode ends begins a new one in the same step; its last observation is kept separately for learners.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise
from typing import NamedTuple

import gymnasium
import numpy as np
from numpy.typing import ArrayLike, NDArray

from bimvox.compiled import kernel, leaf_kernel
from bimvox.env.actions import ACTION_COUNT, checked_actions, named
from bimvox.env.dynamics import (
    REWARDS,
    LiftState,
    RewardWeights,
    StepLimit,
    has_arrived,
    initial_state,
    reward,
    steps_allowed,
    transition,
)
from bimvox.env.guard import CALM, guarded_action
from bimvox.env.observation import TRAIL_STEPS, VIEW_SIZE, look
from bimvox.env.pool import (
    TRAINING_MIX,
    ProblemPool,
    StartMix,
    draw_start,
    pool_of,
    pooled_clearance,
    pooled_distance,
    random_unit,
)
from bimvox.env.problem import LiftProblem, is_learnable
from bimvox.site.collision import CollisionSpace

MEMORY = TRAIL_STEPS[-1] + 1
"""Reference cells that a lift of a batch remembers: as many as its observation needs."""


class _Lifts(NamedTuple):
    """Where N lifts are, as arrays that the kernels overwrite.

    Attributes:
        problem: (N,) int64 index into the pool.
        cell: (N, 3) int64 reference cells.
        last_action: (N,) int64.
        steps: (N,) int64 actions since the episode's start.
        limit: (N,) int64 actions allowed.
        cells: (N, MEMORY, 3) int32 where each was; step s in row s % MEMORY.
        generator: (N,) uint64 state of each lift's random generator.
    """

    problem: NDArray[np.int64]
    cell: NDArray[np.int64]
    last_action: NDArray[np.int64]
    steps: NDArray[np.int64]
    limit: NDArray[np.int64]
    cells: NDArray[np.int32]
    generator: NDArray[np.uint64]


class _Rules(NamedTuple):
    """How episodes begin and end and how actions are rewarded, as a tuple for kernels.

    Attributes:
        chances: (P,) float64 cumulative probability with which each problem is drawn.
        mix: Where episodes begin.
        limit: How many actions an episode may take.
        weights: Coefficients of the reward.
        teacher_discount: Discount per step of the teacher's action values; 0: no teacher.
    """

    chances: NDArray[np.float64]
    mix: StartMix
    limit: StepLimit
    weights: RewardWeights
    teacher_discount: float


class _BatchStep(NamedTuple):
    """The results of one step of N lifts. The arrays are the environment's own and hold until the step after the next.

    Attributes:
        observations: (N, VIEW_SIZE) float32, of the new episode if the old one ended.
        rewards: (N,) float32.
        terminated: (N,) bool, the target was reached.
        truncated: (N,) bool, the step limit was reached first.
        final_observations: (N, VIEW_SIZE) float32; only the rows of ended episodes are valid.
        teacher: (N, 6) float32 value of each action before the step, by the distance field; empty without a teacher.
    """

    observations: NDArray[np.float32]
    rewards: NDArray[np.float32]
    terminated: NDArray[np.bool_]
    truncated: NDArray[np.bool_]
    final_observations: NDArray[np.float32]
    teacher: NDArray[np.float32]

    @property
    def ended(self) -> NDArray[np.bool_]:
        """(N,) bool, the episode ended."""
        return self.terminated | self.truncated


class Rows:
    """N environments in arrays, whose rows threads share.

    Each has its own random generator, so results do not depend on the number of threads.

    ``count``: N.
    """

    def __init__(self, count: int, threads: int) -> None:
        self.count = count
        self.threads = threads
        self._executor = ThreadPoolExecutor(threads - 1) if threads > 1 else None

    def share(self, work: Callable[[int, int], int | None]) -> int:
        """Call ``work`` with each thread's range of the rows, and return the sum of what it returns."""
        bounds = [self.count * t // self.threads for t in range(self.threads + 1)]
        (first, *others) = pairwise(bounds)
        running = [self._executor.submit(work, *other) for other in others] if self._executor else []
        return (work(*first) or 0) + sum(other.result() or 0 for other in running)

    def close(self) -> None:
        """End the threads."""
        if self._executor is not None:
            self._executor.shutdown()
            self._executor = None


class BatchedLiftEnv(Rows):
    """N lifts over a pool of problems.

    Args:
        problems: Episodes are drawn from these; all must be learnable (:func:`bimvox.env.problem.is_learnable`).
        lifts: N.
        reward_name: A key of ``REWARDS``.
        mix: Where episodes begin.
        limit: How many actions an episode may take, from its exact distance.
        seed: The same seed and actions give the same results, whatever the number of threads.
        threads: Number of threads that step the lifts.
        teacher_discount: Discount per step of the action values from the distance field; 0: no teacher.

    Attributes:
        count: N.
        problems: Number of problems to draw from.
        ended_problem: (N,) int64 problem that each lift was on before the last step.

    Raises:
        ValueError: A problem is not learnable.
    """

    def __init__(
        self,
        problems: Sequence[LiftProblem],
        lifts: int,
        *,
        reward_name: str = "shaped",
        mix: StartMix = TRAINING_MIX,
        limit: StepLimit = StepLimit(),  # noqa: B008  (immutable)
        seed: int = 0,
        threads: int = 1,
        teacher_discount: float = 0.0,
    ) -> None:
        if not all(is_learnable(problem) for problem in problems):
            raise ValueError("a problem has no distance field, or no start from which its target can be reached")
        super().__init__(lifts, threads)
        self.problems = len(problems)
        self.ended_problem = np.zeros(lifts, np.int64)
        self.pool = pool_of(problems, with_distances=True)
        chances = np.full(len(problems), 1.0 / len(problems)).cumsum()
        self._rules = _Rules(chances, mix, limit, named("reward", reward_name, REWARDS), teacher_discount)
        self.state = _Lifts(
            np.zeros(lifts, np.int64),
            np.zeros((lifts, 3), np.int64),
            np.zeros(lifts, np.int64),
            np.zeros(lifts, np.int64),
            np.zeros(lifts, np.int64),
            np.zeros((lifts, MEMORY, 3), np.int32),
            np.zeros(lifts, np.uint64),
        )
        self._turns = [
            _BatchStep(
                np.zeros((lifts, VIEW_SIZE), np.float32),
                np.zeros(lifts, np.float32),
                np.zeros(lifts, np.bool_),
                np.zeros(lifts, np.bool_),
                np.zeros((lifts, VIEW_SIZE), np.float32),
                np.zeros((lifts if teacher_discount > 0.0 else 0, ACTION_COUNT), np.float32),
            )
            for _ in range(2)
        ]
        self.seed(seed)

    def seed(self, seed: int) -> None:
        """Set the state of the random generators that draw problems and starts."""
        self.state.generator[:] = np.random.SeedSequence(seed).generate_state(self.count, np.uint64)

    def weigh_problems(self, weights: ArrayLike) -> None:
        """Set how often each problem is drawn, (P,) positive weights."""
        share = np.asarray(weights, np.float64)
        self._rules = self._rules._replace(chances=np.cumsum(share / share.sum()))

    @property
    def observation_space(self) -> gymnasium.spaces.Box:
        """Of one lift."""
        return gymnasium.spaces.Box(-1.0, 1.0, (VIEW_SIZE,), np.float32)

    def reset(self) -> NDArray[np.float32]:
        """Begin N new episodes and return their (N, VIEW_SIZE) float32 observations."""
        observations = self._turns[0].observations

        self.share(lambda first, last: _begin_all(self.pool, self._rules, self.state, first, last, observations))
        return observations

    def place(self, lift: int, problem: int, cell_vox: ArrayLike) -> None:
        """Begin an episode of ``problem`` at a given reference cell; the next step starts from there."""
        x, y, z = (int(c) for c in np.asarray(cell_vox))
        distance = pooled_distance(self.pool, problem, x, y, z)
        self.state.problem[lift] = problem
        _store_state(self.state, lift, initial_state(x, y, z))
        self.state.limit[lift] = steps_allowed(self._rules.limit, distance)

    def step(self, actions: ArrayLike) -> _BatchStep:
        """Take one action per lift, (N,) integers from 0 to 5.

        Raises:
            ActionError: If the actions are not N integers of that range.
        """
        chosen = checked_actions(actions, self.count)
        self._turns.reverse()
        out = self._turns[0]
        self.ended_problem[:] = self.state.problem

        self.share(lambda first, last: _step_all(self.pool, self._rules, self.state, chosen, first, last, out))
        return out

    def chosen_actions(self, values: NDArray[np.float32]) -> NDArray[np.int64]:
        """Return the moves that the loop guard chooses from (N, 6) float32 action values: (N,) int64.

        Its memory is the last ``MEMORY`` cells of each lift. A lift that cannot move gets action 0.
        """
        actions = np.zeros(self.count, np.int64)
        self.share(lambda first, last: _guard_all(self.pool, self.state, values, first, last, actions))
        return actions


@leaf_kernel
def _state_of(batch: _Lifts, n: int) -> LiftState:
    """Return the state of one lift of a batch."""
    return LiftState(batch.cell[n, 0], batch.cell[n, 1], batch.cell[n, 2], batch.last_action[n], batch.steps[n])


@leaf_kernel
def _store_state(batch: _Lifts, n: int, state: LiftState) -> None:
    """Overwrite the state of one lift of a batch."""
    batch.cell[n, 0], batch.cell[n, 1], batch.cell[n, 2] = state.x, state.y, state.z
    batch.last_action[n] = state.last_action
    batch.steps[n] = state.steps
    row = state.steps % batch.cells.shape[1]
    batch.cells[n, row, 0], batch.cells[n, row, 1], batch.cells[n, row, 2] = state.x, state.y, state.z


@leaf_kernel
def _look_around(pool: ProblemPool, space: CollisionSpace, batch: _Lifts, n: int, out: NDArray[np.float32]) -> None:
    """Write the view of one lift of a batch."""
    look(space, pool.target[batch.problem[n]], _state_of(batch, n), batch.cells[n], out)


@leaf_kernel
def _begin(pool: ProblemPool, rules: _Rules, batch: _Lifts, n: int) -> None:
    """Begin a new episode of lift ``n``."""
    generator = batch.generator[n : n + 1]
    draw = random_unit(generator)
    p = min(rules.chances.size - 1, int(np.searchsorted(rules.chances, draw, side="right")))
    x, y, z = draw_start(pool, p, rules.mix, generator)
    batch.problem[n] = p
    _store_state(batch, n, initial_state(x, y, z))
    batch.limit[n] = steps_allowed(rules.limit, pooled_distance(pool, p, x, y, z))


@kernel
def _begin_all(
    pool: ProblemPool,
    rules: _Rules,
    batch: _Lifts,
    first: int,
    last: int,
    observations: NDArray[np.float32],
) -> None:
    """Begin a new episode of every lift of a range."""
    for n in range(first, last):
        _begin(pool, rules, batch, n)
        _look_around(pool, pooled_clearance(pool, batch.problem[n]), batch, n, observations[n])


@kernel
def _step_all(
    pool: ProblemPool,
    rules: _Rules,
    batch: _Lifts,
    actions: NDArray[np.int64],
    first: int,
    last: int,
    out: _BatchStep,
) -> None:
    """Step every lift of a range; begin a new episode if one has ended."""
    for n in range(first, last):
        p = batch.problem[n]
        space = pooled_clearance(pool, p)
        state = _state_of(batch, n)
        if out.teacher.shape[0] > 0:
            _ask_teacher(pool, p, space, rules, state, out.teacher[n])
        following, bumped = transition(space, state, actions[n])
        out.terminated[n] = has_arrived(following, pool.target[p])
        out.truncated[n] = not out.terminated[n] and following.steps >= batch.limit[n]
        out.rewards[n] = reward(
            rules.weights,
            pooled_distance(pool, p, state.x, state.y, state.z),
            pooled_distance(pool, p, following.x, following.y, following.z),
            bumped,
            out.terminated[n],
            state.steps >= batch.limit[n],
        )
        _store_state(batch, n, following)
        if out.terminated[n] or out.truncated[n]:
            _look_around(pool, space, batch, n, out.final_observations[n])
            _begin(pool, rules, batch, n)
            space = pooled_clearance(pool, batch.problem[n])
        _look_around(pool, space, batch, n, out.observations[n])


@leaf_kernel
def _ask_teacher(
    pool: ProblemPool,
    p: int,
    space: CollisionSpace,
    rules: _Rules,
    state: LiftState,
    out: NDArray[np.float32],
) -> None:
    """Write the value of each action if all later ones follow a shortest path.

    It is the action's reward plus the discounted value of the path. A path of d moves has the value
    w (1 - g^d) / (1 - g) + g^(d - 1) arrival, w = progress + step, because the reward of a move depends only on whether
    it gets nearer.
    """
    weights, discount = rules.weights, rules.teacher_discount
    here = pooled_distance(pool, p, state.x, state.y, state.z)
    for action in range(ACTION_COUNT):
        following, bumped = transition(space, state, action)
        there = pooled_distance(pool, p, following.x, following.y, following.z)
        value = reward(weights, here, there, bumped, there == 0, False)
        if there > 0:
            each = weights.progress + weights.step
            ahead = each * (1.0 - discount**there) / (1.0 - discount) + weights.arrival * discount ** (there - 1)
            value += discount * ahead
        out[action] = value


@kernel
def _guard_all(
    pool: ProblemPool,
    batch: _Lifts,
    values: NDArray[np.float32],
    first: int,
    last: int,
    actions: NDArray[np.int64],
) -> None:
    """Choose the guard's move for every lift of a range."""
    for n in range(first, last):
        space = pooled_clearance(pool, batch.problem[n])
        target = pool.target[batch.problem[n]]
        actions[n] = max(0, guarded_action(space, target, batch.cells[n], batch.steps[n], values[n], CALM, False))
