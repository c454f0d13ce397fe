from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from bimvox.policy.sparse_layer import GROUP, NO_SUMS, sparse_layer, sums_of_groups


@given(
    st.integers(1, 3 * GROUP + 5),
    st.integers(1, 20),
    st.integers(1, 40),
    st.sampled_from([(0.9, 0.0), (0.0, 0.9), (0.4, 0.4), (0.0, 0.0), (1.0, 0.0)]),
    st.booleans(),
    st.integers(0, 2**32 - 1),
)
def test_it_is_the_product(inputs, outputs, rows, shares, rectify, seed):
    random = np.random.default_rng(seed)
    weight = random.standard_normal((inputs, outputs)).astype(np.float32)
    bias = random.standard_normal(outputs).astype(np.float32)
    values = random.uniform(-1, 1, (rows, inputs + 2)).astype(np.float32)
    drawn = random.random(values.shape)
    values[drawn < shares[0]] = 1.0
    values[drawn > 1.0 - shares[1]] = 0.0
    wanted = values[:, :inputs].astype(np.float64) @ weight + bias
    if rectify:
        wanted = np.maximum(wanted, 0.0)
    for sums in (sums_of_groups(weight), NO_SUMS):
        found = sparse_layer(values, weight, bias, sums, rectify)
        np.testing.assert_allclose(found, wanted, atol=2e-4)
        alone = np.concatenate([sparse_layer(values[n : n + 1], weight, bias, sums, rectify) for n in range(rows)])
        np.testing.assert_array_equal(alone, found)
