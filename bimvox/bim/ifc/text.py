"""STEP text as IfcOpenShell can read it: without an error, it stops at much that exporters write."""

from __future__ import annotations

import re
from collections import Counter
from functools import cache
from itertools import pairwise
from pathlib import Path

import ifcopenshell

from bimvox.bim.ifc.step_file import stated_schema
from bimvox.errors import IfcError, cut

_STAR = re.compile(r"(?<!IFCORIENTEDEDGE)(?<!\(\*)[(,]\s*\*\s*[,)]")  # oriented edges, by the million, derive theirs
_HEAD = re.compile(r"=\s*([A-Za-z0-9_]+)\s*\(")
_SIGN = re.compile(r"'[^']*'|[(),;*]")
_MOST_SIGNS = 8
"""Equals signs that the texts of an instance may hold in front of an asterisk."""
_SHOWN = 3


def without_stars(text: str, schema: str) -> tuple[str, list[str]]:
    """Return STEP text in which ``*`` is ``$`` wherever the schema derives no value; its length stays.

    Args:
        text: The data section; IfcOpenShell cannot mesh what has a ``*`` in place of a name.
        schema: As IfcOpenShell names it.

    Returns:
        The text, and notes that count what was read so.
    """
    places: list[int] = []
    classes: Counter[str] = Counter()
    done = 0
    while (star := _STAR.search(text, done)) is not None:
        head = _head_between(text, done, star.start() + 1)
        if head is None:
            done = star.end() - 1
            continue
        stars, done = _stars_of(text, head.end(), _derived(schema, head[1].upper()))
        places += stars
        classes[head[1]] += len(stars)
    if not places:
        return text, []
    most = ", ".join(f"{count:,} in {name}" for name, count in classes.most_common(_SHOWN) if count)
    note = f"values written as * that {schema} does not derive, so read as empty: {len(places):,} ({most})"
    pieces = [text[begin + 1 : end] for begin, end in pairwise([-1, *places, len(text)])]
    return "$".join(pieces), [note]


def _head_between(text: str, low: int, high: int) -> re.Match[str] | None:
    """Return the last ``=CLASS(`` between two places; None if there is none."""
    for _ in range(_MOST_SIGNS):
        high = text.rfind("=", low, high)
        if high < 0:
            return None
        if (head := _HEAD.match(text, high)) is not None:
            return head
    return None


def _stars_of(text: str, begin: int, derived: tuple[bool, ...]) -> tuple[list[int], int]:
    """Return where an instance has asterisks for attributes that are not derived, and where it ends."""
    places: list[int] = []
    depth = attribute = 0
    for sign in _SIGN.finditer(text, begin):
        if sign[0] == ";":
            return places, sign.end()
        depth += (sign[0] == "(") - (sign[0] == ")")
        attribute += sign[0] == "," and depth == 0
        if sign[0] == "*" and depth == 0 and attribute < len(derived) and not derived[attribute]:
            places.append(sign.start())
    return places, len(text)


@cache
def _derived(schema: str, name: str) -> tuple[bool, ...]:
    """Return of each attribute of a class whether the schema derives it; nothing of an unknown class."""
    try:
        declared = ifcopenshell.ifcopenshell_wrapper.schema_by_name(schema).declaration_by_name(name).as_entity()
    except RuntimeError:
        return ()
    return () if declared is None else tuple(map(bool, declared.derived()))


_SAME_CLASSES = {
    "IFC2X3": "IFC2X IFC2X_FINAL IFC2X2 IFC2X2_FINAL IFC2X2_ADD1 IFC2X3_FINAL IFC2X3_TC1",
    "IFC4": "IFC4RC4 IFC4_ADD1 IFC4_ADD2 IFC4_ADD2_TC1 IFC4X1 IFC4X2",
    "IFC4X3_ADD2": "IFC4X3 IFC4X3_TC1 IFC4X3_ADD1 IFC4X3_RC1 IFC4X3_RC2 IFC4X3_RC3 IFC4X3_RC4",
}
REWRITES: dict[str, str] = {name: schema for schema, names in _SAME_CLASSES.items() for name in names.split()}
"""Schema names that IfcOpenShell refuses, and the schema whose building classes they share. Instances that do not fit
that schema give a note; geometry that does not fit is refused (``parser_log``)."""

READABLE = tuple(_SAME_CLASSES)

_HEADER = (
    "ISO-10303-21;HEADER;FILE_DESCRIPTION((''),'2;1');FILE_NAME('','',(''),(''),'','','');FILE_SCHEMA(('{}'));ENDSEC;"
)
_DATA = re.compile(rb"\bDATA\s*[;(]")
_BEYOND_ASCII = re.compile(r"[^\x00-\x7f]+")
_ESCAPE = re.compile(
    r"\\\\|\\X2\\(?:[0-9A-Fa-f]{4})+\\X0\\|\\X4\\(?:[0-9A-Fa-f]{8})+\\X0\\"
    r"|\\X\\[0-9A-Fa-f]{2}|\\S\\.|\\P[A-I]\\|\\"
)


_MOST_LABEL = 1000


def label(value: object) -> str:
    """Return a name as text, cut to 1000 characters: the standard allows 255, a damaged file holds any number."""
    return cut(str(value or ""), _MOST_LABEL)


def parser_text(path: Path, step: bytes) -> tuple[str, list[str]]:
    """Return STEP text as IfcOpenShell can read it, with the same number of lines, and notes.

    - A plain header replaces the original: only its schema matters, and the parser fails on a comment or a Windows
      path in it. A schema that the parser does not know is renamed.
    - Characters beyond ASCII are encoded as the standard requires. Many exporters write them unencoded, and the
      parser would drop them.
    - A backslash that does not begin an encoding of the standard is kept as a backslash, also if an encoding was cut
      short: the parser would end the file there.
    - An asterisk is read as an empty value wherever the schema derives none (``stars``), with a note.

    Raises:
        IfcError: If the schema cannot be read, or the data section is missing.
    """
    stated, (_, end) = stated_schema(path, step)
    schema = REWRITES.get(stated, stated)
    if schema not in READABLE:
        readable = ", ".join(READABLE)
        raise IfcError(path, f"schema {stated} cannot be read", hint=f"export it as one of {readable}")
    data = _DATA.search(step, end)
    if data is None:
        raise IfcError(path, "has no DATA section", hint="export the model again")
    lines = "\n" * step.count(b"\n", 0, data.start())
    body = step[data.start() :]
    try:
        text = body.decode("utf-8")
    except UnicodeDecodeError:
        text = body.decode("latin-1")
    if "\\" in text:
        text = _ESCAPE.sub(lambda found: "\\\\" if found[0] == "\\" else found[0], text)
    if not text.isascii():
        text = _BEYOND_ASCII.sub(_encoded, text)
    text, notes = without_stars(text, schema)
    return _HEADER.format(schema) + lines + text, notes


def _encoded(run: re.Match[str]) -> str:
    """Return characters encoded as ISO 10303-21 requires."""
    return f"\\X4\\{run[0].encode('utf-32-be').hex().upper()}\\X0\\"
