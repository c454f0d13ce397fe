from functools import partial

import numpy as np
import pytest
from box_buildings import rasterise_boxes
from box_sites import box_mesh
from hypothesis import given, settings
from hypothesis import strategies as st

from bimvox.grid.frame import GridFrame
from bimvox.site.collision import grown_cells
from bimvox.site.obstructions.cells import MOST_NAMED, Notes, Where, note_about, obstruction_cells
from bimvox.site.obstructions.obstruction_set import Box, Cylinder, Obstruction, Points, Voxels

FRAME = GridFrame((-1.0, 0.0, -0.1), 0.1)
SHAPE = (20, 15, 12)
coordinate = st.floats(-2.0, 3.0)


def cells_of(form, *, grow_vox=0, frame=FRAME, shape=SHAPE):
    return obstruction_cells(Obstruction("x", form), frame, shape, rasterise_boxes, grow_vox=grow_vox)


def as_set(cells):
    return {tuple(cell) for cell in cells.tolist()}


@given(
    st.tuples(st.integers(0, 18), st.integers(0, 13), st.integers(0, 10)),
    st.tuples(st.integers(1, 5), st.integers(1, 5), st.integers(1, 5)),
)
def test_a_box_on_cell_borders_does_not_spill(low, size):
    high = np.minimum(np.add(low, size), SHAPE)
    low_m, high_m = FRAME.corner_of(low), FRAME.corner_of(high)
    cells, where = cells_of(Box(tuple(np.round(low_m, 6)), tuple(np.round(high_m, 6))))
    expected = {tuple(np.add(low, offset)) for offset in np.ndindex(*(high - low))}
    assert as_set(cells) == expected
    assert where is Where.INSIDE


@given(st.tuples(coordinate, coordinate, coordinate), st.tuples(*[st.floats(0.001, 1.0)] * 3))
@settings(deadline=None)
def test_a_box_takes_every_cell_that_it_reaches_into_and_no_other(low, size):
    low, high = np.array(low), np.array(low) + size
    cells, _ = cells_of(Box(tuple(low), tuple(high)))
    every = np.argwhere(np.ones(SHAPE, bool))
    overlap = (np.minimum(FRAME.corner_of(every + 1), high) - np.maximum(FRAME.corner_of(every), low)).min(axis=1)
    assert as_set(every[overlap > 2.1e-4]) <= as_set(cells)
    assert as_set(cells) <= as_set(every[overlap > -1e-9])


@given(st.tuples(coordinate, coordinate, coordinate), st.floats(0.01, 0.8), st.floats(0.01, 1.0))
@settings(deadline=None)
def test_a_cylinder_takes_every_cell_that_holds_a_point_of_it(base, radius, height):
    cells = as_set(cells_of(Cylinder(base, radius, height))[0])
    generator = np.random.default_rng(0)
    angle, share = generator.uniform(0, 2 * np.pi, 4000), np.sqrt(generator.uniform(0, 1, 4000))
    inside = np.stack(
        [
            base[0] + radius * share * np.cos(angle),
            base[1] + radius * share * np.sin(angle),
            base[2] + height * generator.uniform(0, 1, 4000),
        ],
        axis=1,
    )
    where = (inside - FRAME.origin_m) / FRAME.voxel_size_m
    well_inside = (np.abs(where - np.rint(where)) > 2e-3).all(axis=1)  # beyond the 0.1 mm tolerance of every border
    hit = np.floor(where[well_inside]).astype(int)
    hit = hit[((hit >= 0) & (hit < SHAPE)).all(axis=1)]
    assert as_set(hit) <= cells
    for cell in cells:  # no cell that it does not touch
        low = FRAME.corner_of(cell)
        nearest = np.clip(base[:2], low[:2], low[:2] + FRAME.voxel_size_m)
        assert np.hypot(*(nearest - base[:2])) < radius + 1e-9
        assert low[2] < base[2] + height
        assert low[2] + FRAME.voxel_size_m > base[2]


def test_points_take_the_cells_that_hold_them():
    points = FRAME.centre_of([[1, 2, 3], [1, 2, 3], [4, 5, 6], [90, 0, 0]])
    cells, where = cells_of(Points(np.vstack([points, [[1e300, 0.0, 0.0]]])))
    assert cells.tolist() == [[1, 2, 3], [4, 5, 6]]
    assert where is Where.CLIPPED


def test_a_mesh_is_rasterised_by_the_callers_means():
    cells, where = cells_of(box_mesh(FRAME.corner_of((1, 1, 1)), FRAME.corner_of((3, 2, 2))))
    assert cells.tolist() == [[1, 1, 1], [2, 1, 1]]
    assert where is Where.INSIDE


@pytest.mark.parametrize(
    "form",
    [
        Box((-50.0, 0.5, 0.0), (0.0, 1.0, 0.5)),
        Box((-1e30, -1e30, -1e30), (1e30, 1e30, 1e30)),
        Cylinder((-1.0, 0.0, 0.0), 0.5, 900.0),
        Voxels(((0, 0, 1), (-1, 0, 1))),
        Voxels(((0, 0, 1), (0, 0, 2**31 - 1))),
        box_mesh((-3.0, 0.0, 0.0), (0.0, 1.0, 0.5)),
    ],
)
def test_what_sticks_out_is_clipped(form):
    cells, where = cells_of(form)
    assert len(cells)
    assert (cells >= 0).all()
    assert (cells < SHAPE).all()
    assert where is Where.CLIPPED


@pytest.mark.parametrize(
    "form",
    [
        Box((5.0, 5.0, 5.0), (6.0, 6.0, 6.0)),
        Box((-2.0, 0.0, 0.0), (-1.0, 1.0, 1.0)),
        Cylinder((0.0, -2.0, 0.0), 1.0, 1.0),
        Voxels(((0, 0, 12),)),
        Points(np.array([[9.0, 9.0, 9.0]])),
        box_mesh((5.0, 5.0, 5.0), (6.0, 6.0, 6.0)),
    ],
)
def test_obstructions_outside_take_no_cell(form):
    cells, where = cells_of(form)
    assert cells.shape == (0, 3)
    assert where is Where.OUTSIDE


@given(
    st.lists(st.tuples(st.integers(0, 7), st.integers(0, 6), st.integers(0, 5)), min_size=1, max_size=10),
    st.integers(0, 3),
)
def test_growing_takes_the_cells_within_that_many(cells, by):
    shape = (8, 7, 6)
    near = grown_cells(np.unique(np.array(cells, np.int32), axis=0), by)
    near = near[((near >= 0) & (near < shape)).all(axis=1)]
    every = np.argwhere(np.ones(shape, bool))
    distance = np.abs(every[:, None] - np.array(cells)[None]).max(axis=2).min(axis=1)
    assert near.tolist() == every[distance <= by].tolist()


def test_clearance_counts_for_what_stands_just_outside():
    beside = Box((-1.1, 0.0, 0.0), (-1.0, 0.1, 0.1))
    cells, where = cells_of(beside, grow_vox=1)
    assert as_set(cells) == {(0, j, k) for j in (0, 1) for k in (0, 1, 2)}
    assert where is Where.OUTSIDE


def test_a_note_names_the_obstruction_and_the_site():
    frame, shape = GridFrame((-1.0, 0.0, -0.1), 0.1), (20, 15, 12)
    outside = "obstruction 'x' lies outside the site, which is from (-1.00, 0.00, -0.10) to (1.00, 1.50, 1.10) m"
    assert note_about("x", Where.OUTSIDE, frame, shape) == outside
    assert note_about("x", Where.CLIPPED, frame, shape) == "obstruction 'x' is clipped to the site"


def test_very_many_notes_are_counted_but_for_those_of_other_files():
    notes = Notes()
    for n in range(MOST_NAMED + 1003):
        notes.add("outside the site" if n % 2 else "renamed", partial(str, n), always=n == 900)
    *named, more = notes.lines()
    assert named == [*(str(n) for n in range(MOST_NAMED)), "900"]
    assert more == "more obstructions: 502 outside the site, 500 renamed"


def test_few_notes_are_all_there():
    notes = Notes()
    assert notes.lines() == ()
    notes.add("renamed", lambda: "a", always=False)
    assert notes.lines() == ("a",)
