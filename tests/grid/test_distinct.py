"""Distinct integers: the same result as numpy."""

import numpy as np
import pytest

from bimvox.grid.distinct import distinct


@pytest.mark.parametrize("values", [[], [3], [3, 3], [5, -1, 5, 2, -1], list(range(50, 0, -1)) * 2])
@pytest.mark.parametrize("kind", [np.int32, np.int64])
def test_they_are_those_of_numpy(values, kind):
    given = np.array(values, kind)
    before = given.copy()
    found = distinct(given)
    assert found.dtype == kind
    assert np.array_equal(found, np.unique(before))
    assert np.array_equal(given, before)
