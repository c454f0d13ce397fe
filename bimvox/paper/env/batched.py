"""Thousands of sites stepped in one compiled kernel, observations included.

A site whose episode ends begins a new one in the same step; its last observation is kept apart, as learners need it.
Every site has a random generator of its own, so what happens does not depend on the number of threads, nor does a
site's life on how many there are.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bimvox.env.actions import ACTION_COUNT
from bimvox.paper.env.batch_kernels import BatchOut, greedy_rows, move_rows, settle_rows, show, store_row
from bimvox.paper.env.dynamics import stand_up
from bimvox.paper.env.layout import PaperLayout, layout_of, no_layout, pool_of_layouts, random_words, write_layout
from bimvox.paper.env.observation import observation_named, observation_space
from bimvox.paper.env.picture import SitePicture, picture_of_site
from bimvox.paper.env.reward import needs_field, reward_named
from bimvox.paper.env.rules import drawing_of, empty_sites, rules_of
from bimvox.paper.env.spec import PaperSpec
from bimvox.paper.env.state import STATE_SIZE, PaperState, SiteState

_ROWS_PER_THREAD = 256


@dataclass(frozen=True, slots=True, eq=False)
class PaperStep:
    """What one step of N sites gave. The arrays are the environment's own and hold until its next step.

    Where several arrays of observations take turns, the observations hold for as many steps.

    Attributes:
        observations: (N, *shape) float32, of the new episode where the old one ended.
        rewards: (N,) float32.
        terminated: (N,) bool, everything was assembled.
        truncated: (N,) bool, the steps were used up before.
        bumped: (N,) bool, the move was blocked.
        assembled: (N,) bool, a component was assembled.
        final_observations: (N, *shape) float32; only the rows of ended episodes are meant.
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


class BatchedPaperSite:
    """N sites of one description.

    Args:
        spec: The site; its components are renumbered in the order of building.
        sites: N.
        observation: A key of ``OBSERVATIONS``.
        reward: A key of ``PAPER_REWARDS``.
        layouts: What to draw episodes from; None draws every layout anew, as ``spec`` says.
        seed: Same seed, same actions: same everything.
        threads: That step; None takes one per core, fewer where there are few sites.
        teacher: Whether the distance field is kept although the reward does not need it, for ``greedy_actions``.
        turns: Arrays of observations that take turns: one that a step or ``reset`` hands out holds until as many
            steps have been taken after it. Two cost hardly more time than one, and less than a copy.

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
        teacher: bool = False,
        turns: int = 1,
    ) -> None:
        if sites < 1:
            raise ValueError(f"sites: {sites} is less than one")
        if turns < 1:
            raise ValueError(f"turns: {turns} is less than one")
        if layouts is not None and not layouts:
            raise ValueError("layouts: an empty list leaves nothing to draw episodes from")
        self.spec = spec.in_building_order()
        self.sites = sites
        self.observation = observation
        self.observation_space = observation_space(self.spec, observation)
        self._scheme = reward_named(reward)
        self._code = observation_named(observation).code
        most = max((len(layout.obstructions) for layout in layouts or ()), default=0)
        self._rules = rules_of(self.spec)
        self._drawing = drawing_of(self.spec, room_for=most)
        self._pool = pool_of_layouts(self.spec, self._drawing, layouts or ())
        self._generators = np.zeros((sites, 1), np.uint64)
        with_field = teacher or needs_field(self._scheme)
        self._batch = empty_sites(self.spec, self._drawing, sites, with_field=with_field)
        self.states: NDArray[np.int64] = np.zeros((sites, STATE_SIZE), np.int64)
        """(N, 7) int64, columns as the fields of ``PaperState``."""
        size = int(np.prod(self.observation_space.shape))
        first = BatchOut(
            np.zeros((sites, size), np.float32),
            np.zeros((sites, STATE_SIZE), np.int64),
            np.zeros(sites, np.int64),
            np.zeros(sites, np.int64),
            np.zeros(sites, np.float32),
            np.zeros(sites, np.bool_),
            np.zeros(sites, np.bool_),
            np.zeros(sites, np.bool_),
            np.zeros(sites, np.bool_),
            np.zeros((sites, size), np.float32),
            np.zeros((sites, STATE_SIZE), np.int64),
            np.zeros(sites, np.bool_),
        )
        outs = [first] + [
            first._replace(
                observations=np.zeros_like(first.observations),
                shown=np.zeros_like(first.shown),
                drawing=np.zeros_like(first.drawing),
            )
            for _ in range(turns - 1)
        ]
        self._turns = [(out, self._step_of(out)) for out in outs]
        self._take_turn()
        threads = os.cpu_count() or 1 if threads is None else threads
        self.threads = max(1, min(threads, -(-sites // _ROWS_PER_THREAD)))
        self._executor = ThreadPoolExecutor(self.threads - 1) if self.threads > 1 else None
        self.seed(seed)

    @property
    def observations(self) -> NDArray[np.float32]:
        """(N, *shape) float32, the environment's own array: it holds until the next step."""
        return self._step.observations

    @property
    def turns(self) -> int:
        """How many arrays of observations take turns."""
        return len(self._turns)

    def seed(self, seed: int) -> None:
        """Set the states of the random generators that draw layouts."""
        self._generators[:, 0] = random_words(seed, self.sites)

    def reset(self) -> NDArray[np.float32]:
        """Begin N new episodes and return their (N, *shape) float32 observations.

        Raises:
            PlanningError: The yard has no room, or there is no way to the targets.
        """
        self._take_turn()
        if self._shares(lambda first, last: self._settle(first, last, anew=True)):
            raise no_layout(self.spec)
        return self._step.observations

    def place(self, site: int, layout: PaperLayout) -> None:
        """Begin an episode of a given layout; its observation is row ``site`` of the environment's own array.

        Raises:
            ValueError: The layout does not fit the site, or has more obstructions than there is room for.
        """
        one = self._site(site)
        write_layout(self.spec, layout, one)
        state = stand_up(self._rules, one)
        store_row(self.states, site, state)
        self._out.drawings[site] += 1
        show(self._code, self._rules, one, self.states, self._out, site)

    def step(self, actions: ArrayLike, *, copy_to: NDArray[np.float32] | None = None) -> PaperStep:
        """Take one action a site.

        Args:
            actions: (N,) integers 0 .. 5.
            copy_to: (N, *shape) float32 into which the threads copy the observations while they are at it.

        Raises:
            ValueError: The actions are not N numbers of that range.
            PlanningError: No layout was found for a new episode.
        """
        chosen = np.asarray(actions, np.int64)
        if chosen.shape != (self.sites,) or (chosen.min() < 0 or chosen.max() >= ACTION_COUNT):
            raise ValueError(f"actions: {self.sites} integers from 0 to {ACTION_COUNT - 1} are needed")

        self._take_turn()

        def share(first: int, last: int) -> int:
            move_rows(self._code, self._rules, self._scheme, self._batch, self.states, self._out, first, last, chosen)
            failures = self._settle(first, last, anew=False)
            if copy_to is not None:
                copy_to[first:last] = self._step.observations[first:last]
            return failures

        if self._shares(share):
            raise no_layout(self.spec)
        return self._step

    def state(self, site: int) -> PaperState:
        """Return the state of one site."""
        return PaperState(*(int(value) for value in self.states[site]))

    def layout(self, site: int) -> PaperLayout:
        """Return the layout of one site's running episode."""
        return layout_of(self._site(site))

    def cells(self, site: int) -> NDArray[np.int16]:
        """Return (X, Y, Z) int16 what fills each cell of one site, the component in transit left out."""
        return self._site(site).cells

    def picture(self, site: int) -> SitePicture:
        """Return what a picture of one site shows."""
        fresh = bool(self._out.assembled[site] and self.states[site, 6] > 0)
        return picture_of_site(self.spec, self._site(site), self.state(site), just_assembled=fresh)

    def greedy_actions(self) -> NDArray[np.int64]:
        """Return the first action of each site that comes nearer to the target by the exact distance, (N,) int64.

        Raises:
            ValueError: The batch was made without the distance field.
        """
        if self._batch.field.size == 0:
            raise ValueError("teacher: this batch was made without the distance field")
        return greedy_rows(self._batch, self.states)

    def close(self) -> None:
        """End the threads."""
        if self._executor is not None:
            self._executor.shutdown()
            self._executor = None

    def _take_turn(self) -> None:
        """Let the array of observations be written whose turn was longest ago."""
        self._turns = [*self._turns[1:], self._turns[0]]
        self._out, self._step = self._turns[-1]

    def _step_of(self, out: BatchOut) -> PaperStep:
        """Return what is written to, as it is handed out."""
        shape = (self.sites, *self.observation_space.shape)
        return PaperStep(
            out.observations.reshape(shape),
            out.rewards,
            out.terminated,
            out.truncated,
            out.bumped,
            out.assembled,
            out.final_observations.reshape(shape),
            out.final_states,
            out.late,
        )

    def _site(self, site: int) -> SiteState:
        return SiteState(*(array[site] for array in self._batch))

    def _shares(self, work: Callable[[int, int], int]) -> int:
        """Let each thread work on its share of the rows; returns the sum of what they return."""
        bounds = [self.sites * t // self.threads for t in range(self.threads + 1)]
        pairs = list(pairwise(bounds))
        others = [self._executor.submit(work, *pair) for pair in pairs[1:]] if self._executor else []
        return work(*pairs[0]) + sum(other.result() for other in others)

    def _settle(self, first: int, last: int, *, anew: bool) -> int:
        return int(
            settle_rows(
                self._code,
                self._rules,
                self._drawing,
                self._pool,
                self._batch,
                self._generators,
                self.states,
                self._out,
                first,
                last,
                anew,
            )
        )
