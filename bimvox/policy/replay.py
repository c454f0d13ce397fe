"""Replay memory on the learner's device, with one byte per entry, drawn evenly or by error."""

from __future__ import annotations

from typing import Any, NamedTuple

import torch
from gymnasium import spaces
from stable_baselines3.common.buffers import BaseBuffer

from bimvox.env.actions import ACTION_COUNT
from bimvox.policy.config import DqnChoices

_LEAST_ERROR = 0.01
"""Added to every error, so that a transition without error is still drawn sometimes."""


class Transitions(NamedTuple):
    """A batch of transitions.

    Attributes:
        views: (N, size) float32.
        actions: (N, 1) int64, the site's.
        rewards: (N, 1) float32.
        ended: (N, 1) float32, 1 if nothing can follow.
        following: (N, size) float32.
        teacher: (N, ACTION_COUNT) float32 values of the site's actions by the distance field; empty without teacher.
        rows: (N,) int64 where they are in the memory.
    """

    views: torch.Tensor
    actions: torch.Tensor
    rewards: torch.Tensor
    ended: torch.Tensor
    following: torch.Tensor
    teacher: torch.Tensor
    rows: torch.Tensor


class ViewReplay(BaseBuffer):
    """A ring buffer of transitions as tensors; gathering batches from stable-baselines3's arrays is slower.

    Args:
        buffer_size: Transitions remembered, rounded down to whole steps of all environments.
        observation_space: Of one environment; vectors.
        action_space: Of one environment.
        device: Of the tensors.
        n_envs: Number of environments.
        config: Whether there is a teacher, and the exponent of prioritized replay (Schaul et al. 2016): a transition is
            drawn in proportion to its last error to this power; 0 draws evenly.
        levels: Views are stored in steps of 1 / levels, up to 127 of them on either side of 0.
        seed: Of the draws.
        kwargs: Further arguments of stable-baselines3, ignored.
    """

    def __init__(
        self,
        buffer_size: int,
        observation_space: spaces.Space[Any],
        action_space: spaces.Space[Any],
        device: torch.device | str = "cpu",
        n_envs: int = 1,
        *,
        config: DqnChoices,
        levels: int = 127,
        seed: int = 0,
        **kwargs: Any,
    ) -> None:
        super().__init__(max(1, buffer_size // n_envs) * n_envs, observation_space, action_space, device, n_envs)
        size, (width,) = self.buffer_size, observation_space.shape or (0,)
        self._levels = float(levels)
        self._priority = config.priority
        self._views = torch.zeros((size, width), dtype=torch.int8, device=device)
        self._following = torch.zeros((size, width), dtype=torch.int8, device=device)
        self._actions = torch.zeros((size, 1), dtype=torch.int64, device=device)
        self._rewards = torch.zeros((size, 1), device=device)
        self._ended = torch.zeros((size, 1), device=device)
        self._teacher = torch.zeros((size if config.teacher else 0, ACTION_COUNT), device=device)
        self._shares = torch.zeros(size if self._priority else 0, dtype=torch.float64, device=device)
        self._random = torch.Generator(device=device).manual_seed(seed)

    def packed(self, views: torch.Tensor) -> torch.Tensor:
        """Return float32 views as int8."""
        return (views * self._levels).round_().to(torch.int8)

    def unpacked(self, views: torch.Tensor) -> torch.Tensor:
        """Return int8 views as float32."""
        return views.to(torch.float32).div_(self._levels)

    def add(
        self,
        views: torch.Tensor,
        following: torch.Tensor,
        actions: torch.Tensor,
        rewards: torch.Tensor,
        ended: torch.Tensor,
        teacher: torch.Tensor,
    ) -> None:
        """Store one step of all environments; views as :meth:`packed` gives them."""
        rows = slice(self.pos, self.pos + self.n_envs)
        if self._priority:  # their errors are unknown: they get the greatest share of all
            self._shares[rows] = self._shares.max() if self.size() else 1.0
        self._views[rows] = views
        self._following[rows] = following
        self._actions[rows, 0] = actions
        self._rewards[rows, 0] = rewards
        self._ended[rows, 0] = ended
        if self._teacher.shape[0]:
            self._teacher[rows] = teacher
        self.pos += self.n_envs
        if self.pos == self.buffer_size:
            self.full, self.pos = True, 0

    def size(self) -> int:
        """Return the number of stored transitions."""
        return self.buffer_size if self.full else self.pos

    def sample(self, batch_size: int, env: Any = None) -> Transitions:
        """Return transitions drawn with replacement, evenly or by their shares."""
        if not self._priority:
            drawn = torch.randint(self.size(), (batch_size,), generator=self._random, device=self.device)
            return self._get_samples(drawn)
        sums = self._shares[: self.size()].cumsum(0)
        at = torch.rand(batch_size, dtype=torch.float64, generator=self._random, device=self.device) * sums[-1]
        return self._get_samples(torch.searchsorted(sums, at, right=True).clamp_(max=self.size() - 1))

    def importance(self, rows: torch.Tensor, beta: float) -> torch.Tensor:
        """Return a (N, 1) weight per row that corrects for uneven drawing: (N p)^-beta, the largest of them 1."""
        shares = self._shares[rows]
        return (shares / shares.min()).pow(-beta).float()[:, None]

    def note_errors(self, rows: torch.Tensor, errors: torch.Tensor) -> None:
        """Set the shares of some rows from their (N, 1) errors."""
        if self._priority:
            self._shares[rows] = (errors[:, 0].double() + _LEAST_ERROR) ** self._priority

    def _get_samples(self, batch_inds: Any, env: Any = None) -> Transitions:  # type: ignore[override]
        """Return the transitions of some rows."""
        rows = batch_inds
        return Transitions(
            self.unpacked(self._views[rows]),
            self._actions[rows],
            self._rewards[rows],
            self._ended[rows],
            self.unpacked(self._following[rows]),
            self._teacher[rows] if self._teacher.shape[0] else self._teacher,
            rows,
        )
