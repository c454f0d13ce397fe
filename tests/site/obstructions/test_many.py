"""Very many obstructions: the same cells as one by one."""

import itertools

import numpy as np
import pytest
from box_buildings import rasterise_boxes
from box_sites import box_mesh
from hypothesis import given, settings
from hypothesis import strategies as st

from bimvox.errors import InputError
from bimvox.grid.frame import GridFrame
from bimvox.site.obstructions import many
from bimvox.site.obstructions.cells import Where, obstruction_cells
from bimvox.site.obstructions.many import blockers_of, cells_of_all
from bimvox.site.obstructions.obstruction_set import Box, Cylinder, Obstruction, Points, Rows, Voxels

FRAME = GridFrame((-1.0, 0.0, -0.1), 0.1)
SHAPE = (20, 15, 12)
coordinate = (
    st.floats(-2.0, 3.0) | st.integers(-20, 30).map(lambda tenths: tenths / 10) | st.sampled_from([-1e300, 1e9])
)
edge = st.floats(1e-5, 1.0) | st.integers(1, 40).map(lambda tenths: tenths / 10) | st.sampled_from([1e300])
boxes = (
    st.tuples(*[coordinate] * 3, *[edge] * 3)
    .filter(lambda b: all(b[n] + b[n + 3] > b[n] for n in range(3)))
    .map(lambda b: Box(b[:3], (b[0] + b[3], b[1] + b[4], b[2] + b[5])))
)
cylinders = st.builds(Cylinder, st.tuples(*[coordinate] * 3), edge, edge)
index = st.integers(-5, 24) | st.sampled_from([-(2**31), 2**31 - 1])
voxels = st.lists(st.tuples(index, index, index), min_size=1, max_size=4).map(lambda cells: Voxels(tuple(cells)))


@given(
    st.lists(boxes | cylinders | voxels, min_size=1, max_size=9),
    st.integers(0, 3),
    st.sampled_from([0, 10**6]),
    st.sampled_from([2, 1000]),
    st.sampled_from([None, "flat", "uneven"]),
)
@settings(deadline=None, max_examples=300)
def test_many_are_the_same_cells_as_one_by_one(forms, grow_vox, most, at_once, ground):
    ground_vox = None if ground is None else np.full(SHAPE[:2], 2, np.int32)
    if ground == "uneven":
        ground_vox[2:, 1:] = 0
    given_ = [Obstruction(f"{n}", form) for n, form in enumerate(forms)]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(many, "_AT_ONCE", at_once)
        patch.setattr(many, "_MOST_AT_ONCE", most)
        found = list(cells_of_all(given_, FRAME, SHAPE, rasterise_boxes, grow_vox=grow_vox, ground_vox=ground_vox))
    assert len(found) == len(given_)
    for one, (cells, where) in zip(given_, found, strict=True):
        wanted, wanted_where = obstruction_cells(
            one, FRAME, SHAPE, rasterise_boxes, grow_vox=grow_vox, ground_vox=ground_vox
        )
        assert cells.tolist() == wanted.tolist()
        assert cells.dtype == wanted.dtype
        assert where is wanted_where


def test_every_form_is_found_among_the_others():
    forms = [
        Box((0, 0, 0), (0.2, 1, 1)),
        Cylinder((0, 1, 0), 0.3, 0.5),
        box_mesh((0, 0, 0), (0.1, 0.1, 0.1)),
        Voxels(((1, 2, 3), (1, 2, 4))),
        Points(np.array([[0.05, 0.05, 0.05]])),
    ]
    mixed = [Obstruction(f"{n}", form) for n, form in enumerate(forms)]
    found = list(cells_of_all(mixed, FRAME, SHAPE, rasterise_boxes))
    assert [cells.tolist() for cells, _ in found] == [
        obstruction_cells(one, FRAME, SHAPE, rasterise_boxes)[0].tolist() for one in mixed
    ]
    assert {where for _, where in found} == {Where.INSIDE}
    assert [one.form for one in Rows.of(mixed)[:2]] == forms[:2]


def column(x, y, high):
    return np.array([(x, y, z) for z in range(high)], np.int32)


FOUND = [
    ("a", column(0, 0, 3), False),
    ("outside", np.zeros((0, 3), np.int32), False),
    ("b", column(0, 0, 5), False),
    ("mesh", column(0, 0, 6), True),
    ("c", column(1, 0, 2), False),
    ("d", column(1, 0, 2), False),
    ("e", column(2, 0, 1), False),
]


def as_lists(blockers):
    return {blocker.id: [tuple(cell) for cell in blocker.cells.tolist()] for blocker in blockers}


def test_few_obstructions_are_one_object_each():
    blockers = blockers_of(iter(FOUND), SHAPE)
    assert [blocker.id for blocker in blockers] == ["a", "b", "mesh", "c", "d", "e"]
    assert as_lists(blockers)["b"] == [(0, 0, z) for z in range(5)]
    assert not any(blocker.cells.flags.writeable for blocker in blockers)


@pytest.mark.parametrize("at_once", [0, 4, 10**6])
def test_many_share_objects_and_a_cell_has_one(monkeypatch, at_once):
    monkeypatch.setattr(many, "MOST_SINGLE", 3)
    monkeypatch.setattr(many, "_CELLS_AT_ONCE", at_once)
    blockers = blockers_of(iter(FOUND), SHAPE)
    assert as_lists(blockers) == {
        "mesh": [(0, 0, z) for z in range(6)],
        "a to b (2 obstructions)": [(0, 0, z) for z in range(5)],
        "c to d (2 obstructions)": [(1, 0, 0), (1, 0, 1)],
        "e": [(2, 0, 0)],
    }
    assert {blocker.kind for blocker in blockers} == {"obstruction"}
    assert not any(blocker.cells.flags.writeable for blocker in blockers)


def test_few_large_ones_keep_their_names_and_each_cell_the_first(monkeypatch):
    monkeypatch.setattr(many, "MOST_CELLS", 10)
    found = as_lists(blockers_of(iter(FOUND), SHAPE))
    assert list(found) == ["mesh", "a", "b", "c", "e"]
    assert found["b"] == [(0, 0, 3), (0, 0, 4)]
    own = list(itertools.chain(*(cells for name, cells in found.items() if name != "mesh")))
    assert len(own) == len(set(own))


def test_more_cells_than_any_site_needs_are_refused(monkeypatch):
    monkeypatch.setattr(many, "MOST_CELLS_IN_ALL", 12)
    with pytest.raises(InputError, match="more than 12 cells"):
        blockers_of(iter(FOUND), SHAPE)
