"""Very many obstructions: the same cells as one by one, in few objects."""

import itertools

import numpy as np
import pytest

from bimvox.errors import InputError
from bimvox.site.obstructions import many
from bimvox.site.obstructions.many import blockers_of

SHAPE = (20, 15, 12)


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
