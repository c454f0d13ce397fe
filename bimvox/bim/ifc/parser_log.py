"""Check the log of IfcOpenShell's parser: the parser continues after every error and only logs it."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from bimvox.errors import IfcError

_GEOMETRY = ("IfcRepresentationItem", "IfcRepresentation", "IfcProfileDef", "IfcObjectPlacement", "IfcNamedUnit")
_BROKEN = re.compile(r"token (.*) at offset (\d+) invalid (.*)")
_TWICE = re.compile(r"Overwriting instance with name #(\d+)")
_COUNT = re.compile(r"Expected (\d+) attribute values, found (\d+) for instance #(\d+)")
_LOST = re.compile(r"Instance reference #(\d+) used by instance #(\d+)")
_LITERAL = re.compile(r"enumeration literal '(.*?)' is not valid for type '(\w+)'")


def judge_log(path: Path, text: str, file: Any, log: str, stated: str) -> list[str]:
    """Return notes from the parser's log; raise if the file cannot be trusted.

    Args:
        path: The file.
        text: The text that was parsed; the log gives offsets in it.
        file: The ``ifcopenshell.file``.
        log: The parser's log for this file.
        stated: The schema that its header states; it may differ from the one it was read as.

    Raises:
        IfcError: If the text is broken, an instance name is used twice, or a geometric instance does not fit the
            schema that the file was read as.
    """
    if broken := _BROKEN.search(log):
        line = text.count("\n", 0, int(broken[2])) + 1
        raise IfcError(
            path, f"is damaged: {broken[1].strip()!r} cannot be read in line {line}", hint="export or copy it again"
        )
    if twice := _TWICE.findall(log):
        raise IfcError(
            path,
            f"uses {len(set(twice))} instance names twice, the first is #{twice[0]}: references to it mean either",
            hint="export the model again",
        )
    notes = []
    if unfit := {int(step_id): int(found) - int(expected) for expected, found, step_id in _COUNT.findall(log)}:
        notes.append(_unfit(path, file, unfit, stated))
    if lost := _LOST.findall(log):
        notes.append(f"references to missing instances: {len(lost)}, the first to #{lost[0][0]}")
    if literals := Counter(f"{literal} ({enumeration})" for literal, enumeration in _LITERAL.findall(log)):
        shown = ", ".join(literal for literal, _ in literals.most_common(3))
        notes.append(f"values that {file.schema_identifier} does not define: {literals.total()}, such as {shown}")
    return notes


def _unfit(path: Path, file: Any, surplus: Mapping[int, int], stated: str) -> str:
    """Return a note on instances with too many or too few attributes.

    Schema versions add and drop attributes at the end. That is harmless in products, and in geometry with more
    attributes than are read. A shape or a unit of another schema that lacks some is refused.

    Args:
        path: The file.
        file: The ``ifcopenshell.file``.
        surplus: How many attributes too many (or, negative, too few) by step id.
        stated: The schema that the header states.

    Raises:
        IfcError: If geometry lacks attributes in a file of another schema.
    """
    there = set(file.entity_names())
    found = [file.by_id(step_id) for step_id in surplus if step_id in there]
    classes = Counter(str(instance.is_a()) for instance in found)
    shown = ", ".join(f"{count} {name}" for name, count in sorted(classes.items()))
    schema = file.schema_identifier
    lacking = [instance for instance in found if surplus[instance.id()] < 0]
    if schema != stated and any(instance.is_a(name) for instance in lacking for name in _GEOMETRY):
        raise IfcError(
            path, f"schema {stated} cannot be read as {schema}: the attributes of {shown} differ", hint="export it anew"
        )
    return f"instances with more or fewer attributes than {schema} has: {shown or len(surplus)}"
