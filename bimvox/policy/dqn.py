"""Stable-baselines3's DQN, extended for many environments at once: crane lifts, and the paper's sites.

1. The batch chooses the moves from the values: for lifts the planner's loop guard (:mod:`bimvox.env.guard`), so that
   training sees what planning meets. What explores gives it random values. Each environment explores independently;
   SB3 draws once for all of them. No phase is purely random.
2. An action that the view shows as blocked is never chosen, neither in behaviour nor in the target.
3. Optional: double Q-learning, a second loss by the teacher, a running average of the weights, prioritized replay, and
   images of the transitions.
4. The replay memory is on the learner's device (:mod:`bimvox.policy.replay`).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any, NamedTuple, cast

import numpy as np
import torch
from gymnasium import spaces
from numpy.typing import NDArray
from stable_baselines3 import DQN
from stable_baselines3.common.logger import Logger
from stable_baselines3.common.torch_layers import BaseFeaturesExtractor
from stable_baselines3.dqn.policies import DQNPolicy
from stable_baselines3.dqn.policies import QNetwork as TorchQNetwork
from torch.nn import functional

from bimvox.env.actions import ACTION_COUNT
from bimvox.env.batched import BatchedLiftEnv
from bimvox.env.observation import FRAME_ACTIONS, FRAME_COUNT, INPUT_SIZE, NEIGHBOURS, VIEW_SIZE
from bimvox.errors import PolicyError
from bimvox.policy.config import DqnChoices, DqnConfig
from bimvox.policy.network import QNetwork
from bimvox.policy.replay import Transitions, ViewReplay
from bimvox.policy.vec_env import BatchVecEnv


def device_named(name: str) -> torch.device:
    """Return a device after a computation on it.

    If the requested GPU is missing, stable-baselines3 silently uses the processor; for ``auto`` it takes any GPU. The
    weights depend on the device, so their record must name the device on which they were trained.

    Args:
        name: As torch names it: ``cpu``, ``cuda``, ``cuda:1``.

    Raises:
        PolicyError: Torch does not know the device, or this machine or build of torch does not have it.
    """
    try:
        device = torch.device(name)
        torch.zeros(1, device=device).item()
    except (RuntimeError, AssertionError) as error:  # a build of torch without CUDA answers with an AssertionError
        raise PolicyError(
            f"device {name!r} cannot be trained on: {str(error).splitlines()[0]}",
            differs={"device": name},
            hint="cpu is always available; cuda needs an NVIDIA GPU, its driver and a build of torch for it",
        ) from error
    return device


class _ViewExtractor(BaseFeaturesExtractor):
    """The view without its frame."""

    def __init__(self, observation_space: spaces.Space[Any]) -> None:
        super().__init__(observation_space, INPUT_SIZE)

    def forward(self, observations: torch.Tensor) -> torch.Tensor:
        """Return (N, INPUT_SIZE) of (N, VIEW_SIZE)."""
        return observations[:, :INPUT_SIZE]


class _ViewQNetwork(TorchQNetwork):
    """A multilayer perceptron over the whole view."""

    def blocked(self, obs: torch.Tensor) -> torch.Tensor:
        """Return (N, 6) bool: whether the view shows each of the site's actions as blocked."""
        return (obs[:, list(NEIGHBOURS)] > 0.5).gather(1, _frame_actions(obs))


class _FramedQNetwork(_ViewQNetwork):
    """A multilayer perceptron in the view's frame, its values converted to the site's actions."""

    def forward(self, obs: Any) -> torch.Tensor:
        """Return (N, 6) values of the site's actions."""
        values: torch.Tensor = self.q_net(obs[:, :INPUT_SIZE])
        return values.gather(1, _frame_actions(obs))


class _ViewPolicy(DQNPolicy):
    """DQN's policy over whole views, as a stock learner makes it."""

    def make_q_net(self) -> TorchQNetwork:
        """Return a Q-network."""
        return _ViewQNetwork(**self._update_features_extractor(self.net_args, features_extractor=None)).to(self.device)


class FramedPolicy(DQNPolicy):
    """DQN's policy over views without their frame."""

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        super().__init__(*args, **{**kwargs, "features_extractor_class": _ViewExtractor})

    def make_q_net(self) -> TorchQNetwork:
        """Return a Q-network."""
        return _FramedQNetwork(**self._update_features_extractor(self.net_args, features_extractor=None)).to(
            self.device
        )


def _frame_actions(observations: torch.Tensor) -> torch.Tensor:
    """Return (N, 6) int64: which of the frame's actions each action of the site is."""
    table = torch.as_tensor(FRAME_ACTIONS.copy(), device=observations.device)
    rows = (observations[:, VIEW_SIZE - 1] * (FRAME_COUNT - 1)).round().long().clamp(0, FRAME_COUNT - 1)
    return table[rows]


_NEVER = -1e9


class Trained(NamedTuple):
    """What a training makes of its views.

    Attributes:
        policy: Makes the networks.
        arguments: Of the policy.
        levels: Views are remembered in steps of 1 / levels.
        images: Changes the transitions of a gradient step, with a generator of its own.
    """

    policy: type[DQNPolicy]
    arguments: Mapping[str, Any] = MappingProxyType({})
    levels: int = 127
    images: Callable[[Transitions, torch.Generator], Transitions] | None = None


class BatchDqn(DQN):
    """DQN over a batch of environments.

    Args:
        env: The environments.
        config: The choices.
        seed: The same seed, environments and device give the same weights.
        trained: The networks, and what they learn from.
        device: Device of the networks and the replay memory, as torch names it.
        half: Whether to multiply in bfloat16; the weights stay in float32. Three times as fast on a processor with
            matrix units for it.

    Raises:
        PolicyError: The device is not available.
    """

    def __init__(
        self,
        env: BatchVecEnv,
        config: DqnChoices,
        seed: int,
        trained: Trained,
        *,
        device: str = "cpu",
        half: bool = False,
    ) -> None:
        self.config = config
        super().__init__(
            trained.policy,
            env,
            **config.sb3_arguments(),
            policy_kwargs={"net_arch": list(config.hidden), **trained.arguments},
            replay_buffer_class=ViewReplay,  # type: ignore[arg-type]
            replay_buffer_kwargs={"config": config, "levels": trained.levels, "seed": seed},
            device=device_named(device),
            seed=seed,
        )
        # Without a logger, every run of stable-baselines3 leaves an empty folder among the temporary files.
        self.set_logger(Logger(folder=None, output_formats=[]))
        self._random = np.random.default_rng(seed)
        self._updates_to_copy = config.target_update
        self._views: torch.Tensor | None = None
        self._images = trained.images
        self._drawn_images = torch.Generator(device=self.device).manual_seed(seed)
        self._half = half
        self._parameters = list(self.q_net.parameters())
        self._average = [parameter.detach().clone() for parameter in self._parameters]

    def _on_step(self) -> None:
        """Leave the rest to ``_sample_action`` and ``train``."""

    def predict(
        self,
        observation: Any,
        state: Any = None,
        episode_start: Any = None,
        deterministic: bool = False,
    ) -> tuple[NDArray[np.int64], Any]:
        """Return for each observation the action with the highest value among those not shown as blocked."""
        with torch.no_grad():
            values = _free_values(self.q_net, torch.as_tensor(observation, device=self.device))
        return values.argmax(dim=1).cpu().numpy(), state

    def _sample_action(
        self, learning_starts: int, action_noise: Any = None, n_envs: int = 1
    ) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Return the next actions: the batch's, some of them from random values."""
        memory = cast(ViewReplay, self.replay_buffer)
        if self._views is None:
            self._views = memory.packed(torch.as_tensor(self._last_obs, device=self.device))
        with torch.no_grad(), self._precision():
            values = _free_values(self.q_net, memory.unpacked(self._views)).float().cpu().numpy()
        # The first step follows the values alone, as every step of a trained network does.
        shares = self.config.random_shares(self.num_timesteps, self._total_timesteps, len(values))
        explore = self._random.random(len(values)) < shares * (self.num_timesteps > 0)
        values[explore] = self._random.random((int(explore.sum()), ACTION_COUNT))
        actions = cast(BatchVecEnv, self.env).batch.chosen_actions(values)
        return actions, actions

    def _store_transition(
        self, replay_buffer: Any, buffer_action: Any, new_obs: Any, reward: Any, dones: Any, infos: Any
    ) -> None:
        """Store the last step; at the end of an episode, with its last view."""
        step = cast(BatchVecEnv, self.env).last_step
        assert step is not None
        upcoming = replay_buffer.packed(torch.as_tensor(step.observations, device=self.device))
        following = upcoming
        ended = np.flatnonzero(step.ended)
        if ended.size:
            following = upcoming.clone()
            last = torch.as_tensor(step.final_observations[ended], device=self.device)
            following[torch.as_tensor(ended, device=self.device)] = replay_buffer.packed(last)
        over = step.terminated if self.config.bootstrap_at_limit else step.ended
        replay_buffer.add(
            self._views,
            following,
            *(torch.as_tensor(a, device=self.device) for a in (buffer_action, reward, over, step.teacher)),
        )
        self._views = upcoming
        self._last_obs = step.observations

    def train(self, gradient_steps: int, batch_size: int = 100) -> None:
        """Take gradient steps on the Huber loss of the temporal difference."""
        self._set_rate()
        optimizer = self.policy.optimizer
        for _ in range(gradient_steps):
            with self._precision():
                loss = self._loss(batch_size)
            optimizer.zero_grad()
            loss.backward()  # type: ignore[no-untyped-call]
            torch.nn.utils.clip_grad_norm_(self._parameters, self.max_grad_norm)
            optimizer.step()
            self._n_updates += 1
            self._updates_to_copy -= 1
            if self._updates_to_copy == 0:
                self._updates_to_copy = self.config.target_update
                self.q_net_target.load_state_dict(self.q_net.state_dict())
            if self.config.averaging:
                # At first the average follows closely.
                kept = min(self.config.averaging, self._n_updates / (self._n_updates + 10.0))
                torch._foreach_lerp_(self._average, [p.detach() for p in self._parameters], 1.0 - kept)

    def _loss(self, batch_size: int) -> torch.Tensor:
        memory = cast(ViewReplay, self.replay_buffer)
        batch = memory.sample(batch_size)
        if self._images is not None:
            batch = self._images(batch, self._drawn_images)
        with torch.no_grad():
            following = _free_values(self.q_net_target, batch.following)
            chosen_by = _free_values(self.q_net, batch.following) if self.config.double_q else following
            best = following.gather(1, chosen_by.argmax(dim=1, keepdim=True)).float()
            best = best.masked_fill(best < 0.5 * _NEVER, 0.0)  # all are blocked
            wanted = batch.rewards + (1 - batch.ended) * self.gamma * best
        values: torch.Tensor = self.q_net(batch.views).float()
        mine = values.gather(1, batch.actions)
        loss = functional.smooth_l1_loss(mine, wanted, beta=self.config.huber, reduction="none")
        if self.config.importance_first is not None:
            done = min(1.0, self.num_timesteps / max(1, self._total_timesteps))
            loss = loss * memory.importance(batch.rows, 1.0 - (1.0 - done) * (1.0 - self.config.importance_first))
        if self.config.priority:  # after the weights, which correct for how these rows were drawn
            memory.note_errors(batch.rows, (mine - wanted).abs().detach())
        loss = loss.mean()
        if self.config.teacher:
            blocked = _blocked(self.q_net, batch.views)
            free = torch.ones_like(values, dtype=torch.bool) if blocked is None else ~blocked
            told = functional.smooth_l1_loss(
                _over_mean(values, free), _over_mean(batch.teacher, free), beta=self.config.huber, reduction="none"
            )
            loss = loss + self.config.teacher * (told * free).sum() / free.sum()
        return loss

    def _precision(self) -> torch.autocast:
        return torch.autocast(self.device.type, dtype=torch.bfloat16, enabled=self._half)

    def _set_rate(self) -> None:
        """Set the learning rate by the used share of the budget."""
        done = self.num_timesteps / max(1, self._total_timesteps)
        for group in self.policy.optimizer.param_groups:
            group["lr"] = self.config.learning_rate_at(self.num_timesteps, done)

    def tested_parameters(self) -> list[torch.Tensor]:
        """Return the online network's parameters, or their running average if there is one."""
        if self.config.averaging and self._n_updates:
            return self._average
        return [parameter.detach() for parameter in self._parameters]

    def begin_with(self, state: dict[str, torch.Tensor]) -> None:
        """Overwrite the weights of the online and the target network, and their average."""
        for q_net in (self.q_net, self.q_net_target):
            q_net.load_state_dict(state)
        self._average = [parameter.detach().clone() for parameter in self._parameters]


def _blocked(q_net: TorchQNetwork, views: torch.Tensor) -> torch.Tensor | None:
    """Return (N, 6) bool: the site's actions that the views show as blocked. None if they do not show it."""
    return q_net.blocked(views) if isinstance(q_net, _ViewQNetwork) else None


def _free_values(q_net: TorchQNetwork, views: torch.Tensor) -> torch.Tensor:
    """Return (N, 6) values of the site's actions, very low if blocked."""
    values: torch.Tensor = q_net(views)
    blocked = _blocked(q_net, views)
    return values if blocked is None else values.masked_fill(blocked, _NEVER)


def _over_mean(values: torch.Tensor, free: torch.Tensor) -> torch.Tensor:
    """Return (N, 6) values less the mean over each row's free actions.

    The teacher tells which move is better and by how much, not how much a whole path is worth: the target network
    learns that only over many copies, and until then the move taken would look worse than all others.
    """
    mean = (values * free).sum(dim=1, keepdim=True) / free.sum(dim=1, keepdim=True).clamp(min=1)
    return values - mean


def dqn_of_lifts(
    batch: BatchedLiftEnv, config: DqnConfig, seed: int, *, is_framed: bool = True, **how: Any
) -> BatchDqn:
    """Return a DQN over a batch of lifts, see :attr:`QNetwork.is_framed`; ``how``: arguments of :class:`BatchDqn`."""
    return BatchDqn(BatchVecEnv(batch), config, seed, Trained(FramedPolicy if is_framed else _ViewPolicy), **how)


def network_of(dqn: BatchDqn) -> QNetwork:
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
    if isinstance(dqn, BatchDqn):
        dqn.begin_with(dqn.q_net.state_dict())
