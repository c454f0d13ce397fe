import numpy as np
from box_sites import box_mesh

from bimvox.site.obstructions.obstruction_set import EMPTY, Obstruction, ObstructionSet, Points


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
