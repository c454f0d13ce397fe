"""Read OFF (also COFF, NOFF, STOFF): vertices and polygons as text. It states neither unit nor up."""

from __future__ import annotations

import re
from pathlib import Path

from bimvox.bim.mesh.contents import CORNERS_MOST, MeshContents, body_of_polygons, damaged, too_many_corners
from bimvox.bim.mesh.text import numbers, rows_of_numbers, text_of
from bimvox.errors import MeshError

_KEYWORD = re.compile(r"\s*(ST)?C?N?(4)?(n)?OFF(?![a-z])[ \t]*(BINARY)?", re.IGNORECASE)


def read_off(path: Path, data: bytes) -> MeshContents:
    """Return the contents of an OFF file: one unnamed triangle soup.

    Raises:
        MeshError: If it is truncated, binary, or not OFF.
    """
    text = re.sub(r"#[^\n]*", "", text_of(data))
    keyword = _KEYWORD.match(text)
    if keyword is None:
        raise MeshError(path, "does not begin with OFF", hint="check the suffix")
    if any(keyword.group(index) for index in (2, 3, 4)):
        kind = " ".join(keyword.group().split())
        raise MeshError(path, f"is a {kind} file, which is not read", hint="export it as plain, three-dimensional OFF")
    lines = [line for line in text[keyword.end() :].splitlines() if line.strip()]
    counts = numbers(path, lines[0], "its second line") if lines else ()
    if len(counts) < 2 or any(count < 0 or count != int(count) for count in counts[:2]):
        raise damaged(path, "its second line does not count vertices and faces")
    vertex_count, face_count = (int(count) for count in counts[:2])
    if 1 + vertex_count + face_count > len(lines):
        raise damaged(
            path,
            f"declares {vertex_count:,} vertices and {face_count:,} faces, but has {len(lines) - 1:,} lines",
        )
    vertices = rows_of_numbers(path, lines[1 : 1 + vertex_count], 3, "a vertex")
    polygons = [_corners(path, line) for line in lines[1 + vertex_count : 1 + vertex_count + face_count]]
    if vertex_count and not face_count:
        return MeshContents((), left_out=(("", f"{vertex_count:,} points"),))
    return MeshContents((body_of_polygons("", vertices, polygons),))


def _corners(path: Path, line: str) -> list[int]:
    """Return the corners of a face; the line starts with their number and may end with a colour."""
    words = line.split(None, CORNERS_MOST + 1)
    if len(words) > CORNERS_MOST + 1:
        raise too_many_corners(path, f"the face {line.strip()[:40]!r}")
    try:
        count = int(words[0])
        corners = [int(word) for word in words[1 : count + 1]]
    except ValueError:
        raise damaged(path, f"the face {line.strip()[:40]!r} has a corner that is not a number") from None
    if count < 0 or len(corners) < count:
        raise damaged(path, f"the face {line.strip()[:40]!r} has fewer corners than it declares")
    return corners
