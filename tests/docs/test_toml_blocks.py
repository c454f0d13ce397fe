"""The TOML of the docs is TOML, and has only tables and keys that its schema knows."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import tomlkit
from bimvox_pipeline.schema import schema
from doc_commands import DOCUMENTS, ROOT, blocks, name_of

import bimvox

FORMATS = ("site", "crane", "sweep")
BLOCKS = [
    pytest.param(block, id=f"{name_of(file)}-{n}")
    for file in DOCUMENTS
    for n, block in enumerate(blocks(name_of(file), "toml"))
]


def _keys_of_cranes(block: str) -> set[str]:
    cranes = tomllib.loads(block).get("crane", [])
    return {key for crane in (cranes if isinstance(cranes, list) else [cranes]) for key in crane}


def unknown_keys(value: Any, rule: dict[str, Any], definitions: dict[str, Any], at: str = "") -> Iterator[str]:
    """Yield the keys of a document, with their path, that no choice of its schema has."""
    if isinstance(value, list):
        for one in value:
            yield from unknown_keys(one, rule, definitions, at)
    elif isinstance(value, dict):
        tables = list(_tables(rule, definitions))
        for key, inner in value.items():
            rules = [table["properties"][key] for table in tables if key in table["properties"]]
            if tables and not rules and not any(table.get("additionalProperties") for table in tables):
                yield f"{at}{key}"
            for one in rules:
                yield from unknown_keys(inner, one, definitions, f"{at}{key}.")


def _tables(rule: dict[str, Any], definitions: dict[str, Any]) -> Iterator[dict[str, Any]]:
    if "$ref" in rule:
        yield from _tables(definitions[rule["$ref"].rsplit("/", 1)[1]], definitions)
    if "properties" in rule:
        yield rule
    for choice in (*rule.get("anyOf", ()), *rule.get("oneOf", ()), *rule.get("prefixItems", ())):
        yield from _tables(choice, definitions)
    if isinstance(rule.get("items"), dict):
        yield from _tables(rule["items"], definitions)


@pytest.mark.parametrize("block", BLOCKS)
def test_a_block_has_only_known_keys(block: str):
    found = tomllib.loads(block)
    unknown = {}
    for name in FORMATS:
        document = schema(name)
        assert isinstance(document, dict)
        unknown[name] = list(unknown_keys(found, document, document["$defs"]))
    assert not min(unknown.values(), key=len), unknown


def test_a_key_that_no_schema_has_is_found():
    document = schema("site")
    assert isinstance(document, dict)
    found = {"rules": {"clearance": 1.0}, "crane": [{"name": "north", "basis_m": [0, 0]}]}
    assert list(unknown_keys(found, document, document["$defs"])) == ["rules.clearance", "crane.basis_m"]


CRANES = [block for block in BLOCKS if {"base_m", "setup"} & _keys_of_cranes(str(block.values[0]))]


@pytest.fixture(scope="module")
def frame() -> dict[str, Any]:
    """The site that is guessed for the sample frame, as a document."""
    building = bimvox.read(ROOT / "sample_models" / "frame.ifc")
    return tomllib.loads(bimvox.guess_site(building).to_toml())


@pytest.mark.parametrize("block", CRANES)
def test_cranes_of_the_docs_stand_on_a_site(block: str, frame: dict[str, Any], tmp_path: Path):
    frame["model"]["path"] = str(ROOT / "sample_models" / "frame.ifc")
    site = tmp_path / "frame.site.toml"
    site.write_text(tomlkit.dumps({**frame, "crane": tomllib.loads(block)["crane"]}), "utf-8")
    assert bimvox.load_site(site)
