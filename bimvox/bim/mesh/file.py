"""Read a mesh file into a building: named bodies become elements, an unnamed triangle soup is split into bodies."""

from __future__ import annotations

import hashlib
import re
import struct
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bimvox.bim.building import Building, Element, SkippedProduct, Source, TriangleMesh
from bimvox.bim.kinds.kind import UNTOUCHED
from bimvox.bim.kinds.words import DEFAULT_DENSITY_KG_M3
from bimvox.bim.mesh.bodies import bodies_of
from bimvox.bim.mesh.contents import MeshContents
from bimvox.bim.mesh.gltf import read_gltf
from bimvox.bim.mesh.ply import read_ply
from bimvox.bim.mesh.repair import drop_bad_faces, solid_of, turn_outward, weld
from bimvox.bim.mesh.select import corrections_of, roles_of, with_correction
from bimvox.bim.mesh.stl_obj_off import read_obj, read_off, read_stl
from bimvox.bim.mesh.threemf import read_3mf
from bimvox.bim.mesh.units import Scale, doubts, scale_of
from bimvox.bim.options import ReadOptions
from bimvox.bim.site_frame import FAR_M, local_origin, stray
from bimvox.errors import MeshError, listed
from bimvox.progress import Report

MESH_CLASS = "Mesh"
READERS: Mapping[str, Callable[[Path, bytes], MeshContents]] = {
    ".stl": read_stl,
    ".obj": read_obj,
    ".ply": read_ply,
    ".off": read_off,
    ".glb": read_gltf,
    ".gltf": read_gltf,
    ".3mf": read_3mf,
}
"""Readers by suffix."""


@dataclass(frozen=True, slots=True, eq=False)
class _Cleaned:
    """Bodies by name, what did not become a body, and the number of faces dropped."""

    meshes: Mapping[str, TriangleMesh]
    skipped: tuple[SkippedProduct, ...]
    dropped: int


def read_mesh_file(path: Path, data: bytes, sha256: str, options: ReadOptions, report: Report) -> Building:
    """Return the building in a mesh file.

    Args:
        path: The file; its suffix gives the format.
        data: Its bytes.
        sha256: Their hash.
        options: ``select``: names with wildcards, separated by commas; ``unit`` and ``up`` of the file.
        report: Called with the progress.

    Raises:
        MeshError: If the file cannot be read or does not contain triangles.
        SelectionError: If a name of the selection matches nothing.
        InputError: If the unit is unknown.
    """
    suffix = path.suffix.lower()
    report("open", 0, 1)
    contents = _contents(path, data)
    scale = scale_of(contents, options)
    report("open", 1, 1)
    cleaned = _cleaned(contents, scale)
    if not cleaned.meshes:
        raise _nothing(path, contents)
    meshes = cleaned.meshes
    notes = [*contents.notes, *scale.notes]
    if cleaned.dropped:
        notes.append(f"dropped triangles without area or with an invalid corner: {cleaned.dropped:,}")
    boxes = [mesh.bounds_m for mesh in meshes.values()]
    origin_m = local_origin(boxes)
    size_m = float((np.max([box[1] for box in boxes], axis=0) - np.min([box[0] for box in boxes], axis=0)).max())
    roles = roles_of(path.name, list(meshes), options.select)
    corrected, lost = corrections_of(path.name, list(meshes), options.corrections)
    notes += lost
    elements = []
    flipped, guessed = 0, []
    for index, (name, mesh) in enumerate(meshes.items()):
        local = TriangleMesh(mesh.vertices_m - origin_m, mesh.faces)
        outward, shells, turned = turn_outward(local)
        solid = solid_of(shells)
        flipped += turned
        guessed += [] if solid.exact else [name]
        element = Element(
            name,
            name,
            MESH_CLASS,
            name,
            outward,
            roles[name],
            solid.volume_m3 * DEFAULT_DENSITY_KG_M3,
            "default",
            volume_guessed=not solid.exact,
        )
        elements.append(with_correction(element, solid.volume_m3, corrected.get(name, UNTOUCHED)))
        report("elements", index + 1, len(meshes))
    heaviest_kg = max(element.mass_kg for element in elements)
    notes += doubts(scale, size_m, heaviest_kg, max(body.rounding for body in contents.bodies))
    if flipped:
        notes.append(f"inside-out bodies turned outward: {flipped}")
    if guessed:
        notes.append(f"bodies that are not closed, so their mass is a guess: {listed(guessed, 8)}")
    far = [elements[index].name for index in stray(boxes)] if len(boxes) > 1 else []
    if far:
        notes.append(f"bodies more than {FAR_M:g} m from the rest: {listed(far, 8)}")
    if contents.external:
        parts = [sha256, *(hashlib.sha256(part).hexdigest() for part in contents.external)]
        sha256 = hashlib.sha256("".join(parts).encode()).hexdigest()
    source = Source(path.name, sha256, suffix[1:].upper(), scale.unit, scale.assumed)
    return Building(tuple(elements), cleaned.skipped, source, origin_m, notes=tuple(notes))


def _contents(path: Path, data: bytes) -> MeshContents:
    """Return the contents of the file; an unexpected error in a reader means that the file is damaged."""
    suffix = path.suffix.lower()
    try:
        return READERS[suffix](path, data)
    except (ValueError, TypeError, LookupError, OverflowError, AttributeError, struct.error, RecursionError) as error:
        what = str(error).split("\n")[0] or type(error).__name__
        raise MeshError(
            path,
            f"cannot be read as {suffix[1:].upper()}: {what}",
            hint="the file is damaged, or its suffix wrong: export it again",
        ) from error


def _cleaned(contents: MeshContents, scale: Scale) -> _Cleaned:
    """Return the bodies scaled, welded and cleaned, with unique names; unnamed ones are split."""
    meshes: dict[str, TriangleMesh] = {}
    skipped = [
        SkippedProduct(name, MESH_CLASS, name, f"{reason}: no surface" if "support" not in reason else reason)
        for name, reason in contents.left_out
    ]
    dropped = unnamed = 0
    used: dict[str, int] = {}
    for body in sorted(contents.bodies, key=lambda body: _natural(body.name)):
        clean, bad = drop_bad_faces(TriangleMesh(scale.vertices_m(body), body.faces))
        dropped += bad
        if len(clean.faces):
            clean, bad = drop_bad_faces(weld(clean))
            dropped += bad
        if not len(clean.faces):
            skipped.append(SkippedProduct(body.name, MESH_CLASS, body.name, "has no triangle with an area"))
            continue
        if not body.name:
            pieces = bodies_of(clean)
            meshes |= {f"body-{unnamed + index}": piece for index, piece in enumerate(pieces)}
            unnamed += len(pieces)
            continue
        name, number = body.name, used.get(body.name, 1)
        while name in meshes:
            number += 1
            name = f"{body.name}#{number}"
        used[body.name] = number
        meshes[name] = clean
    return _Cleaned(meshes, tuple(skipped), dropped)


def _nothing(path: Path, contents: MeshContents) -> MeshError:
    """Return the error for a file without a usable triangle."""
    if not contents.bodies and contents.left_out:
        held = "; ".join(f"{name}: {what}" if name else what for name, what in contents.left_out[:3])
        if "points" in held:
            return MeshError(
                path,
                f"holds {held} but no faces: it is a scan or a drawing, not a building",
                hint=f'use it as an obstruction: {{"id": "scan", "points": "{path.name}"}} in an obstruction file',
            )
        return MeshError(path, f"holds {held} but no faces", hint="export it as a triangle mesh")
    return MeshError(path, "holds no triangle with an area", hint="export it as a triangle mesh")


def _natural(name: str) -> tuple[tuple[int, str], ...]:
    """Return a sort key that puts ``body-2`` before ``body-10``."""
    parts: Sequence[tuple[str, str]] = re.findall(r"(\d*)(\D*)", name)
    return tuple((int(digits[:300]) if digits else -1, text) for digits, text in parts)
