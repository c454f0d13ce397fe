"""The Q-network of a policy, evaluated from plain arrays, without torch.

The inputs of the first layer are mostly 0 or 1. Reading the weights takes most of the time of a decision, so inputs are
processed in groups. If a group holds more ones than zeros (blocked windows), it starts from the sum of its weights, and
only inputs that differ from 1 are computed; otherwise those that differ from 0. Of the inputs of real lifts, half are 1
and a fifth are 0; a third is left to compute.

The order of summation depends on the row alone, so the values of a lift do not depend on the other lifts of the batch.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import kernel, leaf_kernel
from bimvox.env.actions import ACTION_COUNT
from bimvox.env.observation import FRAME_ACTIONS, FRAME_COUNT, INPUT_SIZE, VIEW_SIZE
from bimvox.errors import PolicyError

GROUP = 128
"""Inputs of a group."""

NO_SUMS = np.zeros((0, 0), np.float32)
"""For layers after rectified linear units, whose inputs are 0 or any positive number."""

_ROWS_AT_ONCE = 16
"""Rows that share a group's weights while these are in the processor's cache."""

_TERMS = 8
"""Inputs added in one pass over the outputs."""


@dataclass(frozen=True, slots=True, eq=False)
class QNetwork:
    """Values of the six actions for an observation: a perceptron. Its arrays must not change.

    Rectified linear units follow each layer but the last. A network of bimvox takes ``INPUT_SIZE`` of the observation's
    ``VIEW_SIZE`` entries and gives values in the view's frame. One of a stock learner takes the whole observation, as
    ``Lift-v0`` gives it, and gives values of the site's actions.

    Attributes:
        weights: Per layer (inputs, outputs) float32, contiguous.
        biases: Per layer (outputs,) float32.
    """

    weights: tuple[NDArray[np.float32], ...]
    biases: tuple[NDArray[np.float32], ...]
    _sums: NDArray[np.float32] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        """Fold the first layer's weights."""
        object.__setattr__(self, "_sums", sums_of_groups(self.weights[0]))

    @property
    def is_framed(self) -> bool:
        """Whether its values are those of the frame's actions, not of the site's."""
        return bool(self.weights[0].shape[0] == INPUT_SIZE)

    def equals(self, other: QNetwork) -> bool:
        """Return whether another network has the same arrays."""
        mine, others = (*self.weights, *self.biases), (*other.weights, *other.biases)
        return len(mine) == len(others) and all(np.array_equal(a, b) for a, b in zip(mine, others, strict=True))

    @property
    def layer_sizes(self) -> tuple[int, ...]:
        """Widths from input to output."""
        return (self.weights[0].shape[0], *(w.shape[1] for w in self.weights))

    def arrays(self) -> dict[str, NDArray[np.float32]]:
        """Return the arrays by name, as files store them."""
        named: dict[str, NDArray[np.float32]] = {}
        for layer, (weight, bias) in enumerate(zip(self.weights, self.biases, strict=True)):
            named[f"layer{layer}.weight"] = weight
            named[f"layer{layer}.bias"] = bias
        return named

    def outputs(self, inputs: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return (N, 6) values of its last layer; columns after the inputs are ignored."""
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
        values = self.outputs(views)
        return _on_site(values, views, FRAME_ACTIONS) if self.is_framed else values


def network_from_arrays(arrays: Mapping[str, NDArray[np.generic]]) -> QNetwork:
    """Return the network of arrays named as by :meth:`QNetwork.arrays`.

    Raises:
        PolicyError: Names, types, shapes or values do not make a network for this version's observation and actions.
    """
    layers = len(arrays) // 2
    if layers == 0 or set(arrays) != {f"layer{n}.{part}" for n in range(layers) for part in ("weight", "bias")}:
        raise PolicyError(
            f"the weights are named {sorted(arrays)}, not layer<n>.weight and layer<n>.bias",
            differs={"arrays": sorted(arrays)},
        )
    weights, biases = [], []
    width = _inputs_of(arrays["layer0.weight"])
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
    if width != ACTION_COUNT:
        raise PolicyError(f"the network has {width} values, not {ACTION_COUNT}")
    return QNetwork(tuple(weights), tuple(biases))


def _inputs_of(weight: NDArray[np.generic]) -> int:
    """Return how many inputs the first layer takes.

    Raises PolicyError: it takes neither the observation nor the observation without its frame.
    """
    if weight.ndim == 2 and weight.shape[0] in (INPUT_SIZE, VIEW_SIZE):
        return int(weight.shape[0])
    raise PolicyError(
        f"the first layer has the shape {weight.shape}; an observation has {VIEW_SIZE:,} numbers",
        differs={"layer0.weight": weight.shape, "observation_size": VIEW_SIZE},
        hint="train a policy with this version of bimvox",
    )


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


def sums_of_groups(weight: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return the sum of each group's weights, (groups, outputs) of (inputs, outputs): a group's output for ones."""
    starts = np.arange(0, weight.shape[0], GROUP)
    return np.add.reduceat(weight, starts, axis=0, dtype=np.float64).astype(np.float32)


@kernel
def sparse_layer(
    inputs: NDArray[np.float32],
    weight: NDArray[np.float32],
    bias: NDArray[np.float32],
    sums: NDArray[np.float32],
    rectify: bool,
) -> NDArray[np.float32]:
    """Return a layer's output.

    Args:
        inputs: (N, inputs or more); further columns are ignored.
        weight: (inputs, outputs).
        bias: (outputs,).
        sums: Of :func:`sums_of_groups`, or ``NO_SUMS``.
        rectify: Whether rectified linear units follow.
    """
    rows, count = inputs.shape[0], weight.shape[1]
    outputs = np.empty((rows, count), np.float32)
    which = np.empty(GROUP + _TERMS, np.int64)
    value = np.empty(GROUP + _TERMS, np.float32)
    zero, one = np.float32(0.0), np.float32(1.0)
    for first in range(0, rows, _ROWS_AT_ONCE):
        last = min(first + _ROWS_AT_ONCE, rows)
        for n in range(first, last):
            for o in range(count):
                outputs[n, o] = bias[o]
        for low in range(0, weight.shape[0], GROUP):
            high = min(low + GROUP, weight.shape[0])
            for n in range(first, last):
                base = zero
                if sums.shape[0] > 0 and _more_ones(inputs[n], low, high):
                    base = one
                    for o in range(count):
                        outputs[n, o] += sums[low // GROUP, o]
                terms = 0
                for i in range(low, high):
                    which[terms] = i
                    value[terms] = inputs[n, i] - base
                    terms += value[terms] != zero
                _add(weight, which, value, terms, outputs[n])
        if rectify:
            for n in range(first, last):
                for o in range(count):
                    outputs[n, o] = max(outputs[n, o], zero)
    return outputs


@leaf_kernel
def _more_ones(row: NDArray[np.float32], low: int, high: int) -> bool:
    ones, zeros = 0, 0
    for i in range(low, high):
        ones += row[i] == np.float32(1.0)
        zeros += row[i] == np.float32(0.0)
    return ones > zeros


@leaf_kernel
def _add(
    weight: NDArray[np.float32],
    which: NDArray[np.int64],
    value: NDArray[np.float32],
    terms: int,
    out: NDArray[np.float32],
) -> None:
    """Add values times their weights, eight at a time; the last pass is filled with zeros."""
    for term in range(terms, terms + _TERMS - 1):
        which[term] = 0
        value[term] = np.float32(0.0)
    for t in range(0, terms, _TERMS):
        a, b, c, d = weight[which[t]], weight[which[t + 1]], weight[which[t + 2]], weight[which[t + 3]]
        e, f, g, h = weight[which[t + 4]], weight[which[t + 5]], weight[which[t + 6]], weight[which[t + 7]]
        va, vb, vc, vd = value[t], value[t + 1], value[t + 2], value[t + 3]
        ve, vf, vg, vh = value[t + 4], value[t + 5], value[t + 6], value[t + 7]
        for o in range(out.shape[0]):
            near = (va * a[o] + vb * b[o]) + (vc * c[o] + vd * d[o])
            out[o] += near + ((ve * e[o] + vf * f[o]) + (vg * g[o] + vh * h[o]))
