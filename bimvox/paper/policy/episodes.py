"""Running a policy: many recorded episodes in lock-step."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bimvox.env.actions import ACTION_COUNT
from bimvox.paper.env.batched import BatchedPaperSite
from bimvox.paper.env.layout import PaperLayout
from bimvox.paper.env.spec import PaperSpec
from bimvox.planning.rollout import Values
from bimvox.site.component import IntVec


@dataclass(frozen=True, slots=True, eq=False)
class Episode:
    """One episode.

    Attributes:
        succeeded: Whether everything was assembled.
        reward: Sum over its steps.
        actions: (T,) int64, blocked ones included.
        places: (T + 1, 4) int64 component in transit and its reference cell: at the start, then after each action.
        bumped: (T,) bool, the move was blocked.
    """

    succeeded: bool
    reward: float
    actions: NDArray[np.int64]
    places: NDArray[np.int64]
    bumped: NDArray[np.bool_]

    @property
    def steps(self) -> int:
        """T."""
        return len(self.actions)

    @property
    def moves(self) -> NDArray[np.int64]:
        """(M,) int64, the actions that were not blocked: what a crane would execute."""
        return self.actions[~self.bumped]

    @property
    def path_cells(self) -> tuple[IntVec, ...]:
        """Reference cells of the last component, in order, without the repeats of blocked moves."""
        cells: list[IntVec] = []
        count = int(self.places[:, 0].max()) + (0 if self.succeeded else 1)
        last = max(0, count - 1)
        for row, (component, x, y, z) in enumerate(self.places.tolist()):
            end = self.succeeded and row == len(self.places) - 1
            if (component == last or end) and (not cells or cells[-1] != (x, y, z)):
                cells.append((x, y, z))
        return tuple(cells)


def run_episodes(
    values: Values | None,
    spec: PaperSpec,
    layouts: Sequence[PaperLayout],
    *,
    observation: str,
    reward: str,
    exploration: float,
    seed: int,
) -> tuple[Episode, ...]:
    """Run one episode of every layout, and judge it by a reward.

    Args:
        values: The policy, from observations to action values. None acts at random.
        spec: The site.
        layouts: One per episode.
        observation: Name of the observation that the policy takes.
        reward: Name of the reward.
        exploration: Share of random actions; every episode draws its own.
        seed: Of the random actions.
    """
    count = len(layouts)
    batch = BatchedPaperSite(spec, count, observation=observation, reward=reward, layouts=layouts, threads=1)
    observations = batch.reset()
    for n, layout in enumerate(layouts):
        batch.place(n, layout)
    random = np.random.default_rng(seed)
    running = np.ones(count, np.bool_)
    succeeded = np.zeros(count, np.bool_)
    places: list[list[NDArray[np.int64]]] = [[state[:4].copy()] for state in batch.states]
    actions: list[list[int]] = [[] for _ in range(count)]
    bumped: list[list[bool]] = [[] for _ in range(count)]
    rewards = np.zeros(count, np.float64)
    while running.any():
        rows = np.flatnonzero(running)
        chosen = random.integers(ACTION_COUNT, size=count)
        if values is not None:
            greedy = random.random(count) >= exploration
            asked = rows[greedy[rows]]
            if asked.size:
                chosen[asked] = values(observations[asked]).argmax(axis=1)
        step = batch.step(chosen)
        observations = step.observations
        for n in rows.tolist():
            actions[n].append(int(chosen[n]))
            bumped[n].append(bool(step.bumped[n]))
            places[n].append(step.final_states[n, :4].copy())
        rewards[rows] += step.rewards[rows]
        succeeded |= running & step.terminated
        running &= ~step.ended
    return tuple(
        Episode(
            bool(succeeded[n]),
            float(rewards[n]),
            np.array(actions[n], np.int64),
            np.array(places[n], np.int64),
            np.array(bumped[n], np.bool_),
        )
        for n in range(count)
    )


def replay(spec: PaperSpec, layout: PaperLayout, actions: NDArray[np.int64], *, reward: str = "paper") -> Episode:
    """Take given actions, (T,) integers, on a layout until the first collision or the end of the episode."""
    batch = BatchedPaperSite(spec, 1, observation="window", reward=reward, layouts=[layout], threads=1)
    batch.reset()
    places = [batch.states[0, :4].copy()]
    bumped: list[bool] = []
    total, succeeded = 0.0, False
    for action in actions:
        step = batch.step([action])
        places.append(step.final_states[0, :4].copy())
        bumped.append(bool(step.bumped[0]))
        total += float(step.rewards[0])
        succeeded = bool(step.terminated[0])
        if bumped[-1] or step.ended[0]:
            break
    taken = len(bumped)
    return Episode(succeeded, total, np.array(actions[:taken], np.int64), np.array(places), np.array(bumped, np.bool_))


def success_rate(episodes: Sequence[Episode]) -> float:
    """Return the share that succeeded."""
    return float(np.mean([episode.succeeded for episode in episodes]))


def best_of(episodes: Sequence[Episode]) -> Episode:
    """Return the episode with the highest reward, the first if several have it."""
    return max(episodes, key=lambda episode: episode.reward)
