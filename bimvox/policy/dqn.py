"""Stable-baselines3's DQN, with three changes that many lifts at once ask for.

1. Each lift explores on its own: SB3 draws once per step and then moves all environments at random, or none.
2. Double Q-learning, where the configuration asks for it.
3. The share of random actions falls over a fixed number of steps, not over a share of the budget.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from stable_baselines3 import DQN
from stable_baselines3.common.logger import Logger
from torch.nn import functional

from bimvox.env.actions import ACTION_COUNT
from bimvox.policy.config import DqnConfig
from bimvox.policy.network import QNetwork
from bimvox.policy.vec_env import LiftVecEnv


class LiftDqn(DQN):
    """DQN over a batch of lifts.

    Args:
        env: The lifts.
        config: The choices.
        seed: Same seed, same problems: same weights.
    """

    def __init__(self, env: LiftVecEnv, config: DqnConfig, seed: int) -> None:
        self.config = config
        super().__init__(
            "MlpPolicy",
            env,
            learning_rate=config.learning_rate,
            buffer_size=config.buffer_size,
            learning_starts=config.learning_starts,
            batch_size=config.batch_size,
            gamma=config.discount,
            train_freq=1,
            gradient_steps=config.gradient_steps,
            max_grad_norm=config.max_gradient_norm,
            policy_kwargs={"net_arch": list(config.hidden)},
            device="cpu",
            seed=seed,
        )
        # Without a logger of its own, every run of stable-baselines3 leaves an empty folder in the temporary files.
        self.set_logger(Logger(folder=None, output_formats=[]))
        self._random = np.random.default_rng(seed)
        self._updates_to_copy = config.target_update

    def _on_step(self) -> None:
        """Lower the share of random actions; the target network is copied by gradient steps, in ``train``."""
        done = min(1.0, self.num_timesteps / max(1, self.config.exploration_steps))
        first, last = self.config.exploration_first, self.config.exploration_last
        self.exploration_rate = first + done * (last - first)

    def predict(
        self,
        observation: Any,
        state: Any = None,
        episode_start: Any = None,
        deterministic: bool = False,
    ) -> tuple[NDArray[np.int64], Any]:
        """Return greedy actions, each replaced by a random one with the exploration rate unless deterministic."""
        greedy, state = self.policy.predict(observation, state, episode_start, True)
        if deterministic:
            return greedy, state
        explore = self._random.random(greedy.shape) < self.exploration_rate
        return np.where(explore, self._random.integers(ACTION_COUNT, size=greedy.shape), greedy), state

    def train(self, gradient_steps: int, batch_size: int = 100) -> None:
        """Take gradient steps on the Huber loss of the temporal difference."""
        self.policy.set_training_mode(True)
        optimizer = self.policy.optimizer
        for _ in range(gradient_steps):
            batch = self.replay_buffer.sample(batch_size)  # type: ignore[union-attr]
            with torch.no_grad():
                following = self.q_net_target(batch.next_observations)
                if self.config.double_q:
                    chosen = self.q_net(batch.next_observations).argmax(dim=1, keepdim=True)
                    best = following.gather(1, chosen)
                else:
                    best = following.max(dim=1, keepdim=True).values
                wanted = batch.rewards + (1 - batch.dones) * self.gamma * best
            values = self.q_net(batch.observations).gather(1, batch.actions.long())
            loss = functional.smooth_l1_loss(values, wanted)
            optimizer.zero_grad()
            loss.backward()  # type: ignore[no-untyped-call]
            torch.nn.utils.clip_grad_norm_(self.policy.parameters(), self.max_grad_norm)
            optimizer.step()
            self._updates_to_copy -= 1
            if self._updates_to_copy == 0:
                self._updates_to_copy = self.config.target_update
                self.q_net_target.load_state_dict(self.q_net.state_dict())
        self._n_updates += gradient_steps


def network_of(dqn: DQN) -> QNetwork:
    """Return the weights of the online network as plain arrays."""
    layers = [layer for layer in dqn.q_net.q_net if isinstance(layer, torch.nn.Linear)]
    return QNetwork(
        tuple(np.ascontiguousarray(layer.weight.detach().numpy().T).copy() for layer in layers),
        tuple(layer.bias.detach().numpy().copy() for layer in layers),
    )


def load_network(dqn: DQN, network: QNetwork) -> None:
    """Overwrite the weights of the online and the target network.

    Raises:
        ValueError: The layers have other sizes.
    """
    for q_net in (dqn.q_net, dqn.q_net_target):
        layers = [layer for layer in q_net.q_net if isinstance(layer, torch.nn.Linear)]
        sizes = (layers[0].in_features, *(layer.out_features for layer in layers))
        if sizes != network.layer_sizes:
            raise ValueError(f"a network of {network.layer_sizes} does not fit one of {sizes}")
        with torch.no_grad():
            for layer, weight, bias in zip(layers, network.weights, network.biases, strict=True):
                layer.weight.copy_(torch.from_numpy(weight.T.copy()))
                layer.bias.copy_(torch.from_numpy(bias.copy()))
