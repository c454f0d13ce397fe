from __future__ import annotations

import tracemalloc

import numpy as np
from named_cranes import default_crane

from bimvox.crane.travel import Travel
from bimvox.planning.order.shared_order import whole_seconds


def test_travel_times_of_all_pairs_need_little_more_memory_than_they_have() -> None:
    travel = Travel(default_crane("hammerhead-75", (0.0, 0.0, 0.0), 40.0), 100.0)
    points_m = np.random.default_rng(0).uniform((5.0, -40.0, 0.0), (40.0, 40.0, 30.0), (2, 700, 3))
    start, end = (travel.axes_of(points) for points in points_m)
    tracemalloc.start()
    found = whole_seconds(travel, start, end)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    alone = [travel.between_s((start[0][i], start[1][i], start[2][i]), end) for i in range(700)]
    assert np.array_equal(found, np.round(alone))
    assert found.max() > found.min() > 0.0
    assert peak < 2.5 * found.nbytes
