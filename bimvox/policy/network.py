"""The Q-network at work, from plain arrays, no torch."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import kernel
from bimvox.env.actions import ACTION_COUNT
from bimvox.env.frame import FRAME_ACTIONS, FRAME_COUNT
from bimvox.env.observation import INPUT_SIZE, VIEW_SIZE
from bimvox.errors import PolicyError
from bimvox.policy.perceptron import Perceptron
from bimvox.policy.sparse_layer import NO_SUMS, sparse_layer, sums_of_groups


@dataclass(frozen=True, slots=True, eq=False)
class QNetwork(Perceptron):
    """Values of the six actions for an observation: a perceptron in the view's frame; its arrays must not change."""

    _sums: NDArray[np.float32] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        """Fold the first layer's weights; see :mod:`bimvox.policy.sparse_layer`."""
        object.__setattr__(self, "_sums", sums_of_groups(self.weights[0]))

    def outputs(self, inputs: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return (N, 6) values in the views' frames; what follows the inputs is not looked at."""
        values, sums = inputs, self._sums
        last = len(self.weights) - 1
        for layer, (weight, bias) in enumerate(zip(self.weights, self.biases, strict=True)):
            values = sparse_layer(values, weight, bias, sums, layer != last)
            sums = NO_SUMS
        return values

    def __call__(self, observations: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return (N, 6) float32 values of the site's actions for (N, VIEW_SIZE) float32 observations.

        Raises:
            ValueError: They have another shape.
        """
        views = np.ascontiguousarray(observations, np.float32)
        if views.ndim != 2 or views.shape[1] != VIEW_SIZE:
            raise ValueError(f"observations of shape {views.shape}, not (N, {VIEW_SIZE})")
        return _on_site(self.outputs(views), views, FRAME_ACTIONS)


def network_from_arrays(arrays: Mapping[str, NDArray[np.generic]]) -> QNetwork:
    """Return the network of arrays named as by :meth:`QNetwork.arrays`.

    Raises:
        PolicyError: Names, types, shapes or values do not make a network for this version's observation and actions.
    """
    layers = len(arrays) // 2
    expected = {f"layer{n}.{part}" for n in range(layers) for part in ("weight", "bias")}
    if layers == 0 or set(arrays) != expected:
        raise PolicyError(
            f"the weights are named {sorted(arrays)}, a Q-network's layer<n>.weight and layer<n>.bias",
            differs={"arrays": sorted(arrays)},
        )
    weights, biases = [], []
    width = INPUT_SIZE
    for n in range(layers):
        weight, bias = arrays[f"layer{n}.weight"], arrays[f"layer{n}.bias"]
        if weight.dtype != np.float32 or bias.dtype != np.float32:
            raise PolicyError(f"layer {n} holds {weight.dtype} and {bias.dtype}, not float32")
        if weight.ndim != 2 or bias.ndim != 1 or weight.shape[0] != width or bias.shape[0] != weight.shape[1]:
            raise PolicyError(
                f"layer {n} has shapes {weight.shape} and {bias.shape}; it takes {width} inputs",
                differs={f"layer{n}.weight": weight.shape, "inputs": width},
                hint="train a policy with this version of bimvox",
            )
        if not (np.isfinite(weight).all() and np.isfinite(bias).all()):
            raise PolicyError(f"layer {n} holds values that are not finite")
        weights.append(np.require(weight, requirements=["C", "W"]))
        biases.append(np.require(bias, requirements=["C", "W"]))
        width = weight.shape[1]
    if width != ACTION_COUNT:
        raise PolicyError(f"the network gives {width} values, not one for each of {ACTION_COUNT} actions")
    return QNetwork(tuple(weights), tuple(biases))


@kernel
def _on_site(
    values: NDArray[np.float32], views: NDArray[np.float32], frame_actions: NDArray[np.int64]
) -> NDArray[np.float32]:
    """Return the values of the site's actions from those of the actions in each view's frame."""
    out = np.empty_like(values)
    for n in range(values.shape[0]):
        frame = min(max(int(np.rint(views[n, VIEW_SIZE - 1] * (FRAME_COUNT - 1))), 0), FRAME_COUNT - 1)
        for action in range(values.shape[1]):
            out[n, action] = values[n, frame_actions[frame, action]]
    return out
