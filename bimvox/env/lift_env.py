"""One lift as a Gymnasium environment, ``bimvox/Lift-v0``; ``bimvox.env.gym`` registers it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, SupportsFloat

import gymnasium
import numpy as np
from gymnasium.error import ResetNeeded
from numpy.typing import NDArray

from bimvox.env.actions import ACTION_COUNT, Action, checked_action, known_options, known_render_mode, named
from bimvox.env.batched import MEMORY
from bimvox.env.dynamics import (
    NO_ACTION,
    REWARDS,
    LiftState,
    StepLimit,
    has_arrived,
    initial_state,
    reward,
    steps_allowed,
    transition,
)
from bimvox.env.observation import VIEW_SIZE, look
from bimvox.env.pool import YARD_ONLY, StartMix, draw_start, pool_of
from bimvox.env.problem import LiftProblem, default_problem, is_learnable
from bimvox.site.collision import placement_is_free
from bimvox.site.component import IntVec

FREE, BLOCKED, TARGET, COMPONENT, _EDGE = (
    (250, 250, 250),
    (52, 52, 56),
    (226, 119, 178),
    (31, 119, 214),
    (190, 190, 195),
)
"""Colours: placements that are free, placements that are not, the target, the component, between the views."""

_LEAST_EDGE_PX = 480
"""The longer edge of the picture is at least this long."""

_GAP = 1


def _lift_pixels(problem: LiftProblem, cell_vox: IntVec) -> NDArray[np.uint8]:
    """Return (H, W, 3) uint8 pixels of a lift with its reference cell at a cell.

    A square is a placement of the reference cell. The upper view is its layer from above (x to the right, y up), the
    lower one its row from the front (x to the right, z up).
    """
    nx, ny, nz = problem.grid_shape
    x, y, z = cell_vox
    above, front = np.empty((ny, nx, 3), np.uint8), np.empty((nz, nx, 3), np.uint8)
    for i in range(nx):
        for j in range(ny):
            above[ny - 1 - j, i] = FREE if placement_is_free(problem.space, i, j, z) else BLOCKED
        for k in range(nz):
            front[nz - 1 - k, i] = FREE if placement_is_free(problem.space, i, y, k) else BLOCKED
    tx, ty, tz = problem.target_vox
    above[ny - 1 - ty, tx], front[nz - 1 - tz, tx] = TARGET, TARGET
    above[ny - 1 - y, x], front[nz - 1 - z, x] = COMPONENT, COMPONENT
    between = np.full((_GAP, nx, 3), _EDGE, np.uint8)
    picture = np.concatenate([above, between, front])
    scale = -(-_LEAST_EDGE_PX // max(picture.shape[:2]))
    return np.ascontiguousarray(picture.repeat(scale, axis=0).repeat(scale, axis=1))


class LiftEnv(gymnasium.Env[NDArray[np.float32], np.int64]):
    """Bring one component from the yard to its place, a voxel at a time.

    It uses the same pure functions as :class:`bimvox.env.batched.BatchedLiftEnv`. This environment is for experiments
    and for other learners; the batched one trains the policy.

    ``reset`` takes the options ``problem`` (index) and ``start`` (reference cell), and no others. ``info`` holds
    ``is_success``, ``bumped``, ``cell_vox`` and ``distance`` (moves to the target).

    Args:
        problems: Episodes are drawn from these; default: the paper's site.
        reward_name: A key of ``REWARDS``.
        mix: Where episodes begin; default: only at the problems' yard starts.
        limit: How many actions an episode may take.
        render_mode: None, ``ansi`` (text) or ``rgb_array`` ((H, W, 3) uint8).

    Raises:
        ValueError: A problem is not learnable, or the render mode is unknown.
    """

    metadata = {"render_modes": ["ansi", "rgb_array"], "render_fps": 4}  # noqa: RUF012  (Gymnasium's own convention)

    def __init__(
        self,
        problems: Sequence[LiftProblem] | None = None,
        *,
        reward_name: str = "shaped",
        mix: StartMix = YARD_ONLY,
        limit: StepLimit = StepLimit(),  # noqa: B008  (immutable)
        render_mode: str | None = None,
    ) -> None:
        self._problems = tuple(problems) if problems is not None else (default_problem(),)
        if not all(is_learnable(problem) for problem in self._problems):
            raise ValueError("a problem has no distance field, or no start from which its target can be reached")
        self._pool = pool_of(self._problems, with_distances=True)
        self._weights = named("reward", reward_name, REWARDS)
        self._mix = mix
        self._limit = limit
        self.render_mode = known_render_mode(render_mode, self.metadata["render_modes"])
        self.action_space = gymnasium.spaces.Discrete(ACTION_COUNT)
        self.observation_space = gymnasium.spaces.Box(-1.0, 1.0, (VIEW_SIZE,), np.float32)
        self._p = 0
        self._state = LiftState(0, 0, 0, NO_ACTION, 0)
        self._allowed = 0
        self._begun = False
        self._cells = np.zeros((MEMORY, 3), np.int32)

    @property
    def problem(self) -> LiftProblem:
        """The problem of the running episode."""
        return self._problems[self._p]

    @property
    def state(self) -> LiftState:
        """The state of the running episode."""
        return self._state

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[NDArray[np.float32], dict[str, Any]]:
        """Begin an episode; see the class for ``options``.

        Raises:
            ValueError: An option is unknown, or its value is not possible.
        """
        super().reset(seed=seed)
        chosen = known_options(options, "problem", "start")
        self._p = int(chosen.get("problem", self.np_random.integers(len(self._problems))))
        if not 0 <= self._p < len(self._problems):
            raise ValueError(f"options: problem {self._p} is not one of 0 to {len(self._problems) - 1}")
        if "start" in chosen:
            cell = tuple(int(c) for c in chosen["start"])
            inside = len(cell) == 3 and all(0 <= c < n for c, n in zip(cell, self.problem.grid_shape, strict=True))
            if not inside or self.problem.distance_from(cell) < 0:
                raise ValueError(f"options: start {cell}: the target cannot be reached from there")
        else:
            generator = self.np_random.integers(2**63, size=1).astype(np.uint64)
            cell = draw_start(self._pool, self._p, self._mix, generator)
        self._state = initial_state(*cell)
        self._cells[0] = cell
        self._allowed = steps_allowed(self._limit, self.problem.distance_from(cell))
        self._begun = True
        return self._observation(), self._info(bumped=False)

    def step(self, action: np.int64) -> tuple[NDArray[np.float32], SupportsFloat, bool, bool, dict[str, Any]]:
        """Take one action; see Gymnasium.

        Raises:
            ActionError: If the action is not an integer from 0 to 5.
            ResetNeeded: Before the first ``reset``.
        """
        if not self._begun:
            raise ResetNeeded("step: no episode has begun; call reset() first")
        before = self._state
        self._state, bumped = transition(self.problem.space, before, checked_action(action))
        self._cells[self._state.steps % MEMORY] = self._state[:3]
        arrived = has_arrived(self._state, self._target)
        earned = reward(
            self._weights,
            self.problem.distance_from(before[:3]),
            self.problem.distance_from(self._state[:3]),
            bumped,
            arrived,
            before.steps >= self._allowed,
        )
        truncated = not arrived and self._state.steps >= self._allowed
        return self._observation(), earned, arrived, truncated, self._info(bumped=bumped)

    def render(self) -> Any:
        """Return the picture of the running episode (:func:`bimvox.env.lift_env.lift_pixels`), or text.

        The text is the layer of the reference cell: C the component, T the target's column, # not free.

        Raises:
            ResetNeeded: Before the first ``reset``.
        """
        if self.render_mode is None:
            return None
        if not self._begun:
            raise ResetNeeded("render: no episode has begun; call reset() first")
        if self.render_mode == "rgb_array":
            return _lift_pixels(self.problem, self._state[:3])
        nx, ny, _ = self.problem.grid_shape
        x, y, z, last_action, steps = self._state
        target = self.problem.target_vox
        rows = []
        for j in range(ny - 1, -1, -1):
            row = ["." if placement_is_free(self.problem.space, i, j, z) else "#" for i in range(nx)]
            if j == target[1]:
                row[target[0]] = "T"
            if j == y:
                row[x] = "C"
            rows.append("".join(row))
        done = "-" if last_action == NO_ACTION else Action(last_action).name.lower()
        return "\n".join([f"step {steps}, cell {(x, y, z)}, target {target}, last action {done}", *rows]) + "\n"

    @property
    def _target(self) -> NDArray[np.int32]:
        return np.asarray(self.problem.target_vox, np.int32)

    def _observation(self) -> NDArray[np.float32]:
        out = np.empty(VIEW_SIZE, np.float32)
        look(self.problem.space, self._target, self._state, self._cells, out)
        return out

    def _info(self, *, bumped: bool) -> dict[str, Any]:
        cell = self._state[:3]
        return {
            "is_success": bool(has_arrived(self._state, self._target)),
            "bumped": bumped,
            "cell_vox": cell,
            "distance": self.problem.distance_from(cell),
        }
