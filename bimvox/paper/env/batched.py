"""Thousands of sites stepped in one compiled kernel, observations included.

A site whose episode ends begins a new one in the same step; its last observation is kept separately for learners. Every
site has its own random generator, so its episodes depend neither on the number of threads nor on the number of sites.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bimvox.env.actions import checked_actions
from bimvox.env.names import named
from bimvox.paper.env.batch_kernels import (
    BatchOut,
    BatchRules,
    BatchSites,
    PaperStep,
    greedy_rows,
    settle_rows,
    show,
    step_rows,
    store_row,
)
from bimvox.paper.env.dynamics import stand_up
from bimvox.paper.env.layout import PaperLayout, layout_of, no_layout, pool_of_layouts, random_words, write_layout
from bimvox.paper.env.observation import OBSERVATIONS, observation_space
from bimvox.paper.env.picture import SitePicture, picture_of_site
from bimvox.paper.env.reward import PAPER_REWARDS
from bimvox.paper.env.rules import drawing_of, empty_sites, rules_of
from bimvox.paper.env.spec import PaperSpec
from bimvox.paper.env.state import STATE_SIZE, PaperState, SiteState
from bimvox.processes import processors

_ROWS_PER_THREAD = 256


class BatchedPaperSite:
    """N sites of one description.

    Args:
        spec: The site; its components are renumbered in the order of building.
        sites: N.
        observation: A key of ``OBSERVATIONS``.
        reward: A key of ``PAPER_REWARDS``.
        layouts: Episodes are drawn from these. None draws a new layout for each, as ``spec`` says.
        seed: The same seed and actions give the same episodes.
        threads: Number of threads. None takes one per core, but fewer for few sites.
        turns: Number of arrays of observations that take turns: the one that a step or ``reset`` returns holds for so
            many steps. Two take hardly more time than one, and less than a copy.

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
        scheme = named("reward", reward, PAPER_REWARDS)
        most = max((len(layout.obstructions) for layout in layouts or ()), default=0)
        drawing = drawing_of(self.spec, room_for=most)
        pool = pool_of_layouts(self.spec, drawing, layouts or ())
        self._batch = BatchRules(OBSERVATIONS[observation].code, rules_of(self.spec), scheme, drawing, pool)
        self._sites = BatchSites(
            empty_sites(self.spec, drawing, sites, with_field=scheme.weights.needs_distance),
            np.zeros((sites, 1), np.uint64),
            np.zeros((sites, STATE_SIZE), np.int64),
        )
        size = int(np.prod(self.observation_space.shape))
        terminated, truncated, bumped, assembled, late = np.zeros((5, sites), np.bool_)
        step = PaperStep(
            np.zeros((sites, size), np.float32),
            np.zeros(sites, np.float32),
            terminated,
            truncated,
            bumped,
            assembled,
            np.zeros((sites, size), np.float32),
            np.zeros((sites, STATE_SIZE), np.int64),
            late,
        )
        drawings = np.zeros(sites, np.int64)
        outs = [
            BatchOut(
                step._replace(observations=np.zeros_like(step.observations)),
                np.zeros((sites, STATE_SIZE), np.int64),
                np.zeros(sites, np.int64),
                drawings,
            )
            for _ in range(turns)
        ]
        self._turns = [(out, self._step_of(out)) for out in outs]
        self._take_turn()
        threads = processors() if threads is None else threads
        self.threads = max(1, min(threads, -(-sites // _ROWS_PER_THREAD)))
        self._executor = ThreadPoolExecutor(self.threads - 1) if self.threads > 1 else None
        self.seed(seed)

    @property
    def states(self) -> NDArray[np.int64]:
        """(N, 7) int64, columns as the fields of ``PaperState``."""
        return self._sites.states

    @property
    def observations(self) -> NDArray[np.float32]:
        """(N, *shape) float32, the environment's own array; it holds until the next step."""
        return self._step.observations

    @property
    def turns(self) -> int:
        """Number of arrays of observations that take turns."""
        return len(self._turns)

    def seed(self, seed: int) -> None:
        """Set the states of the random generators that draw layouts."""
        self._sites.generators[:, 0] = random_words(seed, self.sites)

    def keep_distance_field(self) -> None:
        """Compute the distance field even if the reward does not need it, from the next ``reset`` on."""
        arrays = empty_sites(self.spec, self._batch.drawing, self.sites, with_field=True)
        self._sites = self._sites._replace(arrays=arrays)

    def reset(self) -> NDArray[np.float32]:
        """Begin N new episodes and return their (N, *shape) float32 observations.

        Raises:
            PlanningError: The yard has no room, or a component has no path to its target.
        """
        self._take_turn()
        if self._shares(lambda first, last: int(settle_rows(self._batch, self._sites, self._out, first, last, True))):
            raise no_layout(self.spec)
        return self._step.observations

    def place(self, site: int, layout: PaperLayout) -> None:
        """Begin an episode of a given layout; its observation is row ``site`` of the environment's own array.

        Raises:
            ValueError: The layout does not fit the site, or has more obstructions than there is room for.
        """
        one = self._site(site)
        write_layout(self.spec, layout, one)
        state = stand_up(self._batch.rules, one)
        store_row(self.states, site, state)
        self._out.drawings[site] += 1
        show(self._batch.code, self._batch.rules, one, self.states, self._out, site)

    def step(self, actions: ArrayLike, *, copy_to: NDArray[np.float32] | None = None) -> PaperStep:
        """Take one action per site.

        Args:
            actions: (N,) integers 0 .. 5.
            copy_to: (N, *shape) float32 into which the threads also copy the observations.

        Raises:
            ActionError: The actions are not N integers of that range.
            PlanningError: No layout was found for a new episode.
        """
        chosen = checked_actions(actions, self.sites)

        self._take_turn()

        def share(first: int, last: int) -> int:
            failures = int(step_rows(self._batch, self._sites, self._out, first, last, chosen))
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
        """Return (X, Y, Z) int16: what fills each cell of one site, without the component in transit."""
        return self._site(site).cells

    def picture(self, site: int) -> SitePicture:
        """Return the picture of one site."""
        fresh = bool(self._step.assembled[site] and self.states[site, 6] > 0)
        return picture_of_site(self.spec, self._site(site), self.state(site), just_assembled=fresh)

    def greedy_actions(self) -> NDArray[np.int64]:
        """Return the first action of each site that leads nearer to the target by the exact distance, (N,) int64.

        Raises:
            ValueError: The batch has no distance field.
        """
        if self._sites.arrays.field.size == 0:
            raise ValueError("this batch is without the distance field; call keep_distance_field() before reset()")
        return greedy_rows(self._sites.arrays, self.states)

    def close(self) -> None:
        """End the threads."""
        if self._executor is not None:
            self._executor.shutdown()
            self._executor = None

    def _take_turn(self) -> None:
        """Choose the array of observations whose turn was longest ago as the one to write."""
        self._turns = [*self._turns[1:], self._turns[0]]
        self._out, self._step = self._turns[-1]

    def _step_of(self, out: BatchOut) -> PaperStep:
        """Return the arrays that are written, shaped as they are handed out."""
        shape = (self.sites, *self.observation_space.shape)
        return out.step._replace(
            observations=out.step.observations.reshape(shape),
            final_observations=out.step.final_observations.reshape(shape),
        )

    def _site(self, site: int) -> SiteState:
        return SiteState(*(array[site] for array in self._sites.arrays))

    def _shares(self, work: Callable[[int, int], int]) -> int:
        """Run ``work`` on each thread's share of the rows, and return the sum of the results."""
        bounds = [self.sites * t // self.threads for t in range(self.threads + 1)]
        pairs = list(pairwise(bounds))
        others = [self._executor.submit(work, *pair) for pair in pairs[1:]] if self._executor else []
        return work(*pairs[0]) + sum(other.result() for other in others)
