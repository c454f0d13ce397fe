"""The log's own protobuf messages from tables, without a protobuf compiler at run time.

A table is the one definition of a message: the descriptor in the log and the ``.proto`` text of ``bimvox schema log``
are both made from it. Fields are only ever added, never renumbered.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from google.protobuf import descriptor_pool, message_factory, timestamp_pb2
from google.protobuf.descriptor_pb2 import FieldDescriptorProto, FileDescriptorProto

PACKAGE = "bimvox"
TIMESTAMP = "google.protobuf.Timestamp"
_SCALARS = {
    "uint32": FieldDescriptorProto.TYPE_UINT32,
    "bytes": FieldDescriptorProto.TYPE_BYTES,
    "string": FieldDescriptorProto.TYPE_STRING,
    "double": FieldDescriptorProto.TYPE_DOUBLE,
    "bool": FieldDescriptorProto.TYPE_BOOL,
}

Enums = Mapping[str, Mapping[str, int]]
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


def file_of(message: str) -> str:
    """Return the name of the file that defines a message."""
    return f"{PACKAGE}/{message}.proto"


def descriptor_of(message: str, fields: Sequence[Field], enums: Enums) -> FileDescriptorProto:
    """Return the descriptor of the file that defines a message."""
    file = FileDescriptorProto(
        name=file_of(message), package=PACKAGE, syntax="proto3", dependency=[timestamp_pb2.DESCRIPTOR.name]
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
            added.type, added.type_name = FieldDescriptorProto.TYPE_ENUM, f".{PACKAGE}.{message}.{field.type}"
    return file


def text_of(message: str, about: str, fields: Sequence[Field], enums: Enums) -> str:
    """Return the definition of a message as ``.proto`` text, without the head of a file."""
    lines = [*(f"// {line}".rstrip() for line in about.split("\n")), f"message {message} {{"]
    for enum, numbers in enums.items():
        lines += [f"  enum {enum} {{", *(f"    {name} = {number};" for name, number in numbers.items()), "  }"]
    lines += [f"  {field.type} {field.name} = {field.number};  // {field.comment}" for field in fields]
    return "\n".join([*lines, "}", ""])


def head_text() -> str:
    """Return the head of a ``.proto`` file with the log's own messages."""
    return f'syntax = "proto3";\n\nimport "{timestamp_pb2.DESCRIPTOR.name}";\n\npackage {PACKAGE};\n'


def class_of(file: FileDescriptorProto) -> Any:
    """Return the protobuf class of the message that a file defines."""
    # The default pool, so that the timestamps of this message and of Foxglove's are the same class.
    pool = descriptor_pool.Default()
    pool.Add(file)
    return message_factory.GetMessageClass(pool.FindMessageTypeByName(f"{PACKAGE}.{file.message_type[0].name}"))
