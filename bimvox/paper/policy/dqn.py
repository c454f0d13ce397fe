"""Stable-baselines3's DQN with what the original stable-baselines had, and with many sites at once.

1. Dueling networks and the original's first weights: ``torch_network``.
2. Double Q-learning, and gradients clipped variable by variable: ``gradient``, which takes the gradient steps.
3. No phase of purely random actions: the share of random actions falls from the first step on.
4. Each of many sites explores independently; stable-baselines3 moves all of them at random, or none.

Stable-baselines3 collects transitions, stores them and counts steps. Its torch networks give the first weights, and
share the memory of the compiled learner's weights from then on: ``model.q_net`` and ``model.save()`` are always
current.
"""

from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np
from numpy.typing import NDArray
from stable_baselines3 import DQN
from stable_baselines3.common.logger import Logger

from bimvox.env.actions import ACTION_COUNT
from bimvox.paper.policy.config import PaperDqnConfig
from bimvox.paper.policy.symmetry import IMAGES, symmetry, write_images
from bimvox.paper.policy.torch_network import PaperPolicy, arrays_of, share_arrays
from bimvox.paper.policy.vec_env import PaperVecEnv
from bimvox.policy.learner.arrays import Memory
from bimvox.policy.learner.learner import CompiledLearner, copy_of, move_towards
from bimvox.policy.learner.network import ValueNetwork
from bimvox.policy.learner.priorities import Priorities

WHOLE_NUMBERS = ("paper", "paper_flat")
"""Observations that hold only whole numbers."""


class PaperDqn(DQN):
    """DQN over one site or many.

    Args:
        env: The sites.
        config: The choices.
        seed: The same sites, config, seed, budget and loaded network give the same weights.
        budget: Steps over which the share of random actions falls.
        initial: Network to start from; exploration then starts at ``exploration_again``.
    """

    def __init__(
        self,
        env: PaperVecEnv,
        config: PaperDqnConfig,
        *,
        seed: int,
        budget: int,
        initial: ValueNetwork | None = None,
    ) -> None:
        self.config = config
        self._first = config.exploration_first if initial is None else config.exploration_again
        self._budget = budget
        self._phase = config.exploration_phase(budget)
        super().__init__(
            PaperPolicy,
            env,
            **config.sb3_arguments(),
            exploration_initial_eps=self._first,
            policy_kwargs={
                "net_arch": list(config.hidden),
                "dueling": config.dueling,
                "glorot": config.glorot,
                "layer_norm": config.layer_norm,
            },
            replay_buffer_kwargs={"handle_timeout_termination": config.bootstrap_at_limit},
            device="cpu",
            seed=seed,
        )
        # Without a logger, every run of stable-baselines3 leaves an empty folder among the temporary files.
        self.set_logger(Logger(folder=None, output_formats=[]))
        self.exploration_rate = self._first
        self._random = np.random.default_rng(seed)
        self._updates_to_copy = config.target_update
        self._updates_made = 0
        self._learner = CompiledLearner(
            arrays_of(self.q_net) if initial is None else initial,
            batch_size=config.batch_size,
            learning_rate=config.learning_rate,
            discount=config.discount,
            double_q=config.double_q,
            longest=config.max_gradient_norm,
        )
        share_arrays(self.q_net, self._learner.live)
        share_arrays(self.q_net_target, self._learner.target)
        self._average = self._learner.network()
        self._symmetry = symmetry() if config.symmetry else None
        self._images = _room_for(config.batch_size, self._learner.live.inputs)
        self._priorities = Priorities(config.buffer_size, config.priority) if config.priority else None

    def _setup_model(self) -> None:
        """Store the paper's map as bytes, a quarter of the memory: heights, flags and counts are whole numbers."""
        super()._setup_model()
        buffer, space = self.replay_buffer, self.observation_space
        fits = isinstance(space, gymnasium.spaces.Box) and space.high.max() < 256
        if buffer is not None and fits and self.config.observation in WHOLE_NUMBERS:
            buffer.observations = np.zeros(buffer.observations.shape, np.uint8)
            buffer.next_observations = np.zeros(buffer.next_observations.shape, np.uint8)

    @property
    def network(self) -> ValueNetwork:
        """A copy of the network to test and to keep: the online network, or its average."""
        return self._learner.network() if self.config.averaging == 1.0 else copy_of(self._average)

    def _on_step(self) -> None:
        """Lower the share of random actions and the learning rate; ``train`` copies the target network."""
        done = min(1.0, self.num_timesteps / max(1, self._phase))
        self.exploration_rate = self._first + done * (self.config.exploration_last - self._first)
        self._learner.learning_rate = self.config.learning_rate_at(self.num_timesteps, self._budget)

    def _sample_action(
        self, learning_starts: int, action_noise: Any = None, n_envs: int = 1
    ) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Return actions by the current share of random actions, from the first step on."""
        actions, _ = self.predict(self._last_obs)
        return actions, actions

    def predict(
        self, observation: Any, state: Any = None, episode_start: Any = None, deterministic: bool = False
    ) -> tuple[NDArray[np.int64], Any]:
        """Return (N,) actions; unless deterministic, each is random with the current share."""
        count = len(observation)
        explore = np.zeros(count, np.bool_)
        if not deterministic:
            explore = self._random.random(count) < self._rates(count)
            chosen = self._random.integers(ACTION_COUNT, size=count)
            if explore.all():
                return chosen, state
        # The state's value is the same for all actions, so the advantages decide.
        greedy = self._learner.live.actions(observation).argmax(axis=1)
        return (np.where(explore, chosen, greedy) if explore.any() else greedy), state

    def _rates(self, count: int) -> float | NDArray[np.float64]:
        """Return the current share of random actions, per site if they differ."""
        if not self.config.exploration_spread or count == 1:
            return self.exploration_rate
        half = count // 2
        return self.exploration_rate * np.concatenate([np.zeros(half), np.linspace(0.0, 4.0, count - half)])

    def train(self, gradient_steps: int, batch_size: int = 100) -> None:
        """Take gradient steps on the Huber loss of the temporal difference."""
        memory, filled = self._memory()
        drawn = self._draw(filled, gradient_steps, batch_size)
        for step in range(gradient_steps):
            rows = self._random.integers(filled, size=batch_size) if drawn is None else drawn[step]
            importance = self._importance(rows)
            if self._symmetry is None:
                self._learner.step(memory, rows, importance)
            else:
                write_images(self._symmetry, memory, rows, self._random.integers(IMAGES, size=batch_size), self._images)
                self._learner.step(self._images, np.arange(batch_size), importance)
            if self._priorities is not None:
                self._priorities.put(rows, self._learner.errors)
            self._updates_made += 1
            if self.config.averaging < 1.0:
                # The first steps count equally; otherwise the average would begin at the untrained weights.
                share = max(self.config.averaging, 1.0 / (1 + self._updates_made))
                move_towards(self._average, self._learner.live, share)
            self._updates_to_copy -= 1
            if self._updates_to_copy == 0:
                self._updates_to_copy = self.config.target_update
                self._learner.copy_to_target()
        self._n_updates += gradient_steps

    def _draw(self, filled: int, gradient_steps: int, batch_size: int) -> NDArray[np.int64] | None:
        """Return (steps, B) rows of the memory, by priority. None if they are drawn evenly."""
        buffer = self.replay_buffer
        if self._priorities is None or buffer is None:
            return None
        last = (buffer.pos - 1) % buffer.buffer_size * buffer.n_envs
        self._priorities.fill(filled, slice(last, last + buffer.n_envs))
        return self._priorities.draw(self._random, gradient_steps, batch_size)

    def _importance(self, rows: NDArray[np.int64]) -> NDArray[np.float32] | None:
        """Return the weights of some rows in the loss. None if all are equal."""
        first = self.config.importance_first
        if self._priorities is None or first is None:
            return None
        beta = first + min(1.0, self.num_timesteps / self._budget) * (1.0 - first)
        return self._priorities.importance(rows, beta)

    def _memory(self) -> tuple[Memory, int]:
        """Return the replay memory with one row per transition, and the number of filled rows."""
        buffer = self.replay_buffer
        if buffer is None:
            raise RuntimeError("training before the replay memory was created")
        rows = buffer.buffer_size * buffer.n_envs
        filled = (buffer.buffer_size if buffer.full else buffer.pos) * buffer.n_envs
        memory = Memory(
            buffer.observations.reshape(rows, -1),
            buffer.next_observations.reshape(rows, -1),
            buffer.actions.reshape(rows),
            buffer.rewards.reshape(rows),
            buffer.dones.reshape(rows),
            buffer.timeouts.reshape(rows),
        )
        return memory, filled


def _room_for(transitions: int, inputs: int) -> Memory:
    """Return a memory of zeros for so many transitions."""
    columns = [np.zeros(transitions, np.float32) for _ in range(3)]
    seen = [np.zeros((transitions, inputs), np.float32) for _ in range(2)]
    return Memory(seen[0], seen[1], np.zeros(transitions, np.int64), columns[0], columns[1], columns[2])
