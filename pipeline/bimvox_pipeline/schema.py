"""The schemas of our file formats, as ``bimvox schema`` prints them."""

from __future__ import annotations

import importlib
from operator import attrgetter
from typing import Any

from bimvox.errors import InputError
from bimvox.exporters.csv_json import DELIVERY_COLUMNS, LIFT, SAMPLE_COLUMNS
from bimvox.log import schema as topics

_DRAFT = "https://json-schema.org/draft/2020-12/schema"
_SCHEMAS = {
    "site": "bimvox.site.config.site_config:SiteConfig.file_schema",
    "crane": "bimvox.site.config.machine_file:MachineConfig.file_schema",
    "gear": "bimvox.site.config.gear_file:GearConfig.file_schema",
    "obstructions": "bimvox.site.obstructions.file:obstructions_json_schema",
    "sweep": "bimvox_pipeline.fleet.runs:sweep_json_schema",
    "grid": f"{__name__}:grid_json_schema",
    "log": f"{__name__}:log_schema",
    "page": "bimvox.rendering.page.document:page_json_schema",
    "score": "bimvox.policy.score:PolicyScore.file_schema",
    "sequence-score": "bimvox.library.sequences.score:SequenceScore.file_schema",
}
"""The function that makes each format's schema; its module is imported on use."""


def schema(name: str, *, plain_values: bool = False) -> dict[str, Any] | str:
    """Return the schema of a format: JSON Schema as a document; for the log a ``.proto`` file with its layout.

    With ``plain_values``, the log's schema is a document as well.

    Raises:
        InputError: If there is no such format.
    """
    if name not in _SCHEMAS:
        raise InputError(f"there is no format {name!r}", hint=f"known formats: {', '.join(_SCHEMAS)}")
    if name == "log" and plain_values:
        return log_schema_json()
    module, _, function = _SCHEMAS[name].partition(":")
    made: dict[str, Any] | str = attrgetter(function)(importlib.import_module(module))()
    return made


def grid_json_schema() -> dict[str, Any]:
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


# What ``bimvox schema log`` prints: the layout of the log and the definition of its own message.

_ATTACHMENTS = {
    topics.SITE_FILE: "the whole site: zip of JSON and .npy",
    topics.PLAN_FILE: "lifts, clashes, notes",
    topics.MOTION_FILE: "spans and phases of the motions; their samples are on /motions",
    topics.URDF_FILE: "the crane as a URDF robot",
    topics.CHART_FILE: "capacity over radius",
    topics.STEPS_FILE: "work that the crane does not do (elapsed time), and the crane's pauses (its clock)",
    topics.PROPS_FILE: "what holds each lifted part from its release on, its props, and when they go (elapsed time)",
    topics.CARRIED_OUT_FILE: "of `watch --traffic`: who moved, who decided, what happened",
    topics.REMARKS_FILE: "a list of `kind`, `severity`, `component`, `name`, `text`; not in segments of a watch",
    topics.LAYOUT_FILE: "panels for Foxglove-class viewers",
    "others": "the files that the plan was made from, by name",
}
_TOPICS = topics.topics_of(1, traffic=True)


def log_schema() -> str:
    """Return a .proto file with the layout of the log in its comments."""
    lines = [
        f"bimvox log, schema version {topics.SCHEMA_VERSION}",
        "",
        'MCAP, profile "", zstd chunks of 64 KiB. Times count from the start of the site\'s clock; log time equals',
        "publish time and never falls on a topic. Frame `site`: metres, z up, z = 0 at the top of the ground.",
        "",
        "Topics:",
        *(f"  {topic.name}  {topic.schema}\n      {topic.meaning}" for topic in _TOPICS),
        "",
        f"Metadata record `{topics.METADATA}`: {', '.join(sorted(topics.OWN_METADATA))};",
        "and what the plan was made with (seed, policy, hashes of the input files).",
        "",
        "Attachments:",
        *(f"  {name}  {meaning}" for name, meaning in _ATTACHMENTS.items()),
        "",
        "Columns of the CSV of samples (bimvox export --to csv):",
        *(f"  {name}  {meaning}" for name, meaning in SAMPLE_COLUMNS.items()),
        "",
        "Columns of the CSV of lifts:",
        *(f"  {name}  {meaning}" for name, meaning in LIFT.meanings.items()),
        "",
        "Columns of the CSV of deliveries, a row for each part:",
        *(f"  {name}  {meaning}" for name, meaning in DELIVERY_COLUMNS.items()),
    ]
    comment = "\n".join(f"// {line}".rstrip() for line in "\n".join(lines).split("\n"))
    return f"{comment}\n\n{topics.proto_file()}"


def log_schema_json() -> dict[str, object]:
    """Return the content of :func:`log_schema` as plain values."""
    return {
        "schema_version": topics.SCHEMA_VERSION,
        "topics": [{"name": topic.name, "schema": topic.schema, "meaning": topic.meaning} for topic in _TOPICS],
        "metadata": sorted(topics.OWN_METADATA),
        "attachments": _ATTACHMENTS,
        "csv_samples": SAMPLE_COLUMNS,
        "csv_lifts": LIFT.meanings,
        "csv_deliveries": DELIVERY_COLUMNS,
        "proto": topics.proto_file(),
    }
