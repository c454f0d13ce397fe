"""Reads a log as the value that was written."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
from foxglove_schemas_protobuf.Event_pb2 import Event
from foxglove_schemas_protobuf.PosesInFrame_pb2 import PosesInFrame
from google.protobuf.message import DecodeError as ProtobufError
from numpy.typing import NDArray

from bimvox.errors import LogFileError
from bimvox.log import schema as topics
from bimvox.log.bundle import site_from_bytes
from bimvox.log.carried_out import carried_out_of
from bimvox.log.mcap.form import nanoseconds
from bimvox.log.mcap.reader import Contents, LogMessage, read_contents, read_file, salvage_contents
from bimvox.log.motion_json import motions_from_json
from bimvox.log.motion_message import Samples, SamplesByLift, add_samples
from bimvox.log.narration import CRANE_FIELD, LIFT_EVENT, PHASE_EVENT
from bimvox.log.plan_json import plan_from_json
from bimvox.log.plan_log import LogEvent, LogRate, PlanLog
from bimvox.log.segments import FIRST_PLAN
from bimvox.records.lift import Status
from bimvox.records.motion import LiftMotion
from bimvox.site.site import Site

# The other topics are for viewers: they follow from these and the attachments.
_NEEDED = frozenset((topics.PLANNED, topics.MOTIONS, topics.EVENTS, topics.CARRIED_OUT, topics.OTHERS, topics.SEEN))


def read_log(path: Path | str) -> PlanLog:
    """Return the content of a log.

    Raises:
        LogFileError: If it is missing, empty, not a bimvox log, truncated or damaged; the message says which, and how
            to recover the rest.
    """
    path = Path(path)
    return log_of(read_contents(read_file(path), path, _NEEDED), path)


def log_of(contents: Contents, path: Path) -> PlanLog:
    """Return the log that the contents of a file describe.

    Lifts of a recovered log whose path or motion is incomplete become context.

    Raises:
        LogFileError: If it is not a bimvox log, or is inconsistent.
    """
    metadata = contents.metadata.get(topics.METADATA)
    if metadata is None:
        raise LogFileError(path, f"is not a bimvox log: it has no metadata record {topics.METADATA!r}")
    if (version := metadata.get("schema_version")) != str(topics.SCHEMA_VERSION):
        raise LogFileError(
            path,
            f"has schema version {version}, this bimvox reads {topics.SCHEMA_VERSION}",
            hint="use the bimvox version that wrote it",
        )
    for name in (topics.SITE_FILE, topics.PLAN_FILE):
        if name not in contents.attachments:
            if FIRST_PLAN in metadata and not contents.attachments:
                hint = "open it in a viewer; the plan is in the log without .liveNNNN in its name"
                raise LogFileError(path, "is a live log: the driven motions of a watch, without the plan", hint=hint)
            raise LogFileError(path, f"the attachment {name} is missing")
    try:
        return _assemble(contents, metadata, path, partial=metadata.get(topics.RECOVERED) == "true")
    except (ProtobufError, ValueError) as error:
        raise LogFileError(path, f"a message in it cannot be read: {error}") from error


def _assemble(contents: Contents, metadata: dict[str, str], path: Path, *, partial: bool) -> PlanLog:
    name = str(path)
    site = site_from_bytes(contents.attachments[topics.SITE_FILE], name)
    plan_data = contents.attachments[topics.PLAN_FILE]
    paths, events = _paths_and_events(contents.messages, site, path)
    plan, context = plan_from_json(plan_data, site, paths, name, partial=partial)
    motions: tuple[LiftMotion, ...] = ()
    rate = _rate_of(metadata, path)
    if (data := contents.attachments.get(topics.MOTION_FILE)) is not None:
        cranes = [crane.name for crane in site.cranes]
        motions = motions_from_json(data, _samples(contents.messages, site, path), cranes, name, partial=partial)
        planned = {lift.order for lift in (*plan.lifts, *context) if lift.status is Status.PLANNED}
        for motion in motions:
            if motion.order not in planned:
                raise LogFileError(path, f"its motion {motion.number} is of a lift that is not planned")
    log = PlanLog(
        plan=plan,
        motions=motions,
        attachments={key: value for key, value in contents.attachments.items() if key not in topics.OWN_ATTACHMENTS},
        metadata={key: value for key, value in metadata.items() if key not in topics.OWN_METADATA},
        revision=int(metadata.get("revision", "0")),
        events=tuple(events),
        context=context,
        recovered=partial,
        version=metadata.get("bimvox", ""),
        carried_out=None if partial else carried_out_of(contents, site, path),
        rate=rate,
    )
    if not partial or topics.MOTION_FILE not in contents.attachments:
        return log
    # Of the planned lifts only those that have both a path and a motion.
    timed = {motion.order for motion in log.motions}
    return log.extract([one.order for one in log.plan.lifts if one.status is Status.INFEASIBLE or one.order in timed])


def _paths_and_events(
    messages: list[LogMessage], site: Site, path: Path
) -> tuple[dict[int, NDArray[np.int32]], list[LogEvent]]:
    """Return (N, 3) int32 reference cells by lift order, and the events that are not the recorder's own."""
    paths: dict[int, NDArray[np.int32]] = {}
    starts: dict[tuple[str, int], NDArray[np.int32]] = {}
    events: list[LogEvent] = []
    orders: dict[tuple[str, int], int] = {}
    planned = {topics.of_crane(topics.PLANNED, n): crane.name for n, crane in enumerate(site.cranes)}
    planned.setdefault(topics.PLANNED, "")
    first = planned[topics.PLANNED]
    for message in messages:
        if message.topic in planned:
            starts[planned[message.topic], message.time_ns] = _cells(message.data, site, path)
        elif message.topic == topics.EVENTS:
            event = Event.FromString(message.data)
            fields = {pair.key: pair.value for pair in event.metadata}
            kind = fields.pop("kind", "")
            if kind == LIFT_EVENT:
                orders[fields.get(CRANE_FIELD, first), nanoseconds(event.start_time)] = int(fields["order"])
            elif kind != PHASE_EVENT:
                events.append(LogEvent(kind, nanoseconds(event.start_time), nanoseconds(event.end_time), fields))
    # A path is sent when its lift begins, and no two lifts of a crane begin at the same time.
    for start, cells in starts.items():
        if start in orders:
            paths[orders[start]] = cells
    return paths, events


def _cells(data: bytes, site: Site, path: Path) -> NDArray[np.int32]:
    """Return the path of a message as (N, 3) int32 reference cells."""
    poses = PosesInFrame.FromString(data).poses
    corner_m = np.array([(p.position.x, p.position.y, p.position.z) for p in poses], np.float64).reshape(-1, 3)
    if not len(corner_m) or not np.isfinite(corner_m).all():
        raise LogFileError(path, "a planned path in it is empty or not finite")
    with np.errstate(invalid="ignore"):  # cells that no integer counts are outside the site
        cells = site.frame.cell_of(corner_m + site.frame.voxel_size_m / 2)
    off_m = float(np.abs(site.frame.corner_of(cells) - corner_m).max())
    if off_m > 1e-6 * site.frame.voxel_size_m or (cells < 0).any() or (cells >= site.shape).any():
        raise LogFileError(path, "a planned path in it leaves the cells of the site")
    result: NDArray[np.int32] = cells.astype(np.int32)
    result.flags.writeable = False
    return result


def _rate_of(metadata: dict[str, str], path: Path) -> LogRate:
    rate = metadata.get(topics.RATE)
    if rate not in (LogRate.MOTION, LogRate.FULL):
        raise LogFileError(path, f"its rate is {rate!r}, not {LogRate.MOTION} or {LogRate.FULL}")
    return LogRate(rate)


def _samples(messages: list[LogMessage], site: Site, path: Path) -> SamplesByLift:
    """Return the exact samples of every lift."""
    if not site.cranes:
        raise LogFileError(path, "it holds motions, but its site has no crane")
    result: dict[int, dict[str, Samples]] = {}
    for message in messages:
        if message.topic == topics.MOTIONS:
            add_samples(result, message.data)
    return result


# Recovers the complete lifts of a damaged log.


@dataclasses.dataclass(frozen=True, slots=True)
class _Recovered:
    """What was recovered of a damaged log.

    Attributes:
        messages: Number of messages recovered.
        lost: What was lost, one sentence each; empty for a sound log.
    """

    messages: int
    lost: tuple[str, ...]


def recover_log(path: Path | str) -> tuple[PlanLog, _Recovered]:
    """Return the complete lifts of a damaged log, and what was lost.

    Raises:
        LogFileError: If the site or the plan did not survive, or no lift did.
    """
    path = Path(path)
    contents = _salvage(path)
    for name in (topics.SITE_FILE, topics.PLAN_FILE):
        if name not in contents.attachments:
            raise LogFileError(
                path,
                f"the attachment {name} did not survive, and nothing can replace it ({'; '.join(contents.lost)})",
                hint="plan again: bimvox plan SITE -o LOG.mcap",
            )
    log = log_of(contents, path)
    if not log.planned:
        raise LogFileError(path, "no complete lift survived")
    log = dataclasses.replace(log, recovered=bool(contents.lost))
    return log, _Recovered(len(contents.messages), tuple(contents.lost))


def _salvage(path: Path) -> Contents:
    contents = salvage_contents(read_file(path), path)
    own = contents.metadata.get(topics.METADATA)
    if own is None:
        raise LogFileError(path, "the rest cannot be recognized as a bimvox log (its metadata is lost)")
    contents.metadata[topics.METADATA] = own | {topics.RECOVERED: "true"}
    known = {topic.name for topic in topics.topics_of(topics.MOST_CRANES)}
    contents.messages = [message for message in contents.messages if message.topic in known]
    return contents
