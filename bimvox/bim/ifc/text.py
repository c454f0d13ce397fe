"""STEP text as IfcOpenShell can read it: it stops, without a word, at much that exporters write."""

from __future__ import annotations

import re
from pathlib import Path

from bimvox.bim.ifc.step_file import stated_schema
from bimvox.errors import IfcError

REWRITES: dict[str, str] = {
    "IFC2X": "IFC2X3",
    "IFC2X_FINAL": "IFC2X3",
    "IFC2X2": "IFC2X3",
    "IFC2X2_FINAL": "IFC2X3",
    "IFC2X2_ADD1": "IFC2X3",
    "IFC2X3_FINAL": "IFC2X3",
    "IFC2X3_TC1": "IFC2X3",
    "IFC4RC4": "IFC4",
    "IFC4_ADD1": "IFC4",
    "IFC4_ADD2": "IFC4",
    "IFC4_ADD2_TC1": "IFC4",
    "IFC4X3": "IFC4X3_ADD2",
    "IFC4X3_TC1": "IFC4X3_ADD2",
    "IFC4X3_ADD1": "IFC4X3_ADD2",
    "IFC4X3_RC1": "IFC4X3_ADD2",
    "IFC4X3_RC2": "IFC4X3_ADD2",
    "IFC4X3_RC3": "IFC4X3_ADD2",
    "IFC4X3_RC4": "IFC4X3_ADD2",
    "IFC4X1": "IFC4",
    "IFC4X2": "IFC4",
}
"""Schema names that IfcOpenShell refuses, and the schema whose building classes they share. What does not fit that
schema after all is noted, or refused where it is geometry (``ifc_log``)."""

READABLE = ("IFC2X3", "IFC4", "IFC4X3_ADD2")

_HEADER = (
    "ISO-10303-21;HEADER;FILE_DESCRIPTION((''),'2;1');FILE_NAME('','',(''),(''),'','','');FILE_SCHEMA(('{}'));ENDSEC;"
)
_DATA = re.compile(rb"\bDATA\s*[;(]")
_BEYOND_ASCII = re.compile(r"[^\x00-\x7f]+")
_ESCAPE = re.compile(
    r"\\\\|\\X2\\(?:[0-9A-Fa-f]{4})+\\X0\\|\\X4\\(?:[0-9A-Fa-f]{8})+\\X0\\"
    r"|\\X\\[0-9A-Fa-f]{2}|\\S\\.|\\P[A-I]\\|\\"
)


def parser_text(path: Path, step: bytes) -> str:
    """Return STEP text as IfcOpenShell can read it, the same number of lines.

    - The header is replaced by a plain one: of all that it says only the schema matters, and a comment or a Windows
      path in it would make the parser give up. A schema that it does not know is renamed.
    - Characters beyond ASCII, which the standard does not allow and many exporters write, are encoded as it asks:
      the parser would drop them.
    - A backslash that begins none of the encodings of the standard is taken as it stands, also where an encoding was
      cut short: the parser would end the file there.

    Args:
        path: Names the file in errors.
        step: The STEP text.

    Raises:
        IfcError: If the schema cannot be read, or there is no data section.
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
    return _HEADER.format(schema) + lines + text


def _encoded(run: re.Match[str]) -> str:
    """Encode characters as ISO 10303-21 asks."""
    return f"\\X4\\{run[0].encode('utf-32-be').hex().upper()}\\X0\\"
