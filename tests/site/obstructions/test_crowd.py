"""Very many obstructions: the same cells as one by one, in few objects."""

import itertools

import numpy as np
import pytest
from box_buildings import rasterise_boxes
from hypothesis import given, settings
from hypothesis import strategies as st

from bimvox.errors import InputError
from bimvox.grid.frame import GridFrame
from bimvox.site.obstructions import cells as cells_module
from bimvox.site.obstructions import crowd
from bimvox.site.obstructions.cells import cells_of_all, obstruction_cells
from bimvox.site.obstructions.crowd import blockers_of
from bimvox.site.obstructions.obstruction_set import Box, Cylinder, Obstruction

FRAME = GridFrame((-1.0, 0.0, -0.1), 0.1)
SHAPE = (20, 15, 12)
coordinate = (
    st.floats(-2.0, 3.0) | st.integers(-20, 30).map(lambda tenths: tenths / 10) | st.sampled_from([-1e300, 1e9])
)
edge = st.floats(1e-5, 1.0) | st.integers(1, 40).map(lambda tenths: tenths / 10) | st.sampled_from([1e300])


@given(
    st.lists(st.tuples(*[coordinate] * 3, *[edge] * 3), min_size=3, max_size=9),
    st.integers(0, 3),
    st.sampled_from([0, 10**6]),
)
@settings(deadline=None)
def test_many_boxes_are_the_same_cells_as_one_by_one(drawn, grow_vox, at_once):
    boxes = [
        Box((x, y, z), (x + a, y + b, z + c)) for x, y, z, a, b, c in drawn if min(x + a - x, y + b - y, z + c - z)
    ]
    given_ = [Obstruction(f"{n}", box) for n, box in enumerate(boxes)]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(cells_module, "_MANY", 3)
        patch.setattr(cells_module, "_MOST_AT_ONCE", at_once)
        found = list(cells_of_all(given_, FRAME, SHAPE, rasterise_boxes, grow_vox=grow_vox))
    assert len(found) == len(given_)
    for one, (cells, note) in zip(given_, found, strict=True):
        wanted, wanted_note = obstruction_cells(one, FRAME, SHAPE, rasterise_boxes, grow_vox=grow_vox)
        assert cells.tolist() == wanted.tolist()
        assert cells.dtype == wanted.dtype
        assert note == wanted_note


def test_other_forms_among_many_boxes(monkeypatch):
    monkeypatch.setattr(cells_module, "_MANY", 2)
    boxes = [Obstruction(f"{n}", Box((0.1 * n, 0, 0), (0.1 * n + 0.2, 1, 1))) for n in range(5)]
    mixed = [*boxes[:3], Obstruction("c", Cylinder((0, 1, 0), 0.3, 0.5)), *boxes[3:]]
    found = list(cells_of_all(mixed, FRAME, SHAPE, rasterise_boxes))
    assert [len(cells) for cells, _ in found] == [
        len(obstruction_cells(one, FRAME, SHAPE, rasterise_boxes)[0]) for one in mixed
    ]


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
    monkeypatch.setattr(crowd, "MOST_SINGLE", 3)
    monkeypatch.setattr(crowd, "_AT_ONCE", at_once)
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
    monkeypatch.setattr(crowd, "MOST_CELLS", 10)
    found = as_lists(blockers_of(iter(FOUND), SHAPE))
    assert list(found) == ["mesh", "a", "b", "c", "e"]
    assert found["b"] == [(0, 0, 3), (0, 0, 4)]
    own = list(itertools.chain(*(cells for name, cells in found.items() if name != "mesh")))
    assert len(own) == len(set(own))


def test_more_cells_than_any_site_needs_are_refused(monkeypatch):
    monkeypatch.setattr(crowd, "MOST_CELLS_IN_ALL", 12)
    with pytest.raises(InputError, match="more than 12 cells"):
        blockers_of(iter(FOUND), SHAPE)
