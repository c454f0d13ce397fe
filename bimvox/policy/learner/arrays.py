"""The arrays that the compiled gradient steps share: perceptrons in training, the memory, a batch of it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bimvox.policy.perceptron import Perceptron

Inputs = NDArray[np.float32] | NDArray[np.uint8]


class Variable(NamedTuple):
    """The weights or the biases of one layer in training. All arrays but ``reached`` have the shape of ``values``.

    Attributes:
        values: (inputs, outputs); (1, outputs) for biases.
        slopes: Of the loss.
        means: First moments of Adam.
        squares: Second moments of Adam.
        reached: (inputs,) bool, rows that have had a gradient; the others are skipped.
    """

    values: NDArray[np.float32]
    slopes: NDArray[np.float32]
    means: NDArray[np.float32]
    squares: NDArray[np.float32]
    reached: NDArray[np.bool_]


class Norm(NamedTuple):
    """Layer normalisation (Ba et al. 2016) of one layer in training. B rows of a batch.

    Attributes:
        scale: (1, outputs).
        shift: (1, outputs).
        units: (B, outputs), the sums with mean 0 and variance 1, before scale and shift.
        inverses: (B,) one over the standard deviation of the sums.
    """

    scale: Variable
    shift: Variable
    units: NDArray[np.float32]
    inverses: NDArray[np.float32]


class Stream(NamedTuple):
    """One perceptron in training, with an entry per layer. B rows of a batch.

    Attributes:
        weights: The weights.
        biases: The biases.
        norms: Layer normalisation of each layer; with no outputs if the layer is not normalised.
        outputs: (B, outputs), after the rectifier, except for the last.
        slopes: (B, outputs), of the loss with respect to the value before the rectifier.
    """

    weights: tuple[Variable, ...]
    biases: tuple[Variable, ...]
    norms: tuple[Norm, ...]
    outputs: tuple[NDArray[np.float32], ...]
    slopes: tuple[NDArray[np.float32], ...]


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
    """The perceptrons of a network; a network that is not dueling has its action stream twice."""

    actions: Stream
    state: Stream


class Rule(NamedTuple):
    """The choices that stay the same in every gradient step.

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
        importance: (B,) float32 weight of each transition in the loss.
    """

    memory: Memory
    rows: NDArray[np.int64]
    used: Used
    wanted: NDArray[np.float32]
    errors: NDArray[np.float32]
    importance: NDArray[np.float32]


def used_room(batch_size: int, inputs: int) -> Used:
    """Return empty arrays for the inputs of a batch."""
    return Used(
        np.zeros(batch_size, np.int64),
        np.zeros((batch_size, inputs), np.int64),
        np.zeros(inputs + 1, np.int64),
        np.zeros(batch_size * inputs, np.int64),
    )


def stream_of(network: Perceptron, batch_size: int) -> Stream:
    """Return a perceptron in training that begins with the weights of ``network``."""

    def outputs() -> tuple[NDArray[np.float32], ...]:
        return tuple(np.zeros((batch_size, bias.size), np.float32) for bias in network.biases)

    return Stream(
        tuple(_variable(weight, reached=False) for weight in network.weights),
        tuple(_variable(bias.reshape(1, -1), reached=True) for bias in network.biases),
        tuple(_norm(network, layer, batch_size) for layer in range(len(network.biases))),
        outputs(),
        outputs(),
    )


def _norm(network: Perceptron, layer: int, batch_size: int) -> Norm:
    nothing = np.zeros(0, np.float32)
    normalised = layer < len(network.scales)
    scale, shift = (network.scales[layer], network.shifts[layer]) if normalised else (nothing, nothing)
    return Norm(
        _variable(scale.reshape(1, -1), reached=True),
        _variable(shift.reshape(1, -1), reached=True),
        np.zeros((batch_size, scale.size), np.float32),
        np.zeros(batch_size, np.float32),
    )


def _variable(values: NDArray[np.float32], *, reached: bool) -> Variable:
    slopes, means, squares = (np.zeros(values.shape, np.float32) for _ in range(3))
    return Variable(np.array(values, np.float32, order="C"), slopes, means, squares, np.full(len(values), reached))
