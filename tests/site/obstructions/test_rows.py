import numpy as np
import pytest
from box_sites import box_mesh

from bimvox.errors import InputError
from bimvox.site.obstructions.obstruction_set import Box, Cylinder, Gathered, Obstruction, ObstructionSet, Rows, Voxels

FORMS = [
    Voxels(((1, 2, 3), (4, 5, -6))),
    Box((0.1, 0.2, -0.0), (1.0, 2.0, 3.0)),
    box_mesh((0, 0, 0), (1, 1, 1)),
    Voxels(((0, 0, 0),)),
    Cylinder((1.0, 2.0, 3.0), 0.5, 7.0),
]
GIVEN = [Obstruction(name, form) for name, form in zip("edcba", FORMS, strict=True)]


def test_rows_hold_what_they_were_made_of():
    rows = Rows.of(GIVEN)
    assert [one.id for one in rows] == list("edcba")
    assert [one.form for one in rows] == FORMS
    assert rows[-1].form == FORMS[-1]
    assert [one.id for one in rows[1:3]] == ["d", "c"]
    assert Rows.of(rows) is rows
    with pytest.raises(IndexError):
        rows[5]


def test_rows_by_id_are_the_same_set():
    gathered = Gathered()
    for one in GIVEN:
        gathered.add(one)
    found = gathered.by_id()
    assert [(one.id, one.form) for one in found] == list(zip("abcde", reversed(FORMS), strict=True))
    assert ObstructionSet(found).digest == ObstructionSet.of(GIVEN).digest


def test_lengths_are_scaled_and_cells_are_not():
    gathered = Gathered()
    gathered.box("box", (1, 2, 3), (4, 5, 6))
    gathered.voxels("cells", [[1, 2, 3]])
    gathered.scale(0.3048)
    box, cells = gathered.rows()
    assert box.form == Box(tuple(0.3048 * np.array([1, 2, 3])), tuple(0.3048 * np.array([4, 5, 6])))
    assert cells.form == Voxels(((1, 2, 3),))


def test_what_scaling_makes_flat_is_refused_by_name():
    for add in (
        lambda given: given.box("thin", (0, 0, 0), (1, 1, 5e-324)),
        lambda given: given.cylinder("thin", (0, 0, 0), 1.0, 5e-324),
    ):
        gathered = Gathered()
        add(gathered)
        with pytest.raises(InputError, match="'thin' has no volume"):
            gathered.scale(0.001)
