"""3MF: units, placed components, several model parts, and invalid zip files."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from mesh_samples import samples, zipped

from bimvox.bim.mesh.threemf import read_3mf
from bimvox.errors import MeshError

PATH = Path("a.3mf")
MESH = (
    '<mesh><vertices><vertex x="0" y="0" z="0"/><vertex x="1" y="0" z="0"/><vertex x="0" y="1" z="0"/></vertices>'
    '<triangles><triangle v1="0" v2="1" v3="2"/></triangles></mesh>'
)
CORE = "http://schemas.microsoft.com/3dmanufacturing/core/2015/02"
PRODUCTION = "http://schemas.microsoft.com/3dmanufacturing/production/2015/06"


def package(objects: str, items: str = '<item objectid="1"/>', unit: str = ' unit="meter"') -> bytes:
    build = f"<build>{items}</build>" if items else ""
    xml = f'<model xmlns="{CORE}" xmlns:p="{PRODUCTION}"{unit}><resources>{objects}</resources>{build}</model>'
    return zipped({"3D/3dmodel.model": xml.encode()})


def one(name: str = "wall") -> str:
    return f'<object id="1" name="{name}">{MESH}</object>'


@pytest.mark.parametrize(
    ("attribute", "unit"),
    [(' unit="meter"', "m"), (' unit="inch"', "in"), (' unit="micron"', "µm"), ("", "mm")],
)
def test_the_unit_is_stated_or_millimetres_by_the_standard(attribute: str, unit: str) -> None:
    contents = read_3mf(PATH, package(one(), unit=attribute))
    assert (contents.unit, contents.up, contents.bodies[0].name) == (unit, "z", "wall")


def test_a_scene_with_instances() -> None:
    contents = read_3mf(PATH, samples()["a.3mf"])
    assert sorted(body.vertices.min(axis=0).tolist() for body in contents.bodies) == [[0, 0, 0], [0, 0, 5], [5, 0, 0]]


def test_components_within_components_are_placed() -> None:
    objects = one() + (
        '<object id="2"><components><component objectid="1" transform="1 0 0 0 1 0 0 0 1 5 0 0"/>'
        '<component objectid="1" transform="-1 0 0 0 1 0 0 0 1 0 0 0"/></components></object>'
        '<object id="3"><components><component objectid="2" transform="0 1 0 -1 0 0 0 0 1 0 0 7"/>'
        "</components></object>"
    )
    first, second = read_3mf(PATH, package(objects, '<item objectid="3" partnumber="P7"/>')).bodies
    assert first.vertices.tolist() == [[0, 5, 7], [0, 6, 7], [-1, 5, 7]]
    assert [first.name, second.name] == ["wall", "wall"]
    a, b, c = second.vertices[second.faces[0]]
    assert np.cross(b - a, c - a)[2] > 0


def test_what_is_not_built_is_not_read_and_supports_are_reported() -> None:
    objects = one() + f'<object id="2">{MESH}</object><object id="3" type="support" name="s">{MESH}</object>'
    contents = read_3mf(PATH, package(objects, '<item objectid="1"/><item objectid="3"/>'))
    assert [body.name for body in contents.bodies] == ["wall"]
    assert contents.left_out == (("s", "a support for printing"),)


def test_objects_in_another_part() -> None:
    root = (
        f'<model xmlns="{CORE}" xmlns:p="{PRODUCTION}"><build><item objectid="1" p:path="/3D/Objects/o.model"/></build>'
        "</model>"
    )
    other = f'<model xmlns="{CORE}"><resources>{one("far")}</resources></model>'
    parts = {"3D/3dmodel.model": root.encode(), "3D/Objects/o.model": other.encode()}
    assert [body.name for body in read_3mf(PATH, zipped(parts)).bodies] == ["far"]
    with pytest.raises(MeshError, match=r"part '3d/objects/o\.model' is missing"):
        read_3mf(PATH, zipped({"3D/3dmodel.model": root.encode()}))


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (b"PK\3\4garbage", "zip is damaged"),
        (zipped({"readme.txt": b"hello"}), "no 3D model"),
        (zipped({"3D/3dmodel.model": b"<model"}), "line 1"),
        (package(one(), '<item objectid="9"/>'), "object '9' is placed"),
        (package(one(), unit=' unit="ell"'), "unit 'ell'"),
        (package(one().replace('x="1"', 'x="one"')), "could not convert"),
        (package(one().replace('x="1"', "")), "'x' is missing"),
        (package(one(), '<item objectid="1" transform="1 2 3"/>'), "reshape"),
        (
            package('<object id="1"><components><component objectid="1"/></components></object>'),
            "contains itself",
        ),
    ],
)
def test_damage_is_named(data: bytes, message: str) -> None:
    with pytest.raises(MeshError, match=message):
        read_3mf(PATH, data)


def test_xml_bombs_are_refused() -> None:
    bomb = '<!DOCTYPE m [<!ENTITY a "aaaaaaaaaa"><!ENTITY b "&a;&a;&a;&a;">]><model>&b;</model>'
    with pytest.raises(MeshError, match="document type"):
        read_3mf(PATH, zipped({"3D/3dmodel.model": bomb.encode()}))


def test_zip_bombs_are_refused_before_they_are_unpacked() -> None:
    with pytest.raises(MeshError, match="unpacks from"):
        read_3mf(PATH, zipped({"3D/3dmodel.model": b" " * (1 << 25)}))


def test_instances_of_instances_are_counted_before_they_are_made() -> None:
    twice = '<object id="{}"><components><component objectid="{}"/><component objectid="{}"/></components></object>'
    objects = one() + "".join(twice.format(n, n - 1, n - 1) for n in range(2, 40))
    with pytest.raises(MeshError, match="more than 20,000,000 triangles"):
        read_3mf(PATH, package(objects, '<item objectid="39"/>'))
