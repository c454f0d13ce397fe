"""A plan as an animated GLB: every part from the yard to its place, on the site's clock, and the crane's axes."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from bimvox.crane.kinematics import joints_of
from bimvox.crane.tower_crane import LuffingJib, TowerCrane
from bimvox.exporters.gltf import GltfWriter
from bimvox.grid.frame import Label
from bimvox.grid.summed_area import boxes_of
from bimvox.log.moving import tracks_of
from bimvox.log.plan_log import PlanLog
from bimvox.log.schema import of_crane
from bimvox.records.lift import Lift, Status, YardPlace
from bimvox.records.steps import needed_by_ns
from bimvox.records.track import LoadTrack
from bimvox.rendering.page.keyframes import keyframes
from bimvox.site.component import Component
from bimvox.site.construction import KIND_RGB, STATE_RGB, ConstructionState, Rgb
from bimvox.site.site import Site

Point = tuple[float, float, float]

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
    writer = GltfWriter()
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


def _surroundings(writer: GltfWriter, site: Site) -> None:
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


def _part(writer: GltfWriter, site: Site, track: LoadTrack, arrives: dict[int, int]) -> None:
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


def _left(writer: GltfWriter, site: Site, lift: Lift, place: YardPlace, arrives: dict[int, int]) -> None:
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


def _by_other_means(writer: GltfWriter, site: Site, lift: Lift, needed_by_ns: int) -> None:
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


def _appears(writer: GltfWriter, node: int, arrives_ns: int) -> None:
    """Hide a node until its delivery arrives."""
    if arrives_ns > 0:
        shown = np.array([[_GONE] * 3, [1.0] * 3])
        writer.move(node, "scale", np.array([0.0, arrives_ns / 1e9]), shown, steps=True)


def _crane(writer: GltfWriter, log: PlanLog, number: int, crane: TowerCrane) -> None:
    """Add mast, jib, trolley and rope, moved by the axes; the names of further cranes' nodes are numbered."""
    samples = [motion.samples() for motion in log.motions if motion.crane == number]
    if not samples:
        return
    time_ns = np.concatenate([times for times, _ in samples])
    axes = np.concatenate([values for _, values in samples])
    time_ns, first = np.unique(time_ns, return_index=True)
    times, axes = time_ns / 1e9, axes[first]
    half, top_m = crane.mast_size_m / 2, crane.jib_height_m
    base = np.array(crane.base_m, np.float64)
    if crane.luffing is not None:
        _luffing_crane(writer, crane, crane.luffing, times, axes, number)
        return
    _box(writer, of_crane("mast", number), (-half, -half, 0.0), (half, half, top_m - base[2]), base)
    low, high = (-0.28 * crane.jib_length_m, -0.4, 0.0), (crane.jib_length_m, 0.4, 1.2)
    jib = _box(writer, of_crane("jib", number), low, high, np.array([base[0], base[1], top_m]))
    _rotate(writer, jib, times, axes[:, 0], 2)
    trolley = writer.node(of_crane("trolley", number), parent=jib)
    out = np.stack([axes[:, 1], np.zeros(len(axes)), np.zeros(len(axes))], axis=1)
    kept = _kept(times, out)
    writer.move(trolley, "translation", times[kept], out[kept])
    _rope(writer, of_crane("rope", number), trolley, times, top_m - axes[:, 2])


def _luffing_crane(
    writer: GltfWriter,
    crane: TowerCrane,
    jib: LuffingJib,
    times: NDArray[np.float64],
    axes: NDArray[np.float64],
    number: int,
) -> None:
    """Add mast or undercarriage, platform, luffing jib and rope, moved by the joints."""
    slewing, luff, rope_m = joints_of(crane, axes).T
    base, half, wide = np.array(crane.base_m, np.float64), crane.mast_size_m / 2, jib.width_m / 2
    pivot_m = jib.pivot_height_m - base[2]
    _box(writer, of_crane("mast", number), (-half, -half, 0.0), (half, half, pivot_m), base)
    tail = jib.tail_width_m / 2
    low = (-jib.tail_radius_m, -tail, jib.tail_low_m - jib.pivot_height_m)
    high = (max(jib.pivot_offset_m, 0.1), tail, 0.0)
    platform = _box(writer, of_crane("platform", number), low, high, base + np.array([0.0, 0.0, pivot_m]))
    _rotate(writer, platform, times, slewing, 2)
    foot = np.array([jib.pivot_offset_m, 0.0, 0.0])
    arm = _box(writer, of_crane("jib", number), (0.0, -wide, -wide), (jib.length_m, wide, wide), foot, platform)
    _rotate(writer, arm, times, -luff, 1)
    tip = writer.node(of_crane("tip", number), translation_m=np.array([jib.length_m, 0.0, 0.0]), parent=arm)
    _rotate(writer, tip, times, luff, 1)
    _rope(writer, of_crane("rope", number), tip, times, rope_m)


def _box(writer: GltfWriter, name: str, low: Point, high: Point, at_m: NDArray[np.float64], parent: int = 0) -> int:
    """Add a node of the crane that shows a box, and return its number."""
    mesh = writer.mesh(*_boxes(np.array([low]), np.array([high])), _CRANE_RGB)
    return writer.node(name, mesh=mesh, translation_m=at_m, parent=parent)


def _rotate(
    writer: GltfWriter, node: int, times: NDArray[np.float64], angle_rad: NDArray[np.float64], axis: int
) -> None:
    """Rotate a node about an axis, 0 to 2 for x, y, z."""
    turn = np.zeros((len(times), 4))
    turn[:, axis], turn[:, 3] = np.sin(angle_rad / 2), np.cos(angle_rad / 2)
    kept = _kept(times, angle_rad[:, None], _TURNED, longest=np.pi / 4)
    writer.move(node, "rotation", times[kept], turn[kept])


def _rope(
    writer: GltfWriter, name: str, parent: int, times: NDArray[np.float64], length_m: NDArray[np.float64]
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
