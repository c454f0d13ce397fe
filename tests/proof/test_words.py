"""Numbers in the sentences of a proof are those that people write."""

import numpy as np

from bimvox.proof.words import first_of


def test_the_first_number_or_cell_is_written_without_the_brackets_of_an_array():
    assert first_of(np.array([17, 18])) == "17"
    assert first_of(np.array([48.25])) == "48.25"
    assert first_of(np.array([[3, 4, 5], [6, 7, 8]], np.int32)) == "(3, 4, 5)"
    assert first_of(np.array([], np.int64)) == first_of(np.zeros((0, 3))) == ""
