"""A small writer of binary glTF 2.0 with animations: meshes, nodes, and channels over time.

trimesh, which writes the other GLB files, does not support animations. Everything is in metres and z up inside one root
node, which turns it to glTF's y up.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bimvox.exporters.mesh import linear_rgba

_FLOAT, _UINT32 = 5126, 5125
_ARRAY, _ELEMENTS = 34962, 34963
_KINDS = {1: "SCALAR", 3: "VEC3", 4: "VEC4"}
_TURN = (-np.sqrt(0.5), 0.0, 0.0, np.sqrt(0.5))
"""From z up to y up: a quarter turn about x."""


class GltfWriter:
    """Collects a scene and returns its bytes."""

    def __init__(self) -> None:
        self._binary = bytearray()
        self._views: list[dict[str, Any]] = []
        self._accessors: list[dict[str, Any]] = []
        self._materials: dict[tuple[int, int, int], int] = {}
        self._meshes: list[dict[str, Any]] = []
        self._nodes: list[dict[str, Any]] = [{"name": "site", "rotation": [round(float(q), 9) for q in _TURN]}]
        self._samplers: list[dict[str, Any]] = []
        self._channels: list[dict[str, Any]] = []
        self._times: dict[bytes, int] = {}

    def mesh(
        self,
        vertices_m: NDArray[np.float64],
        faces: NDArray[np.int32],
        rgb: tuple[int, int, int],
    ) -> int:
        """Add a mesh and return its number.

        Args:
            vertices_m: (V, 3) in the frame of the nodes that show it.
            faces: (F, 3) indices.
            rgb: Colour, sRGB, 0..255.
        """
        positions = self._accessor(np.asarray(vertices_m, np.float32), _ARRAY, bounds=True)
        indices = self._accessor(np.asarray(faces, np.uint32).reshape(-1), _ELEMENTS)
        material = self._materials.setdefault(rgb, len(self._materials))
        primitive = {"attributes": {"POSITION": positions}, "indices": indices, "material": material}
        self._meshes.append({"primitives": [primitive]})
        return len(self._meshes) - 1

    def node(
        self,
        name: str,
        *,
        mesh: int | None = None,
        parent: int = 0,
        translation_m: NDArray[np.float64] | None = None,
        extras: Mapping[str, Any] | None = None,
    ) -> int:
        """Add a node and return its number; ``parent`` 0 is the site, z up, in metres."""
        node: dict[str, Any] = {"name": name}
        if mesh is not None:
            node["mesh"] = mesh
        if translation_m is not None:
            node["translation"] = [float(np.float32(value)) for value in translation_m]
        if extras:
            node["extras"] = dict(extras)
        self._nodes.append(node)
        self._nodes[parent].setdefault("children", []).append(len(self._nodes) - 1)
        return len(self._nodes) - 1

    def move(
        self, node: int, path: str, time_s: NDArray[np.float64], values: NDArray[np.float64], *, steps: bool = False
    ) -> None:
        """Animate a node.

        Args:
            node: Its number.
            path: ``translation`` (N, 3) m, ``rotation`` (N, 4) quaternion x, y, z, w, or ``scale`` (N, 3).
            time_s: (N,) strictly ascending, not negative.
            values: (N, 3 or 4) at those times.
            steps: Whether a value holds until the next one; otherwise it is interpolated linearly.
        """
        self._nodes[node][path] = [float(np.float32(value)) for value in values[0]]
        if len(time_s) == 1:
            return
        times = np.asarray(time_s, np.float32)
        key = times.tobytes()
        if key not in self._times:
            self._times[key] = self._accessor(times, None, bounds=True)
        output = self._accessor(np.asarray(values, np.float32), None)
        interpolation = "STEP" if steps else "LINEAR"
        self._samplers.append({"input": self._times[key], "output": output, "interpolation": interpolation})
        target = {"node": node, "path": path}
        self._channels.append({"sampler": len(self._samplers) - 1, "target": target})

    def to_bytes(self, extras: Mapping[str, Any]) -> bytes:
        """Return the GLB; ``extras`` are plain values for the scene."""
        document: dict[str, Any] = {
            "asset": {"version": "2.0", "generator": "bimvox"},
            "scene": 0,
            "scenes": [{"nodes": [0], "extras": dict(extras)}],
            "nodes": self._nodes,
            "meshes": self._meshes,
            "materials": [_material(rgb) for rgb in self._materials],
            "accessors": self._accessors,
            "bufferViews": self._views,
            "buffers": [{"byteLength": len(self._binary)}],
        }
        if self._channels:
            document["animations"] = [{"name": "assembly", "samplers": self._samplers, "channels": self._channels}]
        text = json.dumps(document, separators=(",", ":"), allow_nan=False).encode()
        text += b" " * (-len(text) % 4)
        binary = bytes(self._binary) + b"\0" * (-len(self._binary) % 4)
        length = 12 + 8 + len(text) + 8 + len(binary)
        head = b"glTF" + _uint(2) + _uint(length)
        return head + _uint(len(text)) + b"JSON" + text + _uint(len(binary)) + b"BIN\0" + binary

    def _accessor(self, array: NDArray[Any], target: int | None, *, bounds: bool = False) -> int:
        """Add an array and return its accessor's number."""
        width = 1 if array.ndim == 1 else array.shape[1]
        view: dict[str, Any] = {"buffer": 0, "byteOffset": len(self._binary), "byteLength": array.nbytes}
        if target is not None:
            view["target"] = target
        self._views.append(view)
        self._binary += np.ascontiguousarray(array).tobytes()
        accessor: dict[str, Any] = {
            "bufferView": len(self._views) - 1,
            "componentType": _UINT32 if array.dtype == np.uint32 else _FLOAT,
            "count": len(array),
            "type": _KINDS[width],
        }
        if bounds:
            rows = array.reshape(len(array), width)
            accessor["min"], accessor["max"] = rows.min(axis=0).tolist(), rows.max(axis=0).tolist()
        self._accessors.append(accessor)
        return len(self._accessors) - 1


def _material(rgb: tuple[int, int, int]) -> dict[str, Any]:
    colour = linear_rgba(rgb).tolist()
    return {
        "pbrMetallicRoughness": {"baseColorFactor": colour, "metallicFactor": 0.0, "roughnessFactor": 0.9},
        "doubleSided": True,
    }


def _uint(value: int) -> bytes:
    return value.to_bytes(4, "little")
