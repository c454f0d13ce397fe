"""The construction as a 3-D scene: every part as boxes, coloured by its state, sent again when its state changes."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from foxglove_schemas_protobuf.CubePrimitive_pb2 import CubePrimitive
from foxglove_schemas_protobuf.SceneEntity_pb2 import SceneEntity
from foxglove_schemas_protobuf.SceneEntityDeletion_pb2 import SceneEntityDeletion
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate
from numpy.typing import NDArray

from bimvox.crane.outline import HOOK_BLOCK_M, counter_jib_m
from bimvox.crane.tower_crane import LuffingJib, TowerCrane
from bimvox.grid.frame import GridFrame, Label
from bimvox.grid.summed_area import boxes_of
from bimvox.kept import kept
from bimvox.log import schema as topics
from bimvox.log.colours import KIND_RGBA, STATE_RGBA, ConstructionState, Rgba
from bimvox.log.mcap.messages import colour, pairs, pose, stamp, vector
from bimvox.log.states import StatesAtStarts
from bimvox.records.lift import Lift, YardPlace
from bimvox.records.track import LiftTimes
from bimvox.site.component import Component
from bimvox.site.site import CRANE_ID, GROUND_ID, Blocker, Site

States = Mapping[int, ConstructionState | None]
"""States of components by their index; None: not to be seen. Of the others the state is as it was."""

Boxes = dict[str, tuple[tuple[float, float, float], tuple[float, float, float]]]
"""Lowest corner and size of boxes, by the frame that they move with."""

_HOOK_BLOCK = ((-HOOK_BLOCK_M[0] / 2, -HOOK_BLOCK_M[1] / 2, 0.0), HOOK_BLOCK_M)


def component_frame(component_id: str) -> str:
    """Return the name of the frame in the lowest corner of a component's reference cell."""
    return f"component/{component_id}"


@dataclass(slots=True)
class SceneUpdates:
    """Makes the updates of ``/scene`` and remembers what was sent.

    Attributes:
        site: The site.
        lifts: Lifts by component index.
        sent: The states that the viewer shows now.
    """

    site: Site
    lifts: Mapping[int, Lift]
    sent: dict[int, ConstructionState]

    def fixed(self, time_ns: int) -> Any:
        """Return the update that draws ground, areas, existing structure, obstructions and the crane."""
        entities = [entity for blocker in self.site.blockers for entity in self._blocker_entities(blocker, time_ns)]
        for number, crane in enumerate(self.site.cranes):
            entities += self._crane_entities(crane, number, time_ns)
        return SceneUpdate(entities=entities)

    def afresh(self, time_ns: int) -> Any:
        """Return the same for viewers that already show something: everything shown before is deleted."""
        update = self.fixed(time_ns)
        update.deletions.append(SceneEntityDeletion(timestamp=stamp(time_ns), type=SceneEntityDeletion.ALL))
        self.sent = {}
        return update

    def change(self, states: States, time_ns: int) -> Any | None:
        """Return the update from what was sent to ``states``; None if nothing changes."""
        gone = [index for index, state in states.items() if state is None and index in self.sent]
        changed = [index for index, state in states.items() if self.sent.get(index) is not state and state is not None]
        if not gone and not changed:
            return None
        for index in gone:
            del self.sent[index]
        deletions = [
            SceneEntityDeletion(
                timestamp=stamp(time_ns), type=SceneEntityDeletion.MATCHING_ID, id=self.site.components[index].id
            )
            for index in sorted(gone)
        ]
        update, begins = SceneUpdate(deletions=deletions), SceneEntity(timestamp=stamp(time_ns)).SerializeToString()
        for index in sorted(changed):
            lift = self.lifts[index]
            part, state = self.site.components[index], states[index]
            assert state is not None
            self.sent[index] = state
            # Protobuf merges concatenated messages into one with all fields.
            rest = _entity_bytes(part, lift.place, lift.order, state, self.site.frame)
            update.entities.add().MergeFromString(begins + rest)
        return update

    def _blocker_entities(self, blocker: Blocker, time_ns: int) -> list[Any]:
        frame = self.site.frame
        cells_of = {(blocker.kind, _entity_id(blocker)): blocker.cells}
        if blocker.kind == GROUND_ID:
            area = self.site.labels[tuple(blocker.cells.T)] == Label.CONSTRUCTION_AREA
            cells_of = {
                (GROUND_ID, GROUND_ID): blocker.cells[~area],
                ("construction_area", "construction_area"): blocker.cells[area],
            }
        return [
            SceneEntity(
                timestamp=stamp(time_ns),
                frame_id="site",
                id=entity_id,
                frame_locked=True,
                metadata=pairs({"kind": kind}),
                cubes=_cubes_of_cells(cells, frame, KIND_RGBA.get(kind, KIND_RGBA["structure"])),
            )
            for (kind, entity_id), cells in cells_of.items()
            if len(cells)
        ]

    def _crane_entities(self, crane: TowerCrane, number: int, time_ns: int) -> list[Any]:
        """Return jib, trolley and hook block as boxes in the frames that move with them."""
        boxes = _hammerhead_boxes(crane) if crane.luffing is None else _luffing_boxes(crane.luffing)
        return [
            SceneEntity(
                timestamp=stamp(time_ns),
                frame_id=topics.of_crane(part, number),
                id=topics.of_crane(part, number) if number else f"{CRANE_ID}/{part}",
                frame_locked=True,
                cubes=[_cube(low, size, colour(KIND_RGBA["crane"]))],
            )
            for part, (low, size) in boxes.items()
        ]


@kept
def _entity_bytes(
    component: Component, place: YardPlace | None, order: int, state: ConstructionState, frame: GridFrame
) -> bytes:
    """Return the serialized entity of a part in a state, without its time."""
    frame_id = "site"
    if state is ConstructionState.UNBUILT and place is not None:
        shape, corner_m = place.shape, frame.corner_of(place.cell_vox)
    elif state is ConstructionState.IN_TRANSIT:
        shape, corner_m, frame_id = component.shape, np.zeros(3), component_frame(component.id)
    else:
        shape, corner_m = component.shape, frame.corner_of(component.target_vox)
    entity = SceneEntity(
        frame_id=frame_id,
        id=component.id,
        frame_locked=True,
        metadata=pairs(
            {
                "global_id": component.global_id,
                "ifc_class": component.ifc_class,
                "name": component.name,
                "state": state.value,
                "number": order + 1,
                "order": order,
                "mass_kg": component.mass_kg,
            }
        ),
        cubes=_cubes(shape.boxes, corner_m, frame.voxel_size_m, STATE_RGBA[state]),
    )
    data: bytes = entity.SerializeToString()
    return data


def _hammerhead_boxes(crane: TowerCrane) -> Boxes:
    """Return jib with counter-jib, trolley and hook block: lowest corner and size in their frames."""
    width_m, back_m = crane.mast_size_m, counter_jib_m(crane)
    return {
        "jib": ((-back_m, -width_m / 4, width_m / 4), (back_m + crane.jib_length_m, width_m / 2, width_m / 2)),
        "trolley": ((-width_m / 4, -width_m / 4, 0.0), (width_m / 2, width_m / 2, width_m / 4)),
        "hook": _HOOK_BLOCK,
    }


def _luffing_boxes(jib: LuffingJib) -> Boxes:
    """Return jib, counterweight and hook block: lowest corner and size in their frames."""
    width_m, tail_m = jib.width_m, max(0.5, jib.pivot_height_m - jib.tail_low_m)
    return {
        "jib": ((0.0, -width_m / 2, -width_m / 2), (jib.length_m, width_m, width_m)),
        "platform": (
            (-jib.tail_radius_m, -jib.tail_width_m / 2, -tail_m),
            (jib.tail_radius_m, jib.tail_width_m, tail_m),
        ),
        "hook": _HOOK_BLOCK,
    }


def scene_messages(
    site: Site, lifts: Iterable[Lift], tracks: Iterable[LiftTimes], start_ns: int
) -> Iterator[tuple[int, str, Any]]:
    """Yield the messages of ``/scene``: the whole scene at the start, then every change of state at its time.

    Args:
        site: The site.
        lifts: All lifts of the plan, including those that the log does not carry.
        tracks: Tracks of the carried lifts, in order.
        start_ns: When the log starts.
    """
    lifts, tracks = tuple(lifts), tuple(tracks)
    scene, starts = SceneUpdates(site, {lift.component: lift for lift in lifts}, {}), StatesAtStarts(lifts, tracks)
    yield start_ns, topics.SCENE, scene.fixed(start_ns)
    changes = [(time_ns, track, state) for track in tracks for time_ns, state in track.states]
    for time_ns, track, state in sorted(changes, key=lambda change: change[0]):
        begins = state is ConstructionState.UNBUILT
        update = scene.change(starts.begin(track) if begins else {track.lift.component: state}, time_ns)
        if update is not None:
            yield time_ns, topics.SCENE, update


def _entity_id(blocker: Blocker) -> str:
    # Users choose obstruction ids freely; the prefix keeps them distinct from GlobalIds and from "ground".
    return f"obstruction/{blocker.id}" if blocker.kind == "obstruction" else blocker.id


def _cubes_of_cells(cells: NDArray[np.int32], frame: GridFrame, rgba: Rgba) -> list[Any]:
    low = cells.min(axis=0)
    dense = np.zeros(cells.max(axis=0) - low + 1, np.bool_)
    dense[tuple((cells - low).T)] = True
    return _cubes(boxes_of(dense), frame.corner_of(low), frame.voxel_size_m, rgba)


def _cubes(boxes: NDArray[np.int32], corner_m: NDArray[np.float64], voxel_size_m: float, rgba: Rgba) -> list[Any]:
    of_colour, corner = colour(rgba), corner_m.tolist()
    cubes = []
    for box in boxes.tolist():  # most parts are one box: numpy would be slower
        size_m = [voxel_size_m * (high - low) for low, high in zip(box[:3], box[3:], strict=True)]
        low_m = [at + voxel_size_m * low for at, low in zip(corner, box[:3], strict=True)]
        cubes.append(_cube(low_m, size_m, of_colour))
    return cubes


def _cube(low_m: Sequence[float], size_m: Sequence[float], of_colour: Any) -> Any:
    middle_m = [low + size / 2 for low, size in zip(low_m, size_m, strict=True)]
    return CubePrimitive(pose=pose(middle_m), size=vector(size_m), color=of_colour)
