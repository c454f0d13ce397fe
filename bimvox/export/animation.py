"""A plan as an animated GLB: every part from the yard to its place, on the site's clock, and the crane's axes."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bimvox.crane.kinematics import joints_of
from bimvox.crane.luffing import LuffingJib
from bimvox.crane.tower_crane import TowerCrane
from bimvox.export.gltf import GltfWriter
from bimvox.grid.boxes import boxes_of
from bimvox.grid.labels import Label
from bimvox.log.plan_log import PlanLog
from bimvox.log.recorder import tracks_of
from bimvox.log.schema import of_crane
from bimvox.records.lift import Lift, Status, YardPlace
from bimvox.records.track import LoadTrack
from bimvox.site.construction import KIND_RGB, STATE_RGB, ConstructionState, Rgb
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

    Nodes are named by the parts' ids and carry GlobalId, class, name, number and order as extras. Parts of later
    deliveries appear when they arrive; parts that are not lifted stay in the yard. Lying parts are tipped up as in the
    log.
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
    for lift in log.plan.lifts:
        if lift.status is Status.INFEASIBLE and lift.place is not None:
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
        component.id,
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
    kept = _corners(times, places, STRAIGHT_M)
    writer.move(node, "translation", times[kept], places[kept])
    if (np.abs(turns - turns[0]) > _TURNED).any():
        kept = _corners(times, turns, _TURNED)
        writer.move(node, "rotation", times[kept], turns[kept])
    _appears(writer, node, arrives[track.lift.place.delivery] if track.lift.place else 0)


def _left(writer: GltfWriter, site: Site, lift: Lift, place: YardPlace, arrives: dict[int, int]) -> None:
    """Add a part that is not lifted, as the boxes of its cells in the yard."""
    component, size_m = site.components[lift.component], site.frame.voxel_size_m
    boxes = place.shape.boxes.astype(np.float64) * size_m
    node = writer.node(
        component.id,
        mesh=writer.mesh(*_boxes(boxes[:, :3], boxes[:, 3:]), STATE_RGB[ConstructionState.UNBUILT]),
        translation_m=site.frame.corner_of(np.array(place.cell_vox)),
        extras={"global_id": component.global_id, "ifc_class": component.ifc_class, "infeasible": lift.reason or ""},
    )
    _appears(writer, node, arrives.get(place.delivery, 0))


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
    mast = _boxes(np.array([[-half, -half, 0.0]]), np.array([[half, half, top_m - base[2]]]))
    writer.node(of_crane("mast", number), mesh=writer.mesh(*mast, _CRANE_RGB), translation_m=base)
    beam = _boxes(np.array([[-0.28 * crane.jib_length_m, -0.4, 0.0]]), np.array([[crane.jib_length_m, 0.4, 1.2]]))
    jib = writer.node(
        of_crane("jib", number), mesh=writer.mesh(*beam, _CRANE_RGB), translation_m=np.array([base[0], base[1], top_m])
    )
    halves = axes[:, 0] / 2
    turn = np.stack([np.zeros_like(halves), np.zeros_like(halves), np.sin(halves), np.cos(halves)], axis=1)
    kept = _corners(times, axes[:, :1], _TURNED, longest=np.pi / 4)
    writer.move(jib, "rotation", times[kept], turn[kept])
    trolley = writer.node(of_crane("trolley", number), parent=jib)
    out = np.stack([axes[:, 1], np.zeros(len(axes)), np.zeros(len(axes))], axis=1)
    kept = _corners(times, out, STRAIGHT_M)
    writer.move(trolley, "translation", times[kept], out[kept])
    rope = writer.mesh(*_boxes(np.array([[-0.05, -0.05, -1.0]]), np.array([[0.05, 0.05, 0.0]])), (40, 40, 40))
    node = writer.node(of_crane("rope", number), mesh=rope, parent=trolley)
    scale = np.ones((len(axes), 3))
    scale[:, 2] = np.maximum(top_m - axes[:, 2], _GONE)
    kept = _corners(times, scale, STRAIGHT_M)
    writer.move(node, "scale", times[kept], scale[kept])


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
    mast = _boxes(np.array([[-half, -half, 0.0]]), np.array([[half, half, pivot_m]]))
    writer.node(of_crane("mast", number), mesh=writer.mesh(*mast, _CRANE_RGB), translation_m=base)
    tail = jib.tail_width_m / 2
    deck = _boxes(
        np.array([[-jib.tail_radius_m, -tail, jib.tail_low_m - jib.pivot_height_m]]),
        np.array([[max(jib.pivot_offset_m, 0.1), tail, 0.0]]),
    )
    platform = writer.node(
        of_crane("platform", number),
        mesh=writer.mesh(*deck, _CRANE_RGB),
        translation_m=base + np.array([0.0, 0.0, pivot_m]),
    )
    none = np.zeros(len(axes))
    kept = _corners(times, slewing[:, None], _TURNED, longest=np.pi / 4)
    writer.move(
        platform,
        "rotation",
        times[kept],
        np.stack([none, none, np.sin(slewing / 2), np.cos(slewing / 2)], axis=1)[kept],
    )
    beam = _boxes(np.array([[0.0, -wide, -wide]]), np.array([[jib.length_m, wide, wide]]))
    arm = writer.node(
        of_crane("jib", number),
        mesh=writer.mesh(*beam, _CRANE_RGB),
        translation_m=np.array([jib.pivot_offset_m, 0.0, 0.0]),
        parent=platform,
    )
    kept = _corners(times, luff[:, None], _TURNED, longest=np.pi / 4)
    up = np.stack([none, -np.sin(luff / 2), none, np.cos(luff / 2)], axis=1)
    writer.move(arm, "rotation", times[kept], up[kept])
    tip = writer.node(of_crane("tip", number), translation_m=np.array([jib.length_m, 0.0, 0.0]), parent=arm)
    writer.move(tip, "rotation", times[kept], (up * [1.0, -1.0, 1.0, 1.0])[kept])
    line = writer.mesh(*_boxes(np.array([[-0.05, -0.05, -1.0]]), np.array([[0.05, 0.05, 0.0]])), (40, 40, 40))
    rope = writer.node(of_crane("rope", number), mesh=line, parent=tip)
    scale = np.stack([none + 1.0, none + 1.0, np.maximum(rope_m, _GONE)], axis=1)
    kept = _corners(times, scale, STRAIGHT_M)
    writer.move(rope, "scale", times[kept], scale[kept])


def _boxes(low: NDArray[np.float64], high: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
    """Return vertices and faces of boxes, (N, 3) lowest and highest corners."""
    vertices = low[:, None, :] + _CORNERS[None] * (high - low)[:, None, :]
    faces = _FACES[None] + 8 * np.arange(len(low), dtype=np.int32)[:, None, None]
    return vertices.reshape(-1, 3), faces.reshape(-1, 3)


def _corners(
    times: NDArray[np.float64], values: NDArray[np.float64], tolerance: float, longest: float = np.inf
) -> NDArray[np.int64]:
    """Return which samples to keep so that straight lines between them stay within ``tolerance`` of all samples.

    Ramer-Douglas-Peucker over time. ``longest`` limits the change between two kept samples, because a rotation by more
    than half a circle would be interpolated the other way round.
    """
    kept = {0, len(times) - 1}
    spans: list[tuple[int, int]] = [(0, len(times) - 1)]
    while spans:
        first, last = spans.pop()
        if last - first < 2:
            continue
        inside = slice(first + 1, last)
        share = (times[inside] - times[first]) / (times[last] - times[first])
        line = values[first] + share[:, None] * (values[last] - values[first])
        away = np.linalg.norm(values[inside] - line, axis=1)
        worst = int(away.argmax()) + first + 1
        if away[worst - first - 1] > tolerance or np.abs(values[last] - values[first]).max() > longest:
            middle = worst if away[worst - first - 1] > tolerance else (first + last) // 2
            kept.add(middle)
            spans += [(first, middle), (middle, last)]
    return np.array(sorted(kept), np.int64)
