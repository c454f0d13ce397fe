"""The attributes of a grid file's group: format, frame, source and the table of parts."""

from __future__ import annotations

import dataclasses
import json
import math
from collections.abc import Mapping
from typing import Any, TypeGuard

from bimvox.errors import GridFileError
from bimvox.grid.frame import GridFrame
from bimvox.grid.labels import Label
from bimvox.grid.layout import FORMAT, VERSION, array_document
from bimvox.grid.voxel_grid import Part, VoxelGrid

_AGAIN = "create the grid again with bimvox voxelize MODEL"


def group_document(grid: VoxelGrid, shapes: Mapping[str, tuple[int, ...]]) -> dict[str, Any]:
    """Return the metadata of the group (``zarr.json``), including those of its arrays with these shapes."""
    attributes = {
        "Conventions": "CF-1.11",
        "format": FORMAT,
        "version": VERSION,
        "unit": "m",
        "voxel_size_m": grid.frame.voxel_size_m,
        "origin_m": list(grid.frame.origin_m),
        "source_origin_m": list(grid.origin_m),
        "source": dict(sorted(grid.source.items())),
        "georeference": dict(sorted(grid.georeference.items())),
        "parts": [dataclasses.asdict(part) | {"label": int(part.label)} for part in grid.parts],
    }
    # Not in the Zarr specification, but zarr and xarray look for it first: one document instead of eleven.
    consolidated = {
        "kind": "inline",
        "must_understand": False,
        "metadata": {key: array_document(key, shape) for key, shape in shapes.items()},
    }
    return {
        "zarr_format": 3,
        "node_type": "group",
        "attributes": attributes,
        "consolidated_metadata": consolidated,
    }


@dataclasses.dataclass(frozen=True, slots=True)
class Attributes:
    """The checked attributes; see :class:`bimvox.grid.voxel_grid.VoxelGrid` for what they mean."""

    frame: GridFrame
    origin_m: tuple[float, float, float]
    source: Mapping[str, str | float | bool]
    georeference: Mapping[str, str | float]
    parts: tuple[Part, ...]


def checked_attributes(document: Mapping[str, Any], name: str) -> Attributes:
    """Return the attributes of a group's metadata.

    Raises:
        GridFileError: If a key is wrong; the error names it.
    """
    attributes = document.get("attributes")
    if document.get("zarr_format") != 3 or document.get("node_type") != "group" or not isinstance(attributes, dict):
        raise GridFileError(name, "zarr.json: must be a Zarr v3 group with attributes")
    if attributes.get("format") != FORMAT:
        raise GridFileError(
            name,
            f"format: must be {FORMAT!r}",
            hint="this Zarr file is not from bimvox; name a grid made by bimvox voxelize",
        )
    version = attributes.get("version")
    if version != VERSION or isinstance(version, bool):
        older = isinstance(version, int) and version < VERSION
        hint = f"it is from an older bimvox: {_AGAIN}" if older else f"update bimvox, or {_AGAIN}"
        raise GridFileError(
            name, f"version: {version!r} cannot be read; this bimvox reads version {VERSION}", hint=hint
        )
    if attributes.get("unit") != "m":
        raise GridFileError(name, "unit: must be 'm'")
    size = attributes.get("voxel_size_m")
    if not _is_number(size) or not size > 0.0:
        raise GridFileError(name, "voxel_size_m: must be a positive number")
    return Attributes(
        GridFrame(_triple(attributes, "origin_m", name), float(size)),
        _triple(attributes, "source_origin_m", name),
        _plain_values(attributes, "source", name),
        _plain_values(attributes, "georeference", name),
        _parts(attributes, name),
    )


def _triple(attributes: Mapping[str, Any], key: str, name: str) -> tuple[float, float, float]:
    value = attributes.get(key)
    if not isinstance(value, list) or len(value) != 3 or not all(_is_number(n) for n in value):
        raise GridFileError(name, f"{key}: must be three numbers")
    x, y, z = (float(n) for n in value)
    return (x, y, z)


def _plain_values(attributes: Mapping[str, Any], key: str, name: str) -> dict[str, Any]:
    value = attributes.get(key)
    if not isinstance(value, dict) or not all(isinstance(item, str | float | int) for item in value.values()):
        raise GridFileError(name, f"{key}: must be an object of plain values")
    return value


def _parts(attributes: Mapping[str, Any], name: str) -> tuple[Part, ...]:
    from pydantic import TypeAdapter, ValidationError

    rows = attributes.get("parts")
    known = {field.name for field in dataclasses.fields(Part)}
    if not isinstance(rows, list):
        raise GridFileError(name, "parts: must be a list")
    for index, row in enumerate(rows):
        if not isinstance(row, dict):
            raise GridFileError(name, f"parts[{index}]: must be an object")
        if unknown := sorted(set(row) - known):
            raise GridFileError(name, f"parts[{index}].{unknown[0]}: unknown key")
        if row.get("label") not in list(Label):
            raise GridFileError(name, f"parts[{index}].label: {row.get('label')!r} is not a label")
    try:
        # As JSON: strict checking of Python values accepts only instances of the dataclass and the enumeration.
        parts = TypeAdapter(list[Part]).validate_json(json.dumps(rows), strict=True)
    except ValidationError as error:
        first = error.errors()[0]
        place, *fields = (str(step) for step in first["loc"])
        raise GridFileError(name, ".".join([f"parts[{place}]", *fields]) + f": {first['msg']}") from error
    return tuple(parts)


def _is_number(value: Any) -> TypeGuard[float]:
    """Return whether a value is a finite number; whole numbers in JSON may be too large for a float."""
    if not isinstance(value, int | float) or isinstance(value, bool):
        return False
    return abs(value) < 1e300 and not math.isnan(value)
