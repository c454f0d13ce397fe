"""The obstruction file, version 1: JSON or TOML. ``bimvox schema obstructions`` prints it."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from functools import partial
from itertools import chain
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
    Gathered,
    Obstruction,
    ObstructionSet,
    Points,
    Vec3,
    Voxels,
)
from bimvox.site.obstructions.point_file import read_points
from bimvox.site.site import CRANE_ID, GROUND_ID
from bimvox.undisturbed import uncollected
from bimvox.units import metres_per

# Entries of an obstruction file without a fault, checked quickly: a file may hold a million of them.
#
# Only what is left goes through the schema, which says what is wrong.

LONGEST_ID = 1000
LEAST_INDEX, END_INDEX = -(2**31), 2**31
PLAIN = object()
"""Takes the place of an entry that was gathered."""
_NUMBERS = {int, float}


def _is_reserved(name: str) -> bool:
    """Return whether an id is that of something else on a site."""
    return name in (GROUND_ID, CRANE_ID) or name.startswith(f"{CRANE_ID}:")


def _plain_or_table(gathered: Gathered, table: dict[str, Any]) -> object:
    """Gather a table that is a box, a cylinder or voxels without a fault; return ``PLAIN``, otherwise the table."""
    name = table.get("id")
    if type(name) is not str or len(table) != 2:
        return table
    if not 0 < len(name) <= LONGEST_ID or _is_reserved(name) or not name.isprintable():
        return table
    box: Any = table.get("box")
    one: Any = table.get("cylinder")
    cells: Any = table.get("voxels")
    if _is_box(box):
        gathered.box(name, box["min"], box["max"])
    elif _is_cylinder(one):
        gathered.cylinder(name, one["base"], one["radius"], one["height"])
    elif _are_cells(cells):
        gathered.voxels(name, cells)
    else:
        return table
    return PLAIN


def _is_box(box: Any) -> bool:
    if type(box) is not dict or len(box) != 2:
        return False
    low, high = box.get("min"), box.get("max")
    if type(low) is not list or type(high) is not list or len(low) != 3 or len(high) != 3:
        return False
    if not _NUMBERS.issuperset(map(type, low)) or not _NUMBERS.issuperset(map(type, high)):
        return False
    a, b, c = low
    d, e, f = high
    return bool(-MOST <= a < d <= MOST and -MOST <= b < e <= MOST and -MOST <= c < f <= MOST)


def _is_cylinder(one: Any) -> bool:
    if type(one) is not dict or len(one) != 3:
        return False
    base: Any = one.get("base")
    radius: Any = one.get("radius")
    height: Any = one.get("height")
    if type(base) is not list or len(base) != 3 or not _NUMBERS.issuperset(map(type, (*base, radius, height))):
        return False
    x, y, z = base
    has_place = -MOST <= x <= MOST and -MOST <= y <= MOST and -MOST <= z <= MOST
    return bool(has_place and 0 < radius <= MOST and 0 < height <= MOST)


def _are_cells(cells: Any) -> bool:
    return (
        type(cells) is list
        and set(map(type, cells)) == {list}
        and set(map(len, cells)) == {3}
        and set(map(type, chain.from_iterable(cells))) == {int}
        and min(map(min, cells)) >= LEAST_INDEX
        and max(map(max, cells)) < END_INDEX
    )


ReadMesh = Callable[[Path, str], TriangleMesh]
"""(mesh file, its length unit) -> its triangles in metres, in the file's own coordinates."""

OfTable = Callable[[dict[str, object]], object]
"""Given a table, returns what takes its place."""

_MOST_BYTES = 256 << 20
CellIndex = Annotated[Whole, Field(ge=LEAST_INDEX, lt=END_INDEX)]


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

    id: Annotated[Text, Field(max_length=LONGEST_ID), AfterValidator(_not_reserved)]
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
    schema = ObstructionFile.file_schema()
    schema["$defs"]["ObstructionEntry"]["oneOf"] = [
        {"required": [key], "properties": {key: {"not": {"type": "null"}}}} for key in FORMS
    ]
    return schema


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
    gathered = Gathered()
    found = _validated(_decode(data, name, partial(_plain_or_table, gathered)), gathered.ids)
    if found is None:  # something is wrong; all entries are looked at to say where
        gathered = Gathered()
        try:
            whole = ObstructionFile.model_validate(_decode(data, name))
        except ValidationError as error:
            finding = first_finding(error, ObstructionFile)
            raise ObstructionFileError(name, finding.message, key=finding.key or None, hint=finding.hint) from None
        found = whole, range(len(whole.obstructions))
    rest, numbers = found
    files = []
    try:
        gathered.scale(metres_per(rest.unit))
    except InputError as error:
        raise ObstructionFileError(name, error.message, hint=error.hint) from None
    for number, entry in zip(numbers, rest.obstructions, strict=True):
        for key, reference in (("mesh", entry.mesh), ("points", entry.points)):
            if reference is not None:
                files.append(_existing(folder / reference, name, f"obstructions[{number}].{key}"))
        try:
            gathered.add(Obstruction(entry.id, _form(entry, rest.unit, folder, read_mesh)))
        except InputError as error:
            form = next(key for key in FORMS if getattr(entry, key) is not None)
            key = f"obstructions[{number}].{form}"
            raise ObstructionFileError(name, error.message, key=key, hint=error.hint) from error
    ordered = gathered.by_id() if gathered.ids else ()
    return ObstructionSet(ordered, name, tuple(files), rest.coordinates)


def _validated(values: object, plain: Sequence[str]) -> tuple[ObstructionFile, Sequence[int]] | None:
    """Return a file with the entries that were not gathered, and their numbers; None if something is wrong."""
    given = values.get("obstructions") if isinstance(values, dict) else None
    if not isinstance(values, dict) or not isinstance(given, list):
        return None
    numbers = [number for number, one in enumerate(given) if one is not PLAIN]
    try:
        rest = ObstructionFile.model_validate({**values, "obstructions": [given[number] for number in numbers]})
    except ValidationError:
        return None
    # Tables that look like an entry may stand in a wrong place, too.
    if len({*plain, *(one.id for one in rest.obstructions)}) < len(given) or len(plain) + len(numbers) != len(given):
        return None
    return rest, numbers


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


def _decode(data: bytes, name: str, of_table: OfTable | None = None) -> object:
    """Return the parsed text; errors give the line. ``of_table`` may replace an entry, to save memory."""
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        raise ObstructionFileError(name, f"not UTF-8 text (line {line})", hint=UTF8_HINT) from None
    if not text or text.isspace():
        raise ObstructionFileError(
            name, "the file is empty", hint='without obstructions, write {"version": 1, "obstructions": []}'
        )
    try:
        if not name.lower().endswith(".toml"):
            return json_values(text, of_table)
        values = toml_values(text)
    except ValueError as error:
        raise ObstructionFileError(name, str(error), hint=WHERE_HINT) from None
    if of_table is not None and isinstance(entries := values.get("obstructions"), list):
        for number, one in enumerate(entries):
            entries[number] = of_table(one) if isinstance(one, dict) else one
    return values


def _form(entry: ObstructionEntry, unit: str, folder: Path, read_mesh: ReadMesh) -> Form:
    scale = metres_per(unit)
    if entry.box is not None:
        return Box(_scaled(entry.box.min, scale), _scaled(entry.box.max, scale))
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
