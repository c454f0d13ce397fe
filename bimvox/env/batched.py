"""Thousands of lifts stepped in one compiled kernel, observations included.

A lift that ends begins a new episode in the same step; its last observation is kept apart, as learners need it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bimvox.compiled import kernel, leaf_kernel
from bimvox.env.dynamics import has_arrived, transition
from bimvox.env.limits import StepLimit, steps_allowed
from bimvox.env.observation import OBSERVATION_SIZE, observe
from bimvox.env.pool import ProblemPool, pool_of, pooled_clearance, pooled_distance
from bimvox.env.problem import LiftProblem, is_learnable
from bimvox.env.reward import REWARDS, RewardWeights, reward
from bimvox.env.starts import TRAINING_MIX, StartMix, draw_start, random_unit
from bimvox.env.state import LiftState, initial_state


class BatchState(NamedTuple):
    """Where N lifts are; a plain tuple of arrays that the kernels overwrite.

    Attributes:
        problem: (N,) int64 index into the pool.
        cell: (N, 3) int64 reference cells.
        last_action: (N,) int64.
        steps: (N,) int64 actions since the episode's start.
        limit: (N,) int64 actions allowed.
    """

    problem: NDArray[np.int64]
    cell: NDArray[np.int64]
    last_action: NDArray[np.int64]
    steps: NDArray[np.int64]
    limit: NDArray[np.int64]


@dataclass(frozen=True, slots=True, eq=False)
class BatchStep:
    """What one step of N lifts gave. The arrays are the environment's own: they hold until its next step.

    Attributes:
        observations: (N, OBSERVATION_SIZE) float32, of the new episode where the old one ended.
        rewards: (N,) float32.
        arrived: (N,) bool, the target was reached: terminated.
        truncated: (N,) bool, the step limit was reached elsewhere.
        final_observations: (N, OBSERVATION_SIZE) float32; only the rows of ended episodes are meant.
    """

    observations: NDArray[np.float32]
    rewards: NDArray[np.float32]
    arrived: NDArray[np.bool_]
    truncated: NDArray[np.bool_]
    final_observations: NDArray[np.float32]

    @property
    def ended(self) -> NDArray[np.bool_]:
        """(N,) bool, the episode ended."""
        return self.arrived | self.truncated


class BatchedLiftEnv:
    """N lifts over a pool of problems.

    Args:
        problems: What to draw episodes from; each learnable (:func:`bimvox.env.problem.is_learnable`).
        lifts: N.
        reward_name: A key of ``REWARDS``.
        mix: Where episodes begin.
        limit: How many actions an episode may take, from its exact distance.
        seed: Same seed, same actions: same everything.

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
    ) -> None:
        if not all(is_learnable(problem) for problem in problems):
            raise ValueError("a problem has no distance field, or no start from which its target can be reached")
        self.lifts = lifts
        self.pool = pool_of(problems, with_distances=True)
        self._weights = REWARDS[reward_name]
        self._mix = mix
        self._limit = limit
        self._chances = np.full(len(problems), 1.0 / len(problems)).cumsum()
        self._generator = np.zeros(1, np.uint64)
        self.state = BatchState(
            np.zeros(lifts, np.int64),
            np.zeros((lifts, 3), np.int64),
            np.zeros(lifts, np.int64),
            np.zeros(lifts, np.int64),
            np.zeros(lifts, np.int64),
        )
        self._step = BatchStep(
            np.zeros((lifts, OBSERVATION_SIZE), np.float32),
            np.zeros(lifts, np.float32),
            np.zeros(lifts, np.bool_),
            np.zeros(lifts, np.bool_),
            np.zeros((lifts, OBSERVATION_SIZE), np.float32),
        )
        self.seed(seed)

    def seed(self, seed: int) -> None:
        """Set the state of the random generator that draws problems and starts."""
        self._generator[0] = np.random.SeedSequence(seed).generate_state(1, np.uint64)[0]

    def weigh_problems(self, weights: ArrayLike) -> None:
        """Set how often each problem is drawn, (P,) positive weights."""
        share = np.asarray(weights, np.float64)
        self._chances = np.cumsum(share / share.sum())

    def reset(self) -> NDArray[np.float32]:
        """Begin N new episodes and return their (N, OBSERVATION_SIZE) float32 observations."""
        _begin_all(
            self.pool, self._chances, self._mix, self._limit, self._generator, self.state, self._step.observations
        )
        return self._step.observations

    def place(self, lift: int, problem: int, cell_vox: ArrayLike) -> None:
        """Begin an episode of ``problem`` at a given reference cell; the next step starts from there."""
        x, y, z = (int(c) for c in np.asarray(cell_vox))
        distance = pooled_distance(self.pool, problem, x, y, z)
        self.state.problem[lift] = problem
        self.state.cell[lift] = (x, y, z)
        self.state.last_action[lift] = initial_state(x, y, z).last_action
        self.state.steps[lift] = 0
        self.state.limit[lift] = steps_allowed(self._limit, distance)

    def step(self, actions: NDArray[np.int64]) -> BatchStep:
        """Take one action a lift, (N,) int64."""
        out = self._step
        _step_all(
            self.pool,
            self._chances,
            self._mix,
            self._limit,
            self._weights,
            self._generator,
            self.state,
            np.asarray(actions, np.int64),
            out.observations,
            out.rewards,
            out.arrived,
            out.truncated,
            out.final_observations,
        )
        return out


@leaf_kernel
def state_of(batch: BatchState, n: int) -> LiftState:
    """Return the state of one lift of a batch."""
    return LiftState(batch.cell[n, 0], batch.cell[n, 1], batch.cell[n, 2], batch.last_action[n], batch.steps[n])


@leaf_kernel
def store_state(batch: BatchState, n: int, state: LiftState) -> None:
    """Overwrite the state of one lift of a batch."""
    batch.cell[n, 0], batch.cell[n, 1], batch.cell[n, 2] = state.x, state.y, state.z
    batch.last_action[n] = state.last_action
    batch.steps[n] = state.steps


@leaf_kernel
def _begin(
    pool: ProblemPool,
    chances: NDArray[np.float64],
    mix: StartMix,
    limit: StepLimit,
    generator: NDArray[np.uint64],
    batch: BatchState,
    n: int,
) -> None:
    """Begin a new episode of lift ``n``."""
    draw = random_unit(generator)
    p = 0
    while p < chances.size - 1 and chances[p] <= draw:
        p += 1
    x, y, z = draw_start(pool, p, mix, generator)
    batch.problem[n] = p
    store_state(batch, n, initial_state(x, y, z))
    batch.limit[n] = steps_allowed(limit, pooled_distance(pool, p, x, y, z))


@kernel
def _begin_all(
    pool: ProblemPool,
    chances: NDArray[np.float64],
    mix: StartMix,
    limit: StepLimit,
    generator: NDArray[np.uint64],
    batch: BatchState,
    observations: NDArray[np.float32],
) -> None:
    """Begin a new episode of every lift."""
    for n in range(observations.shape[0]):
        _begin(pool, chances, mix, limit, generator, batch, n)
        p = batch.problem[n]
        observe(pooled_clearance(pool, p), pool.target[p], state_of(batch, n), observations[n])


@kernel
def _step_all(
    pool: ProblemPool,
    chances: NDArray[np.float64],
    mix: StartMix,
    limit: StepLimit,
    weights: RewardWeights,
    generator: NDArray[np.uint64],
    batch: BatchState,
    actions: NDArray[np.int64],
    observations: NDArray[np.float32],
    rewards: NDArray[np.float32],
    arrived: NDArray[np.bool_],
    truncated: NDArray[np.bool_],
    final_observations: NDArray[np.float32],
) -> None:
    """Step every lift; begin anew where an episode ended."""
    for n in range(actions.size):
        p = batch.problem[n]
        clearance = pooled_clearance(pool, p)
        state = state_of(batch, n)
        following, bumped = transition(clearance, state, actions[n])
        arrived[n] = has_arrived(following, pool.target[p])
        truncated[n] = not arrived[n] and following.steps >= batch.limit[n]
        rewards[n] = reward(
            weights,
            pooled_distance(pool, p, state.x, state.y, state.z),
            pooled_distance(pool, p, following.x, following.y, following.z),
            bumped,
            arrived[n],
            state.steps >= batch.limit[n],
        )
        store_state(batch, n, following)
        if arrived[n] or truncated[n]:
            observe(clearance, pool.target[p], following, final_observations[n])
            _begin(pool, chances, mix, limit, generator, batch, n)
            p = batch.problem[n]
            clearance = pooled_clearance(pool, p)
        observe(clearance, pool.target[p], state_of(batch, n), observations[n])
