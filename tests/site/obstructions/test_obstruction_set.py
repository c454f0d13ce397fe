from collections.abc import Callable

import numpy as np
import pytest
from box_sites import box_mesh

from bimvox.bim.building import TriangleMesh
from bimvox.errors import InputError
from bimvox.site.obstructions.obstruction_set import (
    EMPTY,
    Box,
    Cylinder,
    Gathered,
    Obstruction,
    ObstructionSet,
    Points,
    Rows,
    Voxels,
)

CRATE = Box((0, 0, 0), (1, 1, 1))


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: Box((1, 1, 1), (0, 0, 0)), "no volume"),
        (lambda: Box((0, 0, 0), (1, 1, 0)), "no volume"),
        (lambda: Box((float("nan"), 1, 1), (2, 2, 2)), "three finite numbers|low_m is"),
        (lambda: Box((1, 1), (2, 2)), "low_m is"),  # type: ignore[arg-type]
        (lambda: Cylinder((0, 0, 0), 0.0, 1.0), "radius_m is 0.0"),
        (lambda: Cylinder((0, 0, 0), 1.0, float("inf")), "height_m is inf"),
        (lambda: Points(np.array([[0.0, np.nan, 0.0]])), "finite numbers"),
        (lambda: Points("abc"), "points_m is 'abc'"),
        (lambda: Points([(1.0, 2.0)]), "points_m is"),
        (lambda: Box("abc", "def"), "low_m is 'abc'"),
        (lambda: Box(3, (1, 1, 1)), "low_m is 3"),
        (lambda: Cylinder((0, 0, 0), "1", 2), "radius_m is '1'"),
        (lambda: Cylinder((0, 0, 0), 1, None), "height_m is None"),
        (lambda: Voxels(()), r"cells is \(\)"),
        (lambda: Voxels(((40, 40),)), "cells is"),
        (lambda: Voxels(((40.5, 40.2, 3.7),)), "cells is"),
        (lambda: Voxels(np.zeros((3, 2))), r"an array of float64 with the shape \(3, 2\)"),
        (lambda: Voxels(((40, 40, 2**40),)), "32-bit"),
        (lambda: Obstruction("x", TriangleMesh(np.zeros((3, 3)), np.array([[0, 1, 7]]))), "index 7 of 3 vertices"),
        (lambda: Obstruction("x", TriangleMesh(np.zeros((3, 3)), np.array([[0, 1, -1]]))), "index -1 of 3"),
        (lambda: Obstruction("x", TriangleMesh(np.zeros((3, 3)), np.zeros((1, 3)))), "TriangleMesh.faces is"),
        (lambda: Obstruction("x", TriangleMesh(np.full((3, 3), np.inf), np.array([[0, 1, 2]]))), "vertices_m is"),
        (lambda: ObstructionSet.of(Obstruction("x", CRATE)), "takes several obstructions"),
        (lambda: ObstructionSet.of([CRATE]), "takes several obstructions"),
        (lambda: Obstruction("", CRATE), "Obstruction.id is ''"),
        (lambda: Obstruction("x", "a form"), "its form is a str"),  # type: ignore[arg-type]
        (lambda: ObstructionSet.of([Obstruction("x", CRATE), Obstruction("x", CRATE)]), "two obstructions have the id"),
    ],
)
def test_what_cannot_be_in_the_way_is_refused(make: Callable[[], object], said: str) -> None:
    with pytest.raises(InputError, match=said):
        make()


def test_cells_are_plain_numbers_sorted_and_each_once_however_they_are_given():
    wanted = ((40, 40, 3), (41, 40, 3))
    given = [
        ((41, 40, 3), (40, 40, 3), (40, 40, 3)),
        np.array([[41, 40, 3], [40, 40, 3]]),
        [[41.0, 40, 3], [40, 40, 3]],
    ]
    for cells in given:
        found = Voxels(cells)
        assert found.cells == wanted
        assert {type(number) for cell in found.cells for number in cell} == {int}
    digests = {ObstructionSet.of([Obstruction("a", Voxels(cells))]).digest for cells in given}
    assert digests == {ObstructionSet.of([Obstruction("a", Voxels(wanted))]).digest}


def test_lists_are_arrays_and_whole_numbers_are_lengths():
    assert Points([(1, 2, 3)]).points_m.dtype == np.float64
    mesh = Obstruction("m", TriangleMesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])).form
    assert isinstance(mesh, TriangleMesh)
    assert (mesh.vertices_m.dtype, mesh.faces.dtype) == (np.float64, np.int32)
    assert repr(Cylinder((0, 0, 0), np.float32(1), 2)) == repr(Cylinder((0.0, 0.0, 0.0), 1.0, 2.0))


def test_a_box_of_any_numbers_is_a_box_of_floats():
    assert Box(np.array([0, 0, 0]), np.array([1, 1, 1])) == CRATE
    assert repr(Box(np.array([0, 0, 0]), (1, 1, 1))) == "Box(low_m=(0.0, 0.0, 0.0), high_m=(1.0, 1.0, 1.0))"


def test_a_set_from_meshes_keeps_ids_unique():
    mesh = box_mesh((0, 0, 0), (1, 1, 1))
    found = ObstructionSet.from_meshes([("b", mesh), ("a", mesh), ("b", mesh)], "shed.ifc")
    assert [one.id for one in found.obstructions] == ["a", "b", "b#2"]
    assert found.name == "shed.ifc"


def test_the_digest_sees_every_number_of_meshes_and_points():
    meshes = [box_mesh((0, 0, 0), (1, 1, 1)), box_mesh((0, 0, 0), (1, 1, 1 + 1e-9))]
    points = [np.zeros((2, 3)), np.array([[0, 0, 0], [0, 0, 1e-9]])]
    sets = [EMPTY, *(ObstructionSet.from_meshes([("a", mesh)]) for mesh in meshes)]
    sets += [ObstructionSet.of([Obstruction("a", Points(some))]) for some in points]
    assert len({one.digest for one in sets}) == len(sets)
    assert ObstructionSet.from_meshes([("a", box_mesh((0, 0, 0), (1, 1, 1)))]).digest == sets[1].digest


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
