"""The kernels of a gradient step: forward, Huber loss, back-propagation, clipping and Adam, over non-zero inputs."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import kernel, leaf_kernel
from bimvox.policy.learner.arrays import Batch, Inputs, Norm, Rule, Stream, Streams, Used, Variable
from bimvox.policy.perceptron import NORM_EPSILON

BETA_1, BETA_2, EPSILON = 0.9, 0.999, 1e-8
"""Adam's (Kingma and Ba 2015): the defaults of torch and of the original."""


@kernel
def set_targets(online: Streams, target: Streams, rule: Rule, batch: Batch) -> None:
    """Write ``batch.wanted``: what the values of the chosen actions should be, by the target network."""
    memory, rows, used = batch.memory, batch.rows, batch.used
    _find_used(memory.following, rows, used)
    _forward(target.actions, memory.following, rows, used)
    if rule.dueling:
        _forward(target.state, memory.following, rows, used)
    if rule.double_q:
        _forward(online.actions, memory.following, rows, used)
    last = len(online.actions.weights) - 1
    for b in range(rows.size):
        following = target.actions.outputs[last][b]
        chosen = online.actions.outputs[last][b].argmax() if rule.double_q else following.argmax()
        value = following[chosen]
        if rule.dueling:
            value += target.state.outputs[last][b, 0] - following.mean()
        row = rows[b]
        over = memory.ended[row] * (np.float32(1.0) - memory.truncated[row])
        batch.wanted[b] = memory.rewards[row] + (np.float32(1.0) - over) * rule.discount * value


@kernel
def descend(online: Streams, rule: Rule, batch: Batch, learning_rate: float, updates: int) -> None:
    """Change the weights by one step on the mean Huber loss, and write ``batch.errors``."""
    actions, state, dueling = online.actions, online.state, rule.dueling
    memory, rows, used, wanted, errors = batch.memory, batch.rows, batch.used, batch.wanted, batch.errors
    _find_used(memory.observations, rows, used)
    _find_rows(used)
    _forward(actions, memory.observations, rows, used)
    if dueling:
        _forward(state, memory.observations, rows, used)
    last = len(actions.weights) - 1
    for b in range(rows.size):
        values = actions.outputs[last][b]
        chosen = memory.actions[rows[b]]
        value = values[chosen]
        if dueling:
            value += state.outputs[last][b, 0] - values.mean()
        errors[b] = abs(value - wanted[b])
        slope = max(np.float32(-1.0), min(np.float32(1.0), value - wanted[b])) / np.float32(rows.size)
        slope *= batch.importance[b]
        share = slope / np.float32(values.size) if dueling else np.float32(0.0)
        for a in range(values.size):
            actions.slopes[last][b, a] = -share
        actions.slopes[last][b, chosen] += slope
        if dueling:
            state.slopes[last][b, 0] = slope
    _backward(actions, memory.observations, rows, used)
    _adam(actions, rule.longest, learning_rate, updates)
    if dueling:
        _backward(state, memory.observations, rows, used)
        _adam(state, rule.longest, learning_rate, updates)


@leaf_kernel
def _find_used(inputs: Inputs, rows: NDArray[np.int64], used: Used) -> None:
    """Find the inputs that are not zero, once for all layers that read them."""
    for b in range(rows.size):
        row = rows[b]
        count = 0
        for i in range(inputs.shape[1]):
            # Written in either case: a branch would be mispredicted too often.
            used.indices[b, count] = i
            count += 1 if inputs[row, i] != 0.0 else 0
        used.counts[b] = count


@leaf_kernel
def _find_rows(used: Used) -> None:
    """Find the inverse: for each input the rows in which it is not zero."""
    firsts = used.firsts
    firsts[:] = 0
    for b in range(used.counts.size):
        for n in range(used.counts[b]):
            firsts[used.indices[b, n] + 1] += 1
    for i in range(1, firsts.size):
        firsts[i] += firsts[i - 1]
    # Filling moves each start to the place of the next; afterwards they are moved back.
    for b in range(used.counts.size):
        for n in range(used.counts[b]):
            i = used.indices[b, n]
            used.rows[firsts[i]] = b
            firsts[i] += 1
    for i in range(firsts.size - 1, 0, -1):
        firsts[i] = firsts[i - 1]
    firsts[0] = 0


@kernel
def _forward(stream: Stream, inputs: Inputs, rows: NDArray[np.int64], used: Used) -> None:
    """Write the outputs of every layer for some rows of the inputs."""
    last = len(stream.weights) - 1
    weight, bias = stream.weights[0].values, stream.biases[0].values
    _forward_used(inputs, rows, used, weight, bias, stream.outputs[0])
    for layer in range(last + 1):
        if layer > 0:
            weight, bias = stream.weights[layer].values, stream.biases[layer].values
            _forward_layer(stream.outputs[layer - 1], weight, bias, stream.outputs[layer])
        if stream.norms[layer].units.shape[1] > 0:
            _normalise(stream.outputs[layer], stream.norms[layer])
        if layer < last:
            _rectify(stream.outputs[layer])


@leaf_kernel
def _forward_used(
    inputs: Inputs,
    rows: NDArray[np.int64],
    used: Used,
    weight: NDArray[np.float32],
    bias: NDArray[np.float32],
    out: NDArray[np.float32],
) -> None:
    width = out.shape[1]
    for b in range(rows.size):
        for o in range(width):
            out[b, o] = bias[0, o]
        row, indices, count = rows[b], used.indices[b], used.counts[b]
        whole = count - count % 4
        # Four inputs at a time, added in order: one at a time would read and write the sums four times as often.
        for n in range(0, whole, 4):
            i0, i1, i2, i3 = indices[n], indices[n + 1], indices[n + 2], indices[n + 3]
            v0, v1 = np.float32(inputs[row, i0]), np.float32(inputs[row, i1])
            v2, v3 = np.float32(inputs[row, i2]), np.float32(inputs[row, i3])
            for o in range(width):
                t = out[b, o] + v0 * weight[i0, o]
                t += v1 * weight[i1, o]
                t += v2 * weight[i2, o]
                out[b, o] = t + v3 * weight[i3, o]
        for n in range(whole, count):
            i = indices[n]
            value = np.float32(inputs[row, i])
            for o in range(width):
                out[b, o] += value * weight[i, o]


@leaf_kernel
def _forward_layer(
    source: NDArray[np.float32],
    weight: NDArray[np.float32],
    bias: NDArray[np.float32],
    out: NDArray[np.float32],
) -> None:
    width = out.shape[1]
    for b in range(source.shape[0]):
        for o in range(width):
            out[b, o] = bias[0, o]
        for i in range(source.shape[1]):
            value = source[b, i]
            if value != 0.0:
                for o in range(width):
                    out[b, o] += value * weight[i, o]


@leaf_kernel
def _normalise(out: NDArray[np.float32], norm: Norm) -> None:
    """Normalise the sums of every row in place, and remember what going back needs."""
    count = out.shape[1]
    for b in range(out.shape[0]):
        mean = np.float32(0.0)
        for o in range(count):
            mean += out[b, o]
        mean /= np.float32(count)
        variance = np.float32(0.0)
        for o in range(count):
            variance += (out[b, o] - mean) * (out[b, o] - mean)
        inverse = np.float32(1.0) / np.sqrt(variance / np.float32(count) + np.float32(NORM_EPSILON))
        norm.inverses[b] = inverse
        for o in range(count):
            unit = (out[b, o] - mean) * inverse
            norm.units[b, o] = unit
            out[b, o] = unit * norm.scale.values[0, o] + norm.shift.values[0, o]


@leaf_kernel
def _slopes_of_sums(slopes: NDArray[np.float32], norm: Norm) -> None:
    """Write the slopes of scale and shift, and turn those of the normalised values into those of the sums, in place."""
    count = slopes.shape[1]
    for o in range(count):
        norm.scale.slopes[0, o] = 0.0
        norm.shift.slopes[0, o] = 0.0
    for b in range(slopes.shape[0]):
        mean, along = np.float32(0.0), np.float32(0.0)
        for o in range(count):
            norm.scale.slopes[0, o] += slopes[b, o] * norm.units[b, o]
            norm.shift.slopes[0, o] += slopes[b, o]
            slopes[b, o] *= norm.scale.values[0, o]
            mean += slopes[b, o]
            along += slopes[b, o] * norm.units[b, o]
        mean /= np.float32(count)
        along /= np.float32(count)
        for o in range(count):
            slopes[b, o] = norm.inverses[b] * (slopes[b, o] - mean - norm.units[b, o] * along)


@leaf_kernel
def _rectify(out: NDArray[np.float32]) -> None:
    for b in range(out.shape[0]):
        for o in range(out.shape[1]):
            out[b, o] = max(out[b, o], np.float32(0.0))


@kernel
def _backward(stream: Stream, inputs: Inputs, rows: NDArray[np.int64], used: Used) -> None:
    """Write the slopes of all weights and biases from those of the last layer's outputs."""
    for layer in range(len(stream.weights) - 1, -1, -1):
        slopes, weight = stream.slopes[layer], stream.weights[layer]
        if stream.norms[layer].units.shape[1] > 0:
            _slopes_of_sums(slopes, stream.norms[layer])
        _clear_rows(weight.slopes, weight.reached)
        _sum_rows(slopes, stream.biases[layer].slopes)
        if layer == 0:
            _backward_used(inputs, rows, used, slopes, weight.slopes, weight.reached)
        else:
            source = stream.outputs[layer - 1]
            _backward_layer(source, slopes, weight.slopes, weight.reached)
            _slopes_below(slopes, weight.values, source, stream.slopes[layer - 1])


@leaf_kernel
def _sum_rows(slopes: NDArray[np.float32], out: NDArray[np.float32]) -> None:
    for o in range(out.shape[1]):
        out[0, o] = 0.0
    for b in range(slopes.shape[0]):
        for o in range(out.shape[1]):
            out[0, o] += slopes[b, o]


@leaf_kernel
def _backward_used(
    inputs: Inputs,
    rows: NDArray[np.int64],
    used: Used,
    slopes: NDArray[np.float32],
    weight_slopes: NDArray[np.float32],
    reached: NDArray[np.bool_],
) -> None:
    width = slopes.shape[1]
    for i in range(reached.size):
        first, last = used.firsts[i], used.firsts[i + 1]
        if first < last:
            reached[i] = True
        whole = last - (last - first) % 4
        for n in range(first, whole, 4):
            b0, b1, b2, b3 = used.rows[n], used.rows[n + 1], used.rows[n + 2], used.rows[n + 3]
            v0, v1 = np.float32(inputs[rows[b0], i]), np.float32(inputs[rows[b1], i])
            v2, v3 = np.float32(inputs[rows[b2], i]), np.float32(inputs[rows[b3], i])
            for o in range(width):
                t = weight_slopes[i, o] + v0 * slopes[b0, o]
                t += v1 * slopes[b1, o]
                t += v2 * slopes[b2, o]
                weight_slopes[i, o] = t + v3 * slopes[b3, o]
        for n in range(whole, last):
            b = used.rows[n]
            value = np.float32(inputs[rows[b], i])
            for o in range(width):
                weight_slopes[i, o] += value * slopes[b, o]


@leaf_kernel
def _backward_layer(
    source: NDArray[np.float32],
    slopes: NDArray[np.float32],
    weight_slopes: NDArray[np.float32],
    reached: NDArray[np.bool_],
) -> None:
    for b in range(source.shape[0]):
        for i in range(source.shape[1]):
            value = source[b, i]
            if value != 0.0:
                reached[i] = True
                for o in range(slopes.shape[1]):
                    weight_slopes[i, o] += value * slopes[b, o]


@leaf_kernel
def _clear_rows(slopes: NDArray[np.float32], reached: NDArray[np.bool_]) -> None:
    for i in range(slopes.shape[0]):
        if reached[i]:
            for o in range(slopes.shape[1]):
                slopes[i, o] = 0.0


@leaf_kernel
def _slopes_below(
    slopes: NDArray[np.float32], weight: NDArray[np.float32], rectified: NDArray[np.float32], out: NDArray[np.float32]
) -> None:
    width = slopes.shape[1]
    whole = width - width % 4
    for b in range(slopes.shape[0]):
        for i in range(rectified.shape[1]):
            out[b, i] = 0.0
            if rectified[b, i] > 0.0:
                # Four sums in parallel: a single one would wait for each addition.
                t0 = t1 = t2 = t3 = np.float32(0.0)
                for o in range(0, whole, 4):
                    t0 += slopes[b, o] * weight[i, o]
                    t1 += slopes[b, o + 1] * weight[i, o + 1]
                    t2 += slopes[b, o + 2] * weight[i, o + 2]
                    t3 += slopes[b, o + 3] * weight[i, o + 3]
                for o in range(whole, width):
                    t0 += slopes[b, o] * weight[i, o]
                out[b, i] = (t0 + t1) + (t2 + t3)


@kernel
def _adam(stream: Stream, longest: np.float32, learning_rate: float, updates: int) -> None:
    """Clip the slopes and change weights and biases by them."""
    rate = np.float32(learning_rate / (1.0 - BETA_1**updates))
    correction = np.float32(1.0 / np.sqrt(1.0 - BETA_2**updates))
    for layer in range(len(stream.weights)):
        _adam_variable(stream.weights[layer], longest, rate, correction)
        _adam_variable(stream.biases[layer], longest, rate, correction)
        if stream.norms[layer].units.shape[1] > 0:
            _adam_variable(stream.norms[layer].scale, longest, rate, correction)
            _adam_variable(stream.norms[layer].shift, longest, rate, correction)


@leaf_kernel
def _adam_variable(variable: Variable, longest: np.float32, rate: np.float32, correction: np.float32) -> None:
    values, slopes, means, squares, reached = variable
    one, beta_1, beta_2, epsilon = np.float32(1.0), np.float32(BETA_1), np.float32(BETA_2), np.float32(EPSILON)
    length = np.float32(0.0)
    for i in range(values.shape[0]):
        if reached[i]:
            for o in range(values.shape[1]):
                length += slopes[i, o] * slopes[i, o]
    length = np.sqrt(length)
    scale = longest / length if length > longest else one
    for i in range(values.shape[0]):
        if reached[i]:
            for o in range(values.shape[1]):
                slope = scale * slopes[i, o]
                means[i, o] += (one - beta_1) * (slope - means[i, o])
                squares[i, o] += (one - beta_2) * (slope * slope - squares[i, o])
                # np.divide, because Python's division checks every divisor for zero.
                values[i, o] -= np.divide(rate * means[i, o], np.sqrt(squares[i, o]) * correction + epsilon)
