"""A tiny hand-made site and plan: two columns with a beam, one obstruction, with or without a crane."""

from __future__ import annotations

import dataclasses
import hashlib
import io
from typing import Any

import numpy as np

from bimvox.bim.building import TriangleMesh
from bimvox.crane.load_chart import LoadChart
from bimvox.crane.tower_crane import AxisLimits, TowerCrane
from bimvox.grid.frame import GridFrame, Label
from bimvox.log.plan_log import LogEvent, PlanLog
from bimvox.log.recorder import write_log
from bimvox.motion.swept import axes_of_cells, load_frame
from bimvox.records.lift import Lift, LiftPlan, Method, ModelledClash, Status, YardPlace
from bimvox.records.motion import LiftMotion, Phase, PhaseName, Trajectory
from bimvox.site.component import Component, IntVec, StoredPose, shape_of, stored_shape
from bimvox.site.site import Blocker, Rules, Site, SwingRule

FRAME = GridFrame((-2.0, -3.0, -1.0), 1.0)
CRANE = TowerCrane(
    name="test crane",
    base_m=(9.5, -2.5, 0.0),
    mast_size_m=1.0,
    jib_height_m=14.3,
    jib_length_m=20.0,
    min_radius_m=2.0,
    sling_m=1.7,
    rigging_mass_kg=300.0,
    slewing=AxisLimits(0.08, 0.005, 0.01),
    trolley=AxisLimits(1.2, 0.3, 0.4),
    hoist=AxisLimits(1.1, 0.4, 0.5),
    chart=LoadChart((2.0, 12.0, 20.0), (12000.0, 7000.0, 3000.0)),
)


def box_mesh(low: Any, high: Any) -> TriangleMesh:
    """Return the twelve triangles of a box."""
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], np.float64)
    faces = "013 032 465 576 041 145 237 276 024 264 153 357".replace(" ", "")
    return TriangleMesh(
        np.asarray(low) + corners * (np.asarray(high, np.float64) - np.asarray(low)),
        np.array([int(c) for c in faces], np.int32).reshape(-1, 3),
    )


def box_cells(low: IntVec, high: IntVec) -> np.ndarray[Any, Any]:
    """Return the cells of a half-open box."""
    return np.stack(np.meshgrid(*map(np.arange, low, high), indexing="ij"), axis=-1).reshape(-1, 3).astype(np.int32)


def component(index: int, name: str, low: IntVec, high: IntVec, **more: Any) -> Component:
    """Return a box-shaped component at its place."""
    shape, target = shape_of(box_cells(low, high))
    mesh = box_mesh(FRAME.corner_of(low) + 0.1 / 3.0, FRAME.corner_of(high) - 0.1)
    size = shape.size_vox
    return Component(
        index=index,
        id=f"0GlobalId{name}",
        global_id=f"0GlobalId{name}",
        ifc_class="IfcBeam" if name == "Beam" else "IfcColumn",
        name=name,
        shape=shape,
        target_vox=target,
        mesh=mesh,
        mass_kg=2400.0 * float(mesh.signed_volume_m3),
        hook_offset_vox=(size[0] // 2, size[1] // 2, size[2]),
        **more,
    )


def tiny_site(*, crane: bool = True) -> Site:
    """Return a site of 12 x 10 x 9 cells of 1 m: ground slab, an obstruction, two columns and a beam on them."""
    shape = (12, 10, 9)
    labels = np.zeros(shape, np.uint8)
    labels[:, :, 0] = Label.GROUND
    labels[4:10, 4:9, 0] = Label.CONSTRUCTION_AREA
    obstruction = box_cells((7, 2, 1), (8, 4, 3))
    labels[tuple(obstruction.T)] = Label.OBSTRUCTION
    yard = np.zeros(shape[:2], np.bool_)
    yard[:4] = True
    components = (
        component(
            0, "ColumnA", (5, 5, 1), (6, 6, 4), erected=True, start_vox=(0, 0, 1), stored_pose=StoredPose.LYING_X
        ),
        component(1, "ColumnB", (8, 5, 1), (9, 6, 4), erected=True, before=("0GlobalIdBeam",)),
        component(2, "Beam", (5, 5, 4), (9, 6, 5), after=("0GlobalIdColumnA", "0GlobalIdColumnB")),
    )
    blockers = (
        Blocker("ground", "ground", box_cells((0, 0, 0), (12, 10, 1))),
        Blocker("truck-7", "obstruction", obstruction),
        Blocker("0GlobalIdWall", "structure", box_cells((11, 9, 1), (12, 10, 3)), box_mesh((9, 6, 0), (9.9, 6.9, 2))),
    )
    ifc = np.eye(4)
    ifc[:3, 3] = (1000.1, 2000.2, 1.0 / 3.0)
    return Site(
        name="tiny",
        frame=FRAME,
        labels=labels,
        blockers=blockers,
        components=components,
        cranes=(CRANE,) if crane else (),
        rules=Rules(contact_tolerance_m=0.012, swing=SwingRule.OFF),
        yard=yard,
        site_to_ifc=ifc,
        source={"name": "tiny.ifc", "sha256": "ab" * 32, "unit_assumed": False, "scale": 0.3048},
        geometry_digest=hashlib.sha256(b"geometry").hexdigest(),
        digest=hashlib.sha256(b"site").hexdigest(),
    )


def walk(start: IntVec, target: IntVec, up: int) -> np.ndarray[Any, Any]:
    """Return a path up, along x, along y, and down to the target."""
    cells = [start]
    for axis, goal in ((2, up), (0, target[0]), (1, target[1]), (2, target[2])):
        while cells[-1][axis] != goal:
            cell = list(cells[-1])
            cell[axis] += 1 if goal > cell[axis] else -1
            cells.append((cell[0], cell[1], cell[2]))
    return np.array(cells, np.int32)


def tiny_plan(*, crane: bool = True) -> LiftPlan:
    """Return a plan: column A and the beam planned, column B infeasible in between, the beam in the second delivery."""
    site = tiny_site(crane=crane)
    lying = StoredPose.LYING_X

    def lift(index: int, order: int, delivery: int, pose: StoredPose, cell: IntVec, **more: Any) -> Lift:
        place = YardPlace(delivery, pose, stored_shape(site.components[index].shape, pose), cell)
        return Lift(index, order, place, **more)

    return LiftPlan(
        site,
        (
            lift(
                0, 0, 0, lying, (0, 0, 1), status=Status.PLANNED, method=Method.POLICY,
                path_vox=walk((0, 0, 2), (5, 5, 1), 5), shortest_moves=15, contact_moves=0,
            ),
            lift(
                1, 1, 0, lying, (0, 3, 1), status=Status.INFEASIBLE,
                reason="the obstruction stands on its place", blocked_by=("truck-7",),
            ),
            lift(
                2, 2, 1, StoredPose.AS_BUILT, (0, 0, 1), status=Status.PLANNED, method=Method.SEARCH,
                path_vox=walk((0, 0, 2), (5, 5, 4), 6), shortest_moves=14, contact_moves=2,
            ),
        ),
        clashes=(
            ModelledClash("0GlobalIdColumnA", "0GlobalIdBeam", 0.1 / 3.0, (0.0, 0.0, -0.1 / 3.0)),
            ModelledClash("0GlobalIdColumnB", "0GlobalIdBeam", 0.25, None),
        ),
        notes=("nothing supports the far end of the beam",),
    )  # fmt: skip


def same(first: Any, second: Any, where: str = "", *, tolerance: float = 0.0) -> None:
    """Assert that two values are equal at every level, exactly (floats within ``tolerance``)."""
    assert type(first) is type(second), where
    if dataclasses.is_dataclass(first):
        for field in dataclasses.fields(first):
            same(getattr(first, field.name), getattr(second, field.name), f"{where}.{field.name}", tolerance=tolerance)
    elif isinstance(first, np.ndarray):
        assert first.dtype == second.dtype, where
        np.testing.assert_allclose(first, second, rtol=0, atol=tolerance, err_msg=where)
    elif isinstance(first, tuple):
        assert len(first) == len(second), where
        for n, (a, b) in enumerate(zip(first, second, strict=True)):
            same(a, b, f"{where}[{n}]", tolerance=tolerance)
    elif isinstance(first, dict):
        assert sorted(first) == sorted(second), where
        for key in first:
            same(first[key], second[key], f"{where}[{key!r}]", tolerance=tolerance)
    elif isinstance(first, float):
        assert abs(first - second) <= tolerance, where
    else:
        assert first == second, where


def tiny_motions(plan: LiftPlan) -> tuple[LiftMotion, ...]:
    """Return hand-made motions of the planned lifts: hook on, raise, up, across, down, set, release; 0.5 s a sample."""
    crane, frame = plan.site.cranes[0], plan.site.frame
    assert crane is not None
    motions: list[LiftMotion] = []
    hook: Any = None
    for lift in plan.lifts:
        if lift.path_vox is None or lift.place is None:
            continue
        load = load_frame(crane, frame, plan.site.components[lift.component].hook_line_vox)
        start_ns = motions[-1].end_ns if motions else 0
        path = axes_of_cells(load, lift.path_vox)
        path[:, 0] = np.unwrap(path[:, 0])
        low = path[0] - (0.0, 0.0, frame.voxel_size_m)
        first = low
        if lift.place.pose is not StoredPose.AS_BUILT:
            head = np.array([[2, 0, 0]]) + lift.place.cell_vox
            first = axes_of_cells(load, head)[0]
            first[2] = low[2] - 2.0 * frame.voxel_size_m
        at, spans, parts = 0, [], []
        if hook is not None:
            up = np.array([0.0, 0.0, 3.0])
            parts.append(_trajectory(np.stack([hook, hook + up, first + up, first]), at, 31.5))
            spans.append((PhaseName.APPROACH, _length(parts[-1])))
            at += spans[-1][1]
        spans.append((PhaseName.HOOK_ON, 60 * NS))
        at += spans[-1][1]
        parts.append(_trajectory(np.stack([first, *([low] if first is not low else []), path[0]]), at, 3.0))
        spans.append((PhaseName.RAISE, _length(parts[-1]) + 10 * NS))
        at += spans[-1][1]
        parts.append(_trajectory(path, at, 40.0 / 3.0))
        length = _length(parts[-1])
        spans += [(PhaseName.HOIST, length // 4), (PhaseName.TRAVERSE, length // 2)]
        spans += [(PhaseName.LOWER, length - length // 4 - length // 2)]
        spans += [(PhaseName.SET, 120 * NS), (PhaseName.RELEASE, 30 * NS)]
        phases, now = [], start_ns
        for name, span in spans:
            phases.append(Phase(name, now, now + span))
            now += span
        approach = parts[0] if len(parts) == 3 else None
        motions.append(
            LiftMotion(lift.order, lift.component, approach, parts[-2], parts[-1], tuple(phases), start_ns, now)
        )
        hook = path[-1]
    return tuple(motions)


NS = 1_000_000_000


def _trajectory(points: np.ndarray[Any, Any], start_ns: int, bound_s: float) -> Trajectory:
    """Return a trajectory with one second from point to point, two samples each."""
    steps = np.linspace(0, len(points) - 1, 2 * len(points) - 1)
    axes = np.stack([np.interp(steps, np.arange(len(points)), column) for column in points.T], axis=1)
    slew, radius, height = (np.ascontiguousarray(column) for column in axes.T)
    time_ns = start_ns + np.round(steps * NS).astype(np.int64)
    least_s = min(bound_s, float(time_ns[-1] - time_ns[0]) / 1e9)
    return Trajectory(time_ns, slew, radius, height, np.arange(2, len(steps) - 1, 2, dtype=np.int64), least_s)


def _length(trajectory: Trajectory) -> int:
    return int(trajectory.time_ns[-1] - trajectory.time_ns[0])


def tiny_log(*, crane: bool = True) -> PlanLog:
    """Return the whole log, with the inputs of the plan."""
    plan = tiny_plan(crane=crane)
    return PlanLog(
        plan=plan,
        motions=tiny_motions(plan) if crane else (),
        attachments={"site.toml": b"[model]\npath = 'tiny.ifc'\n", "obstructions.json": b'{"version": 1}'},
        metadata={"seed": "7", "policy": "p-123"},
        revision=3,
        events=(LogEvent("replan", 5 * NS, 6 * NS + 1, {"changed_cells": "12"}),),
    )


def log_bytes(record: PlanLog) -> bytes:
    """Return a log as the bytes of a file."""
    stream = io.BytesIO()
    write_log(stream, record)
    return stream.getvalue()
