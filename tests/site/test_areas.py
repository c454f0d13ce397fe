import numpy as np
import shapely
from hypothesis import assume, given
from hypothesis import strategies as st

from bimvox.grid.frame import GridFrame
from bimvox.site.areas import columns_centred_in, columns_met_by, columns_met_by_each

FRAME = GridFrame((-1.0, 2.0, -0.5), 0.5)
SHAPE = (12, 9)


def rectangle(x0, y0, x1, y1):
    return ((x0, y0), (x1, y0), (x1, y1), (x0, y1))


@given(st.floats(-2, 6), st.floats(1, 7), st.floats(0.1, 4), st.floats(0.1, 4))
def test_a_column_belongs_where_its_centre_is(x, y, width, depth):
    inside = columns_centred_in([rectangle(x, y, x + width, y + depth)], FRAME, SHAPE)
    centres = FRAME.centre_of([(i, j, 0) for i, j in np.ndindex(SHAPE)])
    expected = (centres[:, 0] > x) & (centres[:, 0] < x + width) & (centres[:, 1] > y) & (centres[:, 1] < y + depth)
    assert inside.ravel().tolist() == expected.tolist()


def test_a_zone_takes_every_column_that_it_meets_but_none_along_its_edge():
    on_borders = columns_met_by([rectangle(-0.5, 2.5, 0.5, 3.0)], FRAME, SHAPE)
    assert np.argwhere(on_borders).tolist() == [[1, 1], [2, 1]]
    thin = columns_met_by([rectangle(0.6, 2.6, 0.7, 2.7)], FRAME, SHAPE)
    assert np.argwhere(thin).tolist() == [[3, 1]]
    assert not columns_centred_in([rectangle(0.6, 2.6, 0.7, 2.7)], FRAME, SHAPE).any()


def test_polygons_add_up_and_may_be_of_any_shape():
    corner = ((-1.0, 2.0), (1.0, 2.0), (1.0, 2.5), (-0.5, 2.5), (-0.5, 4.0), (-1.0, 4.0))
    both = columns_centred_in([corner, rectangle(4.0, 4.0, 4.5, 4.5)], FRAME, SHAPE)
    cells = [[0, 0], [0, 1], [0, 2], [0, 3], [1, 0], [2, 0], [3, 0], [10, 4]]
    assert np.argwhere(both).tolist() == cells
    assert not columns_centred_in([], FRAME, SHAPE).any()


@given(st.lists(st.tuples(st.floats(-3, 30), st.floats(-3, 30)), min_size=3, max_size=9, unique=True))
def test_columns_tested_by_blocks_are_those_that_meet_the_polygon(points):
    shape = (37, 21)
    polygon = shapely.convex_hull(shapely.MultiPoint(points))
    assume(polygon.geom_type == "Polygon")
    corners = list(polygon.exterior.coords)
    (met,) = columns_met_by_each([corners], FRAME, shape)
    for i, j in np.ndindex(shape):
        x, y, _ = FRAME.corner_of((i, j, 0))
        square = shapely.box(x + 1e-4, y + 1e-4, x + 0.5 - 1e-4, y + 0.5 - 1e-4)
        assert met[i, j] == polygon.intersects(square)


def test_a_thousand_large_zones_take_a_moment():
    """The time of a test machine varies, so this counts the columns that are tested one by one."""
    tested = []

    def intersects(polygon, squares):
        tested.append(np.size(squares))
        return real(polygon, squares)

    real, shapely.intersects = shapely.intersects, intersects
    try:
        list(columns_met_by_each([rectangle(0.0, 3.0, 90.0, 95.0)] * 10, FRAME, (200, 200)))
    finally:
        shapely.intersects = real
    assert sum(tested) < 10 * 200 * 200 / 4
