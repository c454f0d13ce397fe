from __future__ import annotations

import io
import json
import struct

import numpy as np
import pytest
import trimesh

from bimvox.bim.building import TriangleMesh
from bimvox.exporters.mesh import ColouredBody, to_glb, to_ply


def body(name: str, low: tuple[float, float, float], rgb: tuple[int, int, int] = (200, 100, 0)) -> ColouredBody:
    box = trimesh.creation.box((1.0, 2.0, 3.0))
    mesh = TriangleMesh(np.array(box.vertices) - box.bounds[0] + np.array(low), np.array(box.faces, np.int32))
    return ColouredBody(name, mesh, rgb, {"global_id": f"guid of {name}"})


BODIES = [body("beam ä", (0, 0, 0)), body("column", (5, 7, 11), (0, 128, 255)), body("third", (9, 9, 9))]


def json_of(glb: bytes) -> dict:
    assert glb[:4] == b"glTF"
    assert struct.unpack("<2I", glb[4:12]) == (2, len(glb))
    return json.loads(glb[20 : 20 + struct.unpack("<I", glb[12:16])[0]])


def test_glb_has_a_node_for_every_body_with_its_colour_and_values() -> None:
    document = json_of(to_glb(BODIES, {"unit": "m", "source_origin_m": [1.0, 2.0, 3.0]}))
    assert document["scenes"][0]["extras"] == {"unit": "m", "source_origin_m": [1.0, 2.0, 3.0]}
    assert [node["name"] for node in document["nodes"]] == ["beam ä", "column", "third"]
    meshes = [document["meshes"][node["mesh"]] for node in document["nodes"]]
    assert [mesh["extras"]["global_id"] for mesh in meshes] == [f"guid of {b.name}" for b in BODIES]
    materials = [mesh["primitives"][0]["material"] for mesh in meshes]
    assert materials[0] == materials[2] != materials[1]
    # sRGB 128 is 0.216 in linear light, which is what glTF stores.
    colour = document["materials"][materials[1]]["pbrMetallicRoughness"]["baseColorFactor"]
    assert colour == pytest.approx([0.0, 0.216, 1.0, 1.0], abs=0.003)


def test_glb_is_turned_to_y_up_without_mirroring() -> None:
    scene = trimesh.load(io.BytesIO(to_glb(BODIES, {})), file_type="glb")
    column = scene.geometry["column"]
    np.testing.assert_allclose(column.bounds, [[5, 11, -9], [6, 14, -7]])
    assert column.volume == pytest.approx(6.0)


def test_ply_is_one_mesh_with_colours_and_numbers() -> None:
    data = to_ply(BODIES, ["metres\nz up"])
    mesh = trimesh.load(io.BytesIO(data), file_type="ply", process=False)
    assert mesh.volume == pytest.approx(18.0)
    np.testing.assert_allclose(mesh.bounds, [[0, 0, 0], [10, 11, 14]])
    assert mesh.visual.face_colors[12].tolist() == [0, 128, 255, 255]
    head = data[: data.index(b"end_header")].decode("ascii").splitlines()
    assert head[:4] == ["ply", "format binary_little_endian 1.0", "comment metres z up", "comment body 0 beam \\xe4"]
    assert "property int body" in head
    rows = np.frombuffer(data[data.index(b"end_header\n") + 11 + 24 * 12 :], np.uint8).reshape(36, -1)
    np.testing.assert_array_equal(rows[:, -4:].copy().view("<i4")[:, 0], np.repeat([0, 1, 2], 12))


def test_the_same_bodies_give_the_same_bytes() -> None:
    assert to_glb(BODIES, {"a": 1}) == to_glb(BODIES, {"a": 1})
    assert to_ply(BODIES) == to_ply(BODIES)
