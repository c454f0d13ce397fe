"""The Q-network of a policy, evaluated from plain arrays, without torch."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import kernel
from bimvox.env.actions import ACTION_COUNT
from bimvox.env.frame import FRAME_ACTIONS, FRAME_COUNT
from bimvox.env.observation import INPUT_SIZE, VIEW_SIZE
from bimvox.policy.perceptron import Perceptron, layers_from_arrays
from bimvox.policy.sparse_layer import NO_SUMS, sparse_layer, sums_of_groups


@dataclass(frozen=True, slots=True, eq=False)
class QNetwork(Perceptron):
    """Values of the six actions for an observation: a perceptron in the view's frame. Its arrays must not change."""

    _sums: NDArray[np.float32] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        """Fold the first layer's weights; see :mod:`bimvox.policy.sparse_layer`."""
        object.__setattr__(self, "_sums", sums_of_groups(self.weights[0]))

    def outputs(self, inputs: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return (N, 6) values in the views' frames; columns after the inputs are ignored."""
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
    return QNetwork(*layers_from_arrays(arrays, inputs=INPUT_SIZE, outputs=ACTION_COUNT))


@kernel
def _on_site(
    values: NDArray[np.float32], views: NDArray[np.float32], frame_actions: NDArray[np.int64]
) -> NDArray[np.float32]:
    """Return the values of the site's actions from the values of each frame's actions."""
    out = np.empty_like(values)
    for n in range(values.shape[0]):
        frame = min(max(int(np.rint(views[n, VIEW_SIZE - 1] * (FRAME_COUNT - 1))), 0), FRAME_COUNT - 1)
        for action in range(values.shape[1]):
            out[n, action] = values[n, frame_actions[frame, action]]
    return out
