"""The mesh site: both files contain the same named, closed bodies, each in the convention of its format."""

from __future__ import annotations

import fnmatch
import json
import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh

from bimvox.site.config.file import load_site_config
from sample_models.mesh_files import Body, glb_bytes, stl_text
from sample_models.yard import CONTAINER_M, yard_bodies

NAMES = [*(f"container-{i}" for i in range(1, 7)), "excavator", "ground"]


def bodies_of(path: Path) -> dict[str, Any]:
    """Return the mesh of each body by name, z up, metres."""
    scene = trimesh.load_scene(path)
    if path.suffix == ".stl":
        return dict(scene.geometry)
    z_up = np.array([[1, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1]])
    found = {}
    for node in scene.graph.nodes_geometry:
        transform, geometry = scene.graph[node]
        found[node] = scene.geometry[geometry].copy().apply_transform(z_up @ transform)
    return found


@pytest.mark.parametrize("name", ["yard.glb", "yard.stl"])
def test_bodies_are_named_and_where_they_belong(samples: Path, name: str) -> None:
    found = bodies_of(samples / name)
    assert sorted(found) == NAMES
    for body in yard_bodies():
        expected = body.vertices_m + body.at_m
        np.testing.assert_allclose(found[body.name].bounds, [expected.min(axis=0), expected.max(axis=0)], atol=1e-4)
    np.testing.assert_allclose(found["container-1"].extents, CONTAINER_M, atol=1e-4)
    np.testing.assert_allclose(found["ground"].bounds[1, 2], 0.0, atol=1e-9)


@pytest.mark.parametrize("name", ["yard.glb", "yard.stl"])
def test_bodies_are_closed_and_face_outwards(samples: Path, name: str) -> None:
    for body, mesh in bodies_of(samples / name).items():
        mesh.merge_vertices()
        assert mesh.is_watertight, body
        volumes = sorted(shell.volume for shell in mesh.split(only_watertight=False))
        cavities = [volume for volume in volumes if volume < 0]
        assert len(cavities) == body.startswith("container"), body
        if cavities:
            assert 0.95 < volumes[-1] / np.prod(CONTAINER_M) < 1.0
            assert 1.0 < mesh.volume < 3.0  # walls: about 5 t at the default density


def test_stacked_containers_stand_exactly_on_those_below() -> None:
    bodies = {body.name: body for body in yard_bodies()}
    for upper, lower in (("container-5", "container-1"), ("container-6", "container-2")):
        assert bodies[upper].at_m == (*bodies[lower].at_m[:2], CONTAINER_M[2])
    assert all(body.at_m[2] in (0.0, CONTAINER_M[2]) for body in bodies.values())


def test_nothing_stands_in_anything_else() -> None:
    boxes = [(b.vertices_m.min(0) + b.at_m, b.vertices_m.max(0) + b.at_m) for b in yard_bodies()]
    for i, (low, high) in enumerate(boxes):
        for other_low, other_high in boxes[i + 1 :]:
            assert np.max(np.maximum(low - other_high, other_low - high)) >= -1e-9


def test_containers_share_one_mesh_in_the_glb(samples: Path) -> None:
    data = (samples / "yard.glb").read_bytes()
    magic, version, total = struct.unpack_from("<4sII", data)
    assert (magic, version, total) == (b"glTF", 2, len(data))
    size, kind = struct.unpack_from("<I4s", data, 12)
    assert kind == b"JSON"
    document = json.loads(data[20 : 20 + size])
    assert [node["name"] for node in document["nodes"]] == NAMES
    assert len({node["mesh"] for node in document["nodes"] if node["name"].startswith("container")}) == 1
    assert all(view["byteOffset"] % 4 == 0 for view in document["bufferViews"])


def test_written_numbers_are_exact_and_have_no_negative_zero() -> None:
    vertices = np.array([[0, 0, 0], [1, 0, 0], [0, -1, 0], [0, 0, 2.5]], dtype=np.float64)
    body = Body("b", "b", vertices, np.array([[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]], dtype=np.int32), (0, 1, 0))
    text = stl_text([body]).decode()
    assert text.startswith("solid b\nfacet normal 0.0000 0.0000 -1.0000\n")
    assert "-0.0000" not in text
    assert text.count("vertex") == 12
    assert glb_bytes([body]) == glb_bytes([body])


def test_site_file_lifts_the_containers(samples: Path) -> None:
    config = load_site_config(samples / "yard.site.toml")
    assert config.model.select is not None
    assert fnmatch.filter(NAMES, config.model.select) == NAMES[:6]
    assert config.areas.yard is not None
    assert config.areas.construction is not None
    for body in yard_bodies()[:6]:
        low, high = body.vertices_m.min(0)[:2] + body.at_m[:2], body.vertices_m.max(0)[:2] + body.at_m[:2]
        assert np.all(low > np.min(config.areas.construction, axis=0))
        assert np.all(high < np.max(config.areas.construction, axis=0))
