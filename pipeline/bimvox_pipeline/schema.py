"""The schemas of our file formats, as ``bimvox schema`` prints them."""

from __future__ import annotations

from typing import Any

from bimvox.errors import InputError

_DRAFT = "https://json-schema.org/draft/2020-12/schema"


def schema(name: str, *, plain_values: bool = False) -> dict[str, Any] | str:
    """Return the schema of a format.

    Args:
        name: ``site``, ``crane``, ``gear``, ``obstructions``, ``sweep``, ``grid``, ``log``, ``page`` or ``score``.
        plain_values: Return the log's schema as a document instead of the text of a ``.proto`` file.

    Returns:
        JSON Schema as a document; for the log a ``.proto`` file with the layout in its comments.

    Raises:
        InputError: If there is no such format.
    """
    if name == "site":
        from bimvox.site.config.site_config import site_json_schema

        return site_json_schema()
    if name == "crane":
        from bimvox.site.config.machine_file import machine_json_schema

        return machine_json_schema()
    if name == "gear":
        from bimvox.site.config.gear_file import gear_json_schema

        return gear_json_schema()
    if name == "obstructions":
        from bimvox.site.obstructions.file import obstructions_json_schema

        return obstructions_json_schema()
    if name == "sweep":
        from bimvox_pipeline.fleet.sweep_file import sweep_json_schema

        return sweep_json_schema()
    if name == "grid":
        return _grid_json_schema()
    if name == "log":
        from bimvox_pipeline.log_schema import log_schema, log_schema_json

        return log_schema_json() if plain_values else log_schema()
    if name == "page":
        from bimvox.rendering.page.schema import page_json_schema

        return page_json_schema()
    if name == "score":
        from bimvox.policy.score_document import score_json_schema

        return score_json_schema()
    hint = "known formats: site, crane, gear, obstructions, sweep, grid, log, page, score"
    raise InputError(f"there is no format {name!r}", hint=hint)


def _grid_json_schema() -> dict[str, Any]:
    """Return the JSON Schema of the attributes of a grid file's Zarr group, with a list of its arrays."""
    from pydantic import TypeAdapter

    from bimvox.grid.frame import Label
    from bimvox.grid.layout import ARRAYS, FORMAT, SUFFIX, VERSION
    from bimvox.grid.voxel_grid import Part

    part = TypeAdapter(Part).json_schema()
    part["properties"]["label"] = {"enum": [label.value for label in Label]}
    part["description"], meanings = _attributes_of(Part)
    for key, value in part["properties"].items():
        value["description"] = meanings[key]
    part.pop("$defs", None)
    part["additionalProperties"] = False
    metres = {"type": "array", "items": {"type": "number"}, "minItems": 3, "maxItems": 3}
    properties = {
        "Conventions": {"type": "string", "description": "of the attributes: CF"},
        "format": {"const": FORMAT},
        "version": {"const": VERSION},
        "unit": {"const": "m"},
        "voxel_size_m": {"type": "number", "exclusiveMinimum": 0, "description": "edge of a cell"},
        "origin_m": {**metres, "description": "lowest corner of cell (0, 0, 0)"},
        "source_origin_m": {**metres, "description": "what was subtracted from the source's coordinates"},
        "source": {
            "type": "object",
            "description": "its file: name, SHA-256, format, unit",
            "additionalProperties": {"type": ["string", "number", "boolean"]},
        },
        "georeference": {
            "type": "object",
            "description": "map conversion of an IFC file",
            "additionalProperties": {"type": ["string", "number"]},
        },
        "parts": {"type": "array", "items": {"$ref": "#/$defs/Part"}, "description": "the table of parts"},
    }
    return {
        "$schema": _DRAFT,
        "title": "Grid",
        "description": f"Attributes of the Zarr v3 group in a {SUFFIX} file.",
        "type": "object",
        "required": list(properties),
        "properties": properties,
        "$defs": {"Part": part},
        "x-labels": {label.name.lower(): label.value for label in Label},
        "x-arrays": {
            key: {
                "dtype": rule.dtype,
                "dimensions": list(rule.dimensions),
                "fill_value": rule.fill,
                "meaning": rule.attributes["long_name"],
            }
            for key, rule in ARRAYS.items()
        },
    }


def _attributes_of(kind: type) -> tuple[str, dict[str, str]]:
    """Return the description of a class and of each of its attributes from its docstring."""
    import inspect
    import re

    summary, _, attributes = inspect.getdoc(kind).partition("\n\nAttributes:\n")  # type: ignore[union-attr]
    entries = re.split(r"^    (?=\w+: )", attributes, flags=re.M)[1:]
    found = (re.sub(r"\s+", " ", entry).strip().partition(": ") for entry in entries)
    return summary, {name: meaning for name, _, meaning in found}
