"""The log's topics on a websocket, for viewers that look on (Foxglove and others that speak its protocol).

The same topics, schemas and bytes as in a log. What stays until it is sent again (cells, scene, path, events) is sent
to whoever begins to listen. Needs ``pip install 'bimvox[live]'``.
"""

from __future__ import annotations

import threading
from collections.abc import Iterator
from typing import Any

import numpy as np

from bimvox.errors import InputError
from bimvox.log import topics
from bimvox.log.colours import ConstructionState
from bimvox.log.merge import Timed
from bimvox.log.messages import pose, stamp
from bimvox.log.narration import event_messages
from bimvox.log.plan_log import PlanLog
from bimvox.log.recorder import lift_rows
from bimvox.log.rows import Rows
from bimvox.log.scene import Scene, states_before
from bimvox.log.track import crane_track
from bimvox.log.voxels import voxel_grid
from bimvox.planning.lift import Status
from bimvox.trajectory.motion import LiftMotion


class LiveServer:
    """Serves the topics.

    Args:
        host: Where to listen.
        port: Its port; 0 for any that is free.
        cranes: How many cranes there are.

    Raises:
        InputError: If the package is not installed, or the port cannot be had.
    """

    def __init__(self, host: str, port: int, cranes: int = 1) -> None:
        try:
            import foxglove
        except ImportError:
            raise InputError(
                "a live server needs the package foxglove-sdk, which is not installed",
                hint="pip install 'bimvox[live]'",
            ) from None
        context = self._context = foxglove.Context()  # its channels close with it
        self._channels = {
            topic.name: foxglove.Channel(
                topic.name,
                schema=foxglove.Schema(name=topic.schema, encoding="protobuf", data=topic.descriptor_set),
                message_encoding="protobuf",
                context=context,
            )
            for topic in topics.topics_of(cranes)
        }
        self._kept: dict[str, list[tuple[int, bytes]]] = {}
        self._lock = threading.Lock()
        try:
            self._server = foxglove.start_server(
                name="bimvox watch", host=host, port=port, context=context, server_listener=_Listener(self)
            )
        except (OSError, RuntimeError, ValueError) as error:
            raise InputError(f"cannot serve on {host}:{port}: {error}", hint="name another port") from error
        self.address = f"{host}:{self._server.port}"

    def send(self, topic: str, time_ns: int, data: bytes) -> None:
        """Send a message to all who listen."""
        self._channels[topic].log(data, log_time=time_ns)

    def keep(self, messages: list[Timed]) -> None:
        """Send messages, and send them again to whoever begins to listen, until there are others of their topic."""
        kept: dict[str, list[tuple[int, bytes]]] = {}
        for time_ns, topic, message in messages:
            kept.setdefault(topic, []).append((time_ns, message.SerializeToString(deterministic=True)))
        with self._lock:
            self._kept |= kept
        for topic in kept:
            self.send_again(topic)

    def send_again(self, topic: str, client: int | None = None) -> None:
        """Send what is kept of a topic; to one client alone where it is given."""
        with self._lock:
            kept = list(self._kept.get(topic, ()))
        for time_ns, data in kept:
            self._channels[topic].log(data, log_time=time_ns, sink_id=client)

    def close(self) -> None:
        """Stop serving."""
        self._server.stop()


class _Listener:
    """Whoever begins to listen gets what is kept."""

    def __init__(self, server: LiveServer) -> None:
        self._server = server

    def on_subscribe(self, client: Any, channel: Any) -> None:
        self._server.send_again(channel.topic, client.id)

    def __getattr__(self, name: str) -> Any:
        if name.startswith("on_"):
            return lambda *_: None
        raise AttributeError(name)


def standing_messages(record: PlanLog, time_ns: int) -> Iterator[Timed]:
    """Yield what stays until it is sent again: the cells, the scene at a time, the path of the lift then, the events.

    Args:
        record: The whole plan.
        time_ns: On the site's clock.
    """
    site = record.plan.site
    yield time_ns, topics.VOXELS, voxel_grid(site, time_ns)
    lifts = record.all_lifts
    scene = Scene(site, {lift.component: lift for lift in lifts}, {})
    yield time_ns, topics.SCENE, scene.fixed(time_ns)
    under_way = motions_at(record, time_ns)
    now = next((motion for motion in under_way if motion.end_ns > time_ns), None)
    if now is None:
        done = [lift for lift in lifts if lift.status is Status.PLANNED]
        states = {lift.component: ConstructionState.ASSEMBLED for lift in done}
    else:
        states = states_before(lifts, now.order)
    for motion in under_way:
        lift = next(lift for lift in lifts if lift.order == motion.order)
        if motion.end_ns <= time_ns or lift.status is not Status.PLANNED:
            continue
        states[lift.component] = ConstructionState.UNBUILT
        track = crane_track(site, lift, motion)
        for at_ns, state in (
            (track.lifted_ns, ConstructionState.IN_TRANSIT),
            (track.arrived_ns, ConstructionState.ARRIVED),
            (track.assembled_ns, ConstructionState.ASSEMBLED),
        ):
            if at_ns <= time_ns:
                states[lift.component] = state
        if lift.path_vox is not None:
            from foxglove_schemas_protobuf.PosesInFrame_pb2 import PosesInFrame

            poses = [pose(corner) for corner in site.frame.corner_of(lift.path_vox).tolist()]
            message = PosesInFrame(timestamp=stamp(time_ns), frame_id="site", poses=poses)
            yield time_ns, topics.of_crane(topics.PLANNED, motion.crane), message
    if (update := scene.change(states, time_ns)) is not None:
        yield time_ns, topics.SCENE, update
    for _, topic, message in event_messages(record, ()):
        yield time_ns, topic, message


def motions_at(record: PlanLog, time_ns: int) -> list[LiftMotion]:
    """Return what every crane drives at a time, in order of the lifts; after its last lift that one.

    Args:
        record: The whole plan.
        time_ns: On the site's clock.
    """
    found = []
    for number in sorted({motion.crane for motion in record.motions}):
        own = [motion for motion in record.motions if motion.crane == number]
        found.append(next((motion for motion in own if motion.end_ns > time_ns), own[-1]))
    return sorted(found, key=lambda motion: motion.order)


class Moving:
    """What moves, at any time: frames, joints, load.

    Args:
        record: The whole plan.
    """

    def __init__(self, record: PlanLog) -> None:
        self._record = record
        self._rows: dict[int, tuple[int, list[Rows]]] = {}

    def at(self, time_ns: int) -> Iterator[tuple[str, bytes]]:
        """Yield the last message of each topic of the lifts at a time, up to then."""
        for motion in motions_at(self._record, time_ns):
            if motion.crane not in self._rows or self._rows[motion.crane][0] != motion.order:
                self._rows[motion.crane] = motion.order, lift_rows(self._record, motion)
            latest: dict[str, tuple[int, bytes]] = {}
            for rows in self._rows[motion.crane][1]:
                at = int(np.searchsorted(rows.time_ns, time_ns, side="right")) - 1
                if at >= 0:
                    latest[rows.topic] = (int(rows.time_ns[at]), rows.data[at])
            for topic, (_, data) in latest.items():
                yield topic, data
