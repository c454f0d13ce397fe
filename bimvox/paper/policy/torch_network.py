"""The Q-network in training: stable-baselines3's, with a second stream where it is dueling.

Stable-baselines3 has no dueling network. This one is the original stable-baselines': two perceptrons of the same hidden
layers side by side, each from the whole observation, no layer in common.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from stable_baselines3.common.torch_layers import create_mlp
from stable_baselines3.dqn.policies import DQNPolicy
from stable_baselines3.dqn.policies import QNetwork as TorchQNetwork
from torch import nn

from bimvox.paper.policy.network import PaperNetwork
from bimvox.policy.perceptron import Perceptron


class DuelingQNetwork(TorchQNetwork):
    """The state's value plus each action's advantage over their mean: equation (9) of Wang et al. 2016."""

    def __init__(self, *arguments: Any, **named: Any) -> None:
        super().__init__(*arguments, **named)
        self.value_net = nn.Sequential(*create_mlp(self.features_dim, 1, self.net_arch, self.activation_fn))

    def forward(self, observations: torch.Tensor) -> torch.Tensor:  # type: ignore[override]
        """Return (N, 6) action values of (N, inputs) observations."""
        advantages = self.q_net(observations)
        values: torch.Tensor = self.value_net(observations) + (advantages - advantages.mean(dim=1, keepdim=True))
        return values


class PaperPolicy(DQNPolicy):
    """Stable-baselines3's DQN policy, dueling and with the original's first weights where asked for.

    Args:
        dueling: Whether there are two streams.
        glorot: Whether weights begin uniform after Glorot and Bengio, biases at zero.
    """

    def __init__(self, *arguments: Any, dueling: bool, glorot: bool, **named: Any) -> None:
        self._dueling = dueling
        self._glorot = glorot
        super().__init__(*arguments, **named)

    def set_training_mode(self, mode: bool) -> None:
        """Nothing changes between the modes; going through all layers twice a step would take a tenth of the time."""
        self.training = mode

    def make_q_net(self) -> TorchQNetwork:
        """Return one network; called for the online and for the target network."""
        arguments = self._update_features_extractor(self.net_args, features_extractor=None)
        q_net = (DuelingQNetwork if self._dueling else TorchQNetwork)(**arguments).to(self.device)
        if self._glorot:
            for layer in q_net.modules():
                if isinstance(layer, nn.Linear):
                    nn.init.xavier_uniform_(layer.weight)
                    nn.init.zeros_(layer.bias)
        return q_net


def arrays_of(q_net: TorchQNetwork) -> PaperNetwork:
    """Return a copy of a torch network's weights as plain arrays."""
    state = _stream(q_net.value_net) if isinstance(q_net, DuelingQNetwork) else None
    return PaperNetwork(_stream(q_net.q_net), state)


def load_arrays(q_net: TorchQNetwork, network: PaperNetwork) -> None:
    """Overwrite a torch network's weights.

    Raises:
        ValueError: The layers have other sizes, or only one of the two is dueling.
    """
    streams = [(q_net.q_net, network.actions)]
    if isinstance(q_net, DuelingQNetwork) != (network.state is not None):
        raise ValueError("a dueling network does not fit one that is not")
    if isinstance(q_net, DuelingQNetwork) and network.state is not None:
        streams.append((q_net.value_net, network.state))
    for perceptron, arrays in streams:
        layers = _linear(perceptron)
        sizes = (layers[0].in_features, *(layer.out_features for layer in layers))
        if sizes != arrays.layer_sizes:
            raise ValueError(f"a network of {arrays.layer_sizes} does not fit one of {sizes}")
        with torch.no_grad():
            for layer, weight, bias in zip(layers, arrays.weights, arrays.biases, strict=True):
                layer.weight.copy_(torch.from_numpy(weight.T.copy()))
                layer.bias.copy_(torch.from_numpy(bias.copy()))


def _stream(perceptron: nn.Sequential) -> Perceptron:
    layers = _linear(perceptron)
    return Perceptron(
        tuple(_plain(layer.weight).T.copy() for layer in layers), tuple(_plain(layer.bias).copy() for layer in layers)
    )


def _plain(tensor: torch.Tensor) -> NDArray[np.float32]:
    return np.asarray(tensor.detach().numpy(), np.float32)


def _linear(perceptron: nn.Sequential) -> list[nn.Linear]:
    return [layer for layer in perceptron if isinstance(layer, nn.Linear)]
