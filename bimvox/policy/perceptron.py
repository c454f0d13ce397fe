"""A multilayer perceptron from plain arrays.

Compiled with a fixed order of summation, so the outputs of a row do not depend on the other rows of the batch.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import kernel
from bimvox.errors import PolicyError, shown

_ROWS_AT_ONCE = 8

NORM_EPSILON = 1e-5
"""Added to the variance in layer normalisation: torch's default."""


@dataclass(frozen=True, slots=True, eq=False)
class Perceptron:
    """Layers with rectified linear units after each but the last.

    Attributes:
        weights: Per layer (inputs, outputs) float32, contiguous.
        biases: Per layer (outputs,) float32.
        scales: Per hidden layer (outputs,) float32 of layer normalisation (Ba et al. 2016), before the rectifier. Empty
            if the layers are not normalised.
        shifts: The same, added after the scale.
    """

    weights: tuple[NDArray[np.float32], ...]
    biases: tuple[NDArray[np.float32], ...]
    scales: tuple[NDArray[np.float32], ...] = ()
    shifts: tuple[NDArray[np.float32], ...] = ()

    @property
    def layer_sizes(self) -> tuple[int, ...]:
        """Widths from input to output."""
        return (self.weights[0].shape[0], *(w.shape[1] for w in self.weights))

    def __call__(self, observations: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return (N, outputs) float32 of (N, inputs) float32, row by row."""
        return self.outputs(np.ascontiguousarray(observations, np.float32))

    def outputs(self, inputs: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return (N, outputs) float32 of (N, inputs or more) contiguous float32; further columns are ignored."""
        values = inputs
        last = len(self.weights) - 1
        for layer, (weight, bias) in enumerate(zip(self.weights, self.biases, strict=True)):
            normalised = layer < len(self.scales)
            values = _layer(values, weight, bias, layer != last and not normalised)
            if normalised:
                _normalise(values, self.scales[layer], self.shifts[layer])
        return values

    def arrays(self) -> dict[str, NDArray[np.float32]]:
        """Return the arrays by name, as files store them."""
        named: dict[str, NDArray[np.float32]] = {}
        for layer, (weight, bias) in enumerate(zip(self.weights, self.biases, strict=True)):
            named[f"layer{layer}.weight"] = weight
            named[f"layer{layer}.bias"] = bias
        for layer, (scale, shift) in enumerate(zip(self.scales, self.shifts, strict=True)):
            named[f"layer{layer}.scale"] = scale
            named[f"layer{layer}.shift"] = shift
        return named


def layers_from_arrays(
    arrays: Mapping[str, NDArray[np.generic]], *, inputs: int | None, outputs: int
) -> tuple[tuple[NDArray[np.float32], ...], tuple[NDArray[np.float32], ...]]:
    """Return weights and biases from arrays named as by :meth:`Perceptron.arrays`.

    Args:
        arrays: The arrays.
        inputs: Width of the input. None accepts any.
        outputs: Width of the output.

    Raises:
        PolicyError: Names, types, shapes or values do not make such a perceptron.
    """
    layers = len(arrays) // 2
    if layers == 0 or set(arrays) != {f"layer{n}.{part}" for n in range(layers) for part in ("weight", "bias")}:
        raise PolicyError(
            f"the weights are named {sorted(arrays)}, not layer<n>.weight and layer<n>.bias",
            differs={"arrays": sorted(arrays)},
        )
    weights, biases = [], []
    width = len(np.atleast_1d(arrays["layer0.weight"])) if inputs is None else inputs
    for n in range(layers):
        weight, bias = arrays[f"layer{n}.weight"], arrays[f"layer{n}.bias"]
        if weight.dtype != np.float32 or bias.dtype != np.float32:
            raise PolicyError(f"layer {n} holds {weight.dtype} and {bias.dtype}, not float32")
        if weight.ndim != 2 or weight.shape[0] != width or bias.shape != weight.shape[1:]:
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
    if width != outputs:
        raise PolicyError(f"the network has {width} values, not {outputs}")
    return tuple(weights), tuple(biases)


def norms_from_arrays(
    arrays: Mapping[str, NDArray[np.generic]], *, hidden: Sequence[int]
) -> tuple[tuple[NDArray[np.float32], ...], tuple[NDArray[np.float32], ...]]:
    """Return scales and shifts of normalised layers from arrays named as by :meth:`Perceptron.arrays`.

    Args:
        arrays: Those of the names that end in ``scale`` and ``shift``; none if the layers are not normalised.
        hidden: Widths of the hidden layers.

    Raises:
        PolicyError: Names, types, shapes or values do not make such layers.
    """
    if not arrays:
        return (), ()
    pairs: list[tuple[NDArray[np.float32], ...]] = []
    for part in ("scale", "shift"):
        named = [arrays.get(f"layer{n}.{part}") for n in range(len(hidden))]
        pairs.append(
            tuple(
                np.require(array, np.float32, ["C", "W"])
                for array, width in zip(named, hidden, strict=True)
                if array is not None and array.dtype == np.float32 and array.shape == (width,)
                if np.isfinite(array).all()
            )
        )
    if len(arrays) != 2 * len(hidden) or any(len(kept) != len(hidden) for kept in pairs):
        raise PolicyError(
            f"the normalised layers {sorted(arrays)} do not fit hidden layers of {shown(hidden)} units",
            differs={"arrays": sorted(arrays)},
        )
    return pairs[0], pairs[1]


@kernel
def _layer(
    inputs: NDArray[np.float32], weight: NDArray[np.float32], bias: NDArray[np.float32], rectify: bool
) -> NDArray[np.float32]:
    """Return one layer's output. Inputs that are zero (mostly free cells) cost nothing.

    Reading the weights takes most of the time, so several rows share each of them.
    """
    rows, count = inputs.shape[0], weight.shape[1]
    outputs = np.empty((rows, count), np.float32)
    for first in range(0, rows, _ROWS_AT_ONCE):
        last = min(first + _ROWS_AT_ONCE, rows)
        for n in range(first, last):
            outputs[n] = bias
        for i in range(weight.shape[0]):  # further columns are ignored
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


@kernel
def _normalise(outputs: NDArray[np.float32], scale: NDArray[np.float32], shift: NDArray[np.float32]) -> None:
    """Normalise every row to mean 0 and variance 1, scale and shift it, and rectify it, in place."""
    rows, count = outputs.shape
    for n in range(rows):
        mean = np.float32(0.0)
        for o in range(count):
            mean += outputs[n, o]
        mean /= np.float32(count)
        variance = np.float32(0.0)
        for o in range(count):
            variance += (outputs[n, o] - mean) * (outputs[n, o] - mean)
        inverse = np.float32(1.0) / np.sqrt(variance / np.float32(count) + np.float32(NORM_EPSILON))
        for o in range(count):
            value = (outputs[n, o] - mean) * inverse * scale[o] + shift[o]
            outputs[n, o] = max(value, np.float32(0.0))
