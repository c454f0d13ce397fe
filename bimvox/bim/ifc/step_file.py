"""The STEP file of a model: whether it is complete, and which schema it states. Does not need IfcOpenShell."""

from __future__ import annotations

import io
import lzma
import re
import zipfile
import zlib
from datetime import date
from pathlib import Path

from bimvox.errors import IfcError

MAX_UNZIPPED_BYTES = 4 << 30
_HEADER_BYTES = 1 << 16
_TAIL_BYTES = 1 << 12
_SCHEMA = re.compile(rb"FILE_SCHEMA\s*\(\s*\(\s*'([^']*)'", re.IGNORECASE)
_WRITTEN = re.compile(rb"FILE_NAME\s*\(\s*'(?:[^']|'')*'\s*,\s*'(\d{4}-\d\d-\d\d)", re.IGNORECASE)
_NUMBER = rb"[-+.\d][-+.\dE]*"
_NOT_A_POINT = re.compile(
    rb"\b(IFCCARTESIANPOINT|IFCDIRECTION)\s*\((?!\s*\(\s*%b(?:\s*,\s*%b){1,2}\s*\)\s*\))" % (_NUMBER, _NUMBER),
    re.IGNORECASE,
)
"""IfcOpenShell drops coordinates that it cannot read, and takes a missing one as zero: the part is elsewhere."""
_TEXT = re.compile(rb"'[^'\n]*'")
_COMMENT = re.compile(rb"/\*.*?\*/", re.DOTALL)


def step_bytes(path: Path, data: bytes) -> bytes:
    """Return the STEP text of an ``.ifc``, or of the one IFC file inside an ``.ifczip``.

    Raises:
        IfcError: If the archive is damaged or does not hold exactly one IFC file.
    """
    if path.suffix.lower() != ".ifczip":
        return data
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            inside = [entry for entry in archive.infolist() if entry.filename.lower().endswith(".ifc")]
            if len(inside) != 1:
                xml = any(entry.filename.lower().endswith(".ifcxml") for entry in archive.infolist())
                hint = "ifcXML is not read: export it as .ifc" if xml and not inside else "unpack it and name one"
                raise IfcError(path, f"holds {len(inside)} .ifc files, not exactly one", hint=hint)
            if inside[0].file_size > MAX_UNZIPPED_BYTES:
                raise IfcError(path, f"unpacks to {inside[0].file_size:,} bytes, above the limit", hint="unpack it")
            return archive.read(inside[0])
    except (
        zipfile.BadZipFile,
        zlib.error,
        lzma.LZMAError,
        NotImplementedError,
        RuntimeError,
        OSError,
        EOFError,
    ) as error:
        raise IfcError(path, f"is not a readable zip archive: {error}", hint="zip or export it again") from error


def stated_day(step: bytes) -> date | None:
    """Return the day on which the file was written, by its header; None if it states none."""
    found = _WRITTEN.search(step[:_HEADER_BYTES])
    return None if found is None else day_in(found[1].decode())


def day_in(text: str) -> date | None:
    """Return the day of an ISO date, with or without a time; None if it is not one."""
    try:
        return date.fromisoformat(text[:10])
    except ValueError:
        return None


def check_frame(path: Path, step: bytes) -> None:
    """Check the first and the last line of the file.

    Raises:
        IfcError: If it is not a STEP file, or is truncated.
    """
    start = step[:_HEADER_BYTES].removeprefix(b"\xef\xbb\xbf")
    if not without_comments(start).lstrip().startswith(b"ISO-10303-21"):
        raise IfcError(path, "is not an IFC file: it does not begin with ISO-10303-21", hint="export the model as IFC")
    if b"END-ISO-10303-21" not in step[-_TAIL_BYTES:]:
        raise IfcError(
            path, "is truncated: it does not end with END-ISO-10303-21", hint="copy or download the whole file again"
        )


def check_points(path: Path, step: bytes) -> None:
    """Check that every point and direction has two or three numbers.

    Raises:
        IfcError: If one has not.
    """
    if _NOT_A_POINT.search(step) is None:
        return
    text = _TEXT.sub(lambda found: b" " * len(found[0]), without_comments(step))
    if found := _NOT_A_POINT.search(text):
        line = text.count(b"\n", 0, found.start()) + 1
        raise IfcError(
            path,
            f"is damaged: an {found[1].decode().upper()} in line {line} does not have two or three numbers",
            hint="export or copy the model again",
        )


def stated_schema(path: Path, step: bytes) -> tuple[str, tuple[int, int]]:
    """Return the schema name in the header, upper case, and its byte range.

    Raises:
        IfcError: If the header names none.
    """
    match = _SCHEMA.search(step, 0, _HEADER_BYTES)
    if match is None:
        raise IfcError(path, "its header names no schema (FILE_SCHEMA)", hint="export the model again")
    return match[1].decode("ascii", "replace").strip().upper(), match.span(1)


def without_comments(step: bytes) -> bytes:
    """Return the text with comments replaced by spaces; line breaks and offsets stay."""
    return _COMMENT.sub(lambda found: re.sub(rb"[^\n]", b" ", found[0]), step)
