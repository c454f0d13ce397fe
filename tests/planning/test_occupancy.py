"""What occupies each cell during erection, updated as parts are set and picked."""

from __future__ import annotations

from dataclasses import replace

import hypothesis.strategies as st
import numpy as np
import pytest
from box_sites import box_site
from hypothesis import given, settings
from scipy.ndimage import maximum_filter

from bimvox.grid.summed_area import summed_area_table, top_of_columns
from bimvox.planning.occupancy import Occupancy, highest_around

_BOX = st.tuples(*[st.integers(0, 5)] * 3, *[st.integers(1, 3)] * 3)


@pytest.mark.parametrize("one_at_a_time", [False, True])
@settings(max_examples=40, deadline=None)
@given(boxes=st.lists(_BOX, min_size=1, max_size=6), data=st.data())
def test_table_and_heights_are_those_of_the_objects_there(
    one_at_a_time: bool, boxes: list[tuple[int, ...]], data: st.DataObject
) -> None:
    site = replace(box_site([("a", (1, 1, 0), (3, 2, 1))]), blockers=())
    occupancy = Occupancy(site, one_at_a_time=one_at_a_time)
    dense = np.zeros(site.shape, np.int32)
    present: list[np.ndarray] = []
    for x, y, z, a, b, c in boxes:
        if present and data.draw(st.booleans()):
            cells, step = present.pop(data.draw(st.integers(0, len(present) - 1))), -1
            occupancy.remove(cells)
        else:
            cells, step = np.argwhere(np.ones((a, b, c), bool)).astype(np.int32) + np.array([x, y, z], np.int32), 1
            cells = cells[(cells < site.shape).all(axis=1)]
            if not len(cells):
                continue
            present.append(cells)
            occupancy.add(cells)
        dense[tuple(cells.T)] += step
        if data.draw(st.booleans()):
            assert np.array_equal(occupancy.space(site.components[0]).table, summed_area_table(dense > 0))
            assert np.array_equal(occupancy.heights(), top_of_columns(dense > 0))
    assert np.array_equal(occupancy.counts, dense)
    assert np.array_equal(occupancy.space(site.components[0]).table, summed_area_table(dense > 0))
    assert np.array_equal(occupancy.heights(), top_of_columns(dense > 0))


def test_the_highest_around_a_column_is_that_of_a_maximum_filter():
    rng = np.random.default_rng(3)
    for reach in (1, 2, 4):
        for shape in ((20, 30), (3, 7), (1, 1), (5, 2)):
            top = rng.integers(0, 60, shape).astype(np.int32)
            wanted = maximum_filter(top, size=2 * reach + 1, mode="constant")
            assert np.array_equal(highest_around(top, reach), wanted)
