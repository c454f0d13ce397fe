"""The data of the page as one document. Every page that a test opens is compared with the schema (``opened_pages``)."""

from __future__ import annotations

import base64
import json

import numpy as np
import pytest
from opened_pages import Opened, passed_proof, some_remarks, tiny_source
from pydantic import ValidationError

from bimvox.rendering.page.document import DOCUMENT, page_json, page_json_schema
from bimvox.rendering.page.page import page_of


def test_the_document_is_what_the_page_embeds():
    source = tiny_source(proof=passed_proof(), remarks=some_remarks())
    document, opened = json.loads(page_json(source)), Opened(page_of(source))
    numbers = base64.b64decode(document.pop("numbers"))
    assert document == opened.document
    code, offset, count = document["parts"][0]["boxes"]
    assert code == "u16"
    assert np.frombuffer(numbers, "<u2", count, offset).tolist() == opened.numbers([code, offset, count]).tolist()


def test_the_schema_describes_every_key_and_allows_no_other():
    rules = page_json_schema()
    for rule in [rules, *rules["$defs"].values()]:
        assert rule["additionalProperties"] is False
        assert rule["description"]
        assert all(value.get("description") for value in rule["properties"].values()), rule["title"]


def test_another_document_is_refused():
    document = json.loads(page_json(tiny_source()))
    DOCUMENT.model.model_validate_json(json.dumps(document))
    document["revisions"][0]["lifts"][0]["status"] = "done"
    document["parts"][0]["weight"] = 1.0
    del document["scales"]
    with pytest.raises(ValidationError) as caught:
        DOCUMENT.model.model_validate_json(json.dumps(document))
    assert {"parts.0.weight", "revisions.0.lifts.0.status", "scales"} <= {
        ".".join(map(str, one["loc"])) for one in caught.value.errors()
    }
