from collections.abc import Callable

import numpy as np
import pytest
from box_sites import box_mesh

from bimvox.errors import InputError
from bimvox.site.obstructions.obstruction_set import EMPTY, Box, Cylinder, Obstruction, ObstructionSet, Points

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
        (lambda: Obstruction("", CRATE), "Obstruction.id is ''"),
        (lambda: Obstruction("x", "a form"), "its form is a str"),  # type: ignore[arg-type]
        (lambda: ObstructionSet.of([Obstruction("x", CRATE), Obstruction("x", CRATE)]), "two obstructions have the id"),
    ],
)
def test_what_cannot_be_in_the_way_is_refused(make: Callable[[], object], said: str) -> None:
    with pytest.raises(InputError, match=said):
        make()


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
