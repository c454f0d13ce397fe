from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from bimvox.voxelization.bits import empty_plane, has, lowest, pack, population, set_run, stretch, unpack


@settings(deadline=None)
@given(st.integers(1, 2**64 - 1))
def test_lowest_and_population_are_those_of_the_binary_number(word: int) -> None:
    assert lowest(np.uint64(word)) == (word & -word).bit_length() - 1
    assert population(np.uint64(word)) == word.bit_count()


@settings(deadline=None)
@given(st.integers(0, 63), st.integers(1, 64))
def test_a_stretch_has_its_bits(first: int, length: int) -> None:
    stop = min(first + length, 64)
    assert int(stretch(first, stop)) == (1 << stop) - (1 << first)


@settings(deadline=None)
@given(st.integers(1, 200), st.data())
def test_a_run_sets_its_cells(height: int, data: st.DataObject) -> None:
    first = data.draw(st.integers(0, height - 1))
    last = data.draw(st.integers(first, height - 1))
    plane = empty_plane(2, 3, height)
    set_run(plane, 1, 2, first, last)
    expected = np.zeros((2, 3, height), bool)
    expected[1, 2, first : last + 1] = True
    np.testing.assert_array_equal(unpack(plane, height), expected)
    assert has(plane, 1, 2, first)
    assert not has(plane, 0, 2, first)


def test_packing_is_undone_by_unpacking() -> None:
    rng = np.random.default_rng(0)
    for height in (1, 63, 64, 65, 130):
        cells = rng.random((3, 4, height)) < 0.4
        np.testing.assert_array_equal(unpack(pack(cells), height), cells)
