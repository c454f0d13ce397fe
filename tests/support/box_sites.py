"""Small sites made of boxes, for tests that need a whole site but no file."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from bimvox.bim.building import TriangleMesh
from bimvox.crane.load_chart import LoadChart
from bimvox.crane.tower_crane import AxisLimits, TowerCrane
from bimvox.grid.frame import GridFrame, Label
from bimvox.site.build import labels_of
from bimvox.site.component import Component, shape_of
from bimvox.site.site import GROUND_ID, Blocker, Rules, Site

_FACES = np.array(
    [
        [0, 2, 1],
        [1, 2, 3],
        [4, 5, 6],
        [5, 7, 6],
        [0, 1, 4],
        [1, 5, 4],
        [2, 6, 3],
        [3, 6, 7],
        [0, 4, 2],
        [2, 4, 6],
        [1, 3, 5],
        [3, 7, 5],
    ],
    np.int32,
)

PORTAL = [
    ("slab", (1.0, 1.0, 3.4), (5.0, 2.0, 3.6)),
    ("beam", (1.0, 1.4, 3.0), (5.0, 1.6, 3.4)),
    ("left", (1.0, 1.4, 0.0), (1.2, 1.6, 2.98), {"ifc_class": "IfcColumn", "erected": True}),
    ("right", (4.8, 1.4, 0.0), (5.0, 1.6, 2.98), {"ifc_class": "IfcColumn", "erected": True}),
]
"""A beam and a slab on two columns."""


def box_mesh(low, high) -> TriangleMesh:
    corners = np.array(list(itertools.product(*zip(low, high, strict=True))), float)[:, ::1]
    # product varies x slowest; the faces expect x fastest
    corners = corners[[0, 4, 2, 6, 1, 5, 3, 7]]
    mesh = TriangleMesh(corners, _FACES)
    assert mesh.signed_volume_m3 > 0
    return mesh


def box_cells(frame: GridFrame, low, high) -> np.ndarray:
    first, last = frame.cells_over(low, high)
    return np.argwhere(np.ones(last - first, bool)).astype(np.int32) + first.astype(np.int32)


def _hook_above_the_middle(frame: GridFrame, low, high, target, size) -> dict:
    at = ((np.array(low) + high)[:2] / 2 - frame.origin_m[:2]) / frame.voxel_size_m - target[:2]
    cell = np.clip(np.floor(at + 1e-6), 0, np.array(size[:2]) - 1).astype(int)
    aside = np.clip(at - cell - 0.5, -0.4999, 0.4999).round(9)
    return {"hook_offset_vox": (*cell.tolist(), size[2]), "hook_aside_vox": tuple(aside.tolist())}


def box_component(frame: GridFrame, index: int, name: str, low, high, **more) -> Component:
    shape, target = shape_of(box_cells(frame, low, high))
    size = shape.size_vox
    return Component(
        index=index,
        id=name,
        global_id=name,
        ifc_class=more.pop("ifc_class", "IfcBeam"),
        name=name,
        shape=shape,
        target_vox=target,
        mesh=box_mesh(low, high),
        mass_kg=float(np.prod(np.array(high) - np.array(low)) * 2400),
        **{**_hook_above_the_middle(frame, low, high, target, size), **more},
    )


def test_crane(base=(0.0, 0.0, 0.0), jib=60.0, height=30.0) -> TowerCrane:
    return TowerCrane(
        "test",
        base,
        1.6,
        height,
        jib,
        2.0,
        1.0,
        500.0,
        AxisLimits(0.08, 0.01, 0.01),
        AxisLimits(1.0, 0.25, 0.5),
        AxisLimits(0.7, 0.25, 0.5),
        LoadChart((2.0, 20.0, jib), (20_000.0, 20_000.0, 8_000.0)),
    )


test_crane.__test__ = False


def box_site(
    parts: Sequence[tuple],
    *,
    shape=(40, 30, 20),
    voxel_size_m=0.5,
    yard=((20.0, 0.0), (40.0, 30.0)),
    structure: Sequence[tuple] = (),
    obstructions: Sequence[tuple] = (),
    crane=None,
    rules=None,
) -> Site:
    """Return a site of (name, low, high[, options]) parts, structure, obstructions, metres; yard: a box of cells."""
    frame = GridFrame((0.0, 0.0, -voxel_size_m), voxel_size_m)
    components = tuple(
        box_component(frame, n, part[0], part[1], part[2], **(part[3] if len(part) > 3 else {}))
        for n, part in enumerate(parts)
    )
    labels = np.zeros(shape, np.uint8)
    labels[:, :, 0] = Label.GROUND
    yard_cells = np.zeros(shape[:2], bool)
    (x0, y0), (x1, y1) = yard
    yard_cells[int(x0) : int(x1), int(y0) : int(y1)] = True
    ground = np.argwhere(labels == Label.GROUND).astype(np.int32)
    blockers = [Blocker(GROUND_ID, "ground", ground)]
    for name, low, high in structure:
        blockers.append(Blocker(name, "structure", box_cells(frame, low, high), box_mesh(low, high)))
    for name, low, high in obstructions:
        blockers.append(Blocker(name, "obstruction", box_cells(frame, low, high)))
    site = Site(
        name="boxes",
        frame=frame,
        labels=labels,
        blockers=tuple(blockers),
        components=components,
        cranes=() if crane is None else (crane,),
        rules=rules or Rules(rope=crane is not None),
        yard=yard_cells,
        site_to_ifc=np.eye(4),
    )
    return replace(site, labels=labels_of(site))
