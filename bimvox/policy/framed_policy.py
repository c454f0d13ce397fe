"""The torch side of the Q-network: what stable-baselines3's DQN trains, and ``bimvox.policy.network`` runs."""

from __future__ import annotations

from typing import Any

import torch
from gymnasium import spaces
from stable_baselines3.common.torch_layers import BaseFeaturesExtractor
from stable_baselines3.dqn.policies import DQNPolicy, QNetwork

from bimvox.env.frame import FRAME_ACTIONS, FRAME_COUNT
from bimvox.env.observation import INPUT_SIZE, NEIGHBOURS, VIEW_SIZE


class ViewExtractor(BaseFeaturesExtractor):
    """The view without its frame."""

    def __init__(self, observation_space: spaces.Space[Any]) -> None:
        super().__init__(observation_space, INPUT_SIZE)

    def forward(self, observations: torch.Tensor) -> torch.Tensor:
        """Return (N, INPUT_SIZE) of (N, VIEW_SIZE)."""
        return observations[:, :INPUT_SIZE]


class FramedQNetwork(QNetwork):
    """A multilayer perceptron in the view's frame, its values converted to the site's actions."""

    def forward(self, obs: Any) -> torch.Tensor:
        """Return (N, 6) values of the site's actions."""
        values: torch.Tensor = self.q_net(obs[:, :INPUT_SIZE])
        return values.gather(1, _frame_actions(obs))

    def blocked(self, obs: torch.Tensor) -> torch.Tensor:
        """Return (N, 6) bool: whether the view shows each of the site's actions as blocked."""
        return (obs[:, list(NEIGHBOURS)] > 0.5).gather(1, _frame_actions(obs))


class FramedPolicy(DQNPolicy):
    """DQN's policy over views."""

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        super().__init__(*args, **{**kwargs, "features_extractor_class": ViewExtractor})

    def make_q_net(self) -> QNetwork:
        """Return a Q-network."""
        return FramedQNetwork(**self._update_features_extractor(self.net_args, features_extractor=None)).to(self.device)


def _frame_actions(observations: torch.Tensor) -> torch.Tensor:
    """Return (N, 6) int64: which of the frame's actions each action of the site is."""
    table = torch.as_tensor(FRAME_ACTIONS.copy(), device=observations.device)
    rows = (observations[:, VIEW_SIZE - 1] * (FRAME_COUNT - 1)).round().long().clamp(0, FRAME_COUNT - 1)
    return table[rows]
