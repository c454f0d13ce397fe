"""Open an IFC file only if it is complete: IfcOpenShell reads truncated and damaged files without an error."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import date
from pathlib import Path
from typing import Any

import ifcopenshell

from bimvox.bim.ifc.endless import long_outlines, named_misfit
from bimvox.bim.ifc.step_file import check_frame, check_points, stated_day, stated_schema, step_bytes, without_comments
from bimvox.bim.ifc.text import parser_text
from bimvox.bim.ifc.units import project_units, si_scale
from bimvox.errors import IfcError

_GEOMETRY = ("IfcRepresentationItem", "IfcRepresentation", "IfcProfileDef", "IfcObjectPlacement", "IfcNamedUnit")
_BROKEN = re.compile(r"token (.*) at offset (\d+) invalid (.*)")
_TWICE = re.compile(r"Overwriting instance with name #(\d+)")
_COUNT = re.compile(r"Expected (\d+) attribute values, found (\d+) for instance #(\d+)")
_LOST = re.compile(r"Instance reference #(\d+) used by instance #(\d+)")
_LITERAL = re.compile(r"enumeration literal '(.*?)' is not valid for type '(\w+)'")


def _judge_log(path: Path, text: str, file: Any, log: str, stated: str) -> list[str]:
    """Return notes from the parser's log, whose offsets are in ``text``; raise if the file cannot be trusted."""
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


_INSTANCE = re.compile(rb"^[ \t]*#(\d+)[ \t]*=[ \t]*([A-Za-z0-9_]+)", re.MULTILINE)


_UNIT_NAMES = {"FOOT": "ft", "INCH": "in", "METRE": "m"}
_PREFIXES = {"MILLI": "m", "CENTI": "c", "DECI": "d", "KILO": "k", "MICRO": "µ"}


@dataclass(frozen=True, slots=True, eq=False)
class OpenedIfc:
    """A complete IFC file, opened.

    Attributes:
        file: The ``ifcopenshell.file``.
        schema: Schema that it was read as.
        unit: Name of its length unit.
        metres_per_unit: Its length unit in metres.
        notes: What the user should know.
        outlines: Number of points by step id, of outlines with more than a kernel can take.
        written_on: Day on which it was written, by its header.
    """

    file: Any
    schema: str
    unit: str
    metres_per_unit: float
    notes: tuple[str, ...]
    outlines: Mapping[int, int]
    written_on: date | None = None


def open_ifc(path: Path, data: bytes) -> OpenedIfc:
    """Return an IFC file, opened and checked for completeness.

    ``path``: names the file in errors; ``.ifczip`` is unpacked in memory.

    Raises:
        IfcError: If it is not IFC, truncated, damaged, of an unreadable schema, or without exactly one IfcProject or
            without a length unit; or if a point or a unit is not one.
    """
    step = step_bytes(path, data)
    check_frame(path, step)
    stated, _ = stated_schema(path, step)
    ifcopenshell.get_log()  # discards the log of earlier files
    text, text_notes = parser_text(path, step)
    file = parse_text(path, text)
    schema = str(file.schema_identifier)
    notes = [f"schema {stated} was read as {schema}"] if schema != stated else []
    notes += text_notes
    notes += _judge_log(path, text, file, ifcopenshell.get_log(), stated)
    notes += _check_complete(path, step, file)
    check_points(path, step)
    projects = file.by_type("IfcProject")
    if len(projects) != 1:
        raise IfcError(
            path,
            f"holds {len(projects)} IfcProject instances, not exactly one",
            hint="export the model again; a file without its project has no units and is most likely truncated",
        )
    with named_misfit(path, file):
        unit, metres = _length_unit(path, projects[0])
    return OpenedIfc(file, schema, unit, metres, tuple(notes), long_outlines(step), stated_day(step))


def parse_text(path: Path, text: str) -> Any:
    """Return the ``ifcopenshell.file`` of STEP text from ``parser_text``.

    Raises:
        IfcError: If it cannot be parsed at all.
    """
    try:
        file = ifcopenshell.file.from_string(text)
        file.by_type("IfcRoot")  # a file whose header could not be read fails here
    except (ifcopenshell.Error, RuntimeError) as error:
        raise IfcError(path, f"cannot be parsed: {error}", hint="export the model again") from error
    return file


def _check_complete(path: Path, step: bytes, file: Any) -> list[str]:
    """Return notes on instances that were not read: the parser silently drops what it does not understand."""
    missing = _unread(step, file)
    if missing:
        missing = _unread(without_comments(step), file)
    if not missing:
        return []
    known = ifcopenshell.ifcopenshell_wrapper.schema_by_name(file.schema_identifier)
    unknown: Counter[str] = Counter()
    for step_id, name, offset in missing:
        try:
            known.declaration_by_name(name)
        except RuntimeError:
            unknown[name] += 1
            continue
        line = step.count(b"\n", 0, offset) + 1
        raise IfcError(
            path,
            f"is damaged: {len(missing)} instances cannot be read, the first is #{step_id}={name} near line {line}",
            hint="export or copy the model again",
        )
    classes = ", ".join(f"{count} {name}" for name, count in sorted(unknown.items()))
    return [f"left out, because {file.schema_identifier} does not define them: {classes}"]


def _unread(step: bytes, file: Any) -> list[tuple[int, str, int]]:
    """Return (step id, class, offset) of the instances in the text that are missing in the parsed file."""
    read = set(file.entity_names())
    return [
        (int(found[1]), found[2].decode(), found.start(1))
        for found in _INSTANCE.finditer(step)
        if int(found[1]) not in read
    ]


def _length_unit(path: Path, project: Any) -> tuple[str, float]:
    """Return the name of the project's length unit, and its length in metres."""
    unit = project_units(path, project).get("LENGTHUNIT")
    metres = None if unit is None else si_scale(unit)
    if unit is None or metres is None:
        raise IfcError(
            path,
            f"its IfcProject #{project.id()} states no length unit",
            hint="export it with units; without one a millimetre and a metre look the same",
        )
    stated = str(unit.Name or "").upper()
    prefix = str(getattr(unit, "Prefix", None) or "")
    if unit.is_a("IfcSIUnit") and prefix:
        return f"{_PREFIXES.get(prefix, prefix.lower() + '-')}m", metres
    return _UNIT_NAMES.get(stated, stated.lower() or "unnamed"), metres
