"""The obstruction file, version 1: JSON or TOML. ``bimvox schema obstructions`` prints it."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any, Literal, Self

from pydantic import AfterValidator, Field, ValidationError, model_validator

from bimvox.bim.building import TriangleMesh
from bimvox.bim.read import ReadOptions, read_building
from bimvox.errors import InputError, ObstructionFileError
from bimvox.files import read_input, require_regular, resolved, status_of
from bimvox.site.config.validation import MOST, Point3, Positive, Table, Text, Whole, first_finding
from bimvox.site.nested import UTF8_HINT, WHERE_HINT, json_values, toml_values
from bimvox.site.obstructions.esri_grid import is_esri_grid, surface_of
from bimvox.site.obstructions.obstruction_set import (
    Box,
    Coordinates,
    Cylinder,
    Form,
    Obstruction,
    ObstructionSet,
    Points,
    Vec3,
    Voxels,
)
from bimvox.site.obstructions.point_file import read_points
from bimvox.site.site import CRANE_ID, GROUND_ID
from bimvox.uncollected import uncollected
from bimvox.units import metres_per

ReadMesh = Callable[[Path, str], TriangleMesh]
"""(mesh file, its length unit) -> its triangles in metres, in the file's own coordinates."""

_MOST_BYTES = 256 << 20
_LONGEST_ID = 1000
_NUMBERS = (int, float)
CellIndex = Annotated[Whole, Field(ge=-(2**31), lt=2**31)]


def _is_reserved(name: str) -> bool:
    return name in (GROUND_ID, CRANE_ID) or name.startswith(f"{CRANE_ID}:")


def _not_reserved(name: str) -> str:
    if _is_reserved(name):
        raise ValueError(f"{name!r} is reserved for the site")
    return name


class BoxEntry(Table):
    """An upright box."""

    min: Point3
    """Lowest corner [x, y, z]."""
    max: Point3
    """Highest corner [x, y, z]."""

    @model_validator(mode="after")
    def _has_volume(self) -> Self:
        low, high = self.min, self.max
        if high[0] <= low[0] or high[1] <= low[1] or high[2] <= low[2]:
            raise ValueError("max must be larger than min in x, y and z")
        return self


class CylinderEntry(Table):
    """An upright cylinder."""

    base: Point3
    """Centre of its base [x, y, z]."""
    radius: Positive
    """Its radius."""
    height: Positive
    """Its height."""


class ObstructionEntry(Table):
    """One obstruction: an id and exactly one of box, voxels, cylinder, mesh, points."""

    id: Annotated[Text, Field(max_length=_LONGEST_ID), AfterValidator(_not_reserved)]
    """Id, unique in the file."""
    box: BoxEntry | None = None
    """As below."""
    voxels: Annotated[tuple[tuple[CellIndex, CellIndex, CellIndex], ...], Field(min_length=1)] | None = None
    """Cell indices [i, j, k]; k = 0 is the slab."""
    cylinder: CylinderEntry | None = None
    """As below."""
    mesh: Text | None = None
    """Mesh file (STL, OBJ, PLY ...), relative to this file."""
    points: Text | None = None
    """Point cloud (PLY, XYZ, PTS, CSV, LAS, LAZ) or ESRI ASCII grid of heights, relative to this file."""

    @model_validator(mode="after")
    def _one_form(self) -> Self:
        missing = (self.box, self.voxels, self.cylinder, self.mesh, self.points).count(None)
        if missing != len(FORMS) - 1:
            given = [key for key in FORMS if getattr(self, key) is not None]
            raise ValueError(f"expected exactly one of {', '.join(FORMS)}, got {' and '.join(given) or 'none'}")
        return self


FORMS = ("box", "voxels", "cylinder", "mesh", "points")


class ObstructionFile(Table):
    """An obstruction file."""

    version: Literal[1]
    """Version of the format."""
    unit: Literal["m", "mm", "ft"] = "m"
    """Unit of every length, mesh and point files included; a LAS file that states its unit keeps it."""
    coordinates: Coordinates | None = None
    """``site``: of the site frame; ``model``: of the model; ``map``: easting, northing and height, by the model's map
    conversion. Default: those of the site file, or, for what lies outside the site then, those that put it inside."""
    obstructions: tuple[ObstructionEntry, ...]
    """The obstructions."""

    @model_validator(mode="after")
    def _ids_are_unique(self) -> Self:
        first: dict[str, int] = {}
        for number, entry in enumerate(self.obstructions):
            if first.setdefault(entry.id, number) != number:
                raise ValueError(
                    f"obstructions[{number}].id: {entry.id!r} is already the id of obstructions[{first[entry.id]}]"
                )
        return self


def obstructions_json_schema() -> dict[str, Any]:
    """Return the JSON Schema (draft 2020-12) of the obstruction file."""
    schema = ObstructionFile.model_json_schema()
    schema["$defs"]["ObstructionEntry"]["oneOf"] = [
        {"required": [key], "properties": {key: {"not": {"type": "null"}}}} for key in FORMS
    ]
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **schema}


def read_mesh_file(path: Path, unit: str) -> TriangleMesh:
    """Return all bodies of a mesh file as one mesh; a :data:`ReadMesh`."""
    building = read_building(path, ReadOptions(unit=unit))
    mesh = TriangleMesh.joined([element.mesh for element in building.elements])
    return TriangleMesh(mesh.vertices_m + building.origin_m, mesh.faces)


def read_obstruction_file(path: Path) -> ObstructionSet:
    """Return the obstructions of an obstruction file, as :func:`parse_obstructions` does."""
    data = read_input(path, most_bytes=_MOST_BYTES, may_be_empty=True)
    with uncollected():  # looking for garbage among a million entries takes longer than reading
        return parse_obstructions(data, path.name, resolved(path).parent)


def parse_obstructions(data: bytes, name: str, folder: Path, *, read_mesh: ReadMesh = read_mesh_file) -> ObstructionSet:
    """Return the obstructions of an obstruction file, in metres, in the coordinates of the file.

    Args:
        data: Its bytes.
        name: Its name; ``.toml`` is TOML, everything else JSON.
        folder: Its folder; paths of mesh and point files are relative to it.
        read_mesh: Reads a referenced mesh file.

    Raises:
        ObstructionFileError: If the syntax is wrong (line and column), an entry is not allowed (key), an id is not
            unique, or a referenced file cannot be used.
    """
    values = _decode(data, name, _plain_box)
    try:
        unit, entries = _validated(values)
    except ValidationError as error:
        found = first_finding(error, ObstructionFile)
        raise ObstructionFileError(name, found.message, key=found.key or None, hint=found.hint) from None
    obstructions, files, scale = [], [], metres_per(unit)
    for number, entry in enumerate(entries):
        if isinstance(entry, Obstruction):
            obstructions.append(entry if scale == 1.0 else _box(entry.id, *_corners(entry), scale))
            continue
        if entry.box is not None:
            obstructions.append(_box(entry.id, entry.box.min, entry.box.max, scale))
            continue
        for key, reference in (("mesh", entry.mesh), ("points", entry.points)):
            if reference is not None:
                files.append(_existing(folder / reference, name, f"obstructions[{number}].{key}"))
        try:
            obstructions.append(Obstruction(entry.id, _form(entry, unit, folder, read_mesh)))
        except InputError as error:
            key = f"obstructions[{number}].{'mesh' if entry.mesh is not None else 'points'}"
            raise ObstructionFileError(name, error.message, key=key, hint=error.hint) from error
    coordinates = values.get("coordinates") if isinstance(values, dict) else None
    return replace(ObstructionSet.of(obstructions, name, tuple(files)), coordinates=coordinates)


def _plain_box(table: dict[str, object]) -> object:
    """Return the obstruction of a table that is a box without a fault, lengths in the file's unit; otherwise the table.

    A file may hold a million of them. Only what is left goes through the schema, which says what is wrong.
    """
    name, box = table.get("id"), table.get("box")
    if len(table) != 2 or type(name) is not str or type(box) is not dict or len(box) != 2:
        return table
    low, high = box.get("min"), box.get("max")
    if type(low) is not list or type(high) is not list or len(low) != 3 or len(high) != 3:
        return table
    for a, b in zip(low, high, strict=True):
        if type(a) not in _NUMBERS or type(b) not in _NUMBERS or not -MOST <= a < b <= MOST:
            return table
    if not 0 < len(name) <= _LONGEST_ID or _is_reserved(name) or not name.isprintable():
        return table
    return _box(name, low, high, 1.0)


def _validated(values: object) -> tuple[str, Sequence[Obstruction | ObstructionEntry]]:
    """Return the unit and the entries of a file, whose boxes without a fault are obstructions already."""
    given = values.get("obstructions") if isinstance(values, dict) else None
    if isinstance(values, dict) and isinstance(given, list):
        try:
            rest = ObstructionFile.model_validate(
                {**values, "obstructions": [one for one in given if not isinstance(one, Obstruction)]}
            )
        except ValidationError:
            pass  # said below, with the place in the whole file
        else:
            left = iter(rest.obstructions)
            entries = [one if isinstance(one, Obstruction) else next(left) for one in given]
            if len({one.id for one in entries}) == len(entries):
                return rest.unit, entries
    whole = ObstructionFile.model_validate(_as_tables(values))
    return whole.unit, whole.obstructions


def _as_tables(values: object) -> object:
    """Return values as they stand in the file."""
    if isinstance(values, Obstruction):
        low, high = _corners(values)
        return {"id": values.id, "box": {"min": list(low), "max": list(high)}}
    if isinstance(values, dict):
        return {key: _as_tables(value) for key, value in values.items()}
    return [_as_tables(value) for value in values] if isinstance(values, list) else values


def _corners(one: Obstruction) -> tuple[Vec3, Vec3]:
    assert isinstance(one.form, Box)
    return one.form.low_m, one.form.high_m


def _box(name: str, low: Sequence[float], high: Sequence[float], scale: float) -> Obstruction:
    return Obstruction(name, Box(_scaled(low, scale), _scaled(high, scale)))


def obstructions_to_json(given: ObstructionSet) -> bytes:
    """Return the obstruction file of obstructions that were given as a value.

    Meshes and points have no place in such a file: their entries refer to a file that does not exist.
    """
    entries = [_entry(one) for one in given.obstructions]
    return json.dumps({"version": 1, "coordinates": "site", "obstructions": entries}).encode()


def _entry(one: Obstruction) -> dict[str, Any]:
    match one.form:
        case Box(low_m, high_m):
            form: dict[str, Any] = {"box": {"min": low_m, "max": high_m}}
        case Cylinder(base_m, radius_m, height_m):
            form = {"cylinder": {"base": base_m, "radius": radius_m, "height": height_m}}
        case Voxels(cells):
            form = {"voxels": cells}
        case other:
            form = {"mesh" if isinstance(other, TriangleMesh) else "points": "given as a value"}
    return {"id": one.id, **form}


def without_references(data: bytes, name: str) -> tuple[bytes, frozenset[str]]:
    """Return an obstruction file as JSON without the entries that refer to other files, and the ids of those.

    Raises:
        ObstructionFileError: If the syntax is wrong.
    """
    # A backslash may write a letter of these keys.
    if not name.lower().endswith(".toml") and not any(word in data for word in (b"mesh", b"points", b"\\")):
        return data, frozenset()
    document = _decode(data, name)
    entries = document.get("obstructions") if isinstance(document, dict) else None
    if not isinstance(document, dict) or not isinstance(entries, list):
        return data, frozenset()
    refers = [isinstance(entry, dict) and not {"mesh", "points"}.isdisjoint(entry) for entry in entries]
    kept = [entry for entry, does in zip(entries, refers, strict=True) if not does]
    ids = frozenset(str(entry.get("id")) for entry, does in zip(entries, refers, strict=True) if does)
    return json.dumps({**document, "obstructions": kept}).encode(), ids


def _decode(data: bytes, name: str, of_table: Callable[[dict[str, object]], object] | None = None) -> object:
    """Return the parsed text; errors give the line. ``of_table`` may replace each table of JSON, to save memory."""
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        raise ObstructionFileError(name, f"not UTF-8 text (line {line})", hint=UTF8_HINT) from None
    if not text.strip():
        raise ObstructionFileError(
            name, "the file is empty", hint='without obstructions, write {"version": 1, "obstructions": []}'
        )
    try:
        if not name.lower().endswith(".toml"):
            return json_values(text, of_table)
        values = toml_values(text)
    except ValueError as error:
        raise ObstructionFileError(name, str(error), hint=WHERE_HINT) from None
    entries = values.get("obstructions")
    if of_table is not None and isinstance(entries, list):
        entries[:] = (of_table(entry) if isinstance(entry, dict) else entry for entry in entries)
    return values


def _form(entry: ObstructionEntry, unit: str, folder: Path, read_mesh: ReadMesh) -> Form:
    scale = metres_per(unit)
    if entry.voxels is not None:
        return Voxels(entry.voxels)
    if entry.cylinder is not None:
        one = entry.cylinder
        return Cylinder(_scaled(one.base, scale), one.radius * scale, one.height * scale)
    if entry.mesh is not None:
        return read_mesh(folder / entry.mesh, unit)
    assert entry.points is not None
    scan = folder / entry.points
    return surface_of(scan, scale) if is_esri_grid(scan) else Points(read_points(scan, scale))


def _existing(path: Path, name: str, key: str) -> Path:
    def refused(there: Path, message: str, *, hint: str) -> ObstructionFileError:
        return ObstructionFileError(name, f"{there}: {message}", key=key, hint=hint)

    if status_of(path, refused) is None:
        raise ObstructionFileError(name, f"no such file: {path}", key=key, hint="paths are relative to this file")
    require_regular(path, refused)
    return path


def _scaled(point: Sequence[float], scale: float) -> Vec3:
    return (point[0] * scale, point[1] * scale, point[2] * scale)
