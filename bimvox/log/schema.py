"""The log's schema: the one table of topics, files and metadata for recorder, reader and ``bimvox schema log``."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

from foxglove_schemas_protobuf.Event_pb2 import Event
from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from foxglove_schemas_protobuf.JointStates_pb2 import JointStates
from foxglove_schemas_protobuf.Log_pb2 import Log
from foxglove_schemas_protobuf.PoseInFrame_pb2 import PoseInFrame
from foxglove_schemas_protobuf.PosesInFrame_pb2 import PosesInFrame
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate
from foxglove_schemas_protobuf.VoxelGrid_pb2 import VoxelGrid
from mcap_protobuf.schema import build_file_descriptor_set

from bimvox.log.crane_command import COMMAND as COMMAND
from bimvox.log.crane_command import CraneCommandMessage, command_text, head_text, single_crane_descriptor
from bimvox.log.driven import APART_S, OFF_M
from bimvox.log.motion_message import MOTIONS as MOTIONS
from bimvox.log.motion_message import LiftMotionMessage, motion_text
from bimvox.log.plan_log import LogRate
from bimvox.version import __version__

SCHEMA_VERSION = 2
"""Version of the whole log; fields and topics are only ever added. Since 2 the exact samples are on ``/motions``."""
WRITERS = (__version__,)
"""The versions of bimvox whose logs have this schema and all that it demands: no others are proven."""

TF = "/tf"
VOXELS = "/site/voxels"
PLANNED = "/crane/path/planned"
LOAD = "/crane/load/pose"
JOINTS = "/crane/joint_states"
SCENE = "/scene"
LOG = "/log"
EVENTS = "/events"
CARRIED_OUT = "/crane/carried_out"
OTHERS = "/others/places"
SEEN = "/others/seen"

OF_A_CRANE = (PLANNED, LOAD, JOINTS, COMMAND)
"""Topics that every crane has; those of further cranes begin with ``/crane_2/``, ``/crane_3/`` ..."""
MOST_CRANES = 9
"""Recovery reads the topics of at most this many cranes."""

SITE_FILE = "site.bimvox.zip"
PLAN_FILE = "plan.json"
URDF_FILE = "crane.urdf"
CHART_FILE = "load_chart.json"
MOTION_FILE = "motions.json"
LAYOUT_FILE = "foxglove.layout.json"
STEPS_FILE = "steps.json"
PROPS_FILE = "props.json"
REMARKS_FILE = "remarks.json"
CARRIED_OUT_FILE = "carried_out.json"
MEDIA_TYPES = {
    SITE_FILE: "application/zip",
    PLAN_FILE: "application/json",
    MOTION_FILE: "application/json",
    URDF_FILE: "application/xml",
    CHART_FILE: "application/json",
    LAYOUT_FILE: "application/json",
    STEPS_FILE: "application/json",
    PROPS_FILE: "application/json",
    REMARKS_FILE: "application/json",
    CARRIED_OUT_FILE: "application/json",
    **{f"crane_{n}.{URDF_FILE.removeprefix('crane.')}": "application/xml" for n in range(2, MOST_CRANES + 1)},
    **{f"crane_{n}.{CHART_FILE}": "application/json" for n in range(2, MOST_CRANES + 1)},
}
OTHER_MEDIA_TYPE = "application/octet-stream"
OWN_ATTACHMENTS = frozenset(MEDIA_TYPES)
"""Attachments that the recorder makes; all others are input files of the plan."""

METADATA = "bimvox"
RATE = "rate"
"""Metadata key: the ``LogRate``."""
RECOVERED = "recovered"
"""Metadata key of a recovered log: some messages may be missing."""
OWN_METADATA = frozenset((
    "schema_version", "bimvox", "revision", "site", "site_digest", "geometry_digest", "model", "model_sha256",
    "voxel_size_m", "origin_m", "shape", "site_to_ifc", "path_pose", "clock", "extract", RATE, RECOVERED,
))  # fmt: skip
"""Keys of the metadata record that the recorder writes."""


@dataclass(frozen=True, slots=True)
class Topic:
    """One topic of the log.

    Attributes:
        name: Its name.
        message: Its protobuf class.
        meaning: What it carries.
    """

    name: str
    message: Any
    meaning: str

    @property
    def schema(self) -> str:
        """Full name of its protobuf message type."""
        return str(self.message.DESCRIPTOR.full_name)

    def descriptor_set_for(self, *, several_cranes: bool) -> bytes:
        """Return its schema as MCAP wants it: a serialized FileDescriptorSet with all dependencies.

        Args:
            several_cranes: Whether the log is of several cranes; otherwise fields that only they use are left out.
        """
        found = build_file_descriptor_set(self.message)
        if self.message is CraneCommandMessage and not several_cranes:
            reduced = single_crane_descriptor()
            for file in found.file:
                if file.name == reduced.name:
                    file.CopyFrom(reduced)
        return bytes(found.SerializeToString(deterministic=True))


TOPICS = (
    Topic(
        TF,
        FrameTransforms,
        "site -> crane_base -> jib -> trolley -> hook -> component/ID. A component's frame: lowest "
        "corner of its reference cell, axes along the site's.",
    ),
    Topic(
        VOXELS,
        VoxelGrid,
        "Labels of the cells, uint8 `label`, Z-Y-X order, components at their places, without empty layers at the top.",
    ),
    Topic(
        PLANNED,
        PosesInFrame,
        "The path of a planned lift, at its start, unit move by unit move: the component's frame, metres.",
    ),
    Topic(LOAD, PoseInFrame, "The load on the hook: the component's frame, metres."),
    Topic(
        JOINTS,
        JointStates,
        "`slewing` rad from the site's +x axis, counter-clockwise, unwrapped; `trolley` m from the slewing axis; "
        "`hoist` m of rope below the jib. Empty without a crane.",
    ),
    Topic(
        COMMAND,
        CraneCommandMessage,
        "The commands to the crane: a crane that holds the rates of each until the next is on the motion at every "
        "command. At the rate `full` at a fixed period. Empty without a crane.",
    ),
    Topic(SCENE, SceneUpdate, "Everything as boxes, entity id = GlobalId (made unique), coloured by state."),
    Topic(LOG, Log, "The plan in words, and lifts as they begin."),
    Topic(EVENTS, Event, "Spans: `kind` = `lift` (a whole lift), `phase` (a part of it) and others, such as `replan`."),
)

TRAFFIC_TOPICS = (
    Topic(
        CARRIED_OUT,
        JointStates,
        "Of `watch --traffic`, every 0.5 s on a clock of its own: the joints of the crane as it carried the plan out, "
        "and `plan`: position = where it was on the plan's clock, s, velocity = how fast it went there; 1 is as "
        "planned.",
    ),
    Topic(
        OTHERS,
        PosesInFrame,
        "Then, where people and vehicles were: a pose each, in the order of `carried_out.json`, on the ground, metres.",
    ),
    Topic(SEEN, PosesInFrame, "The same as seen: half a second late, with an error of at most 0.3 m."),
)
"""Topics of a log that also holds how its plan was carried out."""

MOTION_TOPIC = Topic(
    MOTIONS,
    LiftMotionMessage,
    "The exact samples of every lift's motion, at its start: what is proven. Frames, joints, load and commands of a "
    f"motion follow from them; unless metadata `{RATE}` is `{LogRate.FULL}`, they are at those samples only between "
    f"which a straight line is within {1000 * OFF_M:g} mm of hook and load, at most {APART_S:g} s apart while anything "
    "moves, and where phases begin and end.",
)
"""Topic of the exact samples, which are nothing for viewers."""


def of_crane(name: str, number: int) -> str:
    """Return a crane's topic, frame or file name from the first crane's; ``number`` is its index in ``Site.cranes``."""
    if number == 0:
        return name
    if name.startswith("/crane/"):
        return f"/crane_{number + 1}/{name.removeprefix('/crane/')}"
    return f"crane_{number + 1}/{name}" if "." not in name else f"crane_{number + 1}.{name.removeprefix('crane.')}"


def of_first_crane(name: str) -> str:
    """Return the first crane's topic that corresponds to this one."""
    if name.startswith("/crane_"):
        number, _, rest = name.removeprefix("/crane_").partition("/")
        if number.isdigit():
            return f"/crane/{rest}"
    return name


def topics_of(cranes: int, *, traffic: bool = False) -> tuple[Topic, ...]:
    """Return the topics of a log of a site with that many cranes.

    ``traffic``: whether with those of ``watch --traffic``.
    """
    further = (
        replace(topic, name=of_crane(topic.name, number), meaning=f"The same for crane {number + 1}.")
        for number in range(1, cranes)
        for topic in TOPICS
        if topic.name in OF_A_CRANE
    )
    return (*TOPICS, *further, *(TRAFFIC_TOPICS if traffic else ()), MOTION_TOPIC)


def proto_file() -> str:
    """Return the definitions of the log's own messages as a ``.proto`` file."""
    return "\n".join([head_text(), command_text(), motion_text()])


def channel_numbers() -> dict[str, int]:
    """Return the number of every topic's channel, the same in all logs."""
    return {topic.name: n for n, topic in enumerate(topics_of(MOST_CRANES, traffic=True), start=1)}
