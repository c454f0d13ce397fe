"""Read a mesh file into a building: named bodies become elements, an unnamed triangle soup is split into bodies."""

from __future__ import annotations

import difflib
import fnmatch
import hashlib
import re
import struct
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bimvox.bim.building import Building, Element, Role, SkippedProduct, Source, TriangleMesh
from bimvox.bim.kinds.evidence import casting_of
from bimvox.bim.kinds.kind import OUT, UNTOUCHED, Corrected, Correction, all_of, refused, unmatched
from bimvox.bim.kinds.words import DEFAULT_DENSITY_KG_M3, density_of_kind, role_by_name
from bimvox.bim.mesh.bodies import bodies_of
from bimvox.bim.mesh.contents import MeshContents, RawBody
from bimvox.bim.mesh.gltf import read_gltf
from bimvox.bim.mesh.ply import read_ply
from bimvox.bim.mesh.repair import drop_bad_faces, solid_of, turn_outward, weld
from bimvox.bim.mesh.stl_obj_off import read_obj, read_off, read_stl
from bimvox.bim.mesh.threemf import read_3mf
from bimvox.bim.options import ReadOptions
from bimvox.bim.site_frame import FAR_M, local_origin, stray
from bimvox.errors import MeshError, NothingSelectedError, SelectionError, cut, listed, shown
from bimvox.progress import Report
from bimvox.units import METRES_PER_UNIT, metres_per

_METRES = {**METRES_PER_UNIT, "µm": 1e-6}
_TINY_M = 0.1
"""A model smaller than this is not a building."""
_HEAVY_KG = 1e6
"""A heavier part means a wrong unit: this is over five times what a crane lifts."""
_ROUNDED_M = 0.0005
"""Coordinates rounded by more than this give a note."""
_USABLE_M = 1e9
"""A coordinate beyond this is damaged, whatever the unit."""
_Y_UP_TO_Z_UP = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])


@dataclass(frozen=True, slots=True)
class Scale:
    """Conversion from a file's coordinates to metres, z up.

    Attributes:
        unit: Name of the unit.
        metres: The unit in metres.
        assumed: Whether the unit is assumed.
        y_up: Whether y points up in the file.
        notes: What was assumed, or overrides the file.
    """

    unit: str
    metres: float
    assumed: bool
    y_up: bool
    notes: tuple[str, ...]

    def vertices_m(self, body: RawBody) -> NDArray[np.float64]:
        """Return a body's vertices in metres, z up; unusable ones become NaN."""
        with np.errstate(invalid="ignore", over="ignore"):
            scaled = body.vertices * self.metres
            metres = np.where(np.abs(scaled) <= _USABLE_M, scaled, np.nan)
            return metres @ _Y_UP_TO_Z_UP.T + 0.0 if self.y_up else metres + 0.0


def _scale_of(contents: MeshContents, options: ReadOptions) -> Scale:
    """Return unit and axes: as requested, otherwise as the file states, otherwise metres and z up, with a note.

    Raises:
        InputError: If the requested unit is unknown.
    """
    notes = []
    if options.unit is not None and contents.unit not in (None, options.unit):
        notes.append(f"read in {options.unit} as requested, although the file is in {contents.unit}")
    if options.up is not None and contents.up not in (None, options.up):
        notes.append(f"read with {options.up} up as requested, although the standard of the format is {contents.up} up")
    unit, up = options.unit or contents.unit, options.up or contents.up
    if unit is None and up is None:
        notes.append("the file states no unit: metres and z up are assumed; set unit and up (--unit, --up) otherwise")
    elif unit is None:
        notes.append("the file states no unit: metres are assumed; set unit (--unit) otherwise")
    elif up is None:
        notes.append("the file does not state which way is up: z is assumed; set up (--up) otherwise")
    metres = metres_per(options.unit) if options.unit is not None else _METRES[unit or "m"]
    return Scale(unit or "m", metres, unit is None, up == "y", tuple(notes))


def doubts(scale: Scale, size_m: float, heaviest_kg: float, rounding: float) -> list[str]:
    """Return notes on implausible sizes, masses and rounding.

    Args:
        scale: The unit and axes that were used.
        size_m: Longest side of the model.
        heaviest_kg: Mass of its heaviest body.
        rounding: Largest rounding of a coordinate, in the file's unit.
    """
    notes = []
    if size_m > FAR_M and scale.assumed:
        notes.append(f"in metres it spans {size_m:,.0f} m: the unit is most likely mm (unit, --unit)")
    elif heaviest_kg > _HEAVY_KG:
        notes.append(f"in {scale.unit} its heaviest body weighs {heaviest_kg / 1000:,.0f} t: check the unit")
    elif size_m > FAR_M or size_m < _TINY_M:
        notes.append(f"in {scale.unit} it spans {size_m:,.4g} m: check the unit")
    if rounding * scale.metres > _ROUNDED_M:
        millimetres = rounding * scale.metres * 1000
        notes.append(
            f"its coordinates are far from the origin in single precision: true to {millimetres:.2g} mm only; "
            "export it near the origin"
        )
    return notes


def roles_of(file: str, names: Sequence[str], select: str | None) -> Mapping[str, Role]:
    """Return the role of every name.

    Without a selection, every body is a component unless its name implies terrain or an obstacle (``name_roles``).
    With a selection, the names that it matches are components, and the others are structure or ground.

    ``names``: of its bodies; ``select``: one name, or names and patterns (``*``, ``?``) separated by commas.

    Raises:
        SelectionError: If a name or pattern matches nothing; it lists the nearest names.
    """
    by_name = {name: role_by_name(name) for name in names}
    if select is None:
        return {name: role or Role.COMPONENT for name, role in by_name.items()}
    chosen = _chosen_names(file, names, select)
    rest = {name: Role.GROUND if role is Role.GROUND else Role.STRUCTURE for name, role in by_name.items()}
    return {name: Role.COMPONENT if name in chosen else rest[name] for name in names}


def _chosen_names(file: str, names: Sequence[str], select: str) -> set[str]:
    """Return the names that a selection matches; the arguments and errors are those of :func:`roles_of`."""
    if select in names:  # a name may contain a comma
        return {select}
    patterns = [pattern.strip() for pattern in select.split(",") if pattern.strip()]
    chosen: set[str] = set()
    for pattern in patterns:
        # As a name first: many exporters put brackets into names, which a pattern reads as a set of letters.
        matching = [pattern] if pattern in names else fnmatch.filter(names, pattern)
        if not matching:
            raise NothingSelectedError(
                f"select {shown(select)}: no body of {file} is named {shown(pattern)}",
                hint=f"{_nearest(pattern, names)}the file has {listed(names, 8)}; * and ? are wildcards",
            )
        chosen.update(matching)
    if not chosen:
        raise SelectionError(f"select {shown(select)}: names nothing", hint=f"the file has {listed(names, 8)}")
    return chosen


def _nearest(pattern: str, names: Sequence[str]) -> str:
    """Return a question with the names most similar to a pattern, case-insensitive; empty if there are none."""
    by_lower = {name.lower(): name for name in names}
    other_case = fnmatch.filter(list(by_lower), pattern.lower())
    close = other_case or difflib.get_close_matches(pattern.lower().strip("*?"), list(by_lower), n=3)
    return f"did you mean {' or '.join(cut(by_lower[name]) for name in close[:3])}? " if close else ""


def corrections_of(
    file: str, names: Sequence[str], corrections: Sequence[Correction]
) -> tuple[Mapping[str, Corrected], list[str]]:
    """Return what the corrections say of each body, by name, and a note about each that selects none.

    Raises:
        SelectionError: If a selection names nothing at all.
    """
    found: dict[str, list[Correction]] = {}
    matched: set[Correction] = set()
    for one in corrections:
        try:
            chosen = {one.select} & set(names) if one.one_part else _chosen_names(file, names, one.select)
        except NothingSelectedError:
            chosen = set()
        except SelectionError as error:
            raise refused(one, error) from None
        for name in chosen:
            found.setdefault(name, []).append(one)
            matched.add(one)
    lost = unmatched([one for one in corrections if not one.one_part], matched.__contains__)
    return {name: all_of(own) for name, own in found.items()}, lost


def with_correction(element: Element, volume_m3: float, corrected: Corrected) -> Element:
    """Return a body with what the site file says of it; its mass, unless stated there, follows from its kind."""
    if corrected.judgement is not None:
        kind = corrected.judgement.kind
        kg, casting = volume_m3 * density_of_kind(kind), casting_of(kind, None)
        element = replace(element, judgement=corrected.judgement, mass_kg=kg, casting=casting)
    if corrected.mass_kg is not None:
        element = replace(element, mass_kg=corrected.mass_kg, mass_source="quantity", volume_guessed=False)
    if corrected.means is not None:
        role = Role.FITTING if corrected.means == OUT else Role.COMPONENT
        element = replace(element, role=role, stated_means=corrected.by_type)
    return element


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

    ``path``: the file; its suffix gives the format; ``options``: ``select``: names with wildcards, separated by commas;
    ``unit`` and ``up`` of the file.

    Raises:
        MeshError: If the file cannot be read or does not contain triangles.
        SelectionError: If a name of the selection matches nothing.
        InputError: If the unit is unknown.
    """
    suffix = path.suffix.lower()
    report("open", 0, 1)
    contents = _contents(path, data)
    scale = _scale_of(contents, options)
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
