"""Replay memory on the learner's device, with one byte per entry."""

from __future__ import annotations

from typing import Any, NamedTuple

import torch
from gymnasium import spaces
from stable_baselines3.common.buffers import BaseBuffer

from bimvox.env.actions import ACTION_COUNT
from bimvox.env.observation import VIEW_SIZE

LEVELS = 127.0
"""Views are in [-1, 1]; they are stored in steps of 1 / 127."""


class Transitions(NamedTuple):
    """A batch of transitions.

    Attributes:
        views: (N, VIEW_SIZE) float32.
        actions: (N, 1) int64, the site's.
        rewards: (N, 1) float32.
        ended: (N, 1) float32, 1 if the target was reached.
        following: (N, VIEW_SIZE) float32.
        teacher: (N, ACTION_COUNT) float32 values of the site's actions by the distance field; empty without teacher.
    """

    views: torch.Tensor
    actions: torch.Tensor
    rewards: torch.Tensor
    ended: torch.Tensor
    following: torch.Tensor
    teacher: torch.Tensor


def packed(views: torch.Tensor) -> torch.Tensor:
    """Return float32 views as int8."""
    return (views * LEVELS).round_().to(torch.int8)


def unpacked(views: torch.Tensor) -> torch.Tensor:
    """Return int8 views as float32."""
    return views.to(torch.float32).div_(LEVELS)


class ViewReplay(BaseBuffer):
    """A ring buffer of transitions as tensors; gathering batches from stable-baselines3's arrays is slower.

    Args:
        buffer_size: Transitions remembered, rounded down to whole steps of all lifts.
        observation_space: Of the lifts.
        action_space: Of the lifts.
        device: Of the tensors.
        n_envs: Number of lifts.
        teacher: Whether the values of the distance field are stored too.
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
        teacher: bool = False,
        seed: int = 0,
        **kwargs: Any,
    ) -> None:
        super().__init__(max(1, buffer_size // n_envs) * n_envs, observation_space, action_space, device, n_envs)
        size = self.buffer_size
        self._views = torch.zeros((size, VIEW_SIZE), dtype=torch.int8, device=device)
        self._following = torch.zeros((size, VIEW_SIZE), dtype=torch.int8, device=device)
        self._actions = torch.zeros((size, 1), dtype=torch.int64, device=device)
        self._rewards = torch.zeros((size, 1), device=device)
        self._ended = torch.zeros((size, 1), device=device)
        self._teacher = torch.zeros((size if teacher else 0, ACTION_COUNT), device=device)
        self._random = torch.Generator(device=device).manual_seed(seed)

    def add(
        self,
        views: torch.Tensor,
        following: torch.Tensor,
        actions: torch.Tensor,
        rewards: torch.Tensor,
        ended: torch.Tensor,
        teacher: torch.Tensor,
    ) -> None:
        """Store one step of all lifts; views as :func:`packed` gives them."""
        rows = slice(self.pos, self.pos + self.n_envs)
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
        """Return transitions drawn uniformly."""
        return self._get_samples(torch.randint(self.size(), (batch_size,), generator=self._random, device=self.device))

    def _get_samples(self, batch_inds: Any, env: Any = None) -> Transitions:  # type: ignore[override]
        """Return the transitions of some rows."""
        rows = batch_inds
        return Transitions(
            unpacked(self._views[rows]),
            self._actions[rows],
            self._rewards[rows],
            self._ended[rows],
            unpacked(self._following[rows]),
            self._teacher[rows] if self._teacher.shape[0] else self._teacher,
        )
