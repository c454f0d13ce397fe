from dataclasses import replace
from math import atan2, hypot, pi

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from named_cranes import default_crane

from bimvox.crane.reach import HOOK_FORBIDDEN, hook_floor, hook_top
from bimvox.crane.working_range import WorkingRange, columns_in_range
from bimvox.errors import InputError
from bimvox.grid.frame import GridFrame

FRAME = GridFrame((-20.0, -20.0, -0.5), 0.5)
COLUMNS = (80, 80)


@example(2.1895463772853665, 2 * pi, 0.0, 1.0)
@example(0.75, 6.25, 0.0, 6.0)  # the sector without slewing is narrower than a column
@given(st.floats(-pi, pi), st.floats(0.3, 2 * pi), st.floats(0.0, 8.0), st.floats(1.0, 12.0))
def test_a_column_in_range_has_all_its_points_in_range(first, width, near, depth):
    given_range = WorkingRange((first, first + width), (near, near + depth))
    inside = columns_in_range(given_range, (0.3, -0.2, 0.0), FRAME.origin_m, 0.5, COLUMNS)
    for i, j in np.argwhere(inside)[::17]:
        for u, v in ((0.0, 0.0), (1.0, 1.0), (0.5, 0.0), (0.2, 0.9)):
            x, y = -20.0 + 0.5 * (i + u) - 0.3, -20.0 + 0.5 * (j + v) + 0.2
            # A chord between two corners is nearer to the axis than the corners, but by no more than its sag.
            assert near - 0.5 <= hypot(x, y) <= near + depth + 1e-6
            if hypot(x, y) > 1.0:
                turned = (atan2(y, x) - first) % (2 * pi)
                assert turned <= width + 1e-6 or turned >= 2 * pi - 1e-6


def test_the_limiter_is_in_the_map_of_the_hook():
    crane = replace(default_crane("hammerhead-30"), working_range=WorkingRange((0.0, pi), (5.0, 15.0), 12.0))
    floor = hook_floor(crane, FRAME, np.zeros(COLUMNS, np.int32), 100.0, rope=True)
    allowed = np.argwhere(floor != HOOK_FORBIDDEN) * 0.5 - 20.0
    assert len(allowed)
    assert allowed[:, 1].min() >= -1e-9
    top = hook_top(crane, FRAME, (*COLUMNS, 60))
    # The hook at 12 m minus slings of 2.5 m: the top of the load is at 9.5 m, 20 cells above the underside of the slab.
    assert (top == 20).all()
    assert hook_top(crane, FRAME, (*COLUMNS, 20)).size == 0


def test_empty_ranges_are_refused():
    for bad in ({"slew_rad": (1.0, 1.0)}, {"slew_rad": (0.0, 7.0)}, {"radius_m": (5.0, 4.0)}):
        with pytest.raises(InputError):
            WorkingRange(**bad)
