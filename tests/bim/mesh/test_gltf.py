"""glTF: nodes and instances, buffers inside and next to the file, primitives, packed numbers, hostile trees."""

from __future__ import annotations

import base64
import json
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mesh_samples import gltf_files, samples, with_inline_buffers

from bimvox.bim.mesh.gltf import read_gltf
from bimvox.bim.read import read_building
from bimvox.errors import MeshError

PATH = Path("a.gltf")
CORNERS = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]], dtype="<f4")


def tree(positions: np.ndarray = CORNERS, order: np.ndarray | None = None, **primitive: Any) -> dict[str, Any]:
    """A glTF with one mesh on one node."""
    order = np.array([0, 1, 2], dtype="<u2") if order is None else order
    kinds = {"<f4": 5126, "<u2": 5123, "<u1": 5121, "<i2": 5122, "<u4": 5125}
    data = positions.tobytes() + order.tobytes()
    size = positions.nbytes
    views = [{"buffer": 0, "byteLength": size}, {"buffer": 0, "byteOffset": size, "byteLength": order.nbytes}]
    return {
        "asset": {"version": "2.0"},
        "buffers": [{"byteLength": len(data), "uri": "data:;base64," + base64.b64encode(data).decode()}],
        "bufferViews": views,
        "accessors": [
            {"bufferView": 0, "componentType": kinds[positions.dtype.str], "count": len(positions), "type": "VEC3"},
            {"bufferView": 1, "componentType": kinds[order.dtype.str], "count": len(order), "type": "SCALAR"},
        ],
        "meshes": [{"name": "shape", "primitives": [{"attributes": {"POSITION": 0}, "indices": 1, **primitive}]}],
        "nodes": [{"mesh": 0, "name": "one"}],
        "scenes": [{"nodes": [0]}],
        "scene": 0,
    }


def read(document: dict[str, Any], path: Path = PATH) -> Any:
    return read_gltf(path, json.dumps(document).encode())


@pytest.mark.parametrize("name", ["a.glb", "a.gltf"])
def test_nodes_are_bodies_in_metres_with_y_up(name: str) -> None:
    contents = read_gltf(Path(name), samples()[name])
    assert (contents.unit, contents.up) == ("m", "y")
    assert {body.name: body.vertices.min(axis=0).tolist() for body in contents.bodies} == {
        "c1": [0, 0, 0],
        "c2": [5, 0, 0],
        "b": [0, 0, 5],
    }


def test_names_come_from_node_then_mesh_and_a_lone_nameless_one_is_a_lump() -> None:
    document = tree()
    del document["nodes"][0]["name"]
    assert read(document).bodies[0].name == "shape"
    del document["meshes"][0]["name"]
    assert read(document).bodies[0].name == ""
    document["nodes"].append({"mesh": 0})
    document["scenes"][0]["nodes"] = [0, 1]
    assert [body.name for body in read(document).bodies] == ["node-0", "node-1"]


def test_placements_are_combined_and_a_mirror_keeps_outside_out() -> None:
    document = tree()
    half = float(np.sqrt(0.5))
    document["nodes"] = [
        {"translation": [10, 0, 0], "rotation": [0, 0, half, half], "children": [1]},
        {"mesh": 0, "name": "one", "scale": [2, -1, 1]},
    ]
    (body,) = read(document).bodies
    # (1, 0, 0) is scaled to (2, 0, 0), rotated to (0, 2, 0), moved to (10, 2, 0).
    assert body.vertices[1] == pytest.approx([10, 2, 0])
    assert body.vertices[2] == pytest.approx([11, 0, 0])
    a, b, c = body.vertices[body.faces[0]]
    assert np.cross(b - a, c - a)[2] == pytest.approx(2.0)


@pytest.mark.parametrize(
    ("mode", "faces"),
    [(4, [[0, 1, 2]]), (5, [[0, 1, 2], [2, 1, 3]]), (6, [[0, 1, 2], [0, 2, 3]])],
)
def test_lists_strips_and_fans(mode: int, faces: list[list[int]]) -> None:
    assert read(tree(order=np.arange(4, dtype="<u2"), mode=mode)).bodies[0].faces.tolist() == faces


def test_primitives_without_material_or_indices_are_joined() -> None:
    document = tree()
    primitives = document["meshes"][0]["primitives"]
    primitives += [{"attributes": {"POSITION": 0}}, {"attributes": {"POSITION": 0}, "mode": 1}]
    (body,) = read(document).bodies
    assert body.faces.tolist() == [[0, 1, 2], [4, 5, 6]]


def test_lines_and_points_are_reported() -> None:
    contents = read(tree(mode=1))
    assert contents.bodies == ()
    assert contents.left_out == (("one", "points or lines"),)


def test_quantized_positions() -> None:
    document = tree(np.array([[0, 0, 0], [32767, 0, 0], [0, -32767, 0]], dtype="<i2"))
    document["accessors"][0]["normalized"] = True
    document["extensionsRequired"] = ["KHR_mesh_quantization"]
    assert read(document).bodies[0].vertices.tolist() == [[0, 0, 0], [1, 0, 0], [0, -1, 0]]


def test_interleaved_and_sparse_positions() -> None:
    interleaved = np.concatenate([CORNERS, CORNERS + 5], axis=1).astype("<f4")
    document = tree(interleaved)
    document["bufferViews"][0]["byteStride"] = 24
    document["accessors"][0].update(byteOffset=12, count=4)
    assert read(document).bodies[0].vertices[1].tolist() == [6, 5, 5]

    document = tree()
    document["accessors"][0]["sparse"] = {
        "count": 1,
        "indices": {"bufferView": 1, "componentType": 5123, "byteOffset": 2},
        "values": {"bufferView": 0, "byteOffset": 36},
    }
    assert read(document).bodies[0].vertices.tolist() == [[0, 0, 0], [1, 1, 0], [0, 1, 0], [1, 1, 0]]


def test_a_buffer_next_to_the_file(tmp_path: Path) -> None:
    files = gltf_files()
    for name, content in files.items():
        (tmp_path / name).write_bytes(content)
    document = json.loads(files["model.gltf"])
    assert len(read(document, tmp_path / "model.gltf").bodies) == 3
    name = document["buffers"][0]["uri"]
    (tmp_path / name).rename(tmp_path / "my buffer.bin")
    document["buffers"][0]["uri"] = "my%20buffer.bin"
    assert len(read(document, tmp_path / "model.gltf").bodies) == 3
    (tmp_path / "my buffer.bin").write_bytes(b"short")
    with pytest.raises(MeshError, match=r"should have .* but has 5"):
        read(document, tmp_path / "model.gltf")
    (tmp_path / "my buffer.bin").unlink()
    with pytest.raises(MeshError, match=r"'my%20buffer\.bin' is missing"):
        read(document, tmp_path / "model.gltf")


def test_the_hash_of_the_source_covers_the_buffers_next_to_it(tmp_path: Path) -> None:
    for name, content in gltf_files().items():
        (tmp_path / name).write_bytes(content)
    path = tmp_path / "model.gltf"
    buffer = tmp_path / json.loads(path.read_bytes())["buffers"][0]["uri"]
    first = read_building(path).source.sha256
    assert read_building(path).source.sha256 == first
    buffer.write_bytes(buffer.read_bytes() + b"\0")
    assert read_building(path).source.sha256 != first
    assert len(first) == 64


@pytest.mark.parametrize(
    "uri", ["../secret.bin", "/etc/passwd", "sub/../../secret.bin", "%2e%2e/secret.bin", "link.bin"]
)
def test_nothing_outside_the_folder_is_read(tmp_path: Path, uri: str) -> None:
    (tmp_path / "secret.bin").write_bytes(b"\0" * 10_000)
    folder = tmp_path / "in"
    folder.mkdir()
    (folder / "link.bin").symlink_to(tmp_path / "secret.bin")
    document = tree()
    document["buffers"][0]["uri"] = uri
    with pytest.raises(MeshError, match="not in the file's folder"):
        read(document, folder / "a.gltf")


@pytest.mark.parametrize(
    ("extension", "message"),
    [
        ("KHR_draco_mesh_compression", "compressed with Draco"),
        ("EXT_meshopt_compression", "compressed with meshopt"),
        ("ACME_shapes", "needs an extension.*ACME_shapes"),
    ],
)
def test_a_required_extension_that_is_not_known(extension: str, message: str) -> None:
    with pytest.raises(MeshError, match=message):
        read(tree() | {"extensionsRequired": [extension]})


def test_draco_without_a_fallback_although_not_required() -> None:
    document = tree(extensions={"KHR_draco_mesh_compression": {"bufferView": 0}})
    assert len(read(document).bodies) == 1
    del document["accessors"][0]["bufferView"]
    with pytest.raises(MeshError, match="Draco"):
        read(document)


def test_instancing_by_extension_is_refused_not_forgotten() -> None:
    document = tree()
    document["nodes"][0]["extensions"] = {"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": 0}}}
    with pytest.raises(MeshError, match="EXT_mesh_gpu_instancing"):
        read(document)


@pytest.mark.parametrize(
    ("nodes", "roots"),
    [
        ([{"children": [1]}, {"children": [0], "mesh": 0}], [0]),
        ([{"children": [0], "mesh": 0}], [0]),
        ([{"children": [1, 1]}, {"mesh": 0}], [0]),
        ([{"mesh": 0}], [0, 0]),
    ],
)
def test_an_invalid_tree(nodes: list[dict[str, Any]], roots: list[int]) -> None:
    document = tree() | {"nodes": nodes, "scenes": [{"nodes": roots}]}
    with pytest.raises(MeshError, match="two parents, or is its own"):
        read(document)


def test_children_that_are_not_a_list_are_none() -> None:
    document = tree() | {"nodes": [{"mesh": 0, "name": "one", "children": 7}]}
    del document["scenes"]
    assert [body.name for body in read(document).bodies] == ["one"]


def test_a_tree_of_many_nodes_is_read_in_seconds() -> None:
    deep = [{"children": [n + 1]} for n in range(50_000)]
    started_s = time.monotonic()
    assert len(read(tree() | {"nodes": [*deep, {"mesh": 0}]}).bodies) == 1
    assert time.monotonic() - started_s < 20.0


def test_excessive_repetition_of_a_mesh_is_refused() -> None:
    document = tree(order=np.zeros(60_000, dtype="<u2"))
    document["nodes"] = [{"mesh": 0}] * 1_100
    document["scenes"] = [{"nodes": list(range(1_100))}]
    with pytest.raises(MeshError, match="more than 20,000,000 triangles"):
        read(document)


@pytest.mark.parametrize(
    ("place", "value", "message"),
    [
        (("accessors", 0, "count"), 10**12, "beyond its end"),
        (("accessors", 0, "count"), -1, "not a count"),
        (("accessors", 0, "count"), 1.5, "not a count"),
        (("accessors", 0, "type"), "VEC2", "not a VEC3"),
        (("accessors", 0, "bufferView"), 7, r"bufferViews\[7\]"),
        (("bufferViews", 0, "byteLength"), 10**9, "beyond its buffer"),
        (("buffers", 0, "byteLength"), 10**9, "should have 1,000,000,000 bytes"),
        (("nodes", 0, "mesh"), 3, r"meshes\[3\]"),
        (("nodes", 0, "matrix"), [1, 2], "placement is damaged"),
        (("asset", "version"), "1.0", "glTF 1.0"),
    ],
)
def test_damage_is_named(place: tuple[Any, ...], value: Any, message: str) -> None:
    document: Any = tree()
    spot = document
    for step in place[:-1]:
        spot = spot[step]
    spot[place[-1]] = value
    with pytest.raises(MeshError, match=message):
        read(document)


def test_indices_out_of_range_make_faces_that_are_dropped() -> None:
    assert (read(tree(order=np.array([0, 1, 2, 0, 1, 60_000], dtype="<u2"))).bodies[0].faces[1] < 0).any()


def test_a_cut_glb_is_refused() -> None:
    data = samples()["a.glb"]
    for keep in range(4, len(data), 41):
        with pytest.raises(MeshError):
            read_gltf(Path("a.glb"), data[:keep])


def test_inline_buffers_equal_those_next_to_the_file() -> None:
    assert with_inline_buffers(gltf_files())["buffers"][0]["uri"].startswith("data:")
