"""The class of work of a part: by type and class where they say it, by shape where they do not, steel by material."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest
from box_sites import box_mesh

from bimvox.bim.building import TriangleMesh
from bimvox.site.work import Work, kind_of, work_of

CUBE = (1.0, 1.0, 1.0)
COLUMN, PANEL, PLANK, GIRDER = (0.4, 0.4, 3.5), (6.0, 0.2, 3.0), (7.2, 1.2, 0.3), (12.0, 0.4, 1.6)


@dataclass
class Part:
    ifc_class: str
    mesh: TriangleMesh
    predefined_type: str | None = None
    material: str | None = None


def part(ifc_class: str, size_m: tuple[float, float, float], kind: str | None = None, material: str | None = None):
    return Part(ifc_class, box_mesh((0.0, 0.0, 0.0), size_m), kind, material)


@pytest.mark.parametrize(
    ("ifc_class", "predefined", "work"),
    [
        ("IfcColumn", None, Work.COLUMN),
        ("IfcWall", "SOLIDWALL", Work.WALL),
        ("IfcWallStandardCase", None, Work.WALL),
        ("IfcSlab", "FLOOR", Work.SLAB),
        ("IfcSlab", "LANDING", Work.STAIR),
        ("IfcSlab", "BASESLAB", Work.FOOTING),
        ("IfcRoof", None, Work.SLAB),
        ("IfcStairFlight", "STRAIGHT", Work.STAIR),
        ("IfcRampFlight", None, Work.STAIR),
        ("IfcFooting", "PAD_FOOTING", Work.FOOTING),
        ("IfcPile", None, Work.FOOTING),
        ("IfcBeam", "HOLLOWCORE", Work.SLAB),
        ("IfcBeam", "BEAM", Work.BEAM),
        ("IfcMember", "POST", Work.COLUMN),
        ("IfcMember", "STRINGER", Work.STAIR),
        ("IfcElementAssembly", "TRUSS", Work.BEAM),
        ("IfcElementAssembly", None, Work.OTHER),
    ],
)
def test_type_and_class_decide(ifc_class: str, predefined: str | None, work: Work) -> None:
    assert kind_of(part(ifc_class, CUBE, predefined)) is work


@pytest.mark.parametrize(
    ("size_m", "work"),
    [(COLUMN, Work.COLUMN), (PANEL, Work.WALL), (PLANK, Work.SLAB), (GIRDER, Work.BEAM)],
)
@pytest.mark.parametrize("ifc_class", ["Mesh", "IfcMember", "IfcPlate", "IfcElementAssembly", "IfcBeam"])
def test_shape_decides_where_the_class_says_little(ifc_class: str, size_m: tuple[float, ...], work: Work) -> None:
    assert kind_of(part(ifc_class, size_m)) is work


@pytest.mark.parametrize("size_m", [COLUMN, PANEL, PLANK, GIRDER])
def test_the_shape_is_told_however_the_part_is_turned(size_m: tuple[float, float, float]) -> None:
    straight = part("Mesh", size_m)
    cos, sin = np.cos(0.7), np.sin(0.7)
    turned = straight.mesh.vertices_m @ np.array([[cos, sin, 0.0], [-sin, cos, 0.0], [0.0, 0.0, 1.0]])
    assert kind_of(Part("Mesh", TriangleMesh(turned, straight.mesh.faces))) is kind_of(straight)


@pytest.mark.parametrize(
    ("material", "is_steel"),
    [
        ("STEEL/S235JR", True),
        ("Metal - Steel - 345 MPa", True),
        ("Metal - Stud Layer", False),
        ("Stahlbeton C30/37", False),
        ("C50/60", False),
        (None, False),
    ],
)
def test_steel_is_told_by_the_material(material: str | None, is_steel: bool) -> None:
    column = part("IfcColumn", COLUMN, None, material)
    assert work_of(column) is (Work.STEEL if is_steel else Work.COLUMN)
    assert kind_of(column) is Work.COLUMN
