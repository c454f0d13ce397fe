"""The gradient step of deep Q-learning, compiled: what torch would compute, for inputs that are mostly zero.

In the paper's map fewer than one number in a hundred is not zero, and the layers are small. Torch would spend most of a
step on multiplying by zero and on calls. Here zeros cost nothing, and rows of weights that no input has reached yet are
skipped, because their moments are zero. The results equal torch's except for rounding: Huber loss, back-propagation,
gradients clipped variable by variable, Adam.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import leaf_kernel
from bimvox.paper.policy.gradient_arrays import Batch, Memory, Rule, StreamArrays, Streams, perceptron_room, used_room
from bimvox.paper.policy.gradient_kernels import descend, set_targets
from bimvox.paper.policy.network import PaperNetwork
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
        network: PaperNetwork,
        *,
        batch_size: int,
        learning_rate: float,
        discount: float,
        double_q: bool,
        longest: float,
    ) -> None:
        self._rule = Rule(network.state is not None, double_q, np.float32(discount), np.float32(longest))
        self._online = [perceptron_room(stream, batch_size) for stream in _streams(network)]
        self._target = [perceptron_room(stream, batch_size) for stream in _streams(network)]
        self.learning_rate = learning_rate
        """Of the next steps."""
        self._wanted = np.zeros(batch_size, np.float32)
        self.errors = np.zeros(batch_size, np.float32)
        """(B,) of the last step: difference of each row's value before the step."""
        self._used = used_room(batch_size, network.inputs)
        self._updates = 0
        self.live = _network(self._online)
        """The online network; its arrays change with every step."""
        self.target = _network(self._target)
        """The target network; its arrays change with every copy."""

    def step(self, memory: Memory, rows: NDArray[np.int64]) -> None:
        """Take one gradient step on (B,) rows of the memory."""
        self._updates += 1
        online, target = Streams(self._online[0], self._online[-1]), Streams(self._target[0], self._target[-1])
        batch = Batch(memory, rows, self._used, self._wanted, self.errors)
        set_targets(online, target, self._rule, batch)
        descend(online, self._rule, batch, self.learning_rate, self._updates)

    def copy_to_target(self) -> None:
        """Make the target network equal to the online one."""
        for online, target in zip(self._online, self._target, strict=True):
            for mine, its in zip((*online.weights, *online.biases), (*target.weights, *target.biases), strict=True):
                its[:] = mine

    def network(self) -> PaperNetwork:
        """Return a copy of the online network."""
        return copy_of(self.live)


def copy_of(network: PaperNetwork) -> PaperNetwork:
    """Return a network with arrays of its own."""
    streams = [
        Perceptron(tuple(w.copy() for w in stream.weights), tuple(b.copy() for b in stream.biases))
        for stream in _streams(network)
    ]
    return PaperNetwork(streams[0], streams[1] if len(streams) > 1 else None)


def move_towards(average: PaperNetwork, network: PaperNetwork, share: float) -> None:
    """Move the arrays of one network a share of the way to those of another."""
    for mine, its in zip(average.arrays().values(), network.arrays().values(), strict=True):
        _approach(mine.reshape(-1), its.reshape(-1), np.float32(share))


@leaf_kernel
def _approach(mine: NDArray[np.float32], its: NDArray[np.float32], share: np.float32) -> None:
    for n in range(mine.size):
        mine[n] += share * (its[n] - mine[n])


def _streams(network: PaperNetwork) -> list[Perceptron]:
    return [network.actions] if network.state is None else [network.actions, network.state]


def _network(streams: list[StreamArrays]) -> PaperNetwork:
    """Return views as a network."""
    parts = [Perceptron(stream.weights, tuple(bias[0] for bias in stream.biases)) for stream in streams]
    return PaperNetwork(parts[0], parts[1] if len(parts) > 1 else None)
