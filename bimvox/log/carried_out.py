"""How a plan was carried out, inside its log: samples as messages, the rest as JSON."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from foxglove_schemas_protobuf.JointState_pb2 import JointState
from foxglove_schemas_protobuf.JointStates_pb2 import JointStates
from foxglove_schemas_protobuf.PosesInFrame_pb2 import PosesInFrame
from numpy.typing import NDArray

from bimvox.crane.kinematics import axes_of_joints, joint_names, joints_of
from bimvox.errors import LogFileError
from bimvox.log import schema as topics
from bimvox.log.codec import ArrayReader, ArrayWriter, decode, encode
from bimvox.log.mcap.form import Form, pose, stamp
from bimvox.log.mcap.packed import Rows
from bimvox.log.mcap.reader import Contents
from bimvox.records.motion import CarriedOut, Other, Tally
from bimvox.site.nested import json_values
from bimvox.site.site import Site
from bimvox.units import NS_PER_S

_PLAN = "plan"


@dataclass(frozen=True, slots=True)
class _Words:
    """Everything but the samples."""

    source: str
    decider: str
    others: tuple[Other, ...]
    tally: Tally


def carried_out_to_json(found: CarriedOut) -> bytes:
    """Return everything about an execution except its samples."""
    words = _Words(found.source, found.decider, found.others, found.tally)
    return json.dumps(encode(words, ArrayWriter()), ensure_ascii=False, indent=1).encode()


def carried_out_rows(site: Site, found: CarriedOut) -> list[Rows]:
    """Return the samples of an execution as messages: the crane, the others, and where they are seen."""
    crane = site.cranes[0]
    states = JointStates(joints=[JointState(name=name) for name in (*joint_names(crane), _PLAN)])

    def joints(time_ns: int, row: Sequence[float]) -> Any:
        states.timestamp.CopyFrom(stamp(time_ns))
        for state, value in zip(states.joints, row[:4], strict=True):
            state.position = value
        states.joints[-1].velocity = row[4]
        return states

    def places(time_ns: int, row: Sequence[float]) -> Any:
        poses = [pose((x, y, 0.0)) for x, y in zip(row[::2], row[1::2], strict=True)]
        return PosesInFrame(timestamp=stamp(time_ns), frame_id="site", poses=poses)

    on_plan = np.stack([found.plan_ns / NS_PER_S, found.pace], axis=1)
    rows = Form(joints, 5).serialized(found.time_ns, np.concatenate([joints_of(crane, found.axes), on_plan], axis=1))
    form = Form(places, 2 * len(found.others))
    return [
        Rows(found.time_ns, topics.CARRIED_OUT, rows),
        Rows(found.time_ns, topics.OTHERS, form.serialized(found.time_ns, found.place_m)),
        Rows(found.time_ns, topics.SEEN, form.serialized(found.time_ns, found.seen_m)),
    ]


def carried_out_of(contents: Contents, site: Site, path: Path) -> CarriedOut | None:
    """Return the execution that a log holds; None if it holds none.

    Raises:
        LogFileError: If it cannot be read.
    """
    data = contents.attachments.get(topics.CARRIED_OUT_FILE)
    if data is None:
        return None
    if len(site.cranes) != 1:
        raise LogFileError(path, f"it holds {topics.CARRIED_OUT_FILE}, but its site has {len(site.cranes)} cranes")
    try:
        words = decode(_Words, json_values(data.decode()), ArrayReader({}), topics.CARRIED_OUT_FILE)
    except (ValueError, RecursionError) as error:
        raise LogFileError(path, f"{topics.CARRIED_OUT_FILE} in it cannot be read: {error}") from error
    names = (*joint_names(site.cranes[0]), _PLAN)
    states = []
    time_ns = []
    for message in contents.messages:
        if message.topic == topics.CARRIED_OUT:
            joints = {joint.name: joint for joint in JointStates.FromString(message.data).joints}
            if joints.keys() != set(names):
                raise LogFileError(path, f"a message on {topics.CARRIED_OUT} in it has other joints")
            states.append((*(joints[name].position for name in names), joints[_PLAN].velocity))
            time_ns.append(message.time_ns)
    values = np.array(states, np.float64).reshape(-1, 5)
    if not np.isfinite(values).all() or np.abs(values[:, 3]).max(initial=0.0) > _LONGEST_S:
        raise LogFileError(path, f"a message on {topics.CARRIED_OUT} in it has a joint that is not a position")
    count = len(words.others)
    place_m, seen_m = (_places(contents, topic, time_ns, count, path) for topic in (topics.OTHERS, topics.SEEN))
    return CarriedOut(
        words.source,
        words.decider,
        words.others,
        np.array(time_ns, np.int64),
        np.round(values[:, 3] * NS_PER_S).astype(np.int64),
        np.ascontiguousarray(values[:, 4]),
        axes_of_joints(site.cranes[0], np.ascontiguousarray(values[:, :3])),
        place_m,
        seen_m,
        words.tally,
    )


_LONGEST_S = 1e9


def _places(contents: Contents, topic: str, time_ns: Sequence[int], count: int, path: Path) -> NDArray[np.float64]:
    """Return (N, K, 2) where the others were, at the times of the crane's samples."""
    found, times = [], []
    for message in contents.messages:
        if message.topic == topic:
            poses = PosesInFrame.FromString(message.data).poses
            if len(poses) != count:
                raise LogFileError(path, f"a message on {topic} in it has {len(poses)} places, not {count}")
            found.append([(one.position.x, one.position.y) for one in poses])
            times.append(message.time_ns)
    if times != list(time_ns):
        raise LogFileError(path, f"{topic} and {topics.CARRIED_OUT} in it have samples at other times")
    return np.array(found, np.float64).reshape(len(times), count, 2)
