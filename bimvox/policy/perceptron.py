"""A multilayer perceptron from plain arrays.

Compiled with a fixed order of summation, so that the values of a lift do not depend on which others are asked with it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import kernel

_ROWS_AT_ONCE = 8


@dataclass(frozen=True, slots=True, eq=False)
class Perceptron:
    """Layers with rectified linear units after every one but the last.

    Attributes:
        weights: Per layer (inputs, outputs) float32, contiguous.
        biases: Per layer (outputs,) float32.
    """

    weights: tuple[NDArray[np.float32], ...]
    biases: tuple[NDArray[np.float32], ...]

    @property
    def layer_sizes(self) -> tuple[int, ...]:
        """Width of the input, of every hidden layer, and of the output."""
        return (self.weights[0].shape[0], *(w.shape[1] for w in self.weights))

    def __call__(self, observations: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return (N, outputs) float32 of (N, inputs) float32, row by row."""
        return self.outputs(np.ascontiguousarray(observations, np.float32))

    def outputs(self, inputs: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return (N, outputs) float32 of (N, inputs or more) contiguous float32; what is more is not looked at."""
        values = inputs
        last = len(self.weights) - 1
        for layer, (weight, bias) in enumerate(zip(self.weights, self.biases, strict=True)):
            values = _layer(values, weight, bias, layer != last)
        return values

    def arrays(self) -> dict[str, NDArray[np.float32]]:
        """Return the arrays by name, as they are stored."""
        named: dict[str, NDArray[np.float32]] = {}
        for layer, (weight, bias) in enumerate(zip(self.weights, self.biases, strict=True)):
            named[f"layer{layer}.weight"] = weight
            named[f"layer{layer}.bias"] = bias
        return named


@kernel
def _layer(
    inputs: NDArray[np.float32], weight: NDArray[np.float32], bias: NDArray[np.float32], rectify: bool
) -> NDArray[np.float32]:
    """Return one layer's output; inputs that are zero (free cells, mostly) cost nothing.

    Reading the weights is what takes the time, so several rows share each of them.
    """
    rows, count = inputs.shape[0], weight.shape[1]
    outputs = np.empty((rows, count), np.float32)
    for first in range(0, rows, _ROWS_AT_ONCE):
        last = min(first + _ROWS_AT_ONCE, rows)
        for n in range(first, last):
            outputs[n] = bias
        for i in range(weight.shape[0]):  # what the layer does not take in may follow
            for n in range(first, last):
                value = inputs[n, i]
                if value != 0.0:
                    for o in range(count):
                        outputs[n, o] += value * weight[i, o]
        if rectify:
            for n in range(first, last):
                for o in range(count):
                    outputs[n, o] = max(outputs[n, o], np.float32(0.0))
    return outputs
