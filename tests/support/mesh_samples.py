"""Small mesh files of every format, made by script."""

from __future__ import annotations

import io
import json
import zipfile
from typing import Any

import numpy as np
import trimesh
from trimesh.exchange import gltf, obj, off, ply, stl


def box(size: tuple[float, float, float] = (1, 2, 3), at: tuple[float, float, float] = (0, 0, 0)) -> trimesh.Trimesh:
    made = trimesh.creation.box(size)
    made.apply_translation(np.array(at) + np.array(size) / 2)
    return made


def two_boxes() -> trimesh.Trimesh:
    return trimesh.util.concatenate([box(), box(at=(10, 0, 0))])


def scene() -> trimesh.Scene:
    """Return a column twice, and a beam."""
    made = trimesh.Scene()
    made.add_geometry(box(), geom_name="column", node_name="c1")
    moved = trimesh.transformations.translation_matrix((5, 0, 0))
    made.add_geometry(made.geometry["column"], geom_name="column", node_name="c2", transform=moved)
    made.add_geometry(box((4, 1, 1), (0, 0, 5)), geom_name="beam", node_name="b")
    return made


def gltf_files() -> dict[str, bytes]:
    return gltf.export_gltf(scene(), merge_buffers=True)


def with_inline_buffers(files: dict[str, bytes]) -> dict[str, Any]:
    """Return the JSON of a glTF that contains its buffers."""
    import base64

    tree: dict[str, Any] = json.loads(files["model.gltf"])
    for buffer in tree["buffers"]:
        buffer["uri"] = "data:application/octet-stream;base64," + base64.b64encode(files[buffer["uri"]]).decode()
    return tree


def samples() -> dict[str, bytes]:
    """Return the bytes of each sample by file name."""
    lump = two_boxes()
    return {
        "binary.stl": stl.export_stl(lump),
        "text.stl": stl.export_stl_ascii(lump).encode(),
        "a.obj": obj.export_obj(scene()).encode(),
        "binary.ply": ply.export_ply(lump),
        "text.ply": ply.export_ply(lump, encoding="ascii"),
        "a.off": off.export_off(lump).encode(),
        "a.glb": gltf.export_glb(scene()),
        "a.gltf": json.dumps(with_inline_buffers(gltf_files())).encode(),
        "a.3mf": scene().export(file_type="3mf"),
    }


def zipped(parts: dict[str, bytes]) -> bytes:
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in parts.items():
            archive.writestr(name, content)
    return stream.getvalue()
