"""Read OBJ: vertices, polygons, objects and groups as text. It states neither unit nor up.

Materials, normals and texture coordinates are ignored. A body is an object (``o``) if the file has several, otherwise
a group (``g``). Without objects and groups the file is one unnamed triangle soup.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from bimvox.bim.mesh.contents import CORNERS_MOST, MeshContents, RawBody, body_of_polygons, damaged, too_many_corners
from bimvox.bim.mesh.text import rows_of_numbers, text_of
from bimvox.errors import MeshError

_CURVED = ("curv", "curv2", "surf")
_NO_NAME = ("", "default", "off", "(null)")

Polygons = dict[tuple[int, str, str], list[list[int]]]
"""Corners of the faces by (number of the object, its name, group)."""


def read_obj(path: Path, data: bytes) -> MeshContents:
    """Return the bodies of an OBJ file.

    Raises:
        MeshError: If it is damaged, or not OBJ.
    """
    rows: list[str] = []
    faces: Polygons = {}
    left_out = {"lines": 0, "points": 0, "curved surfaces": 0}
    key = (0, "", "")
    corners = faces.setdefault(key, [])
    text = text_of(data).replace("\\\r\n", " ").replace("\\\n", " ")
    for number, line in enumerate(text.split("\n"), 1):
        word, rest = (*line.split("#", 1)[0].split(None, 1), "", "")[:2]
        if word == "v":
            rows.append(rest)
        elif word in ("f", "fo"):
            corners.append(_corners(path, number, rest, len(rows)))
        elif word in ("o", "g"):
            name = line.split(None, 1)[-1].strip() if rest else ""
            name = "" if name.lower() in _NO_NAME else name
            key = (key[0] + 1, name, "") if word == "o" else (key[0], key[1], name)
            corners = faces.setdefault(key, [])
        elif word in ("l", "p") or word in _CURVED:
            left_out[{"l": "lines", "p": "points"}.get(word, "curved surfaces")] += 1
    if not rows:
        raise MeshError(path, "has no vertices: it is empty or not OBJ", hint="check the suffix, or export it again")
    vertices = rows_of_numbers(path, rows, 3, "a vertex")
    named = _bodies({key: polygons for key, polygons in faces.items() if polygons})
    bodies: list[RawBody] = [body_of_polygons(name, vertices, polygons) for name, polygons in named]
    if not bodies and not any(left_out.values()):
        left_out["points"] = len(vertices)
    some = tuple(("", f"{count:,} {what}") for what, count in left_out.items() if count)
    return MeshContents(tuple(body for body in bodies if np.size(body.faces)), left_out=some)


def _bodies(faces: Polygons) -> list[tuple[str, list[list[int]]]]:
    """Return the faces of every body with its name."""
    objects = {(number, name) for number, name, _ in faces if name}
    if len(objects) == 1 and len({group for _, _, group in faces}) == 1:
        return [(name, polygons) for (_, name, _), polygons in faces.items()]
    by_object = len(objects) > 1
    bodies: dict[tuple[int, str], list[list[int]]] = {}
    for (number, name, group), polygons in faces.items():
        body = (number, name) if by_object else (0, group or name)
        bodies.setdefault(body, []).extend(polygons)
    return [(name, polygons) for (_, name), polygons in bodies.items()]


def _corners(path: Path, number: int, rest: str, vertices: int) -> list[int]:
    """Return the vertices of a face, from 0 (``1/2/3``, ``1//3`` or ``1`` in the file; negative ones count back)."""
    words = rest.split(None, CORNERS_MOST)
    if len(words) > CORNERS_MOST:
        raise too_many_corners(path, f"line {number}: the face {rest.strip()[:40]!r}")
    try:
        corners = [int(word.split("/", 1)[0]) for word in words]
    except ValueError:
        raise damaged(path, f"line {number}: the face {rest.strip()[:40]!r} is not understood") from None
    return [corner - 1 if corner > 0 else corner + vertices if corner < 0 else -1 for corner in corners]
