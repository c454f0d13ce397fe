"""The kernels of the batched environment: the functions of ``dynamics`` and ``observation``, row by row."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import kernel, leaf_kernel
from bimvox.env.actions import ACTION_COUNT, MOVES
from bimvox.env.pool import random_below
from bimvox.paper.env.draw import draw_layout
from bimvox.paper.env.dynamics import assemble, is_complete, is_late, is_truncated, move, stand_up
from bimvox.paper.env.layout import LayoutPool
from bimvox.paper.env.observation import write_observation
from bimvox.paper.env.reward import PaperReward
from bimvox.paper.env.rules import Drawing, SpecArrays
from bimvox.paper.env.state import PaperState, SiteState


class BatchRules(NamedTuple):
    """What all sites of a batch share; no step changes it.

    Attributes:
        code: Of the observation.
        rules: Of the sites.
        scheme: How actions are rewarded.
        drawing: How layouts are drawn.
        pool: Layouts to draw from instead, if it holds any.
    """

    code: int
    rules: SpecArrays
    scheme: PaperReward
    drawing: Drawing
    pool: LayoutPool


class BatchSites(NamedTuple):
    """N sites; the kernels overwrite their arrays.

    Attributes:
        arrays: Of the sites, each with a first axis of N.
        generators: (N, 1) uint64 states of the random generators.
        states: (N, 7) int64, columns as the fields of ``PaperState``.
    """

    arrays: SiteState
    generators: NDArray[np.uint64]
    states: NDArray[np.int64]


class PaperStep(NamedTuple):
    """The result of one step of N sites. The arrays are the environment's own and hold until the step after the next.

    Attributes:
        observations: (N, *shape) float32, of the new episode if the old one ended; (N, size) in kernels.
        rewards: (N,) float32.
        terminated: (N,) bool, everything was assembled.
        truncated: (N,) bool, the steps were used up first.
        bumped: (N,) bool, the move was blocked.
        assembled: (N,) bool, a component was assembled.
        final_observations: Shaped as ``observations``, valid for ended episodes only.
        final_states: (N, 7) int64 ``PaperState`` after the action, before a new episode began.
        late: (N,) bool, the component in transit was late after the action, before a new episode began.
        teacher: (0, 6): sites have no teacher.
    """

    observations: NDArray[np.float32]
    rewards: NDArray[np.float32]
    terminated: NDArray[np.bool_]
    truncated: NDArray[np.bool_]
    bumped: NDArray[np.bool_]
    assembled: NDArray[np.bool_]
    final_observations: NDArray[np.float32]
    final_states: NDArray[np.int64]
    late: NDArray[np.bool_]
    teacher: NDArray[np.float32]

    @property
    def ended(self) -> NDArray[np.bool_]:
        """(N,) bool, the episode ended."""
        return self.terminated | self.truncated


@leaf_kernel
def state_row(states: NDArray[np.int64], n: int) -> PaperState:
    """Return the state of one site of a batch."""
    return PaperState(states[n, 0], states[n, 1], states[n, 2], states[n, 3], states[n, 4], states[n, 5], states[n, 6])


@leaf_kernel
def store_row(states: NDArray[np.int64], n: int, state: PaperState) -> None:
    """Overwrite the state of one site of a batch."""
    states[n, 0], states[n, 1], states[n, 2], states[n, 3] = state.component, state.x, state.y, state.z
    states[n, 4], states[n, 5], states[n, 6] = state.last_action, state.steps, state.total


@kernel
def step_rows(
    batch: BatchRules, sites: BatchSites, step: PaperStep, first: int, last: int, actions: NDArray[np.int64]
) -> int:
    """Take one action on sites ``first`` .. ``last - 1``, and return for how many of them no layout was found.

    A component that has arrived is assembled. If an episode has ended, its last observation is kept and a new one
    begins.
    """
    failures, rules, at = 0, batch.rules, sites.arrays
    for n in range(first, last):
        site = SiteState(at.cells[n], at.table[n], at.stored[n], at.target[n], at.obstructions[n], at.field[n])
        after, value, bumped, arrived = move(rules, batch.scheme, site, state_row(sites.states, n), actions[n])
        if arrived:
            after = assemble(rules, site, after)
        store_row(sites.states, n, after)
        store_row(step.final_states, n, after)
        step.rewards[n] = value
        step.bumped[n] = bumped
        step.assembled[n] = arrived
        step.late[n] = is_late(rules, after)
        step.terminated[n] = arrived and is_complete(rules, after)
        step.truncated[n] = is_truncated(rules, after)
        if step.terminated[n] or step.truncated[n]:
            write_observation(batch.code, rules, site, after, step.final_observations[n])
            failures += begin_row(batch, sites, site, n)
        write_observation(batch.code, rules, site, state_row(sites.states, n), step.observations[n])
    return failures


@kernel
def begin_rows(batch: BatchRules, sites: BatchSites, step: PaperStep, first: int, last: int) -> int:
    """Begin an episode on sites ``first`` .. ``last - 1``, and return for how many of them no layout was found."""
    failures, at = 0, sites.arrays
    for n in range(first, last):
        site = SiteState(at.cells[n], at.table[n], at.stored[n], at.target[n], at.obstructions[n], at.field[n])
        failures += begin_row(batch, sites, site, n)
        write_observation(batch.code, batch.rules, site, state_row(sites.states, n), step.observations[n])
    return failures


@kernel
def begin_row(batch: BatchRules, sites: BatchSites, site: SiteState, n: int) -> int:
    """Begin an episode on one site: a layout of the pool, or a drawn one; return 1 if none was found."""
    failures, pool = 0, batch.pool
    if pool.stored.shape[0] > 0:
        p = random_below(sites.generators[n], pool.stored.shape[0])
        site.stored[:] = pool.stored[p]
        site.target[:] = pool.target[p]
        site.obstructions[:] = pool.obstructions[p]
    elif not draw_layout(batch.rules, batch.drawing, site, sites.generators[n]):
        failures = 1
    store_row(sites.states, n, stand_up(batch.rules, site))
    return failures


@kernel
def greedy_rows(arrays: SiteState, states: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the first action of each site that leads nearer to the target; 0 if none does."""
    nx, ny, nz = arrays.cells.shape[1], arrays.cells.shape[2], arrays.cells.shape[3]
    actions = np.zeros(states.shape[0], np.int64)
    for n in range(states.shape[0]):
        x, y, z = states[n, 1], states[n, 2], states[n, 3]
        for action in range(ACTION_COUNT):
            u, v, w = x + MOVES[action, 0], y + MOVES[action, 1], z + MOVES[action, 2]
            inside = 0 <= u < nx and 0 <= v < ny and 0 <= w < nz
            if inside and 0 <= arrays.field[n, u, v, w] < arrays.field[n, x, y, z]:
                actions[n] = action
                break
    return actions
