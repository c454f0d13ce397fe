"""Where a crane may be, for its separation from others."""

import numpy as np
from two_cranes import two_crane_site

from bimvox.crane.conflict import SPAN_NS
from bimvox.cranes.lift import approach_track, standing_track
from bimvox.records.motion import Trajectory


def test_a_crane_that_stands_is_where_one_is_whose_hook_does_not_move():
    site = two_crane_site()
    axes = np.array([0.7, 12.0, 9.0])
    slew, radius, height = (np.repeat(axis, 2) for axis in axes)
    still = Trajectory(np.array([0, SPAN_NS]), slew, radius, height, np.zeros(0, np.int64), 0.0)
    for crane in site.cranes:
        moving, standing = approach_track(site, crane, still, 0), standing_track(site, crane, axes)
        assert np.array_equal(standing.spans, moving.spans)
        assert np.array_equal(standing.first, moving.first)
        assert np.array_equal(standing.last, moving.last)
        assert standing.start_ns == moving.start_ns
