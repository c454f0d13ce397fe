from math import pi

import numpy as np
import pytest
from box_sites import box_mesh

from bimvox.bim.building import TriangleMesh
from bimvox.site.lifting import assumed_points, usable_anchors

BEAM = box_mesh((0, 0, 0), (8, 0.4, 0.6))
PLATE = box_mesh((0, 0, 0), (8, 2, 0.2))


def test_a_beam_hangs_on_two_quarter_points_and_a_plate_on_four():
    assert assumed_points(BEAM, (4.0, 0.2), 0.75, upended=False) == ((2.0, 0.2, 0.6), (6.0, 0.2, 0.6))
    four = {(2.0, 0.5, 0.2), (2.0, 1.5, 0.2), (6.0, 0.5, 0.2), (6.0, 1.5, 0.2)}
    assert {tuple(np.round(point, 9)) for point in assumed_points(PLATE, (4.0, 1.0), 0.25, upended=False)} == four


def test_an_upended_part_and_a_small_one_hang_on_one_point():
    column = box_mesh((0, 0, 0), (0.3, 0.3, 3))
    assert assumed_points(column, (0.15, 0.15), 3.0, upended=True) == ((0.15, 0.15, 3.0),)
    assert assumed_points(BEAM, (4.0, 0.2), 0.75, upended=True) == ((4.0, 0.2, 0.75),)
    assert assumed_points(box_mesh((0, 0, 0), (1, 1, 3)), (0.5, 0.5), 3.0, upended=False) == ((0.5, 0.5, 3.0),)


def test_points_are_on_both_sides_of_the_centre_of_mass_at_the_same_distance():
    one, other = assumed_points(BEAM, (3.0, 0.2), 0.75, upended=False)
    assert (one[0], other[0]) == (1.5, 4.5)


@pytest.mark.parametrize("angle", [0.3, pi / 4, 2.0])
def test_a_turned_beam_hangs_on_points_of_its_own_axis(angle):
    cos, sin = np.cos(angle), np.sin(angle)
    turn = np.array([[cos, -sin, 0], [sin, cos, 0], [0, 0, 1]])
    turned = TriangleMesh(BEAM.vertices_m @ turn.T, BEAM.faces)
    hook = turn @ (4.0, 0.2, 0.0)
    found = assumed_points(turned, (hook[0], hook[1]), 0.75, upended=False)
    wanted = [turn @ (2.0, 0.2, 0.6), turn @ (6.0, 0.2, 0.6)]
    assert sorted(map(tuple, np.round(found, 6))) == sorted(map(tuple, np.round(wanted, 6)))


def test_a_sloping_part_hangs_on_points_of_its_surface():
    vertices = BEAM.vertices_m.copy()
    vertices[:, 2] += 0.5 * vertices[:, 0]
    points = assumed_points(TriangleMesh(vertices, BEAM.faces), (4.0, 0.2), 4.75, upended=False)
    assert [point[2] for point in points] == pytest.approx([1.6, 3.6])


def test_anchors_are_used_where_they_can_hold_the_part_level():
    pair = ((1.0, 0.2, 0.6), (7.0, 0.2, 0.6))
    assert usable_anchors(pair, (4.0, 0.2)) == pair
    assert usable_anchors((*pair, pair[0]), (4.0, 0.2)) == pair
    assert usable_anchors((), (4.0, 0.2)) == ()
    assert usable_anchors(((1.0, 0.2, 0.6), (2.0, 0.2, 0.6)), (4.0, 0.2)) == ()
    assert usable_anchors(((4.2, 0.2, 0.6),), (4.0, 0.2)) == ((4.2, 0.2, 0.6),)


def test_of_many_anchors_the_four_outermost_are_used():
    rows = tuple((x, y, 0.2) for x in (1.0, 3.0, 5.0, 7.0) for y in (0.5, 1.5))
    corners = {(1.0, 0.5, 0.2), (1.0, 1.5, 0.2), (7.0, 0.5, 0.2), (7.0, 1.5, 0.2)}
    assert set(usable_anchors(rows, (4.0, 1.0))) == corners
