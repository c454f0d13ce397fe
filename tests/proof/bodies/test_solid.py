"""Corners at the same place have the same number."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from bimvox.bim.building import TriangleMesh
from bimvox.proof.bodies.solid import corner_numbers, point_numbers

COORDINATES = st.sampled_from([-1.5, -0.0, 0.0, 0.1, 2.0])


@given(st.lists(st.tuples(COORDINATES, COORDINATES, COORDINATES), max_size=12))
def test_points_are_numbered_in_the_order_of_their_coordinates(points):
    points = np.array(points).reshape(-1, 3)
    wanted = np.unique(points + 0.0, axis=0, return_inverse=True)[1]
    assert point_numbers(points).tolist() == wanted.reshape(-1).tolist()


def test_corners_that_rounding_parts_have_the_same_number():
    spots = [
        (0.0, 0.0, 0.0),
        (1.0, 0.0, 0.0),
        (0.0, 1.0, 0.0),
        (1.0 + 1e-9, 0.0, 0.0),
        (0.0, 1.0, 1e-9),
        (1.0, 1.0, 0.0),
    ]
    numbers = corner_numbers(TriangleMesh(np.array(spots), np.array([(0, 1, 2), (3, 5, 4)], np.int32)))
    assert numbers.tolist() == [[0, 2, 1], [2, 3, 1]]
