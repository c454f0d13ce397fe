"""The kernels of the batched environment: the functions of ``dynamics`` and ``observation``, row by row."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import kernel, leaf_kernel
from bimvox.env.actions import ACTION_COUNT, MOVES
from bimvox.env.starts import random_below
from bimvox.paper.env.draw import draw_layout
from bimvox.paper.env.dynamics import assemble, is_complete, is_late, is_truncated, move, stand_up
from bimvox.paper.env.layout import LayoutPool
from bimvox.paper.env.observation import PAPER_MAP, write_observation
from bimvox.paper.env.paper_map import move_on_map
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
    """The result of one step of N sites. The arrays are the environment's own and hold until its next step.

    If several arrays of observations take turns, an observation holds for as many steps.

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

    @property
    def ended(self) -> NDArray[np.bool_]:
        """(N,) bool, the episode ended."""
        return self.terminated | self.truncated


class BatchOut(NamedTuple):
    """The arrays that a step of N sites overwrites.

    If several arrays of observations take turns, each shows the sites as they were at its last turn. The paper's map is
    updated by moving the component in transit from where the array shows it, unless it has been redrawn since.

    Attributes:
        step: The result.
        shown: (N, 7) int64 state that the observations show.
        drawing: (N,) int64 number of the drawing that the observations show.
        drawings: (N,) int64 how often the map has been redrawn, on any array.
    """

    step: PaperStep
    shown: NDArray[np.int64]
    drawing: NDArray[np.int64]
    drawings: NDArray[np.int64]


@leaf_kernel
def state_row(states: NDArray[np.int64], n: int) -> PaperState:
    """Return the state of one site of a batch."""
    return PaperState(states[n, 0], states[n, 1], states[n, 2], states[n, 3], states[n, 4], states[n, 5], states[n, 6])


@leaf_kernel
def store_row(states: NDArray[np.int64], n: int, state: PaperState) -> None:
    """Overwrite the state of one site of a batch."""
    states[n, 0], states[n, 1], states[n, 2], states[n, 3] = state.component, state.x, state.y, state.z
    states[n, 4], states[n, 5], states[n, 6] = state.last_action, state.steps, state.total


@leaf_kernel
def move_rows(
    batch: BatchRules, sites: BatchSites, out: BatchOut, first: int, last: int, actions: NDArray[np.int64]
) -> None:
    """Move the component in transit on sites ``first`` .. ``last - 1``, and on the paper's map.

    :func:`settle_rows` does the rest, which is seldom needed. The views of a site are made here, not returned by a
    function: counting references to them would cost more than the step.
    """
    rules, at, step = batch.rules, sites.arrays, out.step
    for n in range(first, last):
        site = SiteState(at.cells[n], at.table[n], at.stored[n], at.target[n], at.obstructions[n], at.field[n])
        before = state_row(sites.states, n)
        after, value, bumped, arrived = move(rules, batch.scheme, site, before, actions[n])
        store_row(sites.states, n, after)
        store_row(step.final_states, n, after)
        step.rewards[n] = value
        step.bumped[n] = bumped
        step.assembled[n] = arrived
        step.terminated[n] = False
        step.truncated[n] = is_truncated(rules, after)
        step.late[n] = is_late(rules, after)
        if batch.code == PAPER_MAP and not arrived and out.drawing[n] == out.drawings[n]:
            move_on_map(rules, state_row(out.shown, n), after, step.observations[n], at.cells.shape[2])
            store_row(out.shown, n, after)


@kernel
def settle_rows(batch: BatchRules, sites: BatchSites, out: BatchOut, first: int, last: int, anew: bool) -> int:
    """Complete the step on sites ``first`` .. ``last - 1``, and return for how many of them no layout was found.

    A component that has arrived is assembled. If an episode has ended, its last observation is kept and a new episode
    begins; with ``anew``, a new episode begins on every site. Observations other than the paper's map are written.
    """
    failures = 0
    code, rules, pool, at, step = batch.code, batch.rules, batch.pool, sites.arrays, out.step
    for n in range(first, last):
        begins = anew
        arrived = step.assembled[n] and not anew
        outdated = out.drawing[n] != out.drawings[n]
        if not arrived and not step.truncated[n] and not anew and code == PAPER_MAP and not outdated:
            continue
        site = SiteState(at.cells[n], at.table[n], at.stored[n], at.target[n], at.obstructions[n], at.field[n])
        if arrived:
            after = assemble(rules, site, state_row(sites.states, n))
            store_row(sites.states, n, after)
            store_row(step.final_states, n, after)
            step.terminated[n] = is_complete(rules, after)
            step.truncated[n] = is_truncated(rules, after)
            step.late[n] = False
        if not anew and (step.terminated[n] or step.truncated[n]):
            write_observation(code, rules, site, state_row(sites.states, n), step.final_observations[n])
            begins = True
        if begins:
            if pool.stored.shape[0] > 0:
                p = random_below(sites.generators[n], pool.stored.shape[0])
                site.stored[:] = pool.stored[p]
                site.target[:] = pool.target[p]
                site.obstructions[:] = pool.obstructions[p]
            elif not draw_layout(rules, batch.drawing, site, sites.generators[n]):
                failures += 1
            store_row(sites.states, n, stand_up(rules, site))
        if arrived or begins:
            out.drawings[n] += 1
        show(code, rules, site, sites.states, out, n)
    return failures


@kernel
def step_rows(
    batch: BatchRules, sites: BatchSites, out: BatchOut, first: int, last: int, actions: NDArray[np.int64]
) -> int:
    """Take one action on sites ``first`` .. ``last - 1``; see :func:`settle_rows`."""
    move_rows(batch, sites, out, first, last, actions)
    return settle_rows(batch, sites, out, first, last, False)


@kernel
def show(code: int, rules: SpecArrays, site: SiteState, states: NDArray[np.int64], out: BatchOut, n: int) -> None:
    """Write the whole observation of one site, and note what it shows."""
    write_observation(code, rules, site, state_row(states, n), out.step.observations[n])
    store_row(out.shown, n, state_row(states, n))
    out.drawing[n] = out.drawings[n]


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
