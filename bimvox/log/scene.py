"""The construction as a 3-D scene: every part as boxes, coloured by its state, sent again when its state changes."""

from __future__ import annotations

from bisect import bisect_left
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from foxglove_schemas_protobuf.CubePrimitive_pb2 import CubePrimitive
from foxglove_schemas_protobuf.LinePrimitive_pb2 import LinePrimitive
from foxglove_schemas_protobuf.Point3_pb2 import Point3
from foxglove_schemas_protobuf.SceneEntity_pb2 import SceneEntity
from foxglove_schemas_protobuf.SceneEntityDeletion_pb2 import SceneEntityDeletion
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate
from numpy.typing import NDArray

from bimvox.crane.links import links_of
from bimvox.crane.tower_crane import TowerCrane
from bimvox.grid.frame import GridFrame, Label
from bimvox.grid.summed_area import boxes_of
from bimvox.kept import kept
from bimvox.log import schema as topics
from bimvox.log.mcap.form import colour, pairs, pose, stamp, vector
from bimvox.records.lift import Lift, YardPlace
from bimvox.records.motion import LiftMotion
from bimvox.records.props import Standing
from bimvox.records.track import LiftTimes
from bimvox.site.component import KIND_RGB, STATE_RGB, Component, ConstructionState, Rgb
from bimvox.site.site import CRANE_ID, GROUND_ID, Blocker, Site

_Rgba = tuple[float, float, float, float]


def _opaque(rgb: Rgb) -> _Rgba:
    red, green, blue = (round(value / 255.0, 4) for value in rgb)
    return (red, green, blue, 1.0)


STATE_RGBA: dict[ConstructionState, _Rgba] = {state: _opaque(rgb) for state, rgb in STATE_RGB.items()}
_KIND_RGBA: dict[str, _Rgba] = {kind: _opaque(rgb) for kind, rgb in KIND_RGB.items()}


States = Mapping[int, ConstructionState | None]
"""States of components by their index; None: not to be seen. Of the others the state is as it was."""


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
        set_up: Of a crane that moves, where it stands.
    """

    site: Site
    lifts: Mapping[int, Lift]
    sent: dict[int, ConstructionState]
    set_up: int = 0

    def fixed(self, time_ns: int) -> Any:
        """Return the update that draws ground, areas, existing structure, obstructions and the crane."""
        moves = self.site.moving is not None
        there = (one for one in self.site.blockers if not (moves and one.kind == CRANE_ID))
        entities = [entity for blocker in there for entity in self._blocker_entities(blocker, time_ns)]
        if moves:
            return SceneUpdate(entities=[*entities, *self._in_set_up(time_ns)])
        for number, crane in enumerate(self.site.cranes):
            entities += self._crane_entities(crane, number, time_ns)
        return SceneUpdate(entities=entities)

    def moved(self, set_up: int, time_ns: int) -> Any:
        """Return the update that draws a crane that moves in another set-up, and no longer in the one before."""
        gone = [entity.id for entity in self._in_set_up(time_ns)]
        self.set_up = set_up
        kind = SceneEntityDeletion.MATCHING_ID
        deletions = [SceneEntityDeletion(timestamp=stamp(time_ns), type=kind, id=name) for name in gone]
        return SceneUpdate(entities=self._in_set_up(time_ns), deletions=deletions)

    def _in_set_up(self, time_ns: int) -> list[Any]:
        """Return the carrier and the links of a crane that moves, where it stands."""
        own = (one for one in self.site.blockers if one.kind == CRANE_ID and self.site.stands_in(one, self.set_up))
        entities = [entity for blocker in own for entity in self._blocker_entities(blocker, time_ns)]
        return entities + self._crane_entities(self.site.cranes[self.set_up], self.set_up, time_ns)

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
                cubes=_cubes_of_cells(cells, frame, _KIND_RGBA.get(kind, _KIND_RGBA["structure"])),
            )
            for (kind, entity_id), cells in cells_of.items()
            if len(cells)
        ]

    def _crane_entities(self, crane: TowerCrane, number: int, time_ns: int) -> list[Any]:
        """Return the solids of the links that move; the mast is among the site's blockers."""
        return [
            SceneEntity(
                timestamp=stamp(time_ns),
                frame_id=topics.of_crane(part, number),
                id=topics.of_crane(part, number) if number else f"{CRANE_ID}/{part}",
                frame_locked=True,
                cubes=[_cube(box.low_m, box.size_m, colour(_KIND_RGBA["crane"])) for box in boxes],
            )
            for part, boxes in links_of(crane).boxes.items()
            if boxes and part != "crane_base"
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


def scene_messages(
    site: Site, lifts: Iterable[Lift], tracks: Iterable[LiftTimes], start_ns: int, props: Iterable[Standing] = ()
) -> Iterator[tuple[int, str, Any]]:
    """Yield the messages of ``/scene``: the whole scene at the start, then every change of state at its time.

    ``lifts``: all of the plan, also those that the log does not carry; ``tracks``: of the carried ones, in order;
    ``props``: those that stand, and when, on the site's clock.
    """
    lifts, tracks = tuple(lifts), tuple(tracks)
    scene, starts = SceneUpdates(site, {lift.component: lift for lift in lifts}, {}), StatesAtStarts(lifts, tracks)
    if site.moving is not None and tracks:
        first = min(tracks, key=lambda track: track.start_ns)
        scene.set_up = site.components[first.lift.component].crane
    yield start_ns, topics.SCENE, scene.fixed(start_ns)
    changes = [(time_ns, track, state) for track in tracks for time_ns, state in track.states]
    for time_ns, track, state in sorted(changes, key=lambda change: change[0]):
        if site.moving is not None and (crane := site.components[track.lift.component].crane) != scene.set_up:
            yield time_ns, topics.SCENE, scene.moved(crane, time_ns)
        begins = state is ConstructionState.UNBUILT
        update = scene.change(starts.begin(track) if begins else {track.lift.component: state}, time_ns)
        if update is not None:
            yield time_ns, topics.SCENE, update
    yield from _props_messages(site, props)


def _props_messages(site: Site, props: Iterable[Standing]) -> Iterator[tuple[int, str, Any]]:
    """Yield the messages that draw the props of a part when they are set up, and delete them when they go."""
    for one in props:
        name, at = f"props/{site.components[one.held.component].id}", stamp(one.from_ns)
        line = LinePrimitive(type=LinePrimitive.LINE_LIST, pose=pose((0.0, 0.0, 0.0)), thickness=_PROP_M, color=_PROP)
        for prop in one.held.props:
            line.points.extend(Point3(x=x, y=y, z=z) for x, y, z in (prop.head_m, prop.foot_m))
        entity = SceneEntity(timestamp=at, frame_id="site", id=name, frame_locked=True, lines=[line])
        yield one.from_ns, topics.SCENE, SceneUpdate(entities=[entity])
        if one.until_ns is not None:
            gone = SceneEntityDeletion(timestamp=stamp(one.until_ns), type=SceneEntityDeletion.MATCHING_ID, id=name)
            yield one.until_ns, topics.SCENE, SceneUpdate(deletions=[gone])


_PROP_M = 0.08
_PROP = colour((0.66, 0.08, 0.03, 1.0))


def _entity_id(blocker: Blocker) -> str:
    # Users choose obstruction ids freely; the prefix keeps them distinct from GlobalIds and from "ground".
    return f"obstruction/{blocker.id}" if blocker.kind == "obstruction" else blocker.id


def _cubes_of_cells(cells: NDArray[np.int32], frame: GridFrame, rgba: _Rgba) -> list[Any]:
    low = cells.min(axis=0)
    dense = np.zeros(cells.max(axis=0) - low + 1, np.bool_)
    dense[tuple((cells - low).T)] = True
    return _cubes(boxes_of(dense), frame.corner_of(low), frame.voxel_size_m, rgba)


def _cubes(boxes: NDArray[np.int32], corner_m: NDArray[np.float64], voxel_size_m: float, rgba: _Rgba) -> list[Any]:
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


# The states of all components while a plan is carried out.

_UNBUILT, _ASSEMBLED = ConstructionState.UNBUILT, ConstructionState.ASSEMBLED


def states_before(lifts: Iterable[Lift], order: int) -> dict[int, ConstructionState]:
    """Return the states of all components when the lift of that order begins.

    Earlier lifts are assembled; the delivery of this lift lies in the yard. A delivery arrives when all lifts of the
    earlier ones are done, so the yard holds no other parts.
    """
    lifts = tuple(lifts)
    delivery = next((_delivery(lift) for lift in lifts if lift.order == order), None)
    states = {lift.component: _state_before(lift, order, delivery) for lift in lifts}
    return {component: state for component, state in states.items() if state is not None}


def states_at(
    lifts: Iterable[Lift], motions: Iterable[LiftMotion], tracks: Iterable[LiftTimes], time_ns: int
) -> dict[int, ConstructionState]:
    """Return the states of all components at a time on the site's clock.

    ``tracks`` are those of the lifts under way at the time.
    """
    lifts, ordered = tuple(lifts), sorted(motions, key=lambda motion: (motion.start_ns, motion.order))
    begun = [motion for motion in ordered if motion.start_ns <= time_ns] or ordered[:1]
    if not begun:
        # Nothing has a time: show the finished plan.
        return {lift.component: _ASSEMBLED for lift in lifts if lift.is_set}
    states = states_before(lifts, begun[-1].order)
    for motion in ordered:
        # With several cranes, a later lift in the order may end before an earlier one begins.
        if motion.end_ns <= time_ns:
            states[motion.component] = _ASSEMBLED
        elif states.get(motion.component) is _ASSEMBLED:
            states[motion.component] = _UNBUILT
    for track in tracks:
        states[track.lift.component] = track.state_at(time_ns)
    return states


class StatesAtStarts:
    """The states of all components when one lift after another begins, as what may change since the one before.

    They are those of ``states_before``. With several cranes, earlier lifts in the order may still be under way, or
    begin later: a part whose lift has begun keeps the state that it has, and one whose lift begins later is unbuilt.

    Args:
        lifts: All lifts of the plan.
        tracks: The tracks of those with a time.
    """

    def __init__(self, lifts: Iterable[Lift], tracks: Iterable[LiftTimes]) -> None:
        self._lifts = sorted(lifts, key=lambda lift: lift.order)
        self._orders = [lift.order for lift in self._lifts]
        self._delivered: defaultdict[int | None, list[Lift]] = defaultdict(list)
        for lift in self._lifts:
            self._delivered[_delivery(lift)].append(lift)
        self._timed, self._begun = {track.lift.component for track in tracks}, set[int]()
        self._passed = 0
        self._delivery: int | None = None

    def begin(self, track: LiftTimes) -> dict[int, ConstructionState | None]:
        """Return the states that may have changed when a lift begins, by component; None: not delivered, or gone.

        Args:
            track: The lift's; the tracks are given by start, then by order.
        """
        order, delivery = track.lift.order, _delivery(track.lift)
        passed = bisect_left(self._orders, order)
        lifts = self._lifts[min(passed, self._passed) : max(passed, self._passed)]
        if delivery != self._delivery:
            lifts += self._delivered[self._delivery] + self._delivered[delivery]
        self._passed, self._delivery = passed, delivery
        self._begun.add(track.lift.component)
        changed = {}
        for lift in lifts:
            if lift.component not in self._begun:
                state = _state_before(lift, order, delivery)
                begins_later = state is _ASSEMBLED and lift.component in self._timed
                changed[lift.component] = _UNBUILT if begins_later else state
        return {**changed, track.lift.component: _UNBUILT}


def _delivery(lift: Lift) -> int | None:
    return None if lift.place is None else lift.place.delivery


def _state_before(lift: Lift, order: int, delivery: int | None) -> ConstructionState | None:
    """Return the state of a lift's part when the lift of that order and delivery begins; None if it is not there."""
    if lift.order < order and lift.is_set:
        return _ASSEMBLED
    in_yard = lift.in_yard
    return _UNBUILT if in_yard is not None and in_yard.delivery == delivery else None
