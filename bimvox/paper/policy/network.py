"""The Q-network at work, without torch: one perceptron, or two where it is dueling."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bimvox.errors import PolicyError
from bimvox.policy.perceptron import Perceptron


@dataclass(frozen=True, slots=True, eq=False)
class PaperNetwork:
    """Values of the six actions for an observation.

    Attributes:
        actions: Perceptron from the observation to one number an action.
        state: Perceptron from the observation to the value of the state; None where the network is not dueling.
    """

    actions: Perceptron
    state: Perceptron | None = None

    @property
    def inputs(self) -> int:
        """Entries of the observation."""
        return self.actions.layer_sizes[0]

    def __call__(self, observations: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return (N, 6) float32 action values of (N, inputs) float32 observations, row by row.

        Dueling, equation (9) of Wang et al. 2016: the value of the state, plus each action's advantage over their mean.
        """
        advantages = self.actions(observations)
        if self.state is None:
            return advantages
        centred = advantages - advantages.mean(axis=1, keepdims=True)
        return np.asarray(self.state(observations) + centred, np.float32)

    def arrays(self) -> dict[str, NDArray[np.float32]]:
        """Return the arrays by name, as they are stored."""
        named = {f"actions.{name}": array for name, array in self.actions.arrays().items()}
        if self.state is not None:
            named.update({f"state.{name}": array for name, array in self.state.arrays().items()})
        return named


def paper_network_from_arrays(arrays: Mapping[str, NDArray[np.generic]], *, outputs: int = 6) -> PaperNetwork:
    """Return the network of arrays named as by :meth:`PaperNetwork.arrays`.

    Raises:
        PolicyError: Names, types, shapes or values do not make one.
    """
    streams = {name.split(".", 1)[0] for name in arrays}
    if not {"actions"} <= streams <= {"actions", "state"}:
        raise PolicyError(
            f"the weights are of {sorted(streams)}, not of a network's actions and state",
            differs={"arrays": sorted(arrays)},
        )
    actions = _stream(arrays, "actions", outputs)
    state = _stream(arrays, "state", 1) if "state" in streams else None
    if state is not None and state.layer_sizes[0] != actions.layer_sizes[0]:
        raise PolicyError(
            f"the streams take {actions.layer_sizes[0]} and {state.layer_sizes[0]} inputs",
            differs={"inputs": (actions.layer_sizes[0], state.layer_sizes[0])},
        )
    return PaperNetwork(actions, state)


def _stream(arrays: Mapping[str, NDArray[np.generic]], stream: str, outputs: int) -> Perceptron:
    """Return one perceptron, checked."""
    own = {name.split(".", 1)[1]: array for name, array in arrays.items() if name.startswith(f"{stream}.")}
    layers = len(own) // 2
    if layers == 0 or set(own) != {f"layer{n}.{part}" for n in range(layers) for part in ("weight", "bias")}:
        raise PolicyError(f"{stream}: the weights are named {sorted(own)}, not layer<n>.weight and layer<n>.bias")
    weights, biases = [], []
    width: int | None = None
    for n in range(layers):
        weight, bias = own[f"layer{n}.weight"], own[f"layer{n}.bias"]
        if weight.dtype != np.float32 or bias.dtype != np.float32:
            raise PolicyError(f"{stream}: layer {n} holds {weight.dtype} and {bias.dtype}, not float32")
        if weight.ndim != 2 or bias.shape != weight.shape[1:] or (width is not None and weight.shape[0] != width):
            raise PolicyError(f"{stream}: layer {n} has shapes {weight.shape} and {bias.shape}, after {width} inputs")
        if not (np.isfinite(weight).all() and np.isfinite(bias).all()):
            raise PolicyError(f"{stream}: layer {n} holds values that are not finite")
        weights.append(np.require(weight, requirements=["C", "W"]))
        biases.append(np.require(bias, requirements=["C", "W"]))
        width = weight.shape[1]
    if width != outputs:
        raise PolicyError(f"{stream}: the network gives {width} values, not {outputs}")
    return Perceptron(tuple(weights), tuple(biases))
