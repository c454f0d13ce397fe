"""The arrays of deep Q-learning that its compiled steps share: a stream in training, the memory, what is not zero."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bimvox.policy.perceptron import Perceptron

Arrays = tuple[NDArray[np.float32], ...]
Inputs = NDArray[np.float32] | NDArray[np.uint8]


class StreamArrays(NamedTuple):
    """One stream in training; a plain tuple, so that kernels take it. L layers; B rows of a batch.

    Attributes:
        weights: Per layer (inputs, outputs).
        biases: Per layer (1, outputs).
        outputs: Per layer (B, outputs), after the rectifier but for the last.
        slopes: Per layer (B, outputs), of the loss by the sum before the rectifier.
        weight_slopes: Per layer (inputs, outputs), of the loss.
        bias_slopes: Per layer (1, outputs).
        weight_means: First moments of Adam.
        bias_means: First moments of Adam.
        weight_squares: Second moments of Adam.
        bias_squares: Second moments of Adam.
        reached: Per layer (inputs,) bool, rows of weights that had a gradient at some time.
    """

    weights: Arrays
    biases: Arrays
    outputs: Arrays
    slopes: Arrays
    weight_slopes: Arrays
    bias_slopes: Arrays
    weight_means: Arrays
    bias_means: Arrays
    weight_squares: Arrays
    bias_squares: Arrays
    reached: tuple[NDArray[np.bool_], ...]


class Memory(NamedTuple):
    """Transitions remembered, one a row.

    Attributes:
        observations: (M, inputs) float32, or uint8 where they are whole numbers.
        following: (M, inputs) of the same type, observation after the action.
        actions: (M,) int64.
        rewards: (M,) float32.
        ended: (M,) float32, 1 where the episode ended.
        truncated: (M,) float32, 1 where it ended only for want of steps: its value goes on.
    """

    observations: Inputs
    following: Inputs
    actions: NDArray[np.int64]
    rewards: NDArray[np.float32]
    ended: NDArray[np.float32]
    truncated: NDArray[np.float32]


class Used(NamedTuple):
    """Which inputs of a batch are not zero.

    Attributes:
        counts: (B,) how many of each row.
        indices: (B, inputs) those, the first ``counts`` of each row.
        firsts: (inputs + 1,) where the rows of each input begin in ``rows``.
        rows: (B * inputs,) rows of the batch in which each input is not zero, ascending, input by input.
    """

    counts: NDArray[np.int64]
    indices: NDArray[np.int64]
    firsts: NDArray[np.int64]
    rows: NDArray[np.int64]


def used_room(batch_size: int, inputs: int) -> Used:
    """Return arrays for the inputs of a batch."""
    return Used(
        np.zeros(batch_size, np.int64),
        np.zeros((batch_size, inputs), np.int64),
        np.zeros(inputs + 1, np.int64),
        np.zeros(batch_size * inputs, np.int64),
    )


def perceptron_room(network: Perceptron, batch_size: int) -> StreamArrays:
    """Return a stream in training that begins as ``network`` is."""
    weights = tuple(np.ascontiguousarray(weight).copy() for weight in network.weights)
    biases = tuple(bias.reshape(1, -1).copy() for bias in network.biases)

    def zeros(arrays: Arrays) -> Arrays:
        return tuple(np.zeros_like(array) for array in arrays)

    def rows() -> Arrays:
        return tuple(np.zeros((batch_size, bias.shape[1]), np.float32) for bias in biases)

    return StreamArrays(
        weights,
        biases,
        rows(),
        rows(),
        zeros(weights),
        zeros(biases),
        zeros(weights),
        zeros(biases),
        zeros(weights),
        zeros(biases),
        tuple(np.zeros(len(weight), np.bool_) for weight in weights),
    )
