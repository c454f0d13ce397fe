"""The Q-networks of the paper's site: as stable-baselines3 trains them, and as values to run, keep and store.

Stable-baselines3 has no dueling network. This one is the original stable-baselines': two perceptrons with the same
hidden layers in parallel, each from the whole observation, with no layer in common. In its ``LnMlpPolicy`` every hidden
layer is normalised before the rectifier.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from safetensors import SafetensorError
from safetensors.torch import load as tensors_from_bytes
from safetensors.torch import save as bytes_from_tensors
from stable_baselines3.common.torch_layers import create_mlp
from stable_baselines3.dqn.policies import DQNPolicy
from stable_baselines3.dqn.policies import QNetwork as TorchQNetwork
from torch import nn
from torch.nn import functional

from bimvox.errors import PolicyError


class _PaperQNetwork(TorchQNetwork):
    """A perceptron, or two: the state's value plus each action's advantage over their mean (Wang et al. 2016, (9))."""

    def __init__(self, *arguments: Any, dueling: bool, glorot: bool, layer_norm: bool, **named: Any) -> None:
        super().__init__(*arguments, **named)

        def perceptron(outputs: int) -> nn.Sequential:
            sizes = (self.features_dim, outputs, self.net_arch, self.activation_fn)
            return nn.Sequential(*create_mlp(*sizes, post_linear_modules=[nn.LayerNorm] if layer_norm else None))

        if layer_norm:
            self.q_net = perceptron(int(self.action_space.n))
        self.value_net = perceptron(1) if dueling else None
        if glorot:
            for layer in self.modules():
                if isinstance(layer, nn.Linear):
                    nn.init.xavier_uniform_(layer.weight)
                    nn.init.zeros_(layer.bias)

    def forward(self, observations: torch.Tensor) -> torch.Tensor:  # type: ignore[override]
        """Return (N, 6) action values of (N, inputs) observations."""
        return _dueling(self.q_net(observations), None if self.value_net is None else self.value_net(observations))


class PaperPolicy(DQNPolicy):
    """Stable-baselines3's DQN policy, optionally dueling and with the original's first weights.

    Args:
        network: ``dueling``: whether there are two streams; ``glorot``: whether weights begin uniform after Glorot and
            Bengio, biases at zero; ``layer_norm``: whether hidden layers are normalised.
    """

    def __init__(self, *arguments: Any, network: dict[str, bool], **named: Any) -> None:
        self._network = network
        super().__init__(*arguments, **named)

    def set_training_mode(self, mode: bool) -> None:
        """Only note the mode: no layer depends on it, and visiting all of them twice a step takes a tenth of it."""
        self.training = mode

    def make_q_net(self) -> TorchQNetwork:
        """Return one network; called for the online and for the target network."""
        arguments = self._update_features_extractor(self.net_args, features_extractor=None)
        return _PaperQNetwork(**arguments, **self._network).to(self.device)


class ValueNetwork:
    """Values of the six actions for an observation.

    Args:
        tensors: The weights, as torch's networks name them; they must not change.
    """

    def __init__(self, tensors: Mapping[str, torch.Tensor]) -> None:
        self.tensors = dict(tensors)

    def __call__(self, observations: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return (N, 6) float32 action values of (N, inputs) float32 observations."""
        seen = torch.from_numpy(np.ascontiguousarray(observations, np.float32))
        with torch.no_grad():
            state = self._stream("value_net.", seen) if "value_net.0.weight" in self.tensors else None
            return np.asarray(_dueling(self._stream("q_net.", seen), state).numpy(), np.float32)

    def _stream(self, name: str, values: torch.Tensor) -> torch.Tensor:
        """Return the outputs of one perceptron."""
        places = sorted({int(key.split(".")[1]) for key in self.tensors if key.startswith(name)})
        for place in places:
            weight, bias = (self.tensors[f"{name}{place}.{part}"] for part in ("weight", "bias"))
            if weight.ndim == 1:
                values = functional.layer_norm(values, weight.shape, weight, bias)
            else:
                values = functional.linear(functional.relu(values) if place else values, weight, bias)
        return values


def _dueling(advantages: torch.Tensor, state: torch.Tensor | None) -> torch.Tensor:
    return advantages if state is None else state + (advantages - advantages.mean(dim=1, keepdim=True))


def network_to_bytes(network: ValueNetwork) -> bytes:
    """Return a network as the bytes of a safetensors file."""
    return bytes(bytes_from_tensors(network.tensors))


def network_from_bytes(content: bytes) -> ValueNetwork:
    """Return the network of :func:`network_to_bytes`.

    Raises:
        PolicyError: The bytes are not such a file.
    """
    try:
        return ValueNetwork(tensors_from_bytes(content))
    except (SafetensorError, ValueError, TypeError, KeyError) as error:
        raise PolicyError(f"not a safetensors file: {error}") from error
