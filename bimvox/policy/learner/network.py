"""A Q-network of one perceptron, or of two if it is dueling, evaluated and stored without torch."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from safetensors import SafetensorError
from safetensors.numpy import load as arrays_from_bytes
from safetensors.numpy import save as bytes_from_arrays

from bimvox.errors import PolicyError
from bimvox.policy.perceptron import Perceptron, layers_from_arrays, norms_from_arrays


@dataclass(frozen=True, slots=True, eq=False)
class ValueNetwork:
    """Values of the six actions for an observation.

    Attributes:
        actions: Perceptron from the observation to one number per action.
        state: Perceptron from the observation to the value of the state. None if the network is not dueling.
    """

    actions: Perceptron
    state: Perceptron | None = None

    @property
    def streams(self) -> tuple[Perceptron, ...]:
        """The action stream, and the state stream if there is one."""
        return (self.actions,) if self.state is None else (self.actions, self.state)

    @property
    def inputs(self) -> int:
        """Entries of the observation."""
        return self.actions.layer_sizes[0]

    def __call__(self, observations: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return (N, 6) float32 action values of (N, inputs) float32 observations, row by row.

        Dueling (equation (9) of Wang et al. 2016): the state's value plus each action's advantage over their mean.
        """
        advantages = self.actions(observations)
        if self.state is None:
            return advantages
        centred = advantages - advantages.mean(axis=1, keepdims=True)
        return np.asarray(self.state(observations) + centred, np.float32)

    def arrays(self) -> dict[str, NDArray[np.float32]]:
        """Return the arrays by name, as files store them."""
        return {
            f"{stream}.{name}": array
            for stream, perceptron in zip(("actions", "state"), self.streams, strict=False)
            for name, array in perceptron.arrays().items()
        }


def value_network_from_arrays(arrays: Mapping[str, NDArray[np.generic]], *, outputs: int = 6) -> ValueNetwork:
    """Return the network of arrays named as by :meth:`ValueNetwork.arrays`.

    Raises:
        PolicyError: Names, types, shapes or values do not make a network.
    """
    streams = {name.split(".", 1)[0] for name in arrays}
    if not {"actions"} <= streams <= {"actions", "state"}:
        raise PolicyError(
            f"the weights are of {sorted(streams)}, not of a network's actions and state",
            differs={"arrays": sorted(arrays)},
        )
    actions = _stream(arrays, "actions", None, outputs)
    state = _stream(arrays, "state", actions.layer_sizes[0], 1) if "state" in streams else None
    return ValueNetwork(actions, state)


def _stream(arrays: Mapping[str, NDArray[np.generic]], stream: str, inputs: int | None, outputs: int) -> Perceptron:
    own = {name.split(".", 1)[1]: array for name, array in arrays.items() if name.startswith(f"{stream}.")}
    try:
        norms = {name: array for name, array in own.items() if name.endswith((".scale", ".shift"))}
        layers = {name: array for name, array in own.items() if name not in norms}
        weights, biases = layers_from_arrays(layers, inputs=inputs, outputs=outputs)
        return Perceptron(weights, biases, *norms_from_arrays(norms, hidden=[len(bias) for bias in biases[:-1]]))
    except PolicyError as error:
        raise PolicyError(f"{stream}: {error.message}", differs=error.differs, hint=error.hint) from error


def network_to_bytes(network: ValueNetwork) -> bytes:
    """Return a network as the bytes of a safetensors file."""
    return bytes(bytes_from_arrays(network.arrays()))


def network_from_bytes(content: bytes) -> ValueNetwork:
    """Return the network of :func:`network_to_bytes`.

    Raises:
        PolicyError: The bytes do not hold such a network.
    """
    try:
        arrays = arrays_from_bytes(content)
    except (SafetensorError, ValueError, TypeError, KeyError) as error:
        raise PolicyError(f"not a safetensors file: {error}") from error
    return value_network_from_arrays(arrays)
