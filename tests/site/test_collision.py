import numpy as np
from box_sites import box_site
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from bimvox.grid.summed_area import summed_area_table
from bimvox.planning.occupancy import Occupancy
from bimvox.site.collision import (
    HOOK_FORBIDDEN,
    NOTHING_CLEARED,
    CollisionSpace,
    boxes_are_free,
    grown_cells,
    hook_is_free,
    in_transit,
    margin_vox,
    placement_is_free,
)
from bimvox.site.component import shape_of
from bimvox.site.site import Rules

GRID = (5, 4, 6)
shapes = st.lists(
    st.tuples(st.integers(0, 2), st.integers(0, 2), st.integers(0, 2)), min_size=1, max_size=8, unique=True
)
floors = arrays(np.int32, GRID[:2], elements=st.sampled_from([0, 1, 3, 5, int(HOOK_FORBIDDEN)]))


def brute_boxes(occupied, cells, at):
    where = cells + np.array(at)
    if (where < 0).any() or (where >= GRID).any():
        return False
    return not occupied[tuple(where.T)].any()


def brute_hook(floor, offset, at):
    x, y, z = np.array(at) + offset
    return bool(0 <= x < GRID[0] and 0 <= y < GRID[1] and floor[x, y] != HOOK_FORBIDDEN and z >= floor[x, y])


@given(
    arrays(np.bool_, GRID, elements=st.sampled_from([False, False, False, True])),
    shapes,
    floors,
    st.tuples(st.integers(0, 2), st.integers(0, 2), st.integers(1, 3)),
    arrays(np.bool_, (2, 2, 2)),
    st.tuples(st.integers(-1, 4), st.integers(-1, 3), st.integers(-1, 5)),
)
@settings(deadline=None, max_examples=40)
def test_agrees_with_cell_by_cell_checks_everywhere(occupied, cells, floor, offset, cleared, cleared_low):
    shape, _ = shape_of(cells)
    hook = np.array(offset, np.int32)
    space = CollisionSpace(
        summed_area_table(occupied), shape.boxes, hook, floor, np.array(cleared_low, np.int32), cleared
    )
    for at in np.ndindex(*(n + 4 for n in GRID)):
        x, y, z = (n - 2 for n in at)
        boxes, line = brute_boxes(occupied, shape.cells, (x, y, z)), brute_hook(floor, hook, (x, y, z))
        assert boxes_are_free(space, x, y, z) == boxes
        assert hook_is_free(space, x, y, z) == line
        inside = np.array([x, y, z]) - cleared_low
        exempt = bool((inside >= 0).all() and (inside < 2).all() and cleared[tuple(inside)])
        assert placement_is_free(space, x, y, z) == (exempt or (boxes and line))


def test_nothing_cleared_exempts_nothing():
    occupied = np.ones(GRID, bool)
    shape, _ = shape_of([(0, 0, 0)])
    space = CollisionSpace(
        summed_area_table(occupied), shape.boxes, np.array([0, 0, 1], np.int32), np.zeros(GRID[:2], np.int32),
        *NOTHING_CLEARED,
    )  # fmt: skip
    assert not any(placement_is_free(space, *at) for at in np.ndindex(*GRID))


def test_whole_cells_are_kept():
    for margin_m, cells in ((0.0, 0), (0.1, 1), (0.5, 1), (0.6, 2)):
        site = box_site([("a", (1, 1, 0), (2, 2, 1))], rules=Rules(transit_clearance_m=margin_m))
        assert margin_vox(site) == cells


def test_grown_boxes_and_grown_cells_say_the_same():
    site = box_site([("a", (1, 1, 0), (3, 2, 1))], structure=[("post", (8, 7, 0), (8.5, 7.5, 4))])
    component = site.components[0]
    free = Occupancy(site).space(component)
    for margin in (0, 1, 2):
        rule, own = in_transit(free, margin), grown_cells(component.shape.cells, margin)
        occupied = Occupancy(site).counts > 0
        for place in [(5, 5, 4), (12, 14, 4), (14, 14, 6), (16, 10, 3), (11, 10, 5), (18, 18, 4)]:
            cells = own + np.array(place)
            assert placement_is_free(rule, *place) == (not occupied[tuple(cells.T)].any())
