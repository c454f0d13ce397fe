"""Which parts stand next to each other."""

import numpy as np
import pytest
from box_sites import box_site

from bimvox.site.component import OrderHints
from bimvox.site.site import parts_beside


def column(name, x_m, **more):
    return name, (x_m, 2.0, 0.0), (x_m + 0.5, 2.5, 3.0), more


@pytest.mark.parametrize("gap_m", [0.0, 2.5, 3.0])
def test_parts_as_far_apart_as_props_reach_stand_next_to_each_other(gap_m):
    site = box_site([column("one", 4.0), column("other", 4.5 + gap_m), column("far", 12.0 + gap_m)])
    near = parts_beside(site)
    assert near.tolist() == [[True, True, False], [True, True, False], [False, False, True]]
    assert np.array_equal(near, near.T)


@pytest.mark.parametrize(
    "more", [{"after": ("one",)}, {"before": ("one",)}, {"hints": OrderHints(connected=("one",))}], ids=str
)
def test_parts_with_a_given_order_or_connection_stand_next_to_each_other(more):
    site = box_site([column("one", 4.0), column("other", 14.0, **more), column("far", 24.0)])
    assert parts_beside(site).tolist() == [[True, True, False], [True, True, False], [False, False, True]]
