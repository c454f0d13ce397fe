"""One page a format, from its schema."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any

from bimvox_pipeline.schema import schema

from docs.reference.markdown import notice, prose, table

Document = dict[str, Any]
_Rows = list[tuple[str, ...]]


def format_pages() -> dict[str, str]:
    """Return the pages of all formats by path in ``docs``."""
    pages = {}
    for name, title in (
        ("site", "Site file"),
        ("crane", "Crane file"),
        ("obstructions", "Obstruction file"),
        ("sweep", "Sweep file"),
        ("grid", "Grid file"),
    ):
        pages[f"formats/{name}.md"] = _text(_schema_page(name, title))
    pages["formats/log.md"] = _text(_log_page())
    return pages


def _text(lines: Iterator[str]) -> str:
    return "\n".join(lines).rstrip() + "\n"


def _head(name: str, title: str) -> Iterator[str]:
    yield from [f"# {title}", "", notice(f"`bimvox schema {name}`"), ""]


def _schema_page(name: str, title: str) -> Iterator[str]:
    document = schema(name, plain_values=True)
    if not isinstance(document, dict):
        raise TypeError(f"the schema of {name} is no document")
    yield from _head(name, title)
    yield f"What it means, with examples: [formats](../formats.md). The JSON Schema: `bimvox schema {name}`."
    yield ""
    yield from _keys(document, document)
    for key in document.get("$defs", {}):
        definition = document["$defs"][key]
        if "properties" in definition:
            yield from [f"## {_anchor(key)}", ""]
            yield from _keys(definition, document)
    if "x-arrays" in document:
        rows: _Rows = [
            (f"`{key}`", f"`{array['dtype']}`", ", ".join(array["dimensions"]), f"`{json.dumps(array['fill_value'])}`")
            for key, array in document["x-arrays"].items()
        ]
        yield from ["## Arrays", "", *table(("array", "type", "dimensions", "nothing"), rows), ""]
        rows = [(str(value), label) for label, value in document["x-labels"].items()]
        yield from ["## Labels", "", *table(("value", "label"), rows), ""]


def _keys(definition: Document, document: Document) -> Iterator[str]:
    if definition.get("description"):
        yield from [prose(definition["description"]), ""]
    required = set(definition.get("required", ()))
    rows: _Rows = [
        (f"`{key}`", _kind(value, document), _default(key, value, required), prose(value.get("description", "")))
        for key, value in definition["properties"].items()
    ]
    yield from [*table(("key", "value", "default", "meaning"), rows), ""]


def _anchor(key: str) -> str:
    return key.removesuffix("Config").removesuffix("Entry")


def _default(key: str, value: Document, required: set[str]) -> str:
    if key in required and "const" not in value:
        return "required"
    default = value.get("default")
    return "" if default is None or default in ([], {}) or isinstance(default, dict) else f"`{json.dumps(default)}`"


def _kind(value: Document, document: Document) -> str:
    """Return in words what a value may be."""
    if "const" in value:
        return f"`{json.dumps(value['const'])}`"
    if "enum" in value:
        return ", ".join(f"`{json.dumps(choice)}`" for choice in value["enum"])
    if "$ref" in value:
        key = value["$ref"].rsplit("/", 1)[1]
        definition = document["$defs"][key]
        return (
            f"[{_anchor(key)}](#{_anchor(key).lower()})" if "properties" in definition else _kind(definition, document)
        )
    if choices := value.get("anyOf") or value.get("oneOf"):
        return " or ".join(_kind(choice, document) for choice in choices if choice.get("type") != "null")
    kind = value.get("type")
    if isinstance(kind, list):
        return " or ".join(kind)
    if kind == "array":
        return _list(value, document)
    if kind in ("number", "integer"):
        return " ".join([kind, *_bounds(value)])
    return {"string": "text", "boolean": "`true` or `false`", "object": "table"}.get(str(kind), str(kind))


def _list(value: Document, document: Document) -> str:
    few, many = value.get("minItems"), value.get("maxItems")
    inner = value.get("items") or (value.get("prefixItems") or [{"type": "value"}])[0]
    number = "list of"
    if many is not None:
        number = f"{many}" if few == many else f"{few or 0} to {many}"
    return f"{number} {_kind(inner, document)}" + ("s" if inner.get("type") in ("number", "integer") and many else "")


def _bounds(value: Document) -> Iterator[str]:
    for key, sign in (("minimum", "≥"), ("exclusiveMinimum", ">"), ("maximum", "≤"), ("exclusiveMaximum", "<")):
        if key in value and abs(value[key]) < 2**31:
            yield f"{sign} {value[key]:g}"


def _log_page() -> Iterator[str]:
    document = schema("log", plain_values=True)
    if not isinstance(document, dict):
        raise TypeError("the schema of the log is no document")
    yield from _head("log", "Log (MCAP)")
    yield f"Version {document['schema_version']}. What it means: [formats](../formats.md). "
    yield "As a document: `bimvox schema log --json`."
    yield ""
    rows: _Rows = [
        (f"`{topic['name']}`", f"`{topic['schema']}`", prose(topic["meaning"])) for topic in document["topics"]
    ]
    yield from ["## Topics", "", *table(("topic", "schema", "meaning"), rows), ""]
    rows = [(f"`{name}`" if "." in name else name, meaning) for name, meaning in document["attachments"].items()]
    yield from ["## Attachments", "", *table(("file", "meaning"), rows), ""]
    yield from ["## Metadata", "", ", ".join(f"`{key}`" for key in document["metadata"]) + ".", ""]
    yield from ["## The crane's commands", "", "```protobuf", document["proto"].rstrip(), "```", ""]
    for key, title in (("csv_samples", "CSV of samples"), ("csv_lifts", "CSV of lifts")):
        rows = [(f"`{column}`", meaning) for column, meaning in document[key].items()]
        yield from [f"## {title}", "", *table(("column", "meaning"), rows), ""]
