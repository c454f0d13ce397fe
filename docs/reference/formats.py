"""One page a format, from its schema."""

from __future__ import annotations

import json
import re
from collections import Counter
from collections.abc import Iterator, Mapping
from functools import cache
from typing import Any

from bimvox_pipeline.schema import schema

from docs.reference.markdown import prose, table

Document = dict[str, Any]
_Rows = list[tuple[str, ...]]


_PAGES = {
    "site": ("Site file", "[formats](../formats.md#site-file)"),
    "crane": ("Crane file", "[your own crane](../crane-file.md)"),
    "gear": ("Gear file", "[slings](../slings.md)"),
    "obstructions": ("Obstruction file", "[obstructions](../obstructions.md)"),
    "sweep": ("Sweep file", "[many sites](../scale.md#many-sites-seeds-and-what-ifs)"),
    "grid": ("Grid file", "[formats](../formats.md#grid)"),
    "log": ("Log (MCAP)", "[formats](../formats.md#log)"),
    "page": ("Data of the page", "[formats](../formats.md#log)"),
    "score": ("Score of a policy", "[for researchers](../start/researcher.md#how-to-compare)"),
}
"""The title of a format's page, and the pages that explain it."""
_SIGNS = {"minimum": "≥", "exclusiveMinimum": ">", "maximum": "≤", "exclusiveMaximum": "<"}
_NO_BOUND = 1e4
"""A bound from here on only keeps nonsense out: the pages leave it out."""
_HAS_UNIT = re.compile(r"_(m[23]?|s[23]?|h|kg|deg|rad|vox|[mn]s)$")
"""Names that say by their unit that a value is a number."""


def format_pages() -> dict[str, str]:
    """Return the pages of all formats by path in ``docs``."""
    return {f"formats/{name}.md": _text(_log_page() if name == "log" else _schema_page(name)) for name in _PAGES}


def _text(lines: Iterator[str]) -> str:
    return "\n".join(lines).rstrip() + "\n"


def _head(name: str) -> Iterator[str]:
    title, explained = _PAGES[name]
    yield from [f"# {title}", "", f"From `bimvox schema {name}`; explained in {explained}.", ""]


@cache
def _document(name: str) -> Document:
    found = schema(name, plain_values=True)
    if not isinstance(found, dict):
        raise TypeError(f"the schema of {name} is no document")
    return found


def _schema_page(name: str) -> Iterator[str]:
    document = _document(name)
    yield from _head(name)
    yield from ["If no kind of value is stated, a name with a unit, a bound or a default tells a number from text.", ""]
    yield from _keys(document, document)
    for key, definition in document.get("$defs", {}).items():
        if "properties" in definition and not _is_of_the_crane_file(key, document):
            yield from [f"## {_anchor(key)}", ""]
            yield from _keys(definition, document)
    if "x-arrays" in document:
        rows: _Rows = [
            (f"`{key}`", array["dtype"], ", ".join(array["dimensions"]), array["meaning"])
            for key, array in document["x-arrays"].items()
        ]
        yield from ["## Arrays", "", *table(("array", "type", "dimensions", "meaning"), rows), ""]
        labels = (f"{value} {label}" for label, value in document["x-labels"].items())
        yield f"Labels: {', '.join(labels)}."


def _is_of_the_crane_file(key: str, document: Document) -> bool:
    """Return whether a table of another file has the same meaning as one of the crane file, whose page describes it."""
    crane = _document("crane")
    return bool(document["title"] != crane["title"] and document["$defs"][key] == crane["$defs"].get(key))


def _keys(definition: Document, document: Document) -> Iterator[str]:
    if definition.get("description"):
        yield from [prose(definition["description"]), ""]
    keys: Document = definition["properties"]
    if whole := _with_the_same_keys(keys, document):
        shown = ", ".join(f"`{key}`" for key in keys)
        yield from [f"As in [{_anchor(whole)}](#{_anchor(whole).lower()}): {shown}.", ""]
        return
    classes = _by_class(keys)
    required = set(definition.get("required", ()))
    optional = [f"`{key}`" for key in keys if key not in required]
    elsewhere = _meanings_of_the_crane_file(document)
    if any(elsewhere.get(key, "") == value.get("description") for key, value in keys.items()):
        yield from ["Keys without a meaning here: [crane file](crane.md).", ""]
    if mostly := len(required) > 2 and len(required) > 2 * len(optional):
        yield from [f"Required: all{' but ' * bool(optional)}{', '.join(optional)}.", ""]
    for key, value in keys.items():
        if key not in classes:
            must = ", required" if key in required and not mostly else ""
            meaning = value.get("description", "")
            meaning = "" if meaning == elsewhere.get(key) else prose(meaning)
            kind = f"{_unless_obvious(key, value, document)}{must}{_default(value)}".removeprefix(", ")
            yield f"- `{key}`" + (f" ({kind})" if kind else "") + (f": {meaning}" if meaning else "")
    yield ""
    if classes:
        one = next(iter(classes.values()))
        heads = list(one["default"])
        rows: _Rows = [
            (f"`{key}`", *(f"{value['default'][head]:g}" for head in heads)) for key, value in classes.items()
        ]
        yield from [f"[Classes of work](../sequence.md#classes-of-work), each {_kind(one, document)}; defaults:", ""]
        yield from [*table(("key", *(f"`{head}`" for head in heads)), rows), ""]


def _meanings_of_the_crane_file(document: Document) -> dict[str, str]:
    """Return the meaning of every key of the crane file, for the page of another file."""
    crane = _document("crane")
    tables = () if document["title"] == crane["title"] else (*crane["$defs"].values(), crane)
    return {
        key: value["description"]
        for one in tables
        for key, value in one["properties"].items()
        if "description" in value
    }


def _with_the_same_keys(keys: Document, document: Document) -> str | None:
    """Return the name of a table that has all these keys with the same values, and more."""
    kinds = {key: _kind(value, document) for key, value in keys.items()}
    for name, other in document.get("$defs", {}).items():
        more = other.get("properties", {})
        if (
            len(keys) < len(more)
            and kinds.items() <= {key: _kind(value, document) for key, value in more.items()}.items()
        ):
            return str(name)
    return None


def _by_class(keys: Document) -> Document:
    """Return the keys whose values are tables of numbers, if there are several of the same kind."""
    found = {key: value for key, value in keys.items() if isinstance(value.get("default"), dict)}
    found = {key: value for key, value in found.items() if {type(one) for one in value["default"].values()} == {float}}
    kinds = Counter(value["$ref"] for value in found.values())
    return {key: value for key, value in found.items() if kinds[value["$ref"]] > 1}


def _anchor(key: str) -> str:
    return key.removesuffix("Config").removesuffix("Entry")


def _default(value: Document) -> str:
    default = value.get("default")
    if default is None or default in ([], {}) or isinstance(default, dict):
        return ""
    return f", default {default:g}" if isinstance(default, float) else f", default `{json.dumps(default)}`"


def _unless_obvious(key: str, value: Document, document: Document) -> str:
    """Return in words what a value may be; of plain values only what name and default do not say."""
    kind, default = _kind(value, document), value.get("default")
    if kind == "text" or (kind == "boolean" and isinstance(default, bool)):
        return ""
    kind = re.sub(r"\b((?:number|integer)s?) [≥>] [01](?= ≤|$)", r"\1", kind)
    kind = re.sub(r"^list of (number|integer)$", r"list of \1s", kind)
    is_number = _HAS_UNIT.search(key) or isinstance(default, int | float) or "≤" in kind
    return re.sub(r"^(number|integer) ?", "", kind) if is_number else kind


def _kind(value: Document, document: Document) -> str:
    """Return in words what a value may be."""
    if "const" in value:
        return f"`{json.dumps(value['const'])}`"
    if "enum" in value:
        return ", ".join(f"`{json.dumps(choice)}`" for choice in value["enum"])
    if "$ref" in value:
        key = value["$ref"].rsplit("/", 1)[1]
        definition = document["$defs"][key]
        if "properties" not in definition:
            return _kind(definition, document)
        page = "crane.md" if _is_of_the_crane_file(key, document) else ""
        return f"[{_anchor(key)}]({page}#{_anchor(key).lower()})"
    if choices := value.get("anyOf") or value.get("oneOf"):
        return " or ".join(_kind(choice, document) for choice in choices if choice.get("type") != "null")
    kind = value.get("type")
    if isinstance(kind, list):
        return " or ".join(kind)
    if kind == "array":
        return _list(value, document)
    if kind in ("number", "integer"):
        return " ".join([kind, *_bounds(value)])
    return {"string": "text", "object": "table"}.get(str(kind), str(kind))


def _list(value: Document, document: Document) -> str:
    """Return in words what a list may be: ``3 numbers``, or ``list of 2 numbers, at least 3``."""
    few, many = value.get("minItems") or 0, value.get("maxItems")
    inner = value.get("items") or (value.get("prefixItems") or [{"type": "value"}])[0]
    kind = _kind(inner, document)
    if many is not None and many < 10:
        if kind.startswith("`"):
            return f"{many if few == many else f'{few} or {many}'} of {kind}"
        number, _, bound = kind.partition(" ")
        return f"{many if few == many else f'{few} or {many}'} {number}s {bound}".rstrip()
    return f"list of {kind}" + (f", at least {few}" if few > 1 else "")


def _bounds(value: Document) -> Iterator[str]:
    bounds = {key: value[key] for key in _SIGNS if key in value and abs(value[key]) < _NO_BOUND}
    for key, bound in bounds.items():
        yield f"{_SIGNS[key]} {bound:g}"


def _log_page() -> Iterator[str]:
    document = _document("log")
    yield from _head("log")
    yield from [f"Version {document['schema_version']}.", ""]
    yield from ["## Topics", ""]
    yield from (f"- `{topic['name']}` (`{topic['schema']}`): {prose(topic['meaning'])}" for topic in document["topics"])
    yield from ["", "## Attachments", "", *_meanings(document["attachments"]), ""]
    yield from ["## Metadata", "", ", ".join(f"`{key}`" for key in document["metadata"]) + ".", ""]
    samples, lifts = document["csv_samples"], document["csv_lifts"]
    shared = {key for key, meaning in samples.items() if lifts.get(key) == meaning}
    yield from ["## CSV of samples", "", *_meanings(samples), ""]
    yield from ["## CSV of lifts", "", f"As above: {', '.join(f'`{key}`' for key in lifts if key in shared)}.", ""]
    yield from _meanings({key: meaning for key, meaning in lifts.items() if key not in shared})


def _meanings(entries: Mapping[str, str]) -> Iterator[str]:
    return (f"- `{name}`: {meaning}" for name, meaning in entries.items())
