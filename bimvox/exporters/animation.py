"""A plan as an animated GLB: every part from the yard to its place, on the site's clock, and the crane's axes."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bimvox.crane.kinematics import joints_of
from bimvox.crane.links import links_of
from bimvox.crane.tower_crane import TowerCrane
from bimvox.exporters.mesh import linear_rgba
from bimvox.grid.frame import Label
from bimvox.grid.summed_area import boxes_of
from bimvox.log.moving import tracks_of
from bimvox.log.plan_log import PlanLog
from bimvox.log.schema import of_crane
from bimvox.records.lift import Lift, Status, YardPlace
from bimvox.records.motion import Stay, by_each_crane, stays_of
from bimvox.records.steps import needed_by_ns
from bimvox.records.track import LoadTrack
from bimvox.rendering.page.motions import keyframes
from bimvox.site.component import KIND_RGB, STATE_RGB, Component, ConstructionState, Rgb
from bimvox.site.site import Site

STRAIGHT_M = 0.005
"""Samples this close to the straight line between their neighbours are left out."""
_TURNED = 1e-3
_GONE = 1e-6  # a scale near 0 hides a node: glTF has no other way without extensions
_CRANE_RGB: Rgb = KIND_RGB["crane"]
_CORNERS = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], np.float64)
_FACES = np.array(
    [
        *([0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1]),
        *([2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]),
    ],
    np.int32,
)


def to_animated_glb(log: PlanLog) -> bytes:
    """Return a plan as binary glTF 2.0 with one animation, ``assembly``, in seconds of the site's clock.

    Nodes are named by the parts, name before id, and carry GlobalId, class, name, number and order as extras. Parts of
    later deliveries appear when they arrive; parts that are not lifted stay in the yard. Lying parts are tipped up as
    in the log.
    """
    writer = _GltfWriter()
    site, tracks = log.plan.site, tracks_of(log)
    _surroundings(writer, site)
    arrives: dict[int, int] = {}
    for track in tracks:
        delivery = track.lift.place.delivery if track.lift.place else 0
        arrives[delivery] = min(arrives.get(delivery, track.start_ns), track.start_ns)
    for track in tracks:
        _part(writer, site, track, arrives)
    needed_ns = needed_by_ns(log.all_lifts, log.motions)
    for lift in log.plan.lifts:
        if lift.by_other_means:
            _by_other_means(writer, site, lift, needed_ns[lift.order] or 0)
        elif lift.status is Status.INFEASIBLE and lift.place is not None:
            _left(writer, site, lift, lift.place, arrives)
    for number, crane in enumerate(site.cranes):
        _crane(writer, log, number, crane)
    end_s = max((track.end_ns for track in tracks), default=0) / 1e9
    return writer.to_bytes({"site": site.name, "revision": log.revision, "end_s": end_s, "plan": site.digest})


def _surroundings(writer: _GltfWriter, site: Site) -> None:
    """Add ground, areas, structure and obstructions as boxes of cells."""
    size_m = site.frame.voxel_size_m
    origin_m = np.array(site.frame.origin_m)
    for label, kind in (
        (Label.GROUND, "ground"),
        (Label.CONSTRUCTION_AREA, "construction_area"),
        (Label.YARD, "yard"),
        (Label.STRUCTURE, "structure"),
        (Label.OBSTRUCTION, "obstruction"),
    ):
        boxes = boxes_of(site.labels == label)
        if len(boxes):
            low, high = boxes[:, :3] * size_m + origin_m, boxes[:, 3:] * size_m + origin_m
            vertices, faces = _boxes(low, high)
            writer.node(kind, mesh=writer.mesh(vertices, faces, KIND_RGB.get(kind, (180, 180, 180))))


def _part(writer: _GltfWriter, site: Site, track: LoadTrack, arrives: dict[int, int]) -> None:
    component = site.components[track.lift.component]
    corner_m = site.frame.corner_of(np.array(component.target_vox))
    mesh = writer.mesh(component.mesh.vertices_m - corner_m, component.mesh.faces, STATE_RGB[ConstructionState.UNBUILT])
    node = writer.node(
        component.label,
        mesh=mesh,
        extras={
            "global_id": component.global_id,
            "ifc_class": component.ifc_class,
            "name": component.name,
            "number": track.lift.number,
            "order": track.lift.order,
        },
    )
    time_s = track.time_ns / 1e9
    places = np.concatenate([track.corner_m, track.corner_m[-1:]])
    turns = np.concatenate([track.tilt, track.tilt[-1:]])
    times = np.concatenate([time_s, [max(track.end_ns / 1e9, time_s[-1] + 1e-3)]])
    kept = _kept(times, places)
    writer.move(node, "translation", times[kept], places[kept])
    if (np.abs(turns - turns[0]) > _TURNED).any():
        kept = _kept(times, turns, _TURNED)
        writer.move(node, "rotation", times[kept], turns[kept])
    _appears(writer, node, arrives[track.lift.place.delivery] if track.lift.place else 0)


def _left(writer: _GltfWriter, site: Site, lift: Lift, place: YardPlace, arrives: dict[int, int]) -> None:
    """Add a part that is not lifted, as the boxes of its cells in the yard."""
    component, size_m = site.components[lift.component], site.frame.voxel_size_m
    boxes = place.shape.boxes.astype(np.float64) * size_m
    node = writer.node(
        component.label,
        mesh=writer.mesh(*_boxes(boxes[:, :3], boxes[:, 3:]), STATE_RGB[ConstructionState.UNBUILT]),
        translation_m=site.frame.corner_of(np.array(place.cell_vox)),
        extras=_why(component, lift),
    )
    _appears(writer, node, arrives.get(place.delivery, 0))


def _by_other_means(writer: _GltfWriter, site: Site, lift: Lift, needed_by_ns: int) -> None:
    """Add a part that is set by other means at its place, from when it is needed."""
    component = site.components[lift.component]
    corner_m = site.frame.corner_of(np.array(component.target_vox))
    rgb = STATE_RGB[ConstructionState.ASSEMBLED]
    node = writer.node(
        component.label,
        mesh=writer.mesh(component.mesh.vertices_m - corner_m, component.mesh.faces, rgb),
        translation_m=corner_m,
        extras=_why(component, lift) | {"by_other_means": True},
    )
    _appears(writer, node, needed_by_ns)


def _why(component: Component, lift: Lift) -> dict[str, Any]:
    return {"global_id": component.global_id, "ifc_class": component.ifc_class, "infeasible": lift.reason or ""}


def _appears(writer: _GltfWriter, node: int, arrives_ns: int) -> None:
    """Hide a node until its delivery arrives."""
    if arrives_ns > 0:
        shown = np.array([[_GONE] * 3, [1.0] * 3])
        writer.move(node, "scale", np.array([0.0, arrives_ns / 1e9]), shown, steps=True)


def _crane(writer: _GltfWriter, log: PlanLog, number: int, crane: TowerCrane) -> None:
    """Add the links and the rope, moved by the axes; the names of further cranes' nodes are numbered."""
    samples = [motion.samples() for motion in by_each_crane(log.motions) if motion.crane == number]
    if not samples:
        return
    time_ns = np.concatenate([times for times, _ in samples])
    axes = np.concatenate([values for _, values in samples])
    time_ns, first = np.unique(time_ns, return_index=True)
    times, axes = time_ns / 1e9, axes[first]
    joints, links = joints_of(crane, axes), links_of(crane)
    parent, rope_from = 0, 0
    for joint in links.joints:
        boxes = links.boxes[joint.child]
        low, high = (np.array([box[corner] for box in boxes], np.float64) for corner in (1, 2))
        name = of_crane("mast" if joint.child == "crane_base" else joint.child, number)
        mesh = writer.mesh(*_boxes(low, high), _CRANE_RGB) if boxes else None
        node = writer.node(name, mesh=mesh, translation_m=np.array(joint.origin_m), parent=parent)
        if parent == 0 and log.plan.site.moving is not None:
            _stays(writer, node, [stay for stay in stays_of(log.motions) if stay.crane == number])
        at = joints[:, joint.column]
        if joint.turns:
            _rotate(writer, node, times, at * joint.axis[joint.along], joint.along)
        elif joint.limits is not None:
            moved = at[:, None] * joint.axis
            kept = _kept(times, moved)
            writer.move(node, "translation", times[kept], moved[kept])
        parent, rope_from = node, parent
    _rope(writer, of_crane("rope", number), rope_from, times, joints[:, 2])


def _stays(writer: _GltfWriter, node: int, stays: Sequence[Stay]) -> None:
    """Hide a crane that moves while it does not stand in a set-up."""
    shown = {0: _GONE}
    for stay in stays:
        shown |= {stay.from_ns: 1.0} | ({} if stay.until_ns is None else {stay.until_ns: _GONE})
    at_ns = sorted(shown)
    writer.move(node, "scale", np.array(at_ns) / 1e9, np.array([[shown[at]] * 3 for at in at_ns]), steps=True)


def _rotate(
    writer: _GltfWriter, node: int, times: NDArray[np.float64], angle_rad: NDArray[np.float64], axis: int
) -> None:
    """Rotate a node about an axis, 0 to 2 for x, y, z."""
    turn = np.zeros((len(times), 4))
    turn[:, axis], turn[:, 3] = np.sin(angle_rad / 2), np.cos(angle_rad / 2)
    kept = _kept(times, angle_rad[:, None], _TURNED, longest=np.pi / 4)
    writer.move(node, "rotation", times[kept], turn[kept])


def _rope(
    writer: _GltfWriter, name: str, parent: int, times: NDArray[np.float64], length_m: NDArray[np.float64]
) -> None:
    """Add a rope of these lengths below a node."""
    rope = writer.mesh(*_boxes(np.array([[-0.05, -0.05, -1.0]]), np.array([[0.05, 0.05, 0.0]])), (40, 40, 40))
    node = writer.node(name, mesh=rope, parent=parent)
    scale = np.ones((len(times), 3))
    scale[:, 2] = np.maximum(length_m, _GONE)
    kept = _kept(times, scale)
    writer.move(node, "scale", times[kept], scale[kept])


def _boxes(low: NDArray[np.float64], high: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
    """Return vertices and faces of boxes, (N, 3) lowest and highest corners."""
    vertices = low[:, None, :] + _CORNERS[None] * (high - low)[:, None, :]
    faces = _FACES[None] + 8 * np.arange(len(low), dtype=np.int32)[:, None, None]
    return vertices.reshape(-1, 3), faces.reshape(-1, 3)


def _kept(
    times: NDArray[np.float64], values: NDArray[np.float64], tolerance: float = STRAIGHT_M, longest: float = np.inf
) -> NDArray[np.int64]:
    """Return which samples to keep; see ``keyframes``."""
    return keyframes(times, values, (), lambda points: points, tolerance, longest)


# A small writer of binary glTF 2.0 with animations: meshes, nodes, and channels over time.
#
# trimesh, which writes the other GLB files, does not support animations. Everything is in metres and z up inside one
# root node, which turns it to glTF's y up.

_FLOAT, _UINT32 = 5126, 5125
_ARRAY, _ELEMENTS = 34962, 34963
_KINDS = {1: "SCALAR", 3: "VEC3", 4: "VEC4"}
_TURN = (-np.sqrt(0.5), 0.0, 0.0, np.sqrt(0.5))
"""From z up to y up: a quarter turn about x."""


class _GltfWriter:
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

    def mesh(self, vertices_m: NDArray[np.float64], faces: NDArray[np.int32], rgb: tuple[int, int, int]) -> int:
        """Add a mesh and return its number.

        Vertices ((V, 3)) are in the frame of the nodes that show it, faces (F, 3) indices, ``rgb`` sRGB,
        0..255.
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
