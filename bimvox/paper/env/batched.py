"""Thousands of sites stepped in one compiled kernel, observations included.

A site whose episode ends begins a new one in the same step; its last observation is kept separately for learners. Every
site has its own random generator, so its episodes depend neither on the number of threads nor on the number of sites.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bimvox.compiled import kernel, leaf_kernel
from bimvox.env.actions import ACTION_COUNT, MOVES, checked_actions, named
from bimvox.env.batched import Rows
from bimvox.env.pool import random_below
from bimvox.paper.env.dynamics import (
    PAPER_REWARDS,
    PaperReward,
    assemble,
    is_complete,
    is_late,
    is_truncated,
    move,
    stand_up,
)
from bimvox.paper.env.layout import (
    LayoutPool,
    PaperLayout,
    draw_layout,
    layout_of,
    no_layout,
    pool_of_layouts,
    random_words,
    write_layout,
)
from bimvox.paper.env.observation import OBSERVATIONS, observation_space, write_observation
from bimvox.paper.env.picture import SitePicture, picture_of_site
from bimvox.paper.env.spec import PaperSpec
from bimvox.paper.env.state import (
    STATE_SIZE,
    Drawing,
    PaperState,
    SiteState,
    SpecArrays,
    drawing_of,
    empty_sites,
    rules_of,
)
from bimvox.processes import processors


class _BatchRules(NamedTuple):
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


class _BatchSites(NamedTuple):
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
def _state_row(states: NDArray[np.int64], n: int) -> PaperState:
    """Return the state of one site of a batch."""
    return PaperState(states[n, 0], states[n, 1], states[n, 2], states[n, 3], states[n, 4], states[n, 5], states[n, 6])


@leaf_kernel
def _store_row(states: NDArray[np.int64], n: int, state: PaperState) -> None:
    """Overwrite the state of one site of a batch."""
    states[n, 0], states[n, 1], states[n, 2], states[n, 3] = state.component, state.x, state.y, state.z
    states[n, 4], states[n, 5], states[n, 6] = state.last_action, state.steps, state.total


@kernel
def _step_rows(
    batch: _BatchRules, sites: _BatchSites, step: PaperStep, first: int, last: int, actions: NDArray[np.int64]
) -> int:
    """Take one action on sites ``first`` .. ``last - 1``, and return for how many of them no layout was found.

    A component that has arrived is assembled. If an episode has ended, its last observation is kept and a new one
    begins.
    """
    failures, rules, at = 0, batch.rules, sites.arrays
    for n in range(first, last):
        site = SiteState(at.cells[n], at.table[n], at.stored[n], at.target[n], at.obstructions[n], at.field[n])
        after, value, bumped, arrived = move(rules, batch.scheme, site, _state_row(sites.states, n), actions[n])
        if arrived:
            after = assemble(rules, site, after)
        _store_row(sites.states, n, after)
        _store_row(step.final_states, n, after)
        step.rewards[n] = value
        step.bumped[n] = bumped
        step.assembled[n] = arrived
        step.late[n] = is_late(rules, after)
        step.terminated[n] = arrived and is_complete(rules, after)
        step.truncated[n] = is_truncated(rules, after)
        if step.terminated[n] or step.truncated[n]:
            write_observation(batch.code, rules, site, after, step.final_observations[n])
            failures += _begin_row(batch, sites, site, n)
        write_observation(batch.code, rules, site, _state_row(sites.states, n), step.observations[n])
    return failures


@kernel
def _begin_rows(batch: _BatchRules, sites: _BatchSites, step: PaperStep, first: int, last: int) -> int:
    """Begin an episode on sites ``first`` .. ``last - 1``, and return for how many of them no layout was found."""
    failures, at = 0, sites.arrays
    for n in range(first, last):
        site = SiteState(at.cells[n], at.table[n], at.stored[n], at.target[n], at.obstructions[n], at.field[n])
        failures += _begin_row(batch, sites, site, n)
        write_observation(batch.code, batch.rules, site, _state_row(sites.states, n), step.observations[n])
    return failures


@kernel
def _begin_row(batch: _BatchRules, sites: _BatchSites, site: SiteState, n: int) -> int:
    """Begin an episode on one site: a layout of the pool, or a drawn one; return 1 if none was found."""
    failures, pool = 0, batch.pool
    if pool.stored.shape[0] > 0:
        p = random_below(sites.generators[n], pool.stored.shape[0])
        site.stored[:] = pool.stored[p]
        site.target[:] = pool.target[p]
        site.obstructions[:] = pool.obstructions[p]
    elif not draw_layout(batch.rules, batch.drawing, site, sites.generators[n]):
        failures = 1
    _store_row(sites.states, n, stand_up(batch.rules, site))
    return failures


@kernel
def _greedy_rows(arrays: SiteState, states: NDArray[np.int64]) -> NDArray[np.int64]:
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


_ROWS_PER_THREAD = 256


class BatchedPaperSite(Rows):
    """N sites of one description.

    Args:
        spec: The site; its components are renumbered in the order of building.
        sites: N.
        observation: A key of ``OBSERVATIONS``.
        reward: A key of ``PAPER_REWARDS``.
        layouts: Episodes are drawn from these. None draws a new layout for each, as ``spec`` says.
        seed: The same seed and actions give the same episodes.
        threads: Number of threads. None takes one per core, but fewer for few sites.

    Raises:
        ValueError: A name is unknown, or a layout does not fit the site.
    """

    def __init__(
        self,
        spec: PaperSpec,
        sites: int,
        *,
        observation: str = "paper_flat",
        reward: str = "paper",
        layouts: Sequence[PaperLayout] | None = None,
        seed: int = 0,
        threads: int | None = None,
    ) -> None:
        if sites < 1:
            raise ValueError(f"sites: {sites} is less than one")
        if layouts is not None and not layouts:
            raise ValueError("layouts: an empty list leaves nothing to draw episodes from")
        self.spec = spec.in_building_order()
        threads = processors() if threads is None else threads
        super().__init__(sites, max(1, min(threads, -(-sites // _ROWS_PER_THREAD))))
        self.observation = observation
        self.observation_space = observation_space(self.spec, observation)
        scheme = named("reward", reward, PAPER_REWARDS)
        most = max((len(layout.obstructions) for layout in layouts or ()), default=0)
        drawing = drawing_of(self.spec, room_for=most)
        pool = pool_of_layouts(self.spec, drawing, layouts or ())
        self._batch = _BatchRules(OBSERVATIONS[observation].code, rules_of(self.spec), scheme, drawing, pool)
        self._sites = _BatchSites(
            empty_sites(self.spec, drawing, sites, with_field=scheme.weights.needs_distance),
            np.zeros((sites, 1), np.uint64),
            np.zeros((sites, STATE_SIZE), np.int64),
        )
        self._turns = [self._room() for _ in range(2)]
        self.seed(seed)

    @property
    def states(self) -> NDArray[np.int64]:
        """(N, 7) int64, columns as the fields of ``PaperState``."""
        return self._sites.states

    def seed(self, seed: int) -> None:
        """Set the states of the random generators that draw layouts."""
        self._sites.generators[:, 0] = random_words(seed, self.count)

    def keep_distance_field(self) -> None:
        """Compute the distance field even if the reward does not need it, from the next ``reset`` on."""
        arrays = empty_sites(self.spec, self._batch.drawing, self.count, with_field=True)
        self._sites = self._sites._replace(arrays=arrays)

    def reset(self) -> NDArray[np.float32]:
        """Begin N new episodes and return their (N, *shape) float32 observations.

        Raises:
            PlanningError: The yard has no room, or a component has no path to its target.
        """
        step, flat = self._turns[0]
        if self.share(lambda first, last: int(_begin_rows(self._batch, self._sites, flat, first, last))):
            raise no_layout(self.spec)
        return step.observations

    def place(self, site: int, layout: PaperLayout) -> None:
        """Begin an episode of a given layout; its observation is row ``site`` of the array returned last.

        Raises:
            ValueError: The layout does not fit the site, or has more obstructions than there is room for.
        """
        one = self._site(site)
        write_layout(self.spec, layout, one)
        state = stand_up(self._batch.rules, one)
        _store_row(self.states, site, state)
        write_observation(self._batch.code, self._batch.rules, one, state, self._turns[0][1].observations[site])

    def step(self, actions: ArrayLike) -> PaperStep:
        """Take one action per site.

        Args:
            actions: (N,) integers 0 .. 5.

        Raises:
            ActionError: The actions are not N integers of that range.
            PlanningError: No layout was found for a new episode.
        """
        chosen = checked_actions(actions, self.count)
        self._turns.reverse()
        step, flat = self._turns[0]
        if self.share(lambda first, last: int(_step_rows(self._batch, self._sites, flat, first, last, chosen))):
            raise no_layout(self.spec)
        return step

    def chosen_actions(self, values: NDArray[np.float32]) -> NDArray[np.int64]:
        """Return the actions of the highest values, (N,) int64 of (N, 6)."""
        return np.asarray(values.argmax(axis=1), np.int64)

    def state(self, site: int) -> PaperState:
        """Return the state of one site."""
        return PaperState(*(int(value) for value in self.states[site]))

    def layout(self, site: int) -> PaperLayout:
        """Return the layout of one site's running episode."""
        return layout_of(self._site(site))

    def cells(self, site: int) -> NDArray[np.int16]:
        """Return (X, Y, Z) int16: what fills each cell of one site, without the component in transit."""
        return self._site(site).cells

    def picture(self, site: int) -> SitePicture:
        """Return the picture of one site."""
        fresh = bool(self._turns[0][0].assembled[site] and self.states[site, 6] > 0)
        return picture_of_site(self.spec, self._site(site), self.state(site), just_assembled=fresh)

    def greedy_actions(self) -> NDArray[np.int64]:
        """Return the first action of each site that leads nearer to the target by the exact distance, (N,) int64.

        Raises:
            ValueError: The batch has no distance field.
        """
        if self._sites.arrays.field.size == 0:
            raise ValueError("this batch is without the distance field; call keep_distance_field() before reset()")
        return _greedy_rows(self._sites.arrays, self.states)

    def _room(self) -> tuple[PaperStep, PaperStep]:
        """Return arrays for a step, shaped as they are handed out, and flat as kernels write them."""
        size = int(np.prod(self.observation_space.shape))
        terminated, truncated, bumped, assembled, late = np.zeros((5, self.count), np.bool_)
        flat = PaperStep(
            np.zeros((self.count, size), np.float32),
            np.zeros(self.count, np.float32),
            terminated,
            truncated,
            bumped,
            assembled,
            np.zeros((self.count, size), np.float32),
            np.zeros((self.count, STATE_SIZE), np.int64),
            late,
            np.zeros((0, ACTION_COUNT), np.float32),
        )
        shape = (self.count, *self.observation_space.shape)
        shaped = flat._replace(
            observations=flat.observations.reshape(shape), final_observations=flat.final_observations.reshape(shape)
        )
        return shaped, flat

    def _site(self, site: int) -> SiteState:
        return SiteState(*(array[site] for array in self._sites.arrays))
