"""``bimvox.CraneCommand``: the commands to the crane as protobuf."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from google.protobuf import descriptor_pool, message_factory, timestamp_pb2
from google.protobuf.descriptor_pb2 import FieldDescriptorProto, FileDescriptorProto
from numpy.typing import NDArray

from bimvox.crane.kinematics import joints_of
from bimvox.crane.tower_crane import TowerCrane
from bimvox.log.mcap.form import Form, stamp
from bimvox.log.mcap.packed import Rows
from bimvox.log.plan_log import shown_values
from bimvox.motion.commands import PHASES, Commands
from bimvox.records.motion import PhaseName

_PACKAGE = "bimvox"
TIMESTAMP = "google.protobuf.Timestamp"
_SCALARS = {
    "uint32": FieldDescriptorProto.TYPE_UINT32,
    "bytes": FieldDescriptorProto.TYPE_BYTES,
    "string": FieldDescriptorProto.TYPE_STRING,
    "double": FieldDescriptorProto.TYPE_DOUBLE,
    "bool": FieldDescriptorProto.TYPE_BOOL,
}

_Enums = Mapping[str, Mapping[str, int]]
"""Values of each of a message's own enumerations, by name."""


class Field(NamedTuple):
    """A field of a message.

    Attributes:
        number: Its number.
        type: Its type: a scalar, ``TIMESTAMP`` or an enumeration of the message.
        name: Its name.
        comment: What it says.
    """

    number: int
    type: str
    name: str
    comment: str


def descriptor_of(message: str, fields: Sequence[Field], enums: _Enums) -> FileDescriptorProto:
    """Return the descriptor of the file that defines a message."""
    file = FileDescriptorProto(
        name=f"{_PACKAGE}/{message}.proto",
        package=_PACKAGE,
        syntax="proto3",
        dependency=[timestamp_pb2.DESCRIPTOR.name],
    )
    made = file.message_type.add(name=message)
    for enum, numbers in enums.items():
        values = made.enum_type.add(name=enum)
        for name, number in numbers.items():
            values.value.add(name=name, number=number)
    for field in fields:
        added = made.field.add(name=field.name, number=field.number, label=FieldDescriptorProto.LABEL_OPTIONAL)
        if field.type in _SCALARS:
            added.type = _SCALARS[field.type]
        elif field.type == TIMESTAMP:
            added.type, added.type_name = FieldDescriptorProto.TYPE_MESSAGE, f".{TIMESTAMP}"
        else:
            added.type, added.type_name = FieldDescriptorProto.TYPE_ENUM, f".{_PACKAGE}.{message}.{field.type}"
    return file


def text_of(message: str, about: str, fields: Sequence[Field], enums: _Enums) -> str:
    """Return the definition of a message as ``.proto`` text, without the head of a file."""
    lines = [*(f"// {line}".rstrip() for line in about.split("\n")), f"message {message} {{"]
    for enum, numbers in enums.items():
        lines += [f"  enum {enum} {{", *(f"    {name} = {number};" for name, number in numbers.items()), "  }"]
    lines += [f"  {field.type} {field.name} = {field.number};  // {field.comment}" for field in fields]
    return "\n".join([*lines, "}", ""])


def head_text() -> str:
    """Return the head of a ``.proto`` file with the log's own messages."""
    return f'syntax = "proto3";\n\nimport "{timestamp_pb2.DESCRIPTOR.name}";\n\npackage {_PACKAGE};\n'


def class_of(file: FileDescriptorProto) -> Any:
    """Return the protobuf class of the message that a file defines."""
    # The default pool, so that the timestamps of this message and of Foxglove's are the same class.
    pool = descriptor_pool.Default()
    pool.Add(file)
    return message_factory.GetMessageClass(pool.FindMessageTypeByName(f"{_PACKAGE}.{file.message_type[0].name}"))


MESSAGE = "CraneCommand"

COMMAND = "/crane/command"
"""Its topic."""

FIELDS = (
    Field(1, TIMESTAMP, "time", "On the site's clock."),
    Field(2, "uint32", "lift_order", "Order of the lift, from 0."),
    Field(3, "string", "component_id", "GlobalId, made unique."),
    Field(4, "Phase", "phase", "Phase of the lift."),
    Field(5, "double", "slew_rate_rad_s", "Counter-clockwise positive."),
    Field(6, "double", "trolley_rate_m_s", "Outward positive; of a luffing jib, the rate of the radius."),
    Field(7, "double", "hoist_rate_m_s", "Up positive."),
    Field(8, "double", "slew_rad", "From the site's +x axis, unwrapped."),
    Field(9, "double", "radius_m", "From the slewing axis to the hook."),
    Field(10, "double", "height_m", "Hook above the site's z = 0."),
    Field(11, "double", "rope_length_m", "Rope below the jib."),
    Field(12, "bool", "loaded", "Whether a load hangs on the hook."),
    Field(13, "double", "luff_rad", "0 for a jib with a trolley."),
    Field(14, "double", "luff_rate_rad_s", "At the next command, up positive."),
)

SEVERAL_CRANES_FIELDS = (Field(15, "string", "crane", "Name of the crane, if there are several."),)
"""Fields that only logs of several cranes have; the schema of other logs stays the same, byte for byte."""

_VALUES = tuple(field.name for field in FIELDS if field.type == "double")
_NUMBERS = tuple(field.number for field in FIELDS if field.name in ("phase", "loaded"))

PHASE_NUMBERS: dict[PhaseName, int] = {
    PhaseName.APPROACH: 1,
    PhaseName.HOOK_ON: 2,
    PhaseName.RAISE: 3,
    PhaseName.HOIST: 4,
    PhaseName.TRAVERSE: 5,
    PhaseName.LOWER: 6,
    PhaseName.SET: 7,
    PhaseName.RELEASE: 8,
    PhaseName.TURN: 9,
    PhaseName.STOP: 10,
    PhaseName.WAIT: 11,
    PhaseName.LEAVE: 12,
}
_NUMBER_OF_PHASE = np.array([PHASE_NUMBERS[phase] for phase in PHASES], np.int64)
_PHASES = {"PHASE_UNSPECIFIED": 0, **{f"PHASE_{name.name}": number for name, number in PHASE_NUMBERS.items()}}
_SEVERAL_CRANES_PHASES = tuple(f"PHASE_{phase.name}" for phase in (PhaseName.WAIT, PhaseName.LEAVE))


def single_crane_descriptor() -> FileDescriptorProto:
    """Return the descriptor of the file as it is in logs of one crane."""
    phases = {name: number for name, number in _PHASES.items() if name not in _SEVERAL_CRANES_PHASES}
    return descriptor_of(MESSAGE, FIELDS, {"Phase": phases})


def file_descriptor() -> FileDescriptorProto:
    """Return the descriptor of the file that defines the message."""
    return descriptor_of(MESSAGE, (*FIELDS, *SEVERAL_CRANES_FIELDS), {"Phase": _PHASES})


def command_text() -> str:
    """Return the definition as ``.proto`` text."""
    about = "Rates of the axes to hold until the next command, and the pose at the next command."
    return text_of(MESSAGE, about, (*FIELDS, *SEVERAL_CRANES_FIELDS), {"Phase": _PHASES})


CraneCommandMessage: Any = class_of(file_descriptor())
"""The protobuf class."""


def command_rows(
    commands: Commands, component_ids: Sequence[str], crane: TowerCrane, *, topic: str = COMMAND, named: bool = False
) -> Rows:
    """Return the messages of one lift's commands, serialized.

    ``component_ids``: of every component, by its index; ``crane``: for the rope's length and the luff angle;
    ``named``: whether they name the crane.
    """
    message = CraneCommandMessage(
        lift_order=commands.order, component_id=component_ids[commands.component], crane=crane.name if named else ""
    )

    def command(time_ns: int, values: Sequence[float], numbers: Sequence[int]) -> Any:
        message.time.CopyFrom(stamp(time_ns))
        for name, value in zip(_VALUES, values, strict=True):
            setattr(message, name, value)
        message.phase, message.loaded = numbers[0], bool(numbers[1])
        return message

    machine = _of_machine(crane, commands.targets, commands.rates[:, 1])
    values = np.concatenate([commands.rates, commands.targets, machine], axis=1)
    numbers = np.stack([_NUMBER_OF_PHASE[commands.phase], commands.loaded], axis=1)
    form = Form(command, len(_VALUES), _NUMBERS)
    return Rows(commands.time_ns, topic, form.serialized(commands.time_ns, shown_values(values), numbers))


def _of_machine(
    crane: TowerCrane, targets: NDArray[np.float64], trolley_rate_m_s: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return (N, 3) rope below the jib, luff angle and luffing rate at the targets ((N, 3) slew, radius, height)."""
    joints, jib = joints_of(crane, targets), crane.luffing
    if jib is None:
        return np.stack([joints[:, 2], np.zeros(len(joints)), np.zeros(len(joints))], axis=1)
    rate = -trolley_rate_m_s / (jib.length_m * np.sin(joints[:, 1]))
    return np.stack([joints[:, 2], joints[:, 1], rate], axis=1)
