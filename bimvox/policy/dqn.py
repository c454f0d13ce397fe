"""Stable-baselines3's DQN, extended for many lifts at once.

1. The planner's loop guard (:mod:`bimvox.env.guard`) chooses the moves, so training sees what planning meets. A lift
   that explores gives the guard random values. Each lift explores independently; SB3 draws once for all of them.
2. An action that the view shows as blocked is never chosen, neither in behaviour nor in the target.
3. Optional: double Q-learning, a second loss by the teacher, a running average of the weights.
4. The share of random actions falls over a fixed number of steps, not over a share of the budget.
5. The replay memory is on the learner's device (:mod:`bimvox.policy.replay`).
"""

from __future__ import annotations

import time
from typing import Any, cast

import numpy as np
import torch
from numpy.typing import NDArray
from stable_baselines3 import DQN
from stable_baselines3.common.logger import Logger
from torch.nn import functional

from bimvox.env.actions import ACTION_COUNT
from bimvox.policy.config import DqnConfig
from bimvox.policy.device import device_named
from bimvox.policy.framed_policy import FramedPolicy, FramedQNetwork, blocked_in_frame, frame_actions
from bimvox.policy.network import QNetwork
from bimvox.policy.replay import ViewReplay, packed, unpacked
from bimvox.policy.vec_env import LiftVecEnv

_NEVER = -1e9


class LiftDqn(DQN):
    """DQN over a batch of lifts.

    Args:
        env: The lifts.
        config: The choices.
        seed: The same seed, problems and device give the same weights.
        device: Device of the network and the replay memory, as torch names it.
        seconds: Time limit over which the learning rate also falls; the weights then depend on the machine. By default
            it falls over the budget alone.
        half: Whether to multiply in bfloat16; the weights stay in float32. Three times as fast on a processor with
            matrix units for it.

    Raises:
        PolicyError: The device is not available.
    """

    q_net: FramedQNetwork
    q_net_target: FramedQNetwork

    def __init__(
        self,
        env: LiftVecEnv,
        config: DqnConfig,
        seed: int,
        *,
        device: str = "cpu",
        seconds: float | None = None,
        half: bool = False,
    ) -> None:
        self.config = config
        super().__init__(
            FramedPolicy,
            env,
            **config.sb3_arguments(),
            policy_kwargs={"net_arch": list(config.hidden)},
            replay_buffer_class=ViewReplay,  # type: ignore[arg-type]
            replay_buffer_kwargs={"teacher": config.teacher > 0.0, "seed": seed},
            device=device_named(device),
            seed=seed,
        )
        # Without a logger, every run of stable-baselines3 leaves an empty folder among the temporary files.
        self.set_logger(Logger(folder=None, output_formats=[]))
        self._random = np.random.default_rng(seed)
        self._updates_to_copy = config.target_update
        self._views: torch.Tensor | None = None
        self._seconds = seconds
        self._half = half
        self._began = time.monotonic()
        lifts = max(1, env.num_envs - 1)
        self._spread = 1.0 + config.exploration_spread * np.arange(env.num_envs) / lifts
        self._average = [parameter.detach().clone() for parameter in self.q_net.parameters()]

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
        """Return for each observation the action with the highest value among those not shown as blocked."""
        with torch.no_grad():
            values = self._values(torch.as_tensor(observation, device=self.device))
        return values.argmax(dim=1).cpu().numpy(), state

    def _values(self, views: torch.Tensor) -> torch.Tensor:
        """Return (N, 6) values of the site's actions, very low if blocked."""
        values = self.q_net.in_frame(views).masked_fill(blocked_in_frame(views), _NEVER)
        return values.gather(1, frame_actions(views))

    def _sample_action(
        self, learning_starts: int, action_noise: Any = None, n_envs: int = 1
    ) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Return the next actions: the guard's moves, some of them from random values."""
        if self._views is None:
            self._views = packed(torch.as_tensor(self._last_obs, device=self.device))
        with torch.no_grad(), self._precision():
            values = self._values(unpacked(self._views)).float().cpu().numpy()
        explore = self._random.random(len(values)) < self.exploration_rate**self._spread
        values[explore] = self._random.random((int(explore.sum()), ACTION_COUNT))
        actions = self.env.batch.guarded_actions(values)  # type: ignore[union-attr]
        return actions, actions

    def _store_transition(
        self, replay_buffer: Any, buffer_action: Any, new_obs: Any, reward: Any, dones: Any, infos: Any
    ) -> None:
        """Store the last step; at the end of an episode, with its last view."""
        step = self.env.last_step  # type: ignore[union-attr]
        upcoming = packed(torch.as_tensor(step.observations, device=self.device))
        following = upcoming
        ended = np.flatnonzero(step.ended)
        if ended.size:
            following = upcoming.clone()
            last = torch.as_tensor(step.final_observations[ended], device=self.device)
            following[torch.as_tensor(ended, device=self.device)] = packed(last)
        replay_buffer.add(
            self._views,
            following,
            *(torch.as_tensor(a, device=self.device) for a in (buffer_action, reward, step.arrived, step.teacher)),
        )
        self._views = upcoming
        self._last_obs = step.observations

    def train(self, gradient_steps: int, batch_size: int = 100) -> None:
        """Take gradient steps on the Huber loss of the temporal difference."""
        self.policy.set_training_mode(True)
        self._set_rate()
        optimizer = self.policy.optimizer
        for _ in range(gradient_steps):
            with self._precision():
                loss = self._loss(batch_size)
            optimizer.zero_grad()
            loss.backward()  # type: ignore[no-untyped-call]
            torch.nn.utils.clip_grad_norm_(self.policy.parameters(), self.max_grad_norm)
            optimizer.step()
            self._n_updates += 1
            self._updates_to_copy -= 1
            if self._updates_to_copy == 0:
                self._updates_to_copy = self.config.target_update
                self.q_net_target.load_state_dict(self.q_net.state_dict())
            if self.config.averaging:
                # At first the average follows closely.
                kept = min(self.config.averaging, self._n_updates / (self._n_updates + 10.0))
                torch._foreach_lerp_(self._average, [p.detach() for p in self.q_net.parameters()], 1.0 - kept)

    def _loss(self, batch_size: int) -> torch.Tensor:
        batch = cast(ViewReplay, self.replay_buffer).sample(batch_size)
        with torch.no_grad():
            blocked = blocked_in_frame(batch.following)
            following = self.q_net_target.in_frame(batch.following).masked_fill(blocked, _NEVER)
            if self.config.double_q:
                online = self.q_net.in_frame(batch.following).masked_fill(blocked, _NEVER)
                best = following.gather(1, online.argmax(dim=1, keepdim=True))
            else:
                best = following.max(dim=1, keepdim=True).values
            best = best.masked_fill(blocked.all(dim=1, keepdim=True), 0.0)
            wanted = batch.rewards + (1 - batch.ended) * self.gamma * best.float()
        values: torch.Tensor = self.q_net(batch.views).float()
        loss = functional.smooth_l1_loss(values.gather(1, batch.actions), wanted, beta=0.1)
        if self.config.teacher:
            free = ~blocked_in_frame(batch.views).gather(1, frame_actions(batch.views))
            told = functional.smooth_l1_loss(
                _over_mean(values, free), _over_mean(batch.teacher, free), beta=0.1, reduction="none"
            )
            loss = loss + self.config.teacher * (told * free).sum() / free.sum()
        return loss

    def _precision(self) -> torch.autocast:
        return torch.autocast(self.device.type, dtype=torch.bfloat16, enabled=self._half)

    def _set_rate(self) -> None:
        """Set the learning rate by the used share of the budget or the time."""
        done = self.num_timesteps / max(1, self._total_timesteps)
        if self._seconds is not None:
            done = max(done, (time.monotonic() - self._began) / self._seconds)
        cooled = min(1.0, max(0.0, (done - 1.0 + self.config.cooling) / max(1e-9, self.config.cooling)))
        first, last = self.config.learning_rate, self.config.learning_rate_last
        for group in self.policy.optimizer.param_groups:
            group["lr"] = first + cooled * (last - first)

    def tested_parameters(self) -> list[torch.Tensor]:
        """Return the online network's parameters, or their running average if there is one."""
        if self.config.averaging and self._n_updates:
            return self._average
        return [parameter.detach() for parameter in self.q_net.parameters()]


def _over_mean(values: torch.Tensor, free: torch.Tensor) -> torch.Tensor:
    """Return (N, 6) values less the mean over each row's free actions.

    The teacher tells which move is better and by how much, not how much a whole path is worth: the target network
    learns that only over many copies, and until then the move taken would look worse than all others.
    """
    mean = (values * free).sum(dim=1, keepdim=True) / free.sum(dim=1, keepdim=True).clamp(min=1)
    return values - mean


def network_of(dqn: LiftDqn) -> QNetwork:
    """Return the weights of the online network, or their average if configured, as plain arrays."""
    arrays = [parameter.cpu().numpy() for parameter in dqn.tested_parameters()]
    return QNetwork(
        tuple(np.ascontiguousarray(weight.T).copy() for weight in arrays[0::2]),
        tuple(bias.copy() for bias in arrays[1::2]),
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
    if isinstance(dqn, LiftDqn):
        for average, parameter in zip(dqn._average, dqn.q_net.parameters(), strict=True):
            average.copy_(parameter.detach())
