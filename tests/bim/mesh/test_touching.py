from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from bimvox.bim.mesh.bodies import touching_groups
from bimvox.bim.mesh.repair import connected_labels


@given(st.integers(0, 2**32 - 1), st.integers(1, 40))
@settings(max_examples=50, deadline=None)
def test_groups_are_those_of_all_pairs_of_boxes(seed: int, count: int) -> None:
    rng = np.random.default_rng(seed)
    low = rng.integers(0, 12, (count, 3)).astype(np.float64)
    high = low + rng.integers(0, 4, (count, 3))
    touch = ((low[:, None] <= high[None]) & (high[:, None] >= low[None])).all(axis=2)
    assert touching_groups(low, high).tolist() == connected_labels(count, *np.nonzero(touch)).tolist()
