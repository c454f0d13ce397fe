"""The arrays that the compiled steps of deep Q-learning share: streams in training, the memory, a batch of it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bimvox.policy.perceptron import Perceptron

Arrays = tuple[NDArray[np.float32], ...]
Inputs = NDArray[np.float32] | NDArray[np.uint8]


class StreamArrays(NamedTuple):
    """One stream in training, as a tuple for kernels. L layers; B rows of a batch.

    Attributes:
        weights: Per layer (inputs, outputs).
        biases: Per layer (1, outputs).
        outputs: Per layer (B, outputs), after the rectifier, except for the last.
        slopes: Per layer (B, outputs), of the loss with respect to the sum before the rectifier.
        weight_slopes: Per layer (inputs, outputs), of the loss.
        bias_slopes: Per layer (1, outputs).
        weight_means: First moments of Adam.
        bias_means: First moments of Adam.
        weight_squares: Second moments of Adam.
        bias_squares: Second moments of Adam.
        reached: Per layer (inputs,) bool, rows of weights that have had a gradient.
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
    """Remembered transitions, one per row.

    Attributes:
        observations: (M, inputs) float32, or uint8 if they are whole numbers.
        following: (M, inputs) of the same type, the observation after the action.
        actions: (M,) int64.
        rewards: (M,) float32.
        ended: (M,) float32, 1 if the episode ended.
        truncated: (M,) float32, 1 if it ended only because the steps were used up: its value goes on.
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
        counts: (B,) number of them in each row.
        indices: (B, inputs) their indices, the first ``counts`` of each row.
        firsts: (inputs + 1,) where the rows of each input start in ``rows``.
        rows: (B * inputs,) rows of the batch in which each input is not zero, ascending, input by input.
    """

    counts: NDArray[np.int64]
    indices: NDArray[np.int64]
    firsts: NDArray[np.int64]
    rows: NDArray[np.int64]


class Streams(NamedTuple):
    """The streams of a network; a network that is not dueling has its action stream twice."""

    actions: StreamArrays
    state: StreamArrays


class Rule(NamedTuple):
    """What stays the same in every gradient step.

    Attributes:
        dueling: Whether the state has a stream of its own.
        double_q: Whether the online network chooses the action that the target network values.
        discount: Per step.
        longest: Length to which the gradient of one variable is scaled down.
    """

    dueling: bool
    double_q: bool
    discount: np.float32
    longest: np.float32


class Batch(NamedTuple):
    """B transitions of a gradient step.

    Attributes:
        memory: Where they are.
        rows: (B,) int64 which.
        used: Their non-zero inputs, overwritten.
        wanted: (B,) float32 values that the chosen actions should have, overwritten.
        errors: (B,) float32 difference of the values before the step, overwritten.
    """

    memory: Memory
    rows: NDArray[np.int64]
    used: Used
    wanted: NDArray[np.float32]
    errors: NDArray[np.float32]


def used_room(batch_size: int, inputs: int) -> Used:
    """Return empty arrays for the inputs of a batch."""
    return Used(
        np.zeros(batch_size, np.int64),
        np.zeros((batch_size, inputs), np.int64),
        np.zeros(inputs + 1, np.int64),
        np.zeros(batch_size * inputs, np.int64),
    )


def perceptron_room(network: Perceptron, batch_size: int) -> StreamArrays:
    """Return a stream in training that begins with the weights of ``network``."""
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
