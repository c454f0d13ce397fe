"""The Q-network in torch: stable-baselines3's, with a second stream if it is dueling.

Stable-baselines3 has no dueling network. This one is the original stable-baselines': two perceptrons with the same
hidden layers in parallel, each from the whole observation, with no layer in common. In its ``LnMlpPolicy`` every hidden
layer is normalised before the rectifier.
"""

from __future__ import annotations

from typing import Any, TypeVar

import numpy as np
import torch
from numpy.typing import NDArray
from stable_baselines3.common.torch_layers import create_mlp
from stable_baselines3.dqn.policies import DQNPolicy
from stable_baselines3.dqn.policies import QNetwork as TorchQNetwork
from torch import nn

from bimvox.policy.learner.network import ValueNetwork
from bimvox.policy.perceptron import Perceptron

L = TypeVar("L", bound=nn.Module)


class DuelingQNetwork(TorchQNetwork):
    """The state's value plus each action's advantage over their mean: equation (9) of Wang et al. 2016."""

    def __init__(self, *arguments: Any, layer_norm: bool = False, **named: Any) -> None:
        super().__init__(*arguments, **named)

        def perceptron(outputs: int) -> nn.Sequential:
            sizes = (self.features_dim, outputs, self.net_arch, self.activation_fn)
            return nn.Sequential(*create_mlp(*sizes, post_linear_modules=[nn.LayerNorm] if layer_norm else None))

        if layer_norm:
            self.q_net = perceptron(int(self.action_space.n))
        self.value_net = perceptron(1)

    def forward(self, observations: torch.Tensor) -> torch.Tensor:  # type: ignore[override]
        """Return (N, 6) action values of (N, inputs) observations."""
        advantages = self.q_net(observations)
        values: torch.Tensor = self.value_net(observations) + (advantages - advantages.mean(dim=1, keepdim=True))
        return values


class PaperPolicy(DQNPolicy):
    """Stable-baselines3's DQN policy, optionally dueling and with the original's first weights.

    Args:
        dueling: Whether there are two streams.
        glorot: Whether weights begin uniform after Glorot and Bengio, biases at zero.
        layer_norm: Whether hidden layers are normalised; only if it is dueling.
    """

    def __init__(self, *arguments: Any, dueling: bool, glorot: bool, layer_norm: bool, **named: Any) -> None:
        self._dueling = dueling
        self._layer_norm = layer_norm
        self._glorot = glorot
        super().__init__(*arguments, **named)

    def set_training_mode(self, mode: bool) -> None:
        """Only note the mode: no layer depends on it, and visiting all of them twice a step takes a tenth of it."""
        self.training = mode

    def make_q_net(self) -> TorchQNetwork:
        """Return one network; called for the online and for the target network."""
        arguments = self._update_features_extractor(self.net_args, features_extractor=None)
        if self._dueling:
            arguments["layer_norm"] = self._layer_norm
        q_net = (DuelingQNetwork if self._dueling else TorchQNetwork)(**arguments).to(self.device)
        if self._glorot:
            for layer in q_net.modules():
                if isinstance(layer, nn.Linear):
                    nn.init.xavier_uniform_(layer.weight)
                    nn.init.zeros_(layer.bias)
        return q_net


def arrays_of(q_net: TorchQNetwork) -> ValueNetwork:
    """Return a copy of a torch network's weights as plain arrays."""
    streams = []
    for perceptron in _perceptrons(q_net):
        layers, norms = _of_kind(perceptron, nn.Linear), _of_kind(perceptron, nn.LayerNorm)
        streams.append(
            Perceptron(
                tuple(_array(layer.weight).T.copy() for layer in layers),
                tuple(_array(layer.bias) for layer in layers),
                tuple(_array(norm.weight) for norm in norms),
                tuple(_array(norm.bias) for norm in norms),
            )
        )
    return ValueNetwork(*streams)


def share_arrays(q_net: TorchQNetwork, network: ValueNetwork) -> None:
    """Make a torch network hold the arrays of a plain one: a change of either changes both.

    Args:
        q_net: Of the same layers.
        network: Its arrays become the memory of the torch network's parameters.

    Raises:
        ValueError: The layers differ.
    """
    perceptrons = _perceptrons(q_net)
    linear = [_of_kind(perceptron, nn.Linear) for perceptron in perceptrons]
    sizes = [(layers[0].in_features, *(layer.out_features for layer in layers)) for layers in linear]
    if sizes != [stream.layer_sizes for stream in network.streams]:
        raise ValueError(f"network: layers {[stream.layer_sizes for stream in network.streams]} do not fit {sizes}")
    for perceptron, layers, arrays in zip(perceptrons, linear, network.streams, strict=True):
        for layer, weight, bias in zip(layers, arrays.weights, arrays.biases, strict=True):
            layer.weight.data = torch.from_numpy(weight).T
            layer.bias.data = torch.from_numpy(bias)
        for norm, scale, shift in zip(_of_kind(perceptron, nn.LayerNorm), arrays.scales, arrays.shifts, strict=True):
            norm.weight.data = torch.from_numpy(scale)
            norm.bias.data = torch.from_numpy(shift)


def _perceptrons(q_net: TorchQNetwork) -> list[nn.Sequential]:
    """Return the action stream, and the state stream if there is one."""
    return [q_net.q_net, q_net.value_net] if isinstance(q_net, DuelingQNetwork) else [q_net.q_net]


def _of_kind(perceptron: nn.Sequential, kind: type[L]) -> list[L]:
    return [layer for layer in perceptron if isinstance(layer, kind)]


def _array(parameter: torch.Tensor) -> NDArray[np.float32]:
    return np.array(parameter.detach().numpy(), np.float32)
