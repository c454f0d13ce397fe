"""One layer of a perceptron whose inputs are mostly 0 or 1.

Reading the weights takes most of the time of a decision, so inputs are processed in groups. If a group holds more ones
than zeros (blocked windows), it starts from the sum of its weights, and only inputs that differ from 1 are computed;
otherwise those that differ from 0. Of the inputs of real lifts, half are 1 and a fifth are 0; a third is left to
compute.

The order of summation depends on the row alone, so the values of a lift do not depend on the other lifts of the batch.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import kernel, leaf_kernel

GROUP = 128
"""Inputs of a group."""

NO_SUMS = np.zeros((0, 0), np.float32)
"""For layers after rectified linear units, whose inputs are 0 or any positive number."""

_ROWS_AT_ONCE = 16
"""Rows that share a group's weights while these are in the processor's cache."""

_TERMS = 8
"""Inputs added in one pass over the outputs."""


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
