"""The gradient step of deep Q-learning, compiled for inputs that are mostly zero.

In the paper's map fewer than one number in a hundred is not zero, and the layers are small. Torch would spend most of a
step on multiplying by zero and on calls. Here zeros cost nothing, and rows of weights that no input has reached yet are
skipped, because their moments are zero. The results equal torch's except for rounding: Huber loss, back-propagation,
gradients clipped variable by variable, Adam.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import leaf_kernel
from bimvox.policy.learner.arrays import Batch, Memory, Norm, Rule, Stream, Streams, Variable, stream_of, used_room
from bimvox.policy.learner.kernels import descend, set_targets
from bimvox.policy.learner.network import ValueNetwork
from bimvox.policy.perceptron import Perceptron


class CompiledLearner:
    """A Q-network in training, and its target network.

    Args:
        network: Weights with which both begin.
        batch_size: B.
        learning_rate: Of Adam.
        discount: Per step.
        double_q: Whether the online network chooses what the target network values.
        longest: Length to which the gradient of one variable is scaled down.
    """

    def __init__(
        self,
        network: ValueNetwork,
        *,
        batch_size: int,
        learning_rate: float,
        discount: float,
        double_q: bool,
        longest: float,
    ) -> None:
        self._rule = Rule(network.state is not None, double_q, np.float32(discount), np.float32(longest))
        self._online = [stream_of(perceptron, batch_size) for perceptron in network.streams]
        self._target = [stream_of(perceptron, batch_size) for perceptron in network.streams]
        self.learning_rate = learning_rate
        """Of the next steps."""
        self._wanted = np.zeros(batch_size, np.float32)
        self.errors = np.zeros(batch_size, np.float32)
        """(B,) of the last step: difference of each row's value before the step."""
        self._equal = np.ones(batch_size, np.float32)
        self._used = used_room(batch_size, network.inputs)
        self._updates = 0
        self.live = _network(self._online)
        """The online network; its arrays change with every step."""
        self.target = _network(self._target)
        """The target network; its arrays change with every copy."""

    def step(self, memory: Memory, rows: NDArray[np.int64], importance: NDArray[np.float32] | None = None) -> None:
        """Take one gradient step on (B,) rows of the memory, with a (B,) weight each in the loss. None: all equal."""
        self._updates += 1
        online, target = Streams(self._online[0], self._online[-1]), Streams(self._target[0], self._target[-1])
        weights = self._equal if importance is None else importance
        batch = Batch(memory, rows, self._used, self._wanted, self.errors, weights)
        set_targets(online, target, self._rule, batch)
        descend(online, self._rule, batch, self.learning_rate, self._updates)

    def copy_to_target(self) -> None:
        """Make the target network equal to the online one."""
        for online, target in zip(self._online, self._target, strict=True):
            for mine, its in zip(_variables(online), _variables(target), strict=True):
                its.values[:] = mine.values

    def network(self) -> ValueNetwork:
        """Return a copy of the online network."""
        return copy_of(self.live)


def copy_of(network: ValueNetwork) -> ValueNetwork:
    """Return a network with arrays of its own."""
    return ValueNetwork(
        *(
            Perceptron(
                *(
                    tuple(array.copy() for array in arrays)
                    for arrays in (stream.weights, stream.biases, stream.scales, stream.shifts)
                )
            )
            for stream in network.streams
        )
    )


def move_towards(average: ValueNetwork, network: ValueNetwork, share: float) -> None:
    """Move the arrays of one network a share of the way to those of another."""
    for mine, its in zip(average.arrays().values(), network.arrays().values(), strict=True):
        _approach(mine.reshape(-1), its.reshape(-1), np.float32(share))


@leaf_kernel
def _approach(mine: NDArray[np.float32], its: NDArray[np.float32], share: np.float32) -> None:
    for n in range(mine.size):
        mine[n] += share * (its[n] - mine[n])


def _network(streams: list[Stream]) -> ValueNetwork:
    """Return views as a network."""
    return ValueNetwork(*(_perceptron(stream) for stream in streams))


def _perceptron(stream: Stream) -> Perceptron:
    norms = _normalised(stream)
    return Perceptron(
        tuple(w.values for w in stream.weights),
        tuple(b.values[0] for b in stream.biases),
        tuple(norm.scale.values[0] for norm in norms),
        tuple(norm.shift.values[0] for norm in norms),
    )


def _normalised(stream: Stream) -> list[Norm]:
    return [norm for norm in stream.norms if norm.scale.values.size]


def _variables(stream: Stream) -> list[Variable]:
    norms = _normalised(stream)
    return [*stream.weights, *stream.biases, *(norm.scale for norm in norms), *(norm.shift for norm in norms)]
